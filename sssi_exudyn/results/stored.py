"""One result for a report: its figures, its series, its model, and the measurements."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import cast

import numpy as np
import pandas as pd

from sssi_exudyn.analysis.biomechanics import WHOLE
from sssi_exudyn.analysis.turns import LEAST_SAMPLES, Stretch, StretchKind, Turn, Turns, find_turns
from sssi_exudyn.bodies.skier.chain import Geometry, geometry_from_dict
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.frames import Array, slope_to_enu
from sssi_exudyn.core.text import one_line
from sssi_exudyn.model.model import Model
from sssi_exudyn.model.toml import read_model
from sssi_exudyn.results.folder import (
    DRAWS,
    MEASURED,
    MODEL,
    SECOND_HALF,
    SKELETON,
    TURNS,
    read_diagnosis,
    read_series,
    read_skeleton,
    read_summary,
    read_table,
)
from sssi_exudyn.results.summary import Summary
from sssi_exudyn.validation.diagnosis.diagnosis_data import Diagnosis


@dataclass(frozen=True, repr=False)
class StoredRun:
    """One result.

    summary : all figures, as in ``summary.json``
    series : the time series, as in ``series.parquet``
    model : the simulated model
    measured : measurements of the instruments (``measured_table``); None where there were none
    geometry : the skeleton's lengths; None for a result without them, which then has no replay
    turn_table : one row a turn and phase (``biomechanics``); None for a result without it
    second_half : measured and predicted speed (``results.posture``); None except for a recording of few sensors
    diagnosis : result of a diagnosis; None where none was made
    draws : draws from the uncertainty of an estimate (``results.draws``); None where nothing was estimated
    """

    summary: Summary
    series: pd.DataFrame
    model: Model
    measured: pd.DataFrame | None = None
    geometry: Geometry | None = None
    turn_table: pd.DataFrame | None = None
    second_half: pd.DataFrame | None = None
    diagnosis: Diagnosis | None = None
    draws: pd.DataFrame | None = None

    def __repr__(self) -> str:
        return f"<StoredRun {self.name}: {len(self.series)} samples>"

    @property
    def name(self) -> str:
        """Name of the recording."""
        return one_line(self.summary.recording or "a recording")

    @cached_property
    def time(self) -> Array:
        """Instants (n,) s."""
        return self.series["time_s"].to_numpy(dtype=float)

    @cached_property
    def com(self) -> Array:
        """Centre of mass (n, 3) m in the slope frame."""
        return self.slope("com", "m")

    @cached_property
    def turns(self) -> Turns:
        """Turns of the table; without one, those of the centre of mass, none where the run stopped at once."""
        table = self.turn_table
        if table is None or table.empty:
            return find_turns(self.time, self.com) if len(self.time) >= LEAST_SAMPLES else Turns((), ())
        columns = table.loc[table["phase"] == WHOLE, ["side", "start_s", "end_s", "complete"]]
        turns = (Turn(side, float(a), float(b), bool(c)) for side, a, b, c in columns.itertuples(index=False))
        stretches = self.summary.turns.stretches or ()
        kinds = (cast(StretchKind, part.kind) for part in stretches)
        return Turns(
            tuple(turns),
            tuple(Stretch(kind, part.start_s, part.end_s) for kind, part in zip(kinds, stretches, strict=True)),
        )

    def slope(self, name: str, unit: str) -> Array:
        """Return the vector (n, 3) of that name in the slope frame, in its columns' unit."""
        columns = [f"{name}_{axis}_{unit}" for axis in ("east", "north", "up")]
        turned = slope_to_enu(self.model.inclination, self.model.fall_line_azimuth)
        return self.series[columns].to_numpy(dtype=float) @ turned

    def snow_force(self, side: str) -> Array:
        """Return (n, 3) N, the snow's whole force on the ``left`` or ``right`` ski in the slope frame.

        An older result lacks its columns: there it is the load along the snow's normal under the foot, and friction.
        """
        if f"{side}_snow_force_up_N" in self.series:
            return self.slope(f"{side}_snow_force", "N")
        load = self.series[f"{side}_load_N"].to_numpy(dtype=float)
        _, rising = self.model.snow(self.slope(f"{side}_foot", "m"))
        normal = np.column_stack([-rising, np.ones(len(load))])
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        return np.asarray(load[:, None] * normal + self.slope(f"{side}_friction", "N"))


def read_run(folder: Path) -> StoredRun:
    """Read the result in a folder.  Raises InputError where there is none or it cannot be read."""
    summary = read_summary(folder)
    skeleton = read_skeleton(folder)
    try:
        geometry = None if skeleton is None else geometry_from_dict(skeleton)
    except ValueError as error:
        raise InputError(folder / SKELETON, "", str(error), "run again") from error
    return StoredRun(
        summary=summary,
        series=read_series(folder),
        model=read_model(folder / MODEL),
        measured=read_table(folder, MEASURED),
        geometry=geometry,
        turn_table=read_table(folder, TURNS[1]),
        second_half=read_table(folder, SECOND_HALF),
        draws=read_table(folder, DRAWS),
        diagnosis=read_diagnosis(folder),
    )
