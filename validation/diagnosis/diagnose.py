"""Where a recording and its simulation part, what physics was left out, the extended model, and the proof.

``diagnose`` is the whole of it; what it gives becomes ``diagnosis.json`` by ``diagnosis_to_dict``.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from functools import partial
from typing import Final

import numpy as np

from sssi_exudyn.core.errors import SimulationDiverged
from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.noise import whiten
from sssi_exudyn.model.model import Model
from sssi_exudyn.motion.motion import Motion
from sssi_exudyn.recording.recording import Recording
from sssi_exudyn.runtime.cache import Cache
from sssi_exudyn.simulation.result import SimulationResult
from sssi_exudyn.validation.diagnosis.evidence import NoiseLevels, Whitener
from sssi_exudyn.validation.diagnosis.findings import (
    PHASES,
    STANDS_OUT,
    SURE,
    WORTH_NAMING,
    Diagnosis,
    Figures,
    Finding,
    Number,
    OwnAccount,
    Where,
)
from sssi_exudyn.validation.diagnosis.held_out import folds_of, held_out_error, held_out_errors, misfit, track_error
from sssi_exudyn.validation.diagnosis.hypotheses import OF_A_DAY
from sssi_exudyn.validation.diagnosis.missing_force import MissingForce, missing_force, placebos
from sssi_exudyn.validation.diagnosis.refit import Refit
from sssi_exudyn.validation.diagnosis.search import INTERVAL_90, Progress, Round, Searcher, Verdict, setting_of
from sssi_exudyn.validation.diagnosis.sentences import sentence_of
from sssi_exudyn.validation.measurements import Measurements

MOST_FINDINGS: Final = 3
ONCE_MORE: Final = 0.05
"""The same once something has been found: a second finding has to be more certain, as the first is no exact model."""


Accepted = tuple[Round, Verdict, Refit]
"""What was weighed, what was taken of it, and the fit with it."""


def diagnose(
    recording: Recording,
    motion: Motion,
    model: Model,
    *,
    full: bool = True,
    cache: Cache | None = None,
    say: Progress = lambda _fraction, _detail: None,
) -> Diagnosis:
    """Find what is missing from ``model`` to explain the recording.

    With ``full`` every fit is confirmed by the full model; without, all is judged by the reduced one.

    Raises ValueError without a GPS, and SimulationDiverged when the model cannot be simulated.
    """
    searcher = Searcher(setting_of(recording, motion, model), say, cache)
    first = base = searcher.first()
    result = None
    if full:
        say(None, "the full model")
        base, result = searcher.confirmed(base)
        first = base
    rounds = [searcher.round(base)]
    accepted: list[Accepted] = []
    while len(accepted) < MOST_FINDINGS:
        latest = rounds[-1]
        allowed = ONCE_MORE if accepted else STANDS_OUT
        best = latest.best
        if latest.nothing.probability > allowed or best.fit is None:
            break
        as_it_was, run = (searcher.levels, searcher.beyond), result
        searcher.levels = best.levels
        try:
            found = searcher.settled(best.fit)
            if full:
                say(None, f"the full model with {best.name}")
                found, run = searcher.confirmed(found)
            rounds.append(searcher.round(found))
        except SimulationDiverged as error:
            say(None, f"nothing more is looked for: with {best.name} {error}")
            searcher.levels, searcher.beyond = as_it_was
            break
        base, result = found, run
        accepted.append((latest, best, base))
    if len(accepted) > 1:
        names = [verdict.name for _, verdict, _ in accepted]
        levels = searcher.levels
        try:
            accepted = _weighed_again(searcher, accepted)
        except SimulationDiverged as error:
            say(None, f"what was found is not weighed again: {error}")
            searcher.levels = levels
        base = accepted[-1][2] if accepted else first
        if full:
            say(None, "the full model with all that was found")
            base, result = searcher.confirmed(base)
            accepted[-1:] = [(*each[:2], base) for each in accepted[-1:]]
        if sorted(names) != sorted(verdict.name for _, verdict, _ in accepted):
            rounds.append(searcher.round(base))
    return _told(recording.name, searcher, first, base, result, rounds, accepted)


def _weighed_again(searcher: Searcher, accepted: list[Accepted]) -> list[Accepted]:
    """Every finding weighed again beside the others; the last only when one of them has become another.

    What was said first was said while the others were still hidden: it may have stood for one of them, and its
    probability and its alternatives were those of a mixture.  What is superfluous beside the others goes.
    """
    said = [verdict for _, verdict, _ in accepted]
    names = sorted(verdict.name for verdict in said)
    for verdict in said:
        if verdict is said[-1] and sorted(each.name for _, each, _ in accepted) == names:
            break
        candidate = verdict.candidate
        at = next(i for i, (_, each, _) in enumerate(accepted) if each is verdict)
        if candidate is None or [each.name for _, each, _ in accepted].count(verdict.name) > 1:
            continue  # two of a name cannot be taken apart by it
        rest = [
            *accepted[:at],
            *((seen, each, searcher.without(fit, candidate)) for seen, each, fit in accepted[at + 1 :]),
        ]
        again = searcher.round(rest[-1][2] if rest else searcher.without(accepted[at][2], candidate))
        accepted = rest
        if again.nothing.probability <= STANDS_OUT and again.best.fit is not None:
            searcher.levels = again.best.levels
            accepted.append((again, again.best, searcher.settled(again.best.fit)))
    return accepted


def own_account(searcher: Searcher, fit: Refit, accepted: Sequence[Accepted] = ()) -> OwnAccount:
    """What other runs of its day are weighed with, from a fit with what was ``accepted``."""
    levels = searcher.levels
    shared = {hypothesis.name for hypothesis in OF_A_DAY}
    for _, verdict, _ in reversed(accepted):  # a second of a name goes before the first
        if verdict.name in shared and verdict.candidate is not None:
            fit = searcher.without(fit, verdict.candidate)
    own = OwnAccount(fit, searcher.scene(fit), searcher.account(fit), searcher.levels)
    searcher.levels = levels
    return own


def _told(
    name: str,
    searcher: Searcher,
    first: Refit,
    final: Refit,
    result: SimulationResult | None,
    rounds: list[Round],
    accepted: list[Accepted],
) -> Diagnosis:
    measurements = searcher.setting.measurements
    tracks = [searcher.of_the_track(fit) for fit in (first, *(fit for _, _, fit in accepted))]
    folds = folds_of(measurements, rounds[0].scene.transitions)
    shown = _figures(searcher, tracks, folds)
    missing, left = (
        missing_force(each.account, searcher.levels, each.scene, each.responses["unexplained_force"])
        for each in (rounds[0], rounds[-1])
    )
    findings = []
    for (each, best, _), (fit, _), before, after in zip(accepted, tracks[:-1], shown[:-1], shown[1:], strict=True):
        columns = placebos(each.scene, each.responses["unexplained_force"])
        residual = measurements.measured - fit.predicted
        errors = held_out_errors(fit, residual, measurements, tracks[-1][1], folds, columns)
        findings.append(_finding(each, best, final, missing, before, after, errors))
    verdict = _verdict(findings)
    return Diagnosis(
        recording=name,
        verdict=verdict,
        sentence=sentence_of(verdict, findings, first.model, final.model, missing, shown[0], shown[-1]),
        findings=tuple(findings),
        first=first,
        fit=final,
        result=result,
        noise=searcher.levels,
        missing=missing,
        left=left,
        rounds=tuple(rounds),
        figures=tuple(shown),
        measurements=measurements,
        residual_before=measurements.measured - tracks[0][0].predicted,
        residual_after=measurements.measured - tracks[-1][0].predicted,
        own=partial(own_account, searcher, final, accepted),
    )


def figures_as_it_is(recording: Recording, motion: Motion, model: Model) -> Figures:
    """The figures of ``model``, fitted, with nothing sought; by the reduced model.

    Raises ValueError without a GPS, and SimulationDiverged when the model cannot be simulated.
    """
    searcher = Searcher(setting_of(recording, motion, model), lambda _fraction, _detail: None)
    fit = searcher.first()
    folds = folds_of(searcher.setting.measurements, searcher.scene(fit).transitions)
    return _figures(searcher, [searcher.of_the_track(fit)], folds)[0]


def _figures(
    searcher: Searcher, tracks: list[tuple[Refit, Whitener]], folds: list[tuple[float, float]]
) -> list[Figures]:
    """Of each fit of the track; what the last of them leaves is the noise that all are held against."""
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


def _verdict(findings: Sequence[Finding]) -> str:
    if not findings:
        return "none"
    if any(f.kind == "unexplained" for f in findings):
        return "unexplained"
    return "explained" if all(f.probability >= SURE for f in findings) else "ambiguous"


def _finding(
    weighed: Round,
    verdict: Verdict,
    final: Refit,
    missing: MissingForce,
    before: Figures,
    after: Figures,
    placebos: Array,
) -> Finding:
    others = tuple(
        (v.name or "nothing", v.probability)
        for v in weighed.verdicts
        if v is not verdict and v.probability >= WORTH_NAMING
    )
    candidate = verdict.candidate
    assert candidate is not None
    numbers: dict[str, Number] = {}
    for names in (*candidate.amplitudes, *((name,) for name in candidate.places)):
        value, low, high = final.interval(names[0], INTERVAL_90)
        numbers[names[0].partition(".")[2]] = Number(value, low, high, final.model.about(names[0]).unit)
    window = _window(candidate.window, numbers, weighed)
    acting = window or (float(weighed.scene.run.time[0]), float(weighed.scene.run.time[-1]))
    return Finding(
        kind=verdict.kind,
        name=verdict.name,
        probability=verdict.probability,
        alternatives=others,
        where=None if window is None else _where(window, weighed),
        parameters=numbers,
        impulse=missing.impulse(acting) if verdict.kind != "sensor" else np.zeros(3),
        before=before,
        after=after,
        placebos=placebos,
        weighed=weighed,
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
    return Where(window[0], window[1], (distance[0], distance[1]), tuple(p for p in PHASES if p in met))


def _memory(residual: Array, measurements: Measurements, levels: NoiseLevels) -> float:
    """Correlation of neighbours in the track's residual once the noise's own memory is taken out."""
    blocks = measurements.blocks
    pairs = [whiten(measurements.fixes, residual[blocks[name]], levels.gps) for name in ("x", "y")]
    return float(np.mean([np.corrcoef(e[:-1], e[1:])[0, 1] for e in pairs]))
