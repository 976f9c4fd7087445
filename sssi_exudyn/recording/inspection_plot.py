"""The picture of a recording: track, speed, altitude, loads and sampling; panels without data are left out."""

from __future__ import annotations

import io
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.text import plot_text
from sssi_exudyn.io.writing import check_file_name, write_atomically
from sssi_exudyn.recording.inspection import Skiing
from sssi_exudyn.recording.recording import Recording

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_PICTURES: Final = (".png", ".svg", ".pdf")


def plot_inspection(recording: Recording, path: Path, skiing: Skiing | None = None) -> None:
    """Draw what the recording's instruments measured, and when, into an image file; turns are shaded, a crop is lined.

    ``path`` ends in .png, .svg or .pdf.  Raises InputError for another ending, and where it cannot be written.
    """
    drawn: list[Callable[[Axes, Recording], None]] = []
    if recording.gps is not None:
        drawn += [_draw_track, _draw_speed, _draw_altitude]
    if recording.insoles is not None:
        drawn.append(_draw_load)
    drawn.append(_draw_sampling)
    rows = -(-len(drawn) // 2)
    figure = picture(path, (11.0, 4.0 * rows))
    columns = min(2, len(drawn))
    for index, draw in enumerate(drawn):
        axes = figure.add_subplot(rows, columns, index + 1)
        if draw is _draw_speed:
            _mark_skiing(axes, skiing)
        draw(axes, recording)
    figure.suptitle(plot_text(recording.name))
    save_picture(figure, path)


def _mark_skiing(axes: Axes, skiing: Skiing | None) -> None:
    """Shade every second turn, so that their bounds are seen, and draw a line at each end of the suggested crop.

    The title names what is drawn.
    """
    words = ["Speed"]
    turns = () if skiing is None else skiing.turns[::2]
    for turn in turns:
        axes.axvspan(turn.start_s, turn.stop_s, color="0.5", alpha=0.15, linewidth=0)
    crop = () if skiing is None else (skiing.crop_start_s, skiing.crop_stop_s)
    bounds = [instant for instant in crop if instant is not None]
    for instant in bounds:
        axes.axvline(instant, color="0.2", linestyle="--", linewidth=1.0)
    words += ["every second turn shaded"] if turns else []
    words += ["suggested crop dashed"] if bounds else []
    axes.set_title(", ".join(words), fontsize="medium")


def picture(path: Path, size: tuple[float, float]) -> Figure:
    """Return an empty figure (inches) for an image file.  Raises InputError where ``path`` does not end as one."""
    check_file_name(path)
    if path.suffix.lower() not in _PICTURES or path.is_dir():
        problem = "this is a folder" if path.is_dir() else f"{path.suffix!r} is no picture format"
        raise InputError(path, "", problem, "write a .png, .svg or .pdf")
    from matplotlib.backends.backend_agg import FigureCanvasAgg  # here: only drawing needs them
    from matplotlib.figure import Figure

    figure = Figure(figsize=size, layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def save_picture(figure: Figure, path: Path) -> None:
    """Write a figure to a file.  Raises InputError where the file cannot be written."""
    content = io.BytesIO()
    figure.savefig(content, format=path.suffix.lower().removeprefix("."), dpi=120)
    write_atomically(path, content.getvalue())


def _draw_track(axes: Axes, recording: Recording) -> None:
    axes.set(title="Track and fall line", xlabel="east (m)", ylabel="north (m)", aspect="equal")
    assert recording.gps is not None
    east, north = recording.gps.enu[:, 0], recording.gps.enu[:, 1]
    azimuth = recording.slope.fall_line_azimuth
    # the fall line is drawn as long as the track reaches along it
    reach = float(np.max(east * np.sin(azimuth) + north * np.cos(azimuth)))
    axes.plot(east, north, ".-", markersize=3, label="antenna")
    axes.plot([0.0, reach * np.sin(azimuth)], [0.0, reach * np.cos(azimuth)], "--", label="fall line")
    axes.legend()


def _draw_altitude(axes: Axes, recording: Recording) -> None:
    axes.set(title="Altitude from the first fix", xlabel="time (s)", ylabel="up (m)")
    assert recording.gps is not None
    axes.plot(recording.gps.time, recording.gps.enu[:, 2], ".-", markersize=3)


def _draw_speed(axes: Axes, recording: Recording) -> None:
    axes.set(xlabel="time (s)", ylabel="speed (m/s)")
    assert recording.gps is not None
    time, enu = recording.gps.time, recording.gps.enu
    middles = 0.5 * (time[1:] + time[:-1])
    axes.plot(middles, np.linalg.norm(np.diff(enu, axis=0), axis=1) / np.diff(time))
    axes.set_ylim(bottom=0.0)


def _draw_load(axes: Axes, recording: Recording) -> None:
    axes.set(title="Insoles", xlabel="time (s)", ylabel="force (N)")
    assert recording.insoles is not None
    axes.plot(recording.insoles.time, recording.insoles.left, label="left")
    axes.plot(recording.insoles.time, recording.insoles.right, label="right")
    axes.legend()


def _draw_sampling(axes: Axes, recording: Recording) -> None:
    axes.set(title="Steps between samples", xlabel="time (s)", ylabel="step (s)", yscale="log")
    times = {"motion": recording.bvh.time}
    if recording.gps is not None:
        times["gps"] = recording.gps.time
    if recording.insoles is not None:
        times["insoles"] = recording.insoles.time
    for name, time in times.items():
        axes.plot(time[1:], np.diff(time), ".", markersize=3, label=name)
    axes.axvspan(recording.start, recording.stop, alpha=0.1)
    axes.legend()
