"""Turns of a run from one sensor on the skier, for instance a telephone in a pocket.

A thigh or a trunk turns about up as the skis do, with kicks of its own, and leans to the inside of the turn.  Yaw rate
and lean change sign together, and their noise is different, so that both together tell the sides better than one.  How
the sensor sits, and so in which of its axes the lean shows, is unknown; the run itself tells:

    turning = w₀ · yaw rate + w · (up in the sensor's axes)

with the weights that best separate the turns to the left from those to the right (Fisher's linear discriminant).  First
the yaw rate alone tells the sides, then the weights and the sides are estimated in turn.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from sssi_exudyn.analysis.turns import Turns, turns_of_course
from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.rotations import lowpass

CUTOFF: Final = 1.0
"""Cut-off of yaw rate and lean, Hz: turns are slower, and the faster motion of a pocket is not the skis'."""
RIDGE: Final = 0.1
"""Weight of the discriminant's ridge: the share of a channel's variance that is taken to be noise of the run."""
ROUNDS: Final = 3
"""Rounds of weights and sides; six give the same."""
FEWEST: Final = 5
"""Least number of turns from which the four weights are estimated; with fewer the yaw rate alone tells the turns."""


def turns_of_sensor(time: Array, yaw_rate: Array, up: Array, speed: Array) -> Turns:
    """Find the turns of a skier from a sensor on the body.

    Parameters
    ----------
    time : (n,) s, evenly spaced
    yaw_rate : (n,) rad/s about up, left positive
    up : (n, 3) the vertical in the sensor's axes
    speed : (n,) m/s over ground
    """
    rate = 1.0 / float(time[1] - time[0])
    cutoff = min(CUTOFF, 0.4 * rate)
    channels = lowpass(np.column_stack([yaw_rate, up]), rate, cutoff)
    size = float(np.std(channels[:, 0]))
    channels = channels - channels.mean(axis=0)
    channels /= np.maximum(np.std(channels, axis=0), 1e-12)  # a sensor that never moves must not divide by nothing
    spread = channels.T @ channels / len(time) + RIDGE * np.eye(channels.shape[1])
    course = _integral(yaw_rate, rate)
    turns = turns_of_course(time, course, speed)
    for _ in range(ROUNDS):
        if len(turns.turns) < FEWEST:
            break
        side = _sides(time, turns)
        turning = channels @ np.linalg.solve(spread, channels.T @ side)
        turns = turns_of_course(time, _integral(turning * size / float(np.std(turning)), rate), speed)
    return replace(turns, course=(time, course))


def _sides(time: Array, turns: Turns) -> Array:
    """Return 1 in turns to the left and -1 in those to the right, else 0, less the mean (n,)."""
    side = np.zeros(len(time))
    for turn in turns.turns:
        side[(time >= turn.start) & (time <= turn.end)] = 1.0 if turn.side == "left" else -1.0
    return np.asarray(side - side.mean())


def _integral(rate: Array, sampling: float) -> Array:
    return np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1])) / sampling])
