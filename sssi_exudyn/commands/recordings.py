"""``sssi inspect``, ``sssi terrain`` and ``sssi import``."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Final

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.text import plot_text
from sssi_exudyn.recording.inspection import Inspection, inspect_recording, picture, plot_inspection, save_picture
from sssi_exudyn.recording.read import read_recording
from sssi_exudyn.recording.recording import FILE, Elevations, Recording
from sssi_exudyn.runtime.progress import Progress

if TYPE_CHECKING:
    from sssi_exudyn.importing.answers import Answers
    from sssi_exudyn.importing.many import ImportedRun
    from sssi_exudyn.motion.motion import Motion
    from sssi_exudyn.terrain.profile import SurfaceFigures
    from sssi_exudyn.terrain.surface import Surface

SILENT: Final = Progress()
"""Reports no progress."""


def inspect(folder: Path, out: Path | None = None) -> Inspection:
    """What is in a recording: durations, rates, gaps, overlaps, estimated slope and heading, the snow surface; drawn to
    the picture ``out`` if given.
    """
    recording = read_recording(folder)
    if out is not None:
        plot_inspection(recording, out)
    found = _snow(recording)
    if found is None:
        return inspect_recording(recording)
    from sssi_exudyn.terrain.profile import surface_figures

    return inspect_recording(recording, surface_figures(*found))


def terrain(folder: Path, elevations: Path | None = None, out: Path | None = None) -> SurfaceFigures:
    """The snow surface under a recorded run, from its fixes' heights and from an elevation model, the recording's own
    or the file ``elevations``; drawn to the picture ``out`` if given.

    Raises InputError for a recording without fixes, and for an elevation model that cannot be used.
    """
    recording = read_recording(folder)
    if elevations is not None:
        recording = replace(recording, elevations=Elevations(elevations, same_datum=False))
    found = _snow(recording)
    if found is None:
        raise InputError(folder / FILE, "[gps]", "there are no fixes whose heights show the snow", "add them")
    from sssi_exudyn.terrain.profile import surface_figures

    if out is not None:
        from sssi_exudyn.reports.sections.snow_surface import surface_panels  # here: only drawing needs it

        figure = picture(out, (11.0, 7.0))
        for axes, panel in zip(figure.subplots(2, 1), surface_panels(recording.name, *found[:3]), strict=True):
            panel.draw(axes)
            axes.set_title(plot_text(panel.title))
        save_picture(figure, out)
    return surface_figures(*found)


def _snow(recording: Recording) -> tuple[Surface, Array, float, int] | None:
    """The snow surface that the fixes show, the way over it (n, 2) m, the plane's inclination, and of how many runs the
    heights are; None without one.
    """
    if recording.gps is None:  # a motion takes a second, and as long to load what makes it
        return None
    from sssi_exudyn.fitting.snow_surface import snow_surface
    from sssi_exudyn.model.from_recording import model_of
    from sssi_exudyn.motion.from_recording import motion_from_recording

    motion = motion_from_recording(recording)
    model = model_of(recording, motion)
    found = snow_surface(model, recording, motion)
    return found and (found[0], found[1].places, model.inclination, 1 + len(found[1].others))


def import_files(files: Sequence[Path], out: Path, answers: Answers, defaults: Path | None = None) -> Inspection:
    """Make a recording's folder ``out`` out of files of other formats; what is in it.  What ``answers`` leave open is
    taken from the file ``defaults``.
    """
    from sssi_exudyn.importing.assemble import import_recording  # here: no other command needs it

    return inspect_recording(import_recording(files, out, _filled(answers, defaults)))


def import_folder(
    folder: Path, out: Path, answers: Answers, defaults: Path | None = None, *, progress: Progress = SILENT
) -> list[ImportedRun]:
    """Make recordings in ``out`` of all runs in ``folder``, with a table of them; its rows."""
    from sssi_exudyn.importing.many import import_many

    with progress.stage("import") as stage:
        return import_many(folder, out, _filled(answers, defaults), stage)


def _filled(answers: Answers, defaults: Path | None) -> Answers:
    from sssi_exudyn.importing.defaults import fill, read_defaults

    return answers if defaults is None else fill(answers, read_defaults(defaults))


def read_folder(source: Path | Recording, progress: Progress) -> tuple[Recording, Motion]:
    """A recording, or that in a folder, and its motion.  Raises InputError where something in it is wrong."""
    from sssi_exudyn.motion.from_recording import motion_from_recording

    with progress.stage("read") as stage:
        recording = source if isinstance(source, Recording) else read_recording(source)
        motion = motion_from_recording(recording)
        stage.advance(1.0, f"{motion.stop - motion.start:.1f} s of {recording.name}")
    return recording, motion
