"""The reduced model on snow that edges cut: the captured posture, and skis that yaw and roll against their feet.

The skier's heading is the captured one; only the skis are free to find their own way below it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from sssi_exudyn.bodies.ski.mesh import mesh
from sssi_exudyn.bodies.ski.modes import modal_ski
from sssi_exudyn.contact.backends.carved_run_kernel import CarvedSeries, Coupling, Joint
from sssi_exudyn.contact.backends.compiled import law_parameters
from sssi_exudyn.contact.backends.groove_kernel import Groove
from sssi_exudyn.contact.backends.structs import ReducedSeries
from sssi_exudyn.core.errors import SimulationDiverged
from sssi_exudyn.core.frames import Array
from sssi_exudyn.model.model import Model, along_snow
from sssi_exudyn.simulation.assembly import CARVED_STEP, COARSE_CARVED_STEP, snow_grid
from sssi_exudyn.simulation.boot_joint import BootJoint, boot_joint
from sssi_exudyn.simulation.prepared import Prepared, ReducedRun, first_place, load_at_start, reduced_run
from sssi_exudyn.simulation.steady_turn import MODES, POINTS, carving_module, edge_work, edges_of

COARSE_POINTS: Final = 50
"""Contact points on each edge where steps are coarse: a ski goes on by less than their distance, too."""
COARSE_MODES: Final = 8
"""Vibrations of each ski there: with step and points they move a run of 6 s by 0.1 to 0.2 m."""


@dataclass(frozen=True)
class CarvedRun:
    """A run on snow that edges cut, n instants.

    run : as every run of the reduced model
    yaw, roll : (n, 2) rad of the skis against the captured feet, > 0 to the left and to the right edge
    friction, skid, pressing : (n,) W that the snow takes along the edges, across them, and by being pressed in
    side_reserve : (n, 2) share of what the wall bears along a ski's edge that is not used; 0 off the snow
    """

    run: ReducedRun
    yaw: Array
    roll: Array
    friction: Array
    skid: Array
    pressing: Array
    side_reserve: Array


def simulate_carved(model: Model, prepared: Prepared, joint: BootJoint | None = None) -> CarvedRun:
    """One run.  Raises SimulationDiverged when no rest is found at the start or Newton's method fails on the way."""
    at = prepared.correct_capture(model)
    kernel = carving_module()
    parameters, motion, surface = law_parameters(model.terms), at.kernel_motion(), snow_grid(model.surface)
    coarse = at.step > 0.5 * (CARVED_STEP + COARSE_CARVED_STEP)
    points, modes = (COARSE_POINTS, COARSE_MODES) if coarse else (POINTS, MODES)
    edges = edges_of(model.ski, points, modes)
    base = np.array([0.0, 0.0, -float(model.ski.height(model.ski.s_of_x(0.0)))])
    ski = edges._replace(points=edges.points + base)
    participation = modal_ski(mesh(model.ski), modes).participation
    coupling = Coupling(np.ascontiguousarray(participation[:, :3]), np.ascontiguousarray(participation[:, 3:]))
    memory, work = Groove(*np.zeros((8, 2, 2, points))), edge_work(points, modes)
    place, velocity = first_place(model, at)
    share = np.array([0.5, 0.5])
    load = float(load_at_start(at, share))
    place[2] = kernel.rest_height(parameters, ski, motion, surface, place, load, memory, work)
    held = _kernel_joint(joint or boot_joint(model.equipment))
    bent = np.zeros((2, 2 + modes))
    if not np.isfinite(place[2]) or not kernel.bend_at_rest(
        parameters, ski, coupling, held, motion, surface, place, load, bent, memory, work
    ):
        raise SimulationDiverged(float(at.time[0]), "the skier does not come to rest on the snow at the start")
    velocity[2] = along_snow(model, place + at.foot_place[0], velocity, at.foot_velocity[0], share)
    series = _empty_series(len(at.time))
    done = kernel.run_carved(
        parameters, ski, coupling, held, motion, surface, place, velocity, bent, memory, work, series
    )
    if done < len(at.time):
        raise SimulationDiverged(float(at.time[done]), "Newton's method does not converge on snow that edges cut")
    return _run_of(at, series)


def _kernel_joint(joint: BootJoint) -> Joint:
    """The joint as the kernel takes it, at rest where the capture has the foot."""
    return Joint(joint.stiffness, joint.damping, joint.inertia, np.zeros((2, 2)))


def _empty_series(count: int) -> CarvedSeries:
    three, pair = np.zeros((2, count, 3)), np.zeros((5, count, 2))
    by_ski = np.zeros((3, count, 2, 3))
    return CarvedSeries(
        place=three[0],
        velocity=three[1],
        turned=np.zeros((count, 2, 2)),
        loads=pair[0],
        sole=pair[1],
        edges=pair[2],
        friction=by_ski[0],
        force=by_ski[1],
        moment=by_ski[2],
        power=np.zeros((count, 3)),
        reserve=np.zeros((count, 2, 2)),
    )


def _run_of(at: Prepared, series: CarvedSeries) -> CarvedRun:
    yaw = series.turned[..., 0]
    foot = at.foot_rotation
    forward = np.cos(yaw)[..., None] * foot[..., 0] + np.sin(yaw)[..., None] * foot[..., 1]
    kept = ReducedSeries(
        series.place, series.velocity, series.loads, series.sole, series.friction, series.edges, series.force,
        series.moment,
    )  # fmt: skip
    run = replace(reduced_run(at, kept, len(at.time)), foot_forward=forward)
    most, used = series.reserve[..., 0], series.reserve[..., 1]
    return CarvedRun(
        run=run,
        yaw=yaw,
        roll=series.turned[..., 1],
        friction=series.power[:, 0],
        skid=series.power[:, 1],
        pressing=series.power[:, 2],
        side_reserve=np.where(most > 0.0, 1.0 - used / np.where(most > 0.0, most, 1.0), 0.0),
    )
