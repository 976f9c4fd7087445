"""The skier as an OpenSim model (``.osim``), and the set-up of OpenSim's inverse dynamics of a run.

Bodies and joints are those of this program's chain, so that the model's coordinates are the columns of
``coordinates.mot``: 21 segments with the skier's own lengths and masses, boots and bindings on the calcanei, poles in
the hands, and two rigid skis welded to the calcanei.  Body frames are the chain's in OpenSim's axes: x forward, y up,
z to the right.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final
from xml.etree import ElementTree as XML

import numpy as np
from scipy.spatial.transform import Rotation

from sssi_exudyn.bodies.skier.anthropometry import SegmentInertia
from sssi_exudyn.bodies.skier.boot import seat_of_ski
from sssi_exudyn.bodies.skier.chain import FEET, JOINTS, SEGMENTS, Joint
from sssi_exudyn.core.frames import GRAVITY, Array
from sssi_exudyn.io.storage import GROUND_FROM_LEVEL
from sssi_exudyn.simulation.assembly import Parts

MODEL_FILE: Final = "skier.osim"
LOADS_FILE: Final = "external_loads.xml"
SETUP_FILE: Final = "inverse_dynamics.xml"
MOMENTS_FILE: Final = "inverse_dynamics.sto"
"""What OpenSim's inverse dynamics writes."""
REVERSED: Final = ("knee_angle_r", "knee_angle_l")
"""Coordinates whose positive direction is the other one in OpenSim's models."""
PELVIS: Final = ("pelvis_tilt", "pelvis_list", "pelvis_rotation")
"""Rotations of the pelvis against the ground, in OpenSim's order, about z, x, y."""
SKIS: Final = ("ski_l", "ski_r")


@dataclass(frozen=True)
class Load:
    """An external force: columns ``<name>_force_v…``, ``<name>_force_p…`` and, with a moment, ``<name>_torque_…``."""

    name: str
    segment: str
    has_moment: bool


def model_text(parts: Parts) -> str:
    """Return the skier and his skis as the text of an ``.osim`` file."""
    gear, geometry = parts.model.equipment, parts.motion.geometry
    ski = SegmentInertia(parts.ski.mass, parts.ski.com, parts.ski.inertia)
    bodies = dict(zip(SEGMENTS, parts.inertias, strict=True)) | dict.fromkeys(SKIS, ski)
    document = XML.Element("OpenSimDocument", Version="40000")
    model = XML.SubElement(document, "Model", name="skier")
    _add(model, "gravity", _numbers(np.array([0.0, -GRAVITY, 0.0])))
    _add(model, "length_units", "meters")
    _add(model, "force_units", "N")
    XML.SubElement(model, "Ground", name="ground")
    objects = _set_of(model, "BodySet", "bodyset")
    for name, body in bodies.items():
        _add_body(objects, name, body)
    objects = _set_of(model, "JointSet", "jointset")
    for i, joint in enumerate(JOINTS):
        if joint.parent is None:
            _add_pelvis(objects)
        else:
            place, attitude = geometry.joint_in_parent[i], geometry.attitude_in_parent[i]
            _add_joint(objects, joint, joint.parent, place, attitude)
    for side, name in enumerate(SKIS):
        seat = seat_of_ski(geometry, FEET[side], gear.boot_centre, gear.ramp_angle)
        _add_joint(objects, Joint(name, None), SEGMENTS[FEET[side]], *seat)
    return _text(document)


def loads_text(loads: Sequence[Load], forces_file: str) -> str:
    """Return OpenSim's external loads, whose columns are in ``forces_file``."""
    document = XML.Element("OpenSimDocument", Version="40000")
    whole = XML.SubElement(document, "ExternalLoads", name="external_loads")
    objects = XML.SubElement(whole, "objects")
    for load in loads:
        force = XML.SubElement(objects, "ExternalForce", name=load.name)
        _add(force, "applied_to_body", load.segment)
        _add(force, "force_expressed_in_body", "ground")
        _add(force, "point_expressed_in_body", "ground")
        _add(force, "force_identifier", f"{load.name}_force_v")
        _add(force, "point_identifier", f"{load.name}_force_p")
        if load.has_moment:
            _add(force, "torque_identifier", f"{load.name}_torque_")
    _add(whole, "datafile", forces_file)
    return _text(document)


def setup_text(start: float, stop: float, coordinates_file: str) -> str:
    """Return the set-up of OpenSim's inverse dynamics from ``start`` to ``stop`` (s)."""
    document = XML.Element("OpenSimDocument", Version="40000")
    tool = XML.SubElement(document, "InverseDynamicsTool", name="inverse_dynamics")
    settings: Mapping[str, str] = {
        "results_directory": ".",
        "model_file": MODEL_FILE,
        "time_range": _numbers(np.array([start, stop])),
        "forces_to_exclude": "Muscles",
        "external_loads_file": LOADS_FILE,
        "coordinates_file": coordinates_file,
        "lowpass_cutoff_frequency_for_coordinates": "-1",  # the run's own accelerations: filtered they fit no force
        "output_gen_force_file": MOMENTS_FILE,
    }
    for name, value in settings.items():
        _add(tool, name, value)
    return _text(document)


def _add_body(objects: XML.Element, name: str, body: SegmentInertia) -> None:
    inertia = GROUND_FROM_LEVEL @ body.inertia @ GROUND_FROM_LEVEL.T
    xml = XML.SubElement(objects, "Body", name=name)
    _add(xml, "mass", f"{body.mass:.17g}")
    _add(xml, "mass_center", _numbers(GROUND_FROM_LEVEL @ body.com))
    _add(xml, "inertia", _numbers(inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]))


def _add_pelvis(objects: XML.Element) -> None:
    names = ("pelvis_tx", "pelvis_ty", "pelvis_tz")
    axes = [(name, axis) for name, axis in zip(PELVIS, np.eye(3)[[2, 0, 1]], strict=True)]
    _add_custom_joint(objects, "pelvis", ("/ground", np.zeros(3), np.eye(3)), axes, names)


def _add_joint(objects: XML.Element, joint: Joint, parent: str, place: Array, attitude: Array) -> None:
    """Add a joint whose frame is at ``place`` (3,) m with ``attitude`` (3, 3) in the parent, in the chain's axes."""
    seat = (
        f"/bodyset/{parent}",
        GROUND_FROM_LEVEL @ place,
        GROUND_FROM_LEVEL @ attitude @ GROUND_FROM_LEVEL.T,
    )
    turning = [
        (name, GROUND_FROM_LEVEL @ np.array(axis) * (-1.0 if name in REVERSED else 1.0))
        for name, axis in joint.rotations
    ]
    if turning:
        _add_custom_joint(objects, joint.segment, seat, turning, ())
    else:
        xml = XML.SubElement(objects, "WeldJoint", name=_joint_name(joint.segment))
        _add_frames(xml, joint.segment, seat)


def _add_custom_joint(
    objects: XML.Element,
    segment: str,
    seat: tuple[str, Array, Array],
    turning: Sequence[tuple[str, Array]],
    moving: Sequence[str],
) -> None:
    """Add a joint that turns about axes (3,) in order, each by a coordinate, and moves along the parent's axes."""
    xml = XML.SubElement(objects, "CustomJoint", name=_joint_name(segment))
    _add_frames(xml, segment, seat)
    coordinates = XML.SubElement(xml, "coordinates")
    for name in (*(name for name, _ in turning), *moving):
        XML.SubElement(coordinates, "Coordinate", name=name)
    transform = XML.SubElement(xml, "SpatialTransform")
    axes = [axis for _, axis in turning]
    axes += [axis for axis in np.eye(3) if len(axes) == 1 and abs(axis @ axes[0]) < 0.5]  # two more, square to it
    names = [name for name, _ in turning] + [""] * (3 - len(turning))
    for number, (name, axis) in enumerate(zip(names, axes, strict=True), 1):
        _add_axis(transform, f"rotation{number}", name, axis)
    for number, axis in enumerate(np.eye(3), 1):
        _add_axis(transform, f"translation{number}", moving[number - 1] if moving else "", axis)


def _add_axis(transform: XML.Element, title: str, coordinate: str, axis: Array) -> None:
    xml = XML.SubElement(transform, "TransformAxis", name=title)
    _add(xml, "coordinates", coordinate)
    _add(xml, "axis", _numbers(axis))
    if coordinate:
        function = XML.SubElement(xml, "LinearFunction", name="function")
        _add(function, "coefficients", " 1 0")
    else:
        function = XML.SubElement(xml, "Constant", name="function")
        _add(function, "value", "0")


def _add_frames(xml: XML.Element, segment: str, seat: tuple[str, Array, Array]) -> None:
    parent, place, attitude = seat
    _add(xml, "socket_parent_frame", "parent_offset")
    _add(xml, "socket_child_frame", "child_offset")
    frames = XML.SubElement(xml, "frames")
    for name, carrier, at, turn in (
        ("parent_offset", parent, place, attitude),
        ("child_offset", f"/bodyset/{segment}", np.zeros(3), np.eye(3)),
    ):
        frame = XML.SubElement(frames, "PhysicalOffsetFrame", name=name)
        _add(frame, "socket_parent", carrier)
        _add(frame, "translation", _numbers(at))
        _add(frame, "orientation", _numbers(Rotation.from_matrix(turn).as_euler("XYZ")))


def _joint_name(segment: str) -> str:
    return f"to_{segment}"


def _set_of(model: XML.Element, kind: str, name: str) -> XML.Element:
    return XML.SubElement(XML.SubElement(model, kind, name=name), "objects")


def _add(parent: XML.Element, tag: str, text: str) -> None:
    XML.SubElement(parent, tag).text = text


def _numbers(values: Array) -> str:
    return " ".join(f"{value:.17g}" for value in values)


def _text(document: XML.Element) -> str:
    XML.indent(document)
    return f'<?xml version="1.0" encoding="UTF-8" ?>\n{XML.tostring(document, encoding="unicode")}\n'
