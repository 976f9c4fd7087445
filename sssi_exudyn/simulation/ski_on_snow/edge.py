"""The snow's forces on the edges of one ski, and the snow's memory: a template that ``compiled`` joins with the laws.

A ski has the coordinates x, y, z of its foot, small turns of the foot about the snow's axes, and its modes; the snow is
the plane z = 0, or the plane that the caller has turned the ski into the frame of.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from sssi_exudyn.contact.codegen.vectors import cross, dot, into, out_of, plus, three, times
from sssi_exudyn.core.frames import Array
from sssi_exudyn.runtime.jit import njit

section_angle: Callable[..., float]
angle_by_depths: Callable[..., float]
edge_derivatives: Callable[..., tuple[float, ...]]
edge_memory: Callable[..., tuple[float, float]]
edge_capacity: Callable[..., tuple[float, float]]

LOWER, UPPER, RATE, ALONG, ACROSS, SWING = range(6)
"""By what the derivatives of an edge's force are taken: both depths, the rate, and the velocity along t and n; and how
the tangent turns, which changes the last two."""


class EdgeSki(NamedTuple):
    """A ski's edges in the foot's frame: m stations from tail to tip, both edges (left, right), k modes.

    points, tangents : (m, 2, 3) m and unit vectors forward along the edge, unloaded
    shape, turning : (m, 2, 3, k) change of both a unit of the mode, against the boot centre
    give : (2, k) m, rad by which the boot centre heaves and pitches a unit of the mode; zero where it is held
    width, length, station : (m,) m: of the ski, of the edge that the point stands for, and place along the ski
    omega, ratio : (k,) rad/s, share of critical damping
    """

    points: Array
    tangents: Array
    shape: Array
    turning: Array
    give: Array
    width: Array
    length: Array
    station: Array
    omega: Array
    ratio: Array


class EdgeWork(NamedTuple):
    """Arrays in which the forces are found.

    by, lines : rows (6, 6 + k) of what a point's force depends on, and (4, 6 + k) of the directions that it acts in
    towards, slopes : (4m, 6 + k) of all points, the directions, and the derivatives of the forces in them

    seen : (m, 13) of each station at its deeper edge: normal, along, across (N), the wall's greatest force (N), depth
        of the edge and of the groove left (m), offset (m), v_t, v_n (m/s), edge (rad), rise (1), rate (m/s), and the
        wall's force (N, ≥ 0)
    """

    by: Array
    lines: Array
    towards: Array
    slopes: Array
    seen: Array


@njit(cache=True, error_model="numpy")
def press_edges(parameters, ski, memory, foot, eta, rate, step, by_place, by_rate, force, matrix, work):
    """Add a ski's snow forces to ``force`` (6 + k,), and to ``matrix`` their derivatives, the sign turned.

    foot : height of its place over the snow, its velocity (tuple), rotation (3, 3) and spin (tuple), and the axes
        (tuples) along and about which the modes make it heave and pitch, on the snow
    eta, rate : (k,) of the modes
    by_place, by_rate : (6 + k,) how the coordinates and their rates follow from what is sought

    Left out of the derivatives: how the directions of the forces turn, and how the tangent's rise changes.
    """
    frame, upright, left = foot[2], foot[4], foot[5]
    modes = ski.omega.shape[0]
    size = 6 + modes
    by, lines, towards, slopes, seen = work.by, work.lines, work.towards, work.slopes, work.seen
    seen[:] = 0.0
    towards[:] = 0.0
    for i in range(ski.width.shape[0]):
        low, lower, upper, edge, arm, other, tangent, _, moving = deeper_edge(ski, foot, eta, rate, i)
        memory.next_groove[low, i], memory.next_offset[low, i], memory.next_speed[low, i] = 0.0, 0.0, 0.0
        # the other edge presses too where the ski is flat, and has no wall
        memory.next_groove[1 - low, i] = max(upper, memory.arrived_groove[1 - low, i]) if upper > 0.0 else 0.0
        memory.next_offset[1 - low, i] = 0.0
        length = math.sqrt(dot(tangent, tangent))
        flat = math.sqrt(tangent[0] * tangent[0] + tangent[1] * tangent[1])
        t = (tangent[0] / flat, tangent[1] / flat, 0.0)
        n = (-t[1], t[0], 0.0)
        v_t, v_n, sinking = dot(moving, t), dot(moving, n), -moving[2]
        memory.next_speed[low, i], memory.next_speed[1 - low, i] = v_t, v_t
        memory.next_drift[low, i], memory.next_drift[1 - low, i] = v_n, v_n
        if lower <= 0.0:
            continue
        groove, offset = memory.arrived_groove[low, i], memory.arrived_offset[low, i]
        rise = tangent[2] / length
        found = edge_derivatives(
            parameters, lower, upper, sinking, ski.width[i], groove, offset, step, v_t, v_n, rise, edge, ski.length[i]
        )
        memory.next_groove[low, i], memory.next_offset[low, i] = edge_memory(
            parameters, lower, upper, sinking, ski.width[i], groove, offset, step, v_t, v_n, rise, edge, ski.length[i]
        )
        seen[i, 0], seen[i, 1], seen[i, 2] = found[0], found[1], found[2]
        seen[i, 3], seen[i, 12] = edge_capacity(
            parameters, lower, upper, sinking, ski.width[i], groove, offset, step, v_t, v_n, rise, edge, ski.length[i]
        )
        seen[i, 4], seen[i, 5], seen[i, 6] = lower, memory.next_groove[low, i], memory.next_offset[low, i]
        seen[i, 7], seen[i, 8], seen[i, 9], seen[i, 10], seen[i, 11] = v_t, v_n, edge, rise, sinking
        by_depths = angle_by_depths(low, edge, ski.width[i])
        # of each coordinate: the directions, and what it changes of depth, rate and velocity
        for c in range(6):
            axis = (1.0 if c % 3 == 0 else 0.0, 1.0 if c % 3 == 1 else 0.0, 1.0 if c % 3 == 2 else 0.0)
            moved, over, turned = (axis, axis, (0.0, 0.0, 0.0)) if c < 3 else (
                cross(axis, arm), cross(axis, other), cross(axis, tangent)
            )  # fmt: skip
            lines[0, c], lines[1, c], lines[2, c], lines[3, c] = moved[2], dot(moved, t), dot(moved, n), over[2]
            by[SWING, c] = dot(turned, n)
        inwards, along, across = into(frame, (0.0, 0.0, 1.0)), into(frame, t), into(frame, n)
        pitched, over_pitched, tipped = cross(left, arm), cross(left, other), cross(left, tangent)
        for k in range(modes):
            a, b, c = ski.shape[i, low, 0, k], ski.shape[i, low, 1, k], ski.shape[i, low, 2, k]
            rigid = plus(times(ski.give[0, k], upright), times(ski.give[1, k], pitched))
            lines[0, 6 + k] = inwards[0] * a + inwards[1] * b + inwards[2] * c + rigid[2]
            lines[1, 6 + k] = along[0] * a + along[1] * b + along[2] * c + dot(rigid, t)
            lines[2, 6 + k] = across[0] * a + across[1] * b + across[2] * c + dot(rigid, n)
            a, b, c = ski.shape[i, 1 - low, 0, k], ski.shape[i, 1 - low, 1, k], ski.shape[i, 1 - low, 2, k]
            rigid = plus(times(ski.give[0, k], upright), times(ski.give[1, k], over_pitched))
            lines[3, 6 + k] = inwards[0] * a + inwards[1] * b + inwards[2] * c + rigid[2]
            a, b, c = ski.turning[i, low, 0, k], ski.turning[i, low, 1, k], ski.turning[i, low, 2, k]
            by[SWING, 6 + k] = across[0] * a + across[1] * b + across[2] * c + ski.give[1, k] * dot(tipped, n)
        for c in range(size):
            by[LOWER, c], by[UPPER, c] = -lines[0, c] * by_place[c], -lines[3, c] * by_place[c]
            by[RATE, c] = -lines[0, c] * by_rate[c]
            swing = by[SWING, c] * by_place[c] / flat
            by[ALONG, c] = lines[1, c] * by_rate[c] + v_n * swing
            by[ACROSS, c] = lines[2, c] * by_rate[c] - v_t * swing
            lines[3, c] -= lines[0, c]
        for part in range(4):
            for c in range(size):
                force[c] += found[part] * lines[part, c]
        for part in range(4):
            at, row = 4 + 6 * part, 4 * i + part
            tilting = found[at + 5] * by_depths
            for c in range(size):
                towards[row, c] = lines[part, c]
                slopes[row, c] = (
                    (found[at] + tilting) * by[LOWER, c]
                    + (found[at + 1] - tilting) * by[UPPER, c]
                    + found[at + 2] * by[RATE, c]
                    + found[at + 3] * by[ALONG, c]
                    + found[at + 4] * by[ACROSS, c]
                )
    matrix -= np.dot(towards.T, slopes)


@njit(cache=True, error_model="numpy")
def deeper_edge(ski, foot, eta, rate, i):
    """Of one station: which edge is the deeper one, its depth and that of the other (m), the edge angle (rad), the
    places of both edges about the foot (m), the deeper edge's tangent (not of unit length), and its velocity by the
    modes alone and in all (m/s), on the snow.
    """
    height, velocity, frame, spin = foot[:4]
    left = bent_vector(frame, three(ski.points[i, 0], 0), ski.shape, eta, i, 0)
    right = bent_vector(frame, three(ski.points[i, 1], 0), ski.shape, eta, i, 1)
    left_depth, right_depth = -height - left[2], -height - right[2]
    low = 1 if right_depth > left_depth else 0
    lower, upper = (right_depth, left_depth) if low == 1 else (left_depth, right_depth)
    edge = section_angle(left_depth, right_depth, ski.width[i])
    arm, other = (right, left) if low == 1 else (left, right)
    tangent = bent_vector(frame, three(ski.tangents[i, low], 0), ski.turning, eta, i, low)
    bending = bent_vector(frame, (0.0, 0.0, 0.0), ski.shape, rate, i, low)
    moving = plus(plus(velocity, cross(spin, arm)), bending)
    return low, lower, upper, edge, arm, other, tangent, bending, moving


@njit(cache=True, error_model="numpy")
def bent_vector(frame, unloaded, shape, eta, i, edge):
    """A vector of an edge point in the bent ski, or with the modes' rates its rate, turned out of the foot's frame.

    unloaded : (3) of the ski as it was made
    """
    a, b, c = unloaded
    for k in range(eta.shape[0]):
        a += shape[i, edge, 0, k] * eta[k]
        b += shape[i, edge, 1, k] * eta[k]
        c += shape[i, edge, 2, k] * eta[k]
    return out_of(frame, (a, b, c))


@njit(cache=True, error_model="numpy")
def eliminate(matrix, right):
    """Solve a linear system in place of its right side (n,), with row pivoting.  False where it is singular."""
    n = right.shape[0]
    for i in range(n):
        best = i
        for r in range(i + 1, n):
            if abs(matrix[r, i]) > abs(matrix[best, i]):
                best = r
        if not abs(matrix[best, i]) > 0.0:
            return False
        if best != i:
            for c in range(i, n):
                matrix[i, c], matrix[best, c] = matrix[best, c], matrix[i, c]
            right[i], right[best] = right[best], right[i]
        inverse = 1.0 / matrix[i, i]
        for r in range(i + 1, n):
            factor = matrix[r, i] * inverse
            if factor != 0.0:
                for c in range(i + 1, n):
                    matrix[r, c] -= factor * matrix[i, c]
                right[r] -= factor * right[i]
    for i in range(n - 1, -1, -1):
        total = right[i]
        for c in range(i + 1, n):
            total -= matrix[i, c] * right[c]
        right[i] = total / matrix[i, i]
    return True
