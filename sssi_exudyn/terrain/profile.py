"""A snow surface along a path: height, its band, and the steepness of the snow."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sssi_exudyn.core.frames import GRAVITY, Array, gravity_in_slope
from sssi_exudyn.terrain.surface import Surface


@dataclass(frozen=True)
class Profile:
    """The surface at n places of a path.

    distance : (n,) m along the path, over the slope's plane;  height : (n,) m over the plane
    band : (n,) m, standard deviation of the height, relative to its mean along the path
    inclination : (n,) rad of the snow against the horizontal
    """

    distance: Array
    height: Array
    band: Array
    inclination: Array


@dataclass(frozen=True)
class SurfaceFigures:
    """The snow surface along the path, from the heights of ``runs`` runs.

    The figures are heights over the slope's plane, their standard deviation (median), and the inclination of the snow.
    """

    lowest_m: float
    highest_m: float
    band_m: float
    inclination_least_deg: float
    inclination_most_deg: float
    modes: int
    runs: int = 1


def profile_along(surface: Surface, places: Array, inclination: float) -> Profile:
    """Return the surface at ``places`` (n, ≥ 2) m in the slope frame, on a plane of that inclination (rad)."""
    path = np.asarray(places[:, :2], dtype=np.float64)
    patch = surface.at(path)
    up = -gravity_in_slope(inclination) / GRAVITY
    normal = np.column_stack([-patch[:, 1:3], np.ones(len(path))])
    cosine = normal @ up / np.linalg.norm(normal, axis=1)
    return Profile(
        distance=np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))]),
        height=patch[:, 0],
        band=surface.deviation_at(path),
        inclination=np.arccos(np.clip(cosine, -1.0, 1.0)),
    )


def surface_figures(surface: Surface, places: Array, inclination: float, runs: int) -> SurfaceFigures:
    """Return the figures of ``profile_along`` for a surface from the heights of so many runs."""
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
