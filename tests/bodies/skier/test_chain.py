"""The kinematic chain against positions worked out by hand, and its rates against numerical differences."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sssi_exudyn.bodies.skier.chain import (
    COORDINATE,
    COORDINATES,
    JOINTS,
    PARENT,
    PRESCRIBED,
    SEGMENT,
    SEGMENTS,
    average_geometry,
    forward_kinematics,
    jacobians,
    joint_rotation,
    mean_jacobian,
    rates,
)
from sssi_exudyn.core.frames import Array, slope_to_level

GEOMETRY = average_geometry(1.75)
CROOKED = replace(
    GEOMETRY, attitude_in_parent=Rotation.random(len(SEGMENTS), random_state=np.random.default_rng(2)).as_matrix()
)
SLOPE = np.radians(16.0)


def pose(**degrees: float) -> Array:
    q = np.zeros(len(COORDINATES))
    for name, value in degrees.items():
        q[COORDINATE[name]] = np.radians(value)
    return q


def direction(segment: str, axis: Array | tuple[float, float, float], **degrees: float) -> Array:
    """Return where a direction fixed in the segment points on level ground."""
    poses = forward_kinematics(GEOMETRY, pose(**degrees), 0.0)
    return np.asarray(poses.rotation[SEGMENT[segment]] @ np.asarray(axis, dtype=float))


FORWARD, LEFT, UP = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
DOWN, BACK, RIGHT = (0.0, 0.0, -1.0), (-1.0, 0.0, 0.0), (0.0, -1.0, 0.0)


@pytest.mark.parametrize(
    ("coordinate", "segment", "fixed", "points"),
    [
        # (coordinate turned by +90°, segment, a direction fixed in it, where that direction must point)
        ("hip_flexion_r", "femur_r", DOWN, FORWARD),  # knee in front
        ("hip_flexion_l", "femur_l", DOWN, FORWARD),
        ("hip_adduction_r", "femur_r", DOWN, LEFT),  # thigh across the midline
        ("hip_adduction_l", "femur_l", DOWN, RIGHT),
        ("hip_rotation_r", "femur_r", FORWARD, LEFT),  # toes inwards
        ("hip_rotation_l", "femur_l", FORWARD, RIGHT),
        ("knee_angle_r", "tibia_r", DOWN, BACK),  # heel to the seat
        ("knee_angle_l", "tibia_l", DOWN, BACK),
        ("ankle_angle_r", "toes_r", FORWARD, UP),  # toes up
        ("ankle_angle_l", "toes_l", FORWARD, UP),
        ("pelvis_tilt", "pelvis", UP, BACK),  # backward tilt
        ("pelvis_list", "pelvis", UP, RIGHT),  # right side down
        ("pelvis_rotation", "pelvis", FORWARD, LEFT),  # turned to the left
        ("lumbar_extension", "torso", UP, BACK),
        ("lumbar_bending", "torso", UP, RIGHT),
        ("lumbar_rotation", "torso", FORWARD, LEFT),
        ("lumbar_extension", "head", UP, BACK),  # the head goes with the torso
        ("arm_flex_r", "humerus_r", DOWN, FORWARD),
        ("arm_flex_l", "humerus_l", DOWN, FORWARD),
        ("arm_add_r", "humerus_r", DOWN, LEFT),
        ("arm_add_l", "humerus_l", DOWN, RIGHT),
        ("arm_rot_r", "humerus_r", FORWARD, LEFT),
        ("arm_rot_l", "humerus_l", FORWARD, RIGHT),
        ("elbow_flex_r", "hand_r", DOWN, FORWARD),
        ("elbow_flex_l", "hand_l", DOWN, FORWARD),
        ("pro_sup_r", "hand_r", FORWARD, LEFT),  # thumb inwards
        ("pro_sup_l", "hand_l", FORWARD, RIGHT),
        ("wrist_flex_r", "hand_r", DOWN, LEFT),  # towards the palm, which faces the thigh
        ("wrist_flex_l", "hand_l", DOWN, RIGHT),
    ],
)
def test_sign_of_every_coordinate(
    coordinate: str, segment: str, fixed: tuple[float, ...], points: tuple[float, ...]
) -> None:
    # 1e-15: one or two roundings of a cosine that should vanish.
    np.testing.assert_allclose(direction(segment, fixed, **{coordinate: 90.0}), points, atol=1e-15)  # type: ignore[arg-type]


def test_sign_table_is_complete() -> None:
    marks = test_sign_of_every_coordinate.pytestmark  # type: ignore[attr-defined]
    assert {row[0] for row in marks[0].args[1]} == set(PRESCRIBED)


def test_chain_has_the_papers_size() -> None:
    assert len(SEGMENTS) == 21
    assert len(COORDINATES) == len(set(COORDINATES)) == 31
    assert PARENT[0] == -1
    assert all(0 <= parent < i for i, parent in enumerate(PARENT) if i)


def test_sitting_skier_puts_the_knee_in_front_and_the_ankle_below_it() -> None:
    q = pose(hip_flexion_r=90.0, knee_angle_r=90.0)
    origin = forward_kinematics(GEOMETRY, q, 0.0).origin
    thigh, shank = GEOMETRY.length("femur_r"), GEOMETRY.length("tibia_r")
    hip = origin[SEGMENT["femur_r"]]
    # 1e-15 m: rounding.
    np.testing.assert_allclose(origin[SEGMENT["tibia_r"]] - hip, [thigh, 0.0, 0.0], atol=1e-15)
    np.testing.assert_allclose(origin[SEGMENT["talus_r"]] - hip, [thigh, 0.0, -shank], atol=1e-15)


def test_flexion_comes_before_adduction() -> None:
    # Flexed by 90° the thigh points forwards (x); its adduction axis, fixed in the flexed thigh, now points upwards, so
    # adduction of the right thigh swings the knee to the left; turned the other way round the knee would stay forward.
    np.testing.assert_allclose(direction("femur_r", DOWN, hip_flexion_r=90.0, hip_adduction_r=90.0), LEFT, atol=1e-15)


def test_slope_and_level_frames() -> None:
    q = pose(hip_flexion_l=40.0, pelvis_rotation=30.0, lumbar_bending=10.0)
    level = forward_kinematics(GEOMETRY, q, 0.0)
    slope = forward_kinematics(GEOMETRY, q, SLOPE)
    # 1e-15: the same posture seen from an inclined frame, up to rounding.
    np.testing.assert_allclose(slope_to_level(SLOPE) @ slope.rotation, level.rotation, atol=1e-15)
    # An upright skier leans uphill of the slope's normal by the inclination.
    upright = forward_kinematics(GEOMETRY, pose(), SLOPE).rotation[0] @ np.array(UP)
    np.testing.assert_allclose(upright, [-np.sin(SLOPE), 0.0, np.cos(SLOPE)], atol=1e-15)


def test_joint_rotation_is_the_chain_between_parent_and_segment() -> None:
    rng = np.random.default_rng(1)
    q = rng.uniform(-1.0, 1.0, (4, 31))
    poses = forward_kinematics(CROOKED, q, SLOPE)
    for i, joint in enumerate(JOINTS[1:], start=1):
        angles = q[:, [COORDINATE[name] for name, _ in joint.rotations]]
        relative = np.swapaxes(poses.rotation[:, PARENT[i]], -1, -2) @ poses.rotation[:, i]
        expected = CROOKED.attitude_in_parent[i] @ joint_rotation(joint, angles)
        np.testing.assert_allclose(expected, relative, atol=1e-14)  # rounding of a few products


def _smooth(t: Array) -> tuple[Array, Array, Array]:
    """Return a movement of all 31 coordinates with its exact derivatives, (n, 31) each."""
    rng = np.random.default_rng(7)
    amplitude, omega, phase = rng.uniform(0.2, 1.0, 31), rng.uniform(1.0, 6.0, 31), rng.uniform(0.0, 6.0, 31)
    x = omega * t[:, None] + phase
    return amplitude * np.sin(x), amplitude * omega * np.cos(x), -amplitude * omega**2 * np.sin(x)


def _skew_part(rotation_rate: Array, rotation: Array) -> Array:
    cross = rotation_rate @ np.swapaxes(rotation, -1, -2)
    return np.stack([cross[..., 2, 1], cross[..., 0, 2], cross[..., 1, 0]], axis=-1)


def test_rates_are_the_derivatives_of_the_poses() -> None:
    t = np.linspace(0.0, 2.0, 9)
    h = 1e-3

    def poses_at(shift: float) -> tuple[Array, Array, Array, Array]:
        q, qd, qdd = _smooth(t + shift)
        poses = forward_kinematics(CROOKED, q, SLOPE)
        r = rates(poses, qd, qdd)
        return poses.rotation, poses.origin, r.angular_velocity, r.velocity

    def difference(which: int) -> Array:
        """Return the sixth-order central difference, error h⁶ f⁽⁷⁾/140."""
        d = [poses_at(k * h)[which] - poses_at(-k * h)[which] for k in (1, 2, 3)]
        return np.asarray((45 * d[0] - 9 * d[1] + d[2]) / (60 * h))

    q, qd, qdd = _smooth(t)
    poses = forward_kinematics(CROOKED, q, SLOPE)
    moving = rates(poses, qd, qdd)
    # Products of up to ten sines at 6 rad/s: f⁽⁷⁾ < (60/s)⁷ ≈ 3e12 at worst, so h⁶ f⁽⁷⁾/140 < 2e-8; rounding adds
    # 1e-12/h.
    tolerance = 2e-8
    np.testing.assert_allclose(moving.velocity, difference(1), atol=tolerance, rtol=0.0)
    np.testing.assert_allclose(
        moving.angular_velocity, _skew_part(difference(0), poses.rotation), atol=tolerance, rtol=0.0
    )
    np.testing.assert_allclose(moving.angular_acceleration, difference(2), atol=tolerance, rtol=0.0)
    np.testing.assert_allclose(moving.acceleration, difference(3), atol=tolerance, rtol=0.0)


def test_jacobians_map_rates_of_coordinates_to_rates_of_segments() -> None:
    q, qd, qdd = _smooth(np.linspace(0.0, 2.0, 5))
    poses = forward_kinematics(CROOKED, q, SLOPE)
    angular, linear = jacobians(poses, range(len(SEGMENTS)), poses.origin)
    weights = np.linspace(0.0, 2.0, len(SEGMENTS)) / len(SEGMENTS)
    mean = mean_jacobian(poses, weights, poses.origin)
    moving = rates(poses, qd, qdd)
    # 1e-12: rounding of sums of 31 terms of order 10.
    np.testing.assert_allclose(np.einsum("tsij,tj->tsi", angular, qd), moving.angular_velocity, atol=1e-12)
    np.testing.assert_allclose(np.einsum("tsij,tj->tsi", linear, qd), moving.velocity, atol=1e-12)
    np.testing.assert_allclose(np.einsum("tij,tj->ti", mean, qd), weights @ moving.velocity, atol=1e-12)


def test_average_skier_stands_on_the_ground() -> None:
    # Standing, the sole is below the hips by both leg segments and the ankle's height: 0.530 of height after Drillis.
    poses = forward_kinematics(GEOMETRY, pose(), 0.0)
    sole = poses.origin[SEGMENT["toes_r"], 2]
    assert sole == pytest.approx(-0.530 * 1.75, abs=1e-12)  # sum of three tabulated lengths
    vertex = poses.origin[SEGMENT["head"]] + GEOMETRY.segment_end[SEGMENT["head"]]
    assert vertex[2] - sole == pytest.approx(1.75, abs=1e-12)
