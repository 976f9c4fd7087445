"""What a run of the full model leaves: states step by step, turned into time series, forces and energies afterwards."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from sssi_exudyn.bodies.skier.skeleton import Skeleton
from sssi_exudyn.core.frames import Array
from sssi_exudyn.simulation.full.snow_wrench import wrench_on_nodes
from sssi_exudyn.simulation.full.system import FREE, System
from sssi_exudyn.simulation.heading import Turn
from sssi_exudyn.simulation.ski_on_snow.structs import Instant

_TOGETHER: Final = 200
"""Steps whose forces on the skis' nodes are summed up at once: one by one it takes as long as the forces themselves."""


class Record:
    """States and multipliers at the end of every accepted step, ``steps`` of them or more.

    headings : (3,) each, rad, rad/s, rad/s² by which the posture was turned; empty where the captured heading was kept
    """

    def __init__(self, system: System, steps: int) -> None:
        self._data = system.mbs.systemData
        skeleton = system.skeleton
        joints = self._data.GetObjectLTGAE(skeleton.constraint) if isinstance(skeleton, Skeleton) else []
        self._joints = np.array(joints, dtype=np.intp)
        held = np.array(system.clamps)
        self._held = held != FREE
        self._clamps = np.array([int(self._data.GetObjectLTGAE(int(c))[0]) for c in held[self._held]], dtype=np.intp)
        self._forces = system.forces
        self._skis = slice(system.first_node, None)
        self._sign = system.skeleton.sign[3:]
        self._states = np.empty((2, steps, len(system.ref)))
        self._on_nodes = np.empty((_TOGETHER, len(system.ref) - system.first_node))
        self._on_skis: list[Array] = []
        self.time: list[float] = []
        self.moments: list[Array] = []
        self.pull: list[Array] = []
        self.clamps: list[Array] = []
        self.feet: list[Array] = []
        self.drag: list[Array] = []
        self.body: list[Array] = []
        self.headings: list[Array] = []
        self.solver: dict[str, int | float | str] = {}

    @property
    def q(self) -> Array:
        """(n, coordinates) without the reference."""
        return self._states[0, : len(self.time)]

    @property
    def v(self) -> Array:
        """(n, coordinates) rates."""
        return self._states[1, : len(self.time)]

    def take(self, t: float) -> None:
        """Keep the current state, the pelvis' acceleration (m/s²) and the multipliers.

        What a constraint does to its coordinate is minus its multiplier.
        """
        row = len(self.time)
        if row == self._states.shape[1]:  # the solver has cut steps
            self._states = np.concatenate([self._states, np.empty_like(self._states)], axis=1)
        own = self._states.shape[2]  # a system that was changed in Exudyn has further coordinates after these
        self._states[0, row] = self._data.GetODE2Coordinates(copy=False)[:own]
        self._states[1, row] = self._data.GetODE2Coordinates_t(copy=False)[:own]
        self.time.append(t)
        self.pull.append(np.array(self._data.GetODE2Coordinates_tt(copy=False)[:3]))
        multipliers = np.asarray(self._data.GetAECoordinates(copy=False))
        self.moments.append(-self._sign * multipliers[self._joints])
        clamps = np.zeros(self._held.shape)
        clamps[self._held] = -multipliers[self._clamps]
        self.clamps.append(clamps)
        if row == 1:  # the first state was set, not solved for, and came without multipliers
            self.moments[0], self.clamps[0] = self.moments[1], self.clamps[1]

    def keep_forces(self, at: Instant) -> None:
        """Keep what the skis and the air do at the state that was taken last; it may depend on those before."""
        self._forces.evaluate(self.q[-1], self.v[-1], at)
        for kept, now in (
            (self.feet, self._forces.seen),
            (self.drag, self._forces.drag),
            (self.body, self._forces.body),
        ):
            kept.append(now.copy())
        step = (len(self.feet) - 1) % _TOGETHER
        self._on_nodes[step] = self._forces.out[self._skis]
        if step == _TOGETHER - 1:
            self._on_skis.append(self._wrenches(_TOGETHER))

    def _wrenches(self, steps: int) -> Array:
        """Return the wrenches (steps, 2, 6) on the skis in the last steps, the first of those whose forces are held."""
        first = len(self.feet) - steps
        states = self.q[first : first + steps] + self._forces.ref
        return wrench_on_nodes(self._on_nodes[:steps], states[:, self._skis])

    @property
    def on_skis(self) -> Array:
        """(n, 2, 6) N and N m: resultant of the forces on each ski's nodes about the foot's place, in its frame."""
        return np.concatenate([*self._on_skis, self._wrenches(len(self.feet) % _TOGETHER)])

    def turn(self, up: Array) -> Turn:
        """Return by how much the posture was turned about gravity at every state; ``up`` (3,) is against gravity."""
        if not self.headings:
            return Turn(up, *np.zeros((3, len(self.time))))
        return Turn.of(up, np.array(self.headings))

    def statistics(self, solver: Any) -> None:
        """Keep the solver's counts."""
        self.solver = {
            "steps": int(solver.it.currentStepIndex),
            "newton_iterations": int(solver.it.newtonStepsCount),
            "jacobians": int(solver.it.newtonJacobiCount),
        }
