"""Five seconds of a bundled run, fitted."""

from __future__ import annotations

from dataclasses import replace

from bundled import bundled

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
