"""Run a model along a motion: from the settled start on the snow to time series of everything.

Posture is prescribed, the pelvis' translations are free: where the skier goes follows from gravity, snow and air.

Only the translations and the skis are solved for; inverse dynamics gives the joint moments.  With the skeleton's tree
of 31 coordinates they are multipliers of its constraints: the path is the same, later.
"""

from __future__ import annotations

import math
import time as clock
from collections.abc import Callable
from dataclasses import dataclass, field
from threading import Lock
from typing import Any, Final

import exudyn as exu
import numpy as np

from sssi_exudyn.bodies.skier.chain import PRESCRIBED
from sssi_exudyn.core.choices import Backend
from sssi_exudyn.core.errors import InputError, SimulationDiverged
from sssi_exudyn.core.frames import GRAVITY, Array, gravity_in_slope, up_in_slope
from sssi_exudyn.model.heading import check_heading
from sssi_exudyn.model.legs import check_legs
from sssi_exudyn.model.model import Model, along_snow
from sssi_exudyn.motion.motion import Motion, antenna_offset
from sssi_exudyn.simulation.assembly import CARVED_STEP, Parts, correct_motion
from sssi_exudyn.simulation.full.forces import choose_backend
from sssi_exudyn.simulation.full.forces_kernel import LOAD
from sssi_exudyn.simulation.full.heading import FullHeading
from sssi_exudyn.simulation.full.recorder import Record
from sssi_exudyn.simulation.full.series import result_from_record
from sssi_exudyn.simulation.full.system import System, build
from sssi_exudyn.simulation.heading import turned
from sssi_exudyn.simulation.posture_table import PostureTable
from sssi_exudyn.simulation.result import SimulationResult

SETTLING = 0.6
"""s of standing still on the snow before the start: free ends of skis, which vibrate longest, are at rest to 0.1 mm."""
SETTLING_STEPS = 60
"""Long steps: with no spectral radius they damp whatever is faster than they are."""
_LONGER = 10.0
_AT_REST = 0.03
"""Times as long, in as many steps, for which he stands where the snow does not carry him to such a share by then.  He
still bounces where it damps little, which longer steps damp."""
CARVED_SETTLING_STEPS = 240
"""Where edges cut: in longer ones Newton's method does not always find which edges of a light ski press."""
_LARGEST_NORM = 1e9
"""Sum of the coordinates' or rates' squares beyond which Newton's method has gone astray: a skier at 40 m/s 5 km from
the start, his skis' nodes whirling at 100 m/s, is well below.  Far beyond it no matrix can be factorised."""
Progress = Callable[[float, str], None]


def simulate(
    model: Model,
    motion: Motion,
    *,
    start: float | None = None,
    stop: float | None = None,
    tree: bool = False,
    backend: Backend = "fastest",
    progress: Progress | None = None,
) -> SimulationResult:
    """Simulate the full model from ``start`` to ``stop`` (recording's clock, s; the motion's ends if None).

    ``tree``: with the skeleton's tree instead of its mass carried by the pelvis, but where the heading is found;
    ``backend`` says how the force terms are evaluated (see ``simulation.full.forces``).  Either way the result is the
    same.

    Raises SimulationDiverged, with the partial result, when the solver gives up.
    """
    begin = clock.perf_counter()
    run, problem = integrate(model, motion, start=start, stop=stop, tree=tree, backend=backend, progress=progress)
    run.record.solver |= {"wall_s": clock.perf_counter() - begin, "backend": choose_backend(backend)}
    result = result_from_record(run.parts, run.posture, run.system, run.record)
    if problem:
        raise divergence(run, problem, result)
    return result


def antenna_path(model: Model, motion: Motion) -> tuple[Array, Array]:
    """Return times (n,) s and places (n, 3) m of the antenna along the whole motion: all that a fit needs.

    Raises SimulationDiverged as ``simulate`` does, ValueError for a motion without an antenna.
    """
    run, problem = integrate(model, motion)
    if problem:
        raise divergence(run, problem, result_from_record(run.parts, run.posture, run.system, run.record))
    time = np.array(run.record.time)
    turn = run.record.turn(up_in_slope(model.inclination)).matrices()
    return time, run.record.q[:, :3] + turned(turn, antenna_offset(run.parts.motion, time)[0])


def integrate(
    model: Model,
    motion: Motion,
    *,
    start: float | None = None,
    stop: float | None = None,
    tree: bool = False,
    backend: Backend = "fastest",
    progress: Progress | None = None,
) -> tuple[FullRun, str]:
    """Simulate as ``simulate`` does, but return the recorded states, and "" or what stopped the solver.

    Where edges cut the snow, steps are ``CARVED_STEP`` at most.  Raises InputError for another back end than the
    fastest there, and elsewhere for a heading that is to be found.
    """
    # the constraints of the tree's angles would ring with every change of the heading's acceleration
    tree = tree and not model.heading.is_found
    with _ONE_AT_A_TIME:
        run = set_up(model, motion, start=start, stop=stop, tree=tree, backend=backend, progress=progress)
        try:
            return run, run.solve()
        finally:
            run.system.release()


def set_up(
    model: Model,
    motion: Motion,
    *,
    start: float | None = None,
    stop: float | None = None,
    tree: bool = False,
    backend: Backend = "fastest",
    progress: Progress | None = None,
) -> FullRun:
    """Return a run that stands at its start, settled on the snow, as ``integrate`` begins with it."""
    check_heading(model.heading, model.terms)
    check_legs(model.legs, model.terms)
    parts = Parts(model, correct_motion(model, motion))
    t0 = motion.start if start is None else start
    t1 = motion.stop if stop is None else stop
    step = model.solver.step
    if parts.is_carved:
        if backend not in ("fastest", "compiled"):
            raise InputError("backend", backend, "edges that cut are compiled alone", "leave the back end out")
        step = min(step, CARVED_STEP)
    span = max(t1 - t0, step)
    count = math.ceil(span / step - 1e-6)  # a little shorter steps, so that the last one ends with the run
    posture = parts.posture(np.linspace(t0, t0 + span, count + 1))
    pelvis, velocity = _start_of_pelvis(parts, posture)
    coordinates = settle(parts, posture, pelvis, velocity)
    run = FullRun(parts, build(parts, posture, coordinates[:3], tree=tree, backend=backend), posture, progress)
    run.start_from(coordinates, velocity)
    return run


def divergence(run: FullRun, problem: str, result: SimulationResult) -> SimulationDiverged:
    """Return the error of a run that ``problem`` stopped, with what stands out at its end."""
    return SimulationDiverged(float(result.time[-1]), f"{problem}; {_last_state(run.parts, result)}", result)


def _last_state(parts: Parts, result: SimulationResult) -> str:
    """Say what stands out at the end of a run that stopped."""
    weight = parts.mass * GRAVITY
    angle, rate = _fastest(parts, float(result.time[-1]))
    return (
        f"the last state has {result.foot_load[-1].sum() / weight:.1f} body weights on the snow, "
        f"{100.0 * result.penetration[-1].max():.1f} cm deep at most, the pelvis at "
        f"{np.linalg.norm(result.pelvis_velocity[-1]):.1f} m/s, and {angle} turning at {np.degrees(rate):.0f} deg/s"
    )


def _fastest(parts: Parts, time: float) -> tuple[str, float]:
    """Return the prescribed coordinate that turns fastest, and its rate (rad/s)."""
    rates = parts.motion.evaluate(np.array([time]))[1][0]
    index = int(np.argmax(np.abs(rates)))
    return PRESCRIBED[index], float(rates[index])


def _start_of_pelvis(parts: Parts, posture: PostureTable) -> tuple[Array, Array]:
    """Return place and velocity of the pelvis (3,) that put the antenna, or the pelvis without one, where the model's
    start says.

    The height is a first guess (both feet's mean on the snow); the velocity along the normal is ``settle``'s.
    """
    start = parts.model.start
    place = speed = np.zeros((1, 3))
    if parts.motion.antenna is not None:
        place, speed = antenna_offset(parts.motion, posture.time[:1])
    pelvis = np.array([start.f - place[0, 0], start.l - place[0, 1], -float(np.mean(posture.foot_place[0, :, 2]))])
    velocity = np.array([start.velocity_f - speed[0, 0], start.velocity_l - speed[0, 1], 0.0])
    pelvis[2] += float(np.mean(parts.model.snow(pelvis + posture.foot_place[0])[0]))
    return pelvis, velocity


def settle(parts: Parts, posture: PostureTable, pelvis: Array, velocity: Array) -> Array:
    """Return coordinates (total values) of pelvis and skis at rest on the snow, loaded as at the start of the run, and
    as much higher as the model's start has it.

    The load along the normal is the weight's share plus what lifts the centre of mass as the posture does at the start.
    ``velocity`` (3,) is completed in place: along the normal the pelvis goes so that the feet, weighted by their loads,
    keep their depth, and as much faster as the start has it.
    """
    gravity = gravity_in_slope(parts.model.inclination)
    share = np.array([0.5, 0.5])
    system = build(parts, posture, pelvis, standing=True)
    try:
        for _ in range(2):
            lift = posture.com_acceleration[0, 2] - share @ posture.foot_acceleration[0, :, 2]
            load = parts.mass * max(-gravity[2] + lift, 0.2 * -gravity[2])
            system.press(load)
            displaced, loads = _rest(system, parts)
            if loads.sum() < 0.01 * load:  # falling; in snow that creeps, sinking still is a start
                raise SimulationDiverged(system.now.time, "the skier does not come to rest on the snow at the start")
            if not parts.is_carved and abs(loads.sum() - load) > _AT_REST * load:
                displaced, loads = _rest(system, parts, _LONGER)
            share = loads / loads.sum()
    finally:
        system.release()
    velocity[2] = along_snow(parts.model, pelvis + posture.foot_place[0], velocity, posture.foot_velocity[0], share)
    displaced[2] += parts.model.start.height
    return displaced + system.ref


def _rest(system: System, parts: Parts, longer: float = 1.0) -> tuple[Array, Array]:
    """Return the coordinates without reference in which the standing system comes to rest, and the loads (2,) N of its
    feet there.  It starts from there the next time.
    """
    steps = CARVED_SETTLING_STEPS if parts.is_carved else SETTLING_STEPS
    settings = solver_settings(parts.model, 0.0, longer * SETTLING, steps)
    settings.timeIntegration.generalizedAlpha.spectralRadius = 0.0
    if solve_system(system.mbs, settings, exu.MainSolverImplicitSecondOrder()):
        raise SimulationDiverged(system.now.time, "the skier does not come to rest on the snow at the start")
    displaced = np.array(system.mbs.systemData.GetODE2Coordinates())
    system.mbs.systemData.SetODE2Coordinates(displaced, exu.ConfigurationType.Initial)
    system.forces.evaluate(displaced, np.zeros(len(displaced)), system.now)
    return displaced, system.forces.seen[:, LOAD].copy()


def solver_settings(model: Model, start: float, stop: float, steps: int) -> Any:
    """Return Exudyn's settings of an integration from ``start`` to ``stop`` (s), which writes nothing."""
    solver = model.solver
    settings = exu.SimulationSettings()
    integration = settings.timeIntegration
    integration.startTime, integration.endTime, integration.numberOfSteps = start, stop, steps
    integration.minimumStepSize = solver.step / 16.0
    integration.generalizedAlpha.spectralRadius = solver.spectral_radius
    integration.generalizedAlpha.computeInitialAccelerations = False
    integration.newton.useModifiedNewton = True
    integration.newton.modifiedNewtonContractivity = 0.3  # a Jacobian costs as much as ten iterations
    integration.newton.maximumSolutionNorm = _LARGEST_NORM
    integration.newton.relativeTolerance = solver.relative_tolerance
    integration.newton.absoluteTolerance = solver.absolute_tolerance
    integration.verboseMode = 0
    settings.linearSolver.solverType = exu.LinearSolverType.EigenSparse
    settings.linearSolver.reuseAnalyzedPattern = True  # of one Jacobian to the next, entries have the same places
    settings.solution.file.write = False
    settings.solution.sensors.active = False
    return settings


def solve_system(mbs: Any, settings: Any, solver: Any) -> str:
    """Solve; return "" or what stopped the solver.

    Exudyn wraps whatever is raised in a callback into an error of its own, an interrupt from the keyboard too.
    """
    try:
        return "" if solver.SolveSystem(mbs, settings) else "Newton's method finds no step small enough"
    except Exception as error:
        message = str(error)
        if "KeyboardInterrupt" in message:
            raise KeyboardInterrupt from None
        if "USER FUNCTION" in message:
            raise  # a fault of this program, not of the run
        return f"the solver stopped ({message.splitlines()[0]})"


_ONE_AT_A_TIME: Final = Lock()
"""Exudyn does not say that threads may solve systems of their own at the same time, and its variables are global."""


@dataclass
class FullRun:
    """One integration: feeds the posture to the system step by step and keeps what comes out."""

    parts: Parts
    system: System
    posture: PostureTable
    progress: Progress | None
    record: Record = field(init=False)

    def __post_init__(self) -> None:
        self.record = Record(self.system, len(self.posture.time))
        self._t0 = float(self.posture.time[0])
        self._heading = FullHeading(self.parts, self._t0) if self.parts.model.heading.is_found else None
        self._step = float(self.posture.time[1]) - self._t0
        self._accepted = self._t0

    def start_from(self, coordinates: Array, velocity: Array) -> None:
        """Set the initial state: as settled, the skis moving with the feet and the pelvis with ``velocity`` (3,).

        The accelerations fit the posture's; the pelvis' is what the forces leave over after the posture's own.
        """
        system, parts, posture = self.system, self.parts, self.posture
        sign, nodes = system.skeleton.sign[3:], system.first_node
        coordinates = np.concatenate([coordinates[:3], sign * posture.angles[0, : len(sign)], coordinates[3:]])
        rates, accelerations = np.zeros(len(coordinates)), np.zeros(len(coordinates))
        rates[:3], rates[3:nodes] = velocity, sign * posture.rates[0, : len(sign)]
        force = system.forces.evaluate(coordinates - system.ref, rates, system.now)[:3].copy()
        force += parts.body_mass * (gravity_in_slope(parts.model.inclination) - posture.com_acceleration[0])
        accelerations[:3], accelerations[3:nodes] = force / parts.mass, sign * posture.accelerations[0, : len(sign)]
        data, initial = system.mbs.systemData, exu.ConfigurationType.Initial
        data.SetODE2Coordinates(list(coordinates - system.ref), initial)
        data.SetODE2Coordinates_t(list(rates), initial)
        data.SetODE2Coordinates_tt(list(accelerations), initial)
        system.forces.accept()
        if self._heading is not None:
            self._heading.ahead(posture, 0)
            self._heading.accept(system.forces)

    def solve(self) -> str:
        """Integrate to the end; "" or what went wrong."""
        mbs, model = self.system.mbs, self.parts.model
        mbs.SetPreStepUserFunction(self.before_step)
        mbs.SetPostStepUserFunction(self.after_step)
        steps = len(self.posture.time) - 1
        settings = solver_settings(model, self._t0, float(self.posture.time[-1]), steps)
        solver = exu.MainSolverImplicitSecondOrder()
        problem = solve_system(mbs, settings, solver)
        self.record.statistics(solver)
        return problem

    def before_step(self, _mbs: Any, t: float) -> bool:
        """Bring the posture, and what the skis left in the snow, to ``t`` (s), the end of the step to be solved."""
        row = round((t - self._t0) / self._step)
        posture = self.posture
        if not (row < len(posture.time) and abs(t - posture.time[row]) < 1e-9):  # the solver has cut the step
            posture, row = self.parts.posture(np.array([t])), 0
        if self._heading is not None:
            posture, row = self._heading.ahead(posture, row), 0
        self.system.advance(posture, row)
        self.system.forces.bring_memory(max(t - self._accepted, 0.0))
        return True

    def after_step(self, _mbs: Any, t: float) -> bool:
        """Keep the state and the forces at ``t`` (s), the end of a step."""
        self.record.take(t)
        self.record.keep_forces(self.system.now)
        if self._heading is not None:
            self.record.headings.append(self._heading.accept(self.system.forces))
        self.system.forces.accept()
        self._accepted = t
        if self.progress is not None:
            span = float(self.posture.time[-1]) - self._t0
            self.progress((t - self._t0) / span, f"{t:.1f} s")
        return True
