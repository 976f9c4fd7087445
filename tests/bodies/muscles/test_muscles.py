"""The skier's muscles: how many, on which side, how they scale, and their moment arms."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from sssi_exudyn.bodies.muscles.bones import stand
from sssi_exudyn.bodies.muscles.muscles import (
    LEG_GROUPS,
    LUMBAR_GROUPS,
    OTHER_LEG_GROUPS,
    OWN_BODY,
    SIDES,
    UPRIGHT,
    SkierMuscles,
    joint_shift,
    leg_volume,
    muscles_table,
    own_geometry,
    skier_muscles,
)
from sssi_exudyn.bodies.muscles.paths import muscle_paths
from sssi_exudyn.bodies.skier.chain import PRESCRIBED, SEGMENT, average_geometry, forward_kinematics
from sssi_exudyn.core.choices import MuscleSet
from sssi_exudyn.core.frames import Array

IN_A_LEG = {  # paper 2.2.1; the iliacus is counted to the leg's psoas major
    "gluteus_maximus": 3,
    "psoas_major": 1,
    "gluteus_medius": 3,
    "hip_abductors": 4,
    "quadriceps_femoris": 4,
    "hamstrings": 4,
    "triceps_surae": 3,
    "tibialis_anterior": 1,
}
BESIDES_IN_A_LEG = {  # Delp et al. 1990, table 1: with the psoas 43 muscles a leg
    "hip_adductors": 7,
    "sartorius": 1,
    "deep_hip_rotators": 3,
    "deep_calf": 3,
    "peroneals": 3,
    "toe_extensors": 2,
}
IN_HALF_THE_TRUNK = {  # Christophy et al. 2012, table 1, and the latissimus dorsi
    "erector_spinae": 38,
    "rectus_abdominis": 1,
    "external_obliques": 6,
    "internal_obliques": 6,
    "multifidus": 25,
    "quadratus_lumborum": 18,
    "psoas_major": 11,
    "latissimus_dorsi": 14,
}


@pytest.fixture(scope="module")
def own() -> SkierMuscles:
    return skier_muscles(own_geometry())


def mirrored(q: Array) -> Array:
    """Mirror a posture (…, 28): right and left change places, turns about x and z change their sign."""
    image = np.empty_like(q)
    for i, name in enumerate(PRESCRIBED):
        swapped = name[:-1] + {"r": "l", "l": "r"}[name[-1]] if name.endswith(("_r", "_l")) else name
        sign = -1.0 if name in ("pelvis_rotation", "pelvis_list", "lumbar_bending", "lumbar_rotation") else 1.0
        image[..., PRESCRIBED.index(swapped)] = sign * q[..., i]
    return image


def postures(count: int) -> Array:
    """Draw postures within the joints' ranges."""
    rng = np.random.default_rng(3)
    ranges = {"hip_flexion": (-0.3, 1.6), "knee_angle": (0.0, 1.9), "lumbar_extension": (-0.7, 0.2)}
    bounds = [ranges.get(name.removesuffix("_r").removesuffix("_l"), (-0.3, 0.3)) for name in PRESCRIBED]
    return np.stack([rng.uniform(low, high, count) for low, high in bounds], axis=1)


@pytest.mark.parametrize(("chosen", "number"), [("paper", 284), ("full", 322)])
def test_counted_by_group_and_side(chosen: MuscleSet, number: int) -> None:
    rows = muscles_table(chosen)
    assert len(rows) == number
    assert len({row["name"] for row in rows}) == number
    counted = Counter((row["side"], row["region"], row["group"]) for row in rows)
    for side in SIDES:
        for group in LEG_GROUPS:
            assert counted.pop((side, "leg", group)) == IN_A_LEG[group]
        for group in OTHER_LEG_GROUPS if chosen == "full" else ():
            assert counted.pop((side, "leg", group)) == BESIDES_IN_A_LEG[group]
        for group in LUMBAR_GROUPS:
            assert counted.pop((side, "lumbar", group)) == IN_HALF_THE_TRUNK[group]
    assert not counted
    assert sum(IN_A_LEG.values()) == 23
    assert sum(IN_A_LEG.values()) + sum(BESIDES_IN_A_LEG.values()) + 1 == 43
    assert 2 * sum(IN_HALF_THE_TRUNK.values()) == 238


def test_figures_are_within_what_muscles_have() -> None:
    for row in muscles_table():
        assert 1.0 < float(row["max_isometric_force_N"]) < 6000.0
        assert 0.01 < float(row["optimal_fibre_m"]) < 0.6
        assert 0.0 < float(row["tendon_slack_m"]) < 0.5
        assert 0.0 <= float(row["pennation_deg"]) < 40.0


@pytest.mark.long
def test_moment_arms_are_minus_the_derivative_of_the_length(own: SkierMuscles) -> None:
    q = postures(12)
    paths = muscle_paths(own.model, q)
    step = 1e-6
    for c in range(len(PRESCRIBED)):
        shift = step * np.eye(len(PRESCRIBED))[c]
        ahead, behind = (muscle_paths(own.model, q + sign * shift).length for sign in (1.0, -1.0))
        # rounding of lengths around 0.5 m over 2e-6 rad; on the ellipsoid the plane's angle is found to 1e-6 rad
        assert np.max(np.abs((ahead - behind) / (2.0 * step) + paths.moment_arm[:, :, c])) < 1e-6


def test_the_left_side_is_the_right_ones_mirror_image(own: SkierMuscles) -> None:
    q = postures(8)
    paths, mirror_paths = muscle_paths(own.model, q), muscle_paths(own.model, mirrored(q))
    half = len(own.named) // 2
    # an ellipsoid's plane is found to 1e-6 rad, and the length is of second order in that
    assert np.allclose(paths.length[:, :half], mirror_paths.length[:, half:], atol=1e-9)
    assert np.allclose(paths.length[:, half:], mirror_paths.length[:, :half], atol=1e-9)


def test_bones_turn_as_the_chains(own: SkierMuscles) -> None:
    for geometry in (own_geometry(), average_geometry(1.75)):
        skier = skier_muscles(geometry)
        q = postures(5)
        # the order of three turns that are shared out matters; each by itself makes up the chain's
        q[:, [PRESCRIBED.index(name) for name in ("lumbar_bending", "lumbar_rotation")]] = 0.0
        bones = skier.model.bones
        stance = stand(bones, q)
        poses = forward_kinematics(geometry, np.hstack([np.zeros((5, 3)), q]), 0.0)
        back = np.swapaxes(poses.rotation[:, 0], 1, 2)
        for name in ("torso", "femur_l", "tibia_r", "calcn_r", "humerus_l"):
            turned, wanted = stance.rotation[:, bones.index(name)], back @ poses.rotation[:, SEGMENT[name]]
            assert np.allclose(turned, wanted, atol=1e-12)  # rounding


def test_the_shift_of_a_joint_is_its_way_on_these_bones(own: SkierMuscles) -> None:
    """Compare with differences; a lumbar joint where a small shared extension turns the torso about does not shift."""
    q = postures(3)
    bones, geometry = own.model.bones, own_geometry()
    shift = joint_shift(own, geometry, stand(bones, q))
    step = 1e-6
    for segment, point in (
        ("tibia_r", np.zeros(3)),
        ("torso", geometry.joint_in_parent[SEGMENT["torso"]] - own.torso_origin),
    ):
        for name, moved in shift[segment].items():
            c = step * np.eye(len(PRESCRIBED))[PRESCRIBED.index(name)]
            i = bones.index(segment)
            ahead, behind = (stand(bones, q + sign * c) for sign in (1.0, -1.0))
            places = [pose.origin[:, i] + pose.rotation[:, i] @ point for pose in (ahead, behind)]
            assert np.allclose((places[0] - places[1]) / (2.0 * step), moved, atol=1e-9)  # rounding over the step
    upright = joint_shift(own, geometry, stand(bones, np.zeros((1, len(PRESCRIBED)))))
    assert np.allclose(upright["torso"]["lumbar_extension"], 0.0, atol=1e-12)  # rounding


def test_fibres_of_the_trunk_are_within_what_sarcomeres_say(own: SkierMuscles) -> None:
    lengths = muscle_paths(own.model, np.zeros((1, len(PRESCRIBED)))).length[0]
    for named, length in zip(own.named, lengths, strict=True):
        if named.region == "lumbar":
            muscle = named.muscle
            fibre = np.hypot(length - muscle.tendon_slack, muscle.optimal_fibre * np.sin(muscle.pennation))
            assert UPRIGHT[0] - 1e-9 < fibre / muscle.optimal_fibre < UPRIGHT[1] + 1e-9  # rounding


def test_the_vertebrae_share_the_rotations_out(own: SkierMuscles) -> None:
    """Compare with extension of Christophy et al. 2012, table 3: L5/S1 to L1/L2 9.5, 15.4, 21.9, 26.4, 26.8 %."""
    q = np.zeros((1, len(PRESCRIBED)))
    q[0, PRESCRIBED.index("lumbar_extension")] = 0.5
    bones = own.model.bones
    stance = stand(bones, q)
    turned = [0.0]
    for name in ("L5", "L4", "L3", "L2", "L1", "torso"):
        frame = stance.rotation[0, bones.index(name)]
        turned.append(float(np.arctan2(frame[2, 0], frame[0, 0])))  # backwards
    shares = np.diff(turned) / 0.5
    assert shares == pytest.approx([0.0952, 0.1541, 0.2191, 0.2639, 0.2676, 0.0], abs=5e-4)  # as printed


def test_scaled_with_the_skier(own: SkierMuscles) -> None:
    """Scale the whole skier: the muscles are scaled alike."""
    geometry = own_geometry()
    large = skier_muscles(replace(geometry, joint_in_parent=1.1 * geometry.joint_in_parent))
    q = postures(4)
    before, after = muscle_paths(own.model, q), muscle_paths(large.model, q)
    assert np.allclose(after.length, 1.1 * before.length, rtol=1e-9)  # rounding, and an ellipsoid's plane
    assert np.allclose(after.moment_arm, 1.1 * before.moment_arm, atol=1e-6)
    for small, big in zip(own.model.muscles, large.model.muscles, strict=True):
        assert big.optimal_fibre == pytest.approx(1.1 * small.optimal_fibre)
        assert big.tendon_slack == pytest.approx(1.1 * small.tendon_slack)
        # of one volume, as the body's mass and height are the same, but longer: thinner
        assert big.max_isometric_force == pytest.approx(small.max_isometric_force / 1.1)


def test_strength_goes_by_volume_and_volume_by_mass_and_height(own: SkierMuscles) -> None:
    assert leg_volume(70.0, 1.70) == pytest.approx(6878.0)  # cm³, 47 · 119 + 1285
    heavy = skier_muscles(own_geometry(), (1.2 * OWN_BODY[0], OWN_BODY[1]))
    wanted = leg_volume(1.2 * OWN_BODY[0], OWN_BODY[1]) / leg_volume(*OWN_BODY)
    assert 1.1 < wanted < 1.2
    for usual, strong in zip(own.model.muscles, heavy.model.muscles, strict=True):
        assert strong.max_isometric_force == pytest.approx(wanted * usual.max_isometric_force)
        assert strong.optimal_fibre == pytest.approx(usual.optimal_fibre)
    rows = muscles_table()
    for row, muscle in zip(rows, own.model.muscles, strict=True):
        assert muscle.max_isometric_force == pytest.approx(float(row["max_isometric_force_N"]))


def test_the_full_set_has_the_papers_muscles_as_they_are(own: SkierMuscles) -> None:
    of_paper = skier_muscles(own_geometry(), chosen="paper").model.muscles
    of_full = {muscle.name: muscle for muscle in own.model.muscles}
    assert {muscle.name for muscle in of_paper} < set(of_full)
    q = postures(3)
    full_length = muscle_paths(own.model, q).length
    paper_length = muscle_paths(skier_muscles(own_geometry(), chosen="paper").model, q).length
    columns = [list(of_full).index(muscle.name) for muscle in of_paper]
    assert np.allclose(paper_length, full_length[:, columns], atol=1e-9)  # an ellipsoid's plane


# Moment arms (m) as measured on cadavers and in images by the studies that are named, in wide, rounded ranges: wrong
# signs, sides and units fall out of them.  Extension of knee and hip, plantar flexion and lumbar extension are what
# these muscles do.
PUBLISHED = [
    ("vas_int_r", "knee_angle_r", 0.35, -0.060, -0.035),  # Buford et al. 1997, Spoor & van Leeuwen 1992
    ("bifemlh_r", "knee_angle_r", 0.80, 0.015, 0.045),  # Spoor & van Leeuwen 1992, Herzog & Read 1993
    ("soleus_r", "ankle_angle_r", 0.0, -0.060, -0.035),  # Maganaris et al. 2000, Rugg et al. 1990
    ("tib_ant_r", "ankle_angle_r", 0.0, 0.030, 0.055),  # Rugg et al. 1990, Maganaris 2000
    ("add_long_r", "hip_adduction_r", 0.0, 0.045, 0.095),  # Dostal et al. 1986, Arnold et al. 2010
    ("add_mag2_r", "hip_adduction_r", 0.0, 0.035, 0.085),  # Dostal et al. 1986
    ("grac_r", "hip_adduction_r", 0.0, 0.045, 0.095),  # Dostal et al. 1986
    ("peri_r", "hip_rotation_r", 0.0, -0.045, -0.010),  # Dostal et al. 1986: outwards
    ("quad_fem_r", "hip_rotation_r", 0.0, -0.045, -0.010),  # Dostal et al. 1986: outwards
    ("grac_r", "knee_angle_r", 0.8, 0.020, 0.055),  # Spoor & van Leeuwen 1992
    ("sar_r", "hip_flexion_r", 0.3, 0.030, 0.110),  # Arnold et al. 2010
    ("tib_post_r", "ankle_angle_r", 0.0, -0.025, 0.0),  # Spoor et al. 1990: under 1 cm
    ("ext_dig_r", "ankle_angle_r", 0.0, 0.025, 0.055),  # Spoor et al. 1990
    ("semimem_r", "hip_flexion_r", 0.3, -0.075, -0.035),  # Arnold et al. 2000, Németh & Ohlsén 1985
    ("LTpT_T10_r", "lumbar_extension", 0.0, 0.040, 0.075),  # Jorgensen et al. 2001: 0.05-0.06 at L3-L5
    ("rect_abd_r", "lumbar_extension", 0.0, -0.130, -0.060),  # Jorgensen et al. 2001: 0.07-0.12
]


@pytest.mark.parametrize(("muscle", "coordinate", "angle", "low", "high"), PUBLISHED)
def test_within_published_ranges(
    own: SkierMuscles, muscle: str, coordinate: str, angle: float, low: float, high: float
) -> None:
    q = np.zeros((1, len(PRESCRIBED)))
    q[0, PRESCRIBED.index(coordinate)] = angle
    arms = muscle_paths(own.model, q, [coordinate]).moment_arm[0, :, 0]
    (index,) = [i for i, candidate in enumerate(own.model.muscles) if candidate.name == muscle]
    assert low < arms[index] < high
