"""What the snow remembers of skis that cut it: a template that ``compiled`` joins with the kernels of their edges."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sssi_exudyn.core.frames import Array
from sssi_exudyn.runtime.jit import njit


class Groove(NamedTuple):
    """The snow's memory along both edges: depth of the groove and offset from its wall, each (2, m) m.

    groove, offset : as the last step left them
    speed, drift : (2, m) m/s of the points along and across their edges then
    arrived_groove, arrived_offset : as they arrive at the points by the end of this step
    next_groove, next_offset, next_speed, next_drift : as this step would leave them
    """

    groove: Array
    offset: Array
    speed: Array
    drift: Array
    arrived_groove: Array
    arrived_offset: Array
    next_groove: Array
    next_offset: Array
    next_speed: Array
    next_drift: Array

    @classmethod
    def fresh(cls, *shape: int) -> Groove:
        """The memory of fresh snow: arrays of that shape, (2, m) for a ski and (2, 2, m) for both."""
        return cls(*np.zeros((len(cls._fields), *shape)))


@njit(cache=True, error_model="numpy")
def between_stations(station, first, place):
    """The stations that a place lies between, searched from ``first`` on, and the share of the way to the second."""
    last = station.shape[0] - 1
    ahead = first
    while ahead < last and station[ahead + 1] < place:
        ahead += 1
    beyond = min(ahead + 1, last)
    share = (place - station[ahead]) / (station[beyond] - station[ahead]) if beyond > ahead else 0.0
    return ahead, beyond, share


@njit(cache=True, error_model="numpy")
def passing_time(station, ahead, beyond, share, speed, step):
    """How long ago the snow at a place between two stations passed the first, s; ``step`` where nothing moves."""
    return share * (station[beyond] - station[ahead]) / speed if speed > 0.0 else step


@njit(cache=True, error_model="numpy")
def advect(ski, memory, step):
    """Bring the memory from where the last step left it to where the points are ``step`` (s) later; what comes from
    ahead of the ski, or from a point that went backwards, is fresh snow.

    The law adds the step times a point's own drift, as backward Euler does.  A drift that varies along the ski adds to
    the offset here, so that in a steady turn the offset grows from station to station by the trapezoidal rule: by
    half the step times how much more the snow's place drifted when the step began; and where that place is between
    stations, by what the straight line between their offsets misses of a parabola.
    """
    station = ski.station
    last = station.shape[0] - 1
    for edge in range(2):
        for i in range(last + 1):
            speed = memory.speed[edge, i]
            place = station[i] + step * speed
            groove, offset = 0.0, 0.0
            if speed >= 0.0 and place <= station[last]:
                ahead, beyond, share = between_stations(station, i, place)
                groove = memory.groove[edge, ahead] + share * (memory.groove[edge, beyond] - memory.groove[edge, ahead])
                offset = memory.offset[edge, ahead] + share * (memory.offset[edge, beyond] - memory.offset[edge, ahead])
                since = passing_time(station, ahead, beyond, share, speed, step)
                rising = memory.drift[edge, beyond] - memory.drift[edge, ahead]
                drifted = memory.drift[edge, ahead] + share * rising - memory.drift[edge, i]
                offset += 0.5 * (step * drifted + (1.0 - share) * since * rising)
            memory.arrived_groove[edge, i] = groove
            memory.arrived_offset[edge, i] = offset


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
    """The memory of one ski out of that of both."""
    return Groove(
        memory.groove[ski], memory.offset[ski], memory.speed[ski], memory.drift[ski], memory.arrived_groove[ski],
        memory.arrived_offset[ski], memory.next_groove[ski], memory.next_offset[ski], memory.next_speed[ski],
        memory.next_drift[ski],
    )  # fmt: skip
