"""The part of the boots' cuffs in the ankles' moments of a run: columns of the series, and figures."""

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
"""Least samples of a run that has figures."""


@dataclass(frozen=True)
class AnkleFigures:
    """One ankle and its boot.

    lean_deg : captured dorsiflexion at which the cuff presses neither way
    moment_rms_Nm, moment_peak_Nm : of dorsiflexion, by inverse dynamics: cuff and muscles together
    cuff_rms_Nm, cuff_peak_Nm : the cuff's part;  muscles_rms_Nm : the muscles' part
    edging_rms_Nm, edging_peak_Nm : the cuff's moment about the foot's long axis
    edging_give_rms_deg : angle by which boot and ankle give way to it
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
    """The boots: their places on the skis, their cuffs, and the cuffs' loads.

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
    """Return the name of the column with a cuff's moment in ``flexion`` or ``edging``."""
    return f"{side}_cuff_{axis}_Nm"


def add_cuffs(series: pd.DataFrame, result: SimulationResult, model: Model) -> tuple[pd.DataFrame, BootFigures | None]:
    """Add columns of the cuffs' moments to a run's series, and return them with figures of its boots.

    A run that stopped at once has neither.

    ``…_cuff_flexion_Nm`` has the sign of the ankle's own moment, up is positive; the shank gets the opposite.
    ``…_cuff_edging_Nm`` is about the foot's long axis forwards, on the foot.
    """
    if len(result.time) < _LEAST:
        return series, None
    equipment, columns = model.equipment, {}
    angle = result.coordinates[:, [result.coordinate_names.index(name) for name in _ANKLES]]
    moment = result.joint_moments[:, [result.moment_names.index(name) for name in _ANKLES]]
    cuffs = find_cuffs(result.time, angle, moment, model.skier.mass, equipment.cuff_flexion, equipment.cuff_lean)
    flexion = cuffs.moment(angle)
    edging = None if result.ankle_edging is None else edging_share(equipment.cuff_edging) * result.ankle_edging
    ankles = {}
    for k, side in enumerate(SIDES):
        columns[cuff_column(side, "flexion")] = flexion[:, k]
        if edging is not None:
            columns[cuff_column(side, "edging")] = edging[:, k]
        ankles[side] = AnkleFigures(
            lean_deg=float(np.degrees(cuffs.lean[k])),
            moment_rms_Nm=_rms(moment[:, k]),
            moment_peak_Nm=_peak(moment[:, k]),
            cuff_rms_Nm=_rms(flexion[:, k]),
            cuff_peak_Nm=_peak(flexion[:, k]),
            muscles_rms_Nm=_rms(moment[:, k] - flexion[:, k]),
            edging_rms_Nm=None if edging is None else _rms(edging[:, k]),
            edging_peak_Nm=None if edging is None else _peak(edging[:, k]),
            edging_give_rms_deg=None if edging is None else _give(edging[:, k], equipment.cuff_edging),
        )
    per_degree = float(np.radians(1.0))
    figures = BootFigures(
        centre_m=equipment.boot_centre,
        ramp_angle_deg=float(np.degrees(equipment.ramp_angle)),
        flexion_Nm_per_deg=cuffs.stiffness * per_degree,
        flexion_se_Nm_per_deg=cuffs.se * per_degree if equipment.cuff_flexion is None else None,
        lean_stated=equipment.cuff_lean is not None,
        edging_Nm_per_deg=equipment.cuff_edging * per_degree,
        ankles=ankles,
    )
    return pd.concat([series, pd.DataFrame(columns, index=series.index)], axis=1), figures


def _give(cuff: Array, stiffness: float) -> float:
    return float(np.degrees(_rms(cuff) / stiffness))


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _peak(values: Array) -> float:
    """Return the value of largest size, with its sign."""
    return float(values[np.argmax(np.abs(values))])
