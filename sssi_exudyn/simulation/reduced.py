"""The reduced model: the same posture, laws and contact points on linear modal skis; many times faster than the full
one.

It screens and gives gradients; what is reported as a result is the full model's.  Left out against the full model:
large bending of the skis, their geometric stiffness, gyroscopic forces between the modes, and modes beyond ``MODES``.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
from scipy.spatial.transform import Rotation

from sssi_exudyn.bodies.ski.modes import ModalSki, modal_ski
from sssi_exudyn.contact.backends import reduced_kernel
from sssi_exudyn.contact.backends.compiled import compile_kernel, parameter_values
from sssi_exudyn.contact.backends.structs import InitialState, ModalContact, PrescribedMotion, ReducedSeries
from sssi_exudyn.contact.registry import pad_terms
from sssi_exudyn.core.errors import SimulationDiverged
from sssi_exudyn.core.frames import Array, gravity_in_slope, slope_to_level
from sssi_exudyn.model.faults import antenna_shift
from sssi_exudyn.model.model import Model, along_snow
from sssi_exudyn.motion.motion import Motion, antenna_carrier, antenna_offset
from sssi_exudyn.simulation.assembly import Parts

MODES: Final = 12
"""Vibrations of each ski that are kept: up to 130 Hz for a slalom ski."""
STEP: Final = 0.005
"""s"""
_LEAST_LOAD: Final = 0.2
"""Share of the weight on the slope that the skier stands with at the start at least, however the posture moves."""


@dataclass(frozen=True)
class ReducedRun:
    """A run of the reduced model at n instants, slope frame: see ``SimulationResult`` for what each is."""

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


@dataclass(frozen=True)
class Prepared:
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
    foot_place: Array
    foot_velocity: Array
    foot_acceleration: Array
    foot_rotation: Array
    foot_spin: Array
    foot_spin_rate: Array
    com_place: Array
    com_velocity: Array
    com_acceleration: Array
    exposed_velocity: Array
    ski: ModalSki
    points: Array
    length: Array
    held: Array
    ski_com: Array

    @property
    def gravity(self) -> Array:
        """(3,) m/s²"""
        return gravity_in_slope(self.inclination)

    def kernel_contact(self) -> ModalContact:
        """The skis as the kernel takes them."""
        return ModalContact(
            shape=np.ascontiguousarray(np.moveaxis(self.ski.contact_shape, 0, 3)),
            points=self.points,
            length=self.length,
            omega=2.0 * np.pi * self.ski.frequency,
            ratio=self.ski.damping_ratio,
            coupling=np.ascontiguousarray(self.ski.participation[:, :3]),
            spinning=np.ascontiguousarray(self.ski.participation[:, 3:]),
        )

    def kernel_motion(self) -> PrescribedMotion:
        """The posture as the kernel takes it."""
        acceleration, turning = self._ski_motion()
        return PrescribedMotion(
            step=self.step,
            time=self.time,
            mass=self.mass,
            carried=self._inertia_force(),
            gravity=self.gravity,
            area=self.area,
            exposed_velocity=self.exposed_velocity,
            foot_place=self.foot_place,
            foot_velocity=self.foot_velocity,
            foot_rotation=self.foot_rotation,
            foot_spin=self.foot_spin,
            ski_acceleration=acceleration,
            ski_turning=turning,
            com_place=self.com_place,
            com_velocity=self.com_velocity,
        )

    def _inertia_force(self) -> Array:
        """(n, 3) N: all masses times the accelerations that the posture gives them relative to the pelvis."""
        arm = np.einsum("nsij,j->nsi", self.foot_rotation, self.ski_com)
        swing = np.cross(self.foot_spin, np.cross(self.foot_spin, arm))
        skis = self.foot_acceleration + np.cross(self.foot_spin_rate, arm) + swing
        return np.asarray(
            self.body_mass * self.com_acceleration + 0.5 * (self.mass - self.body_mass) * skis.sum(axis=1)
        )

    def _ski_motion(self) -> tuple[Array, Array]:
        """(n, 2, 3) each, in the foot's frame: the held node's acceleration less gravity, and the ski's effective
        turning.

        A ski is thin: the centrifugal field on its long axis is that of an angular acceleration besides, Ω × (Ω × x)
        = α' × x.
        """
        arm = np.einsum("nsij,j->nsi", self.foot_rotation, self.held)
        swing = np.cross(self.foot_spin, np.cross(self.foot_spin, arm))
        moving = self.foot_acceleration + np.cross(self.foot_spin_rate, arm) + swing - self.gravity
        spin, rate = (
            np.einsum("nsji,nsj->nsi", self.foot_rotation, vector) for vector in (self.foot_spin, self.foot_spin_rate)
        )
        turning = rate.copy()
        turning[..., 1] -= spin[..., 0] * spin[..., 2]
        turning[..., 2] += spin[..., 0] * spin[..., 1]
        return np.einsum("nsji,nsj->nsi", self.foot_rotation, moving), turning

    def correct_capture(self, model: Model) -> Prepared:
        """The same with the capture's faults as the model has them: turned about gravity, the antenna where it sat.

        The yaw is a straight line in time, so its rate is a constant spin about gravity.
        """
        yaw = model.capture_yaw(self.time)
        rate = float(yaw[-1] - yaw[0]) / float(self.time[-1] - self.time[0])
        lever = antenna_shift(model.sensors)
        if not (np.any(yaw) or np.any(lever)):
            return self
        axis = slope_to_level(self.inclination).T @ [0.0, 0.0, 1.0]
        turn = Rotation.from_rotvec(yaw[:, None] * axis).as_matrix()
        arm = self.antenna_frame @ lever
        spun = rate * axis

        def moved(place: Array, velocity: Array) -> tuple[Array, Array]:
            return place, velocity + np.cross(spun, place)

        antenna, antenna_velocity = moved(self.antenna + arm, self.antenna_velocity + np.cross(self.antenna_spin, arm))
        foot, foot_velocity = moved(self.foot_place, self.foot_velocity)
        com, com_velocity = moved(self.com_place, self.com_velocity)
        vectors = {
            "antenna": antenna,
            "antenna_velocity": antenna_velocity,
            "antenna_spin": self.antenna_spin + spun,
            "foot_place": foot,
            "foot_velocity": foot_velocity,
            "foot_acceleration": self.foot_acceleration + np.cross(spun, self.foot_velocity + foot_velocity),
            "foot_spin": self.foot_spin + spun,
            "foot_spin_rate": self.foot_spin_rate + np.cross(spun, self.foot_spin),
            "com_place": com,
            "com_velocity": com_velocity,
            "com_acceleration": self.com_acceleration + np.cross(spun, self.com_velocity + com_velocity),
            # the segments' places are not kept: a drift's own share of their speed, millimetres a second, is left out
            "exposed_velocity": self.exposed_velocity,
        }
        changed: dict[str, Any] = {
            name: np.einsum("nij,n...j->n...i", turn, vector) for name, vector in vectors.items()
        }
        changed["foot_rotation"] = turn[:, None] @ self.foot_rotation
        changed["antenna_frame"] = turn @ self.antenna_frame
        for name, array in changed.items():
            changed[name] = np.ascontiguousarray(array)
        return replace(self, **changed)


def prepare(
    model: Model, motion: Motion, *, start: float | None = None, stop: float | None = None, step: float = STEP
) -> Prepared:
    """The tables for runs of ``model`` along ``motion`` from ``start`` to ``stop`` (s; its ends if None), heading as
    recorded.
    """
    parts = Parts(model, motion)
    t0, t1 = motion.start if start is None else start, motion.stop if stop is None else stop
    time = t0 + step * np.arange(max(1, round((t1 - t0) / step)) + 1, dtype=np.float64)
    posture = parts.posture(time)
    antenna, moving, turning = np.zeros((3, len(time), 3))
    carrier = np.zeros((len(time), 3, 3))
    if motion.antenna is not None:
        antenna, moving = antenna_offset(motion, time)
        carrier, turning = antenna_carrier(motion, time)
    cut = parts.mesh
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
        exposed_velocity=posture.exposed_velocity,
        ski=modal_ski(cut, MODES),
        points=np.stack([left, left * [1.0, -1.0, 1.0]], axis=1),
        length=cut.contact_length,
        held=cut.node_position[cut.middle] + parts.ski_in_foot,
        ski_com=centre + parts.ski_in_foot,
    )


def simulate_reduced(model: Model, prepared: Prepared) -> ReducedRun:
    """One run.  Raises SimulationDiverged when no rest is found at the start or Newton's method fails on the way."""
    at = prepared.correct_capture(model)
    terms = pad_terms(model.terms)
    kernel = compile_kernel(terms, reduced_kernel)
    parameters = parameter_values(terms)
    gravity = at.gravity
    contact = at.kernel_contact()
    n = len(at.time)
    begin = model.start
    pelvis = np.array([begin.f, begin.l, 0.0]) - at.antenna[0]
    velocity = np.array([begin.velocity_f, begin.velocity_l, 0.0]) - at.antenna_velocity[0]
    share = np.array([0.5, 0.5])
    eta = np.zeros((2, len(contact.omega)))
    pelvis[2] = float(np.mean(model.snow(pelvis + at.foot_place[0])[0] - at.foot_place[0, :, 2]))
    for _ in range(2):
        lift = at.com_acceleration[0, 2] - share @ at.foot_acceleration[0, :, 2]
        load = at.mass * max(-gravity[2] + lift, _LEAST_LOAD * -gravity[2])
        pelvis[2] = kernel.settle(parameters, contact, pelvis, at.foot_place[0], at.foot_rotation[0], load, eta)
        if not np.isfinite(pelvis[2]):
            raise SimulationDiverged(float(at.time[0]), "the skier does not come to rest on the snow at the start")
        share = _load_shares(kernel, parameters, pelvis, at, contact, eta)
    velocity[2] = along_snow(model, pelvis + at.foot_place[0], velocity, at.foot_velocity[0], share)
    loads, sole, edges = np.zeros((3, n, 2))
    series = ReducedSeries(np.zeros((n, 3)), np.zeros((n, 3)), loads, sole, np.zeros((n, 2, 3)), edges)
    done = kernel.run(parameters, contact, at.kernel_motion(), InitialState(pelvis, velocity, eta), series)
    if done < n:
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
    )


def _load_shares(
    kernel: Any, parameters: Array, pelvis: Array, at: Prepared, contact: ModalContact, eta: Array
) -> Array:
    """(2,) each foot's share of the load at rest."""
    count = len(contact.omega)
    size = 3 + 2 * count
    buffers = np.zeros(size), np.zeros((size, size)), np.zeros((4 + count, 3 + count))
    still = (0.0, 0.0, 0.0)
    loads = np.empty(2)
    for side in range(2):
        foot = (tuple(at.foot_place[0, side]), still, at.foot_rotation[0, side], still)
        loads[side], _ = kernel.snow(
            parameters, contact, tuple(pelvis), still, eta, np.zeros_like(eta), foot, side, *buffers, 0.0, 0.0
        )
    return np.asarray(loads / loads.sum())
