"""The content of a recording before any simulation: durations, rates, gaps, and estimates next to given values."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.text import plus_minus
from sssi_exudyn.recording.read import NOT_GIVEN
from sssi_exudyn.recording.recording import Recording
from sssi_exudyn.recording.slope_and_heading import estimate_slope_and_heading

if TYPE_CHECKING:
    from sssi_exudyn.terrain.profile import SurfaceFigures


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
class TurnSpan:
    """One turn of the track, between two transitions."""

    side: Literal["left", "right"]
    start_s: float
    stop_s: float


@dataclass(frozen=True)
class Skiing:
    """Turns and speed of the track.

    top_speed_mps : the receiver's own, else averaged for as long as the fixes' noise requires
    crop_start_s, crop_stop_s : the stretch with turns; None where hardly anything lies outside it
    """

    turns: tuple[TurnSpan, ...]
    top_speed_mps: float
    crop_start_s: float | None
    crop_stop_s: float | None


@dataclass(frozen=True)
class Inspection:
    """The content of a recording; every figure has its unit in its name.

    skiing : turns and speed of the track; None without fixes
    """

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
    skiing: Skiing | None = None


def inspect_recording(
    recording: Recording, surface: SurfaceFigures | None = None, skiing: Skiing | None = None
) -> Inspection:
    """Gather the content of a recording; ``surface`` is the snow surface that the fixes' heights show.

    Lengths and means are over the stretch that all instruments cover.
    """
    gps, insoles = recording.gps, recording.insoles
    instruments = [_instrument("motion", recording.bvh.time)]
    length = drop = speed = sigma = load = None
    if gps is not None:
        instruments.append(_instrument("gps", gps.time))
        within = gps.between(recording.start, recording.stop)
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
        skiing=skiing,
    )


def format_inspection(inspection: Inspection) -> str:
    """Return the inspection as lines of text for a terminal: the run first, then its instruments and its setting."""
    seconds = inspection.stop_s - inspection.start_s
    lines = [f"{inspection.name}: {seconds:.1f} s that all instruments cover{_skiing_text(inspection)}"]
    lines += _crop_text(inspection)
    lines += [
        f"  {one.name:<9}{one.start_s:8.2f} to {one.stop_s:.2f} s  {one.samples:6d} samples"
        f"  {one.rate_hz:6.1f} Hz  longest step {one.longest_step_s:.3f} s"
        for one in inspection.instruments
    ]
    if inspection.track_length_m is not None:
        lines.append(
            f"  track    {inspection.track_length_m:8.1f} m long, {inspection.drop_m:.1f} m down,"
            f" fixes ± {inspection.fix_sigma_m:.3g} m"
        )
    if inspection.mean_load_N is not None:
        dead = ", ".join(inspection.dead_cells) or "none"
        lines.append(f"  feet     {inspection.mean_load_N:8.0f} N on average, dead cells: {dead}")
    lines += [_setting_text(item) for item in inspection.setting]
    if inspection.surface is not None:
        lines.append("  " + format_surface(inspection.surface))
    # what was estimated stands above
    lines += [f"  note: {notice}" for notice in inspection.notices if NOT_GIVEN not in notice]
    return "\n".join(lines) + "\n"


def _skiing_text(inspection: Inspection) -> str:
    """Return turns and speed, as the end of a line."""
    skiing, words = inspection.skiing, []
    if skiing is not None:
        left = sum(turn.side == "left" for turn in skiing.turns)
        words.append(f"{len(skiing.turns)} turns ({left} left, {len(skiing.turns) - left} right)")
    if inspection.mean_speed_mps is not None:
        most = "" if skiing is None else f", {skiing.top_speed_mps:.1f} m/s at most"
        words.append(f"{inspection.mean_speed_mps:.1f} m/s on average{most}")
    return "".join(f", {word}" for word in words)


def _crop_text(inspection: Inspection) -> list[str]:
    """Return the suggested crop in a line; none where the recording is all skiing."""
    skiing = inspection.skiing
    if skiing is None or skiing.crop_start_s is None or skiing.crop_stop_s is None:
        return []
    begin, end = f"{skiing.crop_start_s:.1f}", f"{skiing.crop_stop_s:.1f}"
    return [
        f"  suggested crop: {begin} to {end} s, from the first turn to the last (--seconds {begin}:{end}); before and "
        "after it the skier does not turn"
    ]


def _setting_text(item: Comparison) -> str:
    """Return a number that is used, with its estimate where there is one, to the digits that its error justifies."""
    name = f"  {item.name:<18}"
    estimate = "" if item.estimate_deg is None or not item.sigma_deg else plus_minus(item.estimate_deg, item.sigma_deg)
    if item.given:
        return f"{name}{item.used_deg:g}° given" + (f"; motion and fixes say {estimate}°" if estimate else "")
    return f"{name}{estimate or f'{item.used_deg:.1f}'}° estimated"


def format_surface(surface: SurfaceFigures) -> str:
    """Describe the snow surface in one line."""
    source = "this run" if surface.runs == 1 else f"{surface.runs} runs"
    return (
        f"snow     {surface.lowest_m:+z.2f} to {surface.highest_m:+z.2f} m about the slope's plane,"
        f" ± {surface.band_m:.2f} m,"
        f" {surface.inclination_least_deg:.1f} to {surface.inclination_most_deg:.1f}° steep along the path;"
        f" from the heights of {source}"
    )


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
