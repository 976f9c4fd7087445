"""What a run of the reduced model is made of and what it leaves: tables of the posture, modal skis, masses.

Place and load that it begins with follow from these.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace
from typing import Any, Final

import numpy as np

from sssi_exudyn.bodies.ski.modes import ModalSki, modal_ski
from sssi_exudyn.contact.registry import is_carved
from sssi_exudyn.contact.term import FootState
from sssi_exudyn.core.errors import SimulationDiverged
from sssi_exudyn.core.frames import Array, cross, gravity_in_slope, up_in_slope
from sssi_exudyn.model.faults import antenna_shift
from sssi_exudyn.model.legs import Legs
from sssi_exudyn.model.model import Model
from sssi_exudyn.motion.correction import correct_posture
from sssi_exudyn.motion.motion import Motion, antenna_movement
from sssi_exudyn.simulation.assembly import CARVED_STEP, COARSE_CARVED_STEP, Parts, snow_grid
from sssi_exudyn.simulation.heading import (
    RigidSki,
    Turn,
    WholeBody,
    spread_inertia,
    turned,
    turned_frames,
    whole_body,
)
from sssi_exudyn.simulation.posture_table import FeetAndBody
from sssi_exudyn.simulation.ski_on_snow.structs import (
    ModalContact,
    PrescribedMotion,
    ReducedSeries,
)

MODES: Final = 12
"""Vibrations of each ski that are kept: up to 130 Hz for a slalom ski."""
COARSE_STEP: Final = 0.01
"""s; steps of estimates and diagnoses, of skis in less detail.  They move a run's path by a centimetre against short
ones, evenly for all explanations; what the full model predicts beyond such runs is added to predictions.
"""
COARSE_CONTACTS: Final = 25
"""Contact points on each edge there."""
COARSE_MODES: Final = 10
"""Vibrations of each ski there.  With these points they move the paths of twelve runs by 1 to 5 mm (standard deviation)
and loads by 0.4 to 3 N against runs of fine steps, and fine skis at coarse steps by 0.3 to 3 mm and as much."""
STEP: Final = 0.005
"""s"""
_OVER_TIME: Final = ("time", "antenna", "foot", "com", "exposed")
"""How names of tables over time begin."""
_LEAST_LOAD: Final = 0.2
"""Share of the weight on the slope that the skier stands with at the start at least, however the posture moves."""


@dataclass(frozen=True)
class ReducedRun:
    """A run of the reduced model at n instants, slope frame: see ``SimulationResult`` for what each is.

    snow_force, snow_moment : (n, 2, 3) N, N m of the snow on each ski, friction included, about ``foot_position``
    heading : (n, 3) rad, rad/s, rad/s² by which the whole posture is turned from the captured one; see ``Turn``
    """

    time: Array
    pelvis: Array
    pelvis_velocity: Array
    antenna: Array
    com: Array
    com_velocity: Array
    foot_load: Array
    sole_force: Array
    foot_friction: Array
    foot_position: Array
    foot_velocity: Array
    foot_forward: Array
    edge_angle: Array
    snow_force: Array
    snow_moment: Array
    heading: Array

    def feet(self) -> FootState:
        """Return both skis at all instants, (n, 2) each, as force terms see them, on the slope's plane.

        The area pressed into the snow is left at zero.
        """
        forward = self.foot_forward[..., :2] / np.linalg.norm(self.foot_forward[..., :2], axis=-1, keepdims=True)
        v, none = self.foot_velocity, np.zeros(self.foot_load.shape)
        return FootState(
            load=self.foot_load,
            v_t=v[..., 0] * forward[..., 0] + v[..., 1] * forward[..., 1],
            v_n=v[..., 1] * forward[..., 0] - v[..., 0] * forward[..., 1],
            edge=self.edge_angle,
            groove=none,
            t=none + self.time[:, None],
            f=self.foot_position[..., 0],
            l=self.foot_position[..., 1],
            side=none + np.array([1.0, -1.0]),
        )


def over_time(table: str) -> bool:
    """Return whether a table of ``Prepared`` has a row for each instant."""
    return table.startswith(_OVER_TIME)


@dataclass(frozen=True)
class Prepared(FeetAndBody):
    """All that does not depend on snow, air and start: posture tables (n, …), modal skis, masses.  Can be pickled."""

    step: float
    inclination: float
    time: Array
    mass: float
    body_mass: float
    area: Array
    antenna: Array
    antenna_velocity: Array
    antenna_frame: Array
    antenna_spin: Array
    exposed_velocity: Array
    exposed_facing: Array
    exposed_swing: Array
    ski: ModalSki
    points: Array
    length: Array
    held: Array
    ski_com: Array
    ski_inertia: Array

    @property
    def up(self) -> Array:
        """(3,) against gravity"""
        return up_in_slope(self.inclination)

    @property
    def gravity(self) -> Array:
        """(3,) m/s²"""
        return gravity_in_slope(self.inclination)

    def kernel_contact(self, model: Model) -> ModalContact:
        """Return the skis on the snow, under the legs of a model, as the kernel takes them."""
        ski, legs = self.ski, model.legs
        shapes, omega, ratio, participation = (
            ski.contact_shape, 2.0 * np.pi * ski.frequency, ski.damping_ratio, ski.participation
        )  # fmt: skip
        rise, mixed = 0.0, np.zeros(0)
        if legs.give:
            rise, mixed = self.rise, self.rise * ski.participation[:, 2]
            stiffness, damping = self.leg_rates(legs)
            shapes = np.concatenate([shapes, np.zeros_like(shapes[:1])])
            shapes[-1, ..., 2] = rise
            omega = np.append(omega, np.sqrt(stiffness))
            ratio = np.append(ratio, 0.5 * damping / np.sqrt(stiffness))
            participation = np.vstack([participation, rise * ski.rigid[2]])
        return ModalContact(
            shape=np.ascontiguousarray(np.moveaxis(shapes, 0, 3)),
            points=self.points,
            length=self.length,
            omega=omega,
            ratio=ratio,
            coupling=np.ascontiguousarray(participation[:, :3]),
            spinning=np.ascontiguousarray(participation[:, 3:]),
            rise=rise,
            mixed=mixed,
            surface=snow_grid(model.surface),
        )

    @property
    def rise(self) -> float:
        """m by which a ski and its boot rise a unit of their mode, which has a mass of 1 kg."""
        return 1.0 / math.sqrt(self.ski.rigid[2, 2])

    def leg_rates(self, legs: Legs) -> tuple[Any, Any]:
        """Return stiffness (1/s²) and damping (1/s) of the rise of a ski under legs that give."""
        return legs.stiffness * self.rise**2, legs.damping * self.rise**2

    def kernel_motion(self) -> PrescribedMotion:
        """Return the posture as the kernel takes it."""
        acceleration, turning = self._ski_motion()
        return PrescribedMotion(
            step=self.step,
            time=self.time,
            mass=self.mass,
            carried=self._inertia_force(),
            gravity=self.gravity,
            area=self.area,
            exposed_velocity=self.exposed_velocity,
            exposed_facing=self.exposed_facing,
            foot_place=self.foot_place,
            foot_velocity=self.foot_velocity,
            foot_rotation=self.foot_rotation,
            foot_spin=self.foot_spin,
            ski_acceleration=acceleration,
            ski_turning=turning,
            com_place=self.com_place,
            com_velocity=self.com_velocity,
        )

    def whole_body(self) -> WholeBody:
        """Return skier and skis as one."""
        ski = RigidSki(0.5 * (self.mass - self.body_mass), self.ski_com, self.ski_inertia)
        return whole_body(self, self.body_mass, ski)

    def body_about_pelvis(self) -> tuple[Array, Array]:
        """Return the inertia (n, 3, 3) kg m² and angular momentum (n, 3) N m s of the body, skis apart, about the
        pelvis.
        """
        spread = spread_inertia(np.array([self.body_mass]), self.com_place[:, None])
        moving = self.body_mass * cross(self.com_place, self.com_velocity)
        return self.com_inertia + spread, self.com_momentum + moving

    def _inertia_force(self) -> Array:
        """Return the force (n, 3) N: all masses times the accelerations that the posture gives them relative to the
        pelvis.
        """
        arm = np.einsum("nsij,j->nsi", self.foot_rotation, self.ski_com)
        swing = cross(self.foot_spin, cross(self.foot_spin, arm))
        skis = self.foot_acceleration + cross(self.foot_spin_rate, arm) + swing
        return np.asarray(
            self.body_mass * self.com_acceleration + 0.5 * (self.mass - self.body_mass) * skis.sum(axis=1)
        )

    def _ski_motion(self) -> tuple[Array, Array]:
        """Return in the foot's frame the held node's acceleration less gravity, and the ski's effective turning, (n, 2,
        3) each.

        A ski is thin: the centrifugal field on its long axis is that of a further angular acceleration, Ω × (Ω × x)
        = α' × x.
        """
        arm = np.einsum("nsij,j->nsi", self.foot_rotation, self.held)
        swing = cross(self.foot_spin, cross(self.foot_spin, arm))
        moving = self.foot_acceleration + cross(self.foot_spin_rate, arm) + swing - self.gravity
        spin, rate = (
            np.einsum("nsji,nsj->nsi", self.foot_rotation, vector) for vector in (self.foot_spin, self.foot_spin_rate)
        )
        turning = rate.copy()
        turning[..., 1] -= spin[..., 0] * spin[..., 2]
        turning[..., 2] += spin[..., 0] * spin[..., 1]
        return np.einsum("nsji,nsj->nsi", self.foot_rotation, moving), turning

    def part(self, rows: slice) -> Prepared:
        """Return the tables of some consecutive instants only."""
        cut = {f.name: getattr(self, f.name)[rows] for f in fields(self) if over_time(f.name)}
        return replace(self, **cut)

    def correct_capture(self, model: Model) -> Prepared:
        """Return the same with the capture's faults as the model has them: turned about gravity, the antenna where it
        sat.

        The yaw is a straight line in time, so its rate is a constant spin about gravity.
        """
        yaw = model.capture_yaw(self.time)
        rate = (yaw[-1] - yaw[0]) / (self.time[-1] - self.time[0])
        lever = antenna_shift(model.sensors)
        if not (np.any(yaw) or np.any(lever)):
            return self
        arm = self.antenna_frame @ lever
        moved = replace(
            self,
            antenna=self.antenna + arm,
            antenna_velocity=self.antenna_velocity + cross(self.antenna_spin, arm),
        )
        return moved.turn(Turn(self.up, yaw, np.full(len(yaw), rate), np.zeros(len(yaw))))

    def of_run(self, model: Model, run: ReducedRun) -> Prepared:
        """Return the same as that run of the model had it: with the capture's faults, and turned by the heading it
        solved for.
        """
        at = self.correct_capture(model)
        return at.turn(Turn.of(at.up, run.heading)) if np.any(run.heading) else at

    def turn(self, turn: Turn) -> Prepared:
        """Return the same turned about gravity."""
        matrices = turn.distinct_matrices()
        swung = self.exposed_velocity + turn.rate[:, None, None] * self.exposed_swing
        vectors = {
            "antenna": self.antenna,
            "antenna_velocity": turn.velocity(self.antenna, self.antenna_velocity),
            "antenna_spin": self.antenna_spin + turn.spin(self.antenna_spin),
            "exposed_velocity": swung,
            "exposed_swing": self.exposed_swing,
        }
        changed: dict[str, Any] = turn.of_posture(self)
        changed |= {name: turned(matrices, vector) for name, vector in vectors.items()}
        changed["antenna_frame"] = turned_frames(matrices, self.antenna_frame)
        return replace(self, **changed)


def prepare(
    model: Model, motion: Motion, *, start: float | None = None, stop: float | None = None, step: float | None = None
) -> Prepared:
    """Return the tables for runs of ``model`` along ``motion``, its posture corrected, with the heading as recorded.
    They go from ``start`` to ``stop`` (s; the motion's ends if None), in steps (s) of ``STEP``.  With steps that are
    nearer to ``COARSE_STEP`` skis have less detail, too.  On snow that edges cut steps are ``CARVED_STEP``, and
    ``COARSE_CARVED_STEP`` at most.
    """
    if is_carved(model.terms):
        step = CARVED_STEP if step is None else min(step, COARSE_CARVED_STEP)
    elif step is None:
        step = STEP
    motion = correct_posture(motion, model.posture)
    parts = Parts(model, motion)
    t0, t1 = motion.start if start is None else start, motion.stop if stop is None else stop
    time = t0 + step * np.arange(max(1, round((t1 - t0) / step)) + 1, dtype=np.float64)
    posture = parts.movement(time)
    antenna, moving, turning = np.zeros((3, len(time), 3))
    carrier = np.zeros((len(time), 3, 3))
    if motion.antenna is not None:
        antenna, moving, carrier, turning = antenna_movement(motion, time)
    coarse = not is_carved(model.terms) and step > 0.5 * (STEP + COARSE_STEP)
    cut = parts.mesh_with(COARSE_CONTACTS) if coarse else parts.mesh
    s = cut.contact_s
    left = np.stack([cut.ski.x_of_s(s), 0.5 * cut.ski.width(s), cut.ski.height(s)], axis=1) + parts.ski_in_foot
    centre = np.average(0.5 * (cut.node_position[1:] + cut.node_position[:-1]), axis=0, weights=cut.element_mass)
    return Prepared(
        step=step,
        inclination=model.inclination,
        time=time,
        mass=parts.mass,
        body_mass=parts.body_mass,
        area=np.array(list(parts.areas.values())),
        antenna=antenna,
        antenna_velocity=moving,
        antenna_frame=carrier,
        antenna_spin=turning,
        foot_place=posture.foot_place,
        foot_velocity=posture.foot_velocity,
        foot_acceleration=posture.foot_acceleration,
        foot_rotation=np.ascontiguousarray(posture.foot_rotation),
        foot_spin=np.ascontiguousarray(posture.foot_spin),
        foot_spin_rate=np.ascontiguousarray(posture.foot_spin_rate),
        com_place=posture.com_place,
        com_velocity=posture.com_velocity,
        com_acceleration=posture.com_acceleration,
        com_inertia=posture.com_inertia,
        com_momentum=posture.com_momentum,
        exposed_velocity=posture.exposed_velocity,
        exposed_facing=posture.exposed_facing,
        exposed_swing=cross(up_in_slope(model.inclination), posture.exposed_place),
        ski=modal_ski(cut, COARSE_MODES if coarse else MODES),
        points=np.stack([left, left * [1.0, -1.0, 1.0]], axis=1),
        length=cut.contact_length,
        held=cut.node_position[cut.clamped] + parts.ski_in_foot,
        ski_com=centre + parts.ski_in_foot,
        ski_inertia=parts.ski.inertia,
    )


def first_place(model: Model, at: Prepared) -> tuple[Array, Array]:
    """Return place (m) and velocity (m/s) of the pelvis (3,) that put the antenna where the model's start says.  The
    height is a first guess, both feet's mean on the snow, and the velocity along the normal is still open.
    """
    begin = model.start
    place = np.array([begin.f, begin.l, 0.0]) - at.antenna[0]
    velocity = np.array([begin.velocity_f, begin.velocity_l, 0.0]) - at.antenna_velocity[0]
    place[2] = float(np.mean(model.snow(place + at.foot_place[0])[0] - at.foot_place[0, :, 2]))
    return place, velocity


def load_at_start(at: Prepared, share: Array) -> Any:
    """Return the load (N) normal to the slope: the weight's part, and what lifts the centre of mass as the posture does
    at the start.  The feet are taken as fixed where the load's ``share`` (2,) of each is.
    """
    lift = at.com_acceleration[0, 2] - share @ at.foot_acceleration[0, :, 2]
    weight = -at.gravity[2]
    return at.mass * (weight + lift if np.real(lift) > (_LEAST_LOAD - 1.0) * np.real(weight) else _LEAST_LOAD * weight)


def empty_series(*count: int) -> ReducedSeries:
    """Make room for so many runs and instants."""
    return ReducedSeries(
        place=np.zeros((*count, 3)),
        velocity=np.zeros((*count, 3)),
        loads=np.zeros((*count, 2)),
        sole=np.zeros((*count, 2)),
        friction=np.zeros((*count, 2, 3)),
        edges=np.zeros((*count, 2)),
        force=np.zeros((*count, 2, 3)),
        moment=np.zeros((*count, 2, 3)),
    )


def reduced_run(at: Prepared, series: ReducedSeries, done: int) -> ReducedRun:
    """Return the run that the kernel filled.  Raises SimulationDiverged where it did not reach the end."""
    if done < len(at.time):
        raise SimulationDiverged(float(at.time[done]), "Newton's method does not converge in the reduced model")
    return ReducedRun(
        time=at.time,
        pelvis=series.place,
        pelvis_velocity=series.velocity,
        antenna=series.place + at.antenna,
        com=series.place + at.com_place,
        com_velocity=series.velocity + at.com_velocity,
        foot_load=series.loads,
        sole_force=series.sole,
        foot_friction=series.friction,
        foot_position=series.place[:, None] + at.foot_place,
        foot_velocity=series.velocity[:, None] + at.foot_velocity,
        foot_forward=at.foot_rotation[..., 0],
        edge_angle=series.edges,
        snow_force=series.force,
        snow_moment=series.moment,
        heading=np.zeros((len(at.time), 3)),
    )
