"""What a search found, described: figures before and after each finding, where each acts, and the diagnosis as data."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Final

import numpy as np

from sssi_exudyn.analysis.turns import PHASES, find_turns
from sssi_exudyn.core.frames import Array
from sssi_exudyn.fitting.autocorrelated_noise import whiten
from sssi_exudyn.fitting.evidence import LinearModel
from sssi_exudyn.fitting.linear_fit import Refit
from sssi_exudyn.fitting.noise import NoiseLevels
from sssi_exudyn.fitting.observations import Measurements, Observation
from sssi_exudyn.fitting.posterior import Posterior
from sssi_exudyn.model.model import Model
from sssi_exudyn.recording.uncertainty import Uncertainty
from sssi_exudyn.runtime.provenance import source_digest, versions
from sssi_exudyn.validation.diagnosis.context import DiagnosisProblem
from sssi_exudyn.validation.diagnosis.diagnosis_data import (
    NOTHING_MISSING,
    Adequacy,
    Alternative,
    Change,
    Diagnosis,
    Evidence,
    Finding,
    ForceByFoot,
    ForceOverTime,
    Friction,
    FrictionChange,
    HeldOut,
    LatentForce,
    Likeness,
    Next,
    Noise,
    Number,
    Outcome,
    Placebos,
    SimilarRun,
    Stretch,
    TrackDistance,
    Vector,
    Version,
    Way,
    Weighed,
    Where,
)
from sssi_exudyn.validation.diagnosis.hypotheses.catalogue import BY_NAME, LATENT_FORCE
from sssi_exudyn.validation.diagnosis.hypotheses.hypothesis import FittedRun, Hypothesis
from sssi_exudyn.validation.diagnosis.search.averaged_friction import averaged_friction
from sssi_exudyn.validation.diagnosis.search.chance_findings import CHANCE_SEED, search_by_chance
from sssi_exudyn.validation.diagnosis.search.detectability import adequacy
from sssi_exudyn.validation.diagnosis.search.explanation import Explanation, Refitted, Round
from sssi_exudyn.validation.diagnosis.search.held_out_turns import (
    best_residual,
    folds_of,
    held_out_errors,
    misfit,
    track_error,
)
from sssi_exudyn.validation.diagnosis.search.missing_force import (
    PLACEBO_SEED,
    ForceOnFeet,
    MissingForce,
    missing_force,
    placebos,
)
from sssi_exudyn.validation.diagnosis.search.physical_limits import POSSIBLE_SEED
from sssi_exudyn.validation.diagnosis.search.search_result import Accepted, Figures
from sssi_exudyn.validation.diagnosis.state import State
from sssi_exudyn.validation.diagnosis.thresholds import THRESHOLDS, Thresholds
from sssi_exudyn.validation.diagnosis.wording.likeness import answer_of, likeness_sentence
from sssi_exudyn.validation.diagnosis.wording.next_measurement import next_measurements
from sssi_exudyn.validation.diagnosis.wording.paragraph import paragraph_of
from sssi_exudyn.validation.diagnosis.wording.sentence import sentence_of
from sssi_exudyn.validation.diagnosis.worlds.judge import WORLD_SEED

_PATH_POINTS: Final = 4
"""Points of the path in each cell of the missing force."""


def describe(
    recording: str,
    problem: DiagnosisProblem,
    state: State,
    first: Refit,
    final: Refit,
    rounds: Sequence[Round],
    accepted: Sequence[Accepted],
    estimates: tuple[Posterior, Posterior] | None,
) -> tuple[Diagnosis, tuple[Figures, ...]]:
    """Return the diagnosis of a recording of that name, and the figures of the fit without anything and with each
    finding.

    estimates : the first and the final model with all that is uncertain estimated; None where the search's fits do
    """
    before_model, after_model = (first, final) if estimates is None else estimates
    measurements, thresholds = problem.measurements, problem.thresholds
    lines = [rounds[0].linear, *(finding.linear for finding in accepted)]
    folds = folds_of(measurements, rounds[0].fitted.edge_changes)
    residuals = [best_residual(linear, state.levels) for linear in lines]
    left_out = [held_out_errors(linear, state.levels, folds)[:, 0] for linear in lines]
    figures = [
        figures_of(linear, state.levels, *errors) for linear, *errors in zip(lines, residuals, left_out, strict=True)
    ]
    distances = [_distance(measurements, residual) for residual in (residuals[0], residuals[-1])]
    if estimates is not None:  # what the model does that is written
        distances = [_distance(posterior.setting.seen, posterior.residual) for posterior in estimates]
        for i, posterior in ((0, estimates[0]), (-1, estimates[1])):
            figures[i] = replace(figures[i], trajectory_error=posterior.track_error)
    missing, left = (
        missing_force(searched.linear, state.levels, searched.fitted, searched.responses[LATENT_FORCE.name])
        for searched in (rounds[0], rounds[-1])
    )
    evidence = _evidence_of_each(accepted, lines, figures, state.levels, folds)
    findings = [
        _finding(finding.searched, finding.explanation, after_model, rounds[-1].fitted, missing, its)
        for finding, its in most_gain_first(accepted, evidence)
    ]
    near = adequacy(residuals[-1], measurements, thresholds)
    likeness = _likeness(rounds[-1], accepted)
    alike = likeness is None or likeness.alike
    verdict = verdict_of(findings, near, rounds[-1].nothing.probability, thresholds, alike=alike)
    models = before_model.model, after_model.model
    following = _next(rounds[-1], accepted, state.levels)
    diagnosis = Diagnosis(
        format=1,
        recording=recording,
        verdict=verdict,
        sentence=sentence_of(findings, verdict, rounds[-1], near, models, figures),
        findings=tuple(findings),
        friction=FrictionChange(_friction(before_model.model), _friction(after_model.model)),
        noise=_noise(state.levels, problem.about),
        weighed=tuple(tuple(_weighed(v) for v in searched.explanations) for searched in rounds),
        stands_out=tuple(
            Stretch(begin, end, _vector(missing.impulse((begin, end)))) for begin, end in missing.stretches()
        ),
        latent_force=LatentForce(_over_time(missing), _over_time(left)),
        track_distance=TrackDistance(tuple(measurements.fixes.tolist()), *distances),
        smallest_noticed=rounds[-1].noticed,
        adequacy=near,
        next=following,
        way=_way(rounds[-1].fitted),
        friction_averaged=averaged_friction(
            rounds[-1], [(finding.searched, finding.explanation) for finding in accepted], after_model
        ),
        version=_version(problem.hypotheses, thresholds),
        held_out=held_out_stretches(rounds[0].fitted, folds, left_out[0], left_out[-1]),
        paragraph=paragraph_of(findings, verdict, rounds[-1], near, models[1], figures, following),
        chance=search_by_chance(
            rounds[0].linear, rounds[0].nothing.levels, rounds[0].fitted, problem.hypotheses, rounds[0].responses
        ),
        likeness=likeness,
    )
    return diagnosis, tuple(figures)


def _likeness(last: Round, accepted: Sequence[Accepted]) -> Likeness | None:
    """Return what simulated runs had hidden that look like the recording without its least certain finding, or as it is
    where nothing was found.
    """
    judged = _least_certain(last, accepted).judgement
    if judged is None:
        return None
    thresholds = last.fitted.thresholds
    similar = SimilarRun(
        judged.similar.name,
        tuple(judged.edges.tolist()),
        tuple(_vector(force) for force in judged.similar.recorded),
        tuple(_vector(force) for force in judged.similar.simulated),
    )
    return Likeness(
        judged.runs,
        likeness_sentence(judged, thresholds),
        judged.probabilities,
        judged.outside,
        judged.outside >= thresholds.world_outside,
        about=judged.about,
        best_possible=judged.best_possible.get(answer_of(judged.about)),
        similar=similar,
    )


def _least_certain(last: Round, accepted: Sequence[Accepted]) -> Round:
    """Return the round of the least certain finding, the ``last`` one where nothing was found."""
    return min(accepted, key=lambda finding: finding.explanation.probability).searched if accepted else last


def _next(last: Round, accepted: Sequence[Accepted], levels: NoiseLevels) -> tuple[Next, ...]:
    """Propose what distinguishes the least certain finding or, where nothing was found, nothing from something."""
    if not accepted:
        unlikely = last.nothing.probability < last.fitted.thresholds.likely
        return next_measurements(last, last.nothing, levels) if unlikely else ()
    least = min(accepted, key=lambda finding: finding.explanation.probability)
    return next_measurements(least.searched, least.explanation, levels)


def figures_of(linear: LinearModel, levels: NoiseLevels, residual: Array, left_out: Array) -> Figures:
    """Return the figures of a fit, with everything that is uncertain where it is most probable: there it leaves
    ``residual`` (N,).

    left_out : (fixes,) m, its ``held_out_errors``
    """
    measurements = linear.measurements
    return Figures(
        track_error(residual, measurements),
        float(np.nanmean(left_out)),
        misfit(linear, levels),
        _memory(residual, measurements, levels),
    )


def verdict_of(
    findings: Sequence[Finding],
    near: Adequacy,
    nothing: float,
    thresholds: Thresholds = THRESHOLDS,
    *,
    alike: bool = True,
) -> Outcome:
    """Return the verdict on ``findings``, where nothing more is missing with the probability ``nothing``.

    A name is sure only where turns that were not fitted do not reject it.  Of a recording that is not ``alike`` any
    simulated run, nothing is said.
    """
    if not near.adequate or not alike or (not findings and nothing < thresholds.likely):
        return "not_adequate"
    if not findings:
        return "none"
    if any(_of_no_known_cause(f) > thresholds.unexplained for f in findings if f.kind == "unexplained"):
        return "unexplained"
    sure = all(
        f.probability >= thresholds.sure and f.kind != "unexplained" and not f.evidence.is_rejected_by_turns
        for f in findings
    )
    return "explained" if sure else "ambiguous"


def _of_no_known_cause(finding: Finding) -> float:
    """Return the probability that none of the known causes is behind it."""
    named = [(finding.name, finding.probability), *((a.name, a.probability) for a in finding.alternatives)]
    return sum(probability for name, probability in named if name in BY_NAME and BY_NAME[name].kind == "unexplained")


def _finding(
    searched: Round,
    explanation: Refitted,
    final: Refit | Posterior,
    fitted: FittedRun,
    missing: MissingForce,
    evidence: Evidence,
) -> Finding:
    """Return a finding of a round, with its numbers in the ``final`` model, of which ``fitted`` is a run.  Only with
    all findings is the skier where he was at each instant.
    """
    hypothesis, candidate, thresholds = explanation.hypothesis, explanation.candidate, fitted.thresholds
    numbers: dict[str, Number] = {}
    for names in (*candidate.amplitudes, *((name,) for name in candidate.places)):
        value, low, high = final.interval(names[0], thresholds.interval_90)
        about = final.model.about(names[0])
        numbers[names[0].key] = Number(value, low, high, about.unit, about.meaning)
    window = hypothesis.window(fitted, candidate, numbers)
    acting = window or (float(fitted.run.time[0]), float(fitted.run.time[-1]))
    return Finding(
        kind=hypothesis.kind,
        name=hypothesis.name,
        probability=explanation.probability,
        alternatives=tuple(
            Alternative(other.name, other.probability)
            for other in searched.explanations
            if other is not explanation and other.probability >= thresholds.worth_naming
        ),
        where=None if window is None else where_of(window, fitted),
        parameters=numbers,
        impulse_Ns=_vector(missing.impulse(acting)) if hypothesis.kind != "sensor" else (0.0, 0.0, 0.0),
        evidence=evidence,
        caption=hypothesis.caption,
    )


def most_gain_first(accepted: Sequence[Accepted], evidence: Sequence[Evidence]) -> list[tuple[Accepted, Evidence]]:
    """Return findings with the evidence of each, in the order in which they are read: those that were compared again
    come in any.
    """
    return sorted(zip(accepted, evidence, strict=True), key=lambda pair: pair[0].gain, reverse=True)


def _evidence_of_each(
    accepted: Sequence[Accepted],
    lines: Sequence[LinearModel],
    figures: Sequence[Figures],
    levels: NoiseLevels,
    folds: list[tuple[float, float]],
) -> list[Evidence]:
    """Return how much better the model meets the recording with each finding.

    lines, figures : of the model without any finding, and with each after the other
    """
    evidence = []
    for finding, linear, before, after in zip(accepted, lines[:-1], figures[:-1], figures[1:], strict=True):
        searched = finding.searched
        columns = placebos(searched.fitted, searched.responses[LATENT_FORCE.name])
        errors = np.nanmean(held_out_errors(linear, levels, folds, columns), axis=0)
        evidence.append(replace(_evidence(before, after, errors), force_explained=_force_explained(finding, levels)))
    return evidence


def _force_explained(finding: Accepted, levels: NoiseLevels) -> float | None:
    """Return the share that a finding explains of the energy of the force that its round misses; None of a fault."""
    searched = finding.searched
    if finding.explanation.hypothesis.kind == "sensor":
        return None
    before, after = (
        missing_force(linear, levels, searched.fitted, searched.responses[LATENT_FORCE.name]).energy
        for linear in (searched.linear, finding.linear)
    )
    return max(0.0, 1.0 - after / before) if before > 0.0 else None


def _evidence(before: Figures, after: Figures, placebo_errors: Array) -> Evidence:
    return Evidence(
        trajectory_error_m=Change(before.trajectory_error, after.trajectory_error),
        held_out_error_m=Change(before.held_out_error, after.held_out_error),
        chi2_per_dof=Change(before.chi2_per_dof, after.chi2_per_dof),
        placebo_held_out_error_m=Placebos(
            float(np.min(placebo_errors)), float(np.median(placebo_errors)), tuple(placebo_errors.tolist())
        ),
        residual_memory=Change(before.residual_memory, after.residual_memory),
    )


def where_of(window: tuple[float, float], fitted: FittedRun) -> Where:
    """Return where a ``window`` of time (s) of a run is: metres of its path, phases and turns."""
    run, covered = fitted.run, fitted.thresholds.phase_covered
    way = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(run.com, axis=0), axis=1))])
    distance = [float(np.interp(t, run.time, way)) for t in window]
    every = {
        number: [
            phase
            for phase, (begin, end) in turn.phases.items()
            if min(end, window[1]) - max(begin, window[0]) > covered * (end - begin)
        ]
        for number, turn in enumerate(find_turns(run.time, run.com).turns, 1)
    }
    met = {number: of_turn for number, of_turn in every.items() if of_turn}
    phases = tuple(phase for phase in PHASES if any(phase in of_turn for of_turn in met.values()))
    return Where(window[0], window[1], (distance[0], distance[1]), "both", phases, tuple(met))


def held_out_stretches(
    fitted: FittedRun, folds: Sequence[tuple[float, float]], before: Array, after: Array
) -> tuple[HeldOut, ...]:
    """Return each stretch that was left out, with its mean of the errors (fixes,) m before and after; it stands for the
    turn that it covers most of.
    """
    fixes, turns = fitted.measurements.fixes, find_turns(fitted.run.time, fitted.run.com).turns
    stretches = []
    for begin, end in folds:
        inside = (fixes >= begin) & (fixes < end)
        covered = [(min(end, turn.end) - max(begin, turn.start)) / turn.duration for turn in turns]
        number = next((count for count, share in enumerate(covered, 1) if share > fitted.thresholds.turn_covered), None)
        if np.any(inside):
            stretches.append(HeldOut(begin, end, number, float(np.mean(before[inside])), float(np.mean(after[inside]))))
    return tuple(stretches)


def _memory(residual: Array, measurements: Measurements, levels: NoiseLevels) -> float:
    """Return the correlation of neighbours in the track's residual once the noise's own correlation is taken out."""
    at = [measurements.blocks[name] for name in ("x", "y")]
    both = np.stack([residual[place] for place in at], axis=1)
    white = whiten(measurements.fixes, both, levels.gps, measurements.scale[at[0]])
    return float(np.mean([np.corrcoef(e[:-1], e[1:])[0, 1] for e in white.T]))


def _friction(model: Model) -> Friction:
    return Friction(model.friction.mu_t, model.friction.mu_n)


def _noise(levels: NoiseLevels, about: Uncertainty) -> Noise:
    return Noise(
        gps_sigma_m=levels.gps.sigma,
        gps_correlation_s=levels.gps.correlation_time,
        height_sigma_m=levels.height.sigma,
        load_sigma_N=levels.load.sigma,
        capture_sigma_deg=float(np.degrees(levels.posture * about.foot)),
        height_correlation_s=levels.height.correlation_time,
        difference_sigma_N=levels.difference.sigma,
    )


def _weighed(explanation: Explanation) -> Weighed:
    evidence = explanation.log_evidence if np.isfinite(explanation.log_evidence) else None
    refitted = isinstance(explanation, Refitted)
    return Weighed(explanation.name, explanation.probability, evidence, refitted, explanation.by_fits)


def _over_time(missing: MissingForce) -> ForceOverTime:
    return ForceOverTime(
        edges_s=tuple(missing.edges.tolist()),
        force_N=tuple(_vector(force) for force in missing.force),
        band_N=tuple(_vector(force) for force in missing.band),
        stands_out=tuple((bool(along), bool(across), bool(normal)) for along, across, normal in missing.stands_out),
        log_bayes_factor=missing.log_bayes_factor,
        by_foot=None if missing.on_feet is None else _by_foot(missing.on_feet),
    )


def _by_foot(missing: ForceOnFeet) -> ForceByFoot:
    def vectors(rows: Array) -> tuple[Vector, ...]:
        return tuple(_vector(row) for row in rows)

    force, band = missing.force, missing.band
    return ForceByFoot(
        left_N=vectors(force[:, 0]),
        left_band_N=vectors(band[:, 0]),
        right_N=vectors(force[:, 1]),
        right_band_N=vectors(band[:, 1]),
        log_bayes_factor=missing.log_bayes_factor,
    )


def _distance(measured: Measurements | Observation, residual: Array) -> tuple[float, ...]:
    """Return the horizontal distance (m) of each fix."""
    blocks = measured.blocks
    return tuple(np.hypot(residual[blocks["x"]], residual[blocks["y"]]).tolist())


def _way(fitted: FittedRun) -> Way:
    edges = fitted.time_edges
    parts = [np.linspace(a, b, _PATH_POINTS, endpoint=False) for a, b in pairwise(edges)]
    time = np.concatenate([*parts, edges[-1:]])
    f, l = (np.interp(time, fitted.run.time, fitted.run.com[:, axis]) for axis in range(2))  # noqa: E741
    return Way(tuple(time.tolist()), tuple(f.tolist()), tuple(l.tolist()))


def _version(hypotheses: Sequence[Hypothesis], thresholds: Thresholds) -> Version:
    priors = {hypothesis.name: hypothesis.weight for hypothesis in hypotheses}
    seeds = {"chance": CHANCE_SEED, "placebos": PLACEBO_SEED, "possible": POSSIBLE_SEED, "worlds": WORLD_SEED}
    return Version(versions()["sssi_exudyn"], {NOTHING_MISSING: thresholds.nothing, **priors}, source_digest(), seeds)


def _vector(values: Array) -> Vector:
    first, second, third = (float(value) for value in values)
    return first, second, third
