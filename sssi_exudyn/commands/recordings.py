"""``sssi inspect`` and ``sssi import``."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Final

from sssi_exudyn.importing.assemble import Answers, import_recording
from sssi_exudyn.motion.from_recording import motion_from_recording
from sssi_exudyn.motion.motion import Motion
from sssi_exudyn.recording.inspection import Inspection, inspect_recording, plot_inspection
from sssi_exudyn.recording.read import read_recording
from sssi_exudyn.recording.recording import Recording
from sssi_exudyn.runtime.progress import Progress

SILENT: Final = Progress()
"""Reports no progress."""


def inspect(folder: Path, picture: Path | None = None) -> Inspection:
    """What is in a recording: durations, rates, gaps, overlaps, estimated slope and heading; drawn to ``picture`` if
    given.
    """
    recording = read_recording(folder)
    if picture is not None:
        plot_inspection(recording, picture)
    return inspect_recording(recording)


def import_files(files: Sequence[Path], out: Path, answers: Answers) -> Inspection:
    """Make a recording's folder ``out`` out of files of other formats; what is in it."""
    return inspect_recording(import_recording(files, out, answers))


def read_folder(folder: Path, progress: Progress) -> tuple[Recording, Motion]:
    """The recording in a folder, and its motion.  Raises InputError where something in it is wrong."""
    with progress.stage("read") as stage:
        recording = read_recording(folder)
        motion = motion_from_recording(recording)
        stage.advance(1.0, f"{motion.stop - motion.start:.1f} s of {recording.name}")
    return recording, motion
