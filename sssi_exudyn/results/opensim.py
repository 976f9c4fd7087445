"""A run in OpenSim's text formats.

Joint angles and external forces are ``.mot`` files, joint moments ``.sto``, joint centres as markers ``.trc``; next to
them stands what OpenSim's inverse dynamics needs (``opensim_model``).

OpenSim's ground frame is put on the slope: x along the fall line's azimuth, y up against gravity, z to the right; its
origin is the run's.  Joint coordinates have the names and directions of the full-body lumbar spine model, whose knees
extend positive.  The pelvis turns about z (tilt), x (list), y (rotation) in this order.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.spatial.transform import Rotation

from sssi_exudyn.analysis.biomechanics import residual_moment_vector
from sssi_exudyn.bodies.skier.anthropometry import GRIP
from sssi_exudyn.bodies.skier.chain import SEGMENT, SEGMENTS, Geometry, forward_kinematics
from sssi_exudyn.core.frames import Array, slope_to_level
from sssi_exudyn.io.storage import GROUND_FROM_LEVEL, Storage, storage_text
from sssi_exudyn.results.opensim_model import (
    LOADS_FILE,
    MODEL_FILE,
    PELVIS,
    REVERSED,
    SETUP_FILE,
    Load,
    loads_text,
    model_text,
    setup_text,
)
from sssi_exudyn.simulation.assembly import Parts
from sssi_exudyn.simulation.result import SIDES, SimulationResult

MARKER_RATE: Final = 100.0
"""Hz of the markers; a ``.trc`` has to be evenly sampled."""


def coordinates(result: SimulationResult, inclination: float) -> Storage:
    """Return joint angles (degrees) and the pelvis' place (m)."""
    level = slope_to_level(inclination)
    coordinate = {name: result.coordinates[:, i] for i, name in enumerate(result.coordinate_names)}
    place = result.pelvis @ (GROUND_FROM_LEVEL @ level).T
    tilt, list_, rotation = _pelvis_angles(result).T
    columns = {
        "pelvis_tilt": np.degrees(tilt),
        "pelvis_list": np.degrees(list_),
        "pelvis_rotation": np.degrees(rotation),
        "pelvis_tx": place[:, 0],
        "pelvis_ty": place[:, 1],
        "pelvis_tz": place[:, 2],
    }
    for name in result.moment_names:
        if name not in columns:
            columns[name] = np.degrees(coordinate[name]) * (-1.0 if name in REVERSED else 1.0)
    return _storage("coordinates", result.time, columns, in_degrees=True)


def _pelvis_angles(result: SimulationResult) -> Array:
    """Return the angles (n, 3) rad of the pelvis against the ground, by ``PELVIS``: about z, x and y in this order."""
    coordinate = {name: result.coordinates[:, i] for i, name in enumerate(result.coordinate_names)}
    turned = Rotation.from_euler(
        "ZXY", np.stack([coordinate["pelvis_rotation"], coordinate["pelvis_list"], -coordinate["pelvis_tilt"]], axis=1)
    ).as_matrix()
    return np.asarray(Rotation.from_matrix(GROUND_FROM_LEVEL @ turned @ GROUND_FROM_LEVEL.T).as_euler("ZXY"))


def moments(result: SimulationResult) -> Storage:
    """Return the moment of each coordinate (N m), named as in OpenSim's inverse dynamics; the pelvis' are residuals.

    The residual moment is one vector; a coordinate's is its part along the axis that the coordinate turns about.
    """
    tilt, list_, _ = _pelvis_angles(result).T
    residual = residual_moment_vector(result) @ GROUND_FROM_LEVEL.T
    n, none = len(tilt), np.zeros_like(tilt)
    axes = (
        np.tile([0.0, 0.0, 1.0], (n, 1)),
        np.column_stack([np.cos(tilt), np.sin(tilt), none]),
        np.column_stack([-np.sin(tilt) * np.cos(list_), np.cos(tilt) * np.cos(list_), np.sin(list_)]),
    )
    columns = {f"{name}_moment": np.sum(residual * axis, axis=1) for name, axis in zip(PELVIS, axes, strict=True)} | {
        f"{name}_moment": result.joint_moments[:, i] * (-1.0 if name in REVERSED else 1.0)
        for i, name in enumerate(result.moment_names)
        if name not in PELVIS
    }
    return _storage("joint_moments", result.time, columns, in_degrees=False)


@dataclass(frozen=True)
class ExternalForce:
    """A force on the skier at n instants, slope frame.

    load : its name in OpenSim's external loads, and the segment it acts on
    force, point : (n, 3) N, m
    moment : (n, 3) N m about that point; None where there is none
    """

    load: Load
    force: Array
    point: Array
    moment: Array | None = None


def external_forces(result: SimulationResult, parts: Parts) -> list[ExternalForce]:
    """Return all forces on skier and skis but gravity, without those that are zero all the time.

    The snow's act at the centres of pressure with the free moments, the air's at the segments' centres of mass, the
    poles' at the hands; what acts on the body as a whole is shared out by the segments' masses.
    """
    geometry, inertias = parts.motion.geometry, parts.inertias
    poses = forward_kinematics(geometry, result.coordinates, parts.model.inclination)

    def point(segment: str, place: Array) -> Array:
        i = SEGMENT[segment]
        return np.asarray(poses.origin[:, i] + poses.rotation[:, i] @ place)

    loads = []
    for index, (side, letter) in enumerate(zip(SIDES, "lr", strict=True)):
        foot, force = f"calcn_{letter}", result.snow.force[:, index]
        centre, free = result.pressure_centre[:, index], result.snow.free_moment[:, index]
        loads.append(ExternalForce(Load(f"{side}_snow", foot, True), force, centre, free))
        if result.ski_bending is not None:
            own = Load(f"{side}_ski_bending", foot, True)
            force, moment = result.ski_bending.force[:, index], result.ski_bending.moment[:, index]
            loads.append(ExternalForce(own, force, result.foot_position[:, index], moment))
        if result.pole_force is not None:
            hand = f"hand_{letter}"
            grip = point(hand, GRIP * geometry.segment_end[SEGMENT[hand]])
            loads.append(ExternalForce(Load(f"{side}_pole", hand, False), result.pole_force[:, index], grip))
    shares = [(f"air_{segment}", segment, force) for segment, force in result.segment_drag.items()]
    if result.body_force is not None:
        for segment, body in zip(SEGMENTS, inertias, strict=True):
            shares.append((f"unexplained_{segment}", segment, body.mass / parts.body_mass * result.body_force))
    for name, segment, force in shares:
        loads.append(ExternalForce(Load(name, segment, False), force, point(segment, inertias[SEGMENT[segment]].com)))
    return [load for load in loads if load.load.has_moment or np.any(load.force)]


def snow_forces(forces: Sequence[ExternalForce], time: Array, inclination: float) -> Storage:
    """Return the external forces (N), the points that they act at (m) and their moments about these (N m)."""
    turned = (GROUND_FROM_LEVEL @ slope_to_level(inclination)).T
    columns: dict[str, Array] = {}
    for external in forces:
        name = external.load.name
        parts = {f"{name}_force_v": external.force, f"{name}_force_p": external.point}
        if external.moment is not None:
            parts[f"{name}_torque_"] = external.moment
        for what, vectors in parts.items():
            for axis, values in zip("xyz", (vectors @ turned).T, strict=True):
                columns[f"{what}{axis}"] = values
    return _storage("snow_forces", time, columns, in_degrees=False)


def markers_text(result: SimulationResult, geometry: Geometry, inclination: float) -> str:
    """Return a ``.trc`` file of joint centres, head's vertex and toe tips as markers in metres, ``MARKER_RATE`` a
    second.
    """
    times = np.arange(result.time[0], result.time[-1] + 1e-9, 1.0 / MARKER_RATE)
    q = np.stack([np.interp(times, result.time, column) for column in result.coordinates.T], axis=1)
    poses = forward_kinematics(geometry, q, inclination)
    places = {name: poses.origin[:, SEGMENT[name]] for name in SEGMENTS}
    for name, tip in (("head", "head_vertex"), ("toes_r", "toe_tip_r"), ("toes_l", "toe_tip_l")):
        i = SEGMENT[name]
        places[tip] = poses.origin[:, i] + poses.rotation[:, i] @ geometry.segment_end[i]
    turned = (GROUND_FROM_LEVEL @ slope_to_level(inclination)).T
    names = list(places)
    values = np.stack([places[name] @ turned for name in names], axis=1).reshape(len(times), -1)
    count, rate = len(times), f"{MARKER_RATE:g}"
    head = [
        "PathFileType\t4\t(X/Y/Z)\tmarkers.trc",
        "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames",
        f"{rate}\t{rate}\t{count}\t{len(names)}\tm\t{rate}\t1\t{count}",
        "Frame#\tTime\t" + "\t\t\t".join(names) + "\t\t",
        "\t\t" + "\t".join(f"{axis}{k}" for k in range(1, len(names) + 1) for axis in "XYZ"),
        "",
    ]
    rows = [
        f"{i}\t{time:.6f}\t" + "\t".join(f"{value:.6f}" for value in row)
        for i, (time, row) in enumerate(zip(times, values, strict=True), 1)
    ]
    return "\n".join([*head, *rows]) + "\n"


def opensim_texts(result: SimulationResult, parts: Parts) -> dict[str, str]:
    """Return every file by its name, for the skier and the skis of ``parts``."""
    inclination, time = parts.model.inclination, result.time
    forces = external_forces(result, parts)
    coordinates_file, forces_file = "coordinates.mot", "snow_forces.mot"
    return {
        coordinates_file: storage_text(coordinates(result, inclination)),
        forces_file: storage_text(snow_forces(forces, time, inclination)),
        "joint_moments.sto": storage_text(moments(result)),
        "markers.trc": markers_text(result, parts.motion.geometry, inclination),
        MODEL_FILE: model_text(parts),
        LOADS_FILE: loads_text([external.load for external in forces], forces_file),
        SETUP_FILE: setup_text(float(time[0]), float(time[-1]), coordinates_file),
    }


def _storage(name: str, time: Array, columns: Mapping[str, Array], *, in_degrees: bool) -> Storage:
    return Storage(name, ("time", *columns), np.column_stack([time, *columns.values()]), in_degrees)
