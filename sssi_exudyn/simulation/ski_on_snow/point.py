"""One point of a ski's edge in the snow, and a foot's axes on it: formulas over ``Math``.

``formula`` makes compiled functions of them, with derivatives; the back ends in NumPy and in plain Python call them as
they stand.  Vectors are in the slope frame: f, l along the slope's plane, n square to it.  Arguments that are ``STILL``
are small changes, by which the formulas are differentiated where they are zero.
"""

from __future__ import annotations

from typing import Final

from sssi_exudyn.contact.codegen.formula import formula
from sssi_exudyn.contact.maths import Math, Number, Rotation, Vector, cross, dot, plus, times

STILL: Final = (0.0, 0.0, 0.0)


@formula(by=("h_f", "h_l"))
def snow_normal(math: Math, h_f: Number, h_l: Number) -> Vector:
    """Return the unit normal of snow with slopes h_f and h_l: (−h_f, −h_l, 1)/√(1 + h_f² + h_l²)."""
    s = 1.0 / math.sqrt(1.0 + h_f * h_f + h_l * h_l)
    return -h_f * s, -h_l * s, s


@formula()
def penetration(_math: Math, gap: Number, normal: Vector) -> Number:
    """Return the depth (m) square to the snow of a point with ``gap`` (m) of snow over it along n: δ = gap·n_n."""
    return gap * normal[2]


@formula()
def point_velocity(_math: Math, velocity: Vector, spin: Vector, arm: Vector, bending: Vector) -> Vector:
    """Return the velocity (m/s) of a point at ``arm`` from a foot that moves and spins: v + ω × arm + bending."""
    return plus(velocity, plus(cross(spin, arm), bending))


@formula()
def sinking_rate(_math: Math, velocity: Vector, normal: Vector) -> Number:
    """Return the rate (m/s) at which a point sinks into the snow: −v·n."""
    return -dot(velocity, normal)


@formula(by=("turn", "reach"))
def point_arm(_math: Math, arm: Vector, turn: Vector = STILL, reach: Vector = STILL) -> Vector:
    """Return the arm (m) from the foot to a point that bending moves on by ``reach`` and that turns with the ski."""
    return plus(arm, plus(reach, cross(turn, arm)))


@formula(by=("shift", "velocity", "turn", "spin", "reach", "bending", "raised"))
def point_in_snow(
    math: Math, snow: Vector, curvature: Vector, velocity: Vector, spin: Vector, arm: Vector, bending: Vector,
    shift: Vector = STILL, turn: Vector = STILL, reach: Vector = STILL, raised: Vector = STILL,
) -> tuple[Number, Number]:  # fmt: skip
    """Return depth and rate of a point, with its foot shifted and turned, the bending's ``reach``, and snow ``raised``
    in height and slopes.

    snow : gap (m) over the point, and the slopes h_f, h_l there;  curvature : h_ff, h_fl, h_ll (1/m)
    velocity, spin, arm, bending : as in ``point_velocity``

        moved = shift + reach + turn × arm
        gap' = gap + h_f moved_f + h_l moved_l − moved_n + raised,   h_f' = h_f + h_ff moved_f + h_fl moved_l + …
    """
    further = point_arm(math, arm, turn, reach)
    f, l, n = plus(shift, plus(further, times(-1.0, arm)))  # noqa: E741  the slope frame's axes
    gap, h_f, h_l = snow
    gap = gap + (h_f * f + h_l * l - n + raised[0])
    normal = snow_normal(
        math,
        h_f + (curvature[0] * f + curvature[1] * l + raised[1]),
        h_l + (curvature[1] * f + curvature[2] * l + raised[2]),
    )
    moving = point_velocity(math, velocity, spin, further, plus(bending, cross(turn, bending)))
    return penetration(math, gap, normal), sinking_rate(math, moving, normal)


@formula(by=("turn", "reach"))
def point_wrench(
    math: Math, push: Number, normal: Vector, arm: Vector, turn: Vector = STILL, reach: Vector = STILL
) -> tuple[Vector, Vector]:
    """Return the force (N) of the snow on a point and its moment (N m) about the foot: push·n, arm × push·n."""
    force = times(push, normal)
    return force, cross(point_arm(math, arm, turn, reach), force)


@formula(by=("turn",))
def mode_force(_math: Math, force: Vector, reach: Vector, turn: Vector = STILL) -> Number:
    """Return what a force on a point does to a mode that displaces it by ``reach``, which turns with the ski:
    reach·force.
    """
    return dot(plus(reach, cross(turn, reach)), force)


@formula()
def ski_axes(math: Math, normal: Vector, rotation: Rotation, turn: Vector = STILL) -> tuple[Vector, Vector, Number]:
    """Return the axes along and across a ski in the snow's tangent plane, and its edge angle (rad).  The ski's axes are
    the columns of ``rotation``.

        along = (forward − (forward·n) n)/|…|,   across = n × along,   edge = atan2(left·n, up·n)
    """
    columns = [(rotation[0, j], rotation[1, j], rotation[2, j]) for j in range(3)]
    forward, left, up = (plus(axis, cross(turn, axis)) for axis in columns)
    level = plus(forward, times(-dot(forward, normal), normal))
    along = times(1.0 / math.sqrt(dot(level, level)), level)
    return along, cross(normal, along), math.atan2(dot(left, normal), dot(up, normal))


@formula()
def foot_forces(
    _math: Math, load: Number, f_t: Number, f_n: Number, normal: Vector, along: Vector, across: Vector,
    rotation: Rotation, turn: Vector = STILL,
) -> tuple[Vector, Number]:  # fmt: skip
    """Return the friction (N) on a foot by its parts along and across the ski, and the snow's force square to the sole
    (N).
    """
    friction = plus(times(f_t, along), times(f_n, across))
    up = (rotation[0, 2], rotation[1, 2], rotation[2, 2])
    return friction, dot(plus(up, cross(turn, up)), plus(times(load, normal), friction))


@formula(by=("velocity", "turn", "h_f", "h_l", "forces"))
def foot_on_snow(
    math: Math, velocity: Vector, h_f: Number, h_l: Number, forces: Vector, rotation: Rotation, turn: Vector = STILL
) -> tuple[Number, Number, Number, Vector, Number]:  # fmt: skip
    """Velocity of a foot along and across its ski (m/s), the edge angle (rad), friction and the force on the sole, by
    the slopes of the snow under the foot.

    forces : N of the snow on the foot: its load, and friction along and across the ski
    """
    normal = snow_normal(math, h_f, h_l)
    along, across, edge = ski_axes(math, normal, rotation, turn)
    friction, sole = foot_forces(math, *forces, normal, along, across, rotation, turn)
    return dot(velocity, along), dot(velocity, across), edge, friction, sole
