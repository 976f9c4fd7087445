"""Ways in which a captured posture may be wrong, and what each does to the tables of a simulation.

Segments strapped with sensors are wrong by a constant and by something that wanders over seconds.  What of that moves
a run: each foot's turn about its three axes and its place under the pelvis, and the trunk's lean.  A way of being wrong
is a direction in the space of the skier's angles, one at each instant: the least change of a leg's five angles that
turns or shifts its foot so, and as little else as the joints allow.  So the same correction serves both tiers, the
joint moments and every export.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from functools import partial
from typing import Final

import numpy as np
from scipy.interpolate import BSpline, make_interp_spline

from sssi_exudyn.bodies.skier.chain import PRESCRIBED, jacobians
from sssi_exudyn.core.frames import Array, cross
from sssi_exudyn.motion.correction import PostureCorrection
from sssi_exudyn.motion.motion import Motion, relative_poses
from sssi_exudyn.simulation.assembly import Parts
from sssi_exudyn.simulation.posture_table import PostureTable
from sssi_exudyn.simulation.reduced.derivatives import TableChange
from sssi_exudyn.simulation.reduced.prepared import Prepared

TURNS: Final = ("roll", "pitch", "yaw")
SHIFTS: Final = {"forward": 3, "height": 5}
"""Where each stands among a foot's three turns and three shifts."""
LEANS: Final = ("trunk_forward", "trunk_sideways")
_LEG: Final = ("hip_flexion", "hip_adduction", "hip_rotation", "knee_angle", "ankle_angle")
_SIDES: Final = ("l", "r")
_HELD: Final = np.concatenate([np.full(3, np.radians(0.02)), [0.01, 0.01, 0.0005]])
"""rad and m: how strictly a direction of one kind leaves the foot as it is otherwise, its turns, its place along and
across the slope, its height."""
_BENT: Final = np.radians(5.0)
"""rad by which angles may change to keep it so."""
_SPACING: Final = 1.5
"""s between the supports of an error that wanders."""
_FAST: Final = 0.15
"""The same of one that changes within a second: what a capture filtered at 6 Hz still shows, and skis that hardly slip
answer to.
"""
_FURTHER: Final = 3
"""Instants about those at which a posture is other that second derivatives by differences change, and one more."""
_MOST: Final = {_SPACING: 24, _FAST: 120}
"""Supports at most, however long the run."""
_GRID: Final = 0.05
"""s between the instants at which directions are found and a correction is kept."""


@dataclass(frozen=True)
class PostureError:
    """One way in which the posture may be wrong.

    kind : of ``TURNS`` or ``SHIFTS`` of a foot, or of ``LEANS``; knee and ankle, hinges, let no foot shift sideways
    side : 0 left, 1 right; −1 for the trunk
    support : which B-spline over time; −1 for a constant
    sigma : its standard deviation, rad or m
    spacing : s between supports, longer where they would be too many
    """

    kind: str
    side: int
    support: int
    sigma: float
    spacing: float = _SPACING

    def middle(self, start: float, stop: float) -> float:
        """Return when (s) an error that wanders is greatest, in a run from ``start`` to ``stop`` (s)."""
        return float(_knots(start, stop, self.spacing)[self.support + 2])


@dataclass(frozen=True)
class Responses:
    """What a unit of one kind of error moves, at n instants, relative to the pelvis and in the slope frame.

    angles : (n, 28);  foot_place, foot_turn : (n, 2, 3) m, rad;  com : (n, 3) m;  exposed : (n, e, 3) m
    antenna : (n, 3) m
    """

    angles: Array
    foot_place: Array
    foot_turn: Array
    com: Array
    exposed: Array
    antenna: Array

    def part(self, rows: slice) -> Responses:
        """Return those at some of the instants."""
        return Responses(**{f.name: getattr(self, f.name)[rows] for f in fields(self)})

    def change(self, shape: Array) -> TableChange:
        """Return the tables of a posture that is other by a size times ``shape`` (n,) of the unit at all instants."""
        acting = np.flatnonzero(shape)
        first, last = (int(acting[0]), int(acting[-1])) if len(acting) else (0, 0)
        rows = slice(max(0, first - _FURTHER), last + 1 + _FURTHER)
        return TableChange(partial(_moved_tables, self.part(rows), shape[rows]), rows.start, rows.stop)


class PostureErrors:
    """The errors of one motion: their directions, and the tables that each changes."""

    def __init__(self, parts: Parts, prepared: Prepared, errors: tuple[PostureError, ...]) -> None:
        self.errors = errors
        self.time = prepared.time
        # as ``supports`` counts them: the tables end up to a step later
        self._ends = parts.motion.start, parts.motion.stop
        moving = PostureMap(parts, prepared.time)
        kinds = {(error.kind, error.side) for error in errors}
        self._responses = {kind: moving.responses(angles_of(*kind, moving.posture)) for kind in kinds}

    def profile(self, error: PostureError, time: Array) -> Array:
        """Return the error (n,) at ``time`` (n,), one where it is greatest."""
        return _profile(_knots(*self._ends, error.spacing), error.support, time)

    def change(self, error: PostureError) -> TableChange:
        """Return the tables that are wrong by a size (standard deviations)."""
        return self._responses[error.kind, error.side].change(error.sigma * self.profile(error, self.time))

    def angles(self, sizes: Array) -> Array:
        """Return the angles (n, 28) rad of all errors together at the tables' instants, ``sizes`` (errors,) in standard
        deviations.
        """
        shapes = {kind: np.zeros(len(self.time)) for kind in self._responses}
        for error, size in zip(self.errors, sizes, strict=True):
            shapes[error.kind, error.side] += size * error.sigma * self.profile(error, self.time)
        total = np.zeros((len(self.time), len(PRESCRIBED)))
        for kind, shape in shapes.items():
            total += shape[:, None] * self._responses[kind].angles
        return total

    def direction(self, error: PostureError) -> Array:
        """Return the angles (n, 28) rad of one standard deviation of the error."""
        shape = error.sigma * self.profile(error, self.time)
        return np.asarray(shape[:, None] * self._responses[error.kind, error.side].angles)


def supports(start: float, stop: float, spacing: float = _SPACING) -> int:
    """Return how many supports an error that wanders has from ``start`` to ``stop`` (s)."""
    return len(_knots(start, stop, spacing)) - 4


def errors_of(sizes: Mapping[str, tuple[float, float]], start: float, stop: float) -> tuple[PostureError, ...]:
    """Return errors of each kind, of both feet or the trunk, in a run from ``start`` to ``stop`` (s); none of size 0.

    sizes : standard deviations (rad or m) of a constant error and of one that wanders
    """
    errors = []
    for kind, (constant, wander) in sizes.items():
        for side in (-1,) if kind in LEANS else (0, 1):
            errors.append(PostureError(kind, side, -1, constant))
            errors += [PostureError(kind, side, i, wander) for i in range(supports(start, stop))]
    return tuple(error for error in errors if error.sigma > 0.0)


def fast_errors(sigma: float, start: float, stop: float) -> tuple[PostureError, ...]:
    """Return errors of both feet's yaw (rad) that change within a second, in a run from ``start`` to ``stop`` (s); none
    of size 0.
    """
    count = supports(start, stop, _FAST) if sigma > 0.0 else 0
    return tuple(PostureError("yaw", side, i, sigma, _FAST) for side in (0, 1) for i in range(count))


def _profile(knots: Array, support: int, time: Array) -> Array:
    """Return a constant profile (n,), or the cubic B-spline of that number, one at its greatest."""
    if support < 0:
        return np.ones(len(time))
    count = len(knots) - 4
    shape = BSpline(knots, np.eye(count)[support], 3)(np.clip(time, knots[3], knots[-4]))
    return np.asarray(1.5 * shape, dtype=np.float64)  # a whole B-spline is 2/3 at its middle


def grown(correction: PostureCorrection | None, time: Array, angles: Array) -> PostureCorrection:
    """Return the correction with ``angles`` (n, 28) rad at ``time`` (n,) added."""
    count = max(2, round((time[-1] - time[0]) / _GRID) + 1)
    grid = np.linspace(time[0], time[-1], count)
    more = np.stack([np.interp(grid, time, column) for column in angles.T], axis=1)
    if correction is not None:
        more = more + correction.at(grid)
    return PostureCorrection(grid, more)


def spline_knots(start: float, stop: float, spacing: float, most: int) -> Array:
    """Return the knots of cubic B-splines that together follow whatever changes over ``spacing`` (s), from ``start`` to
    ``stop`` (s); of ``most`` splines at most.
    """
    intervals = int(np.clip(round((stop - start) / spacing), 1, most - 3))
    step = (stop - start) / intervals
    return np.asarray(start + step * np.arange(-3, intervals + 4), dtype=np.float64)


def _knots(start: float, stop: float, spacing: float) -> Array:
    return spline_knots(start, stop, spacing, _MOST[spacing])


class PostureMap:
    """What angles move of the skier, computed on a coarse grid of instants and interpolated to those of the tables."""

    def __init__(self, parts: Parts, time: Array) -> None:
        self.time = time
        self.grid = np.linspace(time[0], time[-1], max(6, round((time[-1] - time[0]) / _GRID) + 1))
        self.posture = parts.posture(self.grid)
        self._antenna = _antenna_jacobian(parts.motion, self.grid)

    def responses(self, angles: Array) -> Responses:
        """Return what changes of ``angles`` (grid, 28) rad move, at the tables' instants."""
        posture = self.posture
        coarse = Responses(
            angles=angles,
            foot_place=np.einsum("nsck,nk->nsc", posture.foot_jacobian, angles),
            foot_turn=np.einsum("nsck,nk->nsc", posture.foot_turning, angles),
            com=np.einsum("nck,nk->nc", posture.com_jacobian, angles),
            exposed=np.einsum("neck,nk->nec", posture.exposed_jacobian, angles),
            antenna=np.einsum("nck,nk->nc", self._antenna, angles),
        )
        return Responses(
            **{
                f.name: make_interp_spline(self.grid, getattr(coarse, f.name), k=5)(self.time)
                for f in fields(Responses)
            }
        )


def angles_of(kind: str, side: int, posture: PostureTable) -> Array:
    """Return the angles (n, 28) that make a unit of an error of that kind and side, as ``PostureError`` has them."""
    n = len(posture.time)
    angles = np.zeros((n, len(PRESCRIBED)))
    if kind in LEANS:
        name = "lumbar_extension" if kind == "trunk_forward" else "lumbar_bending"
        angles[:, PRESCRIBED.index(name)] = -1.0 if kind == "trunk_forward" else 1.0
        return angles
    columns = [PRESCRIBED.index(f"{name}_{_SIDES[side]}") for name in _LEG]
    frame = posture.foot_rotation[:, side]
    wanted = np.zeros((n, 6))
    if kind in TURNS:
        wanted[:, :3] = frame[:, :, TURNS.index(kind)]
    else:
        wanted[:, SHIFTS[kind]] = 1.0
    # turns in the slope's axes, shifts along and across the ski as it lies on the slope
    level = level_axes(frame)
    shifts = np.einsum("nci,nck->nik", level, posture.foot_jacobian[:, side][:, :, columns])
    matrix = np.concatenate([posture.foot_turning[:, side][:, :, columns], shifts], axis=1)
    weighted = matrix / _HELD[:, None]
    normal = np.swapaxes(weighted, 1, 2) @ weighted + np.eye(len(columns)) / _BENT**2
    right = np.einsum("nij,ni->nj", weighted, wanted / _HELD)
    angles[:, columns] = np.linalg.solve(normal, right[..., None])[..., 0]
    return angles


def level_axes(frame: Array) -> Array:
    """Return axes (n, 3, 3) in columns, from feet (n, 3, 3): along the ski within the slope, to its left, and the
    slope's normal.
    """
    forward = frame[:, :2, 0] / np.linalg.norm(frame[:, :2, 0], axis=1, keepdims=True)
    axes = np.zeros((len(frame), 3, 3))
    axes[:, :2, 0] = forward
    axes[:, 0, 1], axes[:, 1, 1] = -forward[:, 1], forward[:, 0]
    axes[:, 2, 2] = 1.0
    return axes


def _antenna_jacobian(motion: Motion, time: Array) -> Array:
    """Return what each angle moves the antenna by, (n, 3, 28) m/rad."""
    if motion.antenna is None:
        return np.zeros((len(time), 3, len(PRESCRIBED)))
    poses, _ = relative_poses(motion, time)
    at = motion.antenna.segment
    place = poses.origin[:, [at]] + (poses.rotation[:, at] @ motion.antenna.offset)[:, None]
    _, linear = jacobians(poses, [at], place)
    return np.asarray(linear[:, 0, :, 3:])


def _moved_tables(responses: Responses, shape: Array, prepared: Prepared, size: complex) -> Prepared:
    """Return the tables of a posture that is wrong by ``size`` times ``shape`` (n,) times a unit of the error: to first
    order in the size, exact as a derivative.
    """

    def moved(unit: Array) -> tuple[Array, Array, Array]:
        place = unit * shape.reshape((-1, *(1,) * (unit.ndim - 1)))
        velocity = np.gradient(place, prepared.step, axis=0)
        return place, velocity, np.gradient(velocity, prepared.step, axis=0)

    turn, spin, _ = moved(responses.foot_turn)
    swing = spin + cross(turn, prepared.foot_spin)
    foot, foot_velocity, foot_acceleration = moved(responses.foot_place)
    com, com_velocity, com_acceleration = moved(responses.com)
    antenna, antenna_velocity, _ = moved(responses.antenna)
    _, exposed_velocity, _ = moved(responses.exposed)
    columns = np.moveaxis(prepared.foot_rotation, -1, 0)  # (3, n, 2, 3)
    turned = np.moveaxis(np.stack([cross(turn, column) for column in columns]), 0, -1)
    return replace(
        prepared,
        foot_place=prepared.foot_place + size * foot,
        foot_velocity=prepared.foot_velocity + size * foot_velocity,
        foot_acceleration=prepared.foot_acceleration + size * foot_acceleration,
        foot_rotation=np.ascontiguousarray(prepared.foot_rotation + size * turned),
        foot_spin=prepared.foot_spin + size * swing,
        foot_spin_rate=prepared.foot_spin_rate + size * np.gradient(swing, prepared.step, axis=0),
        com_place=prepared.com_place + size * com,
        com_velocity=prepared.com_velocity + size * com_velocity,
        com_acceleration=prepared.com_acceleration + size * com_acceleration,
        exposed_velocity=prepared.exposed_velocity + size * exposed_velocity,
        antenna=prepared.antenna + size * antenna,
        antenna_velocity=prepared.antenna_velocity + size * antenna_velocity,
    )
