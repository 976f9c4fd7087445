"""Turns and speed of a recording, before any simulation."""

from __future__ import annotations

from typing import Final

import numpy as np

from sssi_exudyn.analysis.sensor_turns import turns_of_sensor
from sssi_exudyn.analysis.turns import find_turns
from sssi_exudyn.recording.inspection import Skiing, TurnSpan
from sssi_exudyn.recording.recording import Recording

AROUND: Final = 1.0
"""s kept before the first turn and after the last one: a start from rest to the speed of a beginner takes as long."""
WORTH: Final = 2.0
"""s without turns at either end from which a crop is suggested: a turn of a beginner lasts as long."""


def skiing_of(recording: Recording) -> Skiing | None:
    """Find turns, top speed and a crop around the turns of a recording; None without fixes.

    The turns are those of a sensor on the skier, where one shows them: receivers smooth the course.  Else they are the
    track's.
    """
    gps = recording.gps
    if gps is None:
        return None
    within = (gps.time >= recording.start) & (gps.time <= recording.stop)
    time, track = gps.time[within], gps.enu[within]
    speed = np.linalg.norm(np.diff(track, axis=0), axis=1) / np.diff(time)
    sensor = None if recording.completed is None else recording.completed.turning
    if sensor is None:
        turns = find_turns(time, track).turns
    else:
        inside = (sensor.time >= recording.start) & (sensor.time <= recording.stop)
        at = sensor.time[inside]
        turns = turns_of_sensor(
            at, sensor.yaw_rate[inside], sensor.rotation[inside, 2], np.interp(at, time[1:], speed)
        ).turns
    start = stop = None
    if turns:
        first, last = (max(recording.start, turns[0].start - AROUND), min(recording.stop, turns[-1].end + AROUND))
        if first - recording.start > WORTH or recording.stop - last > WORTH:
            start, stop = first, last
    return Skiing(tuple(TurnSpan(turn.side, turn.start, turn.end) for turn in turns), float(np.max(speed)), start, stop)
