"""A posture from few coordinates: skis on the snow, hips' width apart, in balance."""

from __future__ import annotations

import numpy as np
import pytest

from sssi_exudyn.bodies.skier.anthropometry import body_inertia
from sssi_exudyn.bodies.skier.chain import SEGMENTS, average_geometry
from sssi_exudyn.core.frames import BODY_FROM_BVH, Array
from sssi_exudyn.recording.few_sensors.posture_model import (
    JOINTS,
    Body,
    Coordinates,
    capture_from_posture,
    solve_posture,
)
from sssi_exudyn.recording.instruments.bvh import joint_positions, world_rotations

HEIGHT, MASS, GEAR, BASE = 1.75, 75.0, 4.3, 0.13
BODY = Body(HEIGHT, MASS, GEAR, BASE)
LEANS = np.radians(np.linspace(-45.0, 45.0, 13))


def postures(edge: Array, lean: Array) -> tuple[Array, Array]:
    """Return world rotations (n, J, 3, 3) and places (n, J, 3) m from the hips, snow's frame, body axes."""
    snow = np.tile(np.eye(3), (len(lean), 1, 1))
    solved = solve_posture(Coordinates(snow, np.stack([edge, edge], axis=1), lean), BODY)
    bvh = capture_from_posture(solved, snow, np.arange(len(lean)) / 50.0, HEIGHT)
    world = world_rotations(bvh)
    return BODY_FROM_BVH @ world @ BODY_FROM_BVH.T, joint_positions(bvh, world) @ BODY_FROM_BVH.T


def soles(world: Array, place: Array) -> Array:
    """Return the places (n, 2, 3) m of the soles, left and right."""
    feet = [JOINTS.index(side + "Foot") for side in ("Left", "Right")]
    return np.stack([place[:, foot] - BASE * world[:, foot, :, 2] for foot in feet], axis=1)


def test_both_skis_lie_on_the_snow_with_the_outside_one_pressed_deeper() -> None:
    under = soles(*postures(LEANS, LEANS))[..., 2]
    apart = under[:, 0] - under[:, 1]
    # leaning right the left ski is the outside one; 12 mm at full lean is what carries four fifths of the load
    np.testing.assert_allclose(apart, -0.012 * np.tanh(LEANS / np.radians(10.0)), atol=1e-9)


def test_skis_are_a_hips_width_apart_across_the_shins() -> None:
    world, place = postures(LEANS, LEANS)
    legs = [JOINTS.index(side + "Leg") for side in ("Left", "Right")]
    across = np.einsum("ni,ni->n", place[:, legs[0]] - place[:, legs[1]], world[:, legs[0], :, 1])
    hips = 2.0 * 0.0535 * HEIGHT
    # the pelvis rolls by half of the edge angle, so the hips are seen from that much askew
    np.testing.assert_allclose(across, hips * np.cos(0.5 * LEANS), atol=1e-9)


def test_the_outside_leg_is_the_longer_one() -> None:
    world, _ = postures(LEANS, LEANS)

    def flexion(side: str) -> Array:
        thigh, shank = (world[:, JOINTS.index(side + part), :, 2] for part in ("UpLeg", "Leg"))
        return np.asarray(np.arccos(np.sum(thigh * shank, axis=1)))

    left, right = flexion("Left"), flexion("Right")
    np.testing.assert_allclose(np.minimum(left, right), np.radians(45.0), atol=1e-9)
    assert np.all((right - left) * np.sign(LEANS) >= -1e-9)


@pytest.mark.parametrize("steeper_deg", [-8.0, 0.0, 8.0])
def test_the_centre_of_mass_of_de_leva_stands_where_the_force_needs_it(steeper_deg: float) -> None:
    edge = LEANS + np.radians(steeper_deg) * np.sign(LEANS)
    world, place = postures(edge, LEANS)
    under = soles(world, place)
    centre = _centre_of_mass(world, place)
    share = 0.5 + 0.3 * np.tanh(LEANS / np.radians(10.0))
    load = share[:, None] * under[:, 0] + (1.0 - share)[:, None] * under[:, 1]
    arm = centre - load
    # two tables of segments' masses (Winter, de Leva) and the head's and arms' own places differ by 3 cm
    # where the trunk bends as far as it can, the posture itself reports by how much it is out of balance
    snow = np.tile(np.eye(3), (len(LEANS), 1, 1))
    missed = solve_posture(Coordinates(snow, np.stack([edge, edge], axis=1), LEANS), BODY).unbalanced
    expected = arm[:, 2] * np.tan(LEANS) - missed
    np.testing.assert_allclose(-arm[:, 1], expected, atol=0.04)
    assert np.max(np.abs(missed)) < 0.1


def _centre_of_mass(world: Array, place: Array) -> Array:
    """Return the centre of mass (n, 3) m: de Leva's masses on the captured joints, boots and bindings on the feet."""
    geometry = average_geometry(HEIGHT)
    inertias = body_inertia(geometry, MASS, "male", boot_mass=1.9, binding_mass=2.4)
    names = {
        "pelvis": "Hips",
        "torso": "Spine",
        "head": "Neck",
        **{
            f"{segment}_{side}": word + joint
            for side, word in (("l", "Left"), ("r", "Right"))
            for segment, joint in (
                ("femur", "UpLeg"),
                ("tibia", "Leg"),
                ("calcn", "Foot"),
                ("humerus", "Arm"),
                ("radius", "ForeArm"),
                ("hand", "Hand"),
            )
        },
    }
    total, moment = 0.0, np.zeros_like(place[:, 0])
    for segment, body in zip(SEGMENTS, inertias, strict=True):
        joint = names.get(segment)
        if joint is None:
            continue
        at = JOINTS.index(joint)
        arm = body.com
        if any(part in joint for part in ("Arm", "Hand")):  # hanging in the chain, sideways in a capture
            left = 1.0 if joint.startswith("Left") else -1.0
            arm = np.array([arm[0], -left * arm[2], 0.0])
        moment = moment + body.mass * (place[:, at] + world[:, at] @ arm)
        total += body.mass
    return np.asarray(moment / total)
