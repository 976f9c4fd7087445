"""The reduced model on snow that edges cut: the captured posture, and skis that give against their feet.

The skis are free to find their own way below the feet, and the whole skier about gravity where the model says so
(``heading``).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from sssi_exudyn.bodies.ski.mesh import BeamMesh, mesh
from sssi_exudyn.bodies.ski.modes import damping_time, modal_ski
from sssi_exudyn.contact.codegen.compiled import law_parameters
from sssi_exudyn.core.errors import SimulationDiverged
from sssi_exudyn.core.frames import Array
from sssi_exudyn.model.model import Model, along_snow
from sssi_exudyn.simulation.assembly import CARVED_STEP, COARSE_CARVED_STEP, snow_grid
from sssi_exudyn.simulation.heading import Turn
from sssi_exudyn.simulation.reduced.carved_rest import bend_at_rest, rest_height
from sssi_exudyn.simulation.reduced.carved_steps_kernel import (
    CarvedSeries,
    CarvedState,
    CarvedSystem,
    CarvedWork,
    Coupling,
    Joint,
)
from sssi_exudyn.simulation.reduced.edge_setup import MODES, POINTS, bending_edges, carving_module
from sssi_exudyn.simulation.reduced.prepared import Prepared, ReducedRun, first_place, load_at_start, reduced_run
from sssi_exudyn.simulation.result import side_reserve
from sssi_exudyn.simulation.ski_on_snow.boot_joint import BootJoint, boot_joint
from sssi_exudyn.simulation.ski_on_snow.edge import EdgeWork
from sssi_exudyn.simulation.ski_on_snow.heading_kernel import SolvedHeading
from sssi_exudyn.simulation.ski_on_snow.structs import Groove, PrescribedMotion, ReducedSeries

COARSE_POINTS: Final = 50
"""Contact points on each edge where steps are coarse: a ski goes on by less than their distance, too."""
COARSE_MODES: Final = 8
"""Vibrations of each ski there: with step and points they move a run of 6 s by 0.1 to 0.2 m."""
SHARE: Final = np.array([0.5, 0.5])
"""(2,) of the load at the start by foot."""
ORDER: Final = 2
"""Of the skis' steps."""
COARSE_ORDER: Final = 1
"""Where steps are coarse, for fits: it damps how a ski chatters that hardly touches the snow, by which derivatives over
many seconds would grow without end."""
GIVING: Final = 2
"""Vibrations more than of a ski that is held fast: its boot centre heaves and pitches."""


@dataclass(frozen=True)
class CarvedRun:
    """A run on snow that edges cut, n instants.

    run : as every run of the reduced model
    yaw, roll : (n, 2) rad of the skis against the captured feet, > 0 to the left and to the right edge
    heave, pitch : (n, 2) m, rad of the same, > 0 up and tip down
    friction, skid, pressing : (n,) W that the snow takes along the edges, across them, and by being pressed in
    side_reserve : (n, 2) share of what the wall bears along a ski's edge that is not used; 0 off the snow
    """

    run: ReducedRun
    yaw: Array
    roll: Array
    heave: Array
    pitch: Array
    friction: Array
    skid: Array
    pressing: Array
    side_reserve: Array

    @property
    def heading(self) -> Array:
        """(n,) rad of the whole skier against the captured heading, > 0 to the left"""
        return self.run.heading[:, 0]


@dataclass(frozen=True)
class CarvedMoment:
    """A run with the captured heading at one instant: all that its further course depends on.

    time : s;  place, velocity : (3,) m, m/s of the pelvis
    bent, bending : (2, 2 + k) yaw, roll and vibrations of the skis, heave and pitch in the latter, and their rates
    memory : of the snow, as it was left
    """

    time: float
    place: Array
    velocity: Array
    bent: Array
    bending: Array
    memory: Groove

    def state(self) -> CarvedState:
        """Return the state as the kernel takes it, and changes it."""
        return CarvedState.begin(self.place, self.velocity, self.bent)._replace(
            bending=self.bending.copy(), old_bending=self.bending.copy()
        )

    def copy_memory(self) -> Groove:
        """Return the snow's memory, for the kernel to change."""
        return Groove(*(array.copy() for array in self.memory))


@dataclass(frozen=True)
class Carved:
    """What a run is made of, as the kernel takes it, and what it left.

    at, captured : the tables, the capture corrected, turned as the run did and not
    begin : the run at its first instant
    memory : of the snow, as the run left it
    """

    at: Prepared
    captured: Prepared
    system: CarvedSystem
    heading: SolvedHeading
    begin: CarvedMoment
    memory: Groove
    series: CarvedSeries

    @property
    def points(self) -> int:
        """Contact points on each edge."""
        return len(self.system.ski.width)

    @property
    def modes(self) -> int:
        """Vibrations of each ski."""
        return len(self.system.ski.omega)

    def end(self) -> CarvedMoment:
        """Return the run at its last instant."""
        series = self.series
        return CarvedMoment(
            time=float(self.at.time[-1]),
            place=series.place[-1].copy(),
            velocity=series.velocity[-1].copy(),
            bent=series.bent[-1].copy(),
            bending=series.bending[-1].copy(),
            memory=self.memory,
        )

    def work(self) -> CarvedWork:
        """Make room for the kernel."""
        return CarvedWork.room(EdgeWork.room(self.points, self.modes), self.modes)


def simulate_carved(model: Model, prepared: Prepared, joint: BootJoint | None = None) -> CarvedRun:
    """Simulate a run.  Raises SimulationDiverged when no rest is found at the start or Newton's method fails later."""
    done = carved_run(model, prepared, joint)
    series = done.series
    given = series.bent[..., 2:] @ done.system.ski.give.T
    return CarvedRun(
        run=reduced_run_of(done),
        yaw=series.bent[..., 0],
        roll=series.bent[..., 1],
        heave=given[..., 0],
        pitch=given[..., 1],
        friction=series.power[:, 0],
        skid=series.power[:, 1],
        pressing=series.power[:, 2],
        side_reserve=side_reserve(series.reserve[..., 0], series.reserve[..., 1]),
    )


def carved_run(
    model: Model, prepared: Prepared, joint: BootJoint | None = None, begin: CarvedMoment | None = None
) -> Carved:
    """Simulate a run; return all that it was made of.

    begin : of a run that goes on, at the tables' first instant; None for a skier at rest on fresh snow, apart from his
        speed.  A heading that is solved for begins as captured, so that no such run can go on.

    Raises SimulationDiverged as ``simulate_carved`` does.
    """
    at, kernel = prepared.correct_capture(model), carving_module()
    system = _carved_system(model, at, joint or boot_joint(model.equipment))
    points, modes = len(system.ski.width), len(system.ski.omega)
    work = CarvedWork.room(EdgeWork.room(points, modes), modes)
    if begin is None:
        begin = _at_rest(model, at, system, work)
    series, heading, memory = _empty_series(len(at.time), modes), _kernel_heading(model, at), begin.copy_memory()
    if heading.solved:
        system = system._replace(motion=_copy_turned(system.motion))
    reached = kernel.run_carved(system, heading, begin.state(), memory, work, series)
    if reached < len(at.time):
        raise SimulationDiverged(float(at.time[reached]), "Newton's method does not converge on snow that edges cut")
    turned = at.turn(Turn.of(at.up, heading.angle)) if heading.solved else at
    return Carved(turned, at, system, heading, begin, memory, series)


def _at_rest(model: Model, at: Prepared, system: CarvedSystem, work: CarvedWork) -> CarvedMoment:
    """Return the start of a run, at rest on fresh snow apart from its speed.

    Raises SimulationDiverged where there is no rest.
    """
    kernel, points, modes = carving_module(), len(system.ski.width), len(system.ski.omega)
    memory, bent = Groove.fresh(2, 2, points), np.zeros((2, 2 + modes))
    place, velocity = first_place(model, at)
    load = float(load_at_start(at, SHARE))
    place[2] = rest_height(kernel, system, place, load, memory, work)
    if not np.isfinite(place[2]) or not bend_at_rest(kernel, system, place, load, bent, memory, work):
        raise SimulationDiverged(float(at.time[0]), "the skier does not come to rest on the snow at the start")
    velocity[2] = along_snow(model, place + at.foot_place[0], velocity, at.foot_velocity[0], SHARE)
    place[2] += model.start.height
    return CarvedMoment(float(at.time[0]), place, velocity, bent, np.zeros_like(bent), Groove.fresh(2, 2, points))


def _carved_system(model: Model, at: Prepared, joint: BootJoint) -> CarvedSystem:
    """Return laws, skis, joints and posture as the kernel takes them; coarser skis for coarse steps."""
    coarse = at.step > 0.5 * (CARVED_STEP + COARSE_CARVED_STEP)
    points, fast, order = (COARSE_POINTS, COARSE_MODES, COARSE_ORDER) if coarse else (POINTS, MODES, ORDER)
    cut = mesh(model.ski, contacts=points, cutting=True)
    modal = modal_ski(cut, fast + GIVING, (joint.heave_stiffness, joint.pitch_stiffness))
    edges = bending_edges(cut, modal)
    base = np.array([0.0, 0.0, -float(model.ski.height(model.ski.s_of_x(0.0)))])
    return CarvedSystem(
        parameters=law_parameters(model.terms),
        ski=edges._replace(points=edges.points + base),
        coupling=Coupling(*(np.ascontiguousarray(part) for part in np.hsplit(modal.participation, 2))),
        joint=_kernel_joint(joint, cut),
        motion=at.kernel_motion(),
        surface=snow_grid(model.surface),
        order=order,
    )


def _kernel_joint(joint: BootJoint, cut: BeamMesh) -> Joint:
    """Return the joint as the kernel takes it, at rest where the capture has the foot."""
    stiffness, damping = joint.stiffness, joint.damping
    return Joint(
        stiffness=stiffness[:2],
        damping=damping[:2],
        inertia=joint.inertia[:2],
        rest=np.zeros((2, 2)),
        slowing=damping[2:] - damping_time(cut) * stiffness[2:],
    )


def _kernel_heading(model: Model, at: Prepared) -> SolvedHeading:
    """Return the skier's heading as the kernel takes it, its tables not shared with others."""
    held, whole = model.heading, at.whole_body()
    return SolvedHeading(
        solved=int(held.is_found),
        stiffness=held.stiffness if held.mode == "track" else 0.0,
        damping_ratio=held.damping_ratio,
        up=at.up,
        held=at.held,
        inertia=whole.inertia @ at.up @ at.up,
        momentum=whole.momentum @ at.up,
        com_place=whole.place,
        com_velocity=whole.velocity,
        exposed_swing=at.exposed_swing.copy(),
        angle=np.zeros((len(at.time), 3)),
        moment=np.zeros(len(at.time)),
    )


def _copy_turned(motion: PrescribedMotion) -> PrescribedMotion:
    """Return the posture with copies of all that a heading turns."""
    names = ("foot_place", "foot_velocity", "foot_rotation", "foot_spin", "exposed_velocity", "exposed_facing")
    more = ("ski_acceleration", "ski_turning", "com_place", "com_velocity", "carried")
    return motion._replace(**{name: getattr(motion, name).copy() for name in (*names, *more)})


def _empty_series(count: int, modes: int) -> CarvedSeries:
    bent = np.zeros((2, count, 2, 2 + modes))
    three, pair = np.zeros((2, count, 3)), np.zeros((5, count, 2))
    by_ski = np.zeros((3, count, 2, 3))
    return CarvedSeries(
        place=three[0],
        velocity=three[1],
        bent=bent[0],
        bending=bent[1],
        acceleration=np.zeros((count, 7 + 2 * modes)),
        loads=pair[0],
        sole=pair[1],
        edges=pair[2],
        friction=by_ski[0],
        force=by_ski[1],
        moment=by_ski[2],
        power=np.zeros((count, 3)),
        reserve=np.zeros((count, 2, 2)),
    )


def reduced_run_of(done: Carved) -> ReducedRun:
    """Return the run that the kernel filled, as every run of the reduced model."""
    series, at = done.series, done.at
    yaw, foot = series.bent[..., 0], at.foot_rotation
    forward = np.cos(yaw)[..., None] * foot[..., 0] + np.sin(yaw)[..., None] * foot[..., 1]
    kept = ReducedSeries(
        series.place, series.velocity, series.loads, series.sole, series.friction, series.edges, series.force,
        series.moment,
    )  # fmt: skip
    return replace(reduced_run(at, kept, len(at.time)), foot_forward=forward, heading=done.heading.angle)
