"""The lean that balances a skier on snow that edges cut."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from bundled import bundled
from gliding import model, standing

from sssi_exudyn.analysis.biomechanics import residual_moment_vector
from sssi_exudyn.bodies.skier.chain import PRESCRIBED
from sssi_exudyn.contact.registry import combine_terms
from sssi_exudyn.contact.terms.carving import Carving
from sssi_exudyn.core.frames import slope_to_level
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.motion.correction import correct_posture
from sssi_exudyn.simulation.full.run import simulate
from sssi_exudyn.simulation.reduced.balanced_lean import WINDOW, balance, lean_by, roll_left_over
from sssi_exudyn.simulation.reduced.carved_run import carved_run
from sssi_exudyn.simulation.reduced.prepared import prepare

LIST = PRESCRIBED.index("pelvis_list")


def windows(values: np.ndarray, count: int) -> np.ndarray:
    return np.array([part.mean() for part in np.array_split(values, count)])


@pytest.mark.long
def test_what_is_left_over_in_roll_is_what_inverse_dynamics_find() -> None:
    recording, motion = bundled("intermediate")
    paper = model_of(recording, motion)
    snow = Carving(mu=0.13, hardness=0.54e8, strength=0.9e5)
    tried = replace(paper, terms=combine_terms(paper.terms, (snow,)))
    seconds = 1.0
    left_over = roll_left_over(carved_run(tried, prepare(tried, motion, stop=motion.start + seconds)))
    run = simulate(tried, motion, stop=motion.start + seconds)
    way = (run.com_velocity @ slope_to_level(motion.inclination).T)[:, :2]
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    expected = np.sum(residual_moment_vector(run)[:, :2] * way, axis=1)
    count = round(seconds / 0.1)
    assert np.abs(windows(expected, count)).max() > 40.0
    # the residual moment makes up for what is left over; 3 N of load, half a metre aside of the centre of mass
    np.testing.assert_allclose(windows(left_over, count)[1:], -windows(expected, count)[1:], atol=3.0)


@pytest.mark.long
def test_a_skier_who_would_fall_leans() -> None:
    """Skis edged to the left under an upright skier: their turn would throw him over to the outside."""
    seconds = 0.6
    edged = standing(seconds, hip_adduction_l=0.12, hip_adduction_r=-0.14)
    tried = model((Carving(mu=0.05),), speed=8.0)
    balanced = balance(tried, edged)
    assert len(balanced.before) == round(seconds / WINDOW)
    rms = [np.sqrt(np.mean(moment**2)) for moment in (balanced.before, balanced.after)]
    assert rms[1] < 0.5 * rms[0]
    assert 0.01 < np.abs(balanced.lean).max() < 0.5
    again = windows(roll_left_over(carved_run(balanced.model, prepare(balanced.model, edged))), len(balanced.after))
    np.testing.assert_allclose(again, balanced.after)
    # on other snow the search goes on from that lean, and ends where one from none does
    other = tried.with_values({"carving.mu": 0.07})
    from_none, onwards = balance(other, edged), balance(other, edged, begin=balanced)
    assert np.sqrt(np.mean(onwards.before**2)) < 0.5 * np.sqrt(np.mean(from_none.before**2))
    np.testing.assert_allclose(onwards.lean, from_none.lean, atol=np.radians(1.0))


def test_a_lean_is_added_to_what_is_corrected_already() -> None:
    motion = standing(1.0)
    once = lean_by(model(), np.array([0.0, 1.0]), np.array([0.02, 0.02]))
    twice = lean_by(once, np.array([0.0, 0.5, 1.0]), np.array([0.0, 0.01, 0.02]))
    angles = correct_posture(motion, twice.posture).evaluate(np.array([0.0, 0.5, 1.0]))[0]
    np.testing.assert_allclose(angles[:, LIST], [0.02, 0.03, 0.04], atol=1e-9)
    others = np.delete(angles - motion.evaluate(np.zeros(3))[0], LIST, axis=1)
    np.testing.assert_allclose(others, 0.0, atol=1e-12)
