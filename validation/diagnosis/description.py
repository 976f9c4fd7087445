"""What a search found, described: figures before and after each finding, where each acts, and the diagnosis as data."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np

from sssi_exudyn.analysis.turns import PHASES
from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.noise import whiten
from sssi_exudyn.validation.diagnosis.evidence import NoiseLevels, Whitener
from sssi_exudyn.validation.diagnosis.held_out import folds_of, held_out_error, held_out_errors, misfit, track_error
from sssi_exudyn.validation.diagnosis.hypotheses import BY_NAME
from sssi_exudyn.validation.diagnosis.missing_force import MissingForce, missing_force, placebos
from sssi_exudyn.validation.diagnosis.refit import Refit
from sssi_exudyn.validation.diagnosis.result import (
    Alternative,
    Change,
    Diagnosis,
    Evidence,
    Finding,
    ForceOverTime,
    Friction,
    FrictionChange,
    LatentForce,
    Noise,
    Number,
    Outcome,
    Placebos,
    Posterior,
    Stretch,
    TrackDistance,
    Vector,
    Where,
)
from sssi_exudyn.validation.diagnosis.search import INTERVAL_90, Round, Searcher, Verdict
from sssi_exudyn.validation.diagnosis.search_result import SURE, WORTH_NAMING, Figures
from sssi_exudyn.validation.diagnosis.sentences import sentence_of
from sssi_exudyn.validation.measurements import Measurements

Accepted = tuple[Round, Verdict, Refit]
"""A round, what was taken of it, and the fit with it."""


def describe(
    recording: str,
    searcher: Searcher,
    first: Refit,
    final: Refit,
    rounds: Sequence[Round],
    accepted: Sequence[Accepted],
) -> tuple[Diagnosis, tuple[Figures, ...]]:
    """The diagnosis of a recording of that name, and the figures of the fit without anything and with each finding."""
    measurements = searcher.setting.measurements
    tracks = [searcher.of_the_track(fit) for fit in (first, *(fit for _, _, fit in accepted))]
    folds = folds_of(measurements, rounds[0].scene.transitions)
    figures = figures_of(searcher, tracks, folds)
    before, after = (
        missing_force(each.account, searcher.levels, each.scene, each.responses["unexplained_force"])
        for each in (rounds[0], rounds[-1])
    )
    findings = []
    for (each, best, _), (fit, _), worse, better in zip(accepted, tracks[:-1], figures[:-1], figures[1:], strict=True):
        columns = placebos(each.scene, each.responses["unexplained_force"])
        residual = measurements.measured - fit.predicted
        errors = held_out_errors(fit, residual, measurements, tracks[-1][1], folds, columns)
        findings.append(_finding(each, best, final, before, _evidence(worse, better, errors)))
    verdict = _verdict(findings)
    diagnosis = Diagnosis(
        format=1,
        recording=recording,
        verdict=verdict,
        sentence=sentence_of(verdict, findings, first.model, final.model, figures[0], figures[-1]),
        findings=tuple(findings),
        friction=FrictionChange(_friction(first), _friction(final)),
        noise=_noise(searcher.levels),
        weighed=tuple(tuple(_posterior(v) for v in each.verdicts) for each in rounds),
        stands_out=tuple(
            Stretch(begin, end, _vector(before.impulse((begin, end)))) for begin, end in before.stretches()
        ),
        latent_force=LatentForce(_over_time(before), _over_time(after)),
        track_distance=_distance(measurements, tracks[0][0], tracks[-1][0]),
    )
    return diagnosis, tuple(figures)


def figures_of(
    searcher: Searcher, tracks: Sequence[tuple[Refit, Whitener]], folds: list[tuple[float, float]]
) -> list[Figures]:
    """Of each fit of the track; the noise of all of them is what the last of them leaves."""
    measurements, covariance = searcher.setting.measurements, tracks[-1][1]

    def figures(fit: Refit) -> Figures:
        residual = measurements.measured - fit.predicted
        return Figures(
            track_error(residual, measurements),
            held_out_error(fit, residual, measurements, covariance, folds),
            misfit(residual, measurements, covariance, len(fit.values)),
            _memory(residual, measurements, searcher.levels),
        )

    return [figures(fit) for fit, _ in tracks]


def _verdict(findings: Sequence[Finding]) -> Outcome:
    if not findings:
        return "none"
    if any(f.kind == "unexplained" for f in findings):
        return "unexplained"
    return "explained" if all(f.probability >= SURE for f in findings) else "ambiguous"


def _finding(weighed: Round, verdict: Verdict, final: Refit, missing: MissingForce, evidence: Evidence) -> Finding:
    candidate, kind = verdict.candidate, BY_NAME[verdict.name].kind
    assert candidate is not None
    numbers: dict[str, Number] = {}
    for names in (*candidate.amplitudes, *((name,) for name in candidate.places)):
        value, low, high = final.interval(names[0], INTERVAL_90)
        numbers[names[0].partition(".")[2]] = Number(value, low, high, final.model.about(names[0]).unit)
    window = _window(candidate.window, numbers, weighed)
    acting = window or (float(weighed.scene.run.time[0]), float(weighed.scene.run.time[-1]))
    return Finding(
        kind=kind,
        name=verdict.name,
        probability=verdict.probability,
        alternatives=tuple(
            Alternative(v.name or "nothing", v.probability)
            for v in weighed.verdicts
            if v is not verdict and v.probability >= WORTH_NAMING
        ),
        where=None if window is None else _where(window, weighed),
        parameters=numbers,
        impulse_Ns=_vector(missing.impulse(acting)) if kind != "sensor" else (0.0, 0.0, 0.0),
        evidence=evidence,
    )


def _evidence(before: Figures, after: Figures, placebo_errors: Array) -> Evidence:
    return Evidence(
        trajectory_error_m=Change(before.trajectory_error, after.trajectory_error),
        held_out_error_m=Change(before.held_out_error, after.held_out_error),
        chi2_per_dof=Change(before.chi2_per_dof, after.chi2_per_dof),
        placebo_held_out_error_m=Placebos(
            float(np.min(placebo_errors)), float(np.median(placebo_errors)), tuple(placebo_errors.tolist())
        ),
        residual_memory=Change(before.whiteness, after.whiteness),
    )


def _window(
    sought: tuple[float, float] | None, numbers: dict[str, Number], weighed: Round
) -> tuple[float, float] | None:
    """When the finding acts, by its fitted places where it has some."""
    if sought is None:
        return None
    scene = weighed.scene
    if "t0" in numbers:
        return numbers["t0"].value, numbers["t1"].value
    if "f1" in numbers:
        return scene.passed(numbers["f0"].value), scene.passed(numbers["f1"].value)
    if "f0" in numbers:
        f0, reach = numbers["f0"].value, 2.0 * numbers["width"].value
        if "delta" in numbers:
            return scene.passed(f0), float(scene.run.time[-1])
        return scene.passed(f0 - reach), scene.passed(f0 + reach)
    return sought


def _where(window: tuple[float, float], weighed: Round) -> Where:
    run = weighed.scene.run
    way = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(run.com, axis=0), axis=1))])
    distance = [float(np.interp(t, run.time, way)) for t in window]
    edges = np.concatenate([[run.time[0]], weighed.scene.transitions, [run.time[-1]]])
    met = set()
    for begin, end in itertools.pairwise(edges):
        third = (end - begin) / 3.0
        for k, phase in enumerate(PHASES):
            low, high = begin + k * third, begin + (k + 1) * third
            if min(high, window[1]) - max(low, window[0]) > 0.25 * third:
                met.add(phase)
    return Where(window[0], window[1], (distance[0], distance[1]), "both", tuple(p for p in PHASES if p in met))


def _memory(residual: Array, measurements: Measurements, levels: NoiseLevels) -> float:
    """Correlation of neighbours in the track's residual once the noise's own correlation is taken out."""
    blocks = measurements.blocks
    pairs = [whiten(measurements.fixes, residual[blocks[name]], levels.gps) for name in ("x", "y")]
    return float(np.mean([np.corrcoef(e[:-1], e[1:])[0, 1] for e in pairs]))


def _friction(fit: Refit) -> Friction:
    return Friction(fit.model.friction.mu_t, fit.model.friction.mu_n)


def _noise(levels: NoiseLevels) -> Noise:
    return Noise(
        gps_sigma_m=levels.gps.sigma,
        gps_correlation_s=levels.gps.correlation_time,
        height_sigma_m=levels.height.sigma,
        load_sigma_N=levels.load.sigma,
        capture_sigma_deg=float(np.degrees(levels.capture)),
        height_correlation_s=levels.height.correlation_time,
        difference_sigma_N=levels.difference.sigma,
    )


def _posterior(verdict: Verdict) -> Posterior:
    evidence = verdict.log_evidence if np.isfinite(verdict.log_evidence) else None
    return Posterior(verdict.name or "nothing", verdict.probability, evidence, bool(verdict.name and verdict.fit))


def _over_time(missing: MissingForce) -> ForceOverTime:
    return ForceOverTime(
        edges_s=tuple(missing.edges.tolist()),
        force_N=tuple(_vector(each) for each in missing.force),
        band_N=tuple(_vector(each) for each in missing.band),
        stands_out=tuple((bool(along), bool(across), bool(normal)) for along, across, normal in missing.stands_out),
    )


def _distance(measurements: Measurements, first: Refit, final: Refit) -> TrackDistance:
    blocks = measurements.blocks

    def of(fit: Refit) -> tuple[float, ...]:
        residual = measurements.measured - fit.predicted
        return tuple(np.hypot(residual[blocks["x"]], residual[blocks["y"]]).tolist())

    return TrackDistance(tuple(measurements.fixes.tolist()), of(first), of(final))


def _vector(values: Array) -> Vector:
    first, second, third = (float(value) for value in values)
    return first, second, third
