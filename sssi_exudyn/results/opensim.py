"""A run in OpenSim's text formats.

Joint angles and snow forces are ``.mot`` files, joint moments ``.sto``, and joint centres as markers ``.trc``.

OpenSim's ground frame is put on the slope: x along the fall line's azimuth, y up against gravity, z to the right; its
origin is the run's.  Joint coordinates have the names and directions of the full-body lumbar spine model, whose knees
extend positive.  The pelvis turns about z (tilt), x (list), y (rotation) in this order.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

import numpy as np
from scipy.spatial.transform import Rotation

from sssi_exudyn.bodies.skier.chain import SEGMENT, SEGMENTS, Geometry, forward_kinematics
from sssi_exudyn.core.frames import Array, slope_to_level
from sssi_exudyn.io.storage import GROUND_FROM_LEVEL, Storage, storage_text
from sssi_exudyn.simulation.result import SIDES, SimulationResult

MARKER_RATE: Final = 100.0
"""Hz of the markers; a ``.trc`` has to be evenly sampled."""
_EXTENDS: Final = ("knee_angle_r", "knee_angle_l")
"""Coordinates with the opposite positive direction in OpenSim."""


def coordinates(result: SimulationResult, inclination: float) -> Storage:
    """Return joint angles (degrees) and the pelvis' place (m)."""
    level = slope_to_level(inclination)
    coordinate = {name: result.coordinates[:, i] for i, name in enumerate(result.coordinate_names)}
    place = result.pelvis @ (GROUND_FROM_LEVEL @ level).T
    turned = Rotation.from_euler(
        "ZXY", np.stack([coordinate["pelvis_rotation"], coordinate["pelvis_list"], -coordinate["pelvis_tilt"]], axis=1)
    ).as_matrix()
    tilt, list_, rotation = Rotation.from_matrix(GROUND_FROM_LEVEL @ turned @ GROUND_FROM_LEVEL.T).as_euler("ZXY").T
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
            columns[name] = np.degrees(coordinate[name]) * (-1.0 if name in _EXTENDS else 1.0)
    return _storage("coordinates", result.time, columns, in_degrees=True)


def moments(result: SimulationResult) -> Storage:
    """Return the moment of each coordinate (N m), named as in OpenSim's inverse dynamics."""
    columns = {
        f"{name}_moment": result.joint_moments[:, i] * (-1.0 if name in _EXTENDS else 1.0)
        for i, name in enumerate(result.moment_names)
        if not name.startswith("pelvis_")  # about axes in another order there; see residual_moment in the summary
    }
    return _storage("joint_moments", result.time, columns, in_degrees=False)


def snow_forces(result: SimulationResult, inclination: float) -> Storage:
    """Return the snow's force on each ski (N), acting where friction does, with no free moment: external loads."""
    turned = (GROUND_FROM_LEVEL @ slope_to_level(inclination)).T
    columns: dict[str, Array] = {}
    for index, side in enumerate(SIDES):
        for what, vectors in (("v", result.snow_force[:, index]), ("p", result.foot_position[:, index])):
            for axis, values in zip("xyz", (vectors @ turned).T, strict=True):
                columns[f"{side}_snow_force_{what}{axis}"] = values
        for axis in "xyz":
            columns[f"{side}_snow_torque_{axis}"] = np.zeros(len(result.time))
    return _storage("snow_forces", result.time, columns, in_degrees=False)


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


def opensim_texts(result: SimulationResult, geometry: Geometry, inclination: float) -> dict[str, str]:
    """Return every file by its name."""
    return {
        "coordinates.mot": storage_text(coordinates(result, inclination)),
        "snow_forces.mot": storage_text(snow_forces(result, inclination)),
        "joint_moments.sto": storage_text(moments(result)),
        "markers.trc": markers_text(result, geometry, inclination),
    }


def _storage(name: str, time: Array, columns: Mapping[str, Array], *, in_degrees: bool) -> Storage:
    return Storage(name, ("time", *columns), np.column_stack([time, *columns.values()]), in_degrees)
