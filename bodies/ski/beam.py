"""A ski's mesh as Exudyn beam elements (geometrically exact, two nodes with quaternions each)."""

from __future__ import annotations

from dataclasses import dataclass

import exudyn as exu
import numpy as np
from exudyn.itemInterface import (
    MarkerNodeRigid,
    NodeRigidBodyEP,
    ObjectBeamGeometricallyExact,
    RigidBodySpringDamper,
)
from scipy.spatial.transform import Rotation

from sssi_exudyn.bodies.ski.mesh import BeamMesh
from sssi_exudyn.bodies.ski.modes import damping_time
from sssi_exudyn.core.frames import Array


@dataclass(frozen=True)
class SkiBeam:
    """Indices of a ski's items in the system it was added to, from tail to tip."""

    nodes: tuple[int, ...]
    node_markers: tuple[int, ...]
    elements: tuple[int, ...]
    dampers: tuple[int, ...]


def add_ski_beam(
    mbs: exu.MainSystem,
    mesh: BeamMesh,
    pose: Array,
    velocity: Array,
    angular_velocity: Array,
    *,
    damped: bool = True,
    name: str = "ski",
) -> SkiBeam:
    """Add a free ski, unloaded, moving as one rigid body.

    Parameters
    ----------
    pose : (4, 4) homogeneous transform from the ski's frame (origin at the boot centre) to the system's
    velocity : (3,) of the ski frame's origin, m/s, in the system's frame
    angular_velocity : (3,) rad/s, in the system's frame
    damped : add the structural damping as rotational dampers between neighbouring nodes
    name : start of the items' names, such as ``left_ski_node_0`` at the tail

    Camber and shovel are the nodes' reference poses: Exudyn takes the reference configuration as free of stress.
    Nothing is clamped here.
    """
    turn, origin = pose[:3, :3], pose[:3, 3]
    nodes, markers = [], []
    arms = mesh.node_position @ turn.T
    frames = Rotation.from_matrix(turn @ mesh.node_rotation).as_quat(scalar_first=True)
    places = np.hstack([origin + arms, frames])
    rates = np.hstack([velocity + np.cross(angular_velocity, arms), _quaternion_rates(frames, angular_velocity)])
    for number, (place, rate) in enumerate(zip(places.tolist(), rates.tolist(), strict=True)):
        own = f"{name}_node_{number}"
        node = mbs.AddNode(NodeRigidBodyEP(name=own, referenceCoordinates=place, initialVelocities=rate))
        nodes.append(int(node))
        markers.append(int(mbs.AddMarker(MarkerNodeRigid(name=own, nodeNumber=node))))
    elements = [
        int(
            mbs.AddObject(
                ObjectBeamGeometricallyExact(
                    name=f"{name}_beam_{e}",
                    nodeNumbers=nodes[e : e + 2],
                    length=mesh.element_length[e],
                    sectionData=_section(mesh, e),
                )
            )
        )
        for e in range(len(mesh.element_length))
    ]
    return SkiBeam(
        nodes=tuple(nodes),
        node_markers=tuple(markers),
        elements=tuple(elements),
        dampers=_add_dampers(mbs, mesh, markers, name) if damped else (),
    )


def _section(mesh: BeamMesh, element: int) -> exu.BeamSection:
    section = exu.BeamSection()
    section.stiffnessMatrix = np.diag(mesh.stiffness[element])
    section.inertia = np.diag(mesh.section_inertia[element])
    section.massPerLength = mesh.element_mass[element] / mesh.element_length[element]
    return section


def _add_dampers(mbs: exu.MainSystem, mesh: BeamMesh, markers: list[int], name: str) -> tuple[int, ...]:
    """Add dampers D = τK between neighbours, for rotations only: an element's own damping matrix has no effect in
    Exudyn.
    """
    tau = damping_time(mesh)
    dampers = []
    for e, length in enumerate(mesh.element_length):
        damping = np.diag([0.0, 0.0, 0.0, *(tau / length * mesh.stiffness[e, 3:])])
        damper = RigidBodySpringDamper(
            name=f"{name}_damper_{e}",
            markerNumbers=markers[e : e + 2],
            stiffness=np.zeros((6, 6)),
            damping=damping,
            useIntrinsicFormulation=True,
        )
        dampers.append(int(mbs.AddObject(damper)))
    return tuple(dampers)


def _quaternion_rates(quaternions: Array, angular_velocity: Array) -> Array:
    """Return the rates of (n, 4) quaternions (w, x, y, z) for an angular velocity in the outer frame: q̇ = ½ (0, ω) ∘
    q.
    """
    scalar, vector = quaternions[:, :1], quaternions[:, 1:]
    turned = scalar * angular_velocity + np.cross(angular_velocity, vector)
    return 0.5 * np.hstack([-(vector @ angular_velocity)[:, None], turned])
