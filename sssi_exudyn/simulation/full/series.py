"""Time series of everything a run tells, computed from its recorded states."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
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
from sssi_exudyn.simulation.full.forces_kernel import NODE
from sssi_exudyn.simulation.full.recorder import Record
from sssi_exudyn.simulation.full.snow_wrench import torque_on_quaternion, weight_and_inertia
from sssi_exudyn.simulation.full.system import System
from sssi_exudyn.simulation.heading import Turn, turned
from sssi_exudyn.simulation.posture_table import PostureTable
from sssi_exudyn.simulation.result import EdgeSeries, SimulationResult, SnowWrench, Wrench, side_reserve


@dataclass(frozen=True)
class _Recorded:
    """A record as arrays over its n instants, with the posture at each of them.

    posture : turned as the heading was found;  turn : by how much
    pelvis, speed, pull : (n, 3) m, m/s, m/s² of the pelvis
    foot, foot_speed : (n, 2, 3) m, m/s of the feet's places
    nodes, rates : (n, 2, k, 7) coordinates of the skis' nodes in the feet's frames, and their rates
    arm, moving : (n, 2, k, 3) of the nodes in the slope frame: m from the feet's places, m/s
    feet, drag, body : what the forces gave, as ``ForcePass`` has it
    clamps : (n, 2, 6) of the constraints that hold the skis
    """

    time: Array
    posture: PostureTable
    turn: Turn
    pelvis: Array
    speed: Array
    pull: Array
    foot: Array
    foot_speed: Array
    nodes: Array
    rates: Array
    arm: Array
    moving: Array
    feet: Array
    drag: Array
    body: Array
    clamps: Array

    @classmethod
    def of(cls, parts: Parts, posture: PostureTable, system: System, record: Record) -> _Recorded:
        """Evaluate a record; ``posture`` is the table that the run was fed with."""
        time, n = np.array(record.time), len(record.time)
        rows = np.searchsorted(posture.time, time - 1e-9)
        if not np.allclose(posture.time[np.minimum(rows, len(posture.time) - 1)], time, atol=1e-9):
            posture, rows = parts.posture(time), np.arange(n)
        posture, turn = posture.rows(rows), record.turn(up_in_slope(parts.model.inclination))
        if parts.model.heading.is_found:
            posture = posture.turn(turn, parts.body_mass)
        pelvis, speed = record.q[:, :3], record.v[:, :3]
        nodes = (record.q + system.ref)[:, system.first_node :].reshape(n, 2, -1, NODE)
        rates = record.v[:, system.first_node :].reshape(n, 2, -1, NODE)
        foot, foot_speed = pelvis[:, None] + posture.foot_place, speed[:, None] + posture.foot_velocity
        arm = np.einsum("nsij,nskj->nski", posture.foot_rotation, nodes[..., :3])
        moving = np.einsum("nsij,nskj->nski", posture.foot_rotation, rates[..., :3])
        moving = moving + np.cross(posture.foot_spin[:, :, None], arm)
        return cls(
            time=time,
            posture=posture,
            turn=turn,
            pelvis=pelvis,
            speed=speed,
            pull=np.array(record.pull),
            foot=foot,
            foot_speed=foot_speed,
            nodes=nodes,
            rates=rates,
            arm=arm,
            moving=moving + foot_speed[:, :, None],
            feet=np.array(record.feet),
            drag=np.array(record.drag),
            body=np.array(record.body),
            clamps=np.array(record.clamps),
        )


@dataclass(frozen=True)
class _OfPoles:
    """What poles do: force (n, 2, 3) N on the hands, moment (n, 28) N m on the prescribed coordinates beyond that of
    the same force on the centre of mass, and power (n,) W beyond that force's.
    """

    force: Array
    moment: Array
    power: Array


def result_from_record(parts: Parts, posture: PostureTable, system: System, record: Record) -> SimulationResult:
    """Return time series of everything from the recorded states; ``posture`` is the table the run was fed with."""
    run = _Recorded.of(parts, posture, system, record)
    along, across = _foot_axes(run, system)
    friction = run.feet[:, :, kernel.ALONG, None] * along + run.feet[:, :, kernel.ACROSS, None] * across
    through_skis = parts.is_carved or parts.model.legs.give
    on_feet = np.zeros_like(friction) if through_skis else friction
    snow = _snow_wrench(parts, run, record, np.cross(along, across), on_feet)
    on_foot, poles = _from_skis(parts, run), _from_poles(parts, run)
    moments = np.array(record.moments)
    if isinstance(system.skeleton, CarriedMass):
        outer = _of_points(run.posture, on_feet, run.drag[..., :3], run.body)
        moments = _inverse_dynamics(parts, run) - outer
    if poles is not None:
        moments = moments - poles.moment
    moments = moments - _of_wrenches(run.posture, *on_foot)
    com, com_velocity = _centre_of_mass(parts, run)
    edges = _series_of_edges(run.feet, run.turn.angle) if parts.is_carved else None
    energy, closure = _energy(parts, run, com, _powers(parts, run, moments, poles))
    return SimulationResult(
        coordinate_names=COORDINATES,
        moment_names=PRESCRIBED,
        time=run.time,
        pelvis=run.pelvis,
        pelvis_velocity=run.speed,
        com=com,
        com_velocity=com_velocity,
        antenna=_antenna(parts, run),
        coordinates=np.hstack([run.pelvis, run.posture.angles]),
        foot_load=run.feet[:, :, kernel.LOAD],
        sole_force=np.einsum("nsk,nsk->ns", snow.force, run.posture.foot_rotation[..., 2]),
        snow=snow,
        ski_bending=_ski_bending(parts, run, snow, on_foot, on_feet),
        foot_friction=friction,
        foot_position=run.foot,
        foot_velocity=run.foot_speed,
        foot_forward=_forward(parts, run),
        edge_angle=run.feet[:, :, kernel.EDGE],
        penetration=run.feet[:, :, kernel.DEPTH],
        drag=run.drag[..., :3].sum(axis=1),
        segment_drag={name: run.drag[:, k, :3] for k, name in enumerate(parts.areas)},
        body_force=run.body if poles is None else run.body - poles.force.sum(axis=1),
        joint_moments=moments,
        ski_deflection=_deflection(parts, run, edges),
        energy=energy,
        energy_closure=closure,
        statistics=record.solver,
        edges=edges,
        pole_force=None if poles is None else poles.force,
        ankle_edging=_edging(parts, run, on_foot[0] + on_feet, on_foot[1]),
    )


def _antenna(parts: Parts, run: _Recorded) -> Array | None:
    if parts.motion.antenna is None:
        return None
    return np.asarray(run.pelvis + turned(run.turn.matrices(), antenna_offset(parts.motion, run.time)[0]))


def _foot_axes(run: _Recorded, system: System) -> tuple[Array, Array]:
    """Return the axes (n, 2, 3) along and across each foot in the snow's tangent plane."""
    along, across = np.empty_like(run.foot), np.empty_like(run.foot)
    for i, side in np.ndindex(run.foot.shape[:2]):
        place, frame = run.foot[i, side], run.posture.foot_rotation[i, side]
        along[i, side], across[i, side], _ = system.forces.foot_axes(place, frame)
    return along, across


def _centre_of_mass(parts: Parts, run: _Recorded) -> tuple[Array, Array]:
    """Return place and velocity (n, 3) m, m/s of the centre of mass of skier, boots and skis."""
    share, mass = parts.sections.node_mass, parts.body_mass
    skis = np.einsum("k,nskc->nc", share, run.arm + run.foot[:, :, None])
    moving = np.einsum("k,nskc->nc", share, run.moving)
    com = (mass * (run.pelvis + run.posture.com_place) + skis) / parts.mass
    return com, (mass * (run.speed + run.posture.com_velocity) + moving) / parts.mass


def _from_poles(parts: Parts, run: _Recorded) -> _OfPoles | None:
    if not use_poles(parts.model.terms):
        return None
    hands, posture = hands_at(parts.motion, run.time), run.posture
    if parts.model.heading.is_found:
        hands = _turn_hands(hands, run.turn)
    com, com_velocity = run.pelvis + posture.com_place, run.speed + posture.com_velocity
    force = pole_forces(parts.model.terms, run.time, com, com_velocity)
    farther = hands.jacobian - posture.com_jacobian[:, None]
    return _OfPoles(
        force,
        np.einsum("nhck,nhc->nk", farther, force),
        np.sum(force * (hands.velocity - posture.com_velocity[:, None]), axis=(1, 2)),
    )


def _forward(parts: Parts, run: _Recorded) -> Array:
    """Return the unit vector (n, 2, 3) along each ski, which turns against its foot where it cuts the snow."""
    frame = run.posture.foot_rotation
    if not parts.is_carved:
        return frame[..., 0]
    axis = _first_axis(run.nodes[:, :, parts.mesh.clamped, 3:])
    return np.asarray(np.einsum("nsij,nsj->nsi", frame, axis))


def _deflection(parts: Parts, run: _Recorded, edges: EdgeSeries | None) -> Array:
    """Return the normal deflection (n, 2, 2) m of each ski's tip and tail against its unloaded shape."""
    mesh = parts.mesh
    deflection = run.nodes[:, :, [-1, 0], 2] - parts.ski_in_foot[2] - mesh.node_position[[-1, 0], 2]
    if parts.model.legs.give:
        deflection = deflection - _rise(parts, run)[0][..., None]
    if edges is None:
        return np.asarray(deflection)
    ahead = mesh.node_position[[-1, 0], 0] - mesh.node_position[mesh.clamped, 0]
    return np.asarray(deflection - edges.heave[..., None] + edges.pitch[..., None] * ahead)


def _powers(parts: Parts, run: _Recorded, moments: Array, poles: _OfPoles | None) -> dict[str, Array]:
    """Return the power (n,) W of everything but gravity, by name."""
    feet = run.feet
    body = np.sum(run.body * (run.speed + run.posture.com_velocity), axis=1)
    skid = {"skid": feet[:, :, carved_forces_kernel.SKID_POWER].sum(axis=1)} if parts.is_carved else {}
    return {
        "posture": np.sum(moments * run.posture.rates, axis=1),
        "contact": feet[:, :, kernel.CONTACT_POWER].sum(axis=1),
        "friction": feet[:, :, kernel.FRICTION_POWER].sum(axis=1),
        **skid,
        "air": run.drag[..., 3].sum(axis=1),
        "body": body if poles is None else body + poles.power,
        "damping": feet[:, :, kernel.DAMPING_POWER].sum(axis=1) - _leg_loss(parts, run),
    }


def _energy(parts: Parts, run: _Recorded, com: Array, powers: Mapping[str, Array]) -> tuple[dict[str, Array], Array]:
    """Return all energies (n,) J by name, cumulative but for what is stored, and what their balance leaves over."""
    kinetic, elastic = _kinetic(parts, run), _ski_elastic(parts.mesh, run.nodes)
    if parts.is_carved:
        first = carved_forces_kernel.YAW
        given, turning = run.feet[..., first : first + carved_forces_kernel.JOINTS], run.rates[:, :, parts.mesh.clamped]
        kinetic = kinetic + 0.5 * np.sum(parts.leg_inertia * (2.0 * turning[..., [6, 4]]) ** 2, axis=(1, 2))
        elastic = elastic + 0.5 * np.sum(parts.edges.stiffness * given**2, axis=(1, 2))
    if parts.model.legs.give:
        elastic = elastic + 0.5 * parts.model.legs.stiffness * np.sum(_rise(parts, run)[0] ** 2, axis=1)
    energy = {name: _integral(power, run.time) for name, power in powers.items()}
    energy["gravity"] = parts.mass * (com - com[0]) @ gravity_in_slope(parts.model.inclination)
    closure = sum(energy.values()) - (kinetic - kinetic[0]) - (elastic - elastic[0])
    return {**energy, "kinetic": kinetic, "elastic": elastic}, np.asarray(closure)


def _rise(parts: Parts, run: _Recorded) -> tuple[Array, Array]:
    """Return by how much the boots have risen against the captured feet (n, 2) m, and how fast (n, 2) m/s."""
    mesh = parts.mesh
    still = parts.ski_in_foot[2] + mesh.node_position[mesh.clamped, 2]
    return run.nodes[:, :, mesh.clamped, 2] - still, run.rates[:, :, mesh.clamped, 2]


def _leg_loss(parts: Parts, run: _Recorded) -> Array:
    """Return the power (n,) W that the dampers of legs that give take."""
    if not parts.model.legs.give:
        return np.zeros(len(run.time))
    return np.asarray(parts.model.legs.damping * np.sum(_rise(parts, run)[1] ** 2, axis=1))


def _kinetic(parts: Parts, run: _Recorded) -> Array:
    """Return the kinetic energy (n,) J of the body and of the skis' nodes."""
    posture, speed = run.posture, run.speed
    carried = np.einsum("nsji,nsj->nsi", posture.foot_rotation, posture.foot_spin)
    return np.asarray(
        0.5 * parts.body_mass * np.sum(speed**2, axis=1)
        + parts.body_mass * np.sum(speed * posture.com_velocity, axis=1)
        + posture.kinetic
        + 0.5 * np.einsum("k,nskc->n", parts.sections.node_mass, run.moving**2)
        + _ski_spinning(parts, run.nodes, run.rates, carried)
    )


def _snow_wrench(parts: Parts, run: _Recorded, record: Record, normal: Array, friction: Array) -> SnowWrench:
    """Return what the snow does to both skis.

    normal : (n, 2, 3) of the snow under the feet
    friction : (n, 2, 3) N that acts on the feet's places themselves
    """
    if parts.is_carved:
        feet, first, second = run.feet, carved_forces_kernel.PUSHED, carved_forces_kernel.TWISTED
        return SnowWrench(feet[..., first : first + 3], feet[..., second : second + 3], normal)
    nodes, rates = run.nodes[..., :3], run.rates[..., :3]
    mass, gravity = (parts.node_mass, parts.node_moment), gravity_in_slope(parts.model.inclination)
    wrench = record.on_skis - weight_and_inertia(run.posture, nodes, rates, mass, gravity)
    force, moment = np.einsum("nsij,nswj->wnsi", run.posture.foot_rotation, wrench.reshape(*normal.shape[:2], 2, 3))
    return SnowWrench(force + friction, moment, normal)


def _ski_bending(
    parts: Parts, run: _Recorded, snow: SnowWrench, on_foot: tuple[Array, Array], friction: Array
) -> Wrench:
    """Return what must act on rigid skis in addition to the snow, so that the feet get ``on_foot`` and ``friction``.

    on_foot : (n, 2, 3) N and N m of the skis on the feet, about the feet's places
    """
    ski, posture = parts.ski, run.posture
    turn, spin, rate = posture.foot_rotation, posture.foot_spin, posture.foot_spin_rate
    arm = turn @ ski.com
    inertia = turn @ ski.inertia @ np.swapaxes(turn, -1, -2)
    moving = run.pull[:, None] + posture.foot_acceleration + np.cross(rate, arm) + np.cross(spin, np.cross(spin, arm))
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


def _inverse_dynamics(parts: Parts, run: _Recorded) -> Array:
    """Return the moments (n, 28) N m that move the skier without skis as recorded, gravity apart from other forces."""
    return joint_moments(
        parts.motion.geometry,
        parts.inertias,
        parts.model.inclination,
        gravity_in_slope(parts.model.inclination),
        np.hstack([run.pelvis, run.posture.angles]),
        np.hstack([run.speed, run.posture.rates]),
        np.hstack([run.pull, run.posture.accelerations]),
    )


def _of_points(posture: PostureTable, friction: Array, drag: Array, body: Array) -> Array:
    """Return (n, 28) N m that forces do to the prescribed coordinates.

    friction, drag, body : (n, 2, 3) on the feet, (n, k, 3) on the exposed segments, (n, 3) on the centre of mass
    """
    moments = np.einsum("nsck,nsc->nk", posture.foot_jacobian, friction)
    moments += np.einsum("nsck,nsc->nk", posture.exposed_jacobian, drag)
    return np.asarray(moments + np.einsum("nck,nc->nk", posture.com_jacobian, body))


def _from_skis(parts: Parts, run: _Recorded) -> tuple[Array, Array]:
    """Return what the skis do to the feet about the feet's places, (n, 2, 3) N and N m in the slope frame.

    The clamps' forces act on the clamped node (foot's frame) and on three of its quaternion's components; where skis
    give against their feet, what lifts and turns them comes from the snow's law or the leg's spring instead.
    """
    clamps, twisted = run.clamps.copy(), np.zeros_like(run.foot)
    if parts.is_carved:
        clamps[..., 2] = run.feet[..., carved_forces_kernel.LIFTED]
        twisted = run.feet[..., carved_forces_kernel.TURNED : carved_forces_kernel.TURNED + 3]
    elif parts.model.legs.give:
        legs, (rise, rising) = parts.model.legs, _rise(parts, run)
        clamps[..., 2] = -(legs.stiffness * rise + legs.damping * rising)
    middle = run.nodes[:, :, parts.mesh.clamped]
    frame = run.posture.foot_rotation
    general = np.concatenate([np.zeros_like(clamps[..., :1]), clamps[..., 3:]], axis=-1)
    torque = twisted + torque_on_quaternion(middle[..., 3:], general)
    force = clamps[..., :3]
    torque = torque + np.cross(middle[..., :3], force)
    return -np.einsum("nsij,nsj->nsi", frame, force), -np.einsum("nsij,nsj->nsi", frame, torque)


def _of_wrenches(posture: PostureTable, force: Array, torque: Array) -> Array:
    """Return (n, 28) N m that forces on the feet's places and torques, (n, 2, 3), do to the prescribed coordinates."""
    moments = np.einsum("nsck,nsc->nk", posture.foot_jacobian, force)
    return np.asarray(moments + np.einsum("nsck,nsc->nk", posture.foot_turning, torque))


def _edging(parts: Parts, run: _Recorded, force: Array, torque: Array) -> Array:
    """Return the moments (n, 2) N m of the shanks on the feet about their long axes at the ankles.

    force, torque (n, 2, 3) are what friction and skis do to the feet at their places; the foot with its boot, a
    rigid body, takes the rest.
    """
    posture = run.posture
    turn, spin, rate = posture.foot_rotation, posture.foot_spin, posture.foot_spin_rate
    gear = parts.model.equipment
    sole = np.array([gear.boot_centre, 0.0, -parts.motion.geometry.ankle_to_ski_base])
    edging = np.empty(force.shape[:2])
    for side, letter in enumerate("lr"):
        body = parts.foot(letter)
        frame = turn[:, side]
        down, arm = frame @ sole, frame @ (body.com - sole)
        swing = np.cross(spin[:, side], np.cross(spin[:, side], arm))
        moving = run.pull + posture.foot_acceleration[:, side] + np.cross(rate[:, side], arm) + swing
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
