"""Muscles' lengths, speeds of lengthening, and moment arms about the joints.

A path runs through points of bones: fixed ones, ones that glide with a coordinate, ones that count only while a
coordinate is within a range; and around surfaces (``wrapping``).  A moment arm is minus the derivative of the
length with respect to the coordinate: r = −∂L/∂q, so a tension F does the moment r F.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from sssi_exudyn.bodies.muscles.bones import Bones, Stance, stand
from sssi_exudyn.bodies.muscles.curves import Curve
from sssi_exudyn.bodies.muscles.path_kernel import Points, Surfaces, Wraps, follow
from sssi_exudyn.bodies.muscles.wrapping import CYLINDER, ELLIPSOID
from sssi_exudyn.core.frames import Array

_EDGE: Final = 1e-5
"""rad by which a conditional point's range is widened, as in OpenSim."""
_STRETCH: Final = 64
"""Number of instants computed at once: what a unit tension does to every bone is larger than the result."""


@dataclass(frozen=True)
class PathPoint:
    """A point of a muscle's path.

    bone, place : (3,) m in the bone's frame; with ``glides``, those of its three components that are functions
    glides : by component 0, 1, 2 the curve (m) and the coordinate it is of
    condition : coordinate, least and greatest value (rad) for which the path goes through the point
    """

    bone: str
    place: Array
    glides: Mapping[int, tuple[Curve, str]] = field(default_factory=dict)
    condition: tuple[str, float, float] | None = None


@dataclass(frozen=True)
class Surface:
    """A surface that paths are led around.

    kind : "cylinder" (about z), "sphere", "ellipsoid"
    place, attitude : (3,) m, (3, 3) of its frame in the bone
    size : (3,) m: radius and length (and nothing); radius; half axes
    axis, sign : the side on which it is active, as in "+x" or "-y"; sign 0: all around
    """

    name: str
    bone: str
    kind: str
    place: Array
    attitude: Array
    size: Array
    axis: int = 0
    sign: float = 0.0


@dataclass(frozen=True)
class Wrap:
    """A path's surface, and the first and last of the path's points between which it wraps."""

    surface: str
    first: int
    last: int


@dataclass(frozen=True)
class Muscle:
    """A muscle-tendon unit: path, greatest isometric force (N), optimal fibre and tendon slack length (m), pennation
    at the optimal length (rad).
    """

    name: str
    points: tuple[PathPoint, ...]
    max_isometric_force: float
    optimal_fibre: float
    tendon_slack: float
    pennation: float
    wraps: tuple[Wrap, ...] = ()


@dataclass(frozen=True)
class MuscleModel:
    """Bones, muscles, the surfaces they lie on, and the coordinates' default values (c,)."""

    name: str
    bones: Bones
    muscles: tuple[Muscle, ...]
    surfaces: tuple[Surface, ...]
    defaults: Array


@dataclass(frozen=True)
class Paths:
    """m muscles at n instants.

    coordinates : the k coordinates that were requested
    length : (n, m) m
    moment_arm : (n, m, k) m (m/m for a coordinate that is a length)
    pull : (n, m, g, 3) force of a unit tension on each of the g requested groups of bones, in the ground's frame
    """

    coordinates: tuple[str, ...]
    length: Array
    moment_arm: Array
    pull: Array

    def speed(self, rates: Array) -> Array:
        """Return the speeds (n, m) m/s of lengthening of the muscles, for rates (n, k) of the coordinates."""
        return np.asarray(-np.einsum("nmk,nk->nm", self.moment_arm, rates))


def muscle_paths(
    model: MuscleModel,
    q: Array,
    coordinates: Sequence[str] | None = None,
    groups: Sequence[Sequence[str]] = (),
) -> Paths:
    """Compute paths at coordinates ``q`` (n, c) of the model's bones, dependent ones being set by their couplings.

    coordinates : those whose moment arms are wanted, all if None
    groups : sets of bones
    """
    wanted = tuple(model.bones.coordinates if coordinates is None else coordinates)
    parts = [
        _paths(model, part, wanted, groups) for part in np.array_split(q, max(1, -(-len(q) // _STRETCH))) if len(part)
    ]
    return Paths(wanted, *(np.concatenate(columns) for columns in zip(*parts, strict=True)))


def _paths(
    model: MuscleModel, given: Array, wanted: tuple[str, ...], groups: Sequence[Sequence[str]]
) -> tuple[Array, Array, Array]:
    """Return length, moment arm and pull."""
    tree = model.bones
    q, follows = tree.complete(given)
    stance = stand(tree, q)
    points = [point for muscle in model.muscles for point in muscle.points]
    bone = np.array([tree.index(point.bone) for point in points], dtype=np.int64)
    index = {name: i for i, name in enumerate(tree.coordinates)}
    place = np.broadcast_to(np.stack([point.place for point in points]), (len(q), len(points), 3)).copy()
    active = np.ones(place.shape[:2], dtype=bool)
    gliding: list[tuple[int, int, int, Array]] = []
    for p, point in enumerate(points):
        for component, (curve, coordinate) in point.glides.items():
            place[:, p, component], slope = curve(q[:, index[coordinate]])
            gliding.append((p, component, index[coordinate], slope))
        if point.condition is not None:
            coordinate, low, high = point.condition
            active[:, p] = (q[:, index[coordinate]] >= low - _EDGE) & (q[:, index[coordinate]] <= high + _EDGE)
    muscle_of = np.repeat(np.arange(len(model.muscles)), [len(muscle.points) for muscle in model.muscles])
    first, wraps = _lists(model)
    # in one order in memory: the kernel would be compiled again for every other one
    followed = Points(*map(np.ascontiguousarray, (stance.points(bone, place), active, bone, first)))
    length, pulls, wrench = follow(followed, wraps, _surfaces(model, stance), len(tree.bones))
    twist = np.concatenate([stance.moving, stance.turning], axis=-1)  # (n, b, c, 6)
    twist = np.moveaxis(twist, 2, 3).reshape(len(q), -1, len(tree.coordinates))
    slope_of = wrench.reshape(*length.shape, -1) @ twist
    for p, component, c, slope in gliding:
        along = stance.rotation[:, bone[p], :, component]
        slope_of[:, muscle_of[p], c] += slope * np.einsum("nk,nk->n", along, pulls[:, p])
    slope_of = slope_of @ follows[:, :, [index[name] for name in wanted]]
    members = [[tree.index(name) for name in group] for group in groups]
    pull = -np.stack([wrench[:, :, group, :3].sum(axis=2) for group in members], axis=2) if members else None
    return length, -slope_of, np.empty((*length.shape, 0, 3)) if pull is None else pull


def _lists(model: MuscleModel) -> tuple[NDArray[np.int64], Wraps]:
    """Return where each muscle's points begin, and all wraps."""
    number = {surface.name: i for i, surface in enumerate(model.surfaces)}
    first = np.cumsum([0, *(len(muscle.points) for muscle in model.muscles)], dtype=np.int64)
    wraps = [(number[wrap.surface], wrap.first, wrap.last) for muscle in model.muscles for wrap in muscle.wraps]
    wrap_first = np.cumsum([0, *(len(muscle.wraps) for muscle in model.muscles)], dtype=np.int64)
    return first, Wraps(np.array(wraps, dtype=np.int64).reshape(-1, 3), wrap_first)


def _surfaces(model: MuscleModel, stance: Stance) -> Surfaces:
    """Return the surfaces as the kernel takes them."""
    surfaces = model.surfaces
    bone = np.array([model.bones.index(surface.bone) for surface in surfaces], dtype=np.int64)
    attitude = np.array([surface.attitude for surface in surfaces]).reshape(-1, 3, 3)
    arrays = (
        np.array([CYLINDER if surface.kind == "cylinder" else ELLIPSOID for surface in surfaces], dtype=np.int64),
        np.array([surface.size for surface in surfaces]).reshape(-1, 3),
        np.array([surface.axis for surface in surfaces], dtype=np.int64),
        np.array([surface.sign for surface in surfaces], dtype=np.float64),
        bone,
        stance.rotation[:, bone] @ attitude,
        stance.points(bone, np.array([surface.place for surface in surfaces]).reshape(-1, 3)),
    )
    return Surfaces(*map(np.ascontiguousarray, arrays))
