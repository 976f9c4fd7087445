"""What the form of a finding may be wrong by: how exactly a gust swells or a patch begins is unknown.

A finding moves the measurements by d.  So does, nearly, a force g at the centre of mass, cell by cell in time, found by
least squares in units of the noise, with a latent force's prior (``missing_force``):

    d = R g + e,   g ~ N(0, K)

The true effect is (1 + δ) g.  A second finding has to explain what δ of standard deviation ``Thresholds.form`` in every
cell and direction does not, neighbours included, as an effect may begin earlier or end later than was found.

Next to a force of any form a law counts by its evidence with all δ(t) that laws of its kind may be wrong by, as
simulated runs have them.  By its exact form alone, lift of 15 standard errors that comes and goes by 40 % was a force
of no known cause.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np
from scipy.ndimage import maximum_filter1d

from sssi_exudyn.core.frames import Array
from sssi_exudyn.fitting.evidence import Freedom, LinearModel, best_levels, log_evidence, whiten_columns
from sssi_exudyn.fitting.linear_fit import Refit, linear_values
from sssi_exudyn.fitting.noise import NoiseLevels, log_prior
from sssi_exudyn.validation.diagnosis.hypotheses.catalogue import LATENT_FORCE
from sssi_exudyn.validation.diagnosis.search.explanation import OtherForm, Refitted, Round
from sssi_exudyn.validation.diagnosis.search.missing_force import gain_of, latent_covariance
from sssi_exudyn.validation.diagnosis.state import Reestimate, linear_model
from sssi_exudyn.validation.diagnosis.thresholds import Thresholds

MOST_WRONG: Final = 0.4
"""Share of its force by which a law's form is wrong at most, standard deviation: ramps of gusts, edges of patches.  Any
share up to it is as probable."""
MEMORIES: Final = (0.3, 6.0)
"""s for which that error stays the same, at least and at most; any of their logarithm is as probable."""
_SHARES: Final = {0.5: 0.5, 1.0: 0.25}
"""Shares of ``MOST_WRONG`` that the evidence is averaged over, with their weights; the exact form has what is left."""
_TRIED_MEMORIES: Final = tuple(MEMORIES[0] * (MEMORIES[1] / MEMORIES[0]) ** part for part in (1 / 6, 1 / 2, 5 / 6))
"""s; the middle of each third of these memories."""
_WORTHWHILE: Final = 1.0
"""Gain of log evidence from which noise is sought again."""
_SEEN: Final = 0.98
"""Part of the variance of an error of form that its modes have; those of the shortest memory are most."""


def form_of(latest: Round, finding: Refitted) -> Freedom:
    """Return what the form of what a round found may be wrong by.

    A fault of an instrument is no force, and has none; a force that is more probably of any form than for a while has
    that.
    """
    if not finding.has_law and finding.other_form is not None and finding.other_form.share > 0.5:
        return finding.other_form.free
    by_force = latest.responses[LATENT_FORCE.name]
    if finding.hypothesis.kind == "sensor":
        return Freedom(np.zeros((len(by_force), 0)), np.zeros(0))
    moved, fitted = _moved_by(finding, finding.fit), latest.fitted
    return form_error(latest.linear, finding.levels, moved, by_force, fitted.time_edges, fitted.thresholds)


def _moved_by(finding: Refitted, fit: Refit) -> Array:
    """Return what a finding does to the measurements of its fit, (N,)."""
    of_finding = np.array([bool(finding.candidate.strengths & set(parameter.names)) for parameter in fit.parameters])
    return np.asarray(fit.sensitivity[:, of_finding] @ fit.pulls[of_finding])


def count_form_error(latest: Round, law: Refitted, about: Reestimate) -> Refitted:
    """Return a law with its log evidence averaged over what its form may be wrong by; only physics has such errors, and
    where no force of any form is asked for, none count.

    latest : the round in which it is compared;  about : the estimate with the law, by which it was weighed
    """
    has_errors = law.hypothesis.kind == "physics" and LATENT_FORCE.name in latest.responses
    if not has_errors or not np.isfinite(law.log_evidence):
        return law
    gain, form = wrong_form(latest, law, linear_model(about.problem, about.state, about.fit), about.fit)
    return replace(law, log_evidence=law.log_evidence + gain, other_form=form)


def wrong_form(latest: Round, law: Refitted, linear: LinearModel, fit: Refit) -> tuple[float, OtherForm]:
    """Return by how much the log evidence of a law grows that is averaged over what its form may be wrong by, and what
    the fit's numbers are with the most probable error.

    linear, fit : the run linearised about the law's estimate, and its fit there
    """
    fitted, by_force = latest.fitted, latest.responses[LATENT_FORCE.name]
    edges = fitted.time_edges
    moved = _moved_by(law, fit)
    force = _force_like(linear, law.levels, moved, by_force, edges, fitted.thresholds).reshape(3, -1)
    exact = log_evidence(linear, law.levels)
    forms: list[Freedom] = []
    gains, weights = [0.0], [1.0 - sum(_SHARES.values())]
    for memory in _TRIED_MEMORIES:
        modes = share_modes(0.5 * (edges[1:] + edges[:-1]), memory)
        parts = np.cumsum(np.sum(modes**2, axis=0)) / len(modes)
        modes = modes[:, : int(np.searchsorted(parts, _SEEN)) + 1]
        columns = by_force @ np.einsum("dc,cm->dcm", force, modes).reshape(force.size, -1)
        for share, weight in _SHARES.items():
            forms.append(Freedom(columns, np.full(columns.shape[1], share * MOST_WRONG)))
            gains.append(log_evidence(linear, law.levels, forms[-1]) - exact)
            weights.append(weight / len(_TRIED_MEMORIES))
    best, levels = 1 + int(np.argmax(gains[1:])), law.levels
    form = forms[best - 1]
    if gains[best] > _WORTHWHILE:  # what the exact form leaves over is then no noise
        calmer, value = best_levels(linear, levels, form)
        more = value - log_prior(linear.measurements.usual, levels) - exact
        if more > gains[best]:
            gains[best], levels = more, calmer
    evidence = np.log(weights) + gains
    gain = float(np.logaddexp.reduce(evidence))
    first = linear.free.columns.shape[1] - len(fit.parameters)
    bent = replace(linear, free=linear.free.with_more(form.columns, form.scales))
    values = linear_values(bent, levels, fit.parameters, first)
    return gain, OtherForm(1.0 - float(np.exp(evidence[0] - gain)), values, form)


def share_modes(middles: Array, memory: float) -> Array:
    """Return (c, c) the modes of a share of variance one that changes within ``memory`` (s), the largest first.

    middles : (c,) s of the cells
    """
    variances, axes = np.linalg.eigh(np.exp(-np.abs(middles[:, None] - middles) / memory))
    return np.asarray((axes * np.sqrt(np.maximum(variances, 0.0)))[:, ::-1])


def form_error(
    linear: LinearModel, levels: NoiseLevels, moved: Array, by_force: Array, edges: Array, thresholds: Thresholds
) -> Freedom:
    """Return what may vary next to a finding: (N, k) forces along the run in which it acts.

    moved : (N,) what the finding does to the measurements of ``linear``
    by_force : (N, 3·c) responses to a newton of a latent force in the cells between ``edges`` (c + 1,) s
    """
    force = _force_like(linear, levels, moved, by_force, edges, thresholds)
    size = maximum_filter1d(np.abs(force.reshape(3, -1)), 3, axis=1, mode="nearest").ravel()
    kept = size > thresholds.form_negligible * float(np.max(size, initial=0.0))
    return Freedom(np.asarray(by_force[:, kept]), thresholds.form * size[kept])


def _force_like(
    linear: LinearModel, levels: NoiseLevels, moved: Array, by_force: Array, edges: Array, thresholds: Thresholds
) -> Array:
    """Return the force (3·c,) N that does nearly what moves the measurements so; arguments as of ``form_error``."""
    prior = latent_covariance(edges, *thresholds.following_force, held=thresholds.cell)
    white = whiten_columns(linear, levels, np.column_stack([moved, by_force]))
    gram, pull = white[:, 1:].T @ white[:, 1:], white[:, 1:].T @ white[:, 0]
    return gain_of(prior, gram, pull)[0] @ pull
