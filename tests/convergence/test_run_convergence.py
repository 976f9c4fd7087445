"""The full model over steps and elements, and what must not change a run."""

from dataclasses import replace
from functools import cache
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from bundled import bundled

from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.model.model import Model
from sssi_exudyn.motion.motion import Motion
from sssi_exudyn.recording.read import read_recording
from sssi_exudyn.simulation.full.run import simulate
from sssi_exudyn.simulation.result import SimulationResult

EXAMPLES = Path(__file__).parents[2] / "examples"


@cache
def given(name: str) -> tuple[Model, Motion]:
    recording, motion = bundled(name)
    return model_of(recording, motion), motion


def run(seconds: float, name: str = "beginner", **solver: float) -> SimulationResult:
    model, motion = given(name)
    tight = {"relative_tolerance": 1e-6, **solver}
    return simulate(replace(model, solver=replace(model.solver, **tight)), motion, stop=motion.start + seconds)


@pytest.mark.long
def test_order_of_the_step() -> None:
    """Generalised-α is of second order; the first step's estimated acceleration costs it nothing visible."""
    steps = (0.01, 0.005, 0.0025, 0.00125)
    # fewer elements than usual, for speed: it is the steps that are refined
    ends = [run(1.0, step=step, elements=20).pelvis[-1] for step in steps]
    apart = [float(np.linalg.norm(a - b)) for a, b in pairwise(ends)]
    assert apart[0] < 0.01  # m, of 5 m of path
    assert apart[1] < 0.002
    assert np.log2(apart[0] / apart[2]) / 2.0 > 1.5  # the power law and the points' coming and going cost a little of 2


@pytest.mark.long
def test_elements() -> None:
    ends = {elements: run(1.0, "intermediate", elements=elements).pelvis[-1] for elements in (20, 50, 100)}
    # The elements' error is of second order: 20 and 3 µm of 20 and 50 elements.  Where edges change, as in the
    # beginner's first second, it counts as much in which element a contact point lies: 18 µm of 20 and of 50.
    coarse = float(np.linalg.norm(ends[20] - ends[100]))
    usual = float(np.linalg.norm(ends[50] - ends[100]))
    assert usual < 0.002  # m: a tenth of what the GPS can see
    assert usual < 0.7 * coarse


@pytest.mark.long
def test_heading_of_the_slope_and_clock_do_not_matter() -> None:
    """The same movement on a slope that falls another way, recorded an hour later, is the same run."""
    model, motion = given("beginner")
    first = simulate(model, motion, stop=motion.start + 1.0)
    later = replace(motion, knots=motion.knots + 3600.0, start=motion.start + 3600.0, stop=motion.stop + 3600.0)
    second = simulate(replace(model, fall_line_azimuth=model.fall_line_azimuth + 1.0), later, stop=later.start + 1.0)
    # clocks an hour on have 10⁻¹² s less of resolution, and the spline is evaluated with it
    np.testing.assert_allclose(second.pelvis, first.pelvis, atol=1e-6)
    np.testing.assert_allclose(second.foot_load, first.foot_load, atol=1e-3 * first.foot_load.max())


@pytest.mark.long
def test_energy_balance_of_a_run() -> None:
    assert run(3.0, step=0.005).closure_percent < 0.1  # 1 % is asked


@pytest.mark.long
def test_torsional_stiffness_matters_little() -> None:
    """The paper's reason for not measuring GJ (2.2.2)."""
    model, motion = given("intermediate")
    paths = []
    for factor in (1.0, 0.5, 2.0):
        ski = replace(model.ski, shear_modulus=factor * model.ski.shear_modulus)
        paths.append(simulate(replace(model, ski=ski), motion, stop=motion.start + 3.0).com)
    for other in paths[1:]:
        # 0.3 % of a path of 33 m, less than the trajectory errors of the paper (0.6 and 0.7 %)
        assert np.max(np.linalg.norm(other - paths[0], axis=1)) < 0.1


@pytest.mark.long
def test_the_carved_turn_needs_more_resistance_across() -> None:
    """With the skidder's μ_n the intermediate skier slides away from his track (paper 3.1)."""
    model, motion = given("intermediate")
    recording = read_recording(EXAMPLES / "intermediate")
    assert recording.gps is not None
    fixes = recording.gps.time[recording.gps.time <= 4.0]
    errors = []
    for mu_n in (0.5, 0.9):
        run = simulate(model.with_values({"friction.mu_t": 0.19, "friction.mu_n": mu_n}), motion, stop=4.0)
        assert run.antenna is not None
        from sssi_exudyn.fitting.observations import predict_fixes, track_of

        track = track_of(recording.gps, model.fall_line_azimuth, 0.0, float(fixes[-1]))
        seen = predict_fixes(model, run.time, run.antenna, track.time)[:, :2]
        errors.append(float(np.mean(np.linalg.norm(seen - track.place, axis=1))))
    assert errors[1] < 0.5 * errors[0]
