"""The moment that is left over about the pelvis: by hand for a standing skier, and as the full model has it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from bundled import bundled

from sssi_exudyn.bodies.skier.chain import COORDINATE, PRESCRIBED, average_geometry, forward_kinematics
from sssi_exudyn.contact.registry import combine_terms
from sssi_exudyn.contact.terms.carving import Carving
from sssi_exudyn.core.choices import HeadingMode
from sssi_exudyn.core.frames import GRAVITY, Array
from sssi_exudyn.fitting.balance import balance_of, own_moment
from sssi_exudyn.fitting.observations import averages
from sssi_exudyn.model.from_recording import first_guess, model_of
from sssi_exudyn.motion.correction import PostureCorrection, correct_posture
from sssi_exudyn.motion.motion import spline_motion
from sssi_exudyn.simulation.assembly import Parts, correct_motion
from sssi_exudyn.simulation.full.run import simulate
from sssi_exudyn.simulation.reduced.prepared import ReducedRun, prepare
from sssi_exudyn.simulation.reduced.run import simulate_reduced
from sssi_exudyn.simulation.reduced.sensitivities import sensitivities

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
    residual = balance_of(model, moved, prepared.correct_capture(model), run).residual(run, prepared)
    # The full model gives the moments along the pelvis' three axes, which are not square to each other.
    poses = forward_kinematics(motion.geometry, full.coordinates, motion.inclination)
    axes = np.stack([poses.axes[:, COORDINATE[name]] for name in TURNS], axis=1)
    along = full.joint_moments[:, [full.moment_names.index(name) for name in TURNS]]
    expected = np.linalg.solve(axes, along[..., None])[..., 0]
    windows = np.arange(motion.start + 0.4, stop - 0.4, 0.1)
    apart = averages(run.time, residual, windows) - averages(full.time, expected, windows)
    # Linear modal skis against beams, and skis whose own inertia of turning is left out: 1, 1 and 3 N m, however far
    # the trunk is bent.
    assert np.sqrt(np.mean(apart**2, axis=0)) == pytest.approx(np.zeros(3), abs=5.0)
    assert np.sqrt(np.mean(expected**2)) > 20.0


@pytest.mark.long
@pytest.mark.parametrize("mode", ["track", "free"])
def test_only_the_spring_is_left_over_about_gravity_where_the_heading_is_found(mode: HeadingMode) -> None:
    """The moments close about every point, as the forces on the pelvis do; the skis' own yaw is left out of both."""
    recording, motion = bundled("intermediate")
    model = model_of(recording, motion)
    model = replace(model, terms=combine_terms(model.terms, (Carving(mu=0.13, hardness=0.54e8, strength=0.9e5),)))
    model = model.with_heading(mode)
    prepared = prepare(model, motion, stop=motion.start + 3.0, step=0.0025)
    run = simulate_reduced(model, prepared)
    at = prepared.correct_capture(model)
    balance = balance_of(model, correct_motion(model, motion), at, run)
    inertia = at.whole_body().inertia @ at.up @ at.up
    stiffness = model.heading.stiffness if mode == "track" else 0.0
    damping = 2.0 * model.heading.damping_ratio * np.sqrt(stiffness * inertia)
    spring = stiffness * run.heading[:, 0] + damping * run.heading[:, 1]
    windows = np.arange(motion.start + 0.2, motion.start + 2.8, 0.1)
    left = averages(run.time, (balance.residual(run, at) @ at.up + spring)[:, None], windows)
    turning = averages(run.time, (inertia * run.heading[:, 2])[:, None], windows)
    # 0.84 and 1.08 N m, 0.80 and 1.08 with half the step; up to 4.6 in one window, where the edges change
    assert np.sqrt(np.mean(left**2)) < 1.5
    assert np.sqrt(np.mean(turning**2)) > 3.0

    def observed(_: object, seen: ReducedRun) -> Array:
        return balance.residual(seen, at)

    slopes = sensitivities(model, prepared, ["carving.mu"], observed)[1][..., 0]
    value, step = model.value("carving.mu"), 1e-7
    ends = [simulate_reduced(model.with_values({"carving.mu": value + x}), prepared) for x in (step, -step)]
    differences = (observed(model, ends[0]) - observed(model, ends[1])) / (2.0 * step)
    # Newton's method leaves 1e-10 m of what 1e-7 of friction moves
    assert np.median(np.abs(slopes - differences)) < 1e-5 * np.abs(differences).max()
