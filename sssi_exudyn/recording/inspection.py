"""The content of a recording before any simulation: durations, rates, gaps, and estimates next to given values."""

from __future__ import annotations

import io
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.text import plot_text
from sssi_exudyn.io.writing import check_file_name, write_atomically
from sssi_exudyn.recording.recording import Recording
from sssi_exudyn.recording.slope_and_heading import estimate_slope_and_heading

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from sssi_exudyn.terrain.profile import SurfaceFigures

_PICTURES: Final = (".png", ".svg", ".pdf")


@dataclass(frozen=True)
class Instrument:
    """The times at which one instrument measured."""

    name: str
    samples: int
    start_s: float
    stop_s: float
    rate_hz: float
    longest_step_s: float


@dataclass(frozen=True)
class Comparison:
    """A number that is used, and its estimate from the recording itself (None without an estimate)."""

    name: str
    used_deg: float
    given: bool
    estimate_deg: float | None
    sigma_deg: float | None


@dataclass(frozen=True)
class Inspection:
    """The content of a recording; every figure has its unit in its name."""

    name: str
    folder: str
    instruments: tuple[Instrument, ...]
    start_s: float
    stop_s: float
    track_length_m: float | None
    drop_m: float | None
    mean_speed_mps: float | None
    fix_sigma_m: float | None
    mean_load_N: float | None
    dead_cells: tuple[str, ...]
    setting: tuple[Comparison, ...]
    notices: tuple[str, ...]
    surface: SurfaceFigures | None = None


def inspect_recording(recording: Recording, surface: SurfaceFigures | None = None) -> Inspection:
    """Gather the content of a recording; ``surface`` is the snow surface that the fixes' heights show.

    Lengths and means are over the stretch that all instruments cover.
    """
    gps, insoles = recording.gps, recording.insoles
    instruments = [_instrument("motion", recording.bvh.time)]
    length = drop = speed = sigma = load = None
    if gps is not None:
        instruments.append(_instrument("gps", gps.time))
        within = (gps.time >= recording.start) & (gps.time <= recording.stop)
        track = gps.enu[within]
        length = float(np.sum(np.linalg.norm(np.diff(track, axis=0), axis=1)))
        drop = float(track[0, 2] - track[-1, 2])
        speed = length / float(np.ptp(gps.time[within]))
        sigma = float(np.median(gps.sigma))
    if insoles is not None:
        instruments.append(_instrument("insoles", insoles.time))
        within = (insoles.time >= recording.start) & (insoles.time <= recording.stop)
        load = float(np.mean((insoles.left + insoles.right)[within]))
    if recording.poles is not None:
        instruments.append(_instrument("poles", recording.poles.time))
    return Inspection(
        name=recording.name,
        folder=str(recording.folder),
        instruments=tuple(instruments),
        start_s=recording.start,
        stop_s=recording.stop,
        track_length_m=length,
        drop_m=drop,
        mean_speed_mps=speed,
        fix_sigma_m=sigma,
        mean_load_N=load,
        dead_cells=() if insoles is None else insoles.dead_cells,
        setting=_compare(recording),
        notices=recording.notices,
        surface=surface,
    )


def format_inspection(inspection: Inspection) -> str:
    """Return the inspection as lines of text for a terminal."""
    lines = [f"{inspection.name}  ({inspection.folder})", ""]
    lines += [
        f"  {one.name:<9}{one.start_s:8.2f} to {one.stop_s:.2f} s  {one.samples:6d} samples"
        f"  {one.rate_hz:6.1f} Hz  longest step {one.longest_step_s:.3f} s"
        for one in inspection.instruments
    ]
    lines.append(f"  together {inspection.start_s:8.2f} to {inspection.stop_s:.2f} s")
    if inspection.track_length_m is not None:
        lines.append(
            f"  track    {inspection.track_length_m:8.1f} m long, {inspection.drop_m:.1f} m down,"
            f" {inspection.mean_speed_mps:.1f} m/s on average, fixes ± {inspection.fix_sigma_m:.3g} m"
        )
    if inspection.mean_load_N is not None:
        dead = ", ".join(inspection.dead_cells) or "none"
        lines.append(f"  feet     {inspection.mean_load_N:8.0f} N on average, dead cells: {dead}")
    lines.append("")
    for item in inspection.setting:
        source = "given" if item.given else "estimated"
        line = f"  {item.name:<18}{item.used_deg:8.2f}° {source}"
        if item.given and item.estimate_deg is not None:
            line += f"; from motion and fixes {item.estimate_deg:.2f} ± {item.sigma_deg:.2f}°"
        elif item.sigma_deg is not None:
            line += f", ± {item.sigma_deg:.2f}°"
        lines.append(line)
    if inspection.surface is not None:
        lines += ["", "  " + format_surface(inspection.surface)]
    if inspection.notices:
        lines += ["", *(f"  note: {notice}" for notice in inspection.notices)]
    return "\n".join(lines) + "\n"


def format_surface(surface: SurfaceFigures) -> str:
    """Describe the snow surface in one line."""
    source = "this run" if surface.runs == 1 else f"{surface.runs} runs"
    return (
        f"snow      {surface.lowest_m:+.2f} to {surface.highest_m:+.2f} m about the slope's plane,"
        f" ± {surface.band_m:.2f} m,"
        f" {surface.inclination_least_deg:.1f} to {surface.inclination_most_deg:.1f}° steep along the path;"
        f" from the heights of {source}"
    )


def plot_inspection(recording: Recording, path: Path) -> None:
    """Draw track with fall line, altitude, insole totals and the instruments' sampling into an image file.

    ``path`` ends in .png, .svg or .pdf.  Raises InputError for another ending, and where it cannot be written.
    """
    figure = picture(path, (11.0, 8.0))
    panels = figure.subplots(2, 2)
    _draw_track(panels[0, 0], recording)
    _draw_altitude(panels[0, 1], recording)
    _draw_load(panels[1, 0], recording)
    _draw_sampling(panels[1, 1], recording)
    figure.suptitle(plot_text(recording.name))
    save_picture(figure, path)


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


def _instrument(name: str, time: Array) -> Instrument:
    steps = np.diff(time)
    return Instrument(
        name, len(time), float(time[0]), float(time[-1]), 1.0 / float(np.median(steps)), float(np.max(steps))
    )


def _compare(recording: Recording) -> tuple[Comparison, ...]:
    """Return slope and heading as used; given ones come with the estimates from motion and fixes."""
    slope, heading = recording.slope, recording.heading
    used = (
        ("inclination", slope.inclination, slope.estimated, slope.sigma_inclination),
        ("fall-line azimuth", slope.fall_line_azimuth, slope.estimated, slope.sigma_fall_line_azimuth),
        ("heading", heading.value, heading.estimated, heading.sigma),
    )
    estimates: list[tuple[float, float] | None] = [None, None, None]
    if recording.gps is not None:
        given = None if heading.estimated else heading.value
        setting = estimate_slope_and_heading(recording.bvh, recording.gps, recording.equipment.ankle_to_ski_base, given)
        if setting.slope is not None:
            inclination, azimuth = setting.slope.inclination, setting.slope.azimuth
            estimates[0] = (inclination.value, inclination.sigma)
            estimates[1] = (azimuth.value % (2.0 * np.pi), azimuth.sigma)
        if setting.heading is not None:
            estimates[2] = (setting.heading.value % (2.0 * np.pi), setting.heading.sigma)
    rows = []
    for (name, value, estimated, sigma), from_fixes in zip(used, estimates, strict=True):
        estimate = (value, sigma) if estimated else from_fixes
        estimate_deg, sigma_deg = (None, None) if estimate is None else map(float, np.rad2deg(estimate))
        rows.append(Comparison(name, float(np.rad2deg(value)), not estimated, estimate_deg, sigma_deg))
    return tuple(rows)


def _draw_track(axes: Axes, recording: Recording) -> None:
    axes.set(title="Track and fall line", xlabel="east (m)", ylabel="north (m)", aspect="equal")
    if recording.gps is None:
        return
    east, north = recording.gps.enu[:, 0], recording.gps.enu[:, 1]
    azimuth = recording.slope.fall_line_azimuth
    # the fall line is drawn as long as the track reaches along it
    reach = float(np.max(east * np.sin(azimuth) + north * np.cos(azimuth)))
    axes.plot(east, north, ".-", markersize=3, label="antenna")
    axes.plot([0.0, reach * np.sin(azimuth)], [0.0, reach * np.cos(azimuth)], "--", label="fall line")
    axes.legend()


def _draw_altitude(axes: Axes, recording: Recording) -> None:
    axes.set(title="Altitude from the first fix", xlabel="time (s)", ylabel="up (m)")
    if recording.gps is not None:
        axes.plot(recording.gps.time, recording.gps.enu[:, 2], ".-", markersize=3)


def _draw_load(axes: Axes, recording: Recording) -> None:
    axes.set(title="Insoles", xlabel="time (s)", ylabel="force (N)")
    if recording.insoles is not None:
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
