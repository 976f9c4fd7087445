"""Repairs of fixes: marks for "unknown", repeated times, and places or heights that no skier reaches.

One bad fix costs one fix.  What is left out is counted, and a file of which too much is bad is refused.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np

from sssi_exudyn.core.frames import Array
from sssi_exudyn.io.repairs import REPEATED, UNKNOWN, Mask, Repairs, reachable_records, rising_records
from sssi_exudyn.io.table import SHORT_GAP
from sssi_exudyn.recording.instruments.fixes import WORST, Fixes

FASTEST: Final = 75.0
"""Largest speed, m/s; above the fastest skier (record of speed skiing 255 km/h = 70.8 m/s)."""
_FASTEST_DOWN: Final = 45.0
"""Largest vertical speed, m/s: that of the fastest skier on a slope of 40°."""
_USUAL: Final = 3.0
"""Standard deviation of a fix, m, where neither the file nor the user states one: receivers of one frequency."""
_NOISE: Final = 6.0 / np.sqrt(2.0)
"""Standard deviations of one fix that count as noise: six of the difference of two equal ones."""
_HEIGHT_NOISE: Final = 10.0
"""Noise of a height, m, at least: telephones' heights settle by twenty metres."""
_STANDING: Final = 1.0
"""Speed, m/s, below which a receiver has no course."""
_MOSTLY: Final = 0.25
"""Share of values that are neither known nor near a known one, from which on a column is left out."""
DEGREE: Final = 111_200.0
"""Length of a degree of latitude, m."""


def repaired(path: Path, fixes: Fixes, sigma: float | None) -> Fixes:
    """Return the fixes that can be used, in order, with every optional column whole or left out.

    Parameters
    ----------
    sigma : m, standard deviation of a horizontal fix, where the file does not have it; None where unknown

    Raises InputError where too many fixes are bad.
    """
    repairs = Repairs(path)
    fixes = _keep(fixes, _placed(repairs, fixes))
    repairs.check_rest(len(fixes.places), "export the run alone, with place and height of every fix")
    rising = rising_records(fixes.columns["time_s"])
    fix = "sort and export the file again"
    words = "fix(es) whose time stands still or runs back"
    repairs.add_at(words, ~rising, fixes.places, most=REPEATED, fix=fix)
    fixes = _keep(fixes, rising)
    fixes = _keep(fixes, _exact(repairs, fixes))
    fixes = _keep(fixes, _reached(repairs, fixes, sigma))
    fixes = _keep(fixes, _fresh(repairs, fixes))
    fixes = _with_heights(repairs, fixes, sigma)
    fixes = _with_velocity(repairs, fixes)
    return replace(fixes, notes=fixes.notes + repairs.notes)


def _keep(fixes: Fixes, kept: Mask) -> Fixes:
    if np.all(kept):
        return fixes
    columns = {name: column[kept] for name, column in fixes.columns.items()}
    places = tuple(place for place, keep in zip(fixes.places, kept.tolist(), strict=True) if keep)
    return replace(fixes, columns=columns, places=places)


def _placed(repairs: Repairs, fixes: Fixes) -> Mask:
    """Return which fixes have a place on Earth and a height.  Many outside it are another unit, judged later."""
    latitude, longitude = fixes.columns["latitude_deg"], fixes.columns["longitude_deg"]
    lost = (latitude == 0.0) & (longitude == 0.0)
    repairs.add_at("fix(es) at latitude and longitude 0", lost, fixes.places, most=UNKNOWN)
    outside = (np.abs(latitude) > 90.0) | (np.abs(longitude) > 180.0)
    if np.mean(outside) > _MOSTLY:
        outside = np.zeros(len(latitude), bool)
    repairs.add_at("fix(es) outside all latitudes and longitudes", outside, fixes.places)
    flat = np.isnan(fixes.columns["altitude_m"])
    fix = "export the run again, with altitude"
    repairs.add_at("fix(es) without a height", flat & ~lost & ~outside, fixes.places, most=UNKNOWN, fix=fix)
    return np.asarray(~(lost | outside | flat))


def _exact(repairs: Repairs, fixes: Fixes) -> Mask:
    """Return which fixes have a useful accuracy, where the receiver writes one at all."""
    sigma = fixes.columns.get("sigma_m")
    if sigma is None:
        return np.ones(len(fixes.places), bool)
    useless = ~((sigma > 0.0) & (sigma <= WORST))
    if np.all(useless):  # another unit, or a receiver that never knows it
        useless[:] = False
    words = "fix(es) of poor or unknown accuracy"
    repairs.add_at(words, useless, fixes.places, most=UNKNOWN, fix="record again in the open")
    return ~useless


def _flat(fixes: Fixes) -> Array:
    """Return the places (n, 2) m over ground, exact enough for speeds."""
    latitude = fixes.columns["latitude_deg"]
    longitude = np.unwrap(fixes.columns["longitude_deg"], period=360.0)
    shrunk = np.cos(np.radians(np.clip(np.median(latitude), -89.0, 89.0)))
    return DEGREE * np.stack([latitude - latitude[0], shrunk * (longitude - longitude[0])], axis=1)


def _sigma(fixes: Fixes, sigma: float | None) -> Array:
    """Return the standard deviation (n,) m of each fix."""
    stated = fixes.columns.get("sigma_m", np.full(len(fixes.places), np.nan))
    usual = _USUAL if sigma is None else sigma
    return np.where((stated > 0.0) & (stated <= WORST), stated, usual)


def _reached(repairs: Repairs, fixes: Fixes, sigma: float | None) -> Mask:
    """Return which fixes a skier reaches from the others."""
    noise = _NOISE * _sigma(fixes, sigma)
    kept = reachable_records(fixes.columns["time_s"], _flat(fixes), FASTEST, noise)
    words = "fix(es) to which no skier jumps from the others"
    fix = "give time in seconds and places in degrees, or export the run alone"
    repairs.add_at(words, ~kept, fixes.places, fix=fix)
    return kept


def _fresh(repairs: Repairs, fixes: Fixes) -> Mask:
    """Return which fixes are measured, where a logger repeats each until the receiver has the next.

    A skier who stands still gives repeated places too, but then most places occur once.
    """
    names = ("latitude_deg", "longitude_deg", "altitude_m")
    same = np.all([np.diff(fixes.columns[name]) == 0.0 for name in names], axis=0)
    fresh = np.r_[True, ~same]
    often = np.diff(np.flatnonzero(np.r_[fresh, True]))
    if np.count_nonzero(fresh) < 3 or np.median(often) < 2.0:
        return np.ones(len(fresh), bool)
    repairs.add_at("fix(es) that repeat the one before", ~fresh, fixes.places, most=1.0)
    return np.asarray(fresh)


def _with_heights(repairs: Repairs, fixes: Fixes, sigma: float | None) -> Fixes:
    """Leave out fixes whose height no skier reaches; at the ends, over a short gap, the heights are extended."""
    time, height = fixes.columns["time_s"], fixes.columns["altitude_m"]
    noise = np.maximum(1.5 * _NOISE * _sigma(fixes, sigma), _HEIGHT_NOISE)
    right = reachable_records(time, height[:, None], _FASTEST_DOWN, noise)
    words = "height(s) that no skier reaches from the others"
    repairs.add_at(words, ~right, fixes.places, done="not used", fix="correct altitude_m, or export it again")
    if np.all(right):
        return fixes
    known = np.flatnonzero(right)
    reach = max(SHORT_GAP, 3.25 * float(np.median(np.diff(time))))  # as gaps are bridged
    extended = height.copy()
    kept = right.copy()
    for end, near in ((slice(0, known[0]), known[:1]), (slice(known[-1] + 1, None), known[-1:])):
        around = known[np.abs(time[known] - time[near]) <= 2.0 * reach]
        if np.all(np.abs(time[end] - time[near]) <= reach) and len(around) > 2:
            middle = float(time[near[0]])
            line = np.polynomial.polynomial.polyfit(time[around] - middle, height[around], 1)
            extended[end] = np.polynomial.polynomial.polyval(time[end] - middle, line)
            kept[end] = True
    return _keep(replace(fixes, columns=fixes.columns | {"altitude_m": extended}), kept)


def _with_velocity(repairs: Repairs, fixes: Fixes) -> Fixes:
    """Complete speed and course: near known values between these, else from the track; or leave them out."""
    columns = dict(fixes.columns)
    time = columns["time_s"]
    before, after = (np.clip(time + shift, time[0], time[-1]) for shift in (-SHORT_GAP, SHORT_GAP))
    flat = _flat(fixes)
    moved = np.stack([np.interp(after, time, axis) - np.interp(before, time, axis) for axis in flat.T], axis=1)
    velocity = moved / np.maximum(after - before, 1e-9)[:, None]
    track = {
        "speed_mps": np.linalg.norm(velocity, axis=1),
        "course_deg": np.degrees(np.arctan2(velocity[:, 1], velocity[:, 0])) % 360.0,
    }
    for name, estimate in track.items():
        if name not in columns:
            continue
        known = _known(name, columns[name])
        if np.all(known):
            continue
        still = track["speed_mps"] < _STANDING if name == "course_deg" else np.zeros(len(time), bool)
        near = _near(time, known) | still
        far = ~known & ~near
        if not np.any(known) or np.mean(far) > _MOSTLY:
            done = "found, the column is left out"
            repairs.add_at(f"fix(es) without {name}", ~known, fixes.places, done=done, most=1.0)
            del columns[name]
            continue
        values = np.where(far, estimate, columns[name])
        given = known | far
        if name == "course_deg":
            values[given] = np.unwrap(values[given], period=360.0)
        columns[name] = np.interp(time, time[given], values[given])
        if name == "course_deg":
            columns[name] %= 360.0
        done = "completed from the others and the track"
        repairs.add_at(f"fix(es) without {name}", ~known, fixes.places, done=done, most=1.0)
    return replace(fixes, columns=columns)


def _known(name: str, values: Array) -> Mask:
    """Return which values are not marks for "unknown"; many that are out of bounds are another unit, judged later."""
    finite = np.isfinite(values)
    if name == "speed_mps":
        odd = finite & ((values < 0.0) | (values > FASTEST))
        return finite & ~odd if np.mean(odd & (values > 0.0)) <= _MOSTLY else finite & (values >= 0.0)
    signed = np.any(finite & (values < 0.0) & (values != -1.0) & (values >= -360.0))
    odd = finite & (np.abs(values) > 360.0)
    unknown = odd if np.mean(odd) <= _MOSTLY else np.zeros(len(values), bool)
    return np.asarray(finite & ~unknown & (signed | (values != -1.0)))


def _near(time: Array, known: Mask) -> Mask:
    """Return which times lie within ``SHORT_GAP`` of a known value, or between two neighbours of a slow receiver."""
    if not np.any(known):
        return np.zeros(len(time), bool)
    reach = max(SHORT_GAP, 1.25 * float(np.median(np.diff(time))) if len(time) > 1 else 0.0)
    at = time[known]
    right = np.clip(np.searchsorted(at, time), 0, len(at) - 1)
    left = np.clip(right - 1, 0, len(at) - 1)
    return np.asarray(np.minimum(np.abs(at[left] - time), np.abs(at[right] - time)) <= reach)
