"""A writer of captures as BVH, in the form that recordings hold: centimetres, degrees, channels about y, x and z."""

from __future__ import annotations

import warnings
from typing import Final

import numpy as np
from scipy.spatial.transform import Rotation

from sssi_exudyn.core.frames import Array
from sssi_exudyn.recording.instruments.bvh import Bvh

_ROTATIONS: Final = "Yrotation Xrotation Zrotation"
_DIGITS: Final = "%.6f"
"""Format of degrees and centimetres: far finer than any capture resolves."""


def bvh_text(bvh: Bvh) -> str:
    """Return the file's text.  Frames are written at even steps: the mean of ``bvh.time``."""
    order: list[int] = []
    lines = ["HIERARCHY"]
    _write_joint(bvh, 0, "", lines, order)
    step = float(bvh.time[-1] - bvh.time[0]) / (len(bvh.time) - 1)
    lines += ["MOTION", f"Frames: {len(bvh.time)}", f"Frame Time: {step:.9f}"]
    columns = np.hstack([100.0 * bvh.root_position, *(_degrees(bvh.rotations[:, joint]) for joint in order)])
    row = " ".join([_DIGITS] * columns.shape[1])
    lines += [row % tuple(values) for values in columns.tolist()]
    return "\n".join(lines) + "\n"


def _write_joint(bvh: Bvh, joint: int, indent: str, lines: list[str], order: list[int]) -> None:
    """Add the lines of the joint and of all below it; ``order`` collects the order of their channels."""
    order.append(joint)
    name = bvh.names[joint]
    channels = f"CHANNELS 3 {_ROTATIONS}" if indent else f"CHANNELS 6 Xposition Yposition Zposition {_ROTATIONS}"
    lines += [
        f"{indent}{'JOINT' if indent else 'ROOT'} {name}",
        f"{indent}{{",
        f"{indent}  {_offset(bvh.offsets[joint])}",
        f"{indent}  {channels}",
    ]
    for child, parent in enumerate(bvh.parents):
        if parent == joint:
            _write_joint(bvh, child, indent + "  ", lines, order)
    if joint not in bvh.parents:
        end = bvh.end_offsets.get(name, np.zeros(3))
        lines += [f"{indent}  End Site", f"{indent}  {{", f"{indent}    {_offset(end)}", f"{indent}  }}"]
    lines.append(f"{indent}}}")


def _offset(offset: Array) -> str:
    return "OFFSET " + " ".join(_DIGITS % value for value in 100.0 * offset)


def _degrees(rotation: Array) -> Array:
    """Return the angles (n, 3) in degrees about y, x, z of rotations (n, 3, 3)."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # at gimbal lock one angle is free: any choice is the rotation
        return np.asarray(Rotation.from_matrix(rotation).as_euler("YXZ", degrees=True))
