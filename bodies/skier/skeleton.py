"""The skeleton in Exudyn: a kinematic tree of 31 coordinates whose 28 angles are prescribed by constraints, or the
skier's mass carried by the pelvis.

Every coordinate of the chain is one link of an ``ObjectKinematicTree``; the links between the first and the last
rotation of a joint have no mass.  Segments on fixed joints (calcaneus and toes in the boot, head on the torso) are
welded to the link that carries them.  The 28 angles are prescribed by one vector of constraints, so a joint's
moment is its Lagrange multiplier (paper 2.3); the pelvis' three translations are free.

Since all rotations are prescribed, only those translations have to be solved for.  The skier is then a point of his
whole mass that the pelvis carries, pulled by what the posture's own movement takes, and moves as with the tree.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from exudyn import JointType, Matrix3DList, Vector3DList
from exudyn.itemInterface import (
    CoordinateVectorConstraint,
    LoadForceVector,
    MarkerBodyPosition,
    MarkerNodeCoordinates,
    NodeGenericODE2,
    NodePoint,
    NodePointGround,
    ObjectKinematicTree,
    ObjectMassPoint,
)

from sssi_exudyn.bodies.skier.anthropometry import SegmentInertia
from sssi_exudyn.bodies.skier.chain import COORDINATES, JOINTS, PARENT, Axis, Geometry
from sssi_exudyn.core.frames import Array, slope_to_level

_REVOLUTE = (JointType.RevoluteX, JointType.RevoluteY, JointType.RevoluteZ)
_PRISMATIC = (JointType.PrismaticX, JointType.PrismaticY, JointType.PrismaticZ)


@dataclass(frozen=True)
class Links:
    """The chain as a list of one-coordinate links, in the order of ``COORDINATES``.

    parent : index of the parent link, -1 for the first
    axis : 0, 1, 2 for x, y, z
    sign : +1 or -1: the tree's coordinate is ``sign`` times the chain's (the tree knows positive axes only)
    offset, attitude : (31, 3) m and (31, 3, 3) of the link in the parent link's frame, before it turns
    of_segment : for each of the 21 segments the link that carries it, its place (3,) m and attitude (3, 3) in that
        link's frame
    """

    parent: tuple[int, ...]
    axis: tuple[int, ...]
    sign: Array
    offset: Array
    attitude: Array
    of_segment: tuple[tuple[int, Array, Array], ...]


def _axis_and_sign(axis: Axis) -> tuple[int, float]:
    index = int(np.argmax(np.abs(axis)))
    return index, float(np.sign(axis[index]))


def chain_links(geometry: Geometry, inclination: float) -> Links:
    """Unfold the chain's joints into links of one coordinate each, on a slope of ``inclination`` (rad)."""
    parent, axis, sign = [-1, 0, 1], [0, 1, 2], [1.0, 1.0, 1.0]
    offset, attitude = [np.zeros(3)] * 3, [np.eye(3)] * 3
    of_segment: list[tuple[int, Array, Array]] = []
    for i, joint in enumerate(JOINTS):
        if PARENT[i] < 0:
            carrier, place, turn = (
                2,
                np.zeros(3),
                slope_to_level(inclination).T,
            )  # pelvis angles count from the level frame
        else:
            carrier, place, turn = of_segment[PARENT[i]]
            place, turn = place + turn @ geometry.joint_in_parent[i], turn @ geometry.attitude_in_parent[i]
        for _, direction in joint.rotations:
            index, direction_sign = _axis_and_sign(direction)
            parent.append(carrier)
            axis.append(index)
            sign.append(direction_sign)
            offset.append(place)
            attitude.append(turn)
            carrier, place, turn = len(parent) - 1, np.zeros(3), np.eye(3)
        of_segment.append((carrier, place, turn))
    return Links(tuple(parent), tuple(axis), np.array(sign), np.array(offset), np.array(attitude), tuple(of_segment))


def _weld(inertias: Sequence[SegmentInertia], links: Links) -> tuple[Array, Array, Array]:
    """Return mass (31,), centre of mass (31, 3) and inertia about it (31, 3, 3) of each link with its segments."""
    n = len(links.parent)
    mass, first, second = np.zeros(n), np.zeros((n, 3)), np.zeros((n, 3, 3))
    for body, (link, place, turn) in zip(inertias, links.of_segment, strict=True):
        r = place + turn @ body.com
        mass[link] += body.mass
        first[link] += body.mass * r
        second[link] += turn @ body.inertia @ turn.T + body.mass * (r @ r * np.eye(3) - np.outer(r, r))
    com = np.divide(first, mass[:, None], out=np.zeros_like(first), where=mass[:, None] > 0)
    for loaded in np.flatnonzero(mass):
        r = com[loaded]
        second[loaded] -= mass[loaded] * (r @ r * np.eye(3) - np.outer(r, r))
    return mass, com, second


@dataclass(frozen=True)
class Skeleton:
    """The tree in an Exudyn system.

    node, tree : item numbers of the coordinates and of the tree
    constraint : item number of what holds the 28 prescribed coordinates, in the order of ``PRESCRIBED``
    links : how the chain's coordinates map to the tree's
    """

    node: int
    tree: int
    constraint: int
    links: Links

    @property
    def sign(self) -> Array:
        """Signs (31,): the tree's coordinate over the chain's."""
        return self.links.sign

    def prescribe(self, mbs: Any, angles: Array, _com_acceleration: Array) -> None:
        """Set the 28 prescribed angles (rad) for the end of the step."""
        mbs.SetObjectParameter(self.constraint, "offset", self.links.sign[3:] * angles)


@dataclass(frozen=True)
class CarriedMass:
    """The skier's mass on the pelvis' three translations, in an Exudyn system.

    node, load : item numbers of the translations and of the force on them
    mass : kg
    gravity : (3,) m/s²
    """

    node: int
    load: int
    mass: float
    gravity: Array

    @property
    def sign(self) -> Array:
        """Signs (3,) of the translations, the chain's own."""
        return np.ones(3)

    def prescribe(self, mbs: Any, _angles: Array, com_acceleration: Array) -> None:
        """Set the force of weight and of the posture's movement on the pelvis at the end of the step.

        It is m (g − a), with a (3,) m/s² the centre of mass' acceleration relative to the pelvis.
        """
        self.pull(mbs, self.mass * (self.gravity - com_acceleration))

    def pull(self, mbs: Any, force: Array) -> None:
        """Set the whole force (3,) N on the carried mass."""
        mbs.SetLoadParameter(self.load, "loadVector", force)


def add_carried_mass(mbs: Any, mass: float, gravity: Array, pelvis: Array) -> CarriedMass:
    """Add ``mass`` (kg) at the pelvis' place (3,) m to ``mbs``, under ``gravity`` (3,) m/s²."""
    node = mbs.AddNode(NodePoint(name="pelvis", referenceCoordinates=[0.0] * 3, initialCoordinates=list(pelvis)))
    point = mbs.AddObject(ObjectMassPoint(name="skier", mass=mass, nodeNumber=node))
    marker = mbs.AddMarker(MarkerBodyPosition(name="pelvis", bodyNumber=point))
    load = mbs.AddLoad(LoadForceVector(name="weight", markerNumber=marker, loadVector=list(mass * gravity)))
    return CarriedMass(int(node), int(load), mass, gravity)


def add_skeleton(
    mbs: Any,
    geometry: Geometry,
    inertias: Sequence[SegmentInertia],
    gravity: Array,
    inclination: float,
    q: Array,
    qd: Array,
) -> Skeleton:
    """Add tree and constraints to ``mbs``, in the slope frame.

    gravity (3,) m/s² in the slope frame; q, qd (31,) the chain's coordinates and their rates at the start.
    """
    links = chain_links(geometry, inclination)
    mass, com, inertia = _weld(inertias, links)
    types = [_PRISMATIC[a] if i < 3 else _REVOLUTE[a] for i, a in enumerate(links.axis)]
    node = mbs.AddNode(
        NodeGenericODE2(
            name="skier",
            numberOfODE2Coordinates=len(COORDINATES),
            referenceCoordinates=[0.0] * len(COORDINATES),
            initialCoordinates=list(links.sign * q),
            initialCoordinates_t=list(links.sign * qd),
        )
    )
    tree = mbs.AddObject(
        ObjectKinematicTree(
            name="skier",
            nodeNumber=node,
            gravity=list(gravity),
            jointTypes=types,
            linkParents=list(links.parent),
            jointTransformations=Matrix3DList(list(links.attitude)),
            jointOffsets=Vector3DList(list(links.offset)),
            linkInertiasCOM=Matrix3DList(list(inertia)),
            linkCOMs=Vector3DList(list(com)),
            linkMasses=list(mass),
        )
    )
    fixed = mbs.AddNode(NodePointGround(name="ground_of_skier"))
    ground = mbs.AddMarker(MarkerNodeCoordinates(name="ground_of_skier", nodeNumber=fixed))
    marker = mbs.AddMarker(MarkerNodeCoordinates(name="coordinates_of_skier", nodeNumber=node))
    constraint = mbs.AddObject(
        CoordinateVectorConstraint(
            name="prescribed_angles",
            markerNumbers=[ground, marker],
            scalingMarker0=np.zeros((0, 0)),
            scalingMarker1=np.eye(len(COORDINATES))[3:],
            offset=links.sign[3:] * q[3:],
        )
    )
    return Skeleton(int(node), int(tree), int(constraint), links)
