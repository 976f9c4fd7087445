"""What the force kernels are given and what they fill, as structs: shapes and units in one place.

They are named tuples, which Numba compiles as they are.  Feet and skis are (left, right); vectors are in the slope
frame unless another is named; m contact sections, n elements, k modes, s coordinates of the skeleton.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from sssi_exudyn.core.frames import Array


class Sections(NamedTuple):
    """Contact sections and lumped masses of a ski of the full model, the same for both skis.

    element, share, length : (m,) element index, share of the way to its second node, length of edge (m)
    offset : (m, 2, 3) left and right edge in the section's frame, m
    damping : (n, 3) structural damping of each element against relative spin about its own axes, N m s
    node_mass, node_moment : (n + 1,) kg and (n + 1, 3) kg m² of each node, about the foot's axes
    """

    element: Any
    share: Array
    offset: Array
    length: Array
    damping: Array
    node_mass: Array
    node_moment: Array


class Carrier(NamedTuple):
    """What of the skier does not change along a run of the full model.

    sign : (s,) skeleton's coordinate / chain's coordinate: s = 31 for the tree, 3 for the pelvis' place alone
    area : (e,) frontal areas of the exposed segments, m²
    gravity : (3,) m/s²
    """

    sign: Array
    area: Array
    gravity: Array


class Instant(NamedTuple):
    """The prescribed posture at one time (s), relative to the pelvis: one row of ``PostureTable``.

    foot_place, foot_velocity, foot_acceleration : (2, 3) m, m/s, m/s²
    foot_rotation : (2, 3, 3) foot frame → slope frame;  foot_spin, foot_spin_rate : (2, 3) rad/s, rad/s²
    com_place, com_velocity : (3,) m, m/s of skier, boots and bindings;  exposed_velocity : (e, 3) m/s
    foot_jacobian (2, 3, 28), com_jacobian (3, 28), exposed_jacobian (e, 3, 28) : velocity a unit rate of each angle
    """

    time: float
    foot_place: Array
    foot_velocity: Array
    foot_acceleration: Array
    foot_rotation: Array
    foot_spin: Array
    foot_spin_rate: Array
    foot_jacobian: Array
    com_place: Array
    com_velocity: Array
    com_jacobian: Array
    exposed_velocity: Array
    exposed_jacobian: Array


class ForcePass(NamedTuple):
    """What one pass over all forces of the full model fills.

    out : generalised forces on all coordinates (N, N m)
    seen : (2, 11) one row a ski, its columns named in ``full_kernel``
    drag : (e, 4) the air's force (N) and its power (W) on each exposed segment
    body : (3,) force of the body terms, N
    """

    out: Array
    seen: Array
    drag: Array
    body: Array


class Triplets(NamedTuple):
    """A sparse matrix: rows, columns and values, each (entries,) or more."""

    rows: Any
    columns: Any
    values: Array


class ModalContact(NamedTuple):
    """A ski of the reduced model, the same for both: its vibrations, held at the foot, and its contact points.

    shape : (m, 2, 3, k) displacement of the points by edge (left, right), a unit of the mode, foot's frame
    points : (m, 2, 3) m, unloaded, in the foot's frame;  length : (m,) m of edge
    omega : (k,) rad/s;  ratio : (k,) share of critical damping
    coupling, spinning : (k, 3) the modes' participation in the held node's acceleration (kg) and turning (kg m)
    """

    shape: Array
    points: Array
    length: Array
    omega: Array
    ratio: Array
    coupling: Array
    spinning: Array


class PrescribedMotion(NamedTuple):
    """The posture along a run of the reduced model, at t instants ``step`` (s) apart, relative to the pelvis.

    time : (t,) s
    mass : kg of all;  carried : (t, 3) N, all masses times the posture's own accelerations;  gravity : (3,) m/s²
    area : (e,) frontal areas of the exposed segments, m²;  exposed_velocity : (t, e, 3) m/s
    foot_place, foot_velocity, foot_spin : (t, 2, 3) m, m/s, rad/s;  foot_rotation : (t, 2, 3, 3)
    ski_acceleration, ski_turning : (t, 2, 3) of the skis' held nodes, in the feet's frames: acceleration less gravity
        (m/s²), and effective angular acceleration (rad/s²)
    com_place, com_velocity : (t, 3) m, m/s of skier, boots and bindings
    """

    step: float
    time: Array
    mass: float
    carried: Array
    gravity: Array
    area: Array
    exposed_velocity: Array
    foot_place: Array
    foot_velocity: Array
    foot_rotation: Array
    foot_spin: Array
    ski_acceleration: Array
    ski_turning: Array
    com_place: Array
    com_velocity: Array


class InitialState(NamedTuple):
    """Where a run of the reduced model starts: the pelvis' place and velocity (3,) m, m/s; the modes' amplitudes
    (2, k).
    """

    place: Array
    velocity: Array
    eta: Array


class ReducedSeries(NamedTuple):
    """What a run of the reduced model fills, at t instants.

    place, velocity : (t, 3) m, m/s of the pelvis
    loads, sole : (t, 2) N normal to the snow and square to the sole;  edges : (t, 2) rad
    friction : (t, 2, 3) N on each foot
    """

    place: Array
    velocity: Array
    loads: Array
    sole: Array
    friction: Array
    edges: Array


class ReducedState(NamedTuple):
    """The unknowns of the reduced model at one instant.

    place, velocity : (3,) m, m/s of the pelvis;  eta, rate : (2, k) of the modes
    acceleration : (3 + 2k,) of both, pelvis first
    """

    place: Array
    velocity: Array
    eta: Array
    rate: Array
    acceleration: Array


class NewtonWork(NamedTuple):
    """Arrays in which Newton's method works: trial accelerations (3 + 2k,) and the state they lead to, friction
    (2, 3) N, matrix, residual, and the contact's own scratch (4 + k, 3 + k).
    """

    trial: Array
    eta: Array
    rate: Array
    push: Array
    matrix: Array
    residual: Array
    scratch: Array
