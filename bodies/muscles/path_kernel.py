"""Muscle paths through points and around surfaces; compiled.

The stretch of a path that wraps a surface, and the order of several surfaces, follow OpenSim's rules, so that its
models have the same meaning here.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sssi_exudyn.bodies.muscles.wrapping import (
    CYLINDER,
    ELLIPSOID,
    MUST,
    NONE,
    cross,
    cylinder,
    distance,
    ellipsoid,
    ellipsoid_pull,
    inner,
    minus,
)
from sssi_exudyn.core.frames import Array
from sssi_exudyn.runtime.jit import njit

_MOST: Final = 48
"""Size of the buffers: more than the nodes of a path with its tangent points."""
_ROUNDS: Final = 50
_SETTLED: Final = 1e-9
"""Several surfaces on one path: rounds, and the change of length (m) below which they end.  OpenSim ends at 5e-4; then
its moment arms are not exactly the length's derivatives.
"""


class Points(NamedTuple):
    """The p points of m muscles at n instants, one muscle after another.

    place, active : (n, p, 3) m, (n, p)
    bone : (p,) that carries each point
    first : (m + 1,) muscle k has the points from first[k] to first[k + 1]
    """

    place: Array
    active: NDArray[np.bool_]
    bone: NDArray[np.int64]
    first: NDArray[np.int64]


class Wraps(NamedTuple):
    """The w wraps of m muscles.

    between : (w, 3) surface, and the first and last point (from its muscle's first) between which the path wraps it
    first : (m + 1,) muscle k has the wraps from first[k] to first[k + 1]
    """

    between: NDArray[np.int64]
    first: NDArray[np.int64]


class Surfaces(NamedTuple):
    """The s surfaces at n instants.

    kind, size, axis, sign : (s,), (s, 3), (s,), (s,); size: radius and length of a cylinder, or half axes
    bone : (s,) that carries each surface
    frames, centres : (n, s, 3, 3), (n, s, 3) m
    """

    kind: NDArray[np.int64]
    size: Array
    axis: NDArray[np.int64]
    sign: Array
    bone: NDArray[np.int64]
    frames: Array
    centres: Array


class Nodes(NamedTuple):
    """Room for the nodes of one path: its active points, and two tangent points on each surface that it wraps.

    place : (``_MOST``, 3) m
    point, surface : index of the muscle's point or of the surface; the other is −1
    arc_length, plane : of a tangent point, what ``cylinder`` and ``ellipsoid`` give with it
    """

    place: Array
    point: NDArray[np.int64]
    surface: NDArray[np.int64]
    arc_length: Array
    plane: Array


@inner
def _into(rotation, origin, point):
    """Return a point of the ground in the frame given by ``rotation`` (3, 3) and ``origin`` (3,)."""
    d = (point[0] - origin[0], point[1] - origin[1], point[2] - origin[2])
    return (
        rotation[0, 0] * d[0] + rotation[1, 0] * d[1] + rotation[2, 0] * d[2],
        rotation[0, 1] * d[0] + rotation[1, 1] * d[1] + rotation[2, 1] * d[2],
        rotation[0, 2] * d[0] + rotation[1, 2] * d[1] + rotation[2, 2] * d[2],
    )


@inner
def _out(rotation, v):
    """Return a vector of the frame in the ground."""
    return (
        rotation[0, 0] * v[0] + rotation[0, 1] * v[1] + rotation[0, 2] * v[2],
        rotation[1, 0] * v[0] + rotation[1, 1] * v[1] + rotation[1, 2] * v[2],
        rotation[2, 0] * v[0] + rotation[2, 1] * v[1] + rotation[2, 2] * v[2],
    )


@inner
def _row(array, i):
    return (array[i, 0], array[i, 1], array[i, 2])


@inner
def _put(array, i, v):
    array[i, 0], array[i, 1], array[i, 2] = v


@inner
def _add_wrench(wrench, bone, sign, point, pull):
    moment = cross(point, pull)
    for k in range(3):
        wrench[bone, k] += sign * pull[k]
        wrench[bone, 3 + k] += sign * moment[k]


@inner
def _move(nodes, to, of):
    _put(nodes.place, to, _row(nodes.place, of))
    nodes.point[to], nodes.surface[to] = nodes.point[of], nodes.surface[of]
    nodes.arc_length[to], nodes.plane[to] = nodes.arc_length[of], nodes.plane[of]


@inner
def _on_surface(nodes, j):
    """Return whether the path runs on a surface from a node to the next."""
    return nodes.surface[j] >= 0 and nodes.surface[j] == nodes.surface[j + 1]


@inner
def _length(nodes, count):
    total = 0.0
    for j in range(count - 1):
        if _on_surface(nodes, j):
            total += nodes.arc_length[j + 1]
        else:
            total += distance(_row(nodes.place, j), _row(nodes.place, j + 1))
    return total


@inner
def _active_points(nodes, points, i, m):
    """Fill the nodes with a muscle's active points; return their number."""
    count = 0
    for p in range(points.first[m], points.first[m + 1]):
        if points.active[i, p]:
            _put(nodes.place, count, _row(points.place[i], p))
            nodes.point[count], nodes.surface[count] = p, -1
            count += 1
    return count


@inner
def _without(nodes, count, s):
    """Take the tangent points on a surface out; return the number of nodes that are left."""
    for j in range(count):
        if nodes.surface[j] == s:
            for k in range(j, count - 2):
                _move(nodes, k, k + 2)
            return count - 2
    return count


@inner
def _ends(nodes, count, first, begin, end):
    """Return the nodes between which a wrap lies, from point ``begin`` to ``end`` of a muscle; −1 without one."""
    low, high = -1, -1
    for j in range(count):
        if nodes.surface[j] < 0:
            index = nodes.point[j] - first
            if index >= begin and low < 0:
                low = j
            if index <= end:
                high = j
    return low, high


@inner
def _shortest_wrap(nodes, low, high, surfaces, i, s):
    """Return after which node a path wraps a surface (−1: nowhere), both tangent points, arc length and plane."""
    where, least = -1, math.inf
    r1 = r2 = (0.0, 0.0, 0.0)
    length = angle = 0.0
    frame, centre = surfaces.frames[i, s], _row(surfaces.centres[i], s)
    size, axis, sign = _row(surfaces.size, s), surfaces.axis[s], surfaces.sign[s]
    for j in range(low, high if low >= 0 else low):
        if _on_surface(nodes, j):
            continue
        a = _into(frame, centre, _row(nodes.place, j))
        b = _into(frame, centre, _row(nodes.place, j + 1))
        tilt = 0.0
        if surfaces.kind[s] == CYLINDER:
            action, t1, t2, arc = cylinder(a, b, size[0], size[1], axis, sign)
        else:
            action, t1, t2, arc, tilt = ellipsoid(a, b, size, axis, sign)
        if action == NONE:
            continue
        extra = distance(a, t1) + arc + distance(b, t2) - distance(a, b)
        if action == MUST or extra < least:
            where, least, r1, r2, length, angle = j, extra, t1, t2, arc, tilt
        if action == MUST:
            break
    return where, r1, r2, length, angle


@inner
def _wrap(nodes, count, surfaces, i, s, low, high):
    """Wrap a path around a surface where that is shortest; return the number of nodes."""
    where, r1, r2, length, angle = _shortest_wrap(nodes, low, high, surfaces, i, s)
    if where < 0 or count >= _MOST - 2:
        return count
    for k in range(count - 1, where, -1):
        _move(nodes, k + 2, k)
    frame, centre = surfaces.frames[i, s], surfaces.centres[i, s]
    out1, out2 = _out(frame, r1), _out(frame, r2)
    for k in range(3):
        nodes.place[where + 1, k] = centre[k] + out1[k]
        nodes.place[where + 2, k] = centre[k] + out2[k]
    for k in range(where + 1, where + 3):
        nodes.point[k], nodes.surface[k], nodes.arc_length[k], nodes.plane[k] = -1, s, length, angle
    return count + 2


@inner
def _lay(nodes, points, wraps, surfaces, i, m):
    """Lay a muscle's path around its surfaces, by turns where there are several; return the number of nodes."""
    count = _active_points(nodes, points, i, m)
    number = wraps.first[m + 1] - wraps.first[m]
    last_length = math.inf
    for _ in range(min(number, 1) if number < 2 else _ROUNDS):
        for w in range(wraps.first[m], wraps.first[m + 1]):
            s = wraps.between[w, 0]
            count = _without(nodes, count, s)
            low, high = _ends(nodes, count, points.first[m], wraps.between[w, 1], wraps.between[w, 2])
            count = _wrap(nodes, count, surfaces, i, s, low, high)
        total = _length(nodes, count)
        if abs(total - last_length) < _SETTLED:
            break
        last_length = total
    return count


@inner
def _pull(nodes, surfaces, i, j, size):
    """Return the pull of a unit tension along a straight piece of ``size`` (m) from a node to the next, and the point
    where it is taken: the first node, or the second.
    """
    before, after = nodes.surface[j], nodes.surface[j + 1]
    one, two = _row(nodes.place, j), _row(nodes.place, j + 1)
    if after >= 0 and surfaces.kind[after] == ELLIPSOID:
        frame, centre = surfaces.frames[i, after], _row(surfaces.centres[i], after)
        a, b = _into(frame, centre, one), _into(frame, centre, _row(nodes.place, j + 3))
        return _out(frame, ellipsoid_pull(a, b, _row(surfaces.size, after), nodes.plane[j + 1])[0]), one
    if before >= 0 and surfaces.kind[before] == ELLIPSOID:
        frame, centre = surfaces.frames[i, before], _row(surfaces.centres[i], before)
        a, b = _into(frame, centre, _row(nodes.place, j - 2)), _into(frame, centre, two)
        back = _out(frame, ellipsoid_pull(a, b, _row(surfaces.size, before), nodes.plane[j])[1])
        return (-back[0], -back[1], -back[2]), two
    pull = minus(one, two)
    return (pull[0] / size, pull[1] / size, pull[2] / size), one


@inner
def _bone(nodes, points, surfaces, j):
    return surfaces.bone[nodes.surface[j]] if nodes.surface[j] >= 0 else points.bone[nodes.point[j]]


@inner
def _add_pulls(pulls, wrench, nodes, count, points, surfaces, i):
    """Add the pulls of a unit tension to the path's points (p, 3) and to the bones (b, 6)."""
    for j in range(count - 1):
        size = distance(_row(nodes.place, j), _row(nodes.place, j + 1))
        if _on_surface(nodes, j) or size < 1e-12:
            continue
        pull, point = _pull(nodes, surfaces, i, j, size)
        _add_wrench(wrench, _bone(nodes, points, surfaces, j), 1.0, point, pull)
        _add_wrench(wrench, _bone(nodes, points, surfaces, j + 1), -1.0, point, pull)
        for k in range(3):
            if nodes.surface[j] < 0:
                pulls[nodes.point[j], k] += pull[k]
            if nodes.surface[j + 1] < 0:
                pulls[nodes.point[j + 1], k] -= pull[k]


# Its copy on disk does not notice a change of ``wrapping`` alone: touch this file too.
@njit(cache=True, error_model="numpy")
def follow(points, wraps, surfaces, bones):
    """Compute lengths (n, m) m of the muscles' paths and their gradients.

    One gradient (n, p, 3) is with respect to each of the path's points.  The other (n, m, b, 6) is with respect to the
    bones: force and moment about the ground's origin that a unit tension takes from each of the ``bones``.
    """
    n, muscles = len(points.place), len(points.first) - 1
    lengths, pulls = np.zeros((n, muscles)), np.zeros(points.place.shape)
    wrenches = np.zeros((n, muscles, bones, 6))
    nodes = Nodes(
        np.zeros((_MOST, 3)),
        np.zeros(_MOST, dtype=np.int64),
        np.zeros(_MOST, dtype=np.int64),
        np.zeros(_MOST),
        np.zeros(_MOST),
    )
    for i in range(n):
        for m in range(muscles):
            count = _lay(nodes, points, wraps, surfaces, i, m)
            lengths[i, m] = _length(nodes, count)
            _add_pulls(pulls[i], wrenches[i, m], nodes, count, points, surfaces, i)
    return lengths, pulls, wrenches
