"""Cells of an elevation model under a run, in whichever file: which are needed, and the heights between them."""

from __future__ import annotations

from pathlib import Path
from typing import Final

import numpy as np

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.frames import Array

CELLS: Final = 4_000_000
"""Maximum number of cells that are read."""
_AROUND: Final = 8
"""Number of cells around the outermost place: the border's effect on the spline falls to a quarter with each cell."""
_STEEPER: Final = float(np.radians(0.1))
"""Error of a slope, rad, that steps of the heights may leave."""
_SMOOTHEST: Final = 4.0
"""Largest standard deviation of the smoothing, in cells."""
_HIGHEST: Final = 9000.0
"""Greatest height of any ground, m; feet written as metres are mostly beyond it, or steeper than any slope."""
DEGREE: Final = 111_200.0
"""Length of a degree, m."""


def window_of(path: Path, place: Array, needed: int, size: tuple[int, int], fix: str) -> tuple[Array, Array, Array]:
    """Return the places (2, n) within the model, and the first and the last but one row and column (2,) that they need.

    Parameters
    ----------
    place : (2, n) row and column, counted from the middle of the first cell; the first ``needed`` have to be covered
    size : rows and columns of the model
    fix : what to do where the model does not cover them

    Raises InputError for places that are not covered, and for more than ``CELLS`` cells.
    """
    last = np.array(size) - 1
    covered = place[:, :needed]
    if not np.all(np.isfinite(place)) or np.any(covered < 0.0) or np.any(covered > last[:, None]):
        raise InputError(path, "", "does not cover the whole run", fix)
    place = np.clip(place, 0.0, last[:, None])  # beyond the border the nearest cell's height stands
    low = np.maximum(np.floor(place.min(axis=1)).astype(int) - _AROUND, 0)
    high = np.minimum(np.ceil(place.max(axis=1)).astype(int) + _AROUND, last) + 1
    if np.prod(high - low) > CELLS:
        raise InputError(path, "", f"more than {CELLS} cells under the run", "take cells of 0.5 m or more")
    return place, low, high


def heights_between(path: Path, cells: Array, place: Array, smoothing: float) -> Array:
    """Return the heights (n,) m at places (2, n), row and column in ``cells`` (m), by a cubic spline.

    The cells are smoothed with the standard deviation ``smoothing``, in cells.  Raises InputError for heights that no
    ground has.
    """
    if np.any(np.abs(cells) > _HIGHEST):
        raise InputError(path, "band 1", f"heights beyond {_HIGHEST:.0f} m", "convert the heights to metres")
    from scipy.ndimage import gaussian_filter, map_coordinates  # here: a file that is refused waits for none of it

    cells = gaussian_filter(cells, smoothing, mode="nearest", radius=_AROUND)
    return np.asarray(map_coordinates(cells, place, order=3, mode="nearest"))


def smoothing_of_steps(step: float, cell: float) -> float:
    """Return the standard deviation, in cells, of the smoothing that takes out of heights the steps of whole numbers.

    Heights in steps of q have an error of q/√12 in each cell, and slopes of smoothed ones one of q/(√12 √(8π) s² cell).

    Parameters
    ----------
    step, cell : the step of the heights and the side of a cell, m
    """
    error = abs(step) / np.sqrt(12.0) / max(cell, 1e-9)
    return float(min(np.sqrt(error / (np.sqrt(8.0 * np.pi) * _STEEPER)), _SMOOTHEST))
