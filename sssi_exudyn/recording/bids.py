"""A motion capture as a dataset of the Brain Imaging Data Structure (BIDS 1.11, Motion), to share and to archive it.

https://bids-specification.readthedocs.io/en/stable/modality-specific-files/motion.html: a subject's folder ``motion``
holds the time series without a headline, a table of its channels, and what both mean.
"""

from __future__ import annotations

import re
from importlib.metadata import version
from pathlib import Path
from typing import Any, Final

import numpy as np

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.text import one_line
from sssi_exudyn.io.writing import clear_errors, to_json, write_atomically
from sssi_exudyn.recording.instruments.bvh import Bvh, joint_positions, world_rotations

BIDS_VERSION: Final = "1.11.0"
TASK: Final = "skiing"
TRACKSYS: Final = "capture"
"""Labels of the task and of the tracking system in the files' names."""
CHANNEL_COLUMNS: Final = ("name", "component", "type", "tracked_point", "units", "reference_frame")
_PLACE, _TURN = ("x", "y", "z"), ("quat_x", "quat_y", "quat_z", "quat_w")
_FRAME: Final = {
    "reference_frame": {
        "Description": "Frame of the capture.",
        "Levels": {
            "capture": {
                "SpatialAxes": "LUF",
                "RotationRule": "right-hand",
                "RotationOrder": "n/a",
                "Description": "x to the left, y up, z forward.",
            }
        },
    }
}


def write_bids(bvh: Bvh, name: str, folder: Path, subject: str) -> Path:
    """Write a recording's capture into a BIDS dataset, begun where there is none; return the file of its time series.

    Parameters
    ----------
    name : of the recording
    subject : label of the subject in the dataset, of letters and digits

    Raises InputError for another label, and where the dataset has the subject.
    """
    if not re.fullmatch("[0-9A-Za-z]+", subject):
        raise InputError("to_bids", "subject", f"{subject!r} is no label", "use letters and digits alone, such as 01")
    stem = f"sub-{subject}_task-{TASK}_tracksys-{TRACKSYS}"
    own = folder / f"sub-{subject}" / "motion"
    if (own / f"{stem}_motion.tsv").exists():
        raise InputError(own, "", "the dataset has this subject already", "choose another subject")
    channels, values = channels_of(bvh)
    texts = {
        f"{stem}_channels.tsv": _tsv([CHANNEL_COLUMNS, *channels]),
        f"{stem}_channels.json": to_json(_FRAME),
        f"{stem}_motion.json": to_json(_sidecar(bvh, channels)),
        f"{stem}_motion.tsv": _tsv([[f"{value:.6g}" for value in row] for row in values.tolist()]),
    }
    with clear_errors(own):
        own.mkdir(parents=True, exist_ok=True)
    for file, text in _of_dataset(name).items():
        if not (folder / file).exists():
            write_atomically(folder / file, text)
    for file, text in texts.items():
        write_atomically(own / file, text)
    return own / f"{stem}_motion.tsv"


def channels_of(bvh: Bvh) -> tuple[list[tuple[str, ...]], Array]:
    """Return the channels, a row of ``CHANNEL_COLUMNS`` each, and their values (n, channels).

    They are the time from the first frame (s), and of every joint its place (m) and its orientation as a quaternion.
    """
    from scipy.spatial.transform import Rotation  # here: only this export needs it

    world = world_rotations(bvh)
    places = bvh.root_position[:, None] + joint_positions(bvh, world)
    channels: list[tuple[str, ...]] = [("latency", "n/a", "LATENCY", "n/a", "s", "n/a")]
    columns = [bvh.time[:, None] - bvh.time[0]]
    for joint, name in enumerate(bvh.names):
        channels += [(f"{name}_{axis}", axis, "POS", name, "m", "capture") for axis in _PLACE]
        channels += [(f"{name}_{part}", part, "ORNT", name, "n/a", "capture") for part in _TURN]
        columns += [places[:, joint], Rotation.from_matrix(world[:, joint]).as_quat()]
    return channels, np.hstack(columns)


def _sidecar(bvh: Bvh, channels: list[tuple[str, ...]]) -> dict[str, Any]:
    """Return the content of ``_motion.json``."""
    kinds = [channel[2] for channel in channels]
    duration = float(bvh.time[-1] - bvh.time[0])
    return {
        "TaskName": TASK,
        "TaskDescription": "Skiing down a slope.",
        "SamplingFrequency": round(1.0 / float(np.median(np.diff(bvh.time))), 6),
        "SamplingFrequencyEffective": round((len(bvh.time) - 1) / duration, 6),
        "RecordingDuration": round(duration, 6),
        "TrackingSystemName": TRACKSYS,
        "TrackedPointsCount": len(bvh.names),
        "MotionChannelCount": len(channels),
        "POSChannelCount": kinds.count("POS"),
        "ORNTChannelCount": kinds.count("ORNT"),
        "LATENCYChannelCount": kinds.count("LATENCY"),
        "MissingValues": "n/a",
    }


def _of_dataset(recording: str) -> dict[str, str]:
    """Return the files of the dataset itself, by name."""
    description = {
        "Name": "Skiing",
        "BIDSVersion": BIDS_VERSION,
        "DatasetType": "raw",
        "GeneratedBy": [{"Name": "sssi_exudyn", "Version": version("sssi-exudyn")}],
    }
    readme = (
        "# Skiing\n\nMotion captures of skiers, a subject each. Places are metres and orientations are quaternions, "
        f"both in the frame of the capture.\nThe first subject was the recording {one_line(recording)}.\n"
    )
    return {"dataset_description.json": to_json(description), "README.md": readme}


def _tsv(rows: Any) -> str:
    return "".join("\t".join(row) + "\n" for row in rows)
