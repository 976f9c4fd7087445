"""Figures of a run on snow that edges cut."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from sssi_exudyn.analysis.biomechanics import residual_moment_vector
from sssi_exudyn.core.frames import Array, slope_to_level
from sssi_exudyn.model.model import Model
from sssi_exudyn.results.summary import CarvingFigures, Estimate
from sssi_exudyn.simulation.result import SimulationResult

_FEW = 5.0
"""% of the run in which the side reserve is less than the given least."""

_SLOW = 0.1
"""m/s below which a skier has no direction of travel."""


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def carving_figures(model: Model, result: SimulationResult, fitted: Mapping[str, Estimate]) -> CarvingFigures | None:
    """Compute the figures of a run; None for a run by the paper's law."""
    edges = result.edges
    if edges is None:
        return None

    def number(name: str) -> Estimate:
        return Estimate(model.value(f"carving.{name}"), fitted.get(f"carving.{name}", Estimate()).se)

    load = max(float(result.foot_load.sum()), 1.0)
    outer = np.argmax(result.foot_load, axis=1)
    reserve = edges.side_reserve[np.arange(len(outer)), outer]
    residual = residual_moment_vector(result)
    course = (result.com_velocity @ slope_to_level(model.inclination).T)[:, :2]
    course = course / np.maximum(np.linalg.norm(course, axis=1, keepdims=True), _SLOW)
    return CarvingFigures(
        tier="full",
        mu=number("mu"),
        hardness_N_m3=number("hardness"),
        strength_Pa=number("strength"),
        equivalent_mu_t=float(edges.along.sum()) / load,
        equivalent_mu_n=float(edges.across.sum()) / load,
        side_reserve_mean=float(reserve.mean()),
        side_reserve_least=float(np.percentile(reserve, _FEW)),
        ski_yaw_rms_deg=float(np.degrees(_rms(edges.yaw))),
        ski_roll_rms_deg=float(np.degrees(_rms(edges.roll))),
        ski_heave_rms_m=_rms(edges.heave),
        ski_pitch_rms_deg=float(np.degrees(_rms(edges.pitch))),
        heading=model.heading.mode,
        heading_rms_deg=float(np.degrees(_rms(edges.heading))),
        yaw_residual_rms_Nm=_rms(residual[:, 2]),
        roll_residual_rms_Nm=_rms(np.sum(residual[:, :2] * course, axis=1)),
    )
