"""Tangents of the skier's heading where it is found: a template that ``compiled`` joins with ``heading_kernel``,
``air_tangents`` and the laws.

An instant's heading, its rate and acceleration follow from what was before it.  So they are three numbers more by which
the instant is linearised, the first three of all, and every other number moves it through them too.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from sssi_exudyn.contact.codegen.vectors import cross, plus, three, times
from sssi_exudyn.core.frames import Array
from sssi_exudyn.runtime.jit import inlined, njit

segment_derivatives: Callable[..., tuple[float, ...]]
body_force: Callable[..., tuple[float, float, float]]
linearise_segment: Callable[..., None]
linearise_body: Callable[..., None]
add_air_parameters: Callable[..., None]
add_body_parameters: Callable[..., None]

OF_HEADING = 3
"""Columns of the numbers: the heading, its rate, its acceleration."""


class HeadingSlopes(NamedTuple):
    """What the numbers change of the heading's tables, but through the heading; d columns or less, for the first.

    inertia, momentum : (t, ≤ d) of ``SolvedHeading``'s;  com : (t, 3, ≤ d) of its ``com_place``
    swing : (t, 3e, ≤ d) of its ``exposed_swing``
    """

    inertia: Array
    momentum: Array
    com: Array
    swing: Array


@njit(cache=True, error_model="numpy")
def next_heading_tangents(heading, slopes, n, h, moment, turned):
    """Replace ``turned`` (3, d), tangents of the heading at the instant n − 1, its rate and acceleration, with those at
    n, ``h`` (s) later; ``moment`` (d,) those of the moment at n − 1.
    """
    k, inertia = heading.stiffness, heading.inertia[n]
    c = 2.0 * heading.damping_ratio * math.sqrt(k * inertia)
    resisting = inertia + h * c + h * h * k
    more = 1.0 + 0.5 * h * c / inertia
    last, rate = heading.angle[n - 1, 1], heading.angle[n, 1]
    for i in range(OF_HEADING, turned.shape[1]):
        given = heading.inertia[n - 1] * turned[1, i] + h * (moment[i] - k * turned[0, i])
        if i < slopes.inertia.shape[1]:
            given += slopes.inertia[n - 1, i] * last + slopes.momentum[n - 1, i] - slopes.momentum[n, i]
            given -= slopes.inertia[n, i] * more * rate
        new_rate = given / resisting
        turned[2, i] = (new_rate - turned[1, i]) / h
        turned[1, i] = new_rate
        turned[0, i] += h * new_rate


@njit(cache=True, error_model="numpy")
def through_heading(columns, turned):
    """Add to ``columns`` (r, d) what the first three of them, the heading's, make of its tangents (3, d)."""
    columns[:, OF_HEADING:] += np.dot(
        np.ascontiguousarray(columns[:, :OF_HEADING]), np.ascontiguousarray(turned[:, OF_HEADING:])
    )


@njit(cache=True, error_model="numpy")
def whole_change(table, turned):
    """Return the tangents (r, d) of what a table (r, ≤ d) changes at an instant, through the heading too."""
    whole = np.zeros((table.shape[0], turned.shape[1]))
    whole[:, : table.shape[1]] = table
    through_heading(whole, turned)
    return whole


@inlined
def moment_tangents(system, heading, slopes, inputs, n, pelvis, state, series, room):
    """Fill ``state.moment`` (d,) with the tangents of the moment on the heading at an instant.

    pelvis : its place and velocity (tuples);  state : ``SoughtTangents``;  room : ``CarvedRoom``
    series : ``CarvedSeries``, ``CarvedTangents``
    """
    parameters, motion, (x, v), (run, tangents) = system.parameters, system.motion, pelvis, series
    laws = (room.air, room.by_air)
    z, zv, turned, moment = state.z, state.zv, state.turned, state.moment
    many = turned.shape[1]
    up, com = three(heading.up, 0), three(heading.com_place[n], 0)
    body, d_com = whole_change(inputs.body[n], turned), whole_change(slopes.com[n], turned)
    swing, com_swing = whole_change(slopes.swing[n], turned), cross(up, com)
    changed, still = np.zeros((3, many)), np.zeros((2, many))
    moment[:] = 0.0
    for side in range(2):
        force = three(run.force[n, side], 0)
        lever = cross(up, plus(three(motion.foot_place[n, side], 0), times(-1.0, com)))
        aside = cross(force, up)
        place = whole_change(inputs.feet[n, side, :3], turned)
        for k in range(many):
            for c in range(3):
                moment[k] += lever[c] * tangents.force[n, side, c, k] + up[c] * tangents.moment[n, side, c, k]
                moment[k] += aside[c] * (place[c, k] - d_com[c, k])
    for e in range(motion.area.shape[0]):
        moving = plus(v, three(motion.exposed_velocity[n, e], 0))
        facing = motion.exposed_facing[n, e]
        pushed = segment_derivatives(
            parameters, motion.time[n], x[0], x[1], moving[0], moving[1], moving[2], motion.area[e],
            facing[0, 0], facing[0, 1], facing[0, 2], facing[1, 1], facing[1, 2], facing[2, 2],
        )  # fmt: skip
        linearise_segment(parameters, motion, n, e, pelvis, laws)
        collect_force(changed, room.air, z, zv, still, body[6 + 3 * e : 9 + 3 * e])
        add_air_parameters(parameters, motion, inputs, n, e, pelvis, 0, laws, changed)
        force = (pushed[0], pushed[1], pushed[2])
        lever, aside = plus(three(heading.exposed_swing[n, e], 0), times(-1.0, com_swing)), cross(force, up)
        for k in range(many):
            for c in range(3):
                moment[k] += lever[c] * changed[c, k] + force[c] * swing[3 * e + c, k] - aside[c] * d_com[c, k]
    at, moving = plus(x, three(motion.com_place[n], 0)), plus(v, three(motion.com_velocity[n], 0))
    force = body_force(parameters, motion.time[n], at[0], at[1], moving[0], moving[1], moving[2])
    linearise_body(parameters, motion, n, pelvis, laws)
    collect_force(changed, room.air, z, zv, body[:2], body[3:6])
    add_body_parameters(parameters, motion, inputs, n, pelvis, 0, laws, changed)
    lever = cross(up, plus(three(motion.com_place[n], 0), times(-1.0, com)))
    aside = cross(force, up)
    for k in range(many):
        for c in range(3):
            moment[k] += lever[c] * changed[c, k] + aside[c] * (body[c, k] - d_com[c, k])


@njit(cache=True, error_model="numpy")
def collect_force(changed, by_state, z, zv, place, velocity):
    """Fill ``changed`` (3, d) with the tangents of a force by ``by_state`` (3, 5), its law's derivatives by place and
    velocity: those of the pelvis, z and zv, with ``place`` (2, d) and ``velocity`` (3, d) more.
    """
    for c in range(3):
        for k in range(changed.shape[1]):
            total = 0.0
            for i in range(2):
                total += by_state[c, i] * (z[i, k] + place[i, k])
            for i in range(3):
                total += by_state[c, 2 + i] * (zv[i, k] + velocity[i, k])
            changed[c, k] = total
