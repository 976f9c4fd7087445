"""Responses to a force in cells of time, along and across the skis."""

from __future__ import annotations

import numpy as np

from sssi_exudyn.core.frames import Array
from sssi_exudyn.validation.diagnosis.hypotheses.hypothesis import FittedRun


def courses(fitted: FittedRun, foot: int) -> Array:
    """(2, c) the direction of a ski in the snow's plane in each cell."""
    middles = 0.5 * (fitted.time_edges[1:] + fitted.time_edges[:-1])
    forward = fitted.run.foot_forward[:, foot]
    course = np.stack([np.interp(middles, fitted.run.time, forward[:, axis]) for axis in range(2)])
    return np.asarray(course / np.linalg.norm(course, axis=0))


def shaped(responses: Array, course: Array) -> Array:
    """(N, 2, c) responses to a newton along and across ``course`` at the centre of mass."""
    by_f, by_l, _ = responses.reshape(len(responses), 3, -1).transpose(1, 0, 2)
    return np.stack([by_f * course[0] + by_l * course[1], by_l * course[0] - by_f * course[1]], axis=1)
