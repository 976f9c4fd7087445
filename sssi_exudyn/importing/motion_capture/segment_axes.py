"""Segments' axes from two directions, and the lengths of a capture that is made of points."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from sssi_exudyn.bodies.skier.chain import SEGMENT, average_geometry
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.frames import Array
from sssi_exudyn.importing.motion_capture.c3d_points import Points
from sssi_exudyn.importing.motion_capture.capture_tree import SIDES, trunk_places
from sssi_exudyn.io.repairs import Mask
from sssi_exudyn.motion.capture_to_chain import mean_in

Places = dict[str, Array]


def whole_frames(path: Path, points: Points, needed: Sequence[str]) -> tuple[Mask, tuple[str, ...]]:
    """Return which frames (n,) have all needed points, and a note of those that have not.

    Raises InputError for less than three.
    """
    places = points.places[:, [points.names.index(name) for name in needed]]
    whole = np.all(np.isfinite(places), axis=(1, 2))
    if np.count_nonzero(whole) < 3:
        raise InputError(path, "POINT", "no three frames have all markers", "fill the gaps and export again")
    lost = len(whole) - int(np.count_nonzero(whole))
    return whole, (f"{path.name}: {lost} frame(s) in which a marker is lost are gaps",) if lost else ()


def upright(path: Path, at: Places, above: Array, below: Array) -> Places:
    """Return the places with z up; laboratories have y or z up.

    ``above`` and ``below`` (n, 3) are the top of the trunk and the ankles.  Raises InputError for other directions.
    """
    rise = np.mean(above - below, axis=0)
    axis = int(np.argmax(np.abs(rise)))
    if axis == 0 or rise[axis] < 0.7 * np.linalg.norm(rise):
        raise InputError(path, "POINT", "the skier stands along neither y nor z", "export with y or z up")
    if axis == 2:
        return at
    return {name: place[:, [2, 0, 1]] for name, place in at.items()}


def check_axes(path: Path, time: Array, rotation: Places) -> None:
    """Raise InputError for axes of points that coincide or lie on a line."""
    for name, axes in rotation.items():
        if np.min(np.linalg.det(axes)) < 0.5:  # 1, or 0 where markers coincide or lie on a line
            frame = int(np.argmin(np.linalg.det(axes)))
            raise InputError(
                path, f"{time[frame]:.2f} s, {name}", "markers coincide or lie on a line", "correct their labels"
            )


def lengths_of(rotation: Places, joint: Places, tips: Places, height: float) -> tuple[Places, Places]:
    """Return mean places of the joints in the segments that carry them, and far ends of the segments (m)."""

    def mean_place(carrier: str, name: str, places: Places) -> Array:
        return mean_in(rotation[carrier], joint[carrier], places[name])

    neck = mean_place("Spine", "Neck", joint)
    place = {"Spine": mean_place("Hips", "Spine", joint), **trunk_places(neck)}
    ends = {"Head": np.asarray(average_geometry(height).segment_end[SEGMENT["head"]])}
    for _, word in SIDES:
        for carrier, name in (("UpLeg", "Leg"), ("Leg", "Foot"), ("Arm", "ForeArm"), ("ForeArm", "Hand")):
            place[word + name] = mean_place(word + carrier, word + name, joint)
        place[f"{word}UpLeg"] = mean_place("Hips", f"{word}UpLeg", joint)
        place[f"{word}Arm"] = mean_place("Spine", f"{word}Arm", joint) - neck
        ends |= {f"{word}{part}": mean_place(f"{word}{part}", f"{word}{part}", tips) for part in ("Foot", "Hand")}
    return place, ends


def unit(vectors: Array) -> Array:
    """Return the vectors (n, 3) with a length of one; shorter ones than 1e-9 stay short."""
    return np.asarray(vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-9))


def axes_y_x(y: Array, x: Array) -> Array:
    """Return axes (n, 3, 3) with y along the first vector and x towards the second."""
    y = unit(y)
    z = unit(np.cross(x, y))
    return np.stack([np.cross(y, z), y, z], axis=-1)


def axes_z_x(z: Array, x: Array) -> Array:
    """Return axes (n, 3, 3) with z along the first vector and x towards the second."""
    z = unit(z)
    y = unit(np.cross(z, x))
    return np.stack([np.cross(y, z), y, z], axis=-1)


def axes_z_y(z: Array, y: Array) -> Array:
    """Return axes (n, 3, 3) with z along the first vector and y towards the second."""
    z = unit(z)
    x = unit(np.cross(y, z))
    return np.stack([x, np.cross(z, x), z], axis=-1)


def axes_x_y(x: Array, y: Array) -> Array:
    """Return axes (n, 3, 3) with x along the first vector and y towards the second."""
    x = unit(x)
    z = unit(np.cross(x, y))
    return np.stack([x, np.cross(z, x), z], axis=-1)
