"""Muscles and bones of an OpenSim model: reads ``.osim`` files of versions 3 and 4.

It reads what paths need: bodies, joints (with the functions that drive them), coordinates, couplers, wrap objects, and
the muscles.  The model keeps its own frames: x forward, y up, z to the right.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final
from xml.etree.ElementTree import Element

import numpy as np
from scipy.spatial.transform import Rotation

from sssi_exudyn.bodies.muscles.bones import Bone, Bones, Coupling, Drive
from sssi_exudyn.bodies.muscles.curves import Curve, line, polygon, spline
from sssi_exudyn.bodies.muscles.paths import Muscle, MuscleModel, PathPoint, Surface, Wrap
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.frames import Array
from sssi_exudyn.io.bounds import MAX_BYTES
from sssi_exudyn.io.markup import elements

_AXES: Final = np.eye(3)
_PINNED: Final[dict[str, tuple[str, ...]]] = {  # kind of joint: what its coordinates drive, in order
    "PinJoint": ("rz",),
    "SliderJoint": ("tx",),
    "UniversalJoint": ("rx", "ry"),
    "BallJoint": ("rx", "ry", "rz"),
    "GimbalJoint": ("rx", "ry", "rz"),
    "PlanarJoint": ("rz", "tx", "ty"),
    "FreeJoint": ("rx", "ry", "rz", "tx", "ty", "tz"),
    "WeldJoint": (),
}
_SPLINES: Final = ("SimmSpline", "NaturalCubicSpline", "GCVSpline")


@dataclass(frozen=True)
class _Reader:
    """A file and its model's element, with methods that read values or fail with the place."""

    file: Path
    model: Element

    def fail(self, place: str, problem: str) -> InputError:
        return InputError(self.file, place, problem, "export the model from OpenSim again")

    def text(self, element: Element, tag: str, place: str) -> str:
        value = element.findtext(tag)
        if value is None or not value.strip():
            raise self.fail(place, f"<{tag}> is missing")
        return value.strip()

    def numbers(self, text: str | None, place: str, count: int | None = None) -> Array:
        try:
            values = np.array([float(word) for word in (text or "").replace(",", " ").split()])
        except ValueError:
            raise self.fail(place, f"{text!r} are not numbers") from None
        if (count is not None and len(values) != count) or not np.all(np.isfinite(values)):
            raise self.fail(place, f"{text!r} are not {count or 'finite'} numbers")
        return values

    def number(self, element: Element, tag: str, place: str) -> float:
        return float(self.numbers(self.text(element, tag, place), place, 1)[0])

    def vector(self, element: Element, tag: str, place: str) -> Array:
        text = element.findtext(tag)
        return np.zeros(3) if text is None else self.numbers(text, f"{place}: <{tag}>", 3)

    def function(self, holder: Element | None, place: str) -> Curve:
        """Read the function inside ``holder``: a ``<function>`` or the like, or, in version 4, the function itself."""
        inside = next(
            (child for child in (() if holder is None else holder) if child.tag not in ("coordinates", "axis")), None
        )
        if inside is None:
            raise self.fail(place, "a function is missing")
        if inside.tag == "function":
            return self.function(inside, place)
        if inside.tag == "Constant":
            return line(0.0, self.number(inside, "value", place))
        if inside.tag == "LinearFunction":
            slope, at_zero = self.numbers(inside.findtext("coefficients"), place, 2)
            return line(float(slope), float(at_zero))
        if inside.tag == "MultiplierFunction":
            return self.function(inside.find("function"), place).scale(y=self.number(inside, "scale", place))
        if inside.tag in (*_SPLINES, "PiecewiseLinearFunction"):
            x, y = (self.numbers(inside.findtext(tag), place) for tag in ("x", "y"))
            if len(x) != len(y) or len(x) < 2 or np.any(np.diff(x) <= 0.0):
                raise self.fail(place, f"{inside.tag} needs as many y as x, and x that grow")
            return spline(x, y) if inside.tag in _SPLINES else polygon(x, y)
        raise InputError(self.file, place, f"the function {inside.tag} is not known", "use a spline or a line")


def read_osim(path: Path) -> MuscleModel:
    """Read the muscles of an OpenSim model.  Raises InputError for another file, or one with unknown parts."""
    root = next(elements(path, ("OpenSimDocument",), limit=MAX_BYTES), None)
    model = None if root is None else root.find("Model")
    if root is None or model is None:
        raise InputError(path, "", "this is not an OpenSim model", "give a file with <OpenSimDocument> and <Model>")
    reader = _Reader(path, model)
    number = root.get("Version", "0")
    version = int(number) if number.isdigit() else 0
    carried = _old_joints(reader) if version < 40000 else _new_joints(reader)
    bones, defaults = _bones(reader, carried)
    surfaces = tuple(_surfaces(reader))
    muscles = tuple(_muscles(reader))
    known = {bone.name for bone in bones.bones}
    for muscle in muscles:
        for point in muscle.points:
            driven = [name for _, name in point.glides.values()] + ([point.condition[0]] if point.condition else [])
            for name in [*({point.bone} - known), *(set(driven) - set(bones.coordinates))]:
                raise reader.fail(f"muscle {muscle.name}", f"the model has no {name!r}")
        for wrap in muscle.wraps:
            if wrap.surface not in {surface.name for surface in surfaces}:
                raise reader.fail(f"muscle {muscle.name}", f"the model has no wrap object {wrap.surface!r}")
    return MuscleModel(model.get("name", path.stem), bones, muscles, surfaces, defaults)


@dataclass(frozen=True)
class _Carried:
    """A body with its joint: frames in parent and child (place, orientation), the joint's element."""

    body: str
    parent: str
    frame: tuple[Array, Array]
    end: tuple[Array, Array]
    joint: Element


def _old_joints(reader: _Reader) -> list[_Carried]:
    """Read the joints of version 3, each inside the body it carries."""
    bodies = []
    for body in reader.model.findall("./BodySet/objects/Body"):
        name = body.get("name", "")
        holder = body.find("Joint")
        if holder is None or len(holder) == 0:
            continue  # the ground
        joint = holder[0]
        place = f"joint of {name}"
        bodies.append(
            _Carried(
                name,
                reader.text(joint, "parent_body", place),
                (
                    reader.vector(joint, "location_in_parent", place),
                    reader.vector(joint, "orientation_in_parent", place),
                ),
                (reader.vector(joint, "location", place), reader.vector(joint, "orientation", place)),
                joint,
            )
        )
    return bodies


def _new_joints(reader: _Reader) -> list[_Carried]:
    """Read the joints of version 4, which are separate and join frames that are bodies or offset from bodies."""
    bodies = []
    for joint in reader.model.findall("./JointSet/objects/*"):
        place = f"joint {joint.get('name')}"
        sides = []
        for end in ("parent", "child"):
            wanted = reader.text(joint, f"socket_{end}_frame", place).rsplit("/", 1)[-1]
            frame = next((f for f in joint.findall("./frames/PhysicalOffsetFrame") if f.get("name") == wanted), None)
            if frame is None:
                sides.append((wanted, (np.zeros(3), np.zeros(3))))
            else:
                body = reader.text(frame, "socket_parent", place).rsplit("/", 1)[-1]
                offset = (reader.vector(frame, "translation", place), reader.vector(frame, "orientation", place))
                sides.append((body, offset))
        (parent, frame_in_parent), (child, frame_in_child) = sides
        bodies.append(_Carried(child, parent, frame_in_parent, frame_in_child, joint))
    return bodies


def _bones(reader: _Reader, carried: list[_Carried]) -> tuple[Bones, Array]:
    """Return the tree, parents first, and the coordinates' defaults."""
    waiting, done, bones = list(carried), {"ground"}, [Bone("ground", None)]
    names: list[str] = []
    defaults: list[float] = []
    while waiting:
        ready = [entry for entry in waiting if entry.parent in done]
        if not ready:
            raise reader.fail(f"joint of {waiting[0].body}", f"its parent {waiting[0].parent!r} hangs on nothing")
        for entry in ready:
            bones.append(_bone(reader, entry))
            for coordinate in _coordinates(entry.joint):
                names.append(coordinate.get("name", ""))
                text = coordinate.findtext("default_value")
                defaults.append(float(reader.numbers(text, f"coordinate {names[-1]}", 1)[0]) if text else 0.0)
        done |= {entry.body for entry in ready}
        waiting = [entry for entry in waiting if entry.body not in done]
    couplings = []
    for coupler in reader.model.findall("./ConstraintSet/objects/CoordinateCouplerConstraint"):
        place = f"coupler {coupler.get('name')}"
        if "true" in (coupler.findtext("isDisabled"),) or coupler.findtext("isEnforced") == "false":
            continue
        curve = reader.function(coupler.find("coupled_coordinates_function"), place)
        factor = coupler.findtext("scale_factor")
        couplings.append(
            Coupling(
                reader.text(coupler, "dependent_coordinate_name", place),
                reader.text(coupler, "independent_coordinate_names", place),
                curve.scale(y=float(factor)) if factor else curve,
            )
        )
        if not {couplings[-1].dependent, couplings[-1].independent} <= set(names):
            raise reader.fail(place, "it couples coordinates that the model does not have")
    return Bones(tuple(bones), tuple(names), tuple(couplings)), np.array(defaults)


def _coordinates(joint: Element) -> list[Element]:
    return [*joint.findall("./CoordinateSet/objects/Coordinate"), *joint.findall("./coordinates/Coordinate")]


def _bone(reader: _Reader, entry: _Carried) -> Bone:
    place = f"joint of {entry.body}"
    turns: list[Drive] = []
    slides: list[Drive] = []
    transform = entry.joint.find("SpatialTransform")
    if transform is not None:
        for axis in transform.findall("TransformAxis"):
            coordinate = (axis.findtext("coordinates") or "").strip() or None
            function = reader.function(axis, place)
            direction = reader.vector(axis, "axis", place)
            drive = Drive(direction / np.linalg.norm(direction), function, coordinate)
            (turns if axis.get("name", "").startswith("rotation") else slides).append(drive)
    elif entry.joint.tag in _PINNED:
        for what, driver in zip(_PINNED[entry.joint.tag], _coordinates(entry.joint), strict=False):
            drive = Drive(_AXES["xyz".index(what[1])], line(1.0), driver.get("name"))
            (turns if what[0] == "r" else slides).append(drive)
    else:
        raise InputError(reader.file, place, f"a {entry.joint.tag} is not known", "make it a CustomJoint")
    return Bone(
        entry.body,
        entry.parent,
        entry.frame[0],
        _rotation_from(entry.frame[1]),
        tuple(turns),
        tuple(slides),
        entry.end[0],
        _rotation_from(entry.end[1]),
    )


def _rotation_from(angles: Array) -> Array:
    """Return the rotation (3, 3) of OpenSim's body-fixed x-y-z angles."""
    return Rotation.from_euler("XYZ", angles).as_matrix()


def _surfaces(reader: _Reader) -> Iterator[Surface]:
    for body in [*reader.model.findall("./BodySet/objects/Body"), *reader.model.findall("./Ground")]:
        # version 3 has a ground among the bodies
        bone = body.get("name", "ground")
        for wrap in [*body.findall("./WrapObjectSet/objects/*"), *body.findall("./WrapObjectSet/*/objects/*")]:
            name = wrap.get("name", "")
            place = f"wrap object {name}"
            if (wrap.findtext("active") or "true").strip() != "true":
                continue
            match wrap.tag:
                case "WrapCylinder":
                    size = np.array([reader.number(wrap, "radius", place), reader.number(wrap, "length", place), 0.0])
                case "WrapSphere":
                    size = np.full(3, reader.number(wrap, "radius", place))
                case "WrapEllipsoid":
                    size = reader.numbers(wrap.findtext("dimensions"), place, 3)
                case _:
                    raise InputError(reader.file, place, f"a {wrap.tag} is not known", "use a cylinder or an ellipsoid")
            side = (wrap.findtext("quadrant") or "all").strip().lower()
            letter, sign = side[-1], 0.0 if side == "all" else -1.0 if side.startswith("-") else 1.0
            if side != "all" and side not in [direction + axis for direction in ("", "+", "-") for axis in "xyz"]:
                raise reader.fail(place, f"{side!r} is no quadrant")
            yield Surface(
                name,
                bone,
                wrap.tag.removeprefix("Wrap").lower(),
                reader.vector(wrap, "translation", place),
                _rotation_from(reader.vector(wrap, "xyz_body_rotation", place)),
                size,
                "xyz".index(letter) if sign else 0,
                sign,
            )


def _muscles(reader: _Reader) -> Iterator[Muscle]:
    for force in reader.model.findall("./ForceSet/objects/*"):
        path = force.find("GeometryPath")
        if path is None or force.find("max_isometric_force") is None:
            continue
        name = force.get("name", "")
        place = f"muscle {name}"
        points = tuple(_point(reader, element, place) for element in path.findall("./PathPointSet/objects/*"))
        if len(points) < 2:
            raise reader.fail(place, "its path has fewer than two points")
        wraps = []
        surfaces = {element.get("name") for element in reader.model.iter() if element.tag.startswith("Wrap")}
        for wrap in path.findall("./PathWrapSet/objects/PathWrap"):
            low, high = (int(x) for x in reader.numbers(wrap.findtext("range") or "-1 -1", place, 2))
            surface = reader.text(wrap, "wrap_object", place)
            if surface in surfaces:
                wraps.append(Wrap(surface, max(low - 1, 0), len(points) - 1 if high < 1 else high - 1))
            else:
                raise reader.fail(place, f"the model has no wrap object {surface!r}")
        yield Muscle(
            name,
            points,
            reader.number(force, "max_isometric_force", place),
            reader.number(force, "optimal_fiber_length", place),
            reader.number(force, "tendon_slack_length", place),
            reader.number(force, "pennation_angle_at_optimal", place),
            tuple(wraps),
        )


def _point(reader: _Reader, element: Element, place: str) -> PathPoint:
    named = element.findtext("body") or reader.text(element, "socket_parent_frame", place)
    bone = named.strip().rsplit("/", 1)[-1]
    if element.tag == "MovingPathPoint":
        glides = {}
        for k, letter in enumerate("xyz"):
            coordinate = element.findtext(f"{letter}_coordinate") or element.findtext(f"socket_{letter}_coordinate")
            if coordinate and element.find(f"{letter}_location") is not None:
                curve = reader.function(element.find(f"{letter}_location"), place)
                glides[k] = (curve, coordinate.strip().rsplit("/", 1)[-1])
        return PathPoint(bone, reader.vector(element, "location", place), glides)
    location = reader.numbers(element.findtext("location"), place, 3)
    if element.tag != "ConditionalPathPoint":
        return PathPoint(bone, location)
    coordinate = (element.findtext("coordinate") or reader.text(element, "socket_coordinate", place)).strip()
    low, high = reader.numbers(element.findtext("range"), place, 2)
    return PathPoint(bone, location, condition=(coordinate.rsplit("/", 1)[-1], float(low), float(high)))
