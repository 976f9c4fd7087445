"""One ski in a steady turn on snow that its edge cuts: the radius that it runs at an edge angle, and how safely.

The ski is the modal one, held at the boot centre.  Given are the edge angle of the sole, the load along the snow's
normal, the lean of the resultant, where the load acts on the ski, and the speed; found are sinking, pitch, sideslip,
yaw rate and the ski's bend, by letting the ski run until its turn is steady.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any, Final

import numpy as np

from sssi_exudyn.bodies.ski.mesh import mesh
from sssi_exudyn.bodies.ski.modes import modal_ski
from sssi_exudyn.bodies.ski.ski import Ski
from sssi_exudyn.contact.codegen.compiled import law_parameters
from sssi_exudyn.contact.term import EdgeTerm
from sssi_exudyn.contact.terms.carving import Carving
from sssi_exudyn.core.errors import SssiError
from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.quantity import quantity
from sssi_exudyn.simulation.reduced.edge_setup import MODES, POINTS, bending_edges, carving_module
from sssi_exudyn.simulation.ski_on_snow.edge import EdgeSki, EdgeWork
from sssi_exudyn.simulation.ski_on_snow.structs import Groove
from sssi_exudyn.simulation.turns.turn_kernel import Turn, TurnState

_FIRST_EDGE: Final = np.radians(10.0)
"""rad; from which a ski is edged further as it runs."""
_ROLLING: Final = 0.1
"""Lengths of the ski over which it is edged by a degree."""
_CHUNK: Final = 1.0
"""Lengths of the ski after which it is seen whether the turn has become steady."""
_STEADY: Final = 2e-3
"""Share by which the curvature may change over that way."""
_LONGEST: Final = 8
"""Such ways at most; then the mean of the last quarter is taken."""
_DEEPEST: Final = 0.05
"""m; deeper, an edge no longer meets the snow that the law is for."""


class NoSteadyTurn(SssiError):
    """The ski finds no turn in which the equations are met, or sinks deeper than the law of the snow goes."""


@dataclass(frozen=True)
class TurnCase:
    """What is given.

    law : the snow's
    """

    edge: float = quantity(
        np.pi / 4.0, "rad", low=np.radians(5.0).item(), high=np.radians(75.0).item(), source="chosen",
        meaning="edge angle of the sole against the snow",
    )  # fmt: skip
    law: EdgeTerm = field(default_factory=Carving)
    speed: float = quantity(10.0, "m/s", low=0.5, high=40.0, source="chosen", meaning="speed along the ski")
    load: float = quantity(
        700.0, "N", low=10.0, high=5000.0, source="chosen: a skier on one ski", meaning="load along the snow's normal"
    )
    pressure: float = quantity(
        0.0, "m", low=-0.3, high=0.3, source="chosen", meaning="where the load acts, ahead of the boot centre"
    )
    angulation: float = quantity(
        0.0, "rad", low=-0.5, high=0.5, source="chosen: the resultant is square to the base",
        meaning="edge angle less the lean of the resultant",
    )  # fmt: skip


@dataclass(frozen=True)
class SteadyTurn:
    """A steady turn to the left.

    curvature : 1/m, of the boot centre's path;  wobble : 1/m, its standard deviation where it never settles
    sideslip : velocity across the ski over that along it, > 0 where the ski points into the turn
    sinking, pitch : m, rad of the boot centre
    normal, lateral, resistance : N, of the snow along its normal, to the inside, and backwards along the ski
    side_reserve : share of what the groove's wall bears along the edge that is not used
    power : W that the skier gives: the work of the snow's force and moment on the ski, reversed
    friction, compaction, skid : W that the snow takes; together they are the power
    place : (m,) m along the ski, ahead of the boot centre
    pressure, across, most : (m,) N/m of edge: along the normal, to the inside, and what the wall bears at most
    depth, groove : (m,) m of the edge and of the groove that it leaves;  offset : (m,) m from the groove's wall
    slip : (m,) m/s across the edge, to the left;  local_edge : (m,) rad;  all 0 where the edge is out of the snow
    """

    case: TurnCase
    curvature: float
    wobble: float
    sideslip: float
    sinking: float
    pitch: float
    normal: float
    lateral: float
    resistance: float
    side_reserve: float
    power: float
    friction: float
    compaction: float
    skid: float
    place: Array
    pressure: Array
    across: Array
    most: Array
    depth: Array
    groove: Array
    offset: Array
    slip: Array
    local_edge: Array

    @property
    def drag(self) -> float:
        """N, of the snow against the path of the boot centre: the resistance, and the lateral force's part on a path
        that leads out of the ski's direction by the sideslip.
        """
        return (self.resistance + self.lateral * self.sideslip) / float(np.hypot(1.0, self.sideslip))

    @property
    def radius(self) -> float | None:
        """m; None where the ski slips out of the turn."""
        return 1.0 / self.curvature if self.curvature > 0.0 else None


@dataclass(frozen=True)
class Rolling:
    """A ski as it runs: what the kernel keeps from step to step, and the edge angle (rad) reached."""

    ski: EdgeSki
    state: TurnState
    memory: Groove
    work: EdgeWork
    edge: float

    def copied(self) -> Rolling:
        """Return the same, to run on without this one."""
        return Rolling(self.ski, _copy(self.state), _copy(self.memory), _copy(self.work), self.edge)


def _copy(arrays: Any) -> Any:
    return type(arrays)(*(array.copy() for array in arrays))


def edges_of(ski: Ski, points: int = POINTS, modes: int = MODES) -> EdgeSki:
    """Return a ski's edges as the kernel takes them."""
    cut = mesh(ski, contacts=points, cutting=True)
    return bending_edges(cut, modal_ski(cut, modes))


def start_rolling(ski: EdgeSki) -> Rolling:
    """Return the ski on fresh snow, straight, little edged and just touching it."""
    points, modes = len(ski.width), len(ski.omega)
    state = TurnState(np.zeros(4 + modes), np.zeros(2))
    state.sought[2] = 0.5 * float(ski.width.min()) * np.sin(_FIRST_EDGE)
    memory = Groove.fresh(2, points)
    return Rolling(ski, state, memory, EdgeWork.room(points, modes), float(_FIRST_EDGE))


def steady_turn(case: TurnCase, rolling: Rolling, step_points: float = 1.0) -> tuple[SteadyTurn, Rolling]:
    """Return the turn that a ski settles into, and the ski as it runs there.

    Parameters
    ----------
    rolling : the ski as it runs before; it is left as it is
    step_points : least distances of contact points that the ski covers in a step

    Raises NoSteadyTurn where Newton's method fails at the end, or the edge sinks deeper than 50 mm.
    """
    on = rolling.copied()
    ski = on.ski
    gap = float(np.diff(ski.station).min())
    chunk = max(1, round(_CHUNK * float(np.ptp(ski.station)) / (gap * step_points)))
    step = step_points * gap / case.speed
    kernel = carving_module()
    parameters = law_parameters((case.law,))

    def run(edge: Array) -> tuple[Array, int]:
        lean = np.tan(edge - case.angulation)
        turn = Turn(edge, lean, case.load, case.speed, step, case.pressure)
        series = np.zeros((len(edge), 4))
        return series, kernel.follow_turn(parameters, ski, turn, on.state, on.memory, on.work, series)

    rolled = np.degrees(abs(case.edge - on.edge))
    run(np.linspace(on.edge, case.edge, round(_ROLLING * rolled * chunk)))
    curvatures: list[Array] = []
    for _ in range(_LONGEST):
        series, solved = run(np.full(chunk, case.edge))
        if not np.all(np.isfinite(series)):
            raise NoSteadyTurn(f"{_named(case)}: the ski finds no turn")
        curvatures.append(series[:, 1] / case.speed)
        spread = np.ptp(curvatures[-1])
        if len(curvatures) > 1 and spread <= _STEADY * abs(curvatures[-1][-1]):
            break
    if solved < len(series) // 2:
        raise NoSteadyTurn(f"{_named(case)}: the equations of a step have no solution that was found")
    last = np.concatenate(curvatures[-max(1, len(curvatures) // 4) :])
    if on.work.seen[:, 4].max() > _DEEPEST:
        raise NoSteadyTurn(f"{_named(case)}: the edge sinks deeper than {1e3 * _DEEPEST:.0f} mm")
    return _turn_of(case, on, last), replace(on, edge=case.edge)


def _named(case: TurnCase) -> str:
    return f"edged by {np.degrees(case.edge):.0f} degrees with {case.load:.0f} N"


def _turn_of(case: TurnCase, on: Rolling, curvature: Array) -> SteadyTurn:
    """Return the figures of a ski that runs."""
    normal, along, across, most, depth, groove, offset, v_t, v_n, edge, rise, _, borne = on.work.seen.T
    length = on.ski.length
    force, sought = on.work.force, on.state.sought
    climbing = np.where(v_t > 0.0, np.maximum(rise, 0.0), np.minimum(rise, 0.0))
    compaction = float(np.sum(normal * climbing * v_t))
    return SteadyTurn(
        case=case,
        curvature=float(np.mean(curvature)),
        wobble=float(np.std(curvature)),
        sideslip=float(-sought[0] / case.speed),
        sinking=float(-sought[2]),
        pitch=float(sought[3]),
        normal=float(force[2]),
        lateral=float(force[1]),
        resistance=float(-force[0]),
        side_reserve=float(1.0 - np.sum(borne) / np.sum(most)),
        power=-float(force[0] * case.speed + force[1] * sought[0] + force[5] * sought[1]),
        friction=float(-np.sum(along * v_t)) - compaction,
        compaction=compaction,
        skid=float(-np.sum(across * v_n)),
        place=on.ski.station,
        pressure=normal / length,
        across=across / length,
        most=most / length,
        depth=depth.copy(),
        groove=groove.copy(),
        offset=offset.copy(),
        slip=v_n.copy(),
        local_edge=np.abs(edge),
    )
