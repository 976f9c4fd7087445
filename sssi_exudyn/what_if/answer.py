"""The answer of a what-if as ``whatif.json`` holds it, and in lines."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from sssi_exudyn.analysis.turns import find_turns
from sssi_exudyn.bodies.skier.chain import PRESCRIBED
from sssi_exudyn.core.choices import Keep
from sssi_exudyn.core.frames import GRAVITY, Array
from sssi_exudyn.results.summary import Provenance
from sssi_exudyn.what_if.intent import MOMENT, PLACE, SETTLING, SPEED
from sssi_exudyn.what_if.question import Played, Question, figures_tangents
from sssi_exudyn.what_if.solve import Solution

_IN_90: Final = 1.645
"""Standard deviations on either side of the mean that hold 90 % of a normal distribution."""
_FAR: Final = 1.0
"""m off the recorded path beyond which the path is not kept: gates are further apart, but a ski's width is not."""
_LEG: Final = 3.5
"""Body weights on one leg: chosen, above what a recorded run of a racer shows."""


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
class RunFigures:
    """One of the two runs: largest forces on the snow in body weights, energies in J at its end less at its start."""

    duration_s: float
    mean_speed_mps: float
    peak_force_bodyweights: float
    peak_leg_bodyweights: float
    residual_moment_rms_Nm: float
    kinetic_J: float
    gravity_J: float
    friction_J: float
    rest_J: float


@dataclass(frozen=True)
class WhatIf:
    """The answer.

    seconds_lost : at the end of the recorded path; null where the run does not come there
    seconds_low, seconds_high : 90 % interval from the covariance of the fit
    seconds_per_unit : its derivative by each number of the model, in the number's unit
    moment_unchanged_Nm : residual moment (rms) of the recorded movement on the asked model
    full_end_m, recorded_full_end_m : distance of the full model's centre of mass from the reduced one's at the end, of
        this run and of the recorded one; null where the full model was left out
    """

    format: Literal[1]
    recording: str
    keep: Keep
    changes: Mapping[str, str | float]
    skiable: bool
    reasons: tuple[str, ...]
    seconds_lost: float | None
    seconds_low: float | None
    seconds_high: float | None
    seconds_per_unit: Mapping[str, float]
    off_path_rms_m: float
    off_path_largest_m: float
    corrections: tuple[Departure, ...]
    joints: tuple[Departure, ...]
    moment_unchanged_Nm: float
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
    recording: str,
    changes: Mapping[str, str | float],
    fitted: tuple[tuple[str, ...], Array],
    ends: tuple[float | None, float | None],
    provenance: Provenance,
) -> WhatIf:
    """Return the answer.

    fitted : names (k,) of the recorded model's fitted numbers, and their covariance (k, k)
    ends : ``full_end_m`` and ``recorded_full_end_m`` of ``WhatIf``
    """
    question, played = solution.question, solution.played
    reference, off = question.as_recorded, off_path(question, played)
    lost = seconds_lost(question, played)
    names, covariance = fitted
    slopes = seconds_per_number(solution, names, frozenset(changes)) if np.isfinite(lost[-1]) else {}
    by_number = np.array([slopes.get(name, 0.0) for name in names])
    spread = _IN_90 * float(np.sqrt(by_number @ covariance @ by_number))
    corrections, joints = departures(solution)
    asked, recorded = run_figures(played), run_figures(reference)
    reasons = _reasons(solution, corrections, asked, off)
    end = _number(lost[-1])
    return WhatIf(
        format=1,
        recording=recording,
        keep=question.keep,
        changes=changes,
        skiable=not reasons,
        reasons=reasons,
        seconds_lost=end,
        seconds_low=None if end is None else end - spread,
        seconds_high=None if end is None else end + spread,
        seconds_per_unit=slopes,
        off_path_rms_m=float(np.sqrt(np.mean(off**2))),
        off_path_largest_m=float(np.max(np.abs(off))),
        corrections=corrections,
        joints=joints,
        moment_unchanged_Nm=_moment_rms(question.unchanged),
        recorded=recorded,
        asked=asked,
        turns=_turns(question, played, lost),
        rounds=solution.rounds,
        converged=solution.converged,
        full_end_m=ends[0],
        recorded_full_end_m=ends[1],
        provenance=provenance,
    )


def off_path(question: Question, played: Played) -> Array:
    """Return the distances (n,) m to the left of the recorded path at the samples."""
    apart, way = (played.figures - question.as_recorded.figures)[:, PLACE], question.way
    return np.asarray(apart[:, 1] * way[:, 0] - apart[:, 0] * way[:, 1])


def seconds_lost(question: Question, played: Played) -> Array:
    """Return by how much later (n,) s a run passes the lines across the recorded path at the samples; NaN where it
    does not within its time.
    """
    run, lost = played.run, np.full(len(question.samples), np.nan)
    for j, (place, way) in enumerate(zip(question.as_recorded.figures[:, PLACE], question.way, strict=True)):
        ahead = (run.com[:, :2] - place) @ way
        passed = np.flatnonzero((ahead[:-1] < 0.0) & (ahead[1:] >= 0.0))
        if len(passed):
            times = run.time[passed] - ahead[passed] * (run.time[passed + 1] - run.time[passed]) / (
                ahead[passed + 1] - ahead[passed]
            )
            lost[j] = times[np.argmin(np.abs(times - played.times[j]))] - question.samples[j]
    return lost


def seconds_per_number(solution: Solution, names: tuple[str, ...], changed: frozenset[str]) -> dict[str, float]:
    """Return the derivatives (s a unit) of the seconds lost at the end by numbers of the recorded model.

    The skier reacts: corrections and pace follow the numbers as the least squares say.  A number that was changed is
    that of the recorded run alone.
    """
    question, played = solution.question, solution.played
    moved = -figures_tangents(question.as_recorded, names, ())
    shared = [i for i, name in enumerate(names) if name not in changed]
    moved[..., shared] += figures_tangents(played, [names[i] for i in shared], ())
    if question.size:
        jacobian = solution.jacobian
        right = jacobian[: -question.size].T @ question.weighed(moved)
        reacted = -np.linalg.solve(jacobian.T @ jacobian, right)
        moved = moved + solution.by_unknown @ reacted
    by_speed = float(played.figures[-1, SPEED][0])
    along = np.einsum("c,ck->k", question.way[-1], moved[-1, PLACE])
    later = -along / by_speed
    if question.intent.paced:
        later = later + question.end_later(played) @ reacted
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


def run_figures(played: Played) -> RunFigures:
    """Return the figures of a run between its first and last sample."""
    run, prepared = played.run, played.prepared
    inside = run.time <= played.times[-1]
    weight = prepared.mass * GRAVITY
    speed2 = np.sum(run.com_velocity[inside] ** 2, axis=1)
    kinetic = 0.5 * prepared.mass * float(speed2[-1] - speed2[0])
    moved = run.com[inside]
    gravity = prepared.mass * float((moved[-1] - moved[0]) @ prepared.gravity)
    power = np.einsum("nsc,nsc->n", run.foot_friction[inside], run.foot_velocity[inside])
    friction = float(np.trapezoid(power, run.time[inside]))
    settled = inside & (run.time >= run.time[0] + SETTLING)
    return RunFigures(
        duration_s=float(played.times[-1] - run.time[0]),
        mean_speed_mps=float(np.mean(np.sqrt(speed2))),
        peak_force_bodyweights=float(run.foot_load[settled].sum(axis=1).max()) / weight,
        peak_leg_bodyweights=float(run.foot_load[settled].max()) / weight,
        residual_moment_rms_Nm=_moment_rms(played),
        kinetic_J=kinetic,
        gravity_J=gravity,
        friction_J=friction,
        rest_J=kinetic - gravity - friction,
    )


def _moment_rms(played: Played) -> float:
    settled = played.times >= played.times[0] + SETTLING
    return float(np.sqrt(np.mean(np.sum(played.figures[settled, MOMENT] ** 2, axis=1))))


def _reasons(solution: Solution, corrections: tuple[Departure, ...], asked: RunFigures, off: Array) -> tuple[str, ...]:
    reasons = [
        f"{part.name} of {part.largest:.3g} {part.unit} is beyond {part.limit:.3g} {part.unit}"
        for part in corrections
        if part.limit is not None and part.largest > part.limit
    ]
    if asked.peak_leg_bodyweights > _LEG:
        reasons.append(f"{asked.peak_leg_bodyweights:.1f} body weights on one leg are beyond {_LEG:g}")
    if solution.question.keep == "path" and np.max(np.abs(off)) > _FAR:
        reasons.append(f"the path is missed by {np.max(np.abs(off)):.1f} m")
    if not solution.converged:
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
    if answer.seconds_lost is None:
        seconds = "the run does not come to the end of the recorded path"
    else:
        word = "lost" if answer.seconds_lost >= 0.0 else "won"
        low, high = answer.seconds_low, answer.seconds_high
        seconds = f"{abs(answer.seconds_lost):.2f} s {word} (90 % interval of the loss {low:.2f} to {high:.2f} s)"
    departs = ", ".join(f"{part.name} {part.largest:.2g} {part.unit}" for part in answer.corrections)
    lines = [
        f"{answer.recording}, {asked}, keeping the {answer.keep}: {seconds}",
        f"departs from the captured posture by at most: {departs or 'nothing'}",
        f"off the recorded path: {answer.off_path_rms_m:.2f} m rms, {answer.off_path_largest_m:.2f} m at most",
        f"residual moment: {answer.recorded.residual_moment_rms_Nm:.0f} N m recorded, "
        f"{answer.moment_unchanged_Nm:.0f} unchanged, {answer.asked.residual_moment_rms_Nm:.0f} corrected",
    ]
    if answer.full_end_m is not None:
        lines.append(f"full model: {answer.full_end_m:.2f} m from the reduced one at the end")
    if not answer.skiable:
        lines.append(f"not skiable like this: {'; '.join(answer.reasons)}")
    return lines
