"""What a result's folder holds of a run: put together from the run and its fit, and written."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from sssi_exudyn.analysis.biomechanics import biomechanics, label_turns, residual_moment, turn_figures
from sssi_exudyn.analysis.boots import add_cuffs
from sssi_exudyn.analysis.losses import loss_figures
from sssi_exudyn.analysis.skiing import recorded_turns
from sssi_exudyn.analysis.turn_style import add_styles, style_of
from sssi_exudyn.contact.registry import is_carved
from sssi_exudyn.core.frames import Array, slope_to_enu
from sssi_exudyn.fitting.few_sensors.path_balance import PathEstimate
from sssi_exudyn.fitting.first_fit import Fitted
from sssi_exudyn.fitting.observations import correct_fixes
from sssi_exudyn.io.writing import to_plain
from sssi_exudyn.model.model import Model
from sssi_exudyn.motion.from_recording import round_trip_table
from sssi_exudyn.motion.motion import Motion
from sssi_exudyn.recording.recording import Recording
from sssi_exudyn.reports.report import write_run
from sssi_exudyn.results.carving import carving_figures
from sssi_exudyn.results.measured import measured_table
from sssi_exudyn.results.opensim import opensim_texts
from sssi_exudyn.results.stored import StoredRun
from sssi_exudyn.results.summary import (
    DiagnosisResult,
    Energy,
    Estimate,
    Fit,
    Friction,
    Posture,
    ResidualNoise,
    UncertaintyFigures,
    summary_from_dict,
)
from sssi_exudyn.runtime.plugins import origins_of
from sssi_exudyn.runtime.provenance import provenance
from sssi_exudyn.simulation.assembly import Parts
from sssi_exudyn.simulation.result import SimulationResult
from sssi_exudyn.terrain.profile import surface_figures
from sssi_exudyn.validation.agreement import judge_loads, judge_track
from sssi_exudyn.validation.diagnosis.diagnosis_data import Diagnosis


@dataclass(frozen=True)
class Made:
    """A run as a result's folder holds it.

    opensim : the texts of its files for OpenSim, by name
    """

    run: StoredRun
    opensim: Mapping[str, str]


@dataclass(frozen=True)
class Outcome:
    """What a result holds in addition to its run.

    settings : what the user chose
    fit : how the fit ended, with the fitted parameters
    posture, second_half : of a recording of few sensors (``results.posture``)
    uncertainty, draws : what the fit leaves uncertain, and draws from it (``results.draws``)
    diagnosis : what a diagnosis found
    diverged : why the simulation stopped before the end
    missed : why a fit of friction alone has no standard errors; "" where it has
    path : the balance along the path of few sensors
    unconfirmed : why the simulated run does not confirm that balance; "" where it does
    notes : what a reader should know of the fit
    """

    settings: Mapping[str, Any]
    fit: Fit = field(default_factory=Fit)
    posture: Posture | None = None
    second_half: pd.DataFrame | None = None
    uncertainty: UncertaintyFigures | None = None
    draws: pd.DataFrame | None = None
    diagnosis: Diagnosis | None = None
    diverged: str | None = None
    missed: str = ""
    path: PathEstimate | None = None
    unconfirmed: str = ""
    notes: tuple[str, ...] = ()

    @property
    def believable_fit(self) -> Fit:
        """Return how the fit ended, without standard errors where its residuals contradict them."""
        withheld = self.missed if self.uncertainty is None else self.uncertainty.withheld
        if not withheld:
            return self.fit
        parameters = {name: replace(estimate, se=None) for name, estimate in (self.fit.parameters or {}).items()}
        return replace(self.fit, parameters=parameters)

    @property
    def doubts(self) -> tuple[str, ...]:
        """Return what the fit says against its own results, in sentences."""
        ended = () if self.fit.converged is not False else (f"the fit did not converge: {self.fit.reason}",)
        said = tuple(doubt for doubt in (self.missed, self.unconfirmed) if doubt)
        return (*ended, *said, *(() if self.uncertainty is None else self.uncertainty.doubts))


def write_outcome(
    out: Path | None, recording: Recording, motion: Motion, model: Model, result: SimulationResult, outcome: Outcome
) -> Made:
    """Put together all that a result's folder holds of a run, and write it into ``out`` if given."""
    result = result.shift(_height_of_track(recording, result))
    series = result.to_frame(slope_to_enu(model.inclination, model.fall_line_azimuth))
    turns = recorded_turns(recording, float(result.time[0]), float(result.time[-1]))
    technique = biomechanics(result, model.skier.mass, model.inclination, turns)
    if outcome.path is not None and not technique.table.empty:
        technique = replace(technique, table=add_styles(technique.table, outcome.path))
    series, boots = label_turns(series, technique.turns), None
    if recording.completed is None:  # ankles that are assumed tell nothing of boots
        series, boots = add_cuffs(series, result, model)
    gps = recording.gps and correct_fixes(recording.gps, model)
    diagnosis, ended = outcome.diagnosis, outcome.believable_fit
    summary = summary_from_dict(
        {
            "recording": recording.name,
            "friction": _friction(model, ended),
            "carving": carving_figures(model, result, ended.parameters or {}),
            "trajectory": judge_track(series, gps),
            "pressure_ratio": judge_loads(series, recording.insoles),
            "fit": ended,
            "solver": {"simulated_s": float(np.ptp(result.time)), **result.statistics},
            "energy": Energy(
                result.closure_percent, {name: float(work[-1] - work[0]) for name, work in result.energy.items()}
            ),
            "turns": turn_figures(technique),
            "losses": loss_figures(
                result,
                technique.table,
                model.inclination,
                None if is_carved(model.terms) else model.value("friction.mu_n"),
            ),
            "residual_moment": residual_moment(result),
            "provenance": provenance(recording.hashes, {**outcome.settings, **_plugins_of(model)}, seed=0),
            "capture": {"round_trip": round_trip_table(motion)},
            "diverged": outcome.diverged,
            "posture": outcome.posture,
            "uncertainty": outcome.uncertainty,
            "diagnosis": diagnosis and DiagnosisResult(diagnosis.verdict, diagnosis.sentence),
            "notices": (*outcome.doubts, *outcome.notes, *recording.notices),
            "boots": boots,
            "technique": outcome.path and style_of(outcome.path),
            "surface": model.surface
            and surface_figures(
                model.surface, result.foot_position.mean(axis=1), model.inclination, 1 + len(recording.runs)
            ),
        }
    )
    measured = measured_table(gps, recording.insoles)
    table = None if technique.table.empty else technique.table  # a run too short for a turn has a table without columns
    run = StoredRun(
        summary, series, model, measured, motion.geometry, table, outcome.second_half, diagnosis, outcome.draws
    )
    made = Made(run, opensim_texts(result, Parts(model, motion)))
    if out is not None:
        write_run(out, run, made.opensim)
    return made


def _plugins_of(model: Model) -> dict[str, Any]:
    """Return the plug-ins that a model's laws come from, for the result's origin; nothing where there are none."""
    plugins = [plugin.as_table() for plugin in origins_of(type(term) for term in model.terms)]
    return {"plugins": plugins} if plugins else {}


def _height_of_track(recording: Recording, result: SimulationResult) -> Array:
    """Return (3,) m along the slope's normal: heights count from the antenna's at the start, as in the fit.

    See ``predict_fixes``.
    """
    if recording.gps is None or result.antenna is None:
        return np.zeros(3)
    return np.array([0.0, 0.0, -result.antenna[0, 2]])


def _friction(model: Model, fit: Fit) -> Friction:
    if is_carved(model.terms):
        return Friction()
    fitted = fit.parameters or {}

    def estimate(name: str) -> Estimate:
        return Estimate(model.value(f"friction.{name}"), fitted.get(f"friction.{name}", Estimate()).se)

    return Friction(estimate("mu_t"), estimate("mu_n"))


def fit_figures(fitted: Fitted) -> Fit:
    """Return the ``fit`` group of a summary."""
    return Fit(
        method=fitted.method,
        converged=fitted.optimum.converged,
        reason=fitted.optimum.reason,
        evaluations=fitted.optimum.evaluations,
        evaluations_reduced=fitted.reduced.evaluations,
        wall_s=fitted.wall,
        parameters={
            name: Estimate(float(value), float(se))
            for name, value, se in zip(fitted.names, fitted.values, fitted.standard_errors, strict=True)
        },
        correlation=tuple(tuple(row) for row in to_plain(fitted.correlation)),
        residual_noise=ResidualNoise(fitted.noise.sigma, fitted.noise.correlation_time),
    )
