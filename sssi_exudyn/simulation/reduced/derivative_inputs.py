"""What changes in a run of the reduced model with the numbers by which it is differentiated, as its kernels take it.

Tables that NumPy computes are differentiated by a complex step: a number is given an imaginary part of ``STEP`` times
its change, and the result's imaginary part is the derivative, without the cancellation of a difference.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from sssi_exudyn.contact.codegen.compiled import parameter_values, place_parameters
from sssi_exudyn.contact.codegen.law_parameters import LawParameters
from sssi_exudyn.contact.term import Term
from sssi_exudyn.core.frames import Array
from sssi_exudyn.simulation.reduced.prepared import Prepared
from sssi_exudyn.simulation.ski_on_snow.structs import (
    ParameterColumns,
    PrescribedMotion,
    SnowGrid,
    TangentInputs,
)
from sssi_exudyn.terrain.surface import grid_patch, patch_under

STEP: Final = 1e-20
"""Of a complex step; its square is lost next to any number, so that nothing but the derivative is left."""
_SEEN: Final = ("antenna", "com_place", "com_velocity", "foot_place", "foot_velocity")
"""Tables that a run shows in addition to what is sought."""


@dataclass(frozen=True)
class Direction:
    """What changes with one number.

    parameter : where it stands among the laws' parameters, −1 for none of them
    values : the laws' parameters at which the derivative is taken; None for the run's own
    start : where it stands among place and velocity at the start (f, l, n, f, l, n), −1 for none of them
    surface : (nf + 2, nl + 2) m, change of the snow surface's coefficients; None where it does not change
    tables : the posture's tables with the number's complex step; None where they do not change
    leg : stiffness (1/s²) and damping (1/s) of the rise under legs that give
    first : instant of the run at which ``tables`` begin, 0 without them; outside them nothing changes
    """

    parameter: int = -1
    values: Array | None = None
    start: int = -1
    surface: Array | None = None
    tables: Prepared | None = None
    leg: tuple[float, float] = (0.0, 0.0)
    first: int = 0

    @property
    def rows(self) -> slice:
        """Instants of the run that ``tables`` are of, which must not be None."""
        assert self.tables is not None
        return slice(self.first, self.first + len(self.tables.time))

    def tables_at_start(self, at: Prepared) -> Prepared:
        """Return tables whose first row is that of the run's start, as the number changes it; ``at`` where it does
        not.
        """
        return at if self.tables is None or self.first > 0 else self.tables


def slope_of(value: Any) -> Any:
    """Return the derivative that a complex step has left in a number or an array."""
    return np.imag(value) / STEP


def rank(tables: Prepared | None) -> int:
    """Return 0 for tables of body and feet, 1 for those of the feet alone, 2 for none: the kernel's order."""
    if tables is None:
        return 2
    body = (tables.com_place, tables.com_velocity, tables.exposed_velocity)
    return 0 if any(np.any(np.imag(array)) for array in body) else 1


def columns_of(ranks: Sequence[int], most: int) -> int:
    """Return how many directions of such ranks there are up to the last that has ``most`` or less."""
    return max((k + 1 for k, own in enumerate(ranks) if own <= most), default=0)


def tangent_inputs(
    at: Prepared, ordered: Sequence[Direction], listed: ParameterColumns, by_parameter: Array, modes: int
) -> TangentInputs:
    """Return what the directions change, as the kernel takes it, without the start, which is left at zero.

    listed, by_parameter : of ``listed_parameters``
    """
    many, n, exposed = len(ordered), len(at.time), len(at.area)
    ranks = [rank(d.tables) for d in ordered]
    feet = np.zeros((n, 2, 18, columns_of(ranks, 1)))
    inertia = np.zeros((n, 3, feet.shape[3]))
    body = np.zeros((n, 6 + 3 * exposed, columns_of(ranks, 0)))
    mass, gravity = np.zeros(many), np.zeros((3, many))
    for k, direction in enumerate(ordered):
        if direction.tables is None:
            continue
        motion, rows = direction.tables.kernel_motion(), direction.rows
        mass[k], gravity[:, k] = slope_of(motion.mass), slope_of(motion.gravity)
        inertia[rows, :, k] = slope_of(motion.carried)
        parts = (
            motion.foot_place,
            motion.foot_velocity,
            _turn_rates(motion),
            motion.foot_spin,
            motion.ski_acceleration,
            motion.ski_turning,
        )
        for i, part in enumerate(parts):
            feet[rows, :, 3 * i : 3 * i + 3, k] = part if i == 2 else slope_of(part)
        if k < body.shape[2]:
            body[rows, :3, k], body[rows, 3:6, k] = slope_of(motion.com_place), slope_of(motion.com_velocity)
            body[rows, 6:, k] = slope_of(motion.exposed_velocity).reshape(-1, body.shape[1] - 6)
    moved = [(k, d.surface) for k, d in enumerate(ordered) if d.surface is not None]
    grids = np.stack([grid for _, grid in moved]) if moved else np.zeros((0, 2, 2))
    shaping = np.array([k for k, _ in moved], dtype=np.int64)
    leg = np.array([direction.leg for direction in ordered]).reshape(many, 2).T.copy()
    return TangentInputs(
        np.zeros(many, dtype=np.int64), listed, by_parameter,
        grids, shaping, mass, gravity, leg, np.zeros((3, many)), np.zeros((3, many)),
        np.zeros((2 * modes, many)), feet, inertia, body,
    )  # fmt: skip


def _turn_rates(motion: PrescribedMotion) -> Array:
    """Return rotation vectors (n, 2, 3) rad by which the feet turn with the number, from the matrices' complex step."""
    spin = slope_of(motion.foot_rotation) @ np.swapaxes(np.real(motion.foot_rotation), -1, -2)
    return np.stack([spin[..., 2, 1], spin[..., 0, 2], spin[..., 1, 0]], axis=-1)


def listed_parameters(terms: Sequence[Term], ordered: Sequence[Direction]) -> tuple[ParameterColumns, Array]:
    """Return the laws' parameters that change, and the change (c, d) of each with each number."""
    rows: dict[bytes, int] = {}
    values: list[Array] = []
    places: dict[tuple[int, int], list[int]] = {}
    for k, direction in enumerate(ordered):
        row = -1
        if direction.values is not None:
            row = rows.setdefault(direction.values.tobytes(), len(rows))
            values += [direction.values] if row == len(values) else []
        if direction.parameter >= 0:
            places.setdefault((row, direction.parameter), []).append(k)
    listed = sorted(places)
    changes = np.zeros((len(listed), len(ordered)))
    for column, place in enumerate(listed):
        changes[column, places[place]] = 1.0

    def of(kind: str) -> Any:
        known = place_parameters(terms, kind)
        return np.array([i for i, (_, p) in enumerate(listed) if p in known], dtype=np.int64)

    columns = ParameterColumns(
        index=np.array([p for _, p in listed], dtype=np.int64),
        values=np.array(values).reshape(len(values), len(parameter_values(terms))),
        row=np.array([row for row, _ in listed], dtype=np.int64),
        point=of("point"),
        foot=of("foot"),
        segment=of("segment"),
        body=of("body"),
        terrain=of("terrain"),
        edge=of("edge"),
    )
    return columns, changes


def place_at_start(at: Prepared, ordered: Sequence[Direction]) -> tuple[Array, Array]:
    """Return derivatives of the pelvis' place and velocity (3, d) at the start along the slope; the rest is left at
    zero.
    """
    place, velocity = np.zeros((2, 3, len(ordered)))
    for k, direction in enumerate(ordered):
        tables = direction.tables_at_start(at)
        place[:2, k], velocity[:2, k] = -slope_of(tables.antenna[0, :2]), -slope_of(tables.antenna_velocity[0, :2])
        for axis in (0, 1):
            place[axis, k] += direction.start == axis
            velocity[axis, k] += direction.start == 3 + axis
    return place, velocity


def climb_at_start(
    kernel: Any, parameters: LawParameters, surface: SnowGrid, at: Prepared, start: tuple[Array, Array],
    change: tuple[Array, Array], inputs: TangentInputs, foot: int,
) -> tuple[float, Array]:  # fmt: skip
    """Return how fast the pelvis rises (m/s) where a foot goes along the snow at the start, and the derivatives (d,) of
    that.

    start : (3,) place and velocity of the pelvis;  change : (3, d) their derivatives
    """
    ground = np.zeros((3, 2)), np.zeros((3, len(parameters.values)))
    where = start[0] + at.foot_place[0, foot]
    under = patch_under(surface, where[0], where[1])
    slopes = np.array(kernel.terrain_height(parameters, where[0], where[1])[1:]) + under[3:5]
    kernel.linearise_ground(parameters, under, where[0], where[1], *ground)
    tilting = np.zeros((2, len(inputs.columns.index)))
    for column, (row, p) in enumerate(zip(inputs.columns.row, inputs.columns.index, strict=True)):
        if row >= 0:
            others = parameters._replace(values=inputs.columns.values[row])
            kernel.linearise_ground(others, under, where[0], where[1], *ground)
        tilting[:, column] = ground[1][1:, p]
    tilts = [grid_patch(grid, surface.origin, surface.spacing, where[0], where[1])[1:3] for grid in inputs.surface]
    speed = start[1] + at.foot_velocity[0, foot]
    pace = change[1] + of_foot(inputs, foot, 3)
    turning = ground[0][1:] @ (change[0] + of_foot(inputs, foot, 0))[:2]
    turning += tilting @ inputs.parameters
    turning[:, inputs.shaping] += np.reshape(tilts, (-1, 2)).T
    rising = slopes @ speed[:2] - at.foot_velocity[0, foot, 2]
    return rising, np.asarray(slopes @ pace[:2] + speed[:2] @ turning - of_foot(inputs, foot, 3)[2])


def table_slopes(at: Prepared, ordered: Sequence[Direction], name: str) -> Array:
    """Return derivatives (…, d) of one of the tables."""
    slopes = np.zeros((*getattr(at, name).shape, len(ordered)))
    for k, direction in enumerate(ordered):
        if direction.tables is not None:
            slopes[direction.rows, ..., k] = slope_of(getattr(direction.tables, name))
    return slopes


def run_slopes(
    at: Prepared, ordered: Sequence[Direction], tangents: Any, forward: Array, through: Sequence[Direction] = (),
    amounts: Array | None = None,
) -> dict[str, Array]:  # fmt: skip
    """Return derivatives of each field of ``ReducedRun``.

    tangents : the kernel's ``TangentSeries``, or with edges that cut ``CarvedTangents``
    forward : (n, 2, 3, d) those of the skis' forward axes
    through, amounts : the heading's own three directions, and its tangents (n, 3, d) where it is found
    """
    tables = {name: table_slopes(at, ordered, name) for name in _SEEN}
    heading = np.zeros((len(at.time), 3, len(ordered)))
    if amounts is not None:
        heading = amounts
        for name, array in tables.items():
            array += np.einsum("n...k,nkd->n...d", table_slopes(at, through, name), amounts)
    return {
        "time": np.zeros((len(at.time), len(ordered))),
        "pelvis": tangents.place,
        "pelvis_velocity": tangents.velocity,
        "antenna": tangents.place + tables["antenna"],
        "com": tangents.place + tables["com_place"],
        "com_velocity": tangents.velocity + tables["com_velocity"],
        "foot_load": tangents.loads,
        "sole_force": tangents.sole,
        "foot_friction": tangents.friction,
        "foot_position": tangents.place[:, None] + tables["foot_place"],
        "foot_velocity": tangents.velocity[:, None] + tables["foot_velocity"],
        "foot_forward": forward,
        "edge_angle": tangents.edges,
        "snow_force": tangents.force,
        "snow_moment": tangents.moment,
        "heading": heading,
    }


def put_back(slopes_by_field: Mapping[str, Array], order: Sequence[int]) -> dict[str, Array]:
    """Return derivatives (…, d) of each field that are in this ``order`` (d,) of directions in that of the directions;
    those by one number are read together, so each is in one piece of memory.
    """
    by_field: dict[str, Array] = {}
    for name, array in slopes_by_field.items():
        pieces = np.empty((len(order), *array.shape[:-1]))
        pieces[order] = np.moveaxis(array, -1, 0)
        by_field[name] = np.moveaxis(pieces, 0, -1)
    return by_field


def of_foot(inputs: TangentInputs, foot: int, row: int) -> Array:
    """Return three rows (3, d) of the feet's table at the start, for all numbers."""
    rows = np.zeros((3, len(inputs.mass)))
    rows[:, : inputs.feet.shape[3]] = inputs.feet[0, foot, row : row + 3]
    return rows
