"""The run as an animated scene in glTF: the skier's segments and skis as boxes that move, in the level frame.

glTF's y is up: x down the fall line's azimuth, y up, z to the right.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from scipy.spatial.transform import Rotation

from sssi_exudyn.bodies.skier.boot import seat_of_ski
from sssi_exudyn.bodies.skier.chain import FEET, SEGMENTS
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.frames import Array, slope_to_level
from sssi_exudyn.io.storage import GROUND_FROM_LEVEL
from sssi_exudyn.reports.sections.replay import poses_of
from sssi_exudyn.results.stored import StoredRun
from sssi_exudyn.runtime.optional import import_for

RATE: Final = 30.0
"""Frames a second; viewers interpolate between them."""
_HALF: Final = {"pelvis": 0.13, "torso": 0.12, "head": 0.09, "femur": 0.07, "tibia": 0.055}
"""Half the thickness of segments, m; all others have ``_THIN``."""
_THIN: Final = 0.035
_COLOURS: Final = {"body": (0.2, 0.35, 0.55), "ski": (0.84, 0.37, 0.0)}
_FACES: Final = np.array(
    [
        *([0, 2, 1], [1, 2, 3], [4, 5, 6], [5, 7, 6], [0, 1, 4], [1, 5, 4]),
        *([2, 6, 3], [3, 6, 7], [0, 4, 2], [2, 4, 6], [1, 3, 5], [3, 7, 5]),
    ]
)
"""Triangles of a box, whose corners count in binary by z, y, x."""


@dataclass(frozen=True)
class Moving:
    """A box that moves: its corners (8, 3) m in its own frame, and its place (k, 3) m and attitude (k, 3, 3)."""

    name: str
    kind: str
    corners: Array
    place: Array
    rotation: Array


def moving_boxes(run: StoredRun) -> tuple[Array, list[Moving]]:
    """Return times (k,) s from 0 on and the boxes of skier and skis.

    Raises InputError for a result without a skeleton.
    """
    geometry, model = run.geometry, run.model
    if geometry is None:
        raise InputError("to_gltf", run.name, "the result has no skeleton", "simulate it again with this version")
    frames = np.arange(run.time[0], run.time[-1], 1.0 / RATE)
    rows = np.unique(np.searchsorted(run.time, frames).clip(0, len(run.time) - 1))
    poses = poses_of(run.series.iloc[rows], geometry, model.inclination)
    turn = GROUND_FROM_LEVEL @ slope_to_level(model.inclination)
    origin = (poses.origin - poses.origin[0, 0]) @ turn.T
    rotation = turn @ poses.rotation
    boxes = []
    for index, segment in enumerate(SEGMENTS):
        half = _HALF.get(segment.partition("_")[0], _THIN)
        corners = _box(np.zeros(3), geometry.segment_end[index], half)
        boxes.append(Moving(segment, "body", corners, origin[:, index], rotation[:, index]))
    gear, ski = model.equipment, model.ski
    for side, foot in zip(("left", "right"), FEET, strict=True):
        sole, attitude = seat_of_ski(geometry, foot, gear.boot_centre, gear.ramp_angle)
        ends = [np.array([float(ski.x_of_s(s)), 0.0, 0.0]) for s in (0.0, 1.0)]
        corners = _box(ends[0], ends[1], 0.5 * float(np.max(ski.width(np.linspace(0.0, 1.0, 101)))), flat=True)
        place = origin[:, foot] + rotation[:, foot] @ sole
        boxes.append(Moving(f"{side}_ski", "ski", corners, place, rotation[:, foot] @ attitude))
    return run.time[rows] - run.time[rows[0]], boxes


def _box(begin: Array, end: Array, half: float, *, flat: bool = False) -> Array:
    """Return the corners (8, 3) of the box around the line from ``begin`` to ``end`` (3,), ``half`` (m) thick."""
    thick = np.array([0.0, half, 0.008]) if flat else np.full(3, half)
    low, high = np.minimum(begin, end) - thick, np.maximum(begin, end) + thick
    return np.array(
        [[(low, high)[x][0], (low, high)[y][1], (low, high)[z][2]] for x in (0, 1) for y in (0, 1) for z in (0, 1)]
    )


def gltf_bytes(run: StoredRun) -> bytes:
    """Return the animated scene as a binary glTF file (.glb).

    Raises InputError for a result without a skeleton, SssiError where pygltflib is not installed.
    """
    lib: Any = import_for("to_gltf", "pygltflib", "export")
    time, boxes = moving_boxes(run)
    scene = _Scene(lib)
    materials = {kind: scene.material(colour) for kind, colour in _COLOURS.items()}
    clock = scene.numbers(time, bounds=True)
    for box in boxes:
        quaternion = Rotation.from_matrix(box.rotation).as_quat()  # x, y, z, w, as glTF has them
        scene.animate(scene.box(box, materials[box.kind]), clock, box.place, quaternion)
    return scene.finish()


class _Scene:
    """A glTF file that grows: numbers in one buffer, a mesh and a node a box, and one animation."""

    def __init__(self, lib: Any) -> None:
        self._lib, self._data = lib, bytearray()
        self._file = lib.GLTF2(scene=0, scenes=[lib.Scene(nodes=[])], animations=[lib.Animation(name="run")])

    def numbers(self, values: Array, *, bounds: bool = False, indices: bool = False) -> int:
        """Add an array (n,) or (n, c) and return the number of its accessor."""
        lib, file = self._lib, self._file
        table = np.asarray(values, dtype=np.uint16 if indices else np.float32)
        file.bufferViews.append(lib.BufferView(buffer=0, byteOffset=len(self._data), byteLength=table.nbytes))
        self._data += table.tobytes() + bytes(-table.nbytes % 4)  # glTF aligns to four bytes
        kinds = {1: lib.SCALAR, 3: lib.VEC3, 4: lib.VEC4}
        wide = table.reshape(len(table), -1)
        accessor = lib.Accessor(
            bufferView=len(file.bufferViews) - 1,
            componentType=lib.UNSIGNED_SHORT if indices else lib.FLOAT,
            count=len(table),
            type=kinds[wide.shape[1]],
        )
        if bounds:
            accessor.min, accessor.max = wide.min(axis=0).tolist(), wide.max(axis=0).tolist()
        file.accessors.append(accessor)
        return len(file.accessors) - 1

    def material(self, colour: tuple[float, float, float]) -> int:
        """Add a dull material of that colour and return its number."""
        dull = self._lib.PbrMetallicRoughness(baseColorFactor=[*colour, 1.0], metallicFactor=0.0, roughnessFactor=0.8)
        self._file.materials.append(self._lib.Material(pbrMetallicRoughness=dull, doubleSided=True))
        return len(self._file.materials) - 1

    def box(self, box: Moving, material: int) -> int:
        """Add a box as a mesh on a node of its name and return the node's number."""
        lib, file = self._lib, self._file
        corners = self.numbers(box.corners, bounds=True)
        faces = self.numbers(_FACES.ravel(), indices=True)
        surface = lib.Primitive(attributes=lib.Attributes(POSITION=corners), indices=faces, material=material)
        file.meshes.append(lib.Mesh(name=box.name, primitives=[surface]))
        file.nodes.append(lib.Node(name=box.name, mesh=len(file.meshes) - 1))
        file.scenes[0].nodes.append(len(file.nodes) - 1)
        return len(file.nodes) - 1

    def animate(self, node: int, clock: int, place: Array, quaternion: Array) -> None:
        """Move a node along places (k, 3) m and attitudes (k, 4)."""
        lib, animation = self._lib, self._file.animations[0]
        for path, values in (("translation", place), ("rotation", quaternion)):
            sampler = lib.AnimationSampler(input=clock, output=self.numbers(values), interpolation="LINEAR")
            animation.samplers.append(sampler)
            target = lib.AnimationChannelTarget(node=node, path=path)
            animation.channels.append(lib.AnimationChannel(sampler=len(animation.samplers) - 1, target=target))

    def finish(self) -> bytes:
        """Return the file."""
        self._file.buffers.append(self._lib.Buffer(byteLength=len(self._data)))
        self._file.set_binary_blob(bytes(self._data))
        return b"".join(self._file.save_to_bytes())
