"""Uncertainty of muscles and joint loads, from draws of posture, mass, snow and friction.

Each draw is run by the reduced model, and its muscles are computed every ``EVERY`` s.  Its difference from the
estimate, run in the same manner, is the draw's error.  A band's half width is 1.645 standard deviations of the errors,
which hold nine of ten normal ones.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from sssi_exudyn.bodies.muscles.muscles import SkierMuscles
from sssi_exudyn.bodies.skier.chain import Geometry
from sssi_exudyn.core.errors import SimulationDiverged
from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.noise import NORMAL_90
from sssi_exudyn.model.faults import CaptureSensor
from sssi_exudyn.model.model import Model
from sssi_exudyn.motion.motion import spline_motion
from sssi_exudyn.muscle_forces.forces import MuscleForces, muscle_forces
from sssi_exudyn.muscle_forces.loads import joint_forces, joint_moments, movement_of
from sssi_exudyn.results.draws import Draw
from sssi_exudyn.simulation.assembly import Parts, correct_motion
from sssi_exudyn.simulation.reduced.prepared import prepare
from sssi_exudyn.simulation.reduced.run import simulate_reduced

EVERY: Final = 0.05
"""s between the instants of a draw's muscles"""
_STEP: Final = 0.01
"""s; step of the reduced model."""


@dataclass(frozen=True)
class Nominal:
    """The estimate from which draws differ.

    time : (n,) s;  angles, moments : (n, 28) rad, N m;  joint_force : (n, 21, 3) N
    """

    model: Model
    geometry: Geometry
    time: Array
    angles: Array
    moments: Array
    joint_force: Array


@dataclass(frozen=True)
class Errors:
    """Draws and the estimate at k instants.

    time : (k,) s
    nominal, drawn : muscles of the estimate and of each draw
    """

    time: Array
    nominal: MuscleForces
    drawn: tuple[MuscleForces, ...]


@dataclass(frozen=True)
class _Loads:
    """Rates (k, 28) rad/s, moments (k, 28) N m and joint_force (k, 21, 3) N at instants of a reduced run."""

    rates: Array
    moments: Array
    joint_force: Array


def errors_of(skier: SkierMuscles, nominal: Nominal, draws: Sequence[Draw], power: int) -> Errors | None:
    """Compute the muscles of draws from the uncertainty; None where fewer than two of them can be run."""
    time = np.arange(nominal.time[0], nominal.time[-1] - _STEP, EVERY)
    heading = nominal.model.start.heading_offset
    # the posture of a result is corrected and turned already
    sensors = tuple(sensor for sensor in nominal.model.sensors if not isinstance(sensor, CaptureSensor))

    def turned(model: Model) -> Model:
        start = replace(model.start, heading_offset=model.start.heading_offset - heading)
        return replace(model, start=start, posture=None, sensors=sensors)

    try:
        base = _loads(turned(nominal.model), nominal.geometry, nominal.time, nominal.angles, time)
    except SimulationDiverged:
        return None
    rows = np.searchsorted(nominal.time, time - 1e-9)
    angles, moments, force = nominal.angles[rows], nominal.moments[rows], nominal.joint_force[rows]

    def muscles(angle_change: Array, loads: _Loads) -> MuscleForces:
        motion = (angles + angle_change, loads.rates, moments + loads.moments - base.moments)
        between = force + loads.joint_force - base.joint_force
        return muscle_forces(skier, nominal.geometry, time, *motion, between, power)

    drawn = []
    for draw in draws:
        try:
            angles_of_run = nominal.angles + draw.at(nominal.time)
            loads = _loads(turned(draw.model), nominal.geometry, nominal.time, angles_of_run, time)
        except SimulationDiverged:
            continue
        drawn.append(muscles(draw.at(time), loads))
    return Errors(time, muscles(np.zeros_like(angles), base), tuple(drawn)) if len(drawn) > 1 else None


def half_widths(errors: Errors, of: Callable[[MuscleForces], Array], time: Array) -> Array:
    """Return half widths (n, c) of the bands at ``time`` (n,) s of c quantities ``of`` the muscles' forces, (k, c)."""
    nominal = of(errors.nominal)
    spread = NORMAL_90 * np.sqrt(np.mean([(of(forces) - nominal) ** 2 for forces in errors.drawn], axis=0))
    return np.stack([np.interp(time, errors.time, column) for column in spread.T], axis=1)


def _loads(model: Model, geometry: Geometry, time: Array, angles: Array, instants: Array) -> _Loads:
    """Compute the joint loads of the reduced model's run along a posture at some instants.

    Raises SimulationDiverged where the run diverges.
    """
    motion = spline_motion(geometry, model.inclination, time, angles)
    run = simulate_reduced(model, prepare(model, motion, step=_STEP))
    parts = Parts(model, correct_motion(model, motion))
    rows = np.clip(np.searchsorted(run.time, instants), 0, len(run.time) - 1)
    movement = movement_of(parts, run, rows)
    moments = joint_moments(parts, movement, run.foot_position[rows], run.snow_moment[rows])
    return _Loads(movement.rates[:, 3:], moments, joint_forces(parts, movement))
