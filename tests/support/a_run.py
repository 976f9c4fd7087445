"""A run to draw, without a simulation: a skier who swings down a slope, of any length."""

from __future__ import annotations

from typing import Any

import numpy as np
from flat_snow import flat_snow

from sssi_exudyn.analysis.biomechanics import biomechanics, label_turns, residual_moment, turn_figures
from sssi_exudyn.analysis.losses import loss_figures
from sssi_exudyn.bodies.ski.ski import read_ski
from sssi_exudyn.bodies.skier.chain import COORDINATES, PRESCRIBED, average_geometry
from sssi_exudyn.core.frames import Array, slope_to_enu
from sssi_exudyn.model.model import Model
from sssi_exudyn.recording.instruments.gps import Gps
from sssi_exudyn.recording.instruments.insoles import Insoles
from sssi_exudyn.recording.recording import Equipment, Skier
from sssi_exudyn.results.measured import measured_table
from sssi_exudyn.results.stored import StoredRun
from sssi_exudyn.results.summary import summary_from_dict
from sssi_exudyn.simulation.result import SimulationResult
from sssi_exudyn.validation.agreement import judge_loads, judge_track

NAME = "little </script><b>hill</b> & more"
INCLINATION, AZIMUTH = np.radians(15.0), np.radians(70.0)
MASS = 70.0
PERIOD, SPEED, SWING = 4.0, 8.0, 2.0
"""Duration of a left and a right turn, s; speed down the fall line, m/s; swing to each side, m."""
GPS_BIAS = 0.5
"""Distance of the GPS north of the antenna's true place, m."""


def a_result(duration: float = 14.0, rate: float = 50.0) -> SimulationResult:
    """Return the run as a simulation would give it, with ``rate`` samples per second."""
    time = np.arange(0.0, duration + 1e-9, 1.0 / rate)
    n, omega = len(time), 2.0 * np.pi / PERIOD
    com = np.column_stack([SPEED * time, SWING * np.sin(omega * time), np.full(n, 0.9)])
    velocity = np.gradient(com, time, axis=0)
    course = np.arctan2(velocity[:, 1], velocity[:, 0])
    angles = np.radians(10.0 * np.sin(omega * time[:, None] + np.arange(len(PRESCRIBED))))
    angles[:, PRESCRIBED.index("pelvis_rotation")] = course
    share = 0.5 + 0.4 * np.sin(omega * time)
    load = MASS * 9.81 * np.column_stack([share, 1.0 - share])
    aside = np.column_stack([-np.sin(course), np.cos(course), np.zeros(n)])
    feet = np.stack([com + 0.1 * aside, com - 0.1 * aside], axis=1) - [0.0, 0.0, 0.9]
    forward = np.column_stack([np.cos(course), np.sin(course), np.zeros(n)])
    return SimulationResult(
        coordinate_names=COORDINATES,
        moment_names=PRESCRIBED,
        time=time,
        pelvis=com,
        pelvis_velocity=velocity,
        com=com,
        com_velocity=velocity,
        antenna=com + [0.0, 0.0, 0.4],
        coordinates=np.hstack([com, angles]),
        foot_load=load,
        sole_force=load,
        foot_friction=-0.05 * load[..., None] * forward[:, None],
        foot_position=feet,
        foot_velocity=np.stack([velocity, velocity], axis=1),
        foot_forward=np.stack([forward, forward], axis=1),
        snow=flat_snow(load, -0.05 * load[..., None] * forward[:, None]),
        edge_angle=np.column_stack([share, share]),
        penetration=np.full((n, 2), 0.01),
        drag=-20.0 * forward,
        joint_moments=100.0 * angles,
        ski_deflection=0.02 * np.ones((n, 2, 2)),
        energy={"gravity": 100.0 * time, "friction": -90.0 * time, "kinetic": 10.0 * time},
        energy_closure=np.zeros(n),
        statistics={"steps": n, "wall_s": 2.0, "newton_iterations": 3 * n, "backend": "compiled"},
    )


def some_gps(result: SimulationResult) -> Gps:
    """Return ten fixes per second, ``GPS_BIAS`` north of the antenna."""
    every = slice(None, None, max(1, round(0.1 / float(result.time[1]))))
    assert result.antenna is not None
    fixes = result.antenna[every] @ slope_to_enu(INCLINATION, AZIMUTH).T + [0.0, GPS_BIAS, 0.0]
    return Gps(
        time=result.time[every],
        enu=fixes,
        sigma=np.full(len(fixes), 0.02),
        origin=(47.0, 11.0, 1500.0),
        segment="Spine2",
        offset=np.zeros(3),
        speed=None,
        course=None,
        notes=(),
    )


def some_insoles(result: SimulationResult) -> Insoles:
    """Return insoles that feel nine tenths of the soles' load."""
    left, right = 0.9 * result.sole_force.T

    def cells(load: Array) -> Array:
        return load[:, None]

    return Insoles(result.time, left, right, cells(left), cells(right), ())


def a_run(duration: float = 14.0, rate: float = 50.0, *, measured: bool = True, **figures: Any) -> StoredRun:
    """Return the run with all that a result folder keeps of it; ``figures`` go into its summary."""
    result = a_result(duration, rate)
    model = Model(
        name=NAME,
        skier=Skier(mass=MASS, height=1.75, sex="male"),
        equipment=Equipment(skis="slalom_165", ski_mass=2.4, boot_mass=1.9, ankle_to_ski_base=0.13),
        ski=read_ski("slalom_165", "."),
        inclination=float(INCLINATION),
        fall_line_azimuth=float(AZIMUTH),
    )
    figures_of_turns = biomechanics(result, MASS, float(INCLINATION))
    series = label_turns(result.to_frame(slope_to_enu(INCLINATION, AZIMUTH)), figures_of_turns.turns)
    gps, insoles = (some_gps(result), some_insoles(result)) if measured else (None, None)
    summary = summary_from_dict(
        {
            "recording": NAME,
            "friction": {"mu_t": {"value": 0.0612, "se": 0.001}, "mu_n": {"value": 0.55, "se": None}},
            "trajectory": judge_track(series, gps),
            "pressure_ratio": judge_loads(series, insoles),
            "turns": turn_figures(figures_of_turns),
            "losses": loss_figures(result, figures_of_turns.table, float(INCLINATION), 0.55),
            "residual_moment": residual_moment(result),
            "solver": {"simulated_s": duration, **result.statistics},
            "energy": {"closure_percent": result.closure_percent},
            "provenance": {"inputs": {"motion.bvh": "sha256:abc"}, "versions": {}, "settings": {"method": "joint"}},
            **figures,
        }
    )
    measured_rows = measured_table(gps, insoles)
    return StoredRun(summary, series, model, measured_rows, average_geometry(1.75), figures_of_turns.table)
