"""The moment about the pelvis that a simulated run leaves over: a real skier, whom nothing holds there, has none.

    τ = Σ [(c − p) × m (a − g) + d(I ω)/dt] − Σ feet [(x − p) × F + M] − Σ segments (x − p) × D − (c − p) × B

over the body's segments and the skis, p the pelvis, F and M what the snow does to a ski, D the air's forces, B those on
the centre of mass; a pole's acts at its hand instead.  Skis are points here, as fast as their feet: that they turn
takes 5 N m at most in the bundled beginner's run.  Where a heading is found, what the body does is that of its captured
posture, turned by Ψ about the vertical u: with J and L its inertia and its own angular momentum about p,

    R(Ψ) [own + d(J u Ψ̇)/dt + Ψ̇ u × (L + J u Ψ̇)]

What remains of it once snow, air and inertia are counted is the
posture's error or the model's (residual reduction: Delp et al., IEEE Trans. Biomed. Eng. 54 (2007) 1940).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import make_interp_spline

from sssi_exudyn.bodies.skier.chain import SEGMENT
from sssi_exudyn.bodies.skier.inverse_dynamics import segment_loads
from sssi_exudyn.contact.maths import ArrayMath
from sssi_exudyn.core.frames import Array, cross, gravity_in_slope
from sssi_exudyn.model.model import Model
from sssi_exudyn.motion.hands import hands_at, pole_forces, use_poles
from sssi_exudyn.motion.motion import Motion, relative_poses
from sssi_exudyn.simulation.assembly import Parts
from sssi_exudyn.simulation.full.forces_numpy import ArrayLaws
from sssi_exudyn.simulation.heading import Turn, turned
from sssi_exudyn.simulation.reduced.prepared import Prepared, ReducedRun

_GRID: Final = 0.02
"""s between the instants at which the body's own moment is found."""

SLIP_NOISE: Final = 0.05
"""m/s; noise of a foot's captured slip that changes within a second, faster than errors of the posture are estimated:
0.25° of yaw at 11 m/s, as 0.2° in the joints of a leg add up to.
"""


@dataclass(frozen=True)
class Balance:
    """What of the moment about the pelvis does not follow from a run's forces, at n instants.

    own : (n, 3) N m, inertia and weight of the body, skis apart, were the pelvis not accelerated
    air : (n, 3) N m of the air and of what acts on the centre of mass, in one run
    arms : (n, 2, 3) m from each foot's place to its ski's centre of mass;  ski_mass : kg of one
    inertia, momentum : (n, 3) kg m², N m s of the body, skis apart, about the pelvis: the angular momentum that a unit
        rate of the heading gives it, and what it has
    heading : (n, 3) that of the run, by which none of these is turned yet
    """

    own: Array
    air: Array
    arms: Array
    ski_mass: float
    inertia: Array
    momentum: Array
    heading: Array

    def residual(self, run: ReducedRun, prepared: Prepared) -> Array:
        """Return the moment (n, 3) N m that is left over, slope frame; ``run`` may carry a complex step."""
        pull = np.gradient(run.pelvis_velocity, prepared.step, axis=0)
        feet, com = run.foot_position - run.pelvis[:, None], run.com - run.pelvis
        felt = np.gradient(run.foot_velocity, prepared.step, axis=0) - prepared.gravity
        own, air, arms = self.own, self.air, self.arms
        if np.any(run.heading):
            turn = Turn.of(prepared.up, run.heading)
            matrices, swung = turn.matrices(), self.inertia * turn.rate[:, None]
            own = own + np.gradient(self.inertia, prepared.step, axis=0) * turn.rate[:, None]
            own = own + self.inertia * turn.acceleration[:, None]
            own = turned(matrices, own + cross(turn.spin(swung), self.momentum + swung))
            air, arms = turned(matrices, air), turned(matrices, arms)
        total = own + prepared.body_mass * cross(com, pull) - air
        carried = cross(feet + arms, self.ski_mass * felt)
        return np.asarray(total + np.sum(carried - cross(feet, run.snow_force) - run.snow_moment, axis=1))


def balance_of(model: Model, motion: Motion, prepared: Prepared, run: ReducedRun) -> Balance:
    """Return the balance of the run ``run`` of that model along that motion and on its tables, corrected as the model
    says.
    """
    parts = Parts(model, motion)
    turn = Turn.of(prepared.up, run.heading)
    back, at_run = np.swapaxes(turn.matrices(), 1, 2), prepared.turn(turn) if np.any(run.heading) else prepared
    inertia, momentum = prepared.body_about_pelvis()
    grid = np.arange(run.time[0], run.time[-1] + _GRID, _GRID)
    own = make_interp_spline(grid, own_moment(parts, grid), k=3)(run.time)
    coarse = np.arange(0, len(run.time), max(1, round(0.1 / prepared.step)))
    seen = _air(parts, at_run, run, coarse, back)
    air = np.stack([np.interp(run.time, run.time[coarse], column) for column in seen.T])
    return Balance(
        own=own,
        air=air.T + _poles(parts, run, back),
        arms=np.einsum("nsij,j->nsi", prepared.foot_rotation, prepared.ski_com),
        ski_mass=0.5 * (prepared.mass - prepared.body_mass),
        inertia=inertia @ prepared.up,
        momentum=momentum,
        heading=run.heading,
    )


def moment_by_slip_noise(model: Model, run: ReducedRun) -> Array:
    """Return (n,) N m by which the moment about the pelvis is wrong through ``SLIP_NOISE`` of the feet.

    Where skis do not slip, friction across them answers to every error of the slip; where they do, hardly to any.
    """
    feet, math = run.feet(), ArrayMath()
    across = [model.friction.force(math, replace(feet, v_n=feet.v_n + noise))[1] for noise in (SLIP_NOISE, -SLIP_NOISE)]
    arms = np.linalg.norm(run.foot_position - run.pelvis[:, None], axis=-1)
    return np.asarray(np.linalg.norm(0.5 * (across[1] - across[0]) * arms, axis=1))


def own_moment(parts: Parts, time: Array) -> Array:
    """Return ``Balance.own`` (n, 3) N m at ``time`` (n,) s."""
    poses, moving = relative_poses(parts.motion, time)
    force, moment = segment_loads(poses, moving, parts.inertias, gravity_in_slope(parts.model.inclination))
    return np.asarray(np.sum(moment + cross(poses.origin, force), axis=1))


def _air(parts: Parts, at_run: Prepared, run: ReducedRun, rows: NDArray[np.intp], back: Array) -> Array:
    """Return the moment (rows, 3) N m of the air and of the forces on the centre of mass, turned ``back`` (n, 3, 3)."""
    laws = ArrayLaws(parts.model.terms)
    time = run.time[rows]
    poses, _ = relative_poses(parts.motion, time)
    shown = [SEGMENT[name] for name in parts.areas]
    arms = poses.origin[:, shown] + np.stack([poses.rotation[:, i] @ parts.inertias[i].com for i in shown], axis=1)
    moments = np.zeros((len(time), 3))
    for k, row in enumerate(rows):
        place, velocity = run.pelvis[row], run.pelvis_velocity[row]
        drag = laws.segments(
            float(time[k]),
            place[0],
            place[1],
            velocity + at_run.exposed_velocity[row],
            at_run.area,
            at_run.exposed_facing[row],
        )
        at = run.com[row]
        body = laws.body(float(time[k]), at[0], at[1], run.com_velocity[row])
        moments[k] = cross(arms[k], drag @ back[row].T).sum(axis=0) + back[row] @ cross(at - place, body)
    return moments


def _poles(parts: Parts, run: ReducedRun, back: Array) -> Array:
    """Return the moment (n, 3) N m by which forces at the hands differ from forces on the centre of mass, turned
    ``back`` (n, 3, 3).  It is at every instant, as a plant lasts a tenth of a second.
    """
    terms = parts.model.terms
    if not use_poles(terms):
        return np.zeros((len(run.time), 3))
    time, com, velocity = (np.real(array) for array in (run.time, run.com, run.com_velocity))
    arms = hands_at(parts.motion, time).place - turned(back, com - np.real(run.pelvis))[:, None]
    forces = turned(back, pole_forces(terms, time, com, velocity))
    return np.asarray(cross(arms, forces).sum(axis=1))
