"""The work of ``sssi inspect`` and ``sssi terrain``; and recordings read for every other command."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Final

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.text import plot_text
from sssi_exudyn.recording.inspection import Inspection, inspect_recording
from sssi_exudyn.recording.inspection_plot import picture, plot_inspection, save_picture
from sssi_exudyn.recording.read import read_recording
from sssi_exudyn.recording.recording import FILE, Elevations, Recording
from sssi_exudyn.runtime.progress import Progress
from sssi_exudyn.terrain.elevation_model import epsg_of, usual_sigma

if TYPE_CHECKING:
    from sssi_exudyn.motion.motion import Motion
    from sssi_exudyn.terrain.profile import SurfaceFigures
    from sssi_exudyn.terrain.surface import Surface

SILENT: Final = Progress()
"""Reports no progress."""
SHORTEST_FIT: Final = 2.0
"""s; the shortest stretch of a run that a fit can use: one turn."""
SHORTEST_RUN: Final = 0.1
"""s; the shortest stretch that is simulated."""
LONGEST_RUN: Final = 1200.0
"""s; the longest stretch that is simulated: the longest descents of the Alps take less without a stop, and a second of
run takes 5 to 9 MB."""


def inspect(folder: Path, out: Path | None = None) -> Inspection:
    """Inspect a recording: turns, durations, rates, gaps, overlaps, estimated slope and heading, the snow surface.

    Draws it into the picture ``out`` if given.
    """
    from sssi_exudyn.analysis.skiing import skiing_of

    recording = read_recording(folder)
    skiing = skiing_of(recording)
    if out is not None:
        plot_inspection(recording, out, skiing)
    snow = _snow(recording)
    if snow is None:
        return inspect_recording(recording, skiing=skiing)
    from sssi_exudyn.terrain.profile import surface_figures

    return inspect_recording(recording, surface_figures(*snow), skiing)


def terrain(
    folder: Path, elevations: Path | None = None, out: Path | None = None, crs: str | None = None
) -> SurfaceFigures:
    """Estimate the snow surface under a recorded run, and draw it into the picture ``out`` if given.

    It follows from the fixes' heights and from an elevation model, the recording's own or the file ``elevations``
    (in the coordinate system ``crs`` if it states none).
    Raises InputError for a recording without fixes, and for an elevation model that cannot be used.
    """
    recording = read_recording(folder)
    stated = "" if crs is None else epsg_of(crs, "sssi terrain", "--dem-crs")
    if elevations is not None:
        model = Elevations(elevations, same_datum=False, crs=stated, sigma=usual_sigma(elevations))
        recording = replace(recording, elevations=model)
    elif stated:
        raise InputError("sssi terrain", "--dem-crs", "there is no elevation model", "give one with --dem")
    snow = _snow(recording)
    if snow is None:
        raise InputError(folder / FILE, "[gps]", "there are no fixes whose heights show the snow", "add them")
    from sssi_exudyn.terrain.profile import surface_figures

    if out is not None:
        from sssi_exudyn.reports.sections.snow_surface import surface_panels  # here: only drawing needs it

        figure = picture(out, (11.0, 7.0))
        for axes, panel in zip(figure.subplots(2, 1), surface_panels(recording.name, *snow[:3]), strict=True):
            panel.draw(axes)
            axes.set_title(plot_text(panel.title))
        save_picture(figure, out)
    return surface_figures(*snow)


def _snow(recording: Recording) -> tuple[Surface, Array, float, int] | None:
    """Return the snow surface that the fixes show, the path over it (n, 2) m, the plane's inclination, and the runs.

    The last is the number of runs whose heights are used.  None stands for a recording without such fixes.
    """
    if recording.gps is None:  # a motion takes a second, and as long to load what makes it
        return None
    from sssi_exudyn.fitting.snow_surface import snow_surface
    from sssi_exudyn.model.from_recording import model_of
    from sssi_exudyn.motion.from_recording import motion_from_recording

    motion = motion_from_recording(recording)
    model = model_of(recording, motion)
    estimated = snow_surface(model, recording, motion)
    if estimated is None:
        return None
    surface, heights = estimated
    return surface, heights.places, model.inclination, 1 + len(heights.others)


def read_folder(
    source: Path | Recording,
    progress: Progress,
    seconds: tuple[float, float] | None = None,
    shortest: float = SHORTEST_FIT,
) -> tuple[Recording, Motion]:
    """Read a recording, unless it is one already, and its motion; both end at ``seconds``, where these are given.

    Raises InputError where something in it is wrong, and for a stretch outside of it, shorter than ``shortest`` (s) or
    longer than ``LONGEST_RUN``.
    """
    from sssi_exudyn.motion.from_recording import motion_from_recording

    with progress.stage("read") as stage:
        recording = source if isinstance(source, Recording) else read_recording(source)
        if seconds is not None:
            recording = _stretch(recording, *seconds, shortest)
        _check_length(recording)
        motion = motion_from_recording(recording)
        stage.advance(1.0, f"{motion.stop - motion.start:.1f} s of {recording.name}")
    return recording, motion


def _check_length(recording: Recording) -> None:
    """Raise InputError for a recording that is longer than what is simulated at once."""
    length = recording.stop - recording.start
    if length > LONGEST_RUN:
        problem = f"{length:.0f} s are more than the {LONGEST_RUN:.0f} s that are simulated at once"
        raise InputError(recording.folder, "", problem, "take a part of it with --seconds BEGIN:END")


def _stretch(recording: Recording, begin: float, end: float, shortest: float) -> Recording:
    """Return a stretch of a recording (s of its clock).  Raises InputError where hardly anything of it is left."""
    first, last = max(begin, recording.start), min(end, recording.stop)
    if last - first < shortest:
        problem = f"{begin:g} to {end:g} s hold less than {shortest:g} s of the run"
        fix = f"choose a longer stretch of {recording.start:.2f} to {recording.stop:.2f} s"
        raise InputError(recording.folder, "seconds", problem, fix)
    return replace(recording, start=first, stop=last)
