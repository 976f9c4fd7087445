"""The skier's heading about gravity: a template that ``compiled`` joins with ``carved_steps_kernel``.

The whole posture turns by Ψ from the captured one, as ``simulation.heading`` describes.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from sssi_exudyn.contact.codegen.vectors import cross, dot, into, out_of, plus, three, times
from sssi_exudyn.core.frames import Array
from sssi_exudyn.runtime.jit import njit


class SolvedHeading(NamedTuple):
    """How the skier's heading about gravity is solved for: by how much the posture is turned from the captured one.

    solved : 1, or 0 where it stays the captured one; the rest is not looked at then
    stiffness, damping_ratio : N m/rad of the spring that holds it to the captured one, share of its critical damping
    up : (3,) against gravity;  held : (3,) m, the skis' held node in the foot's frame
    inertia, momentum : (t,) kg m², N m s of skier and skis, which do not give, about the vertical through their centre
        of mass, and what of it the captured posture has
    com_place, com_velocity : (t, 3) m, m/s of that centre of mass
    exposed_swing : (t, e, 3) m, velocity of the exposed segments a unit rate of the heading
    angle : (t, 3) rad, rad/s, rad/s² to the left;  filled
    moment : (t,) N m of snow and air about that vertical;  filled
    """

    solved: int
    stiffness: float
    damping_ratio: float
    up: Array
    held: Array
    inertia: Array
    momentum: Array
    com_place: Array
    com_velocity: Array
    exposed_swing: Array
    angle: Array
    moment: Array


@njit(cache=True, error_model="numpy")
def next_heading(k, damping_ratio, h, last, before, after):
    """Return Ψ and its first and second derivative (rad, s) a step of ``h`` (s) after ``last``, which are the same
    then.

    k, damping_ratio : N m/rad of a spring, share of its critical damping
    before : kg m², N m s, N m: inertia I, the posture's own momentum L and moment of snow and air M at ``last``
    after : I and L now

    The moment is that at the step's start, spring and damper act with the heading that they lead to:

        I Ψ̇ + L = (I Ψ̇ + L)₋₁ + h (M₋₁ − k Ψ − c Ψ̇),   Ψ = Ψ₋₁ + h Ψ̇
    """
    c = 2.0 * damping_ratio * math.sqrt(k * after[0])
    given = before[0] * last[1] + before[1] + h * (before[2] - k * last[0])
    rate = (given - after[1]) / (after[0] + h * c + h * h * k)
    return last[0] + h * rate, rate, (rate - last[1]) / h


@njit(cache=True, error_model="numpy")
def turn_about(up, angle, v):
    """Turn a vector (tuple) about the unit vector ``up`` by ``angle`` (rad)."""
    c, s = math.cos(angle), math.sin(angle)
    return plus(times(c, v), plus(times(s, cross(up, v)), times((1.0 - c) * dot(up, v), up)))


@njit(cache=True, error_model="numpy")
def write(row, v):
    """Write a tuple of three into a row."""
    row[0], row[1], row[2] = v


@njit(cache=True, error_model="numpy")
def turn_vectors(up, turned, rows):
    """Turn all vectors (k, 3) about ``up`` by the angle (rad) that ``turned`` begins with."""
    for k in range(rows.shape[0]):
        write(rows[k], turn_about(up, turned[0], three(rows[k], 0)))


@njit(cache=True, error_model="numpy")
def move_on(up, turned, place, velocity, acceleration):
    """Return the velocity and acceleration of a point that the heading takes along, all vectors turned already.

    turned : (3,) angle, its rate and acceleration
    """
    spin = times(turned[1], up)
    moving = plus(velocity, cross(spin, place))
    pulled = plus(cross(times(turned[2], up), place), cross(spin, plus(velocity, moving)))
    return moving, plus(acceleration, pulled)


@njit(cache=True, error_model="numpy")
def turn_heading(heading, motion, n, h):
    """Find the heading at the instant n, ``h`` (s) after the one before, and turn the posture there by it, in place."""
    turned, up = heading.angle[n], three(heading.up, 0)
    if n > 0:
        before = heading.inertia[n - 1], heading.momentum[n - 1], heading.moment[n - 1]
        after = heading.inertia[n], heading.momentum[n]
        last = three(heading.angle[n - 1], 0)
        write(turned, next_heading(heading.stiffness, heading.damping_ratio, h, last, before, after))
    spin = times(turned[1], up)
    for vectors in (
        motion.foot_place[n], motion.foot_velocity[n], motion.foot_spin[n], motion.exposed_velocity[n],
        heading.exposed_swing[n],
    ):  # fmt: skip
        turn_vectors(up, turned, vectors)
    for side in range(2):
        place, velocity = three(motion.foot_place[n, side], 0), three(motion.foot_velocity[n, side], 0)
        spun, frame = three(motion.foot_spin[n, side], 0), motion.foot_rotation[n, side]
        for c in range(3):
            axis = turn_about(up, turned[0], (frame[0, c], frame[1, c], frame[2, c]))
            frame[0, c], frame[1, c], frame[2, c] = axis
        arm = out_of(frame, three(heading.held, 0))
        _, pulled = move_on(up, turned, plus(place, arm), plus(velocity, cross(spun, arm)), (0.0, 0.0, 0.0))
        felt = motion.ski_acceleration[n, side]
        write(felt, plus(three(felt, 0), into(frame, pulled)))
        upright, before = into(frame, up), into(frame, spun)
        after = plus(before, times(turned[1], upright))
        more = plus(times(turned[2], upright), times(turned[1], cross(upright, before)))
        turning = motion.ski_turning[n, side]
        turning[0] += more[0]
        turning[1] += more[1] - after[0] * after[2] + before[0] * before[2]
        turning[2] += more[2] + after[0] * after[1] - before[0] * before[1]
        write(motion.foot_velocity[n, side], plus(velocity, cross(spin, place)))
        write(motion.foot_spin[n, side], plus(spun, spin))
    for k in range(motion.area.shape[0]):
        swung = times(turned[1], three(heading.exposed_swing[n, k], 0))
        write(motion.exposed_velocity[n, k], plus(three(motion.exposed_velocity[n, k], 0), swung))
        facing = motion.exposed_facing[n, k]
        turn_vectors(up, turned, facing)
        turn_vectors(up, turned, facing.T)
    for place, velocity in (
        (motion.com_place[n], motion.com_velocity[n]), (heading.com_place[n], heading.com_velocity[n])
    ):  # fmt: skip
        at, moving = turn_about(up, turned[0], three(place, 0)), turn_about(up, turned[0], three(velocity, 0))
        new, pulled = move_on(up, turned, at, moving, (0.0, 0.0, 0.0))
        write(place, at)
        write(velocity, new)
    carried = turn_about(up, turned[0], three(motion.carried[n], 0))
    write(motion.carried[n], plus(carried, times(motion.mass, pulled)))


@njit(cache=True, error_model="numpy")
def moment_on_heading(heading, motion, n, force, moment, drag, body):
    """Return the moment (N m) of snow and air along ``up`` about the centre of mass of skier and skis.

    force, moment : (2, 3) N, N m on each ski, about its foot;  drag : (4,) N on all exposed segments, and N m about the
    pelvis;  body : N on the centre of mass of skier and boots
    """
    up, com = three(heading.up, 0), three(heading.com_place[n], 0)
    total = drag[3] - dot(up, cross(com, (drag[0], drag[1], drag[2])))
    total += dot(up, cross(plus(three(motion.com_place[n], 0), times(-1.0, com)), body))
    for side in range(2):
        arm = plus(three(motion.foot_place[n, side], 0), times(-1.0, com))
        total += dot(up, plus(cross(arm, three(force[side], 0)), three(moment[side], 0)))
    return total
