"""A skier who stands still on level snow with bent hips, knees and trunk, as a result of a simulation."""

from collections.abc import Mapping

import numpy as np
from flat_snow import flat_snow

from sssi_exudyn.bodies.muscles.muscles import own_geometry
from sssi_exudyn.bodies.skier.chain import COORDINATES, PRESCRIBED, SEGMENT, Geometry, forward_kinematics, jacobians
from sssi_exudyn.bodies.skier.inverse_dynamics import joint_loads
from sssi_exudyn.core.frames import Array, gravity_in_slope
from sssi_exudyn.model.model import Model
from sssi_exudyn.motion.motion import spline_motion
from sssi_exudyn.simulation.assembly import Parts
from sssi_exudyn.simulation.result import SimulationResult

CROUCH = {
    "hip_flexion": 0.9,
    "knee_angle": 1.1,
    "ankle_angle": 0.35,
    "lumbar_extension": -0.35,
    "arm_flex": 0.4,
    "elbow_flex": 0.6,
}


TUCK = {
    "hip_flexion": 2.1,
    "knee_angle": 1.75,
    "ankle_angle": 0.4,
    "lumbar_extension": -0.5,
    "arm_flex": 1.4,
    "elbow_flex": 1.9,
}


def angles(bend: Mapping[str, float] = CROUCH) -> Array:
    """Return angles (28,) rad, the same on both sides; the pelvis tilts so that the feet are flat."""
    q = np.zeros(len(PRESCRIBED))
    for i, name in enumerate(PRESCRIBED):
        q[i] = bend.get(name.removesuffix("_r").removesuffix("_l"), 0.0)
    q[PRESCRIBED.index("pelvis_tilt")] = bend["knee_angle"] - bend["hip_flexion"] - bend["ankle_angle"]
    return q


def geometry() -> Geometry:
    """Return the lengths of the model whose muscles are used."""
    return own_geometry()


def standing(
    model: Model, samples: int = 40, lead: float = 0.0, bend: Mapping[str, float] = CROUCH
) -> SimulationResult:
    """Return the skier for ``samples`` samples of 10 ms.

    The feet share his weight and are placed under his centre of mass.

    lead : share of the weight that is moved from the left to the right foot
    bend : rad of the joints
    """
    time = 0.01 * np.arange(samples)
    chain = geometry()
    body = np.tile(angles(bend), (samples, 1))
    q = np.hstack([np.zeros((samples, 3)), body])
    parts = Parts(model, spline_motion(chain, 0.0, time, body))
    still = np.zeros_like(q)
    _, moments = joint_loads(chain, parts.inertias, 0.0, gravity_in_slope(0.0), q, still, still)
    weight = parts.mass * 9.81
    poses = forward_kinematics(chain, q, 0.0)
    com = sum(
        part.mass * (poses.origin[:, i] + poses.rotation[:, i] @ part.com) for i, part in enumerate(parts.inertias)
    ) / sum(part.mass for part in parts.inertias)
    ski = 0.5 * (parts.mass - parts.body_mass)
    feet = np.array([SEGMENT["calcn_l"], SEGMENT["calcn_r"]])
    place = poses.origin[:, feet].copy()
    place[..., 0] = com[:, None, 0]
    load = np.stack([np.full(samples, (0.5 - lead) * weight), np.full(samples, (0.5 + lead) * weight)], axis=1)
    # the skis weigh on the snow, not on the feet
    on_feet = np.zeros((samples, 2, 3))
    on_feet[..., 2] = load - ski * 9.81
    _, linear = jacobians(poses, feet, place)
    moments = moments - np.einsum("nsck,nsc->nk", linear, on_feet)[:, 3:]
    zero = np.zeros((samples, 3))
    pairs = np.zeros((samples, 2))
    return SimulationResult(
        coordinate_names=COORDINATES,
        moment_names=PRESCRIBED,
        time=time,
        pelvis=zero,
        pelvis_velocity=zero,
        com=com,
        com_velocity=zero,
        antenna=None,
        coordinates=q,
        foot_load=load,
        sole_force=load,
        foot_friction=np.zeros((samples, 2, 3)),
        foot_position=place,
        foot_velocity=np.zeros((samples, 2, 3)),
        foot_forward=np.tile([1.0, 0.0, 0.0], (samples, 2, 1)),
        snow=flat_snow(load, np.zeros((samples, 2, 3))),
        edge_angle=pairs,
        penetration=pairs,
        drag=zero,
        joint_moments=moments,
        ski_deflection=np.zeros((samples, 2, 2)),
        energy={},
        energy_closure=np.zeros(samples),
        statistics={},
    )
