"""Friction along the ski that is not the same everywhere and always: corrections to the constant mu_t."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Final

from sssi_exudyn.contact.maths import Math, Number
from sssi_exudyn.contact.term import FootState, FootTerm
from sssi_exudyn.contact.terms.friction import AnisotropicFriction
from sssi_exudyn.contact.terms.shapes import window
from sssi_exudyn.core.quantity import quantity

LARGEST_FALL: Final = 0.09
"""Largest decrease of mu_t by a correction, so that the two together keep on braking."""
LARGEST_FALL_ACROSS: Final = 0.4
"""Largest decrease of mu_n, so that the two together still hold."""
_SMOOTHING: Final = AnisotropicFriction().eps
SMALL: Final = 1e-3
"""m/s; keeps the speed's root smooth at rest."""
_FLATTEST: Final = 0.3
"""Cosine of the edge angle beyond which edges turn no further."""
_SHALLOWEST: Final = 1e-6
"""Of the groove at which a resistance is stated; keeps the derivative by its power finite."""
_CHOICE: Final = "chosen: several times what is published"


def more_friction(math: Math, state: FootState, delta_mu: Number) -> tuple[Number, Number]:
    """Return the force of a friction that is ``delta_mu`` greater along the ski."""
    more = math.maximum(delta_mu, -LARGEST_FALL)
    return -more * state.load * math.saturate(state.v_t, _SMOOTHING), 0.0


def _touches(math: Math, state: FootState) -> Number:
    """Return 0 without contact, 1 from a few newtons on."""
    return state.load / (math.absolute(state.load) + 1.0)


@dataclass(frozen=True)
class SnowPatch(FootTerm):
    """Snow that glides and holds differently over a stretch of the slope.

    Formula: f_t = −delta_mu_t·ΣF_N·sign(v_t),   f_n = −delta_mu_n·ΣF_N·sign(v_n),   between f0 and f1, smoothed over
    edge
    """

    name: ClassVar[str] = "snow_patch"
    corrects: ClassVar[str] = AnisotropicFriction.name
    sources: ClassVar[tuple[str, ...]] = (
        "gliding friction from 0.023 to 0.139 over 200 runs: Wolfsperger et al., Front. Mech. Eng. 7 (2021) 728722",
    )

    delta_mu_t: float = quantity(
        0.0, "1", low=-LARGEST_FALL, high=0.6, source=_CHOICE, meaning="how much more friction there is along the ski"
    )
    f0: float = quantity(0.0, "m", low=-1e4, high=1e4, source="chosen", meaning="where it begins, down the fall line")
    f1: float = quantity(10.0, "m", low=-1e4, high=1e4, source="chosen", meaning="where it ends")
    edge: float = quantity(0.5, "m", low=0.05, high=10.0, source="chosen", meaning="length over which it changes")
    delta_mu_n: float = quantity(
        0.0, "1", low=-LARGEST_FALL_ACROSS, high=0.6, source=_CHOICE, meaning="how much more there is across it"
    )

    def force(self, math: Math, state: FootState) -> tuple[Number, Number]:
        share = window(math, state.f, self.f0, self.f1, self.edge)
        along, _ = more_friction(math, state, self.delta_mu_t * share)
        return along, -self.delta_mu_n * share * state.load * math.saturate(state.v_n, _SMOOTHING)


@dataclass(frozen=True)
class SpeedDependentFriction(FootTerm):
    """Friction that changes with speed: shear of the melt water film, or snow that is ploughed aside.

    Formula: f_t = −b·(|v| − v_ref)·ΣF_N·sign(v_t)
    """

    name: ClassVar[str] = "speed_dependent_friction"
    corrects: ClassVar[str] = AnisotropicFriction.name
    sources: ClassVar[tuple[str, ...]] = ("L. Bäurle et al., Tribol. Int. 40 (2007) 1: friction over a melt film",)

    b: float = quantity(0.0, "s/m", low=-0.05, high=0.05, source=_CHOICE, meaning="rise of mu_t with speed")
    v_ref: float = quantity(8.0, "m/s", low=0.0, high=50.0, source="chosen", meaning="speed at which mu_t holds")

    def force(self, math: Math, state: FootState) -> tuple[Number, Number]:
        speed = math.sqrt(state.v_t * state.v_t + state.v_n * state.v_n + SMALL * SMALL)
        return more_friction(math, state, self.b * (speed - self.v_ref))


@dataclass(frozen=True)
class Braking(FootTerm):
    """Friction that a skier adds by skidding for a while, or leaves out; several in a row follow any course in time.

    Where more is left out than there is, the ground is steeper than the model has it.

    Formula: f_t = −delta_mu·max(1 − |t − t0|/width, 0)·ΣF_N·sign(v_t)
    """

    name: ClassVar[str] = "braking"
    corrects: ClassVar[str] = AnisotropicFriction.name
    sources: ClassVar[tuple[str, ...]] = ("friction from the balance along a path: docs/theory/few-sensors.md",)

    delta_mu: float = quantity(
        0.0,
        "1",
        low=-0.3,
        high=0.6,
        source="chosen: a slope of 17 degrees that the ground lacks; several times what is published",
        meaning="how much more friction there is at t0",
    )
    t0: float = quantity(1.0, "s", low=-10.0, high=7200.0, source="chosen", meaning="when it is largest")
    width: float = quantity(
        2.5, "s", low=0.1, high=60.0, source="chosen", meaning="time in which it comes, and in which it goes"
    )

    def force(self, math: Math, state: FootState) -> tuple[Number, Number]:
        share = math.maximum(1.0 - math.absolute(state.t - self.t0) / self.width, 0.0)
        return -self.delta_mu * share * state.load * math.saturate(state.v_t, _SMOOTHING), 0.0


@dataclass(frozen=True)
class EdgeDependentFriction(FootTerm):
    """Friction that changes with the edge angle: an edge cuts where a flat base glides.

    Formula: f_t = −b·(|edge| − edge_ref)·ΣF_N·sign(v_t)
    """

    name: ClassVar[str] = "edge_dependent_friction"
    corrects: ClassVar[str] = AnisotropicFriction.name
    sources: ClassVar[tuple[str, ...]] = ("K. Nachbauer et al., J. Sports Sci. 9 (1991): edged against gliding skis",)

    b: float = quantity(0.0, "1/rad", low=-0.5, high=0.5, source=_CHOICE, meaning="rise of mu_t with the edge angle")
    edge_ref: float = quantity(
        0.35, "rad", low=0.0, high=1.4, source="chosen", meaning="edge angle at which mu_t holds"
    )

    def force(self, math: Math, state: FootState) -> tuple[Number, Number]:
        return more_friction(math, state, self.b * (math.absolute(state.edge) - self.edge_ref))


@dataclass(frozen=True)
class LoadDependentFriction(FootTerm):
    """Friction that changes with the load: a film's shear does not grow as the load does.

    Formula: f_t = −b·(ΣF_N/load_ref − 1)·ΣF_N·sign(v_t)
    """

    name: ClassVar[str] = "load_dependent_friction"
    corrects: ClassVar[str] = AnisotropicFriction.name
    sources: ClassVar[tuple[str, ...]] = ("L. Bäurle et al., Tribol. Int. 40 (2007) 1: friction falls with the load",)

    b: float = quantity(0.0, "1", low=-0.3, high=0.3, source=_CHOICE, meaning="rise of mu_t at twice the load")
    load_ref: float = quantity(400.0, "N", low=50.0, high=5e3, source="chosen", meaning="load at which mu_t holds")

    def force(self, math: Math, state: FootState) -> tuple[Number, Number]:
        return more_friction(math, state, self.b * (state.load / self.load_ref - 1.0))


@dataclass(frozen=True)
class UnexplainedFriction(FootTerm):
    """Difference in friction, of unknown cause, between the left and the right ski.

    It may be another base, wax or edge, or snow under one ski alone.  mu_t is the mean of the two.

    Formula: f_t = −½·side·delta_mu·ΣF_N·sign(v_t),   side = 1 for the left ski, −1 for the right one
    """

    name: ClassVar[str] = "unexplained_friction"
    corrects: ClassVar[str] = AnisotropicFriction.name
    mirrors: ClassVar[tuple[str, ...]] = ("delta_mu",)
    sources: ClassVar[tuple[str, ...]] = ("none: it is what the known laws leave",)

    delta_mu: float = quantity(
        0.0,
        "1",
        low=-2.0 * LARGEST_FALL,
        high=2.0 * LARGEST_FALL,
        source="a ski's half of it is the largest fall",
        meaning="by how much more friction the left ski has than the right one",
    )

    def force(self, math: Math, state: FootState) -> tuple[Number, Number]:
        return more_friction(math, state, 0.5 * state.side * self.delta_mu)


@dataclass(frozen=True)
class UnexplainedDrag(FootTerm):
    """A force of unknown cause that holds one ski back for a while.

    It may be an edge that catches, a lump of ice, or a ski under the other.

    Formula: f_t = −½(1 + side·s)·brake_t·w·sign(v_t),   f_n = −½(1 + side·s)·brake_n·w·sign(v_n),   s = 1 for the left
    ski, −1 for the right one, w = ½(tanh((t − t0)/rise) − tanh((t − t1)/rise)), where the ski is on the snow
    """

    name: ClassVar[str] = "unexplained_drag"
    mirrors: ClassVar[tuple[str, ...]] = ("side",)
    sources: ClassVar[tuple[str, ...]] = ("none: it is what the known laws leave",)

    brake_t: float = quantity(0.0, "N", low=0.0, high=3e3, source="chosen", meaning="force that brakes along the ski")
    brake_n: float = quantity(0.0, "N", low=0.0, high=3e3, source="chosen", meaning="force that brakes across it")
    t0: float = quantity(1.0, "s", low=-10.0, high=7200.0, source="chosen", meaning="when it comes")
    t1: float = quantity(2.0, "s", low=-10.0, high=7200.0, source="chosen", meaning="when it goes")
    rise: float = quantity(0.05, "s", low=0.01, high=2.0, source="chosen", meaning="time it takes to come and to go")
    side: float = quantity(
        1.0, "1", low=-1.0, high=1.0, source="chosen", meaning="which ski: 1 the left, -1 the right, 0 both alike"
    )

    def force(self, math: Math, state: FootState) -> tuple[Number, Number]:
        share = window(math, state.t, self.t0, self.t1, self.rise) * _touches(math, state)
        share = 0.5 * (1.0 + self.side * state.side) * share
        along, across = (math.saturate(v, _SMOOTHING) for v in (state.v_t, state.v_n))
        return -self.brake_t * share * along, -self.brake_n * share * across


@dataclass(frozen=True)
class SnowCompaction(FootTerm):
    """Resistance of snow that is pressed down ahead of the ski, as deep as the ski sinks.

    Formula: f_t = −c·groove·(groove/groove_ref)^(power − 1)·sign(v_t),   groove = Σ δ·length

    A metre of the path takes the work that presses the groove down, ∫ p dδ: snow whose pressure p is its strength at
    any depth has power 1, and snow whose pressure grows with the depth has 2.
    """

    name: ClassVar[str] = "snow_compaction"
    sources: ClassVar[tuple[str, ...]] = (
        "D. A. Lind, S. P. Sanders, The Physics of Skiing (2004), ch. 4: work of compaction over the path",
    )

    c: float = quantity(0.0, "N/m^2", low=0.0, high=2e5, source=_CHOICE, meaning="resistance to a groove's area")
    power: float = quantity(
        1.0, "1", low=1.0, high=3.0, source="the work of pressing snow down, above", meaning="of the groove's area"
    )
    groove_ref: float = quantity(
        0.02,
        "m^2",
        low=1e-3,
        high=1.0,
        source="chosen: a ski that sinks in a centimetre",
        meaning="groove at which c holds",
    )

    def force(self, math: Math, state: FootState) -> tuple[Number, Number]:
        deeper = math.power(math.maximum(state.groove / self.groove_ref, _SHALLOWEST), self.power - 1.0)
        pull = self.c * state.groove * deeper * _touches(math, state)
        return -pull * math.saturate(state.v_t, _SMOOTHING), 0.0


@dataclass(frozen=True)
class EdgeFriction(FootTerm):
    """Friction across the edges, which do not all point as the ski does.

    Sidecut and bend turn the edges ahead of the boot to one side and those behind it to the other.

    Formula: f_t = −c·ΣF_N·(β² − s²)₊/(2β)·sign(v_t),   f_n = −c·ΣF_N·(s/β within ±1 − sign(v_n)),   s = v_n/|v_t|,
    β = spread/cos(edge)

    Edges point evenly into all directions from −β to β, and each resists with c of its load across itself.  Where the
    ski slips by less than β they resist each other: less holds across the ski, and more brakes along it.
    """

    name: ClassVar[str] = "edge_friction"
    corrects: ClassVar[str] = AnisotropicFriction.name
    sources: ClassVar[tuple[str, ...]] = (
        "friction at each point of an edge; an edged ski that lies bent on the snow has the radius R·cos(edge), R that"
        " of its sidecut (Howe, Skiing Mechanics, 1983)",
    )

    c: float = quantity(
        0.0, "1", low=0.0, high=0.99, source="friction.mu_n, where all acts at the edges", meaning="share of mu_n"
    )
    spread: float = quantity(
        0.05, "rad", low=0.005, high=0.3, source="chosen: the ski's outline", meaning="how far edges turn from the ski"
    )

    def force(self, math: Math, state: FootState) -> tuple[Number, Number]:
        spread = self.spread / math.maximum(math.cos(state.edge), _FLATTEST)
        slip = state.v_n / math.sqrt(state.v_t * state.v_t + _SMOOTHING * _SMOOTHING)
        within = math.maximum(math.minimum(slip / spread, 1.0), -1.0)
        braking = 0.5 * spread * (1.0 - within * within) * math.saturate(state.v_t, _SMOOTHING)
        load = self.c * state.load
        return -load * braking, load * (math.saturate(state.v_n, _SMOOTHING) - within)
