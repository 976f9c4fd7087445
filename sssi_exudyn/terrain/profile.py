"""A snow surface along a way: height, its band, and how steep the snow is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sssi_exudyn.core.frames import GRAVITY, Array, gravity_in_slope
from sssi_exudyn.terrain.surface import Surface


@dataclass(frozen=True)
class Profile:
    """The surface at n places of a way.

    distance : (n,) m along the way, over the slope's plane;  height : (n,) m over the plane
    band : (n,) m, standard deviation of the height, relative to its mean along the way
    inclination : (n,) rad of the snow against the horizontal
    """

    distance: Array
    height: Array
    band: Array
    inclination: Array


@dataclass(frozen=True)
class SurfaceFigures:
    """The snow surface along the way: heights over the slope's plane, one standard deviation of them (median), and how
    steep the snow is; of how many runs the heights are.
    """

    lowest_m: float
    highest_m: float
    band_m: float
    inclination_least_deg: float
    inclination_most_deg: float
    modes: int
    runs: int = 1


def profile_along(surface: Surface, places: Array, inclination: float) -> Profile:
    """The surface at ``places`` (n, ≥ 2) m in the slope frame, on a plane of that inclination (rad)."""
    way = np.asarray(places[:, :2], dtype=np.float64)
    patch = surface.at(way)
    up = -gravity_in_slope(inclination) / GRAVITY
    normal = np.column_stack([-patch[:, 1:3], np.ones(len(way))])
    cosine = normal @ up / np.linalg.norm(normal, axis=1)
    return Profile(
        distance=np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(way, axis=0), axis=1))]),
        height=patch[:, 0],
        band=surface.deviation_at(way),
        inclination=np.arccos(np.clip(cosine, -1.0, 1.0)),
    )


def surface_figures(surface: Surface, places: Array, inclination: float, runs: int) -> SurfaceFigures:
    """The figures of ``profile_along``, of a surface from the heights of so many runs."""
    profile = profile_along(surface, places, inclination)
    steep = np.degrees(profile.inclination)
    return SurfaceFigures(
        lowest_m=float(profile.height.min()),
        highest_m=float(profile.height.max()),
        band_m=float(np.median(profile.band)),
        inclination_least_deg=float(steep.min()),
        inclination_most_deg=float(steep.max()),
        modes=len(surface.amounts),
        runs=runs,
    )
