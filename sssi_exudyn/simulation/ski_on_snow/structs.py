"""What the force kernels are given and what they fill, as structs: shapes and units in one place.

They are named tuples, which Numba compiles as they are.  Feet and skis are (left, right); vectors are in the slope
frame unless another is named; m contact sections, n elements, k modes, s coordinates of the skeleton.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from sssi_exudyn.core.frames import Array


class SnowGrid(NamedTuple):
    """The snow surface where it is no plane: the coefficients of a bicubic spline (``terrain.surface``).

    coefficients : (nf + 2, nl + 2) m, or (0, 0) for a plane;  origin : (2,) m, f and l of the first node
    spacing : m between nodes
    """

    coefficients: Array
    origin: Array
    spacing: float


class Sections(NamedTuple):
    """Contact sections and lumped masses of a ski of the full model, the same for both skis.

    element, share, length : (m,) element index, share of the distance to its second node, length of edge (m)
    offset : (m, 2, 3) left and right edge in the section's frame, m
    damping : (n, 3) structural damping of each element against relative spin about its own axes, N m s
    node_mass, node_moment : (n + 1,) kg and (n + 1, 3) kg m² of each node, about the foot's axes
    surface : ``SnowGrid`` that the sections touch
    rising : index of the node at the boot where it rises against the captured foot, −1 where it is held there;
        friction acts on that node, or else on the foot
    """

    element: Any
    share: Array
    offset: Array
    length: Array
    damping: Array
    node_mass: Array
    node_moment: Array
    surface: SnowGrid
    rising: int


class CuttingEdges(NamedTuple):
    """What edges that cut need of a ski's sections in addition to ``Sections``, and how it gives against its foot.

    tangent : (m, 2, 3) unit vectors forward along the left and right edge in the section's frame
    width, station, element_length : (m,) m, of the ski, along it, and of the element that the section lies in
    clamped, pitched : index of the node at the boot, and its pitch in the unloaded ski (rad)
    stiffness, damping : (4,) N m/rad, N m s/rad of yaw and roll, N/m, N s/m of heave, N m/rad, N m s/rad of pitch
    """

    tangent: Array
    width: Array
    station: Array
    element_length: Array
    clamped: int
    pitched: float
    stiffness: Array
    damping: Array


class Groove(NamedTuple):
    """The snow's memory along both edges: depth of the groove and offset from its wall, each (2, m) m.

    groove, offset : as the last step left them
    speed, drift : (2, m) m/s of the points along and across their edges then
    arrived_groove, arrived_offset : as they arrive at the points by the end of this step
    next_groove, next_offset, next_speed, next_drift : as this step would leave them
    """

    groove: Array
    offset: Array
    speed: Array
    drift: Array
    arrived_groove: Array
    arrived_offset: Array
    next_groove: Array
    next_offset: Array
    next_speed: Array
    next_drift: Array

    @classmethod
    def fresh(cls, *shape: int) -> Groove:
        """Return the memory of fresh snow: arrays of that shape, (2, m) for a ski and (2, 2, m) for both."""
        return cls(*np.zeros((len(cls._fields), *shape)))


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
    exposed_facing : (e, 3, 3) m⁴, as ``SegmentState`` has it
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
    exposed_facing: Array
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

    Where the leg gives, the last of the k modes is the ski's rise as one with its boot against the captured foot.

    shape : (m, 2, 3, k) displacement of the points by edge (left, right), a unit of the mode, foot's frame
    points : (m, 2, 3) m, unloaded, in the foot's frame;  length : (m,) m of edge
    omega : (k,) rad/s;  ratio : (k,) share of critical damping
    coupling, spinning : (k, 3) the modes' participation in the held node's acceleration (kg) and turning (kg m)
    rise : m by which the boot rises a unit of the last mode; 0 where the leg does not give
    mixed : (k − 1,) kg, mass coupling of the other modes with that rise; empty where the leg does not give
    surface : ``SnowGrid`` that the points touch
    """

    shape: Array
    points: Array
    length: Array
    omega: Array
    ratio: Array
    coupling: Array
    spinning: Array
    rise: float
    mixed: Array
    surface: SnowGrid


class PrescribedMotion(NamedTuple):
    """The posture along a run of the reduced model, at t instants ``step`` (s) apart, relative to the pelvis.

    time : (t,) s
    mass : kg of all;  carried : (t, 3) N, all masses times the posture's own accelerations;  gravity : (3,) m/s²
    area : (e,) frontal areas of the exposed segments, m²;  exposed_velocity : (t, e, 3) m/s
    exposed_facing : (t, e, 3, 3) m⁴, as ``SegmentState`` has it
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
    exposed_facing: Array
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
    force, moment : (t, 2, 3) N, N m of all the snow's forces on each ski, about the place of its foot
    """

    place: Array
    velocity: Array
    loads: Array
    sole: Array
    friction: Array
    edges: Array
    force: Array
    moment: Array


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


class TimeStep(NamedTuple):
    """A step of Newmark's rule: its length (s), and by how much place and rate at its end grow with the acceleration
    there.
    """

    length: float
    by_place: float
    by_rate: float


class NewtonWork(NamedTuple):
    """Arrays in which Newton's method works: trial accelerations (3 + 2k,), amplitudes and rates (2, k) of the modes
    that they lead to, matrix, residual, the contact's own scratch (4 + k, 3 + k), and its points (2m, 9).
    """

    trial: Array
    eta: Array
    rate: Array
    matrix: Array
    residual: Array
    scratch: Array
    posed: Array


class ParameterColumns(NamedTuple):
    """The parameters of the laws by which a run is differentiated, c of them.

    index : (c,) where each stands in the array of parameters
    values : (r, p) other parameters, at which the derivative of some is taken in the run's own states
    row : (c,) row of ``values`` at which it is taken, −1 for the run's own; equal ones stand together
    point, foot, segment, body, terrain, edge : which of them the laws of that place depend on
    """

    index: Any
    values: Array
    row: Any
    point: Any
    foot: Any
    segment: Any
    body: Any
    terrain: Any
    edge: Any


class TangentInputs(NamedTuple):
    """What changes in the inputs of a run of the reduced model, for d numbers by which it is differentiated.

    The first b of them change the tables of feet and body, the next the feet's alone, f with tables in all.  What
    begins late stands before what begins early.

    begins : (d,) the instant at which each first changes anything, none later than the one before
    columns : ``ParameterColumns``;  parameters : (c, d) change of each
    surface : (s, nf + 2, nl + 2) m, changes of the snow surface's coefficients;  shaping : (s,) the number of each
    mass : (d,) kg;  gravity : (3, d) m/s²
    leg : (2, d) of the stiffness (1/s²) and damping (1/s) of the last mode, where the legs give
    place, velocity : (3, d) of the pelvis at the start;  eta : (2k, d) of the modes' amplitudes
    feet : (t, 2, 18, f) place, velocity, turn (rotation vector), spin, ski_acceleration and ski_turning, 3 rows each
    inertia : (t, 3, f) of the posture's ``carried``
    body : (t, 6 + 3e, b) of the centre of mass' place and velocity and of the exposed segments' velocities
    """

    begins: Any
    columns: ParameterColumns
    parameters: Array
    surface: Array
    shaping: Any
    mass: Array
    gravity: Array
    leg: Array
    place: Array
    velocity: Array
    eta: Array
    feet: Array
    inertia: Array
    body: Array


class TangentSeries(NamedTuple):
    """Tangents of ``ReducedSeries``, each with a last axis (d,) for the numbers."""

    place: Array
    velocity: Array
    loads: Array
    sole: Array
    friction: Array
    edges: Array
    force: Array
    moment: Array


class TangentState(NamedTuple):
    """Tangents at one instant, and arrays in which the next are found.

    place, rate, acceleration : (3 + 2k, d) of pelvis and modes
    matrix, right : (3 + 2k, 3 + 2k) and (3 + 2k, d) of the linear system
    skis : (2, 13 + k, 18 + 2k + c) the skis' linearisations
    inputs : (2, 18 + 2k + c, d) tangents of what they depend on
    first, last : (18 + 2k + c,) range in which each row of the inputs is not zero
    """

    place: Array
    rate: Array
    acceleration: Array
    matrix: Array
    right: Array
    skis: Array
    inputs: Array
    first: Any
    last: Any


class SkiWork(NamedTuple):
    """Arrays in which a ski is linearised.

    posed : (2m, 9) the points, as of ``pose_points``
    touching : (2m, 15) of each that is in the snow what ``ski_tangents`` names its columns by
    point : (2m, 2, 21) depth and force of each of these, by what ``point_in_snow`` is differentiated by
    reach : (2m, 3, k) the modes' displacements there
    slopes : (4, 12 + 2k) of one of them depth, force and the snow's two slopes by the ski's columns
    on_patch : (4, 6) the same by the numbers of the patch under the ski
    pulls : (3, 7 + k) what a newton on it, and what its force as these slopes grow, does to the pelvis, the modes, the
        moment about the foot and the load
    by_state : (3, 7) of any law by its state;  by_ground : (3, 2) of height and slopes of the snow by the place
    by_parameter : (3, p) of all laws by the parameters, each in columns of its own
    foot_state, foot_law : (7, 11), (2, 7) of ``foot_on_snow`` and of the foot's laws
    foot : (5, 14) of friction, edge angle and the force on the sole, all these together
    patches : (2, 6) by which the patch under the ski changes as it moves along f and along l
    """

    posed: Array
    touching: Array
    point: Array
    reach: Array
    slopes: Array
    on_patch: Array
    pulls: Array
    by_state: Array
    by_ground: Array
    by_parameter: Array
    foot_state: Array
    foot_law: Array
    foot: Array
    patches: Array
