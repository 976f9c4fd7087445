"""What air and body forces do to the tangents of a run, with edges that cut or without: a template that ``compiled``
joins with the kernels of tangents and the laws.
"""

from __future__ import annotations

from collections.abc import Callable

from sssi_exudyn.contact.codegen.law_parameters import LawParameters
from sssi_exudyn.contact.codegen.vectors import plus, three
from sssi_exudyn.runtime.jit import njit

with_values: Callable[..., LawParameters]
segment_linearisation: Callable[..., None]
body_linearisation: Callable[..., None]


@njit(cache=True, error_model="numpy")
def linearise_air(
    parameters, motion, inputs, n, x, v, by_place, by_rate, q, rate, begun, by, by_air, by_body, matrix, right
):
    """Add to the linear system of an instant what the air on all segments and the body forces change.

    inputs : ``TangentInputs``;  x, v : of the pelvis;  q, rate : tangents, (3, d) or longer, of both before the
        instant's accelerations;  by_place, by_rate : what these make of them;  begun : the first number that counts
    by : (3, 5) or more, by_air, by_body : (3, p) room for the laws' derivatives
    matrix, right : (≥ 3, ≥ 3) and (≥ 3, d)
    """
    many, with_body = right.shape[1], inputs.body.shape[2]
    for e in range(motion.area.shape[0]):
        linearise_segment(parameters, motion, n, e, x, v, by, by_air)
        for c in range(3):
            for d in range(2):
                matrix[c, d] -= by_place * by[c, d]
                for k in range(begun, many):
                    right[c, k] += by[c, d] * q[d, k]
            for d in range(3):
                matrix[c, d] -= by_rate * by[c, 2 + d]
                for k in range(begun, many):
                    right[c, k] += by[c, 2 + d] * rate[d, k]
                for k in range(begun, with_body):
                    right[c, k] += by[c, 2 + d] * inputs.body[n, 6 + 3 * e + d, k]
        add_air_parameters(parameters, motion, inputs, n, e, x, v, begun, by, by_air, right)
    linearise_body(parameters, motion, n, x, v, by, by_body)
    for c in range(3):
        for d in range(2):
            matrix[c, d] -= by_place * by[c, d]
            for k in range(begun, many):
                right[c, k] += by[c, d] * q[d, k]
            for k in range(begun, with_body):
                right[c, k] += by[c, d] * inputs.body[n, d, k]
        for d in range(3):
            matrix[c, d] -= by_rate * by[c, 2 + d]
            for k in range(begun, many):
                right[c, k] += by[c, 2 + d] * rate[d, k]
            for k in range(begun, with_body):
                right[c, k] += by[c, 2 + d] * inputs.body[n, 3 + d, k]
    add_body_parameters(parameters, motion, inputs, n, x, v, begun, by, by_body, right)


@njit(cache=True, error_model="numpy")
def linearise_segment(parameters, motion, n, e, x, v, by, by_air):
    """Fill the derivatives of the air's force on a segment."""
    moving, facing = plus(v, three(motion.exposed_velocity[n, e], 0)), motion.exposed_facing[n, e]
    segment_linearisation(
        parameters, motion.time[n], x[0], x[1], moving[0], moving[1], moving[2], motion.area[e],
        facing[0, 0], facing[0, 1], facing[0, 2], facing[1, 1], facing[1, 2], facing[2, 2],
        by, by_air,
    )  # fmt: skip


@njit(cache=True, error_model="numpy")
def linearise_body(parameters, motion, n, x, v, by, by_body):
    """Fill the derivatives of the force on the centre of mass."""
    at, moving = plus(x, three(motion.com_place[n], 0)), plus(v, three(motion.com_velocity[n], 0))
    body_linearisation(parameters, motion.time[n], at[0], at[1], moving[0], moving[1], moving[2], by, by_body)


@njit(cache=True, error_model="numpy")
def add_air_parameters(parameters, motion, inputs, n, e, x, v, begun, by, by_air, to):
    """Add to ``to`` (≥ 3, d) what parameters change of the air's force on a segment; ``by`` is overwritten."""
    columns, row_of_values = inputs.columns, -1
    for i in range(columns.segment.shape[0]):
        column = columns.segment[i]
        if columns.row[column] != row_of_values:
            row_of_values = columns.row[column]
            others = with_values(parameters, columns.values[row_of_values])
            linearise_segment(others, motion, n, e, x, v, by, by_air)
        add_parameter(by_air, columns.index[column], inputs.parameters[column], begun, to)


@njit(cache=True, error_model="numpy")
def add_body_parameters(parameters, motion, inputs, n, x, v, begun, by, by_body, to):
    """Add the same of the force on the centre of mass."""
    columns, row_of_values = inputs.columns, -1
    for i in range(columns.body.shape[0]):
        column = columns.body[i]
        if columns.row[column] != row_of_values:
            row_of_values = columns.row[column]
            others = with_values(parameters, columns.values[row_of_values])
            linearise_body(others, motion, n, x, v, by, by_body)
        add_parameter(by_body, columns.index[column], inputs.parameters[column], begun, to)


@njit(cache=True, error_model="numpy")
def add_parameter(by_parameter, index, amounts, begun, to):
    """Add to ``to`` (≥ 3, d) what a force changes with the parameter at ``index``, itself by ``amounts`` (d,)."""
    for c in range(3):
        factor = by_parameter[c, index]
        for k in range(begun, to.shape[1]):
            to[c, k] += factor * amounts[k]
