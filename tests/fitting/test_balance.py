"""The moment that is left over about the pelvis: by hand for a standing skier, and as the full model has it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from bundled import bundled

from sssi_exudyn.bodies.skier.chain import COORDINATE, PRESCRIBED, average_geometry, forward_kinematics
from sssi_exudyn.core.frames import GRAVITY
from sssi_exudyn.fitting.balance import balance_of, own_moment
from sssi_exudyn.fitting.measurements import averages
from sssi_exudyn.model.from_recording import first_guess, model_of
from sssi_exudyn.motion.correction import PostureCorrection, correct_posture
from sssi_exudyn.motion.motion import spline_motion
from sssi_exudyn.simulation.assembly import Parts, correct_motion
from sssi_exudyn.simulation.full import simulate
from sssi_exudyn.simulation.prepared import prepare
from sssi_exudyn.simulation.reduced import simulate_reduced

TURNS = ("pelvis_rotation", "pelvis_list", "pelvis_tilt")


def test_a_standing_skier_by_hand() -> None:
    """On level ground the body's own moment is its weight at its centre of mass."""
    recording, motion = bundled("beginner")
    model = replace(model_of(recording, motion), inclination=0.0)
    time = np.linspace(0.0, 1.0, 12)
    standing = spline_motion(average_geometry(1.7), 0.0, time, np.zeros((12, 28)))
    parts = Parts(model, standing)
    com = parts.posture(time).com_place[0]
    expected = np.cross(com, [0.0, 0.0, parts.body_mass * GRAVITY])
    np.testing.assert_allclose(own_moment(parts, time), np.tile(expected, (12, 1)), atol=1e-9)


@pytest.mark.long
def test_the_reduced_model_leaves_over_what_the_full_one_does() -> None:
    """Of a posture out of balance: the trunk bent forwards and to one side by 30°."""
    recording, motion = bundled("beginner")
    bent = np.zeros((2, len(PRESCRIBED)))
    bent[:, [PRESCRIBED.index(name) for name in ("lumbar_extension", "lumbar_bending")]] = np.radians([-30.0, 30.0])
    motion = correct_posture(motion, PostureCorrection(np.array([motion.start, motion.stop]), bent))
    model = model_of(recording, motion)
    assert recording.gps is not None
    start = first_guess(recording.gps, motion, model.inclination, model.fall_line_azimuth)
    model = replace(model, start=start).with_values({"friction.mu_t": 0.06, "friction.mu_n": 0.55})
    stop = motion.start + 4.0
    full = simulate(model, motion, stop=stop)
    prepared = prepare(model, motion, stop=stop, step=0.005)
    run = simulate_reduced(model, prepared)
    moved = correct_motion(model, motion)
    found = balance_of(model, moved, prepared.correct_capture(model), run).residual(run, prepared)
    # The full model gives the moments along the pelvis' three axes, which are not square to each other.
    poses = forward_kinematics(motion.geometry, full.coordinates, motion.inclination)
    axes = np.stack([poses.axes[:, COORDINATE[name]] for name in TURNS], axis=1)
    along = full.joint_moments[:, [full.moment_names.index(name) for name in TURNS]]
    expected = np.linalg.solve(axes, along[..., None])[..., 0]
    windows = np.arange(motion.start + 0.4, stop - 0.4, 0.1)
    apart = averages(run.time, found, windows) - averages(full.time, expected, windows)
    # Linear modal skis against beams, and skis whose own inertia of turning is left out: 1, 1 and 3 N m, however far
    # the trunk is bent.
    assert np.sqrt(np.mean(apart**2, axis=0)) == pytest.approx(np.zeros(3), abs=5.0)
    assert np.sqrt(np.mean(expected**2)) > 20.0
