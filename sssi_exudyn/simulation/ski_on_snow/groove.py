"""What the snow remembers of skis that cut it: a template that ``compiled`` joins with the kernels of their edges and
the formulas of ``edge_point``.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from sssi_exudyn.runtime.jit import njit
from sssi_exudyn.simulation.ski_on_snow.structs import Groove

arriving_memory: Callable[..., tuple[float, float]]
arriving_memory_linearisation: Callable[..., None]


@njit(cache=True, error_model="numpy")
def coming_from(station, memory, step, edge, i):
    """Return the stations that the snow lay between which reaches a station after ``step`` (s), and what
    ``arriving_memory`` takes of it; the first is negative where that snow is fresh, from ahead of the ski or of a point
    that went backwards.
    """
    last, speed = station.shape[0] - 1, memory.speed[edge, i]
    place = station[i] + step * speed
    ahead = i
    while ahead < last and station[ahead + 1] < place:
        ahead += 1
    beyond = min(ahead + 1, last)
    gap = station[beyond] - station[ahead] if beyond > ahead else 1.0
    groove, offset, drift = memory.groove[edge], memory.offset[edge], memory.drift[edge]
    given = (
        (station[i], station[ahead], gap), step, (groove[ahead], groove[beyond]), (offset[ahead], offset[beyond]),
        speed, (drift[i], drift[ahead], drift[beyond]),
    )  # fmt: skip
    return ahead if speed >= 0.0 and place <= station[last] else -1, beyond, given


@njit(cache=True, error_model="numpy")
def advect(ski, memory, step):
    """Bring the memory from where the last step left it to where the points are ``step`` (s) later; what comes from
    ahead of the ski, or from a point that went backwards, is fresh snow.

    The law adds the step times a point's own drift, as backward Euler does.  A drift that varies along the ski adds to
    the offset here, so that in a steady turn the offset grows from station to station by the trapezoidal rule: by
    half the step times how much more the snow's place drifted when the step began; and where that place is between
    stations, by what the straight line between their offsets misses of a parabola.
    """
    for edge in range(2):
        for i in range(ski.station.shape[0]):
            ahead, _, given = coming_from(ski.station, memory, step, edge, i)
            groove, offset = arriving_memory(*given) if ahead >= 0 else (0.0, 0.0)
            memory.arrived_groove[edge, i], memory.arrived_offset[edge, i] = groove, offset


@njit(cache=True, error_model="numpy")
def advect_tangents(ski, memory, step, held, arrived):
    """Fill ``arrived`` (4m, d) with the tangents of the memory that ``advect`` brings, from those of what the last step
    left, ``held`` (6m, d).  It is called before the step's memory is accepted.
    """
    stations, slopes = ski.station.shape[0], np.zeros((2, 8))
    arrived[:] = 0.0
    for edge in range(2):
        for i in range(stations):
            ahead, beyond, given = coming_from(ski.station, memory, step, edge, i)
            if ahead < 0:
                continue
            arriving_memory_linearisation(*given, slopes)
            groove, offset = edge * stations, (2 + edge) * stations
            speed, drift = 4 * stations, 5 * stations
            rows = (
                groove + ahead, groove + beyond, offset + ahead, offset + beyond, speed + i, drift + i, drift + ahead,
                drift + beyond,
            )  # fmt: skip
            for part in range(2):
                row = (groove, offset)[part] + i
                for by in range(8):
                    slope = slopes[part, by]
                    if slope != 0.0:
                        for k in range(held.shape[1]):
                            arrived[row, k] += slope * held[rows[by], k]


@njit(cache=True, error_model="numpy")
def leave_tangents(left, kept, moved, arrived, held):
    """Fill ``held`` (6m, d) with the tangents of what a step leaves.

    left, kept : of a ski as ``EdgeLines`` has them;  moved : (i, d) of what moves the ski;  arrived : (4m, d)
    """
    np.dot(left, moved, held)
    rows = kept.shape[0]
    for row in range(rows):
        for part in range(2):
            for k in range(held.shape[1]):
                held[rows * part + row, k] += (
                    kept[row, part, 0] * arrived[row, k] + kept[row, part, 1] * arrived[rows + row, k]
                )


@njit(cache=True, error_model="numpy")
def pass_over(memory, low, i, upper, v_t, v_n):
    """Note that a station moves on: its deeper edge ``low`` leaves no groove until the law says so; the other one, at
    the depth ``upper`` (m), presses where the ski is flat, and has no wall.
    """
    memory.next_groove[low, i], memory.next_offset[low, i] = 0.0, 0.0
    memory.next_groove[1 - low, i] = max(upper, memory.arrived_groove[1 - low, i]) if upper > 0.0 else 0.0
    memory.next_offset[1 - low, i] = 0.0
    for edge in range(2):
        memory.next_speed[edge, i], memory.next_drift[edge, i] = v_t, v_n


@njit(cache=True, error_model="numpy")
def accept(memory):
    """Take what the step would leave as what it left."""
    for edge in range(2):
        for i in range(memory.groove.shape[1]):
            memory.groove[edge, i] = memory.next_groove[edge, i]
            memory.offset[edge, i] = memory.next_offset[edge, i]
            memory.speed[edge, i] = memory.next_speed[edge, i]
            memory.drift[edge, i] = memory.next_drift[edge, i]


@njit(cache=True, error_model="numpy")
def of_ski(memory, ski):
    """Return the memory of one ski out of that of both."""
    return Groove(
        memory.groove[ski], memory.offset[ski], memory.speed[ski], memory.drift[ski], memory.arrived_groove[ski],
        memory.arrived_offset[ski], memory.next_groove[ski], memory.next_offset[ski], memory.next_speed[ski],
        memory.next_drift[ski],
    )  # fmt: skip
