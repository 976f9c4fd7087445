"""The point of an edge that cuts: what the snow's law on it depends on, and where the law's forces act.

Formulas over ``Math``, written once for the reduced model, its tangents, the full model and the steady turn; their
derivatives are generated (``contact.codegen.formula``).  A section of a ski touches the snow with the deeper edge, and
where it lies flat with the other one too.  Forces act along the snow's normal, along t, which is the edge's tangent
projected on the snow, and along n = normal × t.
"""

from __future__ import annotations

from typing import Final

from sssi_exudyn.contact.codegen.formula import formula
from sssi_exudyn.contact.maths import Math, Number, Pair, Vector, cross, dot, plus, times
from sssi_exudyn.simulation.ski_on_snow.point import STILL, point_velocity

UP: Final[Vector] = (0.0, 0.0, 1.0)
"""The normal of snow whose own frame the ski has been turned into."""
_UPRIGHT: Final = 1e-18
"""Square of the cosine below which a section stands on its edge."""


def section_angle(math: Math, apart: Number, width: Number) -> Number:
    """Return the angle (rad) of a section of this width on the snow, positive on its right edge.  That edge is deeper
    by ``apart`` (m) than the left one.
    """
    sine = math.maximum(-1.0, math.minimum(1.0, apart / width))
    return math.atan(sine / math.sqrt(math.maximum((1.0 - sine) * (1.0 + sine), _UPRIGHT)))


@formula()
def edge_axes(math: Math, tangent: Vector, normal: Vector) -> tuple[Vector, Vector]:
    """Return the unit vectors t along an edge in the snow's plane, and n across it, to its left."""
    across = cross(normal, tangent)
    n = times(1.0 / math.sqrt(dot(across, across)), across)
    return cross(n, normal), n


@formula(by=("place", "other", "tangent", "velocity"))
def edge_state(
    math: Math,
    place: Vector,
    other: Vector,
    tangent: Vector,
    velocity: Vector,
    normal: Vector,
    other_normal: Vector,
    width: Number,
    side: Number,
) -> tuple[Number, ...]:
    """Return the depths of both edges (m), the rate of the deeper one's, its velocity along t and n (m/s), the rise of
    its tangent, and the edge angle (rad), as ``EdgeState`` has them.

    place, other : of the deeper and of the other edge, m from a point of the snow's tangent plane there
    tangent, velocity : of the deeper edge, a unit of its length, and m/s against the snow
    side : 1 where the right edge is the deeper one, −1 where the left is
    """
    t, n = edge_axes(math, tangent, normal)
    lower, upper = -dot(normal, place), -dot(other_normal, other)
    edge = section_angle(math, side * (lower - upper), width)
    rise = dot(normal, tangent)
    return lower, upper, -dot(normal, velocity), dot(t, velocity), dot(n, velocity), rise, edge


@formula(by=("low", "high", "tangent", "velocity"))
def flat_edge(
    math: Math, low: Number, high: Number, tangent: Vector, velocity: Vector, width: Number, side: Number
) -> tuple[Number, ...]:
    """Return ``edge_state`` on the plane z = 0, where the deeper and the other edge are at these heights (m)."""
    unit = times(1.0 / math.sqrt(dot(tangent, tangent)), tangent)
    return edge_state(math, (0.0, 0.0, low), (0.0, 0.0, high), unit, velocity, UP, UP, width, side)  # type: ignore[no-any-return]


@formula(by=("height", "velocity", "turn", "spin", "arm", "other", "tangent", "bending"))
def turned_edge(
    math: Math,
    height: Number,
    velocity: Vector,
    spin: Vector,
    arm: Vector,
    other: Vector,
    tangent: Vector,
    bending: Vector,
    width: Number,
    side: Number,
    turn: Vector = STILL,
) -> tuple[Number, ...]:
    """Return ``flat_edge`` of a ski whose foot has a height over the snow (m), a velocity and a spin, and the direction
    of its deeper edge in the snow's plane (rad).

    arm, other : m from the foot to the deeper and to the other edge;  bending : m/s of the deeper one by the ski's bend
    turn : rad, a small turn of the ski about its foot
    """
    arm, other, tangent, bending = (plus(v, cross(turn, v)) for v in (arm, other, tangent, bending))
    moving = point_velocity(math, velocity, spin, arm, bending)
    state = flat_edge(math, height + arm[2], height + other[2], tangent, moving, width, side)
    return *state, math.atan2(tangent[1], tangent[0])


@formula()
def force_on_deeper(
    _math: Math, push: Number, along: Number, across: Number, at_other: Number, t: Vector, n: Vector, normal: Vector
) -> Vector:
    """Return the force (N) on the deeper edge; on the other one acts ``at_other`` along its own normal.

    push, along, across, at_other : N as ``EdgeTerm.force`` gives them
    """
    return plus(times(push - at_other, normal), plus(times(along, t), times(across, n)))


@formula(by=("groove", "offset", "speed", "drift"))
def arriving_memory(
    math: Math, along: Vector, step: Number, groove: Pair, offset: Pair, speed: Number, drift: Vector
) -> tuple[Number, Number]:
    """Return groove and offset (m) at a station of an edge after a step (s): those of the snow that was ahead of it.

    along : m along the ski: the station, that behind the place the snow comes from, and how far beyond is the next
    groove, offset : m at these two stations, behind that place and beyond it
    speed : m/s of the station along the edge, ≥ 0;  drift : m/s across it, of the station and of these two
    """
    station, ahead, gap = along
    share = (station + step * speed - ahead) / gap
    # how long ago the snow passed the station ahead; the step where nothing moves
    since = math.where(speed, share * gap / math.maximum(speed, 1e-300), step)
    rising = drift[2] - drift[1]
    drifted = drift[1] + share * rising - drift[0]
    moved = 0.5 * (step * drifted + (1.0 - share) * since * rising)
    return groove[0] + share * (groove[1] - groove[0]), offset[0] + share * (offset[1] - offset[0]) + moved
