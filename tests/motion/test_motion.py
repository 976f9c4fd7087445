"""From a captured skeleton to prescribed angles: exact where the chain can follow, measured where it cannot."""

from __future__ import annotations

import pickle
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sssi_exudyn.bodies.skier.chain import JOINTS, PRESCRIBED, SEGMENT, Geometry, average_geometry, forward_kinematics
from sssi_exudyn.core.frames import BODY_FROM_BVH, Array, slope_to_level
from sssi_exudyn.core.rotations import angles_between, lowpass, smooth_rotations
from sssi_exudyn.motion.capture_to_chain import capture_in_body_axes, chain_angles, segment_of_joint, skier_geometry
from sssi_exudyn.motion.from_recording import motion_from_recording, round_trip_table
from sssi_exudyn.motion.limb_angles import ball_joint_angles, tait_bryan, unwrap_angles
from sssi_exudyn.motion.motion import Motion, antenna_offset, relative_poses, spline_motion, turn_motion
from sssi_exudyn.recording.instruments.bvh import Bvh
from sssi_exudyn.recording.instruments.gps import Gps
from sssi_exudyn.recording.read import read_recording
from sssi_exudyn.recording.recording import Equipment, Heading, Recording, Skier, Slope

RATE = 60.0
HEIGHT = 1.75
EXAMPLES = Path(__file__).parents[2] / "examples"

_SPINE = (("Spine", "Hips"), ("Spine1", "Spine"), ("Spine2", "Spine1"), ("Neck", "Spine2"), ("Head", "Neck"))
_TREE: dict[str, str | None] = {
    "Hips": None,
    **{f"{s}{a}": p if p == "Hips" else f"{s}{p}" for s in ("Right", "Left")
       for a, p in (("UpLeg", "Hips"), ("Leg", "UpLeg"), ("Foot", "Leg"))},
    **dict(_SPINE),
    **{f"{s}{a}": p if p == "Spine2" else f"{s}{p}" for s in ("Right", "Left")
       for a, p in (("Shoulder", "Spine2"), ("Arm", "Shoulder"), ("ForeArm", "Arm"), ("Hand", "ForeArm"))},
}  # fmt: skip
_MOVED_BY = {
    "Hips": "pelvis",
    **dict.fromkeys(("Spine", "Spine1", "Spine2"), "torso"),
    **dict.fromkeys(("Neck", "RightShoulder", "LeftShoulder"), "torso"),
    "Head": "head",
    **{f"{word}{joint}": f"{segment}_{side}" for side, word in (("r", "Right"), ("l", "Left"))
       for joint, segment in (("UpLeg", "femur"), ("Leg", "tibia"), ("Foot", "calcn"), ("Arm", "humerus"),
                              ("ForeArm", "radius"), ("Hand", "hand"))},
}  # fmt: skip


def captured(angles: Array, geometry: Geometry) -> Bvh:
    """Return the BVH of a perfect capture of the chain: zero is the T-pose, the spine bends at its root only."""
    names = tuple(_TREE)
    parents = tuple(-1 if parent is None else names.index(parent) for parent in _TREE.values())
    q = np.hstack([np.zeros((len(angles), 3)), angles])
    world = forward_kinematics(geometry, q, 0.0).rotation
    t_pose = {name: Rotation.identity().as_matrix() for name in names}
    for word, turn in (("Right", np.pi / 2), ("Left", -np.pi / 2)):
        for part in ("Arm", "ForeArm", "Hand"):
            t_pose[word + part] = Rotation.from_euler("x", turn).as_matrix()
    in_bvh = [BODY_FROM_BVH.T @ (world[:, SEGMENT[_MOVED_BY[n]]] @ t_pose[n]) @ BODY_FROM_BVH for n in names]
    local = [
        in_bvh[i] if parent < 0 else np.swapaxes(in_bvh[parent], -1, -2) @ in_bvh[i] for i, parent in enumerate(parents)
    ]
    joint = geometry.joint_in_parent
    offset = {name: np.zeros(3) for name in names}
    offset["Spine"], offset["Neck"] = joint[SEGMENT["torso"]], joint[SEGMENT["head"]]
    for side, word in (("r", "Right"), ("l", "Left")):
        for name, segment in (("UpLeg", "femur"), ("Leg", "tibia"), ("Foot", "talus"), ("Arm", "humerus")):
            offset[word + name] = joint[SEGMENT[f"{segment}_{side}"]]
        for name, segment in (("ForeArm", "ulna"), ("Hand", "hand")):
            offset[word + name] = t_pose[word + "Arm"].T @ joint[SEGMENT[f"{segment}_{side}"]]
    ends = {"Head": geometry.segment_end[SEGMENT["head"]]}
    for side, word in (("r", "Right"), ("l", "Left")):
        ends[word + "Foot"] = joint[SEGMENT[f"toes_{side}"]]
        ends[word + "Hand"] = t_pose[word + "Hand"].T @ geometry.segment_end[SEGMENT[f"hand_{side}"]]
    return Bvh(
        names=names,
        parents=parents,
        offsets=np.stack([offset[name] for name in names]) @ BODY_FROM_BVH,
        end_offsets={name: end @ BODY_FROM_BVH for name, end in ends.items()},
        time=np.arange(len(angles)) / RATE,
        rotations=np.stack(local, axis=1),
        root_position=np.zeros((len(angles), 3)),
    )


def skiing(seconds: float, hertz: float = 0.4) -> Array:
    """Return a smooth movement (n, 28) rad in a skier's range, knees well beyond 90°, every coordinate busy."""
    t = np.arange(round(seconds * RATE)) / RATE
    rng = np.random.default_rng(3)
    middle = {"hip_flexion": 60.0, "knee_angle": 85.0, "ankle_angle": 20.0, "lumbar_extension": -25.0,
              "elbow_flex": 60.0, "arm_add": -30.0, "arm_flex": 30.0}  # fmt: skip
    swing = {"knee_angle": 35.0, "pelvis_rotation": 60.0, "hip_flexion": 25.0}
    columns = []
    for name in PRESCRIBED:
        stem = name.removesuffix("_r").removesuffix("_l")
        phase = rng.uniform(0.0, 2.0 * np.pi)
        columns.append(middle.get(stem, 0.0) + swing.get(stem, 15.0) * np.sin(2.0 * np.pi * hertz * t + phase))
    return np.radians(np.stack(columns, axis=1))


def recorded(bvh: Bvh, heading: float = 0.0, azimuth: float = 0.0, gps: Gps | None = None) -> Recording:
    """Return a recording around a capture, on a slope of 16°."""
    return Recording(
        name="made up",
        note="",
        folder=Path(),
        skier=Skier(height=HEIGHT),
        equipment=Equipment(),
        slope=Slope(inclination=np.radians(16.0), fall_line_azimuth=azimuth),
        bvh=bvh,
        heading=Heading(heading, estimated=False, sigma=np.radians(1.0)),
        gps=gps,
        insoles=None,
        start=float(bvh.time[0]),
        stop=float(bvh.time[-1]),
        hashes={},
        notices=(),
    )


@pytest.fixture(scope="module")
def geometry() -> Geometry:
    return average_geometry(HEIGHT)


def test_angles_that_the_chain_has_are_recovered(geometry: Geometry) -> None:
    angles = skiing(3.0)
    assert np.degrees(angles[:, PRESCRIBED.index("knee_angle_r")].max()) > 110.0
    capture = capture_in_body_axes(captured(angles, geometry))
    estimated = skier_geometry(capture, HEIGHT, geometry.ankle_to_ski_base)
    # 1e-9 m, 1e-9 rad: what remains of Gauss-Newton at a perfect fit is rounding, amplified by the weights.
    np.testing.assert_allclose(estimated.joint_in_parent, geometry.joint_in_parent, atol=1e-9)
    np.testing.assert_allclose(estimated.segment_end, geometry.segment_end, atol=1e-9)
    np.testing.assert_allclose(chain_angles(capture, estimated, np.eye(3)), angles, atol=1e-9)


def test_t_pose_is_ninety_degrees_of_abduction(geometry: Geometry) -> None:
    bvh = captured(np.zeros((12, len(PRESCRIBED))), geometry)
    still = replace(bvh, rotations=np.broadcast_to(np.eye(3), bvh.rotations.shape))
    capture = capture_in_body_axes(still)
    angles = chain_angles(capture, geometry, np.eye(3))
    expected = np.zeros(len(PRESCRIBED))
    expected[[PRESCRIBED.index("arm_add_r"), PRESCRIBED.index("arm_add_l")]] = -np.pi / 2
    # In gimbal lock flexion and rotation of the arm are not separate: their sum is.  1e-7: sqrt of rounding, since
    # the middle angle is at the turning point of its sine.
    for side in "rl":
        flexion, rotation = PRESCRIBED.index(f"arm_flex_{side}"), PRESCRIBED.index(f"arm_rot_{side}")
        angles[:, flexion] += angles[:, rotation]
        angles[:, rotation] = 0.0
    np.testing.assert_allclose(angles, np.broadcast_to(expected, angles.shape), atol=1e-7)


@pytest.mark.parametrize(("heading", "azimuth"), [(25.0, 70.0), (350.0, 20.0), (180.0, 170.0)])
def test_pelvis_turns_left_of_the_fall_line_by_azimuth_less_heading(
    geometry: Geometry, heading: float, azimuth: float
) -> None:
    # Azimuths run clockwise, rotations to the left counter-clockwise: a skier who faces the capture's +z stands turned
    # by (azimuth − heading) to the left of the fall line.
    bvh = captured(np.zeros((60, len(PRESCRIBED))), geometry)
    motion = motion_from_recording(recorded(bvh, np.radians(heading), np.radians(azimuth)))
    q, _, _ = motion.evaluate(np.array([0.5]))
    yaw = np.degrees(q[0, PRESCRIBED.index("pelvis_rotation")])
    assert (yaw - (azimuth - heading) + 180.0) % 360.0 == pytest.approx(180.0, abs=1e-9)  # rounding of 350 degrees


def test_heading_offset_turns_the_skier_about_gravity(geometry: Geometry) -> None:
    motion = spline_motion(geometry, np.radians(16.0), np.arange(120) / RATE, skiing(2.0))
    time, delta = np.linspace(0.1, 1.8, 7), np.radians(3.0)
    before, _ = relative_poses(motion, time)
    after, _ = relative_poses(turn_motion(motion, lambda t: delta + 0.0 * t), time)
    tilt = slope_to_level(motion.inclination)
    turn = tilt.T @ Rotation.from_euler("z", delta).as_matrix() @ tilt
    # 1e-12: rounding; B-splines add up to one to rounding only.
    np.testing.assert_allclose(after.rotation, turn @ before.rotation, atol=1e-12)
    np.testing.assert_allclose(after.origin, before.origin @ turn.T, atol=1e-12)


def test_a_drifting_heading_is_a_line_in_time(geometry: Geometry) -> None:
    motion = spline_motion(geometry, np.radians(16.0), np.arange(120) / RATE, skiing(2.0))
    time = np.linspace(motion.start, motion.stop, 9)
    before, after = motion.evaluate(time), turn_motion(motion, lambda t: 0.02 * (t - 0.7)).evaluate(time)
    yaw = PRESCRIBED.index("pelvis_rotation")
    # a spline whose coefficients are a line at Greville's abscissae is that line, to rounding
    np.testing.assert_allclose(after[0][:, yaw] - before[0][:, yaw], 0.02 * (time - 0.7), atol=1e-12)
    np.testing.assert_allclose(after[1][:, yaw] - before[1][:, yaw], 0.02, atol=1e-10)


def test_splines_are_smooth_and_their_rates_are_derivatives(geometry: Geometry) -> None:
    angles = skiing(2.0)
    motion = spline_motion(geometry, 0.0, np.arange(len(angles)) / RATE, angles)
    at_knots, _, _ = motion.evaluate(np.arange(len(angles)) / RATE)
    np.testing.assert_allclose(at_knots, angles, atol=1e-12)  # it interpolates, up to rounding of the band solve
    time, h = np.linspace(0.2, 1.7, 40), 1e-4
    _, speed, acceleration = motion.evaluate(time)
    forward, backward = motion.evaluate(time + h), motion.evaluate(time - h)
    # Central differences: h²/6 of a third derivative below 1 rad · (2π 0.4 Hz)³ = 16 rad/s³, 3e-8; more for the next.
    np.testing.assert_allclose((forward[0] - backward[0]) / (2 * h), speed, atol=3e-8)
    np.testing.assert_allclose((forward[1] - backward[1]) / (2 * h), acceleration, atol=1e-7)
    # No jump of acceleration at a knot: over 2e-9 s it may change by jerk × time, 16 rad/s³ × 2e-9 s, plus rounding.
    knot = 30 / RATE
    jump = motion.evaluate(np.array([knot + 1e-9]))[2] - motion.evaluate(np.array([knot - 1e-9]))[2]
    np.testing.assert_allclose(jump, 0.0, atol=1e-7)


def test_motion_pickles(geometry: Geometry) -> None:
    motion = motion_from_recording(recorded(captured(skiing(2.0), geometry)))
    copy: Motion = pickle.loads(pickle.dumps(motion))
    time = np.linspace(0.0, 1.9, 11)
    np.testing.assert_array_equal(copy.evaluate(time)[2], motion.evaluate(time)[2])
    assert copy.round_trip == motion.round_trip


def gain(hertz: float) -> float:
    """Return the amplitude ratio of the filter for a sine, away from the ends."""
    t = np.arange(1200) / RATE
    wave = np.exp(2j * np.pi * hertz * t)
    out = lowpass(wave.real, RATE, 6.0) + 1j * lowpass(wave.imag, RATE, 6.0)
    ratio = (out / wave)[400:800]
    assert np.max(np.abs(np.angle(ratio))) < 1e-9  # zero lag, up to rounding
    return float(np.mean(np.abs(ratio)))


def test_filter_halves_the_power_at_its_cutoff_and_keeps_what_is_slow() -> None:
    # Two passes of 1/√(1 + x⁴) with x = tan(πf/fs)/tan(πf₀/fs)/1.246…: 1/√2 at 6 Hz exactly.
    assert gain(6.0) == pytest.approx(np.sqrt(0.5), rel=1e-9)  # rounding
    x = np.tan(np.pi / RATE) / np.tan(np.pi * 6.0 / RATE)
    assert gain(1.0) == pytest.approx(1.0 / (1.0 + (np.sqrt(2.0) - 1.0) * x**4), rel=1e-9)
    assert gain(1.0) > 0.999
    assert gain(15.0) < 0.03  # (6/15)⁴ = 0.026 and warping helps


def test_filter_keeps_a_steady_turn_to_its_ends() -> None:
    steady = np.linspace(2.0, 5.0, 100)
    np.testing.assert_allclose(lowpass(steady, RATE, 6.0), steady, atol=1e-9)  # rounding of a recursive filter


def test_filter_refuses_a_cutoff_above_half_the_rate() -> None:
    with pytest.raises(ValueError, match="faster than 12 Hz"):
        lowpass(np.zeros(50), 12.0, 6.0)


def test_rotations_are_filtered_through_gimbal_lock() -> None:
    # An arm that swings through 90° of abduction, where Euler angles jump; with noise of 0.5°.
    t = np.arange(300) / RATE
    swing = np.radians(-90.0 + 20.0 * np.sin(2.0 * np.pi * 0.5 * t))
    clean = Rotation.from_euler("YXZ", np.stack([0.3 * np.sin(t), swing, 0.2 * np.cos(t)], axis=1)).as_matrix()
    noise = np.random.default_rng(5).normal(0.0, np.radians(0.5), (300, 3))
    noisy = clean @ Rotation.from_rotvec(noise).as_matrix()
    before, after = angles_between(noisy, clean), angles_between(smooth_rotations(noisy, RATE, 6.0), clean)
    # White noise keeps about 2 · 6 Hz/60 Hz of its power, 0.45 of its size; the bound leaves room for chance.
    assert np.sqrt(np.mean(after**2)) < 0.6 * np.sqrt(np.mean(before**2))
    assert np.degrees(after.max()) < 1.5  # no jump anywhere, also not at the ends: three sigmas of the noise


@pytest.mark.parametrize("order", ["YXZ", "ZXY"])
@pytest.mark.parametrize("middle", [0.3, -1.2, np.pi / 2, -np.pi / 2])
def test_tait_bryan_angles_give_the_rotation_back(order: str, middle: float) -> None:
    rotation = Rotation.from_euler(order, [0.7, middle, -0.4]).as_matrix()
    first, second, third = ("XYZ".index(letter) for letter in order)
    again = Rotation.from_euler(order, tait_bryan(rotation, (first, second, third))).as_matrix()
    np.testing.assert_allclose(again, rotation, atol=1e-14)  # rounding, also in gimbal lock


def test_angles_continue_over_half_turns() -> None:
    # Arms swung over the head sideways: the middle angle passes −90°, where the principal triple jumps by half turns.
    t = np.linspace(0.0, 1.0, 101)
    angles = np.stack([0.2 + 0.1 * t, -2.5 * t, 0.3 - 0.2 * t], axis=1)
    rotation = Rotation.from_euler("YXZ", angles).as_matrix()
    principal = tait_bryan(rotation, (1, 0, 2))
    assert np.abs(np.diff(principal, axis=0)).max() > 3.0
    np.testing.assert_allclose(unwrap_angles(principal), angles, atol=1e-12)  # rounding near the turning point
    hip = JOINTS[SEGMENT["femur_l"]]
    signs = np.array([-1.0, -1.0, -1.0])  # the left hip's axes are −y, −x, −z
    np.testing.assert_allclose(ball_joint_angles(hip, rotation), signs * angles, atol=1e-12)


def inclined(bvh: Bvh, knee: float, ankle: float) -> Bvh:
    """Incline both shanks and feet of the capture out of plane by constant angles (rad), as loose straps do."""
    rotations = bvh.rotations.copy()
    for word, sense in (("Right", 1.0), ("Left", -1.0)):
        for joint, angle in (("Leg", knee), ("Foot", ankle)):
            at = bvh.index(word + joint)
            rotations[:, at] = rotations[:, at] @ Rotation.from_euler("z", sense * angle).as_matrix()
    return replace(bvh, rotations=rotations)


def test_the_feet_keep_their_edge_angle_when_the_capture_bends_knees_sideways(geometry: Geometry) -> None:
    # 6° at the knee and 4° at the ankle, which the chain's hinges cannot follow: dropped, they would be degrees of edge
    # angle and centimetres of place.  As constant attitudes they cost nothing but what the filter does to a rotation
    # of several axes, second order in the movement over the cut-off: thousandths of a degree, hundredths of a mm.
    bvh = inclined(captured(skiing(4.0), geometry), np.radians(6.0), np.radians(4.0))
    rows = {row.segment: row for row in motion_from_recording(recorded(bvh)).round_trip}
    for side in "rl":
        assert np.degrees(rows[f"calcn_{side}"].filtered_max) < 1e-3
        assert rows[f"calcn_{side}"].place_max < 1e-5
        assert np.degrees(rows[f"tibia_{side}"].filtered_max) < 1e-3


def test_round_trip_of_a_perfect_capture_is_exact(geometry: Geometry) -> None:
    motion = motion_from_recording(recorded(captured(skiing(4.0, hertz=0.2), geometry)))
    for row in motion.round_trip:
        # The chain can follow the true rotations; the filter changes them in second order only, as above; at the ends
        # it bends them straight, which the recorded ones show.
        assert np.degrees(row.filtered_max) < 1e-3
        assert row.place_max < 1e-5
        assert np.degrees(row.raw_max) < 0.1
    table = round_trip_table(motion)
    assert [entry["segment"] for entry in table] == [row.segment for row in motion.round_trip]
    assert table[0]["raw_max_deg"] == pytest.approx(np.degrees(motion.round_trip[0].raw_max))


def test_antenna_moves_with_its_joint(geometry: Geometry) -> None:
    angles = skiing(4.0, hertz=0.2)
    bvh = captured(angles, geometry)
    offset = np.array([0.02, 0.10, -0.16])
    gps = Gps(bvh.time, np.zeros((len(bvh.time), 3)), np.full(len(bvh.time), 0.02), (0.0, 0.0, 0.0), "Spine2", offset)
    motion = motion_from_recording(recorded(bvh, gps=gps))
    assert motion.antenna is not None
    assert motion.antenna.segment == SEGMENT["torso"]
    # Spine2 is where the lumbar joint is in this tree, so the offset is the antenna's place; 0.1 mm: filtering.
    np.testing.assert_allclose(motion.antenna.offset, BODY_FROM_BVH @ offset, atol=1e-4)
    time, h = np.linspace(0.5, 3.0, 9), 1e-4
    place, velocity = antenna_offset(motion, time)
    poses, _ = relative_poses(motion, time)
    lever = poses.rotation[:, SEGMENT["torso"]] @ motion.antenna.offset
    np.testing.assert_allclose(place, poses.origin[:, SEGMENT["torso"]] + lever, atol=1e-12)  # rounding
    difference = (antenna_offset(motion, time + h)[0] - antenna_offset(motion, time - h)[0]) / (2 * h)
    np.testing.assert_allclose(velocity, difference, atol=1e-7)  # h²/6 × third derivative of order 10 m/s³


def test_no_antenna_without_gps(geometry: Geometry) -> None:
    motion = spline_motion(geometry, 0.0, np.arange(60) / RATE, skiing(1.0))
    with pytest.raises(ValueError, match="no GPS antenna"):
        antenna_offset(motion, np.array([0.1]))


def test_every_captured_joint_belongs_to_a_segment(geometry: Geometry) -> None:
    bvh = captured(np.zeros((2, len(PRESCRIBED))), geometry)
    segments = {name: segment_of_joint(bvh, name) for name in bvh.names}
    assert segments == _MOVED_BY
    with pytest.raises(KeyError):
        segment_of_joint(bvh, "Tail")


def test_torso_follows_the_highest_vertebra(geometry: Geometry) -> None:
    # Older trees have a Spine3; insert one above Spine2 that bends by 10° more: the torso is what the arms hang on.
    bvh = captured(np.zeros((30, len(PRESCRIBED))), geometry)
    at = bvh.index("Spine2")
    shifted = tuple(p if p < at else at + 1 if p == at else p + 1 for p in bvh.parents)
    tree = replace(
        bvh,
        names=(*bvh.names[: at + 1], "Spine3", *bvh.names[at + 1 :]),
        parents=(*shifted[: at + 1], at, *shifted[at + 1 :]),
        offsets=np.insert(bvh.offsets, at + 1, [0.0, 0.1, 0.0], axis=0),
        rotations=np.insert(bvh.rotations, at + 1, Rotation.from_euler("x", 10.0, degrees=True).as_matrix(), axis=1),
    )
    capture = capture_in_body_axes(tree)
    angles = chain_angles(capture, skier_geometry(capture, HEIGHT, 0.13), np.eye(3))
    # BVH +x is to the left: 10° about it bends forwards, which is −10° of extension.  Rounding.
    np.testing.assert_allclose(np.degrees(angles[:, PRESCRIBED.index("lumbar_extension")]), -10.0, atol=1e-9)


@pytest.mark.parametrize("name", ["beginner", "intermediate"])
def test_round_trip_of_the_examples(name: str) -> None:
    recording = read_recording(EXAMPLES / name)
    motion = motion_from_recording(recording)
    assert motion.start == recording.start
    assert motion.stop <= recording.bvh.time[-1]
    rows = {row.segment: row for row in motion.round_trip}
    for side in "rl":
        foot = rows[f"calcn_{side}"]
        # What the skis ask for: edge angle to 0.1°, place to 1 mm, both rms; a half more for the capture's own drift.
        assert np.degrees(foot.filtered_rms) < 0.15
        assert foot.place_rms < 1.5e-3
    # The torso's orientation is free in the chain: rounding.  Its place hangs on one lumbar joint instead of three
    # vertebrae that bend by 10° each over 0.3 m: a sagitta of millimetres, a third of the GPS's 20 mm at the very most.
    assert rows["torso"].filtered_max < 1e-9
    assert rows["torso"].place_max < 7e-3
    # Posture noise of 0.3° in each joint and three joints in a limb: nothing may be off by more than ten times that.
    assert max(np.degrees(row.raw_max) for row in motion.round_trip) < 3.0
