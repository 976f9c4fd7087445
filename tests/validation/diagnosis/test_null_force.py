"""The force that every explanation of a telephone's run has."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from bundled import bundled

from sssi_exudyn.core.frames import Array
from sssi_exudyn.fitting.noise import NULL_FORCE
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.simulation.reduced.run import simulate_reduced
from sssi_exudyn.validation.diagnosis.context import Nuisances, diagnosis_problem, nuisances_of
from sssi_exudyn.validation.diagnosis.hypotheses.catalogue import LATENT_FORCE
from sssi_exudyn.validation.diagnosis.hypotheses.hypothesis import FittedRun, responses_of


def nuisances_and_force(stated: float) -> tuple[Nuisances, Array, Array]:
    """Return what may vary in a run whose receiver states ``stated`` m, variances (N,) of what the force does to the
    measurements, and of their noise.
    """
    recording, motion = bundled("beginner")
    assert recording.gps is not None
    gps = replace(recording.gps, sigma=np.full(len(recording.gps.time), stated))
    recording, motion = replace(recording, gps=gps), replace(motion, stop=motion.start + 3.0)
    problem = diagnosis_problem(recording, motion, model_of(recording, motion))
    made = nuisances_of(problem, problem.model, np.zeros(len(problem.errors) + 1), ())
    run, seen = simulate_reduced(problem.model, problem.prepared), problem.measurements
    fitted = FittedRun(problem.model, problem.prepared, run, seen, seen.predict(problem.model, run))
    responses = responses_of(LATENT_FORCE.probes(fitted), problem.prepared, seen)
    edges = fitted.time_edges
    middles = 0.5 * (edges[1:] + edges[:-1])
    alike = NULL_FORCE.size**2 * np.exp(-np.abs(middles[:, None] - middles) / NULL_FORCE.memory)
    noise = np.concatenate([np.full(at.stop - at.start, seen.usual.of(name).sigma) for name, at in seen.blocks.items()])
    return made, np.sum((responses @ np.kron(np.eye(3), alike)) * responses, axis=1), noise**2


@pytest.mark.long(seconds=12)
def test_a_telephone_s_run_has_a_force_of_any_course_and_another_receiver_s_none() -> None:
    by_receiver, _, _ = nuisances_and_force(0.02)
    by_telephone, expected, noise = nuisances_and_force(2.0)
    assert by_receiver.force.shape[1] == 0
    more = by_telephone.force
    assert more.shape[1] > 0
    # a direction that is left out is below 0.02 of the noise of all measurements, and there are fewer than 24
    assert np.all(np.abs(expected - np.sum(more**2, axis=1)) < 24.0 * 0.02**2 * noise)
