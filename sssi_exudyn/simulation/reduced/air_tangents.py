"""What air and body forces do to the tangents of a run, with edges that cut or without: a template that ``compiled``
joins with the kernels of tangents and the laws.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from sssi_exudyn.contact.codegen.law_parameters import LawParameters
from sssi_exudyn.contact.codegen.vectors import indices, plus, three
from sssi_exudyn.core.frames import Array
from sssi_exudyn.runtime.jit import njit
from sssi_exudyn.simulation.ski_on_snow.structs import TimeStep

with_values: Callable[..., LawParameters]
segment_linearisation: Callable[..., None]
body_linearisation: Callable[..., None]


class PelvisEquations(NamedTuple):
    """The linear system of an instant, whose first three equations are the pelvis', with the tangents by d numbers.

    step : ``TimeStep``, what accelerations make of place and velocity
    place, velocity : (≥ 3, d) tangents of both before the instant's accelerations
    begun : the first number that counts;  matrix, right : (≥ 3, ≥ 3), (≥ 3, d)
    """

    step: TimeStep
    place: Array
    velocity: Array
    begun: int
    matrix: Array
    right: Array


@njit(cache=True, error_model="numpy")
def linearise_air(parameters, motion, inputs, n, pelvis, equations, room):
    """Add to the linear system of an instant what the air on all segments and the body forces change.

    inputs : ``TangentInputs``;  pelvis : its place and velocity;  equations : ``PelvisEquations``
    room : (3, 5) or more and (3, p) for the laws' derivatives, by state and by parameter
    """
    step, q, rate, begun, matrix, right = equations
    many, with_body, by = right.shape[1], inputs.body.shape[2], room[0]
    whole = np.zeros((3, 5))  # of all parts: the pelvis moves each of them by the same
    for e in range(motion.area.shape[0]):
        linearise_segment(parameters, motion, n, e, pelvis, room)
        for c in range(3):
            for j in range(5):
                whole[c, j] += by[c, j]
            for d in range(3):
                for k in indices(begun, with_body):
                    right[c, k] += by[c, 2 + d] * inputs.body[n, 6 + 3 * e + d, k]
        add_air_parameters(parameters, motion, inputs, n, e, pelvis, begun, room, right)
    linearise_body(parameters, motion, n, pelvis, room)
    for c in range(3):
        for j in range(5):
            whole[c, j] += by[c, j]
            for k in indices(begun, with_body):
                right[c, k] += by[c, j] * inputs.body[n, j if j < 2 else 1 + j, k]
    add_body_parameters(parameters, motion, inputs, n, pelvis, begun, room, right)
    for c in range(3):
        for d in range(2):
            matrix[c, d] -= step.by_place * whole[c, d]
            for k in indices(begun, many):
                right[c, k] += whole[c, d] * q[d, k]
        for d in range(3):
            matrix[c, d] -= step.by_rate * whole[c, 2 + d]
            for k in indices(begun, many):
                right[c, k] += whole[c, 2 + d] * rate[d, k]


@njit(cache=True, error_model="numpy")
def linearise_segment(parameters, motion, n, e, pelvis, room):
    """Fill the derivatives of the air's force on a segment."""
    (x, v), (by, by_parameter) = pelvis, room
    moving, facing = plus(v, three(motion.exposed_velocity[n, e], 0)), motion.exposed_facing[n, e]
    segment_linearisation(
        parameters, motion.time[n], x[0], x[1], moving[0], moving[1], moving[2], motion.area[e],
        facing[0, 0], facing[0, 1], facing[0, 2], facing[1, 1], facing[1, 2], facing[2, 2],
        by, by_parameter,
    )  # fmt: skip


@njit(cache=True, error_model="numpy")
def linearise_body(parameters, motion, n, pelvis, room):
    """Fill the derivatives of the force on the centre of mass."""
    (x, v), (by, by_parameter) = pelvis, room
    at, moving = plus(x, three(motion.com_place[n], 0)), plus(v, three(motion.com_velocity[n], 0))
    body_linearisation(parameters, motion.time[n], at[0], at[1], moving[0], moving[1], moving[2], by, by_parameter)


@njit(cache=True, error_model="numpy")
def add_air_parameters(parameters, motion, inputs, n, e, pelvis, begun, room, to):
    """Add to ``to`` (≥ 3, d) what parameters change of the air's force on a segment; ``room`` is overwritten."""
    columns, row_of_values = inputs.columns, -1
    for i in range(columns.segment.shape[0]):
        column = columns.segment[i]
        if columns.row[column] != row_of_values:
            row_of_values = columns.row[column]
            others = with_values(parameters, columns.values[row_of_values])
            linearise_segment(others, motion, n, e, pelvis, room)
        add_parameter(room[1], columns.index[column], inputs.parameters[column], begun, to)


@njit(cache=True, error_model="numpy")
def add_body_parameters(parameters, motion, inputs, n, pelvis, begun, room, to):
    """Add the same of the force on the centre of mass."""
    columns, row_of_values = inputs.columns, -1
    for i in range(columns.body.shape[0]):
        column = columns.body[i]
        if columns.row[column] != row_of_values:
            row_of_values = columns.row[column]
            others = with_values(parameters, columns.values[row_of_values])
            linearise_body(others, motion, n, pelvis, room)
        add_parameter(room[1], columns.index[column], inputs.parameters[column], begun, to)


@njit(cache=True, error_model="numpy")
def add_parameter(by_parameter, index, amounts, begun, to):
    """Add to ``to`` (≥ 3, d) what a force changes with the parameter at ``index``, itself by ``amounts`` (d,)."""
    for c in range(3):
        factor = by_parameter[c, index]
        for k in indices(begun, to.shape[1]):
            to[c, k] += factor * amounts[k]
