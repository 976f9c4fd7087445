"""What the boots' cuffs take of the ankles' moments in a run: columns of the series, and figures."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
import pandas as pd

from sssi_exudyn.bodies.skier.boot import edging_share, find_cuffs
from sssi_exudyn.core.frames import Array
from sssi_exudyn.model.model import Model
from sssi_exudyn.simulation.result import SIDES, SimulationResult

_ANKLES: Final = ("ankle_angle_l", "ankle_angle_r")
_LEAST: Final = 2
"""Samples of a run that has figures."""


@dataclass(frozen=True)
class AnkleFigures:
    """One ankle and its boot.

    lean_deg : captured dorsiflexion at which the cuff presses neither way
    moment_rms_Nm, moment_peak_Nm : of dorsiflexion, by inverse dynamics: cuff and muscles together
    cuff_rms_Nm, cuff_peak_Nm : the cuff's part;  muscles_rms_Nm : what is left to the muscles
    edging_rms_Nm, edging_peak_Nm : the cuff's moment about the foot's long axis
    edging_give_rms_deg : by which boot and ankle give way to it
    """

    lean_deg: float | None = None
    moment_rms_Nm: float | None = None
    moment_peak_Nm: float | None = None
    cuff_rms_Nm: float | None = None
    cuff_peak_Nm: float | None = None
    muscles_rms_Nm: float | None = None
    edging_rms_Nm: float | None = None
    edging_peak_Nm: float | None = None
    edging_give_rms_deg: float | None = None


@dataclass(frozen=True)
class BootFigures:
    """The boots: where they are on the skis, their cuffs, and what these bear.

    flexion_se_Nm_per_deg : standard error of the cuffs' stiffness; null where it was stated
    lean_stated : whether the recording states the cuffs' lean
    ankles : by side
    """

    centre_m: float | None = None
    ramp_angle_deg: float | None = None
    flexion_Nm_per_deg: float | None = None
    flexion_se_Nm_per_deg: float | None = None
    lean_stated: bool = False
    edging_Nm_per_deg: float | None = None
    ankles: Mapping[str, AnkleFigures] | None = None


def cuff_column(side: str, axis: str) -> str:
    """Name of the column with a cuff's moment in ``flexion`` or ``edging``."""
    return f"{side}_cuff_{axis}_Nm"


def add_cuffs(series: pd.DataFrame, result: SimulationResult, model: Model) -> tuple[pd.DataFrame, BootFigures | None]:
    """The series of a run with columns of its cuffs' moments, and figures of its boots; without for a run that stopped
    at once.

    ``…_cuff_flexion_Nm`` has the sign of the ankle's own moment, up is positive; the shank gets the opposite.
    ``…_cuff_edging_Nm`` is about the foot's long axis forwards, on the foot.
    """
    if len(result.time) < _LEAST:
        return series, None
    gear, columns = model.equipment, {}
    angle = result.coordinates[:, [result.coordinate_names.index(name) for name in _ANKLES]]
    moment = result.joint_moments[:, [result.moment_names.index(name) for name in _ANKLES]]
    found = find_cuffs(result.time, angle, moment, model.skier.mass, gear.cuff_flexion, gear.cuff_lean)
    flexion = found.moment(angle)
    edging = None if result.ankle_edging is None else edging_share(gear.cuff_edging) * result.ankle_edging
    ankles = {}
    for k, side in enumerate(SIDES):
        columns[cuff_column(side, "flexion")] = flexion[:, k]
        if edging is not None:
            columns[cuff_column(side, "edging")] = edging[:, k]
        ankles[side] = AnkleFigures(
            lean_deg=float(np.degrees(found.lean[k])),
            moment_rms_Nm=_rms(moment[:, k]),
            moment_peak_Nm=_peak(moment[:, k]),
            cuff_rms_Nm=_rms(flexion[:, k]),
            cuff_peak_Nm=_peak(flexion[:, k]),
            muscles_rms_Nm=_rms(moment[:, k] - flexion[:, k]),
            edging_rms_Nm=None if edging is None else _rms(edging[:, k]),
            edging_peak_Nm=None if edging is None else _peak(edging[:, k]),
            edging_give_rms_deg=None if edging is None else _give(edging[:, k], gear.cuff_edging),
        )
    per_degree = float(np.radians(1.0))
    figures = BootFigures(
        centre_m=gear.boot_centre,
        ramp_angle_deg=float(np.degrees(gear.ramp_angle)),
        flexion_Nm_per_deg=found.stiffness * per_degree,
        flexion_se_Nm_per_deg=found.se * per_degree if gear.cuff_flexion is None else None,
        lean_stated=gear.cuff_lean is not None,
        edging_Nm_per_deg=gear.cuff_edging * per_degree,
        ankles=ankles,
    )
    return pd.concat([series, pd.DataFrame(columns, index=series.index)], axis=1), figures


def _give(cuff: Array, stiffness: float) -> float:
    return float(np.degrees(_rms(cuff) / stiffness))


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _peak(values: Array) -> float:
    """The value that is largest, with its sign."""
    return float(values[np.argmax(np.abs(values))])
