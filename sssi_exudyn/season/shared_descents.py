"""Every descent of a season that was skied again, its runs compared together."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Final

import numpy as np
import pandas as pd

from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.noise import ExponentialNoise
from sssi_exudyn.season.joint_friction import JointFriction, compare_runs
from sssi_exudyn.season.places import local
from sssi_exudyn.season.stretches import Descent, passages_of

MOST_RUNS: Final = 40
"""Maximum number of runs of a descent that are compared, the last ones: computing grows with their square."""
_COARSE: Final = 3.0
"""s between fixes from which on a track does not show speeds at places: a skier is 30 m farther on."""


def compare_descents(table: pd.DataFrame, tracks: Mapping[str, pd.DataFrame]) -> tuple[JointFriction, ...]:
    """Return the comparison of each descent that has two tracks with fixes dense enough.

    Parameters
    ----------
    table : the season's table, with ``place``;  tracks : with the columns ``TRACK``, by run
    """
    compared = []
    for place, rows in table[table["place"] != ""].groupby("place", sort=True):
        dense = [run for run in rows["run"] if run in tracks and np.median(np.diff(tracks[run]["time_s"])) <= _COARSE][
            -MOST_RUNS:
        ]
        if len(dense) < 2:
            continue
        skiers = dict(zip(rows["run"], rows["skier"], strict=True))
        flat = local([tracks[run][["latitude_deg", "longitude_deg"]].to_numpy(dtype=float) for run in dense])
        runs = [_descent(tracks[run], path, skiers[run]) for run, path in zip(dense, flat, strict=True)]
        places, passages = passages_of(runs)
        if passages:
            left_out = tuple(run for run in rows["run"] if run not in dense)
            compared.append(replace(compare_runs(str(place), dense, places, passages), left_out=left_out))
    return tuple(compared)


def _descent(track: pd.DataFrame, flat: Array, skier: str) -> Descent:
    columns = {name: track[name].to_numpy(dtype=float) for name in track}
    known = {name: float(column[0]) for name, column in columns.items()}
    return Descent(
        time=columns["time_s"],
        flat=flat,
        height=columns["altitude_m"],
        speed=columns["speed_mps"],
        sigma=known["sigma_m"],
        speed_sigma=known["speed_sigma_mps"],
        height_sigma=known["height_sigma_m"],
        wander=ExponentialNoise(known["wander_m"], known["wander_s"]),
        drag=known["drag_per_m"],
        skier=skier,
    )
