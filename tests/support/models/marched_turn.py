"""A second computation of a steady turn: the law called as it is written, point after point from the tip to the tail.

In a steady turn each point meets the groove that the point before it left, so no time is needed.  The offset grows from
point to point by the mean of both drifts.
"""

from __future__ import annotations

import numpy as np

from sssi_exudyn.contact.codegen.compiled import law_parameters
from sssi_exudyn.contact.maths import FloatMath
from sssi_exudyn.contact.term import EdgeState
from sssi_exudyn.contact.terms.carving import Carving
from sssi_exudyn.core.frames import Array
from sssi_exudyn.simulation.reduced.edge_setup import carving_module
from sssi_exudyn.simulation.turns.steady_turn import Rolling, SteadyTurn
from sssi_exudyn.simulation.turns.turn_kernel import Turn


def marched_forces(turn: SteadyTurn, rolling: Rolling) -> tuple[Array, Array]:
    """Return the turn's force (3,) N and moment (3,) N m about the boot centre, and the modes' forces (k,) N.

    x is along the ski and z along the snow's normal.  Shape and motion are those of ``rolling``.
    """
    law, speed, ski, sought = turn.case.law, turn.case.speed, rolling.ski, rolling.state.sought
    assert isinstance(law, Carving)
    frame = _pitched(sought[3]) @ _rolled(-turn.case.edge)
    arms = (ski.points + ski.shape @ sought[4:]) @ frame.T
    tangents = (ski.tangents + ski.turning @ sought[4:]) @ frame.T
    depths = -sought[2] - arms[..., 2]
    groove, offset = np.zeros(2), np.zeros(2)
    total, moment, modal = np.zeros(3), np.zeros(3), np.zeros(len(ski.omega))
    gaps, ahead = np.diff(ski.station), None
    for i in range(len(ski.width))[::-1]:
        low = int(np.argmax(depths[i]))
        edge = np.arcsin((depths[i, 1] - depths[i, 0]) / ski.width[i])
        tangent = tangents[i, low] / np.linalg.norm(tangents[i, low])
        t = np.array([tangent[0], tangent[1], 0.0]) / np.hypot(*tangent[:2])
        n = np.array([-t[1], t[0], 0.0])
        velocity = np.array([speed, sought[0], 0.0]) + np.cross([0.0, 0.0, sought[1]], arms[i, low])
        drift = velocity @ n
        step = gaps[min(i, len(gaps) - 1)] / (velocity @ t)
        arrived = offset[low] if ahead is None else offset[low] + 0.5 * step * (ahead - drift)
        ahead = drift
        state = EdgeState(
            depths[i, low], depths[i, 1 - low], 0.0, ski.width[i], groove[low], arrived, step, velocity @ t, drift,
            tangent[2], edge, ski.length[i],
        )  # fmt: skip
        normal, along, across, upper = law.force(FloatMath(), state)
        groove, offset = np.zeros(2), np.zeros(2)
        groove[low], offset[low] = law.remember(FloatMath(), state)
        for side, force in (
            (low, along * t + across * n + [0.0, 0.0, normal - upper]),
            (1 - low, np.array([0.0, 0.0, upper])),
        ):
            total += force
            moment += np.cross(arms[i, side], force)
            modal += (frame.T @ force) @ ski.shape[i, side]
    return np.concatenate([total, moment]), modal


def mean_motion(turn: SteadyTurn, rolling: Rolling, seconds: float) -> Rolling:
    """Return the ski in its mean shape and motion over so many seconds more."""
    on, case = rolling.copied(), turn.case
    step = float(np.diff(on.ski.station).min()) / case.speed
    edge, kernel, parameters = np.array([case.edge]), carving_module(), law_parameters((case.law,))
    given = Turn(edge, np.tan(edge - case.angulation), case.load, case.speed, step, case.pressure)
    mean, steps = np.zeros_like(on.state.sought), round(seconds / step)
    for _ in range(steps):
        kernel.follow_turn(parameters, on.ski, given, on.state, on.memory, on.work, np.zeros((1, 4)))
        mean += on.state.sought / steps
    on.state.sought[:] = mean
    return on


def _rolled(angle: float) -> Array:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])


def _pitched(angle: float) -> Array:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
