"""What of a model does not change along a run: masses, the skis' mesh and contact sections, frontal areas."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import TypeVar

import numpy as np
from scipy.interpolate import make_interp_spline
from scipy.spatial.transform import Rotation

from sssi_exudyn.bodies.ski.mesh import CONTACTS, BeamMesh, mesh
from sssi_exudyn.bodies.ski.modes import damping_time
from sssi_exudyn.bodies.skier.anthropometry import Footwear, SegmentInertia, body_inertia, combine
from sssi_exudyn.bodies.skier.boot import ski_on_foot
from sssi_exudyn.bodies.skier.chain import SEGMENT
from sssi_exudyn.contact.codegen import vectors
from sssi_exudyn.contact.registry import is_carved
from sssi_exudyn.contact.terms.air import FrontalAreas, PostureAir, ShownAreas
from sssi_exudyn.core.frames import Array
from sssi_exudyn.model.faults import antenna_shift
from sssi_exudyn.model.model import Model
from sssi_exudyn.motion.correction import correct_posture
from sssi_exudyn.motion.motion import Antenna, Motion, relative_poses, turn_motion
from sssi_exudyn.simulation.facing import facing
from sssi_exudyn.simulation.heading import RigidSki, spread_inertia
from sssi_exudyn.simulation.posture_table import Carried, MovementTable, PostureTable, movement_at, posture_at
from sssi_exudyn.simulation.ski_on_snow.boot_joint import boot_joint
from sssi_exudyn.simulation.ski_on_snow.structs import CuttingEdges, Sections, SnowGrid
from sssi_exudyn.terrain.surface import Surface

Table = TypeVar("Table", MovementTable, PostureTable)
_STRETCH = 256
"""Instants whose posture is computed at once."""
_LOOKS = 0.04
"""s between the postures whose areas are found: they move by less than 6 Hz."""
CUTTING_POINTS = 100
"""Contact points on each edge where edges cut the snow."""
CARVED_STEP = 0.00125
"""s; on snow that edges cut: in a step a ski goes on by no more than the distance of its contact points."""
COARSE_CARVED_STEP = 0.0025
"""s; the longest step there, with half as many points: for fits."""


def correct_motion(model: Model, motion: Motion) -> Motion:
    """Return the motion as it was, if the capture's faults are those of the model: posture corrected, turned, antenna
    in place.
    """
    moved = turn_motion(correct_posture(motion, model.posture), model.capture_yaw)
    if motion.antenna is None:
        return moved
    antenna = Antenna(motion.antenna.segment, motion.antenna.offset + antenna_shift(model.sensors))
    return replace(moved, antenna=antenna)


@dataclass(frozen=True)
class Parts:
    """What of a model does not change along the run: masses, the skis' mesh, frontal areas."""

    model: Model
    motion: Motion

    @cached_property
    def mesh(self) -> BeamMesh:
        return self.mesh_with(CUTTING_POINTS if self.is_carved else CONTACTS)

    def mesh_with(self, contacts: int) -> BeamMesh:
        """Return the skis' mesh with so many contact points on each edge."""
        return mesh(self.model.ski, self.model.solver.elements, contacts, cutting=self.is_carved)

    @property
    def is_carved(self) -> bool:
        """Return whether edges cut the snow."""
        return is_carved(self.model.terms)

    @cached_property
    def inertias(self) -> tuple[SegmentInertia, ...]:
        gear = self.model.equipment
        return body_inertia(
            self.motion.geometry,
            self.model.skier.mass,
            self.model.skier.sex,
            boot_mass=gear.boot_mass,
            binding_mass=max(gear.ski_mass - float(self.mesh.element_mass.sum()), 0.0),  # equal masses, rounded
            footwear=Footwear(boot_length=gear.boot_sole_length, boot_centre=gear.boot_centre),
            pole=(gear.pole_mass, gear.pole_length),
        )

    def foot(self, letter: str) -> SegmentInertia:
        """Return the left (l) or right (r) foot in boot and binding as one body, in the ski's axes counted from the
        ankle.
        """
        geometry, ramp = self.motion.geometry, ski_on_foot(self.model.equipment.ramp_angle)
        place, attitude, parts = np.zeros(3), np.eye(3), []
        for name in ("talus", "calcn", "toes"):
            i = SEGMENT[f"{name}_{letter}"]
            if name != "talus":
                place = place + attitude @ geometry.joint_in_parent[i]
                attitude = attitude @ geometry.attitude_in_parent[i]
            body = self.inertias[i]
            parts.append(SegmentInertia(body.mass, place + attitude @ body.com, attitude @ body.inertia @ attitude.T))
        whole = combine(parts)
        calcaneus = geometry.attitude_in_parent[SEGMENT[f"calcn_{letter}"]] @ ramp
        return SegmentInertia(whole.mass, calcaneus.T @ whole.com, calcaneus.T @ whole.inertia @ calcaneus)

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
        """(3,) m: the ski frame's origin counted from the running surface under the boot's centre, in the frame of
        ski and foot.
        """
        return np.array([0.0, 0.0, -float(self.model.ski.height(self.model.ski.s_of_x(0.0)))])

    @cached_property
    def ski(self) -> RigidSki:
        """A ski that does not give, for what skier and skis are as a whole."""
        mass, place = self.node_mass, self.mesh.node_position + self.ski_in_foot
        com = mass @ place / mass.sum()
        inertia = spread_inertia(mass, (place - com)[None])[0] + np.diag(self.node_moment.sum(axis=0))
        return RigidSki(float(mass.sum()), com, inertia)

    @cached_property
    def node_mass(self) -> Array:
        """(k,) kg of a ski, lumped at its nodes."""
        return _lump(self.mesh.element_mass)

    @cached_property
    def node_moment(self) -> Array:
        """(k, 3) kg m² of a ski's sections, lumped at its nodes."""
        return _lump(self.mesh.section_inertia * self.mesh.element_length[:, None])

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
            node_mass=self.node_mass,
            node_moment=self.node_moment,
            surface=snow_grid(self.model.surface),
            rising=cut.clamped if self.model.legs.give else -1,
        )

    @cached_property
    def edges(self) -> CuttingEdges:
        """The skis' edges where they cut the snow, and the joints at the boots."""
        cut, joint = self.mesh, boot_joint(self.model.equipment)
        frames = [_section_pose(cut, m)[1] for m in range(len(cut.contact_s))]
        turned = [frame.inv().apply(pair) for frame, pair in zip(frames, cut.edge_tangents, strict=True)]
        return CuttingEdges(
            tangent=np.array(turned),
            width=self.model.ski.width(cut.contact_s),
            station=self.model.ski.x_of_s(cut.contact_s),
            element_length=cut.element_length[cut.contact_element],
            clamped=cut.clamped,
            pitched=float(np.arcsin(-cut.node_rotation[cut.clamped, 2, 0])),
            stiffness=joint.stiffness,
            damping=joint.damping,
        )

    @cached_property
    def leg_inertia(self) -> Array:
        """(2,) kg m² of boot and leg in yaw and roll, which a ski that turns against its foot takes along."""
        place = self.mesh.node_position[:, 0]
        own = [self.node_mass @ place**2 + self.node_moment[:, 2].sum(), self.node_moment[:, 0].sum()]
        return np.asarray(np.maximum(boot_joint(self.model.equipment).inertia[:2] - np.array(own), 0.0))

    def posture(self, time: Array) -> PostureTable:
        """Return the posture at ``time`` (n,)."""
        return self._in_stretches(posture_at, time)

    def movement(self, time: Array) -> MovementTable:
        """Return the movement at ``time`` (n,): the posture without its Jacobians, in half of the time."""
        return self._in_stretches(movement_at, time)

    def _in_stretches(self, at: Callable[[Motion, Carried, Array], Table], time: Array) -> Table:
        """Return a table ``at`` all times, a stretch at a time: intermediate arrays are far larger than those kept."""
        gear = self.model.equipment
        carried = Carried(self.inertias, tuple(self.areas), gear.boot_centre, gear.ramp_angle)
        kept: dict[str, Array] = {}
        for first in range(0, max(1, len(time)), _STRETCH):
            rows = slice(first, first + _STRETCH)
            table = at(self.motion, carried, time[rows])
            for entry in fields(table):  # copied, as they may be parts of such intermediate arrays
                column: Array = getattr(table, entry.name)
                kept.setdefault(entry.name, np.empty((len(time), *column.shape[1:])))[rows] = column
        whole = replace(table, **kept)
        if not any(isinstance(term, PostureAir) for term in self.model.terms):
            return whole
        return replace(whole, exposed_facing=self.facing(time))

    def facing(self, time: Array) -> Array:
        """Return (n, k, 3, 3) m⁴ that the exposed segments show the air at ``time`` (n,): ``facing``, every ``_LOOKS``
        s and straight between.
        """
        looks = np.linspace(time[0], time[-1], max(2, 1 + round((time[-1] - time[0]) / _LOOKS)))
        shown = {name: np.array(areas) for name, areas in ShownAreas().of_height(self.model.skier.height).items()}
        areas_seen = np.concatenate(
            [
                facing(relative_poses(self.motion, part)[0], self.inertias, shown)
                for part in np.array_split(looks, max(1, -(-len(looks) // _STRETCH)))
            ]
        )
        if looks[-1] == looks[0]:
            return np.repeat(areas_seen[:1], len(time), axis=0)
        return np.ascontiguousarray(make_interp_spline(looks, areas_seen, k=1)(time))


def snow_grid(surface: Surface | None) -> SnowGrid:
    """Return the snow surface as the kernels take it."""
    if surface is None:
        return SnowGrid(np.zeros((0, 0)), np.zeros(2), 1.0)
    return SnowGrid(surface.coefficients, np.array(surface.origin), surface.spacing)


def _edge_offsets(cut: BeamMesh) -> Array:
    """Return (m, 2, 3) m: both edges of each contact section in the section's own frame, from the unloaded ski."""
    s = cut.contact_s
    left = np.stack([cut.ski.x_of_s(s), 0.5 * cut.ski.width(s), cut.ski.height(s)], axis=1)
    offsets = np.empty((len(s), 2, 3))
    for m in range(len(s)):
        place, frame = _section_pose(cut, m)
        back = frame.inv()
        for edge, sign in enumerate((1.0, -1.0)):
            offsets[m, edge] = back.apply(left[m] * [1.0, sign, 1.0] - place)
    return offsets


def _section_pose(cut: BeamMesh, m: int) -> tuple[Array, Rotation]:
    """Return place (3,) m and frame of a contact section of the unloaded ski."""
    frames = Rotation.from_matrix(cut.node_rotation).as_quat(scalar_first=True)
    element = cut.contact_element[m]
    first, second = ((tuple(cut.node_position[node]), tuple(frames[node])) for node in (element, element + 1))
    place, frame = vectors.between(*first, *second, float(cut.contact_weight[m]))
    return np.array(place), Rotation.from_quat(frame, scalar_first=True)


def _lump(of_elements: Array) -> Array:
    """Return (n + 1, …) at the nodes: half of each element's share (n, …) at each of its ends."""
    lumped = np.zeros((len(of_elements) + 1, *of_elements.shape[1:]))
    lumped[:-1] += 0.5 * of_elements
    lumped[1:] += 0.5 * of_elements
    return lumped
