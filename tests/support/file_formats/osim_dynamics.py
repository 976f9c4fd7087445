"""Newton's and Euler's laws and inverse dynamics from OpenSim's files alone: nothing of the program's own model.

Bodies, joints and masses are read from the ``.osim``, movement from the ``.mot`` by splines, forces by the names in
the external loads.  Ground is x forward, y up, z right.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree as XML

import numpy as np
from scipy.interpolate import make_interp_spline
from scipy.spatial.transform import Rotation

from sssi_exudyn.io.storage import Storage, read_storage


def vector(element: XML.Element, tag: str) -> np.ndarray:
    return np.array(element.findtext(tag, "0 0 0").split(), dtype=float)


@dataclass(frozen=True)
class Movement:
    """Of one body at n instants: place and turn of its frame, velocity, spin, and their rates; ground."""

    place: np.ndarray
    turn: np.ndarray
    speed: np.ndarray
    spin: np.ndarray
    acceleration: np.ndarray
    spin_rate: np.ndarray

    def carry(self, arm: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Place and acceleration of a point fixed in the body at ``arm`` (3,)."""
        out = self.turn @ arm
        return self.place + out, self.acceleration + np.cross(self.spin_rate, out) + np.cross(
            self.spin, np.cross(self.spin, out)
        )


@dataclass(frozen=True)
class Axis:
    """A coordinate's axis (n, 3) through ``place`` (n, 3), and the body that it moves, by the joint's child."""

    body: str
    direction: np.ndarray
    place: np.ndarray
    turns: bool


class Files:
    """What a result's folder, or texts by name, hold for OpenSim."""

    def __init__(self, texts: dict[str, str]) -> None:
        document = XML.fromstring(texts["skier.osim"])
        self.bodies = {body.get("name", ""): body for body in document.iter("Body")}
        self.joints = [*document.iter("CustomJoint"), *document.iter("WeldJoint")]
        self.gravity = vector(document.find("Model"), "gravity")  # type: ignore[arg-type]
        self.coordinates = read_storage(Path("coordinates.mot"), texts["coordinates.mot"])
        self.forces = read_storage(Path("snow_forces.mot"), texts["snow_forces.mot"])
        self.loads = list(XML.fromstring(texts["external_loads.xml"]).iter("ExternalForce"))
        self.time = self.coordinates.values[:, 0]
        self.parent: dict[str, str] = {}
        self.axes: dict[str, Axis] = {}
        self.movements = self._move()

    def column(self, table: Storage, name: str) -> np.ndarray:
        return table.values[:, table.columns.index(name)]

    def _coordinate(self, name: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        values = self.column(self.coordinates, name)
        if not name.startswith("pelvis_t") or name == "pelvis_tilt":
            values = np.radians(values)
        spline = make_interp_spline(self.time, values, k=5)
        return values, spline.derivative(1)(self.time), spline.derivative(2)(self.time)

    def _move(self) -> dict[str, Movement]:
        n = len(self.time)
        zero = np.zeros((n, 3))
        movements = {"ground": Movement(zero, np.tile(np.eye(3), (n, 1, 1)), zero, zero, zero, zero)}
        waiting = list(self.joints)
        while waiting:
            for joint in waiting:
                frames = {frame.get("name"): frame for frame in joint.iter("PhysicalOffsetFrame")}
                parent = frames[joint.findtext("socket_parent_frame")].findtext("socket_parent", "").split("/")[-1]
                if parent in movements:
                    break
            waiting.remove(joint)
            child = frames[joint.findtext("socket_child_frame")].findtext("socket_parent", "").split("/")[-1]
            self.parent[child] = parent
            frame = frames[joint.findtext("socket_parent_frame")]
            movements[child] = self._joined(movements[parent], joint, child, frame)
        return movements

    def _joined(self, on: Movement, joint: XML.Element, child: str, offset: XML.Element) -> Movement:
        arm = vector(offset, "translation")
        place, acceleration = on.carry(arm)
        speed = on.speed + np.cross(on.spin, on.turn @ arm)
        turn = on.turn @ Rotation.from_euler("XYZ", vector(offset, "orientation")).as_matrix()
        spin, rate = on.spin, on.spin_rate
        first = turn
        axes = {axis.get("name", ""): axis for axis in joint.iter("TransformAxis")}
        moving = [(name, axis) for name, axis in axes.items() if axis.findtext("coordinates")]
        for name, axis in moving:  # translations are along the parent's axes
            if name.startswith("translation"):
                values, pace, pull = self._coordinate(axis.findtext("coordinates", ""))
                direction = first @ vector(axis, "axis")
                assert not np.any(on.spin)  # of the ground alone
                place = place + direction * values[:, None]
                speed, acceleration = speed + direction * pace[:, None], acceleration + direction * pull[:, None]
        for name, axis in moving:
            coordinate = axis.findtext("coordinates", "")
            if name.startswith("rotation"):
                values, pace, pull = self._coordinate(coordinate)
                own = vector(axis, "axis")
                direction = turn @ own
                about = direction * pace[:, None]
                rate = rate + direction * pull[:, None] + np.cross(spin, about)
                spin = spin + about
                turn = turn @ Rotation.from_rotvec(values[:, None] * own).as_matrix()
                self.axes[coordinate] = Axis(child, direction, place, True)
        for name, axis in moving:
            if name.startswith("translation"):
                direction = first @ vector(axis, "axis")
                self.axes[axis.findtext("coordinates", "")] = Axis(child, direction, place, False)
        return Movement(place, turn, speed, spin, acceleration, rate)

    def wrenches(self) -> dict[str, list[tuple[np.ndarray, np.ndarray, np.ndarray]]]:
        """By body what it needs beyond gravity and external forces: force, the point it acts at, moment about it."""
        wrenches: dict[str, list[tuple[np.ndarray, np.ndarray, np.ndarray]]] = {}
        for name, body in self.bodies.items():
            moving, mass = self.movements[name], float(body.findtext("mass", "0"))
            place, acceleration = moving.carry(vector(body, "mass_center"))
            xx, yy, zz, xy, xz, yz = np.array(body.findtext("inertia", "").split(), dtype=float)
            inertia = (
                moving.turn @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ moving.turn.transpose(0, 2, 1)
            )
            momentum = np.einsum("nij,nj->ni", inertia, moving.spin)
            moment = np.einsum("nij,nj->ni", inertia, moving.spin_rate) + np.cross(moving.spin, momentum)
            wrenches[name] = [(mass * (acceleration - self.gravity), place, moment)]
        for load in self.loads:
            force, point, moment = (
                np.stack([self.column(self.forces, f"{prefix}{axis}") for axis in "xyz"], axis=1)
                if (prefix := load.findtext(tag))
                else np.zeros((len(self.time), 3))
                for tag in ("force_identifier", "point_identifier", "torque_identifier")
            )
            wrenches[load.findtext("applied_to_body", "")].append((-force, point, -moment))
        return wrenches

    def left_over(self) -> tuple[np.ndarray, np.ndarray]:
        """(n, 3) N and N m about the pelvis' place: what Newton's and Euler's laws of the whole leave over."""
        about = self.movements["pelvis"].place
        force, moment = np.zeros_like(about), np.zeros_like(about)
        for parts in self.wrenches().values():
            for pushed, point, turned in parts:
                force += pushed
                moment += turned + np.cross(point - about, pushed)
        return force, moment

    def inverse_dynamics(self) -> dict[str, np.ndarray]:
        """(n,) N or N m by coordinate."""
        moments, wrenches = {}, self.wrenches()
        for name, axis in self.axes.items():
            total = np.zeros(len(self.time))
            for body, parts in wrenches.items():
                if self._is_beyond(body, axis.body):
                    for pushed, point, turned in parts:
                        lever = turned + np.cross(point - axis.place, pushed) if axis.turns else pushed
                        total += np.sum(lever * axis.direction, axis=1)
            moments[name] = total
        return moments

    def _is_beyond(self, body: str, other: str) -> bool:
        while body != "ground":
            if body == other:
                return True
            body = self.parent[body]
        return False
