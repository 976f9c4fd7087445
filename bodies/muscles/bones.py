"""Bones that hang on one another by joints whose movements are functions of coordinates.

Musculoskeletal models are built like this.  A joint has three rotations and three translations, each about or along an
axis of its own and driven by one coordinate.  One coordinate may drive several joints: the vertebrae share the lumbar
rotations, the patella glides with the knee.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from sssi_exudyn.bodies.muscles.curves import Curve
from sssi_exudyn.core.frames import Array


@dataclass(frozen=True)
class Drive:
    """A turn about (rad) or a slide along (m) ``axis`` (3,), by ``curve`` of the coordinate (None: a constant)."""

    axis: Array
    curve: Curve
    coordinate: str | None = None


@dataclass(frozen=True)
class Bone:
    """A bone and the joint that carries it.

    parent : its name, None for the ground
    place, attitude : (3,) m and (3, 3) the joint's frame in the parent
    end_place, end_attitude : the joint's frame in this bone
    slides : along axes of the joint's frame in the parent
    turns : intrinsic and in order; each axis is fixed in the frame that those before have reached
    """

    name: str
    parent: str | None
    place: Array = field(default_factory=lambda: np.zeros(3))
    attitude: Array = field(default_factory=lambda: np.eye(3))
    turns: tuple[Drive, ...] = ()
    slides: tuple[Drive, ...] = ()
    end_place: Array = field(default_factory=lambda: np.zeros(3))
    end_attitude: Array = field(default_factory=lambda: np.eye(3))


@dataclass(frozen=True)
class Coupling:
    """A coordinate that follows another by a curve."""

    dependent: str
    independent: str
    curve: Curve


@dataclass(frozen=True)
class Bones:
    """All bones, parents before children, the coordinates that move them, and which of these follow others."""

    bones: tuple[Bone, ...]
    coordinates: tuple[str, ...]
    couplings: tuple[Coupling, ...] = ()

    def index(self, name: str) -> int:
        """Return the index of a bone by name.  Raises KeyError when there is none."""
        for i, bone in enumerate(self.bones):
            if bone.name == name:
                return i
        raise KeyError(name)

    def complete(self, q: Array) -> tuple[Array, Array]:
        """Set the dependent coordinates of ``q`` (n, c) by the couplings, and return their derivative too.

        The derivative (n, c, c) by the given coordinates is d completed_i / d given_j, zero for j that depends.
        """
        completed = q.copy()
        follows = np.broadcast_to(np.eye(q.shape[1]), (len(q), q.shape[1], q.shape[1])).copy()
        index = {name: i for i, name in enumerate(self.coordinates)}
        for coupling in self.couplings:
            i, j = index[coupling.dependent], index[coupling.independent]
            completed[:, i], slope = coupling.curve(completed[:, j])
            follows[:, i] = slope[:, None] * follows[:, j]
        return completed, follows


@dataclass(frozen=True)
class Stance:
    """Places of the bones, and their movement a unit rate of each coordinate, in the ground's frame.

    coordinates : (n, c), all of them, coupled ones too
    rotation, origin : (n, b, 3, 3) bone → ground; (n, b, 3) m
    turning : (n, b, c, 3) angular velocity a unit rate of each coordinate
    moving : (n, b, c, 3) velocity, a unit rate, of the point of the bone that is at the ground's origin
    """

    coordinates: Array
    rotation: Array
    origin: Array
    turning: Array
    moving: Array

    def points(self, bones: NDArray[np.int64], places: Array) -> Array:
        """Return the places (n, k, 3) m of points of ``bones`` (k,), in the ground's frame.

        The points are fixed at ``places`` (k, 3) or (n, k, 3) in the bones' frames.
        """
        turned = self.rotation[:, bones] @ np.broadcast_to(places, (len(self.origin), *places.shape[-2:]))[..., None]
        return np.asarray(self.origin[:, bones] + turned[..., 0])


def stand(tree: Bones, q: Array) -> Stance:
    """Compute the stance at coordinates ``q`` (n, c), in the tree's order, coupled ones already completed."""
    value = {name: q[:, i] for i, name in enumerate(tree.coordinates)}
    column = {name: i for i, name in enumerate(tree.coordinates)}
    n, count = len(q), len(tree.bones)
    rotation, origin = np.empty((n, count, 3, 3)), np.empty((n, count, 3))
    turning, moving = np.zeros((n, count, len(column), 3)), np.zeros((n, count, len(column), 3))
    index: dict[str, int] = {}
    for i, bone in enumerate(tree.bones):
        index[bone.name] = i
        frame = np.broadcast_to(bone.attitude, (n, 3, 3))
        place = np.broadcast_to(bone.place, (n, 3))
        if bone.parent is not None:
            p = index[bone.parent]
            place = origin[:, p] + rotation[:, p] @ bone.place
            frame = rotation[:, p] @ bone.attitude
            turning[:, i], moving[:, i] = turning[:, p], moving[:, p]
        carried = frame
        for drive in bone.slides:
            amount, slope = _driven_value(drive, value, n)
            along = carried @ drive.axis
            place = place + amount[:, None] * along
            if drive.coordinate in column:
                moving[:, i, column[drive.coordinate]] += slope[:, None] * along
        for drive in bone.turns:
            amount, slope = _driven_value(drive, value, n)
            if drive.coordinate in column:
                spin = slope[:, None] * (frame @ drive.axis)
                turning[:, i, column[drive.coordinate]] += spin
                moving[:, i, column[drive.coordinate]] += np.cross(place, spin)
            frame = frame @ _turn(drive.axis, amount)
        rotation[:, i] = frame @ bone.end_attitude.T
        origin[:, i] = place - rotation[:, i] @ bone.end_place
    return Stance(q, rotation, origin, turning, moving)


def _driven_value(drive: Drive, value: Mapping[str, Array], n: int) -> tuple[Array, Array]:
    """Return a drive's angle (rad) or slide (m) and its slope, each (n,)."""
    return drive.curve(np.zeros(n) if drive.coordinate is None else value[drive.coordinate])


def _turn(axis: Array, angle: Array) -> Array:
    """Return turns (n, 3, 3) about ``axis`` (3,) of length 1, by ``angle`` (n,)."""
    x, y, z = axis
    k = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + np.sin(angle)[:, None, None] * k + (1.0 - np.cos(angle))[:, None, None] * (k @ k))
