"""Time series of everything a run tells, computed from its recorded states."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid
from scipy.spatial.transform import Rotation

from sssi_exudyn.bodies.ski.mesh import BeamMesh
from sssi_exudyn.bodies.skier.chain import COORDINATES, PRESCRIBED
from sssi_exudyn.bodies.skier.inverse_dynamics import joint_moments
from sssi_exudyn.bodies.skier.skeleton import CarriedMass
from sssi_exudyn.core.frames import Array, gravity_in_slope, up_in_slope
from sssi_exudyn.motion.hands import Hands, hands_at, pole_forces, use_poles
from sssi_exudyn.motion.motion import antenna_offset
from sssi_exudyn.simulation.assembly import Parts
from sssi_exudyn.simulation.full import carved_forces_kernel
from sssi_exudyn.simulation.full import forces_kernel as kernel
from sssi_exudyn.simulation.full.forces import CarvedForces
from sssi_exudyn.simulation.full.forces_kernel import NODE
from sssi_exudyn.simulation.full.recorder import Record
from sssi_exudyn.simulation.full.snow_wrench import torque_on_quaternion, weight_and_inertia
from sssi_exudyn.simulation.full.system import System, instant
from sssi_exudyn.simulation.heading import Turn, turned
from sssi_exudyn.simulation.posture_table import PostureTable
from sssi_exudyn.simulation.result import EdgeSeries, SimulationResult, SnowWrench, Wrench, side_reserve


def result_from_record(parts: Parts, posture: PostureTable, system: System, record: Record) -> SimulationResult:
    """Return time series of everything from the recorded states; ``posture`` is the table the run was fed with."""
    time = np.array(record.time)
    q, v = record.q, record.v
    rows = np.searchsorted(posture.time, time - 1e-9)
    if not np.allclose(posture.time[np.minimum(rows, len(posture.time) - 1)], time, atol=1e-9):
        posture, rows = parts.posture(time), np.arange(len(time))
    n = len(time)
    turn = record.turn(up_in_slope(parts.model.inclination))
    if record.headings:
        posture, rows = posture.rows(rows).turn(turn, parts.body_mass), np.arange(n)
    forces = system.forces
    cutting = isinstance(forces, CarvedForces)
    along, across = np.empty((n, 2, 3)), np.empty((n, 2, 3))
    for i, row in enumerate(rows):
        at = instant(posture, row)
        for side in range(2):
            place = q[i, :3] + at.foot_place[side]
            along[i, side], across[i, side], _ = forces.foot_axes(place, at.foot_rotation[side])
    feet, drag, body = np.array(record.feet), np.array(record.drag), np.array(record.body)
    pelvis, speed = q[:, :3], v[:, :3]
    antenna = None
    if parts.motion.antenna is not None:
        antenna = pelvis + turned(turn.matrices(), antenna_offset(parts.motion, time)[0])
    nodes = (q + system.ref)[:, system.first_node :].reshape(n, 2, -1, NODE)
    rates = v[:, system.first_node :].reshape(n, 2, -1, NODE)
    cut = parts.mesh
    frame, spin = posture.foot_rotation[rows], posture.foot_spin[rows]
    foot, foot_speed = pelvis[:, None] + posture.foot_place[rows], speed[:, None] + posture.foot_velocity[rows]
    arm = np.einsum("nsij,nskj->nski", frame, nodes[..., :3])
    moving = np.einsum("nsij,nskj->nski", frame, rates[..., :3]) + np.cross(spin[:, :, None], arm)
    moving += foot_speed[:, :, None]
    share = parts.sections.node_mass
    ski_first = np.einsum("k,nskc->nc", share, arm + foot[:, :, None])
    ski_moving = np.einsum("k,nskc->nc", share, moving)
    com_place, com_speed = posture.com_place[rows], posture.com_velocity[rows]
    com = (parts.body_mass * (pelvis + com_place) + ski_first) / parts.mass
    com_velocity = (parts.body_mass * (speed + com_speed) + ski_moving) / parts.mass
    friction = feet[:, :, kernel.ALONG, None] * along + feet[:, :, kernel.ACROSS, None] * across
    moments = np.array(record.moments)
    on_feet = np.zeros_like(friction) if cutting else friction  # what cuts reaches the feet through the skis
    if isinstance(system.skeleton, CarriedMass):
        outer = _of_points(posture, rows, on_feet, drag[..., :3], body)
        moments = _inverse_dynamics(parts, posture, rows, record) - outer
    clamps, twisted = np.array(record.clamps), np.zeros_like(friction)
    if cutting:
        clamps[..., 2] = feet[..., carved_forces_kernel.LIFTED]
        twisted = feet[..., carved_forces_kernel.TURNED : carved_forces_kernel.TURNED + 3]
    body_power = np.sum(body * (speed + com_speed), axis=1)
    poles = None
    if use_poles(parts.model.terms):
        hands = hands_at(parts.motion, time)
        if record.headings:
            hands = _turn_hands(hands, turn)
        poles = pole_forces(parts.model.terms, time, pelvis + com_place, speed + com_speed)
        farther = hands.jacobian - posture.com_jacobian[rows][:, None]
        moments = moments - np.einsum("nhck,nhc->nk", farther, poles)
        body_power = body_power + np.sum(poles * (hands.velocity - com_speed[:, None]), axis=(1, 2))
    on_foot = _from_skis(parts, posture, rows, nodes, clamps, twisted)
    moments = moments - _of_wrenches(posture, rows, *on_foot)
    snow = _snow_wrench(parts, posture.rows(rows), record, (nodes, rates), np.cross(along, across), on_feet)
    kinetic = (
        0.5 * parts.body_mass * np.sum(speed**2, axis=1)
        + parts.body_mass * np.sum(speed * com_speed, axis=1)
        + posture.kinetic[rows]
        + 0.5 * np.einsum("k,nskc->n", share, moving**2)
        + _ski_spinning(parts, nodes, rates, np.einsum("nsji,nsj->nsi", frame, spin))
    )
    elastic = _ski_elastic(cut, nodes)
    forward = frame[..., 0]
    deflection = nodes[:, :, [-1, 0], 2] - parts.ski_in_foot[2] - cut.node_position[[-1, 0], 2]
    of_edges = None
    if cutting:
        given = feet[..., carved_forces_kernel.YAW : carved_forces_kernel.YAW + carved_forces_kernel.JOINTS]
        kinetic = kinetic + 0.5 * np.sum(parts.leg_inertia * (2.0 * rates[:, :, cut.clamped, [6, 4]]) ** 2, axis=(1, 2))
        elastic = elastic + 0.5 * np.sum(parts.edges.stiffness * given**2, axis=(1, 2))
        forward = np.einsum("nsij,nsj->nsi", frame, _first_axis(nodes[:, :, cut.clamped, 3:]))
        of_edges = _series_of_edges(feet, turn.angle)
        ahead = cut.node_position[[-1, 0], 0] - cut.node_position[cut.clamped, 0]
        deflection = deflection - of_edges.heave[..., None] + of_edges.pitch[..., None] * ahead
    powers: dict[str, Array] = {
        "posture": np.sum(moments * posture.rates[rows], axis=1),
        "contact": feet[:, :, kernel.CONTACT_POWER].sum(axis=1),
        "friction": feet[:, :, kernel.FRICTION_POWER].sum(axis=1),
        **({} if of_edges is None else {"skid": feet[:, :, carved_forces_kernel.SKID_POWER].sum(axis=1)}),
        "air": drag[..., 3].sum(axis=1),
        "body": body_power,
        "damping": feet[:, :, kernel.DAMPING_POWER].sum(axis=1),
    }
    energy = {name: _integral(power, time) for name, power in powers.items()}
    energy["gravity"] = parts.mass * (com - com[0]) @ gravity_in_slope(parts.model.inclination)
    closure = sum(energy.values()) - (kinetic - kinetic[0]) - (elastic - elastic[0])
    energy |= {"kinetic": kinetic, "elastic": elastic}
    angles = posture.angles[rows]
    return SimulationResult(
        coordinate_names=COORDINATES,
        moment_names=PRESCRIBED,
        time=time,
        pelvis=pelvis,
        pelvis_velocity=speed,
        com=com,
        com_velocity=com_velocity,
        antenna=antenna,
        coordinates=np.hstack([pelvis, angles]),
        foot_load=feet[:, :, kernel.LOAD],
        sole_force=np.einsum("nsk,nsk->ns", snow.force, frame[..., 2]),
        snow=snow,
        ski_bending=_ski_bending(parts, posture.rows(rows), np.array(record.pull), snow, on_foot, on_feet),
        foot_friction=friction,
        foot_position=foot,
        foot_velocity=foot_speed,
        foot_forward=forward,
        edge_angle=feet[:, :, kernel.EDGE],
        penetration=feet[:, :, kernel.DEPTH],
        drag=drag[..., :3].sum(axis=1),
        segment_drag={name: drag[:, k, :3] for k, name in enumerate(parts.areas)},
        body_force=body if poles is None else body - poles.sum(axis=1),
        joint_moments=moments,
        ski_deflection=deflection,
        energy=energy,
        energy_closure=np.asarray(closure),
        statistics=record.solver,
        edges=of_edges,
        pole_force=poles,
        ankle_edging=_edging(parts, posture, rows, np.array(record.pull), on_foot[0] + on_feet, on_foot[1]),
    )


def _snow_wrench(
    parts: Parts,
    posture: PostureTable,
    record: Record,
    skis: tuple[Array, Array],
    normal: Array,
    friction: Array,
) -> SnowWrench:
    """Return what the snow does to both skis; ``posture`` is that of the record's instants.

    skis : (n, 2, k, 7) coordinates of the nodes, and their rates
    normal : (n, 2, 3) of the snow under the feet
    friction : (n, 2, 3) N that acts on the feet's places themselves
    """
    if parts.is_carved:
        feet, first, second = np.array(record.feet), carved_forces_kernel.PUSHED, carved_forces_kernel.TWISTED
        return SnowWrench(feet[..., first : first + 3], feet[..., second : second + 3], normal)
    nodes, rates = (part[..., :3] for part in skis)
    mass, gravity = (parts.node_mass, parts.node_moment), gravity_in_slope(parts.model.inclination)
    wrench = record.on_skis - weight_and_inertia(posture, nodes, rates, mass, gravity)
    force, moment = np.einsum("nsij,nswj->wnsi", posture.foot_rotation, wrench.reshape(*normal.shape[:2], 2, 3))
    return SnowWrench(force + friction, moment, normal)


def _ski_bending(
    parts: Parts, posture: PostureTable, pull: Array, snow: SnowWrench, on_foot: tuple[Array, Array], friction: Array
) -> Wrench:
    """Return what must act on rigid skis in addition to the snow, so that the feet get ``on_foot`` and ``friction``.

    on_foot : (n, 2, 3) N and N m of the skis on the feet, about the feet's places
    pull : (n, 3) m/s² of the pelvis
    """
    ski, turn, spin, rate = parts.ski, posture.foot_rotation, posture.foot_spin, posture.foot_spin_rate
    arm = turn @ ski.com
    inertia = turn @ ski.inertia @ np.swapaxes(turn, -1, -2)
    moving = pull[:, None] + posture.foot_acceleration + np.cross(rate, arm) + np.cross(spin, np.cross(spin, arm))
    force = ski.mass * (moving - gravity_in_slope(parts.model.inclination))
    turning = np.einsum("nsij,nsj->nsi", inertia, rate)
    turning += np.cross(spin, np.einsum("nsij,nsj->nsi", inertia, spin))
    moment = np.cross(arm, force) + turning
    return Wrench(force + on_foot[0] + friction - snow.force, moment + on_foot[1] - snow.moment)


def _turn_hands(hands: Hands, turn: Turn) -> Hands:
    matrices = turn.matrices()
    moving = turned(matrices, turn.velocity(hands.place, hands.velocity))
    return Hands(turned(matrices, hands.place), moving, matrices[:, None] @ hands.jacobian)


def _series_of_edges(feet: Array, heading: Array) -> EdgeSeries:
    return EdgeSeries(
        heading=heading,
        yaw=feet[..., carved_forces_kernel.YAW],
        roll=feet[..., carved_forces_kernel.ROLL],
        heave=feet[..., carved_forces_kernel.HEAVE],
        pitch=feet[..., carved_forces_kernel.PITCH],
        side_reserve=side_reserve(feet[..., carved_forces_kernel.MOST], feet[..., carved_forces_kernel.BORNE]),
        along=feet[..., carved_forces_kernel.DRAGGED],
        across=feet[..., carved_forces_kernel.USED],
    )


def _first_axis(q: Array) -> Array:
    """Return the first axis (…, 3) of quaternions (…, 4)."""
    w, x, y, z = np.moveaxis(q, -1, 0)
    return np.stack([1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)], axis=-1)


def _integral(power: Array, time: Array) -> Array:
    return np.asarray(cumulative_trapezoid(power, time, initial=0), dtype=np.float64)


def _inverse_dynamics(parts: Parts, posture: PostureTable, rows: NDArray[np.intp], record: Record) -> Array:
    """Return the moments (n, 28) N m that move the skier without skis as recorded, gravity apart from other forces."""
    return joint_moments(
        parts.motion.geometry,
        parts.inertias,
        parts.model.inclination,
        gravity_in_slope(parts.model.inclination),
        np.hstack([record.q[:, :3], posture.angles[rows]]),
        np.hstack([record.v[:, :3], posture.rates[rows]]),
        np.hstack([np.array(record.pull), posture.accelerations[rows]]),
    )


def _of_points(posture: PostureTable, rows: NDArray[np.intp], friction: Array, drag: Array, body: Array) -> Array:
    """Return (n, 28) N m that forces do to the prescribed coordinates.

    friction, drag, body : (n, 2, 3) on the feet, (n, k, 3) on the exposed segments, (n, 3) on the centre of mass
    """
    moments = np.einsum("nsck,nsc->nk", posture.foot_jacobian[rows], friction)
    moments += np.einsum("nsck,nsc->nk", posture.exposed_jacobian[rows], drag)
    return np.asarray(moments + np.einsum("nck,nc->nk", posture.com_jacobian[rows], body))


def _from_skis(
    parts: Parts, posture: PostureTable, rows: NDArray[np.intp], nodes: Array, clamps: Array, turned: Array
) -> tuple[Array, Array]:
    """Return what the skis do to the feet about the feet's places, (n, 2, 3) N and N m in the slope frame.

    clamps (n, 2, 6): force on the clamped node (foot's frame) and on three of its quaternion's components.
    turned (n, 2, 3): a further moment on that node, N m in the foot's frame.
    """
    middle = nodes[:, :, parts.mesh.clamped]
    frame = posture.foot_rotation[rows]
    general = np.concatenate([np.zeros_like(clamps[..., :1]), clamps[..., 3:]], axis=-1)
    torque = turned + torque_on_quaternion(middle[..., 3:], general)
    force = clamps[..., :3]
    torque = torque + np.cross(middle[..., :3], force)
    return -np.einsum("nsij,nsj->nsi", frame, force), -np.einsum("nsij,nsj->nsi", frame, torque)


def _of_wrenches(posture: PostureTable, rows: NDArray[np.intp], force: Array, torque: Array) -> Array:
    """Return (n, 28) N m that forces on the feet's places and torques, (n, 2, 3), do to the prescribed coordinates."""
    moments = np.einsum("nsck,nsc->nk", posture.foot_jacobian[rows], force)
    return np.asarray(moments + np.einsum("nsck,nsc->nk", posture.foot_turning[rows], torque))


def _edging(
    parts: Parts, posture: PostureTable, rows: NDArray[np.intp], pull: Array, force: Array, torque: Array
) -> Array:
    """Return the moments (n, 2) N m of the shanks on the feet about their long axes at the ankles.

    force, torque (n, 2, 3) are what friction and skis do to the feet at their places, pull (n, 3) m/s² is the pelvis'
    acceleration; the foot with its boot, a rigid body, takes the rest.
    """
    turn, spin, rate = posture.foot_rotation[rows], posture.foot_spin[rows], posture.foot_spin_rate[rows]
    gear = parts.model.equipment
    sole = np.array([gear.boot_centre, 0.0, -parts.motion.geometry.ankle_to_ski_base])
    edging = np.empty(force.shape[:2])
    for side, letter in enumerate("lr"):
        body = parts.foot(letter)
        frame = turn[:, side]
        down, arm = frame @ sole, frame @ (body.com - sole)
        swing = np.cross(spin[:, side], np.cross(spin[:, side], arm))
        moving = pull + posture.foot_acceleration[rows, side] + np.cross(rate[:, side], arm) + swing
        inertia = frame @ body.inertia @ np.swapaxes(frame, 1, 2)
        turning = np.einsum("nij,nj->ni", inertia, rate[:, side])
        turning += np.cross(spin[:, side], np.einsum("nij,nj->ni", inertia, spin[:, side]))
        felt = body.mass * (moving - gravity_in_slope(parts.model.inclination))
        own = np.cross(frame @ body.com, felt) + turning
        outer = np.cross(down, force[:, side]) + torque[:, side]
        edging[:, side] = np.sum((own - outer) * frame[..., 0], axis=1)
    return edging


def _ski_spinning(parts: Parts, nodes: Array, rates: Array, carried: Array) -> Array:
    """Return the energy (n,) J of the nodes' spin; ``carried`` (n, 2, 3) is the feet's spin in their own frame."""
    scalar, vector = nodes[..., 3:4], nodes[..., 4:]
    local = 2.0 * (scalar * rates[..., 4:] - rates[..., 3:4] * vector + np.cross(vector, rates[..., 4:]))
    total = local + carried[:, :, None]
    return np.asarray(0.5 * np.einsum("kc,nskc->n", parts.sections.node_moment, total**2))


def _strains(nodes: Array) -> Array:
    """Return the SE(3) logarithm (…, e, 6) of each element's relative pose: stretch along x, y, z (m), turn about x, y,
    z (rad).

    nodes (…, e + 1, 7): place and unit quaternion, of one sign along a ski.
    """
    first, second = nodes[..., :-1, :], nodes[..., 1:, :]
    w, u = first[..., 3:4], -first[..., 4:]  # back into the first node's frame
    gap = second[..., :3] - first[..., :3]
    across = 2.0 * _cross(u, gap)
    move = gap + w * across + _cross(u, across)
    scalar = w * second[..., 3:4] - np.sum(u * second[..., 4:], axis=-1, keepdims=True)
    vector = w * second[..., 4:] + second[..., 3:4] * u + _cross(u, second[..., 4:])
    half = np.arctan2(np.linalg.norm(vector, axis=-1, keepdims=True), scalar)
    half = np.maximum(half, 1e-9)
    turn = 2.0 * half / np.sin(half) * vector
    once = _cross(turn, move)
    rho = move - 0.5 * once + (1.0 - half / np.tan(half)) / (2.0 * half) ** 2 * _cross(turn, once)
    return np.concatenate([rho, turn], axis=-1)


def _cross(a: Array, b: Array) -> Array:
    """Return the cross product (…, 3); NumPy's own takes twice the time for arrays of this size."""
    x, y, z = np.moveaxis(a, -1, 0)
    u, v, w = np.moveaxis(b, -1, 0)
    return np.stack([y * w - z * v, z * u - x * w, x * v - y * u], axis=-1)


def _ski_elastic(cut: BeamMesh, nodes: Array) -> Array:
    """Return the energy (n,) J of both skis: ½ Σ εᵀ C ε L with the strains of the unloaded ski taken off."""
    reference = np.hstack([cut.node_position, Rotation.from_matrix(cut.node_rotation).as_quat(scalar_first=True)])
    unloaded = _strains(reference)

    def of_stretch(stretch: Array) -> Array:
        strain = (_strains(stretch) - unloaded) / cut.element_length[:, None]
        return np.asarray(0.5 * np.einsum("nsec,ec,e->n", strain**2, cut.stiffness, cut.element_length))

    # a stretch at a time: intermediate strains are several times larger than the states
    return np.concatenate([of_stretch(part) for part in np.array_split(nodes, max(1, len(nodes) // 200))])
