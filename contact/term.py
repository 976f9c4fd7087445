"""A force term: one law of a force on the skier, written once and used everywhere.

One frozen dataclass is one term.  Its parameters are declared with ``quantity``; its formula is in the docstring, on a
line that begins with ``Formula:``, and once in code, over a ``Math``.  A term acts in one of seven places, each with an
abstract class and a state here; terms of one kind add up.  Directions and signs are those of the slope frame.
"""

from __future__ import annotations

import inspect
from abc import ABC, abstractmethod
from collections.abc import Iterable
from dataclasses import dataclass
from typing import ClassVar

from sssi_exudyn.contact.maths import Math, Number, Vector
from sssi_exudyn.core.quantity import quantities


@dataclass(frozen=True)
class Term(ABC):
    """Common properties of all terms: the name used in files, the place they act in, their sources.

    A term that corrects another law names it in ``corrects``; it may give energy back where the law takes more.  A term
    that replaces other laws names them in ``replaces``.  Where a law treats the left and the right ski differently,
    ``mirrors`` names the numbers that change their sign when the two are exchanged.
    """

    name: ClassVar[str]
    kind: ClassVar[str]
    corrects: ClassVar[str] = ""
    replaces: ClassVar[tuple[str, ...]] = ()
    mirrors: ClassVar[tuple[str, ...]] = ()
    sources: ClassVar[tuple[str, ...]]


@dataclass(frozen=True)
class PointState:
    """One contact point of a ski's edge.

    depth : how deep it is in the snow, along the snow's normal (m, > 0 in the snow)
    rate : rate of the depth (m/s, > 0 going deeper)
    length : length of edge the point stands for (m)
    """

    depth: Number
    rate: Number
    length: Number


@dataclass(frozen=True)
class PointTerm(Term):
    """A term of this kind is the snow's force on one contact point, along its normal.

    Examples
    --------
    >>> @dataclass(frozen=True)
    ... class Springs(sssi_exudyn.PointTerm):
    ...     '''Springs under the edge.
    ...
    ...     Formula: F_N = k·δ·length
    ...     '''
    ...
    ...     name = "springs"
    ...     sources = ("an example",)
    ...     k: float = quantity(5e4, "N/m^2", low=1e3, high=1e6, source="chosen", meaning="stiffness")
    ...
    ...     def force(self, math, state):
    ...         return self.k * math.maximum(0.0, state.depth) * state.length
    """

    kind: ClassVar[str] = "point"

    @abstractmethod
    def force(self, math: Math, state: PointState) -> Number:
        """Return the normal force on the ski (N, ≥ 0; 0 for depth ≤ 0)."""


@dataclass(frozen=True)
class FootState:
    """One foot with its ski, in the snow's tangent plane.

    load : sum of the ski's normal forces (N, ≥ 0)
    v_t, v_n : velocity of the foot relative to the snow along t, the ski's forward axis projected on the snow, and
        along n = normal × t, to its left (m/s)
    edge : signed angle between the ski's base and the snow about the ski's long axis (rad)
    groove : sum over the ski's points of max(depth, 0)·length: the area pressed into the snow, seen from the side (m²)
    t : time (s)
    f, l : place on the slope (m)
    side : +1 left ski, −1 right ski
    """

    load: Number
    v_t: Number
    v_n: Number
    edge: Number
    groove: Number
    t: Number
    f: Number
    l: Number  # noqa: E741  the slope frame's name of the axis
    side: Number


@dataclass(frozen=True)
class FootTerm(Term):
    """A term of this kind is the snow's drag on a foot, in the tangent plane of the snow.

    Examples
    --------
    >>> @dataclass(frozen=True)
    ... class WetSnow(sssi_exudyn.FootTerm):
    ...     '''Suction of a water film.
    ...
    ...     Formula: f_t = −c·v_t²·ΣF_N·sign(v_t)
    ...     '''
    ...
    ...     name = "wet_snow"
    ...     sources = ("an example",)
    ...     c: float = quantity(0.0, "s^2/m^2", low=0.0, high=0.01, source="chosen", meaning="rise")
    ...
    ...     def force(self, math, state):
    ...         return -self.c * state.v_t**2 * state.load * math.saturate(state.v_t, 0.1), 0.0
    """

    kind: ClassVar[str] = "foot"

    @abstractmethod
    def force(self, math: Math, state: FootState) -> tuple[Number, Number]:
        """Return the force on the foot (N): along the ski (t) and across it (n, to the left); none without load."""


@dataclass(frozen=True)
class SegmentState:
    """One body segment in the air, in the slope frame.

    velocity : of its centre of mass (m/s)
    wind : the air's velocity there (m/s)
    area : frontal area of an upright skier (m²)
    facing : M_ff, M_fl, M_fn, M_ll, M_ln, M_nn (m⁴): along a direction û the segment has the area √(û·M û), less the
        part that others shield
    """

    velocity: Vector
    wind: Vector
    area: Number
    facing: tuple[Number, Number, Number, Number, Number, Number] = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True)
class SegmentTerm(Term):
    """A term of this kind is the air's force on a body segment, at its centre of mass.

    knows_up : whether it depends on the direction up from the slope, as lift does; otherwise no direction is its own

    Examples
    --------
    >>> @dataclass(frozen=True)
    ... class SlowAir(sssi_exudyn.SegmentTerm):
    ...     '''Air so slow that its drag is linear.
    ...
    ...     Formula: F = c·u
    ...     '''
    ...
    ...     name = "slow_air"
    ...     sources = ("an example",)
    ...     c: float = quantity(0.0, "kg/s", low=0.0, high=5.0, source="chosen", meaning="linear drag")
    ...
    ...     def force(self, math, state):
    ...         return tuple(self.c * (air - own) for air, own in zip(state.wind, state.velocity))
    """

    kind: ClassVar[str] = "segment"
    knows_up: ClassVar[bool] = False

    @abstractmethod
    def force(self, math: Math, state: SegmentState) -> Vector:
        """Return the force on the segment (N), components f, l, n."""


@dataclass(frozen=True)
class PlaceState:
    """Time and place.  t : time (s);  f, l : place on the slope (m)."""

    t: Number
    f: Number
    l: Number  # noqa: E741  the slope frame's name of the axis


@dataclass(frozen=True)
class WindTerm(Term):
    """A term of this kind moves the air over the ground.

    Examples
    --------
    >>> @dataclass(frozen=True)
    ... class Downslope(sssi_exudyn.WindTerm):
    ...     '''A wind down the fall line.
    ...
    ...     Formula: w = (w_f, 0, 0)
    ...     '''
    ...
    ...     name = "downslope"
    ...     sources = ("an example",)
    ...     w_f: float = quantity(0.0, "m/s", low=0.0, high=9.0, source="chosen", meaning="down the slope")
    ...
    ...     def velocity(self, math, state):
    ...         return self.w_f, 0.0, 0.0
    """

    kind: ClassVar[str] = "wind"

    @abstractmethod
    def velocity(self, math: Math, state: PlaceState) -> Vector:
        """Return the velocity of the air (m/s), components f, l, n."""


@dataclass(frozen=True)
class TerrainTerm(Term):
    """A term of this kind shapes the snow surface over the mean slope plane.

    Examples
    --------
    >>> @dataclass(frozen=True)
    ... class Waves(sssi_exudyn.TerrainTerm):
    ...     '''Waves of 6.3 m down the slope.
    ...
    ...     Formula: h = a·sin(f)
    ...     '''
    ...
    ...     name = "waves"
    ...     sources = ("an example",)
    ...     a: float = quantity(0.0, "m", low=0.0, high=0.3, source="chosen", meaning="height of waves")
    ...
    ...     def height(self, math, f, l):
    ...         return self.a * math.sin(f), self.a * math.cos(f), 0.0
    """

    kind: ClassVar[str] = "terrain"

    @abstractmethod
    def height(self, math: Math, f: Number, l: Number) -> tuple[Number, Number, Number]:  # noqa: E741
        """Return the height h over the plane (m) and its slopes ∂h/∂f, ∂h/∂l (1) at the place f, l (m)."""


@dataclass(frozen=True)
class BodyState:
    """The skier as a whole, in the slope frame.

    t : time (s)
    f, l : place of the centre of mass on the slope (m)
    velocity : of the centre of mass (m/s)
    """

    t: Number
    f: Number
    l: Number  # noqa: E741  the slope frame's name of the axis
    velocity: Vector


@dataclass(frozen=True)
class BodyTerm(Term):
    """A term of this kind is a force on the skier's centre of mass, or at the hands, which moves the skier the same.

    Examples
    --------
    >>> @dataclass(frozen=True)
    ... class Parachute(sssi_exudyn.BodyTerm):
    ...     '''A small parachute.
    ...
    ...     Formula: F = −c·v
    ...     '''
    ...
    ...     name = "parachute"
    ...     sources = ("an example",)
    ...     c: float = quantity(0.0, "kg/s", low=0.0, high=99.0, source="chosen", meaning="linear drag")
    ...
    ...     def force(self, math, state):
    ...         return tuple(-self.c * v for v in state.velocity)
    """

    kind: ClassVar[str] = "body"

    def at_hands(self) -> tuple[float, float]:
        """Return the shares of the force at the left and at the right hand; the rest acts on the centre of mass."""
        return 0.0, 0.0

    @abstractmethod
    def force(self, math: Math, state: BodyState) -> Vector:
        """Return the force on the skier (N), components f, l, n."""


@dataclass(frozen=True)
class EdgeState:
    """One section of a ski at its deeper edge, with the snow's memory of earlier points.

    lower, upper : depth of the deeper and of the other edge, along the snow's normal (m, > 0 in the snow)
    rate : rate of the deeper edge's depth (m/s, > 0 going deeper)
    width : of the ski there (m)
    groove : depth of the groove that arrived from ahead (m, ≥ 0)
    offset : of the edge from the groove's wall, to the left, as it arrived from ahead (m)
    step : time since (s)
    v_t, v_n : velocity of the edge point relative to the snow along t, its own tangent projected on the snow, and along
        n = normal × t, to its left (m/s)
    rise : the unprojected tangent's component along the snow's normal (1, > 0 where the edge climbs going forward)
    edge : signed angle between the section's base and the snow about the ski's long axis (rad, > 0 where the right edge
        is deeper)
    length : length of edge the point stands for (m)
    """

    lower: Number
    upper: Number
    rate: Number
    width: Number
    groove: Number
    offset: Number
    step: Number
    v_t: Number
    v_n: Number
    rise: Number
    edge: Number
    length: Number


@dataclass(frozen=True)
class EdgeTerm(Term):
    """The snow's force on a section of a ski, which the snow remembers."""

    kind: ClassVar[str] = "edge"

    @abstractmethod
    def force(self, math: Math, state: EdgeState) -> tuple[Number, Number, Number, Number]:
        """Return the force on the section (N), none for lower ≤ 0.

        Components: along the snow's normal (≥ 0), along t, along n, and the part of the first that acts at the upper
        edge; everything else acts at the lower edge.
        """

    @abstractmethod
    def remember(self, math: Math, state: EdgeState) -> tuple[Number, Number]:
        """Return groove and offset (m) that the point leaves at the end of the step; none for lower ≤ 0."""

    @abstractmethod
    def capacity(self, math: Math, state: EdgeState) -> tuple[Number, Number]:
        """Return the greatest force (N) of the groove's wall towards the base's side, and its force now (N, ≥ 0)."""


KINDS: tuple[type[Term], ...] = (PointTerm, FootTerm, SegmentTerm, WindTerm, TerrainTerm, BodyTerm, EdgeTerm)
"""The places a term may act in."""


def vector_sum(vectors: Iterable[tuple[Number, ...]], size: int) -> tuple[Number, ...]:
    """Return the sum of vectors of the given size, component by component; zeros when there is none."""
    total: tuple[Number, ...] = (0.0,) * size
    for vector in vectors:
        total = tuple(a + b for a, b in zip(total, vector, strict=True))
    return total


def point_force(math: Math, terms: Iterable[Term], state: PointState) -> Number:
    """Return the normal force of all point terms among ``terms`` (N)."""
    return vector_sum(((term.force(math, state),) for term in terms if isinstance(term, PointTerm)), 1)[0]


def foot_force(math: Math, terms: Iterable[Term], state: FootState) -> tuple[Number, ...]:
    """Return the force of all foot terms among ``terms``, along and across (N)."""
    return vector_sum((term.force(math, state) for term in terms if isinstance(term, FootTerm)), 2)


def segment_force(math: Math, terms: Iterable[Term], state: SegmentState) -> tuple[Number, ...]:
    """Return the force of all segment terms among ``terms``, components f, l, n (N)."""
    return vector_sum((term.force(math, state) for term in terms if isinstance(term, SegmentTerm)), 3)


def air_velocity(math: Math, terms: Iterable[Term], state: PlaceState) -> tuple[Number, ...]:
    """Return the velocity of the air by all wind terms among ``terms``, components f, l, n (m/s)."""
    return vector_sum((term.velocity(math, state) for term in terms if isinstance(term, WindTerm)), 3)


def terrain_height(math: Math, terms: Iterable[Term], f: Number, l: Number) -> tuple[Number, ...]:  # noqa: E741
    """Return height (m) and slopes (1) of the snow by all terrain terms among ``terms``: h, ∂h/∂f, ∂h/∂l."""
    return vector_sum((term.height(math, f, l) for term in terms if isinstance(term, TerrainTerm)), 3)


def body_force(math: Math, terms: Iterable[Term], state: BodyState) -> tuple[Number, ...]:
    """Return the force of all body terms among ``terms``, components f, l, n (N)."""
    return vector_sum((term.force(math, state) for term in terms if isinstance(term, BodyTerm)), 3)


def hand_forces(math: Math, terms: Iterable[Term], state: BodyState) -> tuple[tuple[Number, ...], ...]:
    """Return the body terms' forces at the left and at the right hand, components f, l, n each (N)."""
    shared = [(term.at_hands(), term.force(math, state)) for term in terms if isinstance(term, BodyTerm)]
    shared = [(share, force) for share, force in shared if any(share)]
    return tuple(
        vector_sum((tuple(share[hand] * part for part in force) for share, force in shared), 3) for hand in range(2)
    )


def parameters(term: Term) -> dict[str, float]:
    """Return the values of a term's declared numbers, by name, in order of declaration."""
    return {name: getattr(term, name) for name in quantities(term)}


def formula(cls: type[Term]) -> str:
    """Return the paragraph of a term's docstring that begins with ``Formula:``, without it; "" where there is none."""
    for paragraph in inspect.cleandoc(cls.__doc__ or "").split("\n\n"):
        if paragraph.startswith("Formula:"):
            return " ".join(paragraph.removeprefix("Formula:").split("\n")).strip()
    return ""
