"""A run that is led along fixes: fixes of the model's own runs, whose braking and turns are known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from bundled import bundled
from strapped import write_few

from sssi_exudyn.bodies.skier.chain import PRESCRIBED
from sssi_exudyn.contact.terms.friction_corrections import Braking
from sssi_exudyn.core.frames import Array, slope_to_level
from sssi_exudyn.core.noise import ExponentialNoise
from sssi_exudyn.fitting.few_sensors.led_run import Fixes, lead
from sssi_exudyn.fitting.first_fit import problem_of
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.model.model import Model
from sssi_exudyn.motion.correction import PostureCorrection
from sssi_exudyn.motion.from_recording import motion_from_recording
from sssi_exudyn.motion.motion import Motion
from sssi_exudyn.recording.read import read_recording
from sssi_exudyn.simulation.heading import HEADING
from sssi_exudyn.simulation.reduced.prepared import COARSE_STEP, ReducedRun, prepare
from sssi_exudyn.simulation.reduced.run import simulate_reduced

NOISE = ExponentialNoise(0.35, 20.0)
"""m, s; of a receiver that states a metre."""


def over_ground(model: Model, vectors: Array) -> Array:
    return np.asarray((vectors @ slope_to_level(model.inclination).T)[:, :2])


def run_of(model: Model, motion: Motion) -> ReducedRun:
    return simulate_reduced(model, prepare(model, motion, step=COARSE_STEP))


@pytest.fixture(scope="module")
def skied(tmp_path_factory: pytest.TempPathFactory) -> tuple[Model, Motion, ReducedRun]:
    """Return a model, the motion that a telephone in a pocket shows, and their run as it is."""
    folder = tmp_path_factory.mktemp("led") / "phone"
    recording = read_recording(write_few(bundled("beginner")[0], ("pocket",), folder))
    motion = motion_from_recording(recording)
    model = problem_of(recording, motion, model_of(recording, motion), "joint").model
    model = model.with_values({"friction.mu_t": 0.12, "friction.mu_n": 0.7})
    return model, motion, run_of(model, motion)


def with_truth(model: Model, motion: Motion, turn: float, braking: float) -> Model:
    """Return the model of a skier whose posture points ``turn`` rad farther left and who brakes in the middle."""
    middle = 0.5 * (motion.start + motion.stop)
    angles = np.zeros((2, len(PRESCRIBED)))
    angles[:, HEADING] = turn
    posture = PostureCorrection(np.array([motion.start, motion.stop]), angles)
    return replace(model, posture=posture, terms=(*model.terms, Braking(braking, middle, 3.0)))


def led_to(
    skied: tuple[Model, Motion, ReducedRun], truth: ReducedRun, noise: Array | None = None
) -> tuple[Model, ReducedRun, Array, Array]:
    """Lead the run to fixes of another one; return model, run, and what it misses of place and speed at the fixes."""
    model, motion, run = skied
    time = np.arange(truth.time[0], truth.time[-1], 1.0)

    def at_fixes(made: ReducedRun, vectors: Array) -> Array:
        level = over_ground(model, vectors)
        return np.stack([np.interp(time, made.time, column) for column in level.T], axis=1)

    place = at_fixes(truth, truth.antenna) + (0.0 if noise is None else noise[: len(time)])
    speed = np.linalg.norm(at_fixes(truth, truth.com_velocity), axis=1)
    fixes = Fixes(time, speed, 0.1, 1.0, NOISE, float(np.radians(13.0)))
    led, made = lead(
        model,
        prepare(model, motion, step=COARSE_STEP),
        run,
        fixes,
        lambda _, other: place - at_fixes(other, other.antenna),
    )
    slower = speed - np.linalg.norm(at_fixes(made, made.com_velocity), axis=1)
    return led, made, place - at_fixes(made, made.antenna), slower


@pytest.mark.long
@pytest.mark.parametrize(("turn_deg", "braking"), [(8.0, 0.0), (0.0, 0.1), (-6.0, 0.08)])
def test_a_run_is_led_to_the_track_of_another(
    skied: tuple[Model, Motion, ReducedRun], turn_deg: float, braking: float
) -> None:
    model, motion, run = skied
    truth = run_of(with_truth(model, motion, float(np.radians(turn_deg)), braking), motion)
    apart = over_ground(model, truth.antenna - run.antenna)
    led, _, missed, slower = led_to(skied, truth)
    assert np.max(np.linalg.norm(apart, axis=1)) > 3.0  # otherwise there is nothing to lead
    assert np.sqrt(np.mean(np.sum(missed**2, axis=1))) < np.sqrt(2.0) * NOISE.sigma
    assert np.sqrt(np.mean(slower**2)) < 0.3  # three times what speeds are wrong by: braking has corners every 2.5 s
    assert led.posture is not None
    turned = led.posture.at(np.linspace(motion.start, motion.stop, 50))[:, HEADING]
    # a start that is unknown takes up some of it, and each turn's own course some more
    assert np.degrees(np.mean(turned)) == pytest.approx(turn_deg, abs=3.0)


@pytest.mark.long
def test_a_run_that_is_right_is_left_alone(skied: tuple[Model, Motion, ReducedRun]) -> None:
    model, _, run = skied
    led, made, missed, _ = led_to(skied, run)
    assert np.max(np.abs(missed)) < 0.05
    braking = [term.delta_mu for term in led.terms if isinstance(term, Braking)]
    assert np.max(np.abs(braking)) < 0.005
    assert led.posture is not None
    assert np.degrees(np.max(np.abs(led.posture.angles))) < 0.5
    assert led.value("start.f") == pytest.approx(model.value("start.f"), abs=0.05)
    assert np.max(np.abs(made.com - run.com)) < 0.1


@pytest.mark.long
def test_fixes_that_no_skier_follows_turn_him_within_bounds(skied: tuple[Model, Motion, ReducedRun]) -> None:
    """They run aside at 40 m/s for two seconds: the posture would turn by more than a model's file may hold."""
    run = skied[2]
    time = np.arange(run.time[0], run.time[-1], 1.0)
    aside = np.stack([np.zeros(len(time)), 40.0 * np.clip(time - 4.0, 0.0, 2.0)], axis=1)
    led, _, _, _ = led_to(skied, run, aside)
    assert led.posture is not None
    assert 1.0 < np.max(np.abs(led.posture.angles)) <= 1.5


@pytest.mark.long
def test_an_error_of_all_fixes_moves_the_start_and_not_the_skier(skied: tuple[Model, Motion, ReducedRun]) -> None:
    run = skied[2]
    led, _, _, slower = led_to(skied, run, np.full((1000, 2), [0.3, -0.2]))
    assert led.posture is not None
    assert np.degrees(np.max(np.abs(led.posture.angles))) < 0.5
    assert np.max(np.abs(slower)) < 0.1
