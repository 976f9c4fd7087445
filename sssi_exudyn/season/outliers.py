"""What stands out: runs far from the others of the same descent, or else of the same day."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np
import pandas as pd

FAR: Final = 3.5
"""Robust standard deviations from the median beyond which a run stands out (Iglewicz and Hoaglin 1993)."""
FEWEST: Final = 5
"""Runs of which a median and a spread are stated; of four, one run that differs decides the spread."""
_NORMAL: Final = 1.4826
"""Standard deviation of a normal distribution over its median absolute deviation."""
WATCHED: Final = {
    "mean_speed_mps": ("mean speed", "m/s", 0.3),
    "top_speed_mps": ("top speed", "m/s", 0.5),
    "vertical_m": ("vertical", "m", 5.0),
    "length_m": ("length", "m", 10.0),
    "turns": ("turns", "", 1.0),
    "effective_friction": ("effective friction", "", 0.005),
    "energy_lost_a_turn_J_per_kg": ("energy lost in a turn", "J/kg", 3.0),
    "track_error_m": ("track error", "m", 0.3),
}
"""Words, unit, and least spread of each figure: what instruments leave uncertain is no difference between runs."""


def add_outliers(table: pd.DataFrame) -> pd.DataFrame:
    """Return the table of runs with what stands out of each in words, in the column ``stands_out``."""
    said: dict[int, list[str]] = {}
    for rows, among in _groups(table):
        for name, (words, unit, least) in WATCHED.items():
            values = table.loc[rows, name].to_numpy(dtype=float)
            known = np.isfinite(values)
            if np.count_nonzero(known) < FEWEST:
                continue
            middle = float(np.median(values[known]))
            spread = max(_NORMAL * float(np.median(np.abs(values[known] - middle))), least)
            for row, value in zip(rows, values, strict=True):
                if np.isfinite(value) and abs(value - middle) > FAR * spread:
                    shown = f"{_figure(value)} {unit}".strip()
                    said.setdefault(row, []).append(
                        f"{words} {shown}, {among} {_figure(middle)} ({(value - middle) / spread:+.0f} robust sd)"
                    )
    return table.assign(stands_out=["; ".join(said.get(row, [])) for row in table.index])


def _groups(table: pd.DataFrame) -> Iterator[tuple[list[int], str]]:
    """Yield the rows that are compared, and what their median is called."""
    by_place = table["place"].where(table["place"] != "").map(table["place"].value_counts()) >= FEWEST
    for place, rows in table[by_place].groupby("place", sort=True):
        yield list(rows.index), f"median of descent {place}"
    others = table[~by_place]
    for day, rows in others.groupby("day", sort=True):
        yield list(rows.index), f"median of {day!s}" if day else "median of runs without a date"


def _figure(value: float) -> str:
    return f"{value:.3f}" if abs(value) < 1.0 else f"{value:.1f}"
