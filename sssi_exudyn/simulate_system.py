"""The full model as an Exudyn system: skeleton, two flexible skis clamped to the feet, and the forces on them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import exudyn as exu
import numpy as np
from exudyn.itemInterface import (
    CoordinateConstraint,
    GenericJoint,
    LoadCoordinate,
    MarkerNodeCoordinate,
    NodePointGround,
)
from scipy.spatial.transform import Rotation

from sssi_exudyn.bodies.anthropometry import SegmentInertia, body_inertia
from sssi_exudyn.bodies.beam import SkiBeam, add_ski_beam
from sssi_exudyn.bodies.skeleton import Skeleton, add_skeleton, chain_links
from sssi_exudyn.bodies.ski_mesh import BeamMesh, mesh
from sssi_exudyn.bodies.ski_modes import damping_time
from sssi_exudyn.chain import FEET
from sssi_exudyn.contact.air import FrontalAreas
from sssi_exudyn.contact.backend import CompiledForces, Instant, Sections, add_forces
from sssi_exudyn.contact.kernel import NODE, TREE
from sssi_exudyn.frames import Array, gravity_in_slope
from sssi_exudyn.model import Model
from sssi_exudyn.motion import Motion
from sssi_exudyn.posture import Posture, posture_at


@dataclass(frozen=True)
class Parts:
    """What of a model does not change along the run: masses, the skis' mesh, frontal areas."""

    model: Model
    motion: Motion

    @cached_property
    def mesh(self) -> BeamMesh:
        return mesh(self.model.ski, self.model.solver.elements)

    @cached_property
    def inertias(self) -> tuple[SegmentInertia, ...]:
        gear = self.model.equipment
        return body_inertia(
            self.motion.geometry,
            self.model.skier.mass,
            self.model.skier.sex,
            boot_mass=gear.boot_mass,
            binding_mass=gear.ski_mass - float(self.mesh.element_mass.sum()),
        )

    @cached_property
    def areas(self) -> dict[str, float]:
        """Frontal area of each exposed segment, m²."""
        return FrontalAreas().of_height(self.model.skier.height)

    @cached_property
    def body_mass(self) -> float:
        """Skier, boots and bindings, kg."""
        return sum(body.mass for body in self.inertias)

    @cached_property
    def mass(self) -> float:
        """All that moves, kg."""
        return self.body_mass + 2.0 * float(self.mesh.element_mass.sum())

    @cached_property
    def ski_in_foot(self) -> Array:
        """(3,) m: the ski frame's origin counted from the running surface under the ankle, in the foot's frame."""
        return np.array([0.0, 0.0, -float(self.model.ski.height(self.model.ski.s_of_x(0.0)))])

    @cached_property
    def sections(self) -> Sections:
        cut = self.mesh
        tau = damping_time(cut)
        return Sections(
            element=cut.contact_element,
            share=cut.contact_weight,
            offset=_edge_offsets(cut),
            length=cut.contact_length,
            damping=tau * cut.stiffness[:, 3:] / cut.element_length[:, None],
        )

    def posture(self, time: Array) -> Posture:
        """The posture at ``time`` (n,)."""
        return posture_at(self.motion, self.inertias, tuple(self.areas), time)


def _edge_offsets(cut: BeamMesh) -> Array:
    """(m, 2, 3) m: both edges of each contact section in the section's own frame, from the unloaded ski."""
    from sssi_exudyn.contact.kernel import between, turned

    def quaternion(rotation: Array) -> Array:
        return Rotation.from_matrix(rotation).as_quat(scalar_first=True)

    s = cut.contact_s
    half = 0.5 * cut.ski.width(s)
    left = np.stack([cut.ski.x_of_s(s), half, cut.ski.height(s)], axis=1)
    offsets = np.empty((len(s), 2, 3))
    for m, (element, xi) in enumerate(zip(cut.contact_element, cut.contact_weight, strict=True)):
        place, frame = between(
            cut.node_position[element],
            quaternion(cut.node_rotation[element]),
            cut.node_position[element + 1],
            quaternion(cut.node_rotation[element + 1]),
            xi,
        )
        frame = frame / np.linalg.norm(frame)
        for edge, sign in enumerate((1.0, -1.0)):
            offsets[m, edge] = turned(frame * [1.0, -1.0, -1.0, -1.0], left[m] * [1.0, sign, 1.0] - place)
    return offsets


def instant(posture: Posture, row: int) -> Instant:
    """One row of a posture table as the force kernel wants it."""
    return Instant(
        time=float(posture.time[row]),
        foot_place=posture.foot_place[row],
        foot_velocity=posture.foot_velocity[row],
        foot_rotation=posture.foot_rotation[row],
        foot_jacobian=posture.foot_jacobian[row],
        com_place=posture.com_place[row],
        com_velocity=posture.com_velocity[row],
        com_jacobian=posture.com_jacobian[row],
        exposed_velocity=posture.exposed_velocity[row],
        exposed_jacobian=posture.exposed_jacobian[row],
    )


@dataclass
class System:
    """An assembled Exudyn system, with the posture of the step that is being solved."""

    container: Any
    mbs: Any
    skeleton: Skeleton
    skis: tuple[SkiBeam, SkiBeam]
    forces: CompiledForces
    ref: Array
    now: Instant


def build(parts: Parts, posture: Posture, pelvis: Array, velocity: Array, *, held_by: float | None = None) -> System:
    """Assemble the model in the posture of row 0 with the pelvis at ``pelvis`` (3,) m, moving with ``velocity`` (3,) m/s.

    With ``held_by`` nothing moves but the skis and the pelvis' height: friction and movement are left out, and the skier is
    pressed on the snow by a force (N) along the normal in place of gravity.  That is how the start is found.
    """
    container = exu.SystemContainer()
    mbs = container.AddSystem()
    standing = held_by is not None
    rates = np.zeros(28) if standing else posture.rates[0]
    velocity = np.zeros(3) if standing else velocity
    gravity = np.zeros(3) if standing else gravity_in_slope(parts.model.inclination)
    skeleton = add_skeleton(
        mbs,
        parts.motion.geometry,
        parts.inertias,
        gravity,
        parts.model.inclination,
        np.concatenate([pelvis, posture.angles[0]]),
        np.concatenate([velocity, rates]),
    )
    skis = []
    for side in range(2):
        turn = posture.foot_rotation[0, side]
        pose = np.eye(4)
        pose[:3, :3] = turn
        pose[:3, 3] = pelvis + posture.foot_place[0, side] + turn @ parts.ski_in_foot
        still = np.zeros(3)
        spin = still if standing else posture.foot_spin[0, side]
        moving = still if standing else velocity + posture.foot_velocity[0, side] + np.cross(spin, turn @ parts.ski_in_foot)
        ski = add_ski_beam(mbs, parts.mesh, pose, moving, spin, damped=False)
        _clamp(mbs, parts, skeleton, ski, side)
        skis.append(ski)
    if not standing:
        _add_gravity(mbs, parts, skis, gravity)
    else:
        _hold(mbs, skeleton, pelvis, -held_by)
    nodes = [skeleton.node, *skis[0].nodes, *skis[1].nodes]
    ref = np.concatenate([np.asarray(mbs.GetNode(node)["referenceCoordinates"], dtype=np.float64) for node in nodes])
    terms = [term for term in parts.model.terms if not standing or term.kind in ("point", "terrain")]
    forces = CompiledForces(terms, parts.sections, skeleton.links.sign, np.array(list(parts.areas.values())), ref)
    system = System(container, mbs, skeleton, (skis[0], skis[1]), forces, ref, instant(posture, 0))
    add_forces(mbs, nodes, forces, lambda: system.now)
    mbs.Assemble()
    return system


def _clamp(mbs: Any, parts: Parts, skeleton: Skeleton, ski: SkiBeam, side: int) -> None:
    """Fix the ski's middle node to the foot (paper 2.2.2)."""
    cut = parts.mesh
    sole = np.array([0.0, 0.0, -parts.motion.geometry.ankle_to_ski_base])
    ankle = sole - parts.motion.geometry.joint_in_parent[FEET[side]]
    place = ankle + parts.ski_in_foot + cut.node_position[cut.middle]
    marker = skeleton.marker(mbs, FEET[side], place, cut.node_rotation[cut.middle])
    mbs.AddObject(GenericJoint(markerNumbers=[marker, ski.node_markers[cut.middle]], constrainedAxes=[1] * 6))


def _add_gravity(mbs: Any, parts: Parts, skis: Sequence[SkiBeam], gravity: Array) -> None:
    """The skis' weight, each element's half to each of its nodes."""
    from exudyn.itemInterface import LoadForceVector

    mass = np.zeros(len(parts.mesh.node_s))
    mass[:-1] += 0.5 * parts.mesh.element_mass
    mass[1:] += 0.5 * parts.mesh.element_mass
    for ski in skis:
        for marker, share in zip(ski.node_markers, mass, strict=True):
            mbs.AddLoad(LoadForceVector(markerNumber=marker, loadVector=list(share * gravity)))


def _hold(mbs: Any, skeleton: Skeleton, pelvis: Array, load: float) -> None:
    """Keep the pelvis where it is along the slope and load it along the normal."""
    ground = mbs.AddMarker(MarkerNodeCoordinate(nodeNumber=mbs.AddNode(NodePointGround()), coordinate=0))
    for coordinate in range(2):
        marker = mbs.AddMarker(MarkerNodeCoordinate(nodeNumber=skeleton.node, coordinate=coordinate))
        mbs.AddObject(CoordinateConstraint(markerNumbers=[ground, marker], offset=float(pelvis[coordinate])))
    marker = mbs.AddMarker(MarkerNodeCoordinate(nodeNumber=skeleton.node, coordinate=2))
    mbs.AddLoad(LoadCoordinate(markerNumber=marker, load=load))


def rigid_rates(parts: Parts, posture: Posture, velocity: Array, coordinates: Array) -> Array:
    """Rates of all coordinates (total values given) when every ski moves with its foot as one body, posture of row 0.

    The skeleton's angles turn as the tree counts them.
    """
    rates = np.zeros(len(coordinates))
    rates[:3] = velocity
    rates[3:TREE] = chain_links(parts.motion.geometry).sign[3:] * posture.rates[0]
    nodes = coordinates[TREE:].reshape(2, -1, NODE)
    moving = rates[TREE:].reshape(2, -1, NODE)
    pelvis = coordinates[:3]
    for side in range(2):
        spin = posture.foot_spin[0, side]
        arm = nodes[side, :, :3] - (pelvis + posture.foot_place[0, side])
        moving[side, :, :3] = velocity + posture.foot_velocity[0, side] + np.cross(spin, arm)
        scalar, vector = nodes[side, :, 3], nodes[side, :, 4:]
        moving[side, :, 3] = -0.5 * vector @ spin
        moving[side, :, 4:] = 0.5 * (scalar[:, None] * spin + np.cross(spin, vector))
    return rates




def rigid_accelerations(parts: Parts, posture: Posture, coordinates: Array, rates: Array, force: Array) -> Array:
    """Second rates of all coordinates for skis that move with the feet as one body under the resultant ``force`` (3,) N.

    The pelvis' acceleration is what is left of the force after the posture's own acceleration of all masses.
    """
    ski = 0.5 * (parts.mass - parts.body_mass)
    carried = parts.body_mass * posture.com_acceleration[0] + ski * posture.foot_acceleration[0].sum(axis=0)
    pelvis = (force - carried) / parts.mass
    found = np.zeros(len(coordinates))
    found[:3], found[3:TREE] = pelvis, posture.accelerations[0]
    nodes, moving = coordinates[TREE:].reshape(2, -1, NODE), rates[TREE:].reshape(2, -1, NODE)
    turning = found[TREE:].reshape(2, -1, NODE)
    for side in range(2):
        spin, spin_rate = posture.foot_spin[0, side], posture.foot_spin_rate[0, side]
        arm = nodes[side, :, :3] - (coordinates[:3] + posture.foot_place[0, side])
        swing = np.cross(spin, np.cross(spin, arm))
        turning[side, :, :3] = pelvis + posture.foot_acceleration[0, side] + np.cross(spin_rate, arm) + swing
        for vector, into in ((spin_rate, nodes[side]), (spin, moving[side])):  # q̈ = ½ (α ∘ q + ω ∘ q̇)
            turning[side, :, 3] -= 0.5 * into[:, 4:] @ vector
            turning[side, :, 4:] += 0.5 * (into[:, 3, None] * vector + np.cross(vector, into[:, 4:]))
    return found
