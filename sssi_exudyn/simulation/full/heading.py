"""The skier's heading in a run of the full model: solved for at every step, as the reduced model does."""

from __future__ import annotations

from typing import Final

import numpy as np

from sssi_exudyn.core.frames import Array, cross, up_in_slope
from sssi_exudyn.simulation.assembly import Parts
from sssi_exudyn.simulation.full.carved_forces_kernel import PUSHED, TWISTED
from sssi_exudyn.simulation.full.forces import Forces
from sssi_exudyn.simulation.heading import HEADING, Turn, WholeBody, turned, whole_body
from sssi_exudyn.simulation.posture_table import PostureTable
from sssi_exudyn.simulation.ski_on_snow.heading_kernel import next_heading

_STILL: Final = (0.0, 0.0, 0.0)


class FullHeading:
    """By how much the posture is turned about gravity at the accepted step, and at the one that is being solved."""

    def __init__(self, parts: Parts, start: float) -> None:
        held = parts.model.heading
        self._parts, self._up = parts, up_in_slope(parts.model.inclination)
        self._stiffness = held.stiffness if held.mode == "track" else 0.0
        self._ratio = held.damping_ratio
        self._accepted, self._last, self._given = start, _STILL, 0.0
        self._before = (0.0, 0.0)
        self._trial = _STILL
        self._posture: PostureTable
        self._whole: WholeBody

    def ahead(self, captured: PostureTable, row: int) -> PostureTable:
        """Return the posture of a row, turned as it will be then: a table of one row."""
        one = captured.rows(np.array([row]))
        self._whole = whole_body(one, self._parts.body_mass, self._parts.ski)
        step = float(one.time[0]) - self._accepted
        if step > 0.0:
            before = (*self._before, self._given)
            self._trial = next_heading(self._stiffness, self._ratio, step, self._last, before, self._now())
        self._posture = one.turn(Turn(self._up, *np.array(self._trial)[:, None]), self._parts.body_mass)
        return self._posture

    def accept(self, forces: Forces) -> Array:
        """Take the step whose forces are those of the last pass; (3,) rad, rad/s, rad/s² of the heading then."""
        at = self._posture
        self._accepted, self._last = float(at.time[0]), self._trial
        self._before = self._now()
        turn = Turn(self._up, *np.array(self._trial)[:, None])
        com = turned(turn.matrices(), self._whole.place)[0]
        pushed, twisted = forces.seen[:, PUSHED : PUSHED + 3], forces.seen[:, TWISTED : TWISTED + 3]
        moment = np.sum(cross(at.foot_place[0] - com, pushed) + twisted, axis=0)
        moment += cross(at.com_place[0] - com, forces.body)
        drag = forces.drag[:, :3]
        self._given = float(self._up @ (moment - cross(com, drag.sum(axis=0))))
        self._given += float(np.sum(drag * at.exposed_jacobian[0, ..., HEADING]))
        return np.array(self._trial)

    def _now(self) -> tuple[float, float]:
        """Return the inertia (kg m²) of skier and skis about the vertical, and their captured momentum (N m s)."""
        return float(self._up @ self._whole.inertia[0] @ self._up), float(self._up @ self._whole.momentum[0])
