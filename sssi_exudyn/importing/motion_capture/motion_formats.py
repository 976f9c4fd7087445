"""Motion captures of any format, as a recording holds them; each format has one reader, chosen by the file's suffix."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.importing.motion_capture.c3d_points import Points, read_points
from sssi_exudyn.importing.motion_capture.cmu_and_rokoko import other_skeleton, read_other_skeleton
from sssi_exudyn.importing.motion_capture.joint_angles import read_joint_angles
from sssi_exudyn.importing.motion_capture.joint_centres import capture_of_joint_centres
from sssi_exudyn.importing.motion_capture.markers import capture_of_markers, is_plug_in_gait
from sssi_exudyn.importing.motion_capture.mvnx import read_mvnx
from sssi_exudyn.importing.motion_capture.theia import capture_of_poses
from sssi_exudyn.importing.motion_capture.trc import read_trc
from sssi_exudyn.recording.instruments.bvh import Bvh, joint_bones, read_bvh, recording_names

Read = tuple[Bvh, float | None]


def read_motion(path: Path, height: float | None) -> Read:
    """Read the capture and the UTC of its time 0 (s since 1970; None where the file does not have it).

    Parameters
    ----------
    height : height of the skier, m; needed by formats that hold angles without lengths

    Raises InputError for a suffix without reader and whatever the reader refuses.
    """
    try:
        reader = MOTION_READERS[path.suffix.lower()]
    except KeyError:
        raise InputError(
            path, "", f"no reader for {path.suffix!r}", f"export it as one of {', '.join(MOTION_READERS)}"
        ) from None
    return reader(path, height)


def _bvh(path: Path, height: float | None) -> Read:
    """Read a BVH file with the joints of Axis Studio, Axis Neuron or Xsens, of CMU's library or of Rokoko."""
    bones = dict(joint_bones(path))
    renamed = recording_names(tuple(bones))
    kind = other_skeleton({renamed.get(name, name): bone for name, bone in bones.items()})
    if kind is not None:
        if height is None:
            raise InputError(path, "", "no file holds --height-m", "give this option")
        return read_other_skeleton(path, kind, renamed, height), None
    bvh = read_bvh(path, renamed=renamed)
    if "Spine3" not in renamed.values() or bvh.time[0] > 0.0:  # the first frame is left out already
        return replace(bvh, time=bvh.time - bvh.time[0]), None
    note = f"{path.name}: the first frame is left out: Xsens writes the T-pose there"
    return (
        replace(
            bvh,
            time=bvh.time[1:] - bvh.time[1],
            rotations=bvh.rotations[1:],
            root_position=bvh.root_position[1:],
            notes=(*bvh.notes, note),
        ),
        None,
    )


def _mvnx(path: Path, _height: float | None) -> Read:
    return read_mvnx(path)


def _joint_angles(path: Path, height: float | None) -> Read:
    return read_joint_angles(path, height), None


def _markers(path: Path, height: float | None) -> Read:
    """Read a C3D file with the markers of Plug-in Gait, the centres of joints, or Theia's segments."""
    return _of_points(path, read_points(path) if height is not None else None, height), None


def _trc(path: Path, height: float | None) -> Read:
    """Read a TRC file with the same."""
    points, notes = read_trc(path) if height is not None else (None, ())
    bvh = _of_points(path, points, height)
    return replace(bvh, notes=(*notes, *bvh.notes)), None


def _of_points(path: Path, points: Points | None, height: float | None) -> Bvh:
    if points is None or height is None:
        raise InputError(path, "", "no file holds --height-m", "give this option")
    if points.poses:
        return capture_of_poses(path, points, height)
    model = capture_of_markers if is_plug_in_gait(points) else capture_of_joint_centres
    return model(path, points, height)


MOTION_READERS: Final[dict[str, Callable[[Path, float | None], Read]]] = {
    ".bvh": _bvh,
    ".mvnx": _mvnx,
    ".mot": _joint_angles,
    ".sto": _joint_angles,
    ".c3d": _markers,
    ".trc": _trc,
}


@dataclass(frozen=True)
class MotionReader:
    """A reader of this kind lets a plug-in read motion captures.

    suffix : suffix of its files, with the dot
    read : function of a file and the skier's height (m, None where unknown).  It returns the capture and the UTC of its
        time 0 (s since 1970, None where the file does not have it).

    Examples
    --------
    >>> sssi_exudyn.use_plugin(sssi_exudyn.MotionReader(".abc", read_abc))
    """

    suffix: str
    read: Callable[[Path, float | None], Read]


def add_motion_reader(reader: MotionReader) -> None:
    """Let imports read another format of motion capture.  Raises ValueError where the suffix has a reader."""
    if MOTION_READERS.setdefault(reader.suffix.lower(), reader.read) is not reader.read:
        raise ValueError(f"files {reader.suffix} have a reader already")
