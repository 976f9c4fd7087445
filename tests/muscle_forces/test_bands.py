"""Bands of muscles and joint loads: for known draws, compared with what follows from them."""

from dataclasses import replace
from pathlib import Path

import gliding
import numpy as np
import pandas as pd
import pytest
import standing

from sssi_exudyn.bodies.muscles.muscles import skier_muscles
from sssi_exudyn.bodies.skier.chain import PRESCRIBED
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.noise import NORMAL_90
from sssi_exudyn.model.model import Model
from sssi_exudyn.motion.motion import spline_motion
from sssi_exudyn.muscle_forces.bands import EVERY, Errors, Nominal, errors_of, half_widths
from sssi_exudyn.muscle_forces.forces import JOINTS, MUSCLED, MuscleForces
from sssi_exudyn.muscle_forces.loads import Movement, joint_forces, joint_moments
from sssi_exudyn.results.draws import Draw, draws_of
from sssi_exudyn.results.folder import DRAW_ANGLES, DRAW_MASS
from sssi_exudyn.results.stored import StoredRun
from sssi_exudyn.results.summary import Summary
from sssi_exudyn.simulation.assembly import Parts

SAMPLES = 40


def model() -> Model:
    """Return level snow, on which a skier who stands stays where he is."""
    return replace(gliding.model(speed=0.0), inclination=0.0)


def nominal() -> Nominal:
    """Return a skier who stands; no moment is asked of his muscles, so that a draw alone asks for some."""
    time = 0.01 * np.arange(SAMPLES)
    angles = np.tile(standing.angles(), (SAMPLES, 1))
    zero = np.zeros((SAMPLES, len(PRESCRIBED)))
    return Nominal(model(), standing.geometry(), time, angles, zero, np.zeros((SAMPLES, 21, 3)))


def drawn(mass: float = 0.0, **angles: float) -> Draw:
    """Return a draw with another mass (kg) and other angles (rad)."""
    table = np.zeros((2, len(PRESCRIBED)))
    for name, value in angles.items():
        table[:, PRESCRIBED.index(name)] = value
    estimated = model()
    heavier = replace(estimated, skier=replace(estimated.skier, mass=estimated.skier.mass + mass))
    return Draw(np.array([0.0, 1.0]), table, heavier)


def wanted(forces: MuscleForces) -> Array:
    return forces.wanted


@pytest.fixture(scope="module")
def heavier() -> Errors:
    errors = errors_of(skier_muscles(standing.geometry()), nominal(), (drawn(4.0), drawn(-4.0)), 2)
    assert errors is not None
    return errors


@pytest.mark.long
def test_draws_like_the_estimate_have_no_band() -> None:
    errors = errors_of(skier_muscles(standing.geometry()), nominal(), (drawn(), drawn()), 2)
    assert errors is not None
    assert np.all(half_widths(errors, wanted, nominal().time) < 1e-9)  # the same numbers


@pytest.mark.long
def test_what_a_heavier_skier_asks_of_his_knees_is_by_hand(heavier: Errors) -> None:
    """Put half of 4 kg more above the knee, at the lever that the weight has there."""
    end = -1  # the skis have settled
    half_width = half_widths(heavier, wanted, heavier.time)[end, MUSCLED.index("knee_angle_r")]
    moments = [
        run.joint_moments[0, PRESCRIBED.index("knee_angle_r")]
        for run in (standing.standing(drawn(4.0).model), standing.standing(model()))
    ]
    # the tibia slides while the knee bends: a tenth of the moment; and the skis have not quite settled
    assert half_width == pytest.approx(NORMAL_90 * abs(float(moments[0] - moments[1])), rel=0.25)


@pytest.mark.long
def test_bands_are_between_the_instants_of_the_draws(heavier: Errors) -> None:
    assert np.allclose(np.diff(heavier.time), EVERY)
    widths = half_widths(heavier, lambda forces: np.linalg.norm(forces.contact, axis=2), nominal().time)
    assert widths.shape == (SAMPLES, len(JOINTS))
    assert np.all(widths[-1] > 0.0)


@pytest.mark.long
def test_one_draw_is_no_band() -> None:
    assert errors_of(skier_muscles(standing.geometry()), nominal(), (drawn(),), 2) is None


def test_moments_of_a_standing_skier_are_those_of_the_constraints() -> None:
    """Compare with ``standing``, which has them from the recursion and the feet's Jacobian alone."""
    estimated = model()
    stood = standing.standing(estimated)
    motion = spline_motion(standing.geometry(), 0.0, stood.time, stood.coordinates[:, 3:])
    parts, still = Parts(estimated, motion), np.zeros((SAMPLES, 31))
    snow = np.zeros((SAMPLES, 2, 3))
    snow[..., 2] = stood.foot_load
    movement = Movement(
        stood.time, stood.coordinates, still, still, stood.com, np.zeros((SAMPLES, 3)), snow, np.zeros((SAMPLES, 2, 3))
    )
    moments = joint_moments(parts, movement, stood.foot_position, np.zeros((SAMPLES, 2, 3)))
    assert np.allclose(moments, stood.joint_moments, atol=1e-6)  # ``STILL`` of the air
    # all forces together hold what weighs 800 N: no other force has to hold the pelvis
    assert np.allclose(joint_forces(parts, movement)[:, 0], 0.0, atol=1e-6)


def table(**changed: float) -> pd.DataFrame:
    """Return two draws at two instants."""
    rows = {"draw": [0, 1, 0, 1], "time_s": [0.0, 0.0, 1.0, 1.0], **dict.fromkeys(DRAW_ANGLES, 0.0)}
    return pd.DataFrame({**rows, DRAW_MASS: 76.0, "friction.mu_t": 0.08} | changed)


def test_draws_come_back_from_their_table() -> None:
    draws = draws_of(StoredRun(Summary(), pd.DataFrame(), model(), draws=table()), Path())
    assert len(draws) == 2
    assert draws[0].model.skier.mass == 76.0
    assert draws[0].model.friction.mu_t == 0.08
    assert np.array_equal(draws[1].at(np.array([0.5])), np.zeros((1, len(PRESCRIBED))))
    assert draws_of(StoredRun(Summary(), pd.DataFrame(), model()), Path()) == ()


@pytest.mark.parametrize(
    ("changed", "problem"),
    [
        ({DRAW_MASS: 700.0}, "700 kg is no skier's mass"),
        ({"friction.mu_t": 7.0}, "outside"),
        ({"glue.k": 1.0}, "no such number"),
        ({"friction.colour": 1.0}, "no such number"),
        ({DRAW_ANGLES[3]: 9.0}, "angles that are none"),
        ({"time_s": 1.0}, "times that do not grow"),
    ],
)
def test_draws_of_another_model_are_refused(changed: dict[str, float], problem: str) -> None:
    with pytest.raises(InputError, match=problem):
        draws_of(StoredRun(Summary(), pd.DataFrame(), model(), draws=table(**changed)), Path())
