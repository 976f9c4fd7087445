"""Checks of instruments and settings against each other: an error in one of them shows in another.

A fault that makes a simulation meaningless raises InputError; an oddity gives a notice.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from sssi_exudyn.core.errors import InputError, SssiError
from sssi_exudyn.core.frames import GRAVITY
from sssi_exudyn.recording.instruments.bvh import Bvh
from sssi_exudyn.recording.instruments.gps import Gps
from sssi_exudyn.recording.instruments.insoles import Insoles
from sssi_exudyn.recording.slope_and_heading import (
    Estimate,
    SlopeEstimate,
    estimate_heading,
    estimate_slope,
    ski_direction_misfits,
    stance_at_fixes,
    track_of_skis,
)

_LEG_SHARE: Final = 0.495
"""Length of thigh and shank over body height, (0.4222 + 0.4403) m of 1.741 m: de Leva (1996), men."""
_LENGTH_UNITS: Final = {"metres": 0.01, "millimetres": 10.0, "inches": 1.0 / 2.54, "feet": 1.0 / 30.48}
"""Factors by which lengths are wrong when they are written in another unit than centimetres."""
_FEET: Final = 1.0 / 0.3048


@dataclass(frozen=True)
class SlopeAndHeading:
    """Heading and slope as estimated from motion and fixes; None where no estimate is possible, with the reason."""

    heading: Estimate | None
    slope: SlopeEstimate | None
    why_not: tuple[str, ...] = ()


def estimate_slope_and_heading(
    bvh: Bvh, gps: Gps, ankle_to_ski_base: float, heading: float | None = None
) -> SlopeAndHeading:
    """Estimate heading and slope from motion and fixes.

    Parameters
    ----------
    ankle_to_ski_base : m, along the foot's up axis
    heading : rad, the given azimuth of the BVH +z axis; the skis' track uses it, else the estimate
    """
    stance = stance_at_fixes(bvh, gps, ankle_to_ski_base)
    if len(stance.time) < 5:
        return SlopeAndHeading(None, None, ("fewer than five fixes lie within the motion capture",))
    why_not: list[str] = []
    estimate: Estimate | None = None
    slope: SlopeEstimate | None = None
    try:
        estimate = estimate_heading(stance, gps)
    except SssiError as error:
        why_not.append(str(error))
    azimuth = heading if heading is not None else (estimate.value if estimate is not None else 0.0)
    try:
        slope = estimate_slope(track_of_skis(stance, gps, azimuth), float(np.median(gps.sigma)))
    except SssiError as error:
        why_not.append(str(error))
    return SlopeAndHeading(estimate, slope, tuple(why_not))


def check_coordinates(bvh: Bvh, gps: Gps, ankle_to_ski_base: float, path: Path) -> None:
    """Raise InputError when the skis follow the track only with latitude and longitude exchanged.

    With the two exchanged, left turns become right turns, which the turning of the skis shows.
    """
    stance = stance_at_fixes(bvh, gps, ankle_to_ski_base)
    if len(stance.time) < 5:
        return
    as_is, swapped = ski_direction_misfits(stance, gps)
    # skidding turns skis from the course, but along with it: mirrored, a true track fits three times worse, not better.
    # 0.03 is a deviation of 14°, below which a run is too straight to decide
    if as_is > 0.03 and swapped < 0.4 * as_is:
        raise InputError(
            path,
            "latitude_deg, longitude_deg",
            "the skis turn left where the track turns right: latitude and longitude look swapped",
            "swap the two columns back, or fix a lost sign",
        )


def check_heading(given: float, setting: SlopeAndHeading, path: Path) -> tuple[str, ...]:
    """Compare ``heading_deg`` (``given``, rad) with its estimate; returns notices."""
    if setting.heading is None:
        return ()
    difference, sigma = _angle_between(given, setting.heading.value), setting.heading.sigma
    estimate = f"{_deg(setting.heading.value) % 360.0:.1f} ± {_deg(sigma):.1f}"
    problem = f"heading_deg is {_deg(given):.1f}, the estimate from course and skis is {estimate}"
    if difference > max(np.deg2rad(45.0), 6.0 * sigma):  # skis across or against their own course
        raise InputError(
            path,
            "[motion] heading_deg",
            problem,
            "correct it (clockwise from north), or leave it out to have it estimated",
        )
    if difference > max(np.deg2rad(10.0), 4.0 * sigma):
        return (f"{path.name}: [motion] heading_deg: {problem}; check it, or leave it out to have it estimated",)
    return ()


def check_slope(
    inclination: float, azimuth: float, setting: SlopeAndHeading, path: Path, gps_path: Path
) -> tuple[str, ...]:
    """Compare ``[slope]`` (rad) with the plane through the track; returns notices."""
    if setting.slope is None:
        return ()
    incline, fall_line = setting.slope.inclination, setting.slope.azimuth
    if _angle_between(azimuth, fall_line.value) > max(np.deg2rad(60.0), 6.0 * fall_line.sigma):
        raise InputError(
            path,
            "[slope] fall_line_azimuth_deg",
            f"it is {_deg(azimuth):.1f}, but the track falls towards {_deg(fall_line.value) % 360.0:.1f}",
            "correct it (downhill, clockwise from north), or leave [slope] out to have it estimated",
        )
    ratio = np.tan(incline.value) / np.tan(max(inclination, 1e-3))
    if abs(ratio / _FEET - 1.0) < 0.15:  # a slope known to 15 % still distinguishes feet from metres
        raise InputError(
            gps_path,
            "column altitude_m",
            f"the track is {ratio:.2f} times as steep as [slope]: the altitude looks like feet",
            "give the altitude in metres",
        )
    notices = []
    if abs(incline.value - inclination) > max(np.deg2rad(3.0), 4.0 * incline.sigma):
        notices.append(
            f"{path.name}: [slope] inclination_deg is {_deg(inclination):.1f}, the track falls by"
            f" {_deg(incline.value):.1f} ± {_deg(incline.sigma):.1f};"
            " check it, or leave [slope] out to have it estimated"
        )
    if _angle_between(azimuth, fall_line.value) > max(np.deg2rad(10.0), 4.0 * fall_line.sigma):
        notices.append(
            f"{path.name}: [slope] fall_line_azimuth_deg is {_deg(azimuth):.1f}, the track falls towards"
            f" {_deg(fall_line.value) % 360.0:.1f} ± {_deg(fall_line.sigma):.1f}; check it"
        )
    return tuple(notices)


def check_size(bvh: Bvh, height: float, path: Path) -> None:
    """Raise InputError when the capture's legs, or any other bone, cannot belong to a skier of ``height`` m."""
    shafts = [bvh.index(side + part) for side in ("Left", "Right") for part in ("Leg", "Foot")]
    leg = 0.5 * float(np.sum(np.linalg.norm(bvh.offsets[shafts], axis=1)))
    ratio = leg / (_LEG_SHARE * height)
    # people's legs differ by 15 % of their share (three sigma); twice that leaves room for a rough skeleton
    if 0.7 < ratio < 1.3:
        bones = np.linalg.norm(bvh.offsets[1:], axis=1)
        if np.max(bones) > height:
            name = bvh.names[1 + int(np.argmax(bones))]
            problem = f"{np.max(bones):.3g} m do not fit a skier of {height:g} m"
            raise InputError(path, f"OFFSET of {name}", problem, "export the capture again")
        return
    looks = [f": lengths look like {unit}" for unit, factor in _LENGTH_UNITS.items() if 0.7 < ratio / factor < 1.3]
    raise InputError(
        path,
        "OFFSET of the legs",
        f"legs of {leg:.3g} m do not fit a skier of {height:g} m{looks[0] if looks else ''}",
        "export the capture in centimetres, or correct height_m",
    )


def check_load(insoles: Insoles, mass: float, path: Path) -> tuple[str, ...]:
    """Compare the mean force under both feet with the weight of ``mass`` kg; returns notices."""
    weights = float(np.mean(insoles.left + insoles.right)) / (mass * GRAVITY)
    # boots' cuffs carry part of the weight, never nine tenths of it; turns add less than that again
    if 0.1 < weights < 3.0:
        return ()
    return (f"{path.name}: the feet carry {weights:.2g} times the skier's weight on average; check the unit (newtons)",)


def _angle_between(one: float, other: float) -> float:
    return abs(float(np.angle(np.exp(1j * (one - other)))))


def _deg(angle: float) -> float:
    return float(np.rad2deg(angle))
