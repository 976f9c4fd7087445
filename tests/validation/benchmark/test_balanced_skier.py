"""The benchmark's skier balances: on other snow the steady residual moment stays small."""

from dataclasses import replace

import numpy as np
import pytest
from bundled import bundled

from sssi_exudyn.fitting.balance import balance_of
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.model.model import Model
from sssi_exudyn.motion.motion import Motion
from sssi_exudyn.simulation.reduced.prepared import prepare
from sssi_exudyn.simulation.reduced.run import simulate_reduced
from sssi_exudyn.validation.benchmark.balanced_skier import balance_skier


def steady_moment(model: Model, motion: Motion) -> float:
    """Return the moment (N m) across the skier, mean over the run but for its ends."""
    prepared = prepare(model, motion, step=0.01)
    run = simulate_reduced(model, prepared)
    inside = slice(40, -40)
    return float(np.mean(balance_of(model, motion, prepared, run).residual(run, prepared)[inside, 1]))


@pytest.mark.long
def test_more_friction_is_leant_against() -> None:
    recording, full_motion = bundled("beginner")
    motion = replace(full_motion, stop=full_motion.start + 4.0)
    model = model_of(recording, motion).with_values({"friction.mu_t": 0.16, "friction.mu_n": 0.55})
    # 0.1 more friction of 80 kg on a slope, a metre below the pelvis' place, is a moment of 50 N m and more
    before = steady_moment(model, motion)
    assert abs(before) > 30.0
    balanced = balance_skier(model, motion, recording)
    assert abs(steady_moment(model, balanced)) < 0.2 * abs(before)
    assert (balanced.start, balanced.stop) == (motion.start, motion.stop)
