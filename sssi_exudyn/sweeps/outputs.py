"""The figures of a run of a sweep: one number each, its unit in its name."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
import pandas as pd

from sssi_exudyn.bodies.skier.chain import PRESCRIBED
from sssi_exudyn.core.choices import Method
from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.number_ref import FRICTION, HEADING_OFFSET, MU_N, MU_T, START_F, START_L, VELOCITY_F, VELOCITY_L
from sssi_exudyn.fitting.first_fit import NUISANCES, Fitted
from sssi_exudyn.fitting.observations import predict_fixes, track_of
from sssi_exudyn.model.model import Model
from sssi_exudyn.recording.recording import Recording
from sssi_exudyn.simulation.reduced.prepared import ReducedRun
from sssi_exudyn.simulation.result import SimulationResult
from sssi_exudyn.simulation.turns.steady_turn import SteadyTurn
from sssi_exudyn.sweeps.file import Task, Tier
from sssi_exudyn.validation.agreement import judge_loads
from sssi_exudyn.validation.metrics import LOAD_FLOOR, path_length, pressure_ratio, trajectory_error

AnyRun = ReducedRun | SimulationResult
Figures = dict[str, float | None]


@dataclass(frozen=True)
class Column:
    """A column of the table: its name, unit ("" for words) and meaning."""

    name: str
    unit: str
    meaning: str


_OF_A_RUN: Final = (
    Column("simulated_s", "s", "length of the run"),
    Column("distance_m", "m", "length of the centre of mass's path"),
    Column("down_m", "m", "how far down the slope the centre of mass came"),
    Column("left_m", "m", "how far to the left it came"),
    Column("mean_speed_mps", "m/s", "of the centre of mass, over time"),
    Column("max_speed_mps", "m/s", "of the centre of mass"),
    Column("end_speed_mps", "m/s", "of the centre of mass at the end"),
    Column("mean_load_N", "N", "normal force on both skis, over time"),
    Column("max_load_N", "N", "largest normal force on both skis together"),
    Column("max_ski_load_N", "N", "largest normal force on one ski"),
    Column("left_share", "1", "left ski's share of the load, over time"),
    Column("mean_edge_angle_deg", "deg", "size of the edge angle, over time, each ski weighted by its load"),
    Column("max_edge_angle_deg", "deg", "largest edge angle of a loaded ski"),
    Column("friction_work_J", "J", "work of the snow's friction on the feet"),
    Column("gps_mean_error_m", "m", "mean horizontal distance of the antenna to the GPS fixes"),
    Column("gps_rms_error_m", "m", "root mean square of it"),
    Column("gps_end_error_m", "m", "at the last fix"),
    Column("insoles_correlation", "1", "of the left foot's share of the load with the insoles'"),
)
_OF_A_FULL_RUN: Final = (
    Column("max_penetration_m", "m", "deepest contact point"),
    Column("energy_closure_percent", "%", "largest gap of the energy balance, of the energy turned over"),
    *(Column(f"max_{name}_moment_Nm", "N m", f"largest size of the moment that drives {name}") for name in PRESCRIBED),
)
_FITTED_UNITS: Final = {
    MU_T: ("mu_t", "1", 1.0),
    MU_N: ("mu_n", "1", 1.0),
    VELOCITY_F: ("start_velocity_f_mps", "m/s", 1.0),
    VELOCITY_L: ("start_velocity_l_mps", "m/s", 1.0),
    START_F: ("start_f_m", "m", 1.0),
    START_L: ("start_l_m", "m", 1.0),
    HEADING_OFFSET: ("heading_offset_deg", "deg", 180.0 / np.pi),
}
_OF_A_TURN: Final = (
    Column("radius_m", "m", "of the boot centre's path; none where the ski slips out of the turn"),
    Column("curvature_per_m", "1/m", "of the boot centre's path, > 0 to the inside"),
    Column("wobble_per_m", "1/m", "standard deviation of the curvature where the turn never settles"),
    Column("side_reserve", "1", "share of what the groove's wall bears that is not used"),
    Column("sideslip_deg", "deg", "by how much the ski points into the turn"),
    Column("drag_N", "N", "of the snow against the path of the boot centre"),
    Column("resistance_N", "N", "of the snow backwards along the ski"),
    Column("power_W", "W", "that the skier gives; friction, compaction and skid take it"),
    Column("friction_W", "W", "that friction takes"),
    Column("compaction_W", "W", "that snow pressed by a climbing edge takes"),
    Column("skid_W", "W", "that sideslip takes"),
    Column("groove_m", "m", "deepest of the groove"),
    Column("pitch_deg", "deg", "of the boot, > 0 tip down"),
)
_USUAL_TURN: Final = ("radius_m", "side_reserve", "drag_N")
_USUAL: Final = ("mean_speed_mps", "max_load_N", "mean_edge_angle_deg", "gps_mean_error_m")
_USUAL_FULL: Final = ("mean_speed_mps", "max_load_N", "max_knee_angle_r_moment_Nm", "gps_mean_error_m")
_USUAL_FITTED: Final = ("fitted_mu_t", "fitted_mu_n", "gps_mean_error_m")


def columns_of(task: Task, tier: Tier, method: Method) -> tuple[Column, ...]:
    """Return the columns of the figures of every run of a sweep."""
    if task == "turn":
        return _OF_A_TURN
    if task == "simulate":
        return _OF_A_RUN + (_OF_A_FULL_RUN if tier == "full" else ())
    fitted = []
    for name in FRICTION + (NUISANCES if method == "joint" else ()):
        column, unit, _ = _FITTED_UNITS[name]
        fitted.append(Column(f"fitted_{column}", unit, f"{name} as fitted"))
        fitted.append(Column(f"fitted_{column}_se", unit, "its standard error"))
    return (
        *fitted,
        Column("gps_mean_error_m", "m", "mean horizontal distance of the antenna to the GPS fixes"),
        Column("gps_rms_error_m", "m", "root mean square of it"),
        Column("evaluations", "1", "of the fit's objective"),
        Column("converged", "1", "1 where the fit's search came to an end, 0 where it was given up"),
    )


def usual_outputs(task: Task, tier: Tier) -> tuple[str, ...]:
    """Return the figures that plots and indices show where the file names none."""
    if task != "simulate":
        return _USUAL_FITTED if task == "fit" else _USUAL_TURN
    return _USUAL_FULL if tier == "full" else _USUAL


def figures_of_run(run: AnyRun, model: Model, recording: Recording) -> Figures:
    """Compute the figures of a simulated run; None where the recording lacks the instrument."""
    speed = np.linalg.norm(run.com_velocity, axis=1)
    loads = np.maximum(run.foot_load, 0.0)
    total = loads.sum(axis=1)
    edge = np.degrees(np.abs(run.edge_angle))
    loaded = loads > LOAD_FLOOR * max(float(np.mean(total)), 1e-9)
    power = np.sum(run.foot_friction * run.foot_velocity, axis=(1, 2))
    figures: dict[str, float] = {
        "simulated_s": float(np.ptp(run.time)),
        "distance_m": path_length(run.com),
        "down_m": float(run.com[-1, 0] - run.com[0, 0]),
        "left_m": float(run.com[-1, 1] - run.com[0, 1]),
        "mean_speed_mps": _mean(speed, run.time),
        "max_speed_mps": float(speed.max()),
        "end_speed_mps": float(speed[-1]),
        "mean_load_N": _mean(total, run.time),
        "max_load_N": float(total.max()),
        "max_ski_load_N": float(loads.max()),
        "left_share": float(np.nanmean(pressure_ratio(loads[:, 0], loads[:, 1]))),
        "mean_edge_angle_deg": float(np.sum(loads * edge) / max(float(np.sum(loads)), 1e-9)),
        "max_edge_angle_deg": float(np.max(edge[loaded], initial=0.0)),
        "friction_work_J": float(np.trapezoid(power, run.time)),
    }
    figures |= _against_gps(run, model, recording) | _against_insoles(run, recording)
    if isinstance(run, SimulationResult):
        figures["max_penetration_m"] = float(run.penetration.max())
        figures["energy_closure_percent"] = run.closure_percent
        largest = np.max(np.abs(run.joint_moments), axis=0)
        figures |= {f"max_{name}_moment_Nm": float(m) for name, m in zip(run.moment_names, largest, strict=True)}
    return complete(
        figures, columns_of("simulate", "full" if isinstance(run, SimulationResult) else "reduced", "joint")
    )


def figures_of_fit(fitted: Fitted) -> Figures:
    """Collect the figures of a fit."""
    figures: dict[str, float] = {}
    for name, (column, _, factor) in _FITTED_UNITS.items():
        if name in fitted.names:  # an estimate has many more, the snow surface's modes among them
            figures[f"fitted_{column}"] = factor * fitted.value(name)
            figures[f"fitted_{column}_se"] = factor * fitted.standard_error(name)
    distance = np.linalg.norm(fitted.residual, axis=1)
    figures["gps_mean_error_m"] = float(np.mean(distance))
    figures["gps_rms_error_m"] = float(np.sqrt(np.mean(distance**2)))
    figures["evaluations"] = float(fitted.optimum.evaluations)
    figures["converged"] = float(fitted.optimum.converged)
    return complete(figures, columns_of("fit", "full", fitted.method))


def figures_of_turn(turn: SteadyTurn) -> Figures:
    """Collect the figures of a ski in a turn."""
    figures = {
        "curvature_per_m": turn.curvature,
        "wobble_per_m": turn.wobble,
        "side_reserve": turn.side_reserve,
        "sideslip_deg": float(np.degrees(np.arctan(turn.sideslip))),
        "drag_N": turn.drag,
        "resistance_N": turn.resistance,
        "power_W": turn.power,
        "friction_W": turn.friction,
        "compaction_W": turn.compaction,
        "skid_W": turn.skid,
        "groove_m": float(turn.groove.max()),
        "pitch_deg": float(np.degrees(turn.pitch)),
    }
    if turn.radius is not None:
        figures["radius_m"] = turn.radius
    return complete(figures, _OF_A_TURN)


def series_of_run(run: AnyRun) -> pd.DataFrame:
    """Return the run's time series in the slope frame, in single precision except for time.

    Units are in the columns' names.
    """
    columns: dict[str, Array] = {}
    for name, vectors, unit in (
        ("com", run.com, "m"),
        ("com_velocity", run.com_velocity, "mps"),
        ("antenna", run.antenna, "m"),
        ("left_friction", run.foot_friction[:, 0], "N"),
        ("right_friction", run.foot_friction[:, 1], "N"),
    ):
        if vectors is not None:
            columns |= {f"{name}_{axis}_{unit}": vectors[:, i] for i, axis in enumerate("fln")}
    for i, side in enumerate(("left", "right")):
        columns[f"{side}_load_N"] = run.foot_load[:, i]
        columns[f"{side}_sole_N"] = run.sole_force[:, i]
        columns[f"{side}_edge_angle_deg"] = np.degrees(run.edge_angle[:, i])
    if isinstance(run, SimulationResult):
        columns |= {f"{name}_moment_Nm": run.joint_moments[:, i] for i, name in enumerate(run.moment_names)}
    return pd.DataFrame({"time_s": run.time} | {name: c.astype(np.float32) for name, c in columns.items()})


def _against_gps(run: AnyRun, model: Model, recording: Recording) -> dict[str, float]:
    if recording.gps is None or run.antenna is None:
        return {}
    track = track_of(recording.gps, model.fall_line_azimuth, float(run.time[0]), float(run.time[-1]))
    if len(track.time) < 2:
        return {}
    error = trajectory_error(predict_fixes(model, run.time, run.antenna, track.time)[:, :2], track.place)
    return {
        "gps_mean_error_m": error.mean_error,
        "gps_rms_error_m": error.rms_error,
        "gps_end_error_m": error.end_error,
    }


def _against_insoles(run: AnyRun, recording: Recording) -> dict[str, float]:
    series = {"time_s": run.time}
    for i, side in enumerate(("left", "right")):
        series |= {f"{side}_sole_N": run.sole_force[:, i], f"{side}_load_N": run.foot_load[:, i]}
    agreement = judge_loads(pd.DataFrame(series), recording.insoles)
    return {"insoles_correlation": agreement["correlation"]} if agreement else {}


def _mean(values: Array, time: Array) -> float:
    """Return the mean over time; steps may differ in length."""
    return float(np.trapezoid(values, time) / (time[-1] - time[0]))


def complete(figures: dict[str, float], columns: tuple[Column, ...]) -> Figures:
    """Return a figure for every column, None where there is no figure or it is not finite."""
    completed: Figures = {}
    for column in columns:
        value = figures.get(column.name)
        completed[column.name] = value if value is not None and np.isfinite(value) else None
    return completed
