"""The muscle forces that make a run's joint moments, and the loads of the joints.

At each instant muscles have to make the inverse dynamics' moments of hips, knees, ankles and lumbar joint, 13 in all.
Static optimisation shares these among them (``static_optimisation``).  The other joints, those of the arms, have
moments of their own: latissimus dorsi counts at the spine alone.

A joint's load is the force through it without muscles, by Newton's law for everything beyond it, plus the pressure of
the muscles that cross it.  The quadriceps reach the tibia through the patella's ligament, whose force follows from the
knee moment they make.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from sssi_exudyn.bodies.muscles.bones import Bones, Stance, stand
from sssi_exudyn.bodies.muscles.force_curves import fibres
from sssi_exudyn.bodies.muscles.muscles import SkierMuscles, joint_shift
from sssi_exudyn.bodies.muscles.paths import Paths, muscle_paths
from sssi_exudyn.bodies.skier.chain import PRESCRIBED, SEGMENT, Geometry
from sssi_exudyn.core.frames import Array
from sssi_exudyn.muscle_forces.static_optimisation import optimise

MUSCLED: Final = tuple(name for name in PRESCRIBED if name.startswith(("hip_", "knee_", "ankle_", "lumbar_")))
"""The coordinates whose moments muscles make."""
LACKS: Final = 1.0
"""N m of reserve above which a joint lacks strength."""
_CROSSED: Final = (*MUSCLED, *(name for name in PRESCRIBED if name.startswith("arm_")))
"""The coordinates that lengthen the muscles."""
_UPPER: Final = ("L5", "L4", "L3", "L2", "L1", "torso", "humerus_r", "humerus_l")
JOINTS: Final[dict[str, tuple[str, tuple[str, ...]]]] = {
    **{
        f"{joint}_{side}": (f"{segment}_{side}", tuple(f"{bone}_{side}" for bone in beyond))
        for joint, segment, beyond in (
            ("hip", "femur", ("femur", "patella", "tibia", "talus", "calcn")),
            ("knee", "tibia", ("tibia", "talus", "calcn")),
            ("ankle", "talus", ("talus", "calcn")),
        )
        for side in "rl"
    },
    "L5_S1": ("torso", _UPPER),
}
"""The joints with a contact force: the chain's segment beyond, and the muscles' bones beyond."""
_STRETCH: Final = 512
"""Number of instants computed at once."""


@dataclass(frozen=True)
class MuscleForces:
    """m muscles at n instants.

    activation : (n, m)
    force : (n, m) N along the tendons
    fibre_length : (n, m) in optimal lengths
    wanted : (n, 13) N m, the required moments of ``MUSCLED``, about the joints of the muscles' bones
    made : (n, 13) N m that the muscles make
    reserve : (n, 13) N m, the missing moments
    contact : (n, 7, 3) N of the inner part on the outer part at each of ``JOINTS``, in the pelvis' axes
    """

    activation: Array
    force: Array
    fibre_length: Array
    wanted: Array
    made: Array
    reserve: Array
    contact: Array


def muscle_forces(
    skier: SkierMuscles,
    geometry: Geometry,
    time: Array,
    angles: Array,
    rates: Array,
    moments: Array,
    joint_force: Array,
    power: int = 2,
) -> MuscleForces:
    """Compute the forces of all muscles.

    Parameters
    ----------
    skier, geometry : muscles, and the chain they are on
    time : (n,) s
    angles, rates, moments : (n, 28) rad, rad/s, N m of the chain's prescribed coordinates
    joint_force : (n, 21, 3) N that each segment gets from its parent, muscles and all, in the pelvis' axes
    power : exponent of the activations in the minimised sum
    """
    parts: list[tuple[Array, ...]] = []
    before = None
    for rows in np.array_split(np.arange(len(angles)), max(1, -(-len(angles) // _STRETCH))):
        stretch = (time[rows], angles[rows], rates[rows], moments[rows], joint_force[rows])
        parts.append(_stretch(skier, geometry, *stretch, power, before))
        before = float(time[rows[-1]]), parts[-1][0][-1]
    return MuscleForces(*(np.concatenate(columns) for columns in zip(*parts, strict=True)))


def _stretch(
    skier: SkierMuscles,
    geometry: Geometry,
    time: Array,
    angles: Array,
    rates: Array,
    moments: Array,
    joint_force: Array,
    power: int,
    before: tuple[float, Array] | None,
) -> tuple[Array, ...]:
    muscles = skier.model.muscles
    stance = stand(skier.model.bones, angles)
    paths = muscle_paths(skier.model, angles, _CROSSED, [beyond for _, beyond in JOINTS.values()])
    muscle_fibres = fibres(
        paths.length,
        paths.speed(rates[:, [PRESCRIBED.index(name) for name in _CROSSED]]),
        np.array([muscle.max_isometric_force for muscle in muscles]),
        np.array([muscle.optimal_fibre for muscle in muscles]),
        np.array([muscle.tendon_slack for muscle in muscles]),
        np.array([muscle.pennation for muscle in muscles]),
    )
    arms = np.swapaxes(paths.moment_arm[:, :, : len(MUSCLED)], 1, 2)
    wanted = moments[:, [PRESCRIBED.index(name) for name in MUSCLED]].copy()
    for segment, shifts in joint_shift(skier, geometry, stance).items():
        for name, shift in shifts.items():
            wanted[:, MUSCLED.index(name)] += np.sum(joint_force[:, SEGMENT[segment]] * shift, axis=1)
    optimum = optimise(arms * muscle_fibres.force[:, None], wanted, power, time, before)
    force = optimum.activation * muscle_fibres.force
    made = np.einsum("ncm,nm->nc", arms, force)
    contact = _contact(skier, stance, paths, force, joint_force)
    return optimum.activation, force, muscle_fibres.length, wanted, made, wanted - made, contact


def _contact(skier: SkierMuscles, stance: Stance, paths: Paths, force: Array, joint_force: Array) -> Array:
    """Return the force (n, 7, 3) N through each joint less the muscles' part of it."""
    pulled = np.einsum("nmgk,nm->ngk", paths.pull, force)
    for side in "rl":
        pulled[:, list(JOINTS).index(f"knee_{side}")] += _ligament(skier, stance, paths, force, side)
    through = joint_force[:, [SEGMENT[segment] for segment, _ in JOINTS.values()]]
    return np.asarray(through - pulled)


def _ligament(skier: SkierMuscles, stance: Stance, paths: Paths, force: Array, side: str) -> Array:
    """Return the force (n, 3) N of the patella's ligament on the tibia.

    The muscles that end on the patella make the moment M about the knee through it: with u its direction and v the
    velocity of its end on the tibia a unit rate of the knee, F u · v = M.
    """
    tree = skier.model.bones
    tibia, patella = skier.ligament[side]
    end = _point(tree, stance, f"tibia_{side}", tibia)
    direction = _point(tree, stance, f"patella_{side}", patella) - end
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    knee = f"knee_angle_{side}"
    i, c = tree.index(f"tibia_{side}"), PRESCRIBED.index(knee)
    velocity = stance.moving[:, i, c] + np.cross(stance.turning[:, i, c], end)
    on_patella = [k for k, muscle in enumerate(skier.model.muscles) if muscle.points[-1].bone == f"patella_{side}"]
    moment = np.sum(paths.moment_arm[:, on_patella, paths.coordinates.index(knee)] * force[:, on_patella], axis=1)
    return np.asarray((moment / np.sum(direction * velocity, axis=1))[:, None] * direction)


def _point(tree: Bones, stance: Stance, bone: str, place: Array) -> Array:
    i = tree.index(bone)
    return np.asarray(stance.origin[:, i] + stance.rotation[:, i] @ place)
