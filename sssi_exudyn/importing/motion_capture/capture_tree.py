"""One tree of joints for every source of segments: a capture made from segments' rotations in space."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Final

import numpy as np

from sssi_exudyn.core.frames import BODY_FROM_BVH, Array
from sssi_exudyn.importing.motion_capture.resample import even_frames
from sssi_exudyn.motion.capture_to_chain import hanging_from_t_pose
from sssi_exudyn.recording.instruments.bvh import Bvh

SIDES: Final = (("r", "Right"), ("l", "Left"))
TREE: Final[tuple[tuple[str, str], ...]] = (
    ("Hips", ""),
    *(
        row
        for _, word in SIDES
        for row in ((f"{word}UpLeg", "Hips"), (f"{word}Leg", f"{word}UpLeg"), (f"{word}Foot", f"{word}Leg"))
    ),
    ("Spine", "Hips"),
    ("Spine1", "Spine"),
    ("Spine2", "Spine1"),
    ("Neck", "Spine2"),
    ("Head", "Neck"),
    *(
        row
        for _, word in SIDES
        for row in (
            (f"{word}Shoulder", "Spine2"),
            (f"{word}Arm", f"{word}Shoulder"),
            (f"{word}ForeArm", f"{word}Arm"),
            (f"{word}Hand", f"{word}ForeArm"),
        )
    ),
)
"""Joints and the joint that carries each; parents before children."""
_TRUNK: Final = ("Spine", "Spine1", "Spine2", "Neck", "LeftShoulder", "RightShoulder")
"""Joints that move with the trunk, whose parts these sources do not distinguish."""


def capture_of(
    path: Path,
    time: Array,
    rotation: Mapping[str, Array],
    place: Mapping[str, Array],
    ends: Mapping[str, Array],
    notes: tuple[str, ...],
) -> Bvh:
    """Make a capture from segments, at even steps.

    Parameters
    ----------
    path : file that messages name
    time : (n,) s, rising
    rotation : joint → (n, 3, 3) of the segment it moves, in a level world: body axes, zero when standing with the arms
        hanging; "Spine" stands for the whole trunk
    place : joint → (3,) m in the segment that carries it; zero where there is none
    ends : joint → (3,) m, the far end of its segment in that segment

    Raises InputError where no stretch is free of long gaps.
    """
    world = {
        name: BODY_FROM_BVH.T
        @ rotation["Spine" if name in _TRUNK else name]
        @ hanging_from_t_pose(name).T
        @ BODY_FROM_BVH
        for name, _ in TREE
    }
    local = np.stack(
        [np.swapaxes(world[parent], -1, -2) @ world[name] if parent else world[name] for name, parent in TREE], axis=1
    )
    even, turned, root, done = even_frames(path, time, local, np.zeros((len(time), 3)))
    names = tuple(name for name, _ in TREE)
    zero = np.zeros(3)
    offsets = [BODY_FROM_BVH.T @ hanging_from_t_pose(parent) @ place.get(name, zero) for name, parent in TREE]
    return Bvh(
        names=names,
        parents=tuple(names.index(parent) if parent else -1 for _, parent in TREE),
        offsets=np.array(offsets),
        end_offsets={name: BODY_FROM_BVH.T @ hanging_from_t_pose(name) @ end for name, end in ends.items()},
        time=even,
        rotations=turned,
        root_position=root,
        notes=(*notes, *done),
    )


def trunk_places(neck: Array) -> dict[str, Array]:
    """Return the places of the trunk's joints above the lumbar one, for a base of the neck at ``neck`` (3,) m from it.

    The parts are equal, and the collar bones begin at the neck.
    """
    third = neck / 3.0
    return {name: third for name in _TRUNK if name != "Spine"}
