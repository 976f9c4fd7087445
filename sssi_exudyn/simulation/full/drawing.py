"""What Exudyn's renderer draws of the model: the skier's segments, the skis and the snow, in the slope frame."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

import exudyn as exu
import numpy as np
from exudyn import graphics
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from sssi_exudyn.bodies.skier.anthropometry import GRIP, POLE_DIRECTION
from sssi_exudyn.bodies.skier.boot import seat_of_ski
from sssi_exudyn.bodies.skier.chain import FEET, SEGMENTS, Poses, forward_kinematics
from sssi_exudyn.core.frames import Array
from sssi_exudyn.simulation.assembly import Parts
from sssi_exudyn.simulation.full.forces_kernel import NODE
from sssi_exudyn.simulation.full.system import System
from sssi_exudyn.simulation.posture_table import PostureTable

Graphics = list[dict[str, Any]]
"""Exudyn's ``GraphicsData``, a dictionary a shape."""
_BODY: Final = [0.20, 0.35, 0.55, 1.0]
_GEAR: Final = [0.15, 0.15, 0.15, 1.0]
_SKIS: Final = ([0.0, 0.45, 0.70, 1.0], [0.84, 0.37, 0.0, 1.0])
_SNOW: Final = ([0.97, 0.98, 1.0, 1.0], [0.88, 0.92, 0.97, 1.0])
_THICK: Final = {"pelvis": 0.13, "torso": 0.13, "head": 0.10, "femur": 0.075, "tibia": 0.055, "humerus": 0.045}
"""Radii of segments, m; all others have ``_THIN``."""
_THIN: Final = 0.035
_CELL: Final = 1.0
"""m; side of the fields in which the snow is drawn, at least."""
_MOST_CELLS: Final = 150
_MARGIN: Final = 15.0
"""m of snow around the straight line along which the skier starts."""
_BOX: Final = np.array([[0, 1, 5], [0, 5, 4], [3, 2, 6], [3, 6, 7], [1, 3, 7], [1, 7, 5], [2, 0, 4], [2, 4, 6]])
"""Triangles between the corners of two sections: left and right at the base, then on top."""


class DrawnSkier:
    """The skier's segments, boots, poles and skis as the coordinates of Exudyn's system have them.

    Nodes of skis count from their feet (docs/notebook/decisions/0001): Exudyn itself would draw them at the origin.
    """

    def __init__(self, parts: Parts, system: System) -> None:
        self._parts, self._system = parts, system
        gear, geometry = parts.model.equipment, parts.motion.geometry
        self._seats = [seat_of_ski(geometry, foot, gear.boot_centre, gear.ramp_angle) for foot in FEET]
        self._meshes = [_merged(shapes) for shapes in _segment_shapes(parts)]
        cut, ski = parts.mesh, parts.model.ski
        across, above = 0.5 * ski.width(cut.node_s), ski.thickness(cut.node_s)
        zero = np.zeros_like(across)
        corners = [(zero, across, zero), (zero, -across, zero), (zero, across, above), (zero, -across, above)]
        self._corners = np.stack([np.stack(corner, axis=-1) for corner in corners], axis=1)
        first = 4 * np.arange(len(cut.element_length))
        self._triangles = (first[:, None, None] + _BOX).reshape(-1, 3)

    def ski_nodes(self, q: Array) -> tuple[Array, Array]:
        """Return places (2, k, 3) m and frames (2, k, 3, 3) of the skis' nodes in the slope frame.

        q : coordinates of the system, without reference
        """
        system, poses = self._system, self._poses(q)
        own = (q[: len(system.ref)] + system.ref)[system.first_node :].reshape(2, -1, NODE)
        frames = Rotation.from_quat(own[..., 3:].reshape(-1, 4), scalar_first=True).as_matrix()
        places, turned = [], []
        for side, (foot, (sole, attitude)) in enumerate(zip(FEET, self._seats, strict=True)):
            carrier = poses.rotation[foot] @ attitude
            places.append(poses.origin[foot] + poses.rotation[foot] @ sole + own[side, :, :3] @ carrier.T)
            turned.append(carrier @ frames.reshape(2, -1, 3, 3)[side])
        return np.array(places), np.array(turned)

    def shapes(self, q: Array) -> Graphics:
        """Return body, gear, left and right ski as they are at the coordinates ``q``."""
        places, frames = self.ski_nodes(q)
        points = places[:, :, None] + np.einsum("skij,kcj->skci", frames, self._corners)
        poses, drawn = self._poses(q), []
        for colour, (own, segments, triangles) in zip((_BODY, _GEAR), self._meshes, strict=True):
            moved = poses.origin[segments] + np.einsum("nij,nj->ni", poses.rotation[segments], own)
            drawn.append(graphics.FromPointsAndTrigs(moved, triangles, color=colour))
        skis = [
            graphics.FromPointsAndTrigs(points[side].reshape(-1, 3), self._triangles, color=_SKIS[side])
            for side in range(2)
        ]
        return [*drawn, *skis]

    def user_function(self) -> Callable[[Any, int], Graphics]:
        """Return the function that Exudyn's renderer calls for every picture."""

        def draw(mbs: Any, _item: int) -> Graphics:
            return self.shapes(np.array(mbs.systemData.GetODE2Coordinates(exu.ConfigurationType.Visualization)))

        return draw

    def _poses(self, q: Array) -> Poses:
        system, parts = self._system, self._parts
        own = system.skeleton.sign * q[: system.first_node]
        return forward_kinematics(parts.motion.geometry, own, parts.model.inclination)


def _segment_shapes(parts: Parts) -> tuple[dict[int, Graphics], dict[int, Graphics]]:
    """Return the shapes of the body and those of boots and poles, by segment and in the segment's frame."""
    geometry, gear = parts.motion.geometry, parts.model.equipment
    body: dict[int, Graphics] = {}
    worn: dict[int, Graphics] = {}
    for index, segment in enumerate(SEGMENTS):
        end, kind = geometry.segment_end[index], segment.partition("_")[0]
        if kind == "calcn":
            sole, attitude = seat_of_ski(geometry, index, gear.boot_centre, gear.ramp_angle)
            boot = graphics.Brick([0.0, 0.0, 0.15], [gear.boot_sole_length, 0.11, 0.22], color=_GEAR)
            worn[index] = [graphics.Move(boot, list(sole), attitude)]
            continue
        radius = _THICK.get(kind, _THIN)
        body[index] = [graphics.Sphere([0.0] * 3, radius, color=_BODY, nTiles=12)]
        if np.linalg.norm(end) > 0.0:
            body[index].append(graphics.Cylinder([0.0] * 3, list(end), radius, color=_BODY, nTiles=16))
        if kind == "hand" and gear.pole_mass > 0.0:
            pole = list(gear.pole_length * POLE_DIRECTION)
            worn[index] = [graphics.Cylinder(list(GRIP * end), pole, 0.008, color=_GEAR, nTiles=8)]
    return body, worn


def _merged(shapes: dict[int, Graphics]) -> tuple[Array, NDArray[np.int64], NDArray[np.int64]]:
    """Return points (p, 3) m, each in the frame of its segment (p,), and triangles (t, 3) between them."""
    points, segments, triangles = [], [], []
    count = 0
    for index, own in shapes.items():
        for shape in own:
            places, corners = (np.asarray(part) for part in graphics.ToPointsAndTrigs(shape))
            points.append(places)
            segments.append(np.full(len(places), index))
            triangles.append(corners + count)
            count += len(places)
    return np.concatenate(points), np.concatenate(segments), np.concatenate(triangles)


def snow_graphics(parts: Parts, posture: PostureTable) -> Graphics:
    """Return the snow as a chequered surface under the straight line along which the skier starts."""
    start, lasting = parts.model.start, float(posture.time[-1] - posture.time[0])
    begin = np.array([start.f, start.l])
    end = begin + lasting * np.array([start.velocity_f, start.velocity_l])
    low, high = np.minimum(begin, end) - _MARGIN, np.maximum(begin, end) + _MARGIN
    cell = max(_CELL, float(np.max(high - low)) / _MOST_CELLS)
    count = np.ceil((high - low) / cell).astype(int)
    f, l = np.meshgrid(*(low[axis] + cell * np.arange(count[axis] + 1) for axis in range(2)), indexing="ij")  # noqa: E741
    places = np.stack([f.ravel(), l.ravel(), np.zeros(f.size)], axis=1)
    places[:, 2] = parts.model.snow(places)[0]
    row, column = (index.ravel() for index in np.meshgrid(*(np.arange(n) for n in count), indexing="ij"))
    corner = row * (count[1] + 1) + column
    along = corner + count[1] + 1
    fields = np.stack([np.stack([corner, along, along + 1], 1), np.stack([corner, along + 1, corner + 1], 1)], axis=1)
    dark = (row + column) % 2
    return [
        graphics.FromPointsAndTrigs(places, fields[dark == shade].reshape(-1, 3), color=_SNOW[shade])
        for shade in range(2)
    ]
