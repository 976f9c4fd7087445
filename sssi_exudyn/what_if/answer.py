"""The answer of a what-if as ``whatif.json`` holds it, and in lines."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from sssi_exudyn.analysis.turns import find_turns
from sssi_exudyn.bodies.skier.chain import PRESCRIBED
from sssi_exudyn.core.choices import Keep
from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.noise import NORMAL_90
from sssi_exudyn.results.summary import Provenance
from sssi_exudyn.what_if.intent import PATH_SIGMA, PLACE, SPEED, STRICT_PATH_SIGMA
from sssi_exudyn.what_if.limits import (
    BALANCE,
    FAR,
    Imbalance,
    RunFigures,
    beyond,
    imbalance,
    moment_rms,
    out_of_balance,
    run_figures,
)
from sssi_exudyn.what_if.question import Played, Question, figures_tangents
from sssi_exudyn.what_if.solve import Solution

_LINEAR: Final = 0.1
"""Share of the run's time up to which seconds lost count as linear in the fitted numbers: chosen.  On 4 s losses by 23
and 54 % more friction are 0.20 and 0.56 s, a fifth more than linear at a seventh of the time."""


@dataclass(frozen=True)
class Departure:
    """How far the skier departs from the captured posture by one correction or in one joint; in ``unit``."""

    name: str
    unit: str
    largest: float
    rms: float
    limit: float | None = None


@dataclass(frozen=True)
class TurnChange:
    """One turn of the recorded run: seconds lost in it (below 0 won), and mean speeds of both runs (m/s)."""

    side: str
    start_s: float
    end_s: float
    lost_s: float | None
    recorded_mps: float
    asked_mps: float


@dataclass(frozen=True)
class Stricter:
    """The same question for a skier who keeps his path more strictly, to ``path_m`` (one standard deviation)."""

    path_m: float
    seconds_lost: float | None
    off_path_largest_m: float
    skiable: bool
    reasons: tuple[str, ...]


@dataclass(frozen=True)
class WhatIf:
    """The answer.

    compared_until_s : instant of the recorded run at whose place both runs are compared: its end, or the last place
        that the asked run comes to, where ``comes_to_the_end`` is false
    seconds_lost : at that place
    seconds_low, seconds_high : 90 % interval from the covariance of the fit, or null
    no_interval : why there is none; null where there is one
    stricter : what a stricter skier makes of it, as how strictly a path is kept has no source; null where none is
        kept so
    seconds_per_unit : derivative of ``seconds_lost`` by each number of the model, in the number's unit
    moment_unchanged_Nm : residual moment (rms) of the recorded movement on the asked model
    imbalance, imbalance_unchanged : largest departure from the recorded run's balance, of the answer and of the
        recorded movement on the asked model
    full_end_m, recorded_full_end_m : distance of the full model's centre of mass from the reduced one's at the end, of
        this run and of the recorded one; null where the full model was left out
    """

    format: Literal[1]
    recording: str
    keep: Keep
    changes: Mapping[str, str | float]
    skiable: bool
    reasons: tuple[str, ...]
    seconds_lost: float
    seconds_low: float | None
    seconds_high: float | None
    no_interval: str | None
    compared_until_s: float
    comes_to_the_end: bool
    stricter: Stricter | None
    seconds_per_unit: Mapping[str, float]
    off_path_rms_m: float
    off_path_largest_m: float
    corrections: tuple[Departure, ...]
    joints: tuple[Departure, ...]
    moment_unchanged_Nm: float
    imbalance: Imbalance
    imbalance_unchanged: Imbalance
    recorded: RunFigures
    asked: RunFigures
    turns: tuple[TurnChange, ...]
    rounds: int
    converged: bool
    full_end_m: float | None
    recorded_full_end_m: float | None
    provenance: Provenance


def answer_of(
    solution: Solution,
    strict: Solution | None,
    recording: str,
    changes: Mapping[str, str | float],
    fitted: tuple[tuple[str, ...], Array],
    ends: tuple[float | None, float | None],
    provenance: Provenance,
) -> WhatIf:
    """Return the answer.

    strict : solution of ``question.stricter()``; None where none is kept so
    fitted : names (k,) of the recorded model's fitted numbers, and their covariance (k, k)
    ends : ``full_end_m`` and ``recorded_full_end_m`` of ``WhatIf``
    """
    question, played = solution.question, solution.played
    reference, off = question.as_recorded, off_path(question, played)
    lost = seconds_lost(question, played)
    names, covariance = fitted
    slopes = seconds_per_number(solution, names, frozenset(changes))
    by_number = np.array([slopes[name] for name in names])
    spread = NORMAL_90 * float(np.sqrt(by_number @ covariance @ by_number))
    none = no_interval(solution, names, spread)
    corrections, joints = departures(solution)
    reasons = reasons_of(solution)
    last = last_passed(lost)
    end = float(lost[last])
    return WhatIf(
        format=1,
        recording=recording,
        keep=question.keep,
        changes=changes,
        skiable=not reasons,
        reasons=reasons,
        seconds_lost=end,
        seconds_low=end - spread if none is None else None,
        seconds_high=end + spread if none is None else None,
        no_interval=none,
        compared_until_s=float(question.samples[last]),
        comes_to_the_end=last == len(lost) - 1,
        stricter=None if strict is None else _stricter(strict),
        seconds_per_unit=slopes,
        off_path_rms_m=float(np.sqrt(np.mean(off**2))),
        off_path_largest_m=float(np.max(np.abs(off))),
        corrections=corrections,
        joints=joints,
        moment_unchanged_Nm=moment_rms(question.unchanged),
        imbalance=imbalance(question, played),
        imbalance_unchanged=imbalance(question, question.unchanged),
        recorded=run_figures(reference),
        asked=run_figures(played),
        turns=_turns(question, played, lost),
        rounds=solution.rounds,
        converged=solution.converged,
        full_end_m=ends[0],
        recorded_full_end_m=ends[1],
        provenance=provenance,
    )


def no_interval(solution: Solution, names: tuple[str, ...], spread: float) -> str | None:
    """Return why seconds lost that are uncertain by ``spread`` (s) have no interval; None where they have one.

    names : of the numbers that the fit gave a standard error
    """
    if reasons_of(solution):
        return "derivatives at a run beyond a skier's limits say nothing of what a skier would do"
    if not names:
        return "the recorded run has no fitted numbers whose errors are known"
    if spread > _LINEAR * float(solution.question.samples[-1] - solution.question.samples[0]):
        return "the errors of the fitted numbers are too large for derivatives, which hold for small changes"
    return None


def _stricter(strict: Solution) -> Stricter:
    lost, reasons = seconds_lost(strict.question, strict.played), reasons_of(strict)
    off = float(np.max(np.abs(off_path(strict.question, strict.played))))
    return Stricter(STRICT_PATH_SIGMA, _number(lost[-1]), off, not reasons, reasons)


def off_path(question: Question, played: Played) -> Array:
    """Return the distances (n,) m to the left of the path that is kept, at the samples."""
    apart, way = (played.figures - question.intended)[:, PLACE], question.way
    return np.asarray(apart[:, 1] * way[:, 0] - apart[:, 0] * way[:, 1])


def seconds_lost(question: Question, played: Played) -> Array:
    """Return by how much later (n,) s a run passes the lines across its path at the samples, than the recorded run did
    its own; NaN where it does not within its time.
    """
    run, lost = played.run, np.full(len(question.samples), np.nan)
    for j, (place, way) in enumerate(zip(question.intended[:, PLACE], question.way, strict=True)):
        ahead = (run.com[:, :2] - place) @ way
        passed = np.flatnonzero((ahead[:-1] < 0.0) & (ahead[1:] >= 0.0))
        if len(passed):
            times = run.time[passed] - ahead[passed] * (run.time[passed + 1] - run.time[passed]) / (
                ahead[passed + 1] - ahead[passed]
            )
            lost[j] = times[np.argmin(np.abs(times - played.times[j]))] - question.samples[j]
    return lost


def last_passed(lost: Array) -> int:
    """Return the last sample whose line across the recorded path a run passes; the first where it passes none."""
    return int(np.max(np.flatnonzero(np.isfinite(lost)), initial=0))


def seconds_per_number(solution: Solution, names: tuple[str, ...], changed: frozenset[str]) -> dict[str, float]:
    """Return the derivatives (s a unit) of the seconds lost by numbers of the recorded model.

    The skier reacts: corrections and pace follow the numbers as the least squares say.  A number that was changed is
    that of the recorded run alone.
    """
    if not names:
        return {}
    question, played = solution.question, solution.played
    lost = seconds_lost(question, played)
    last = last_passed(lost)
    # at its own pace the skier is at the line when the sample comes; otherwise he passes it at another sample
    passing = (
        last if question.intent.paced else int(np.argmin(np.abs(played.times - question.samples[last] - lost[last])))
    )
    recorded = question.on_path(figures_tangents(question.as_recorded, names, ()))
    asked = np.zeros_like(recorded)
    shared = [i for i, name in enumerate(names) if name not in changed]
    asked[..., shared] = figures_tangents(played, [names[i] for i in shared], ())
    if question.path is not None:
        asked = question.path.by_recorded_start(asked, names)
    later = np.zeros(len(names))
    if question.size:
        jacobian = solution.jacobian
        right = jacobian[: -question.size].T @ question.weighed(asked - recorded)
        reacted = -np.linalg.solve(jacobian.T @ jacobian, right)
        asked = asked + solution.by_unknown @ reacted
        later = question.later(played)[last] @ reacted
    along = np.einsum("c,ck->k", question.way[last], asked[passing, PLACE] - recorded[last, PLACE])
    later = later - along / float(played.figures[passing, SPEED][0])
    return dict(zip(names, later.tolist(), strict=True))


def departures(solution: Solution) -> tuple[tuple[Departure, ...], tuple[Departure, ...]]:
    """Return the corrections, and the joints that they turn."""
    question = solution.question
    amounts = question.amounts(solution.unknowns, question.nodes)
    corrections = tuple(
        _departure(correction.name, column, *correction.in_files, correction.limit)
        for correction, column in zip(question.intent.corrections, amounts.T, strict=True)
    )
    angles = question.added(solution.unknowns)
    joints = (
        _departure(name, column, "deg", float(np.degrees(1.0)))
        for name, column in zip(PRESCRIBED, angles.T, strict=True)
    )
    return corrections, tuple(joint for joint in joints if joint.largest > 0.0)


def _departure(name: str, column: Array, unit: str, factor: float, limit: float | None = None) -> Departure:
    largest, rms = float(np.max(np.abs(column))), float(np.sqrt(np.mean(column**2)))
    return Departure(name, unit, factor * largest, factor * rms, None if limit is None else factor * limit)


def reasons_of(solution: Solution) -> tuple[str, ...]:
    """Return why a run is not skiable like this; none where it is."""
    question, played = solution.question, solution.played
    reasons = []
    off = np.abs(off_path(question, played))
    if question.keep in ("path", "line") and np.max(off) > FAR:
        at = question.samples[np.argmax(off)]
        reasons.append(f"he misses the path by {np.max(off):.1f} m at {at:.1f} s (limit {FAR:g})")
    reasons += out_of_balance(imbalance(question, played))
    reasons += [
        f"{correction.departs.format(f'{part.largest:.2g} {part.unit}')} (limit {part.limit:.2g})"
        for correction, part in zip(question.intent.corrections, departures(solution)[0], strict=True)
        if part.limit is not None and part.largest > part.limit
    ]
    reasons += beyond(run_figures(played), run_figures(question.as_recorded), played.model.skier.sex)
    if not solution.converged and question.worth == 0.0:  # in a hurry, any run within the limits will do
        reasons.append("no balanced movement was reached")
    return tuple(reasons)


def _turns(question: Question, played: Played, lost: Array) -> tuple[TurnChange, ...]:
    reference = question.as_recorded
    turns = []
    for turn in find_turns(reference.run.time, reference.run.com).turns:
        first, last = (float(np.interp(at, question.samples, lost)) for at in (turn.start, turn.end))
        within = (question.samples >= turn.start) & (question.samples <= turn.end)
        if np.any(within):
            speeds = [float(np.mean(run.figures[within, SPEED])) for run in (reference, played)]
            turns.append(TurnChange(turn.side, turn.start, turn.end, _number(last - first), *speeds))
    return tuple(turns)


def _number(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def lines_of(answer: WhatIf) -> list[str]:
    """Return the answer in lines."""
    asked = ", ".join(f"{name} = {value}" for name, value in answer.changes.items()) or "nothing changed"
    until = "" if answer.comes_to_the_end else f" until {answer.compared_until_s:.1f} s"
    seconds = f"{_lost(answer.seconds_lost)}{until}"
    if answer.seconds_low is not None and answer.seconds_high is not None:
        seconds += f" (90 % interval of the loss {answer.seconds_low:.2f} to {answer.seconds_high:.2f} s)"
    else:
        seconds += " (without an interval)"
    hurry = ", as fast as the limits let him" if answer.keep == "line" else ""
    departs = ", ".join(f"{part.name} {part.largest:.2g} {part.unit}" for part in answer.corrections)
    lines = [
        f"{answer.recording}, {asked}, keeping the {answer.keep}{hurry}: {seconds}",
        f"departs from the captured posture by at most: {departs or 'nothing'}",
        _speeds(answer),
        f"off the path: {answer.off_path_rms_m:.2f} m rms, {answer.off_path_largest_m:.2f} m at most",
        f"out of the recorded run's balance by at most {answer.imbalance_unchanged.moment_Nm:.0f} N m unchanged, "
        f"{answer.imbalance.moment_Nm:.0f} corrected (limit {BALANCE:g})",
    ]
    strict = answer.stricter
    if strict is not None:
        cost = "does not come to the end" if strict.seconds_lost is None else _lost(strict.seconds_lost)
        doubt = "" if strict.skiable else f", not skiable like this: {'; '.join(strict.reasons)}"
        lines.insert(
            1, f"a skier who keeps the path to {strict.path_m:g} m in place of {PATH_SIGMA:g} m: {cost}{doubt}"
        )
    if answer.full_end_m is not None:
        lines.append(f"full model: {answer.full_end_m:.2f} m from the reduced one at the end")
    if answer.no_interval is not None:
        lines.append(f"no interval: {answer.no_interval}")
    if not answer.skiable:
        lines.append(f"not skiable like this: {'; '.join(answer.reasons)}")
    return lines


def _speeds(answer: WhatIf) -> str:
    """Return mean speeds, and what a turn costs on average, as a line."""
    speeds = f"mean speed: {answer.recorded.mean_speed_mps:.2f} m/s recorded, {answer.asked.mean_speed_mps:.2f} asked"
    lost = [turn.lost_s for turn in answer.turns if turn.lost_s is not None]
    if not lost:
        return speeds
    slower = [turn.recorded_mps - turn.asked_mps for turn in answer.turns if turn.lost_s is not None]
    change = float(np.mean(slower))
    speeds += (
        f"; a turn: {_lost(float(np.mean(lost)))} and {abs(change):.2f} m/s {'slower' if change >= 0 else 'faster'}"
    )
    return f"{speeds}, on average of {len(lost)}"


def _lost(seconds: float) -> str:
    return f"{abs(seconds):.2f} s {'lost' if seconds >= 0.0 else 'won'}"
