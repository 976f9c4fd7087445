"""Turns and speed of a recording, before any simulation."""

from __future__ import annotations

from typing import Final

import numpy as np

from sssi_exudyn.analysis.sensor_turns import turns_of_sensor
from sssi_exudyn.analysis.turns import LEAST_SAMPLES, Turns, find_turns
from sssi_exudyn.recording.few_sensors.course import velocity_of
from sssi_exudyn.recording.inspection import Skiing, TurnSpan
from sssi_exudyn.recording.recording import Recording

AROUND: Final = 1.0
"""s kept before the first turn and after the last one: a start from rest to the speed of a beginner takes as long."""
WORTH: Final = 2.0
"""s without turns at either end from which a crop is suggested: a turn of a beginner lasts as long."""


def recorded_turns(recording: Recording, start: float, stop: float) -> Turns | None:
    """Return the turns from ``start`` to ``stop`` (s) as a sensor on the skier shows them; None where none does.

    Receivers smooth the course, and a path that follows it misses quick turns.
    """
    completed, gps = recording.completed, recording.gps
    if completed is None or completed.turning is None or gps is None:
        return None
    sensor = completed.turning
    inside = (sensor.time >= start) & (sensor.time <= stop)
    time, speed = sensor.time[inside], np.linalg.norm(velocity_of(gps), axis=1)
    if len(time) < LEAST_SAMPLES:
        return None
    return turns_of_sensor(time, sensor.yaw_rate[inside], sensor.rotation[inside, 2], np.interp(time, gps.time, speed))


def skiing_of(recording: Recording) -> Skiing | None:
    """Find turns, top speed and a crop around the turns of a recording; None without fixes.

    The turns are those of a sensor on the skier, where one shows them: receivers smooth the course.  Else they are the
    track's.
    """
    gps = recording.gps
    if gps is None:
        return None
    within = gps.between(recording.start, recording.stop)
    time, track = gps.time[within], gps.enu[within]
    top = float(np.max(np.linalg.norm(velocity_of(gps), axis=1)[within]))
    turns = (recorded_turns(recording, recording.start, recording.stop) or find_turns(time, track)).turns
    start = stop = None
    if turns:
        first, last = (max(recording.start, turns[0].start - AROUND), min(recording.stop, turns[-1].end + AROUND))
        if first - recording.start > WORTH or recording.stop - last > WORTH:
            start, stop = first, last
    return Skiing(tuple(TurnSpan(turn.side, turn.start, turn.end) for turn in turns), top, start, stop)
