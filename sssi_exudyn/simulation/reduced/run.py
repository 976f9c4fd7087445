"""The reduced model: the same posture, laws and contact points on linear modal skis; many times faster than the full
one.

It screens and gives gradients; what is reported as a result is the full model's.  Left out against the full model:
large bending of the skis, their geometric stiffness, gyroscopic forces between the modes, and modes beyond ``MODES``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from sssi_exudyn.contact.codegen.compiled import compile_kernel, law_parameters
from sssi_exudyn.contact.codegen.law_parameters import LawParameters
from sssi_exudyn.contact.registry import is_carved
from sssi_exudyn.core.errors import SimulationDiverged
from sssi_exudyn.core.frames import Array
from sssi_exudyn.model.heading import check_heading
from sssi_exudyn.model.legs import check_legs
from sssi_exudyn.model.model import Model, along_snow
from sssi_exudyn.simulation.reduced import air_tangents, newmark, ski_tangents, steps_kernel, tangents_kernel
from sssi_exudyn.simulation.reduced.carved_run import simulate_carved
from sssi_exudyn.simulation.reduced.prepared import (
    Prepared,
    ReducedRun,
    empty_series,
    first_place,
    load_at_start,
    reduced_run,
)
from sssi_exudyn.simulation.ski_on_snow import ground as ground_kernel
from sssi_exudyn.simulation.ski_on_snow import point
from sssi_exudyn.simulation.ski_on_snow.structs import (
    InitialState,
    ModalContact,
    PrescribedMotion,
    ReducedSeries,
    TimeStep,
)


def reduced_module() -> Any:
    """Return the compiled functions of the reduced model, on snow that edges do not cut."""
    return compile_kernel(point, ground_kernel, newmark, steps_kernel, air_tangents, ski_tangents, tangents_kernel)


@dataclass(frozen=True)
class Rest:
    """The skier at rest on the snow before the start.

    height : m of the pelvis;  eta : (2, k) amplitudes of the skis' modes;  loads : (2,) N of the feet
    """

    height: float
    eta: Array
    loads: Array

    @property
    def share(self) -> Array:
        """(2,) of the load by foot."""
        return np.asarray(self.loads / self.loads.sum())


@dataclass(frozen=True)
class StartOfRun:
    """How a run starts: place and velocity of the pelvis (3,) m, m/s, and the states of rest that led there, the first
    with equal loads assumed, the second with the loads of the first.  From rest he may be raised, and move.
    """

    place: Array
    velocity: Array
    rests: tuple[Rest, Rest]

    @property
    def state(self) -> InitialState:
        """The start as the kernel takes it."""
        return InitialState(self.place, self.velocity, self.rests[1].eta)


def start_of_run(
    model: Model, at: Prepared, kernel: Any, parameters: LawParameters, contact: ModalContact
) -> StartOfRun:
    """Return where and how a run starts, at rest on the snow apart from its speed and what the model's start adds.

    Raises SimulationDiverged where there is no rest.
    """
    pelvis, velocity = first_place(model, at)
    share = np.array([0.5, 0.5])
    rests: list[Rest] = []
    eta = np.zeros((2, len(contact.omega)))
    for _ in range(2):
        load = load_at_start(at, share)
        pelvis[2] = kernel.settle(parameters, contact, pelvis, at.foot_place[0], at.foot_rotation[0], load, eta)
        if not np.isfinite(pelvis[2]):
            raise SimulationDiverged(float(at.time[0]), "the skier does not come to rest on the snow at the start")
        rests.append(Rest(float(pelvis[2]), eta.copy(), _loads(kernel, parameters, pelvis, at, contact, eta)))
        share = rests[-1].share
    velocity[2] = along_snow(model, pelvis + at.foot_place[0], velocity, at.foot_velocity[0], share)
    pelvis[2] += model.start.height
    return StartOfRun(pelvis, velocity, (rests[0], rests[1]))


def simulate_reduced(model: Model, prepared: Prepared) -> ReducedRun:
    """Simulate a run, on snow that edges cut where the model has such.

    Raises SimulationDiverged when no rest is found at the start or Newton's method fails on the way, InputError for a
    heading that is to be found on other snow, and for legs that give on such.
    """
    check_heading(model.heading, model.terms)
    check_legs(model.legs, model.terms)
    if is_carved(model.terms):
        return simulate_carved(model, prepared).run
    at = prepared.correct_capture(model)
    kernel, contact = reduced_module(), at.kernel_contact(model)
    parameters = law_parameters(model.terms)
    start = start_of_run(model, at, kernel, parameters, contact)
    one = parameters._replace(values=parameters.values[None])
    series, done = run_batch(kernel, contact, at.kernel_motion(), one, [start])
    return reduced_run(at, ReducedSeries(*(array[0] for array in series)), int(done[0]))


def run_batch(
    kernel: Any,
    contact: ModalContact,
    motion: PrescribedMotion,
    parameters: LawParameters,
    starts: Sequence[StartOfRun],
) -> tuple[ReducedSeries, Any]:
    """Run a batch with parameters of values (b, p) and so many starts in one compiled call.  Return what each run
    leaves, on a first axis, and the instants (b,) that it reached.
    """
    states = [start.state for start in starts]
    begin = InitialState(*(np.stack(parts) for parts in zip(*states, strict=True)))
    series = empty_series(len(starts), len(motion.time))
    done = np.zeros(len(starts), dtype=np.int64)
    kernel.run_batch(parameters, contact, motion, begin, series, done)
    return series, done


def _loads(
    kernel: Any, parameters: LawParameters, pelvis: Array, at: Prepared, contact: ModalContact, eta: Array
) -> Array:
    """Return each foot's load at rest, (2,) N."""
    count = len(contact.omega)
    size = 3 + 2 * count
    buffers = np.zeros(size), np.zeros((size, size)), np.zeros((4 + count, 3 + count))
    still, rest = (0.0, 0.0, 0.0), TimeStep(0.0, 0.0, 0.0)
    loads, posed = np.empty(2), np.empty((2 * len(contact.length), 9))
    for side in range(2):
        foot = (tuple(pelvis + at.foot_place[0, side]), still, at.foot_rotation[0, side], still)
        kernel.pose_points(parameters, contact, foot, eta[side], np.zeros(count), posed)
        loads[side], *_ = kernel.snow(parameters, contact, foot, posed, 3 + side * count, rest, *buffers)
    return loads
