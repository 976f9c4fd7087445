"""Draws from the uncertainty of an estimate, kept with its result so that bands can be computed later.

A draw tells how much a posture, the skier's mass and the model's numbers differ from the estimate, all of them
together.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np
import pandas as pd

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.quantity import quantities
from sssi_exudyn.fitting.posterior import Posterior, draw_numbers
from sssi_exudyn.model.faults import Sensor
from sssi_exudyn.model.model import Model
from sssi_exudyn.results.folder import DRAW_ANGLES, DRAW_MASS, DRAWS
from sssi_exudyn.results.stored import StoredRun

COUNT: Final = 8
"""Number of draws that are kept: their standard deviation is right to a quarter."""
_GRID: Final = 0.1
"""s between the instants at which a posture is kept; its errors vary over a second and a half."""
_MOST: Final = 1.6
"""rad; larger errors are not those of a capture."""


@dataclass(frozen=True)
class Draw:
    """One draw.

    time, angles : (k,) s and (k, 28) rad to add to the estimated posture
    model : the estimated model with the drawn numbers and mass
    """

    time: Array
    angles: Array
    model: Model

    def at(self, time: Array) -> Array:
        """Return the angles (n, 28) rad that are added at ``time`` (n,) s."""
        return np.stack([np.interp(time, self.time, column) for column in self.angles.T], axis=1)


def draws_table(posterior: Posterior) -> pd.DataFrame:
    """Draw ``COUNT`` times, always the same for one estimate, and return a row a draw and instant."""
    setting, responses = posterior.setting, posterior.responses.posture
    values, sizes = draw_numbers(posterior, COUNT, np.random.default_rng(0))
    start, stop = float(responses.time[0]), float(responses.time[-1])
    grid = np.linspace(start, stop, max(2, round((stop - start) / _GRID) + 1))
    mass, sigma = setting.mass
    parts = []
    for i in range(COUNT):
        angles = responses.angles((sizes[i] - posterior.sizes)[:-1])
        table = pd.DataFrame(
            np.stack([np.interp(grid, responses.time, column) for column in angles.T], axis=1), columns=DRAW_ANGLES
        )
        table.insert(0, "time_s", grid)
        table.insert(0, "draw", i)
        numbers = {
            str(name): float(value)
            for unknown, value in zip(setting.unknowns, values[i], strict=True)
            for name in unknown.names
            if not isinstance(posterior.model.owner(name.owner), Sensor)
        }
        numbers[DRAW_MASS] = mass + float(sizes[i, -1]) * sigma
        parts.append(pd.concat([table, pd.DataFrame(numbers, index=table.index)], axis=1))
    return pd.concat(parts).sort_values(["time_s", "draw"], kind="stable", ignore_index=True)


def draws_of(run: StoredRun, folder: Path) -> tuple[Draw, ...]:
    """Return the draws of the result in ``folder``; none where it was not estimated.

    Raises InputError where they are not of its model.
    """
    if run.draws is None:
        return ()
    draws = []
    for _, table in run.draws.groupby("draw"):
        if len(table) < 2:
            raise InputError(folder / DRAWS, "", "a draw has fewer than two instants", "run again")
        time, angles = table["time_s"].to_numpy(dtype=float), table[list(DRAW_ANGLES)].to_numpy(dtype=float)
        if np.any(np.diff(time) <= 0.0) or np.max(np.abs(angles)) > _MOST:
            raise InputError(folder / DRAWS, "", "times that do not grow, or angles that are none", "run again")
        draws.append(Draw(time, angles, _drawn_model(run.model, table.iloc[0], folder / DRAWS)))
    return tuple(draws)


def _drawn_model(model: Model, row: pd.Series, path: Path) -> Model:
    about = quantities(type(model.skier))["mass"]
    mass = float(row[DRAW_MASS])
    if not about.low <= mass <= about.high:
        raise InputError(path, f"column {DRAW_MASS}", f"{mass:g} kg is no skier's mass", "run again")
    values = {str(name): float(row[name]) for name in row.index if "." in str(name)}
    for name, value in values.items():
        try:
            low, high = model.bounds(name)
        except InputError:
            raise InputError(path, f"column {name}", "the model has no such number", "run again") from None
        if not low <= value <= high:
            raise InputError(path, f"column {name}", f"{value:g} is outside {low:g} to {high:g}", "run again")
    return replace(model.with_values(values), skier=replace(model.skier, mass=mass))
