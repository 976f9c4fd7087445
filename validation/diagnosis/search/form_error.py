"""What the form of a finding may be wrong by: how exactly a gust swells or a patch begins is unknown.

A finding moves the measurements by d.  So does, nearly, a force g at the centre of mass, cell by cell in time, found by
least squares in units of the noise, with a latent force's prior (``missing_force``):

    d = R g + e,   g ~ N(0, K)

The true effect is (1 + δ) g, with δ of standard deviation ``Thresholds.form`` in every cell and direction, neighbours
included, as an effect may begin earlier or end later than was found.  A second finding has to explain what this does
not.
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import maximum_filter1d

from sssi_exudyn.core.frames import Array
from sssi_exudyn.fitting.evidence import Freedom, LinearModel, whiten_columns
from sssi_exudyn.fitting.noise import NoiseLevels
from sssi_exudyn.validation.diagnosis.hypotheses.catalogue import LATENT_FORCE
from sssi_exudyn.validation.diagnosis.search.explanation import Refitted, Round
from sssi_exudyn.validation.diagnosis.search.missing_force import latent_covariance
from sssi_exudyn.validation.diagnosis.thresholds import Thresholds


def form_of(latest: Round, finding: Refitted) -> Freedom:
    """Return what the form of what a round found may be wrong by.

    A fault of an instrument is no force, and has none; a force that is more probably of any form than for a while has
    that.
    """
    if finding.free_form is not None and finding.free_form.share > 0.5:
        return finding.free_form.free
    fit, by_force = finding.fit, latest.responses[LATENT_FORCE.name]
    if finding.hypothesis.kind == "sensor":
        return Freedom(np.zeros((len(by_force), 0)), np.zeros(0))
    of_finding = np.array([bool(finding.candidate.strengths & set(parameter.names)) for parameter in fit.parameters])
    moved = fit.sensitivity[:, of_finding] @ fit.pulls[of_finding]
    fitted = latest.fitted
    return form_error(latest.linear, finding.levels, moved, by_force, fitted.time_edges, fitted.thresholds)


def form_error(
    linear: LinearModel, levels: NoiseLevels, moved: Array, by_force: Array, edges: Array, thresholds: Thresholds
) -> Freedom:
    """Return what may vary next to a finding: (N, k) forces along the run in which it acts.

    moved : (N,) what the finding does to the measurements of ``linear``
    by_force : (N, 3·c) responses to a newton of a latent force in the cells between ``edges`` (c + 1,) s
    """
    prior = latent_covariance(edges, *thresholds.following_force, held=thresholds.cell)
    white = whiten_columns(linear, levels, np.column_stack([moved, by_force]))
    gram, pull = white[:, 1:].T @ white[:, 1:], white[:, 1:].T @ white[:, 0]
    force = np.linalg.solve(np.eye(len(prior)) + prior @ gram, prior @ pull)
    size = maximum_filter1d(np.abs(force.reshape(3, -1)), 3, axis=1, mode="nearest").ravel()
    kept = size > thresholds.form_negligible * float(np.max(size, initial=0.0))
    return Freedom(np.asarray(by_force[:, kept]), thresholds.form * size[kept])
