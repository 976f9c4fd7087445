"""Kinematics and kinetics of a run: sample by sample, by turn and by phase.

Definitions are the paper's ("Quantitative analysis of turning technique").  Angles between directions are taken in the
snow's plane.  The inside of a turn is where its centre lies; the outside ski is the left one in a right turn.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any, Final, Literal

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sssi_exudyn.analysis.losses import loss_columns, losses
from sssi_exudyn.analysis.turns import Turn, Turns, find_turns
from sssi_exudyn.core.frames import GRAVITY, Array
from sssi_exudyn.core.rotations import lowpass
from sssi_exudyn.simulation.result import SIDES, SimulationResult

Mask = NDArray[np.bool_]
WHOLE: Final = "turn"
"""Name that replaces a phase's: the whole turn."""
FORCE_CUTOFF: Final = 6.0
"""Hz; the paper's filter of measured foot loads.  Simulated ones are filtered alike before their crossing is searched
for.
"""
RESIDUAL_MOMENT: Final = {"peak": (50.0, 75.0), "rms": (30.0, 50.0)}
"""N m; limits of a good and of an okay residual moment: OpenSim's user guide on residual reduction ("Evaluating your
results"; Hicks et al. 2015 give the same).
"""
VERDICTS: Final = ("good", "okay", "bad")
WEDGE_DEG: Final = 5.0
"""Angle between the skis above which they make a wedge: between the paper's beginner (9°) and intermediate (2°)."""
STANDING_SPEED: Final = 0.5
"""m/s below which a direction of travel has no meaning."""


@dataclass(frozen=True)
class Technique:
    """Figures of n samples; pairs are (left, right).

    speed : (n,) m/s of the centre of mass
    ski_angle : (n,) rad from the left ski's direction to the right one's, positive when the tips are together (wedge)
    steering_angle : (n, 2) rad from a foot's direction of travel to its ski's axis, anticlockwise from above
    inclination : (n,) rad from the snow's normal to the line from the middle of pressure to the centre of mass, in the
        plane across the direction of travel; positive to the left
    offset : (n, 2) m, distance of the centre of mass to the left of each ski's line
    load : (n, 2) N, the snow's normal force on each ski, filtered
    share : (n, 2) each ski's share of it; NaN where there is none
    total_force : (n,) N, sum of both
    snow_force : (n, 2) N, size of the snow's whole force on each ski, friction included, filtered
    """

    speed: Array
    ski_angle: Array
    steering_angle: Array
    inclination: Array
    offset: Array
    load: Array
    share: Array
    total_force: Array
    snow_force: Array


def technique(result: SimulationResult) -> Technique:
    """Compute the technique of a run; angles that need a direction of travel are NaN where the skier stands."""
    forward = result.foot_forward[..., :2]
    left_normal = np.stack([-forward[..., 1], forward[..., 0]], axis=-1)
    left_normal /= np.linalg.norm(left_normal, axis=-1, keepdims=True)
    velocity = result.com_velocity[:, :2]
    speed = np.linalg.norm(velocity, axis=1)
    foot_speed = np.linalg.norm(result.foot_velocity[..., :2], axis=-1)
    with np.errstate(invalid="ignore", divide="ignore"):
        direction = np.where(speed[:, None] > STANDING_SPEED, velocity / speed[:, None], np.nan)
    steering = _angle_between(result.foot_velocity[..., :2], forward)
    steering[foot_speed < STANDING_SPEED] = np.nan
    load = _lowpass(result.time, result.foot_load)
    pressing = np.maximum(load, 0.0)
    total = pressing.sum(axis=1)
    weight = np.divide(pressing, total[:, None], out=np.full_like(pressing, np.nan), where=total[:, None] > 0.0)
    middle = np.einsum("ns,nsk->nk", np.where(np.isfinite(weight), weight, 0.5), result.foot_position)
    arm = result.com - middle
    aside = -arm[:, 0] * direction[:, 1] + arm[:, 1] * direction[:, 0]
    return Technique(
        speed=np.linalg.norm(result.com_velocity, axis=1),
        ski_angle=_angle_between(forward[:, 0], forward[:, 1]),
        steering_angle=steering,
        inclination=np.arctan2(aside, arm[:, 2]),
        offset=np.einsum("nsk,nsk->ns", result.com[:, None, :2] - result.foot_position[..., :2], left_normal),
        load=load,
        share=weight,
        total_force=total,
        snow_force=np.linalg.norm(_lowpass(result.time, result.snow.force), axis=-1),
    )


@dataclass(frozen=True)
class Shift:
    """Time at which two curves of left and right cross near a transition: s after it, and in percent of the next turn.

    NaN where they do not cross within half a turn of it.
    """

    after: float
    percent: float


def shift(time: Array, left_minus_right: Array, turn: Turn) -> Shift:
    """Find the crossing (zero of ``left_minus_right`` (n,)) nearest to the turn's start, within half its duration."""
    above = left_minus_right >= 0.0
    before = np.flatnonzero(above[:-1] != above[1:])
    a, b = left_minus_right[before], left_minus_right[before + 1]
    crossings = time[before] + (time[before + 1] - time[before]) * a / (a - b) - turn.start
    near = crossings[np.abs(crossings) <= 0.5 * turn.duration]
    if not len(near):
        return Shift(float("nan"), float("nan"))
    after = float(near[np.argmin(np.abs(near))])
    return Shift(after, 100.0 * after / turn.duration)


@dataclass(frozen=True)
class Biomechanics:
    """A run's turns, the technique along it, and a table with one row a turn and phase (``WHOLE`` for the whole turn).

    The table's columns have their unit in their name; those of joints carry ``outside`` or ``inside``.
    """

    turns: Turns
    technique: Technique
    table: pd.DataFrame


def biomechanics(
    result: SimulationResult, skier_mass: float, inclination: float, turns: Turns | None = None
) -> Biomechanics:
    """Compute all figures of a run by turn and phase.

    Parameters
    ----------
    skier_mass : kg without boots and skis; joint moments are per kg of it, forces per its weight, as in the paper
    inclination : rad, of the slope
    turns : the run's turns where they are known; None: those of the path of its centre of mass
    """
    turns = find_turns(result.time, result.com) if turns is None else turns
    skiing, lost = technique(result), losses(result, inclination)
    rows = []
    for number, turn in enumerate(turns.turns, 1):
        for phase, (begin, end) in {WHOLE: (turn.start, turn.end), **turn.phases}.items():
            within = (result.time >= begin) & (result.time <= end)
            if np.count_nonzero(within) < 3:
                continue
            row: dict[str, Any] = {
                "turn": number,
                "side": turn.side,
                "phase": phase,
                "complete": turn.complete,
                "start_s": begin,
                "end_s": end,
                "duration_s": end - begin,
                **_path_figures(result, skiing, within, turns, turn),
                **_force_figures(skiing, within, turn, skier_mass),
                **_joint_figures(result, within, turn, skier_mass),
                **_work_figures(result, within),
                **loss_columns(lost, within),
            }
            if phase == WHOLE:
                row |= _shift_figures(result, skiing, turns, turn)
            rows.append(row)
    return Biomechanics(turns, skiing, pd.DataFrame(rows))


def label_turns(series: pd.DataFrame, turns: Turns) -> pd.DataFrame:
    """Add to a run's series the number of the turn (0: none), its side and its phase as columns."""
    number, side, phase = turns.labels(series["time_s"].to_numpy(dtype=float))
    return series.assign(turn=number.astype(int), turn_side=side, turn_phase=phase)


@dataclass(frozen=True)
class ResidualMoment:
    """The residual moment at the pelvis, and the bounds below which it is okay.

    peak_at_s : when it is largest; None in older files
    """

    peak_Nm: float | None = None
    rms_Nm: float | None = None
    peak_okay_below_Nm: float | None = None
    rms_okay_below_Nm: float | None = None
    verdict: Literal["good", "okay", "bad"] | None = None
    peak_at_s: float | None = None


def residual_moment(result: SimulationResult) -> ResidualMoment:
    """Compute the residual moment at the pelvis (N m), which nothing holds on a real skier: it measures consistency.

    There is no residual force: the pelvis' translations are free.  The verdict is by ``RESIDUAL_MOMENT``.
    """
    columns = [i for i, name in enumerate(result.moment_names) if name.startswith("pelvis_")]
    size = np.linalg.norm(result.joint_moments[:, columns], axis=1)
    figures = {"peak": float(np.max(size)), "rms": float(np.sqrt(np.mean(size**2)))}
    grades = [sum(figures[key] > bound for bound in bounds) for key, bounds in RESIDUAL_MOMENT.items()]
    return ResidualMoment(
        peak_Nm=figures["peak"],
        rms_Nm=figures["rms"],
        peak_okay_below_Nm=RESIDUAL_MOMENT["peak"][1],
        rms_okay_below_Nm=RESIDUAL_MOMENT["rms"][1],
        verdict=VERDICTS[max(grades)],
        peak_at_s=float(result.time[np.argmax(size)]),
    )


def residual_moment_vector(result: SimulationResult) -> Array:
    """Return the residual moment at the pelvis as one vector (n, 3) N m in the level frame.

    A moment Q of a coordinate is the vector's part along that coordinate's axis: rotation about gravity, list about the
    axis that points forward then, tilt about the one to the right after both.
    """
    names, coordinates = list(result.moment_names), list(result.coordinate_names)
    rotation, list_, tilt = (
        result.joint_moments[:, names.index(f"pelvis_{name}")] for name in ("rotation", "list", "tilt")
    )
    heading, leaning = (result.coordinates[:, coordinates.index(f"pelvis_{name}")] for name in ("rotation", "list"))
    forward = np.stack([np.cos(heading), np.sin(heading)], axis=1)
    left = np.stack([-forward[:, 1], forward[:, 0]], axis=1)
    across = -(tilt + np.sin(leaning) * rotation) / np.cos(leaning)
    level = list_[:, None] * forward + across[:, None] * left
    return np.column_stack([level, rotation])


HEADLINES: Final = (
    "duration_s",
    "mean_speed_mps",
    "turn_radius_m",
    "ski_angle_mean_deg",
    "steering_angle_mean_deg",
    "steering_angle_peak_deg",
    "edge_angle_outside_peak_deg",
    "inclination_peak_deg",
    "com_inside_both_share",
    "postural_shift_s",
    "postural_shift_percent",
    "load_shift_s",
    "load_shift_percent",
    "hip_flexion_outside_max_deg",
    "lateral_ratio_p90",
    "effective_friction",
    "energy_lost_J_per_kg_m",
    "air_share_of_losses",
)
"""Figures of the whole turn of which the summary gives mean and spread over complete turns."""

CONTROL: Final = (
    "outside_force_share",
    "total_force_bodyweights",
    "outside_snow_force_share",
    "snow_force_bodyweights",
)
"""Figures of the control phase: of the forces square to the snow, and of the whole forces, friction included."""


@dataclass(frozen=True)
class Spread:
    """Mean and standard deviation of a figure over the complete turns that have it."""

    mean: float | None = None
    sd: float | None = None
    turns: int | None = None


@dataclass(frozen=True)
class StretchFigures:
    """An interval without turns: ``stop``, ``traverse`` or ``fall``."""

    kind: str
    start_s: float
    end_s: float


@dataclass(frozen=True)
class TurnFigures:
    """The turns of a run in figures.

    each, control : figures over complete turns, by name: of the whole turn (``HEADLINES``), and of the control phase
        (``CONTROL``)
    peak_moments : N m/kg, the largest (and least) of each joint over all complete turns
    """

    count: int | None = None
    complete: int | None = None
    left: int | None = None
    right: int | None = None
    stretches: tuple[StretchFigures, ...] | None = None
    each: Mapping[str, Spread] | None = None
    control: Mapping[str, Spread] | None = None
    peak_moments: Mapping[str, float | None] | None = None


def turn_figures(analysis: Biomechanics) -> TurnFigures:
    """Return counts of turns, and mean and standard deviation of their figures over complete turns."""
    turns = analysis.turns
    figures = TurnFigures(
        count=len(turns.turns),
        complete=sum(turn.complete for turn in turns.turns),
        left=sum(turn.side == "left" for turn in turns.turns),
        right=sum(turn.side == "right" for turn in turns.turns),
        stretches=tuple(StretchFigures(s.kind, s.start, s.end) for s in turns.stretches),
    )
    if not figures.complete:
        return figures
    complete = analysis.table[analysis.table["complete"]]
    whole_turns, control_phases = (complete[complete["phase"] == phase] for phase in (WHOLE, "control"))
    peaks = [name for name in whole_turns.columns if name.endswith(("moment_max_Nm_per_kg", "moment_min_Nm_per_kg"))]
    return replace(
        figures,
        each=_spread(whole_turns, HEADLINES),
        control=_spread(control_phases, CONTROL),
        peak_moments={
            name: float(whole_turns[name].max() if "_max_" in name else whole_turns[name].min())
            for name in sorted(peaks)
        },
    )


def _spread(rows: pd.DataFrame, names: tuple[str, ...]) -> dict[str, Spread]:
    return {
        name: Spread(
            mean=float(rows[name].mean()),
            sd=float(rows[name].std()) if rows[name].count() > 1 else float("nan"),
            turns=int(rows[name].count()),
        )
        for name in names
    }


def _angle_between(first: Array, second: Array) -> Array:
    """Return the angle (…) from ``first`` (…, 2) to ``second`` (…, 2), anticlockwise, in (−π, π]."""
    cross = first[..., 0] * second[..., 1] - first[..., 1] * second[..., 0]
    return np.asarray(np.arctan2(cross, np.sum(first * second, axis=-1)))


def _lowpass(time: Array, values: Array) -> Array:
    """Filter ``values`` (n, …) to frequencies below ``FORCE_CUTOFF``.

    The steps of a run are even, except those that the solver had to cut.
    """
    if len(time) < 2:
        return values
    rate = (len(time) - 1) / float(time[-1] - time[0])
    return lowpass(values, rate, FORCE_CUTOFF) if rate > 2.0 * FORCE_CUTOFF else values


def _sides(turn: Turn) -> Iterator[tuple[str, int]]:
    """Yield ("outside", its index) and ("inside", its index) in pairs of (left, right)."""
    outside = SIDES.index("right" if turn.side == "left" else "left")
    yield "outside", outside
    yield "inside", 1 - outside


def _of_known(figure: Callable[[Array], Any], values: Array) -> float:
    """Return a figure of the values that are known, NaN where none is: a foot that stands has no steering angle."""
    known = values[np.isfinite(values)]
    return float(figure(known)) if known.size > 0 else float("nan")


def _path_figures(
    result: SimulationResult, skiing: Technique, rows: Mask, turns: Turns, turn: Turn
) -> dict[str, float]:
    inwards = 1.0 if turn.side == "left" else -1.0
    steering = np.degrees(np.abs(skiing.steering_angle[rows]))
    inside = inwards * skiing.offset[rows] > 0.0
    lean = np.degrees(inwards * skiing.inclination[rows])
    row = {
        "mean_speed_mps": float(np.mean(skiing.speed[rows])),
        "turn_radius_m": turns.radius(result.time[rows], result.com[rows]),
        "ski_angle_mean_deg": float(np.mean(np.abs(np.degrees(skiing.ski_angle[rows])))),
        "steering_angle_mean_deg": _of_known(np.mean, steering),
        "steering_angle_peak_deg": _of_known(np.max, steering),
        "inclination_mean_deg": _of_known(np.mean, lean),
        "inclination_peak_deg": _of_known(np.max, lean),
        "com_inside_both_share": float(np.mean(inside.all(axis=1))),
        "com_inside_one_share": float(np.mean(inside.sum(axis=1) == 1)),
    }
    for name, side in _sides(turn):
        edge = np.degrees(np.abs(result.edge_angle[rows, side]))
        row |= {
            f"steering_angle_{name}_mean_deg": _of_known(np.mean, steering[:, side]),
            f"edge_angle_{name}_mean_deg": float(np.mean(edge)),
            f"edge_angle_{name}_peak_deg": float(np.max(edge)),
        }
    return row


def _force_figures(skiing: Technique, rows: Mask, turn: Turn, mass: float) -> dict[str, float]:
    outside = dict(_sides(turn))["outside"]
    weights = skiing.total_force[rows] / (mass * GRAVITY)
    share = skiing.share[rows, outside]
    snow_force = skiing.snow_force[rows]
    return {
        "outside_force_share": _of_known(np.mean, share),
        "outside_snow_force_share": float(np.sum(snow_force[:, outside]) / np.sum(snow_force))
        if np.any(snow_force)
        else float("nan"),
        "snow_force_bodyweights": float(np.mean(snow_force.sum(axis=1))) / (mass * GRAVITY),
        "total_force_bodyweights": float(np.mean(weights)),
        "total_force_peak_bodyweights": float(np.max(weights)),
    }


def _joint_figures(result: SimulationResult, rows: Mask, turn: Turn, mass: float) -> dict[str, float]:
    """Return mean, least and largest of every angle (deg) and moment (N m/kg); legs and arms as outside and inside."""
    row: dict[str, float] = {}
    named = {f"_{SIDES[side][0]}": f"_{name}" for name, side in _sides(turn)}

    def add(name: str, values: Array, kind: str, unit: str) -> None:
        name = name[:-2] + named[name[-2:]] if name[-2:] in named else name
        for what, figure in (("mean", np.mean), ("min", np.min), ("max", np.max)):
            row[f"{name}_{kind}{what}_{unit}"] = float(figure(values))

    for index, name in enumerate(result.coordinate_names):
        if name in result.moment_names:
            add(name, np.degrees(result.coordinates[rows, index]), "", "deg")
    for index, name in enumerate(result.moment_names):
        add(name, result.joint_moments[rows, index] / mass, "moment_", "Nm_per_kg")
    return row


def _work_figures(result: SimulationResult, rows: Mask) -> dict[str, float]:
    time = result.time[rows]
    work = {name: float(energy[rows][-1] - energy[rows][0]) for name, energy in result.energy.items()}
    row = {f"work_{name}_J": value for name, value in work.items()}
    return row | {f"power_{name}_W": value / float(time[-1] - time[0]) for name, value in work.items()}


def _shift_figures(result: SimulationResult, skiing: Technique, turns: Turns, turn: Turn) -> dict[str, float]:
    """Return the shift of posture and of load at the transition into ``turn``; NaN where no turn precedes it."""
    before = any(other.end == turn.start for other in turns.turns)
    none = Shift(float("nan"), float("nan"))
    left, right = (result.coordinates[:, result.coordinate_names.index(f"hip_flexion_{side}")] for side in "lr")
    posture = shift(result.time, left - right, turn) if before else none
    force = shift(result.time, skiing.load[:, 0] - skiing.load[:, 1], turn) if before else none
    return {
        "postural_shift_s": posture.after,
        "postural_shift_percent": posture.percent,
        "load_shift_s": force.after,
        "load_shift_percent": force.percent,
    }
