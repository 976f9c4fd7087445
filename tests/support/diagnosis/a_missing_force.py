"""Five seconds of a fitted run, and what a force on a ski does to it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from bundled import bundled

from sssi_exudyn.core.frames import Array
from sssi_exudyn.fitting.first_fit import problem_of
from sssi_exudyn.fitting.observations import measurements_of
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.simulation.reduced.prepared import prepare
from sssi_exudyn.simulation.reduced.run import simulate_reduced
from sssi_exudyn.validation.diagnosis.hypotheses.hypothesis import FittedRun


def five_seconds() -> FittedRun:
    """Five seconds of a run, which have transitions, by the reduced model."""
    recording, motion = bundled("beginner")
    motion = replace(motion, stop=motion.start + 5.0)
    model = problem_of(recording, motion, model_of(recording, motion), "joint").model
    model = model.with_values({"start.clock_offset": 0.003})  # fixes between the run's instants, where its course bends
    prepared = prepare(model, motion, step=0.01)
    run = simulate_reduced(model, prepared)
    measurements = measurements_of(recording, model, motion.start, motion.stop)
    return FittedRun(model, prepared, run, measurements, measurements.predict(model, run))


def courses(fitted: FittedRun, foot: int) -> Array:
    """(2, c) the direction of a ski in the snow's plane in each cell."""
    middles = 0.5 * (fitted.time_edges[1:] + fitted.time_edges[:-1])
    forward = fitted.run.foot_forward[:, foot]
    forward_in_cells = np.stack([np.interp(middles, fitted.run.time, forward[:, axis]) for axis in range(2)])
    return np.asarray(forward_in_cells / np.linalg.norm(forward_in_cells, axis=0))


def shaped(responses: Array, course: Array) -> Array:
    """(N, 2, c) responses to a newton along and across ``course`` at the centre of mass."""
    by_f, by_l, _ = responses.reshape(len(responses), 3, -1).transpose(1, 0, 2)
    return np.stack([by_f * course[0] + by_l * course[1], by_l * course[0] - by_f * course[1]], axis=1)
