"""Muscle paths through points and around surfaces; compiled.

The stretch of a path that wraps a surface, and the order of several surfaces, follow OpenSim's rules, so that its
models have the same meaning here.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

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
from sssi_exudyn.runtime.jit import njit

_MOST: Final = 48
"""Size of the buffers: more than the nodes of a path with its tangent points."""
_ROUNDS: Final = 50
_SETTLED: Final = 1e-9
"""Several surfaces on one path: rounds, and the change of length (m) below which they end.  OpenSim ends at 5e-4; then
its moment arms are not exactly the length's derivatives.
"""


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
def _length(place, surface, arc_length, count):
    total = 0.0
    for i in range(count - 1):
        if surface[i] >= 0 and surface[i] == surface[i + 1]:
            total += arc_length[i + 1]
        else:
            total += distance(_row(place, i), _row(place, i + 1))
    return total


# Its copy on disk does not notice a change of ``wrapping`` alone: touch this file too.
@njit(cache=True, error_model="numpy")
def follow(points, active, bone, first, wraps, wrap_first, kind, size, axis, sign, carrier, frames, centres, bones):
    """Compute lengths (n, m) m of m muscles and their gradients.

    One gradient (n, p, 3) is with respect to each of the path's points.  The other (n, m, b, 6) is with respect to the
    bones: force and moment about the ground's origin that a unit tension takes from each bone.

    Parameters
    ----------
    points, active : (n, p, 3) m, (n, p); of all muscles one after another, muscle k from first[k] to first[k + 1]
    bone : (p,) that carries each point
    wraps : (w, 3) surface, first and last point of the path (from its own start) between which it wraps; muscle k has
        those from wrap_first[k] to wrap_first[k + 1]
    kind, size, axis, sign : (s,), (s, 3), (s,), (s,) of the surfaces: radius and length of a cylinder, half axes
    carrier, frames, centres : (s,) their bones, (n, s, 3, 3), (n, s, 3) where they are
    bones : their number
    """
    n, muscles = len(points), len(first) - 1
    lengths, pulls = np.zeros((n, muscles)), np.zeros(points.shape)
    wrenches = np.zeros((n, muscles, bones, 6))
    place, origin = np.zeros((_MOST, 3)), np.zeros(_MOST, dtype=np.int64)
    surface, arc_length, plane = np.zeros(_MOST, dtype=np.int64), np.zeros(_MOST), np.zeros(_MOST)
    for i in range(n):
        for m in range(muscles):
            count = 0
            for p in range(first[m], first[m + 1]):
                if active[i, p]:
                    _put(place, count, _row(points[i], p))
                    origin[count], surface[count] = p, -1
                    count += 1
            number = wrap_first[m + 1] - wrap_first[m]
            last_length = math.inf
            for _ in range(0 if number == 0 else 1 if number == 1 else _ROUNDS):
                for w in range(wrap_first[m], wrap_first[m + 1]):
                    s = wraps[w, 0]
                    for j in range(count):  # take this surface's own points out again
                        if surface[j] == s:
                            for k in range(j, count - 2):
                                _put(place, k, _row(place, k + 2))
                                origin[k], surface[k], arc_length[k], plane[k] = (
                                    origin[k + 2], surface[k + 2], arc_length[k + 2], plane[k + 2],
                                )  # fmt: skip
                            count -= 2
                            break
                    low, high = -1, -1
                    for j in range(count):
                        if surface[j] < 0:
                            index = origin[j] - first[m]
                            if index >= wraps[w, 1] and low < 0:
                                low = j
                            if index <= wraps[w, 2]:
                                high = j
                    where, least = -1, math.inf
                    r1 = r2 = (0.0, 0.0, 0.0)
                    length = angle = 0.0
                    frame, centre = frames[i, s], _row(centres[i], s)
                    for j in range(low, high):
                        if low < 0 or (surface[j] >= 0 and surface[j] == surface[j + 1]):
                            continue
                        a = _into(frame, centre, _row(place, j))
                        b = _into(frame, centre, _row(place, j + 1))
                        tilt = 0.0
                        if kind[s] == CYLINDER:
                            action, t1, t2, arc = cylinder(a, b, size[s, 0], size[s, 1], axis[s], sign[s])
                        else:
                            action, t1, t2, arc, tilt = ellipsoid(a, b, _row(size, s), axis[s], sign[s])
                        if action == NONE:
                            continue
                        extra = distance(a, t1) + arc + distance(b, t2) - distance(a, b)
                        if action == MUST or extra < least:
                            where, least, r1, r2, length, angle = j, extra, t1, t2, arc, tilt
                        if action == MUST:
                            break
                    if where >= 0 and count < _MOST - 2:
                        for k in range(count - 1, where, -1):
                            _put(place, k + 2, _row(place, k))
                            origin[k + 2], surface[k + 2], arc_length[k + 2], plane[k + 2] = (
                                origin[k], surface[k], arc_length[k], plane[k],
                            )  # fmt: skip
                        out1, out2 = _out(frame, r1), _out(frame, r2)
                        for k in range(3):
                            place[where + 1, k] = centre[k] + out1[k]
                            place[where + 2, k] = centre[k] + out2[k]
                        for k in range(where + 1, where + 3):
                            origin[k], surface[k], arc_length[k], plane[k] = -1, s, length, angle
                        count += 2
                total = _length(place, surface, arc_length, count)
                if abs(total - last_length) < _SETTLED:
                    break
                last_length = total
            lengths[i, m] = _length(place, surface, arc_length, count)
            wrench = wrenches[i, m]
            for j in range(count - 1):
                s, after = surface[j], surface[j + 1]
                if s >= 0 and s == after:
                    continue
                one, two = _row(place, j), _row(place, j + 1)
                size_of = distance(one, two)
                if size_of < 1e-12:
                    continue
                pull = minus(one, two)
                pull = (pull[0] / size_of, pull[1] / size_of, pull[2] / size_of)
                bone_here = carrier[s] if s >= 0 else bone[origin[j]]
                bone_there = carrier[after] if after >= 0 else bone[origin[j + 1]]
                at_end = False  # where the pull is taken: at the first node, or at the second
                if after >= 0 and kind[after] == ELLIPSOID:
                    frame, centre = frames[i, after], _row(centres[i], after)
                    a, b = _into(frame, centre, one), _into(frame, centre, _row(place, j + 3))
                    pull = _out(frame, ellipsoid_pull(a, b, _row(size, after), plane[j + 1])[0])
                elif s >= 0 and kind[s] == ELLIPSOID:
                    frame, centre = frames[i, s], _row(centres[i], s)
                    a, b = _into(frame, centre, _row(place, j - 2)), _into(frame, centre, two)
                    back = _out(frame, ellipsoid_pull(a, b, _row(size, s), plane[j])[1])
                    pull, at_end = (-back[0], -back[1], -back[2]), True
                point = two if at_end else one
                _add_wrench(wrench, bone_here, 1.0, point, pull)
                _add_wrench(wrench, bone_there, -1.0, point, pull)
                for k in range(3):
                    if s < 0:
                        pulls[i, origin[j], k] += pull[k]
                    if after < 0:
                        pulls[i, origin[j + 1], k] -= pull[k]
    return lengths, pulls, wrenches
