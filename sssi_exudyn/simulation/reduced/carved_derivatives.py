"""A run on snow that edges cut with its exact derivatives by any numbers, the groove's memory included."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from sssi_exudyn.core.frames import Array
from sssi_exudyn.model.model import Model
from sssi_exudyn.simulation.heading import Turn, turned
from sssi_exudyn.simulation.reduced.carved_rest import rest_tangents
from sssi_exudyn.simulation.reduced.carved_run import SHARE, Carved, CarvedMoment, carved_run, reduced_run_of
from sssi_exudyn.simulation.reduced.carved_steps_kernel import CarvedWork
from sssi_exudyn.simulation.reduced.carved_tangents_kernel import CarvedRoom, CarvedTangents, SoughtTangents
from sssi_exudyn.simulation.reduced.derivative_inputs import (
    STEP,
    Direction,
    climb_at_start,
    columns_of,
    listed_parameters,
    place_at_start,
    put_back,
    rank,
    run_slopes,
    slope_of,
    tangent_inputs,
)
from sssi_exudyn.simulation.reduced.edge_setup import carving_module
from sssi_exudyn.simulation.reduced.heading_tangents import HeadingSlopes
from sssi_exudyn.simulation.reduced.prepared import Prepared, ReducedRun, load_at_start
from sssi_exudyn.simulation.ski_on_snow.edge import EdgeLines
from sssi_exudyn.simulation.ski_on_snow.structs import TangentInputs


class CarvedLinearisation:
    """One run, and its derivatives in as many directions as are asked for.

    begin : of a run that goes on; directions change nothing of it then

    Raises SimulationDiverged as ``simulate_carved`` does.
    """

    def __init__(self, model: Model, prepared: Prepared, begin: CarvedMoment | None = None) -> None:
        self.model = model
        self.goes_on = begin is not None
        self.done = carved_run(model, prepared, begin=begin)
        self.run = reduced_run_of(self.done)
        self._turning = _turning(self.done)

    def derivatives(self, directions: Sequence[Direction]) -> tuple[ReducedRun, dict[str, Array]]:
        """Return the run, and of each of its fields the derivatives in those directions."""
        done, kernel = self.done, carving_module()
        order = sorted(range(len(directions)), key=lambda i: rank(directions[i].tables))
        captured, own = [directions[i] for i in order], len(self._turning)
        ordered = [*self._turning, *(_turned(done, direction) for direction in captured)]
        many, points, modes = len(ordered), done.points, done.modes
        listed, by_parameter = listed_parameters(self.model.terms, ordered)
        inputs = tangent_inputs(done.at, ordered, listed, by_parameter, modes)
        counts = len(listed.index), len(done.system.parameters.values)
        lines = EdgeLines.room(points, modes, *counts)
        room = CarvedRoom.room(lines, many)
        work, system = done.work(), done.system
        z, zv = np.zeros((2, 7 + 2 * modes, many))
        if not self.goes_on:
            self._begin_tangents(ordered, inputs, (work, lines, room), z, zv)
        series = _empty_tangents(done, many)
        slopes = _heading_slopes(done, self._turning, captured)
        kernel.carved_tangents(
            system, done.heading, inputs, slopes, SoughtTangents.begin(z, zv), done.begin.copy_memory(), work, lines,
            room, (done.series, series),
        )  # fmt: skip
        through = series.angle if own else None
        slopes_by_field = run_slopes(done.at, ordered, series, series.forward, self._turning, through)
        return self.run, put_back({name: array[..., own:] for name, array in slopes_by_field.items()}, order)

    def _begin_tangents(
        self, ordered: Sequence[Direction], inputs: TangentInputs, rooms: tuple[CarvedWork, EdgeLines, CarvedRoom],
        z: Array, zv: Array,
    ) -> None:  # fmt: skip
        """Fill the tangents (7 + 2k, d) of pelvis and skis, and of their rates, where a run starts from rest."""
        done, kernel, system = self.done, carving_module(), self.done.system
        z[:3], zv[:3] = place_at_start(done.at, ordered)
        load = np.array([slope_of(load_at_start(d.tables_at_start(done.at), SHARE)) for d in ordered])
        feet = inputs.feet.copy()
        feet[:, :, 3:6] = feet[:, :, 9:12] = 0.0
        still = np.zeros_like(system.motion.foot_velocity)
        rest_tangents(
            kernel, system._replace(motion=system.motion._replace(foot_velocity=still, foot_spin=still)),
            inputs._replace(feet=feet), (done.begin.place, done.begin.bent), load, done.begin.copy_memory(), rooms, z,
        )  # fmt: skip
        for foot in range(2):
            start, change = (done.begin.place, done.begin.velocity), (z[:3], zv[:3])
            _, climb = climb_at_start(
                kernel, system.parameters, system.surface, done.at, start, change, inputs, foot
            )  # fmt: skip
            zv[2] += SHARE[foot] * climb


def _heading_slopes(done: Carved, turning: Sequence[Direction], captured: Sequence[Direction]) -> HeadingSlopes:
    """Return what the numbers change of the heading's tables, the heading's own first; nothing where it is captured."""
    at, count, own = done.captured, len(done.at.time), len(turning)
    if not own:
        return HeadingSlopes(*np.zeros((2, count, 0)), *np.zeros((2, count, 3, 0)))
    ranks = [rank(direction.tables) for direction in captured]
    feet, bodies = own + columns_of(ranks, 1), own + columns_of(ranks, 0)
    inertia, momentum = np.zeros((2, count, feet))
    com, swing = np.zeros((count, 3, feet)), np.zeros((count, 3 * at.exposed_swing.shape[1], bodies))
    matrices = Turn.of(at.up, done.heading.angle).matrices()
    for k, direction in enumerate([*turning, *captured]):
        if direction.tables is None:
            continue
        whole, rows = direction.tables.whole_body(), direction.rows
        place, swung = slope_of(whole.place), slope_of(direction.tables.exposed_swing)
        if k >= own:  # of tables that are not turned yet
            inertia[rows, k] = slope_of(whole.inertia @ at.up @ at.up)
            momentum[rows, k] = slope_of(whole.momentum @ at.up)
            place, swung = turned(matrices[rows], place), turned(matrices[rows], swung)
        com[rows, :, k] = place
        if k < bodies:
            swing[rows, :, k] = swung.reshape(len(swung), -1)
    return HeadingSlopes(inertia, momentum, com, swing)


def _turning(done: Carved) -> tuple[Direction, ...]:
    """Return the solved heading, its rate and its acceleration as numbers; none where it is the captured one."""
    if not done.heading.solved:
        return ()
    at, steps = done.captured, done.heading.angle + 1j * STEP * np.eye(3)[:, None]
    return tuple(Direction(tables=at.turn(Turn.of(at.up, step))) for step in steps)


def _turned(done: Carved, direction: Direction) -> Direction:
    """Return the direction with its tables turned as the run was."""
    if direction.tables is None or not done.heading.solved:
        return direction
    turn = Turn.of(done.at.up, done.heading.angle[direction.rows])
    return replace(direction, tables=direction.tables.turn(turn))


def _empty_tangents(done: Carved, many: int) -> CarvedTangents:
    count = len(done.at.time)
    pelvis, by_foot, vectors = np.zeros((2, count, 3, many)), np.zeros((3, count, 2, many)), (4, count, 2, 3, many)
    friction, force, moment, forward = np.zeros(vectors)
    return CarvedTangents(
        pelvis[0], pelvis[1], by_foot[0], by_foot[1], friction, by_foot[2], force, moment, forward,
        np.zeros((count, 3, many)),
    )  # fmt: skip
