"""Masses, centres of mass and inertia of the 21 segments of the chain, after de Leva (1996).

The table ``de_leva_1996.toml`` gives shares of the skier's mass and of the segments' lengths; the lengths are those of
the chain.  Its segments become the chain's as follows:

- pelvis: lower trunk; torso: middle and upper trunk together.  The trunk's line runs from the middle of the hip joint
  centres to the base of the neck (CERV); where it is cut (OMPH, XYPH) is taken from the mean subject's proportions.
- forearm: one half on ulna and one on radius, foot: 0.1 : 1.25 : 0.2166 on talus, calcaneus and toes (the masses in
  kg of OpenSim's gait2392 foot).  These parts share the centre of mass and the radii of gyration of the whole, so that
  together they are the published segment.
- boot and binding sit on the calcaneus.
"""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from functools import cache, lru_cache
from pathlib import Path
from typing import Any, Final

import numpy as np

from sssi_exudyn.bodies.skier.chain import SEGMENT, SEGMENTS, Geometry
from sssi_exudyn.core.choices import SEXES
from sssi_exudyn.core.frames import Array, cross
from sssi_exudyn.core.quantity import quantity

TABLE: Final = Path(__file__).with_name("de_leva_1996.toml")
_FOOT_PARTS: Final = {"talus": 0.1, "calcn": 1.25, "toes": 0.2166}
GRIP: Final = 0.5
"""Place where the hand grips a pole, as a share of the hand's length from the wrist."""
POLE_DIRECTION: Final = np.array([-1.0, 0.0, 0.0])
"""Direction from grip to tip in the hand's frame: across the hand, down when the forearm points forwards."""
POLE_CENTRE: Final = 0.4
"""Centre of mass of a pole, as a share of its length from the grip: an estimate, as the grip is the heaviest part."""
_FOREARM_PARTS: Final = {"ulna": 0.5, "radius": 0.5}


@dataclass(frozen=True)
class SegmentInertia:
    """Mass (kg), com (3,) m in the segment's frame from its joint, and inertia (3, 3) kg m² about that centre."""

    mass: float
    com: Array
    inertia: Array


@dataclass(frozen=True)
class Footwear:
    """Boxes of even density that stand for boot and binding: their sizes and places along the foot's axes."""

    boot_length: float = quantity(0.32, "m", low=0.2, high=0.5, source="typical boot, not measured", meaning="boot, x")
    boot_centre: float = quantity(
        0.0, "m", low=-0.1, high=0.2, source="assumed", meaning="middle of sole and binding ahead of the ankle joint"
    )
    boot_width: float = quantity(0.12, "m", low=0.05, high=0.3, source="typical boot, not measured", meaning="boot, y")
    boot_height: float = quantity(0.28, "m", low=0.1, high=0.5, source="typical boot, not measured", meaning="boot, z")
    boot_rise: float = quantity(
        0.0, "m", low=-0.2, high=0.2, source="typical boot, not measured", meaning="boot's centre over the ankle joint"
    )
    binding_length: float = quantity(
        0.32, "m", low=0.1, high=0.8, source="typical binding, not measured", meaning="binding, x"
    )
    binding_width: float = quantity(
        0.07, "m", low=0.02, high=0.2, source="typical binding, not measured", meaning="binding, y"
    )
    binding_height: float = quantity(
        0.03, "m", low=0.005, high=0.1, source="typical binding, not measured", meaning="binding, z"
    )
    binding_rise: float = quantity(
        0.03, "m", low=0.0, high=0.1, source="ski 18 mm thick", meaning="binding's centre over the running surface"
    )
    heel_share: float = quantity(
        0.25, "1", low=0.1, high=0.4, source="chain.average_geometry", meaning="part of the foot behind the ankle joint"
    )


@lru_cache(maxsize=16)  # an estimate asks for that of one skier a hundred times
def body_inertia(
    geometry: Geometry,
    skier_mass: float,
    sex: str,
    boot_mass: float = 0.0,
    binding_mass: float = 0.0,
    footwear: Footwear | None = None,
    pole: tuple[float, float] = (0.0, 0.0),
) -> tuple[SegmentInertia, ...]:
    """Return the inertia of the 21 segments, in the chain's order.

    ``skier_mass`` kg without equipment, ``boot_mass`` and ``binding_mass`` kg each, ``pole`` the mass (kg) and length
    (m) of one.  The masses add up to skier_mass + 2·(boot_mass + binding_mass + pole's).

    Raises ValueError for another sex than ``SEXES`` or a mass below zero.
    """
    if sex not in SEXES:
        raise ValueError(f"sex is {sex!r}, not one of {', '.join(SEXES)}")
    if min(skier_mass, boot_mass, binding_mass, *pole) < 0.0:
        raise ValueError("a mass is below zero")
    rows = _rows_for_mass(sex, skier_mass)
    worn = footwear or Footwear()
    bodies = {"head": _along(rows["head"], geometry.segment_end[SEGMENT["head"]], np.zeros(3))}
    bodies["pelvis"], bodies["torso"] = _trunk(rows, geometry)
    for side in ("l", "r"):
        bodies |= _arm(rows, geometry, side, *pole)
        for part, row, next_joint in (("femur", "thigh", "tibia"), ("tibia", "shank", "talus")):
            joint = geometry.joint_in_parent[SEGMENT[f"{next_joint}_{side}"]]
            bodies[f"{part}_{side}"] = _along(rows[row], np.zeros(3), joint)
        bodies |= _foot(rows["foot"], geometry, side, worn, boot_mass, binding_mass)
    return tuple(bodies[name] for name in SEGMENTS)


def combine(parts: list[SegmentInertia]) -> SegmentInertia:
    """Combine several bodies, all given in one frame, into one (parallel axes)."""
    mass = sum(part.mass for part in parts)
    if mass == 0.0:
        return SegmentInertia(0.0, np.mean([part.com for part in parts], axis=0), np.zeros((3, 3)))
    com = np.sum([part.mass * part.com for part in parts], axis=0) / mass
    inertia = np.zeros((3, 3))
    for part in parts:
        r = part.com - com
        inertia += part.inertia + part.mass * (r @ r * np.eye(3) - np.outer(r, r))
    return SegmentInertia(float(mass), com, inertia)


@dataclass(frozen=True)
class _Row:
    """One line of the table for one sex: mass in kg, the rest as shares of the length."""

    mass: float
    com: float
    radii: Array
    length: float


@cache
def _table() -> dict[str, Any]:
    table: dict[str, Any] = tomllib.loads(TABLE.read_text(encoding="utf-8"))
    return table


def _rows_for_mass(sex: str, skier_mass: float) -> dict[str, _Row]:
    table = _table()
    lines = {name: entry[sex] for name, entry in table.items()}
    paired = ("upper_arm", "forearm", "hand", "thigh", "shank", "foot")
    total = sum(line["mass"] * (2.0 if name in paired else 1.0) for name, line in lines.items())
    return {
        name: _Row(
            mass=skier_mass * line["mass"] / total,
            com=line["com"] / 100.0,
            radii=np.array(line["radii"]) / 100.0,
            length=line["length"] / 1000.0,
        )
        for name, line in lines.items()
    }


def _along(row: _Row, start: Array, end: Array, axes: tuple[int, int, int] = (0, 1, 2)) -> SegmentInertia:
    """Return a segment from ``start`` to ``end`` (3,) m; ``axes`` are the radii for x, y and z, the long axis."""
    length = float(np.linalg.norm(end - start))
    moments = row.mass * (row.radii[list(axes)] * length) ** 2
    return SegmentInertia(row.mass, start + row.com * (end - start), _about_axis(moments, end - start))


def _about_axis(moments: Array, direction: Array) -> Array:
    """Turn the z axis of principal moments (x, y, z) onto ``direction`` by the smallest rotation; none along ±z."""
    z = direction / np.linalg.norm(direction)
    z = z if z[2] >= 0.0 else -z
    x = np.array([1.0, 0.0, 0.0]) - z[0] / (1.0 + z[2]) * np.array([z[0], z[1], 1.0 + z[2]])
    axes = np.stack([x, cross(z, x), z], axis=1)
    return np.asarray(axes @ np.diag(moments) @ axes.T)


def _trunk(rows: dict[str, _Row], geometry: Geometry) -> tuple[SegmentInertia, SegmentInertia]:
    """Return pelvis and torso, made of the three parts of the trunk, which are cut at OMPH and XYPH."""
    hips = 0.5 * (geometry.joint_in_parent[SEGMENT["femur_l"]] + geometry.joint_in_parent[SEGMENT["femur_r"]])
    lumbar = geometry.joint_in_parent[SEGMENT["torso"]]
    neck = lumbar + geometry.joint_in_parent[SEGMENT["head"]]
    lengths = [rows[name].length for name in ("lower_trunk", "middle_trunk", "upper_trunk")]
    cuts = np.cumsum([0.0, *lengths]) / sum(lengths)
    midh, omph, xyph, cerv = (hips + cut * (neck - hips) for cut in cuts)
    pelvis = _along(rows["lower_trunk"], omph, midh)
    middle = _along(rows["middle_trunk"], xyph - lumbar, omph - lumbar)
    upper = _along(rows["upper_trunk"], cerv - lumbar, xyph - lumbar)
    return pelvis, combine([middle, upper])


def _arm(
    rows: dict[str, _Row], geometry: Geometry, side: str, pole_mass: float, pole_length: float
) -> dict[str, SegmentInertia]:
    elbow = geometry.joint_in_parent[SEGMENT[f"ulna_{side}"]]
    radius = geometry.joint_in_parent[SEGMENT[f"radius_{side}"]]
    wrist = radius + geometry.joint_in_parent[SEGMENT[f"hand_{side}"]]
    forearm = _along(rows["forearm"], np.zeros(3), wrist)
    # The table's palms face forwards, the chain's the thighs: what is sagittal there is transverse here.
    end = geometry.segment_end[SEGMENT[f"hand_{side}"]]
    hand = _along(rows["hand"], np.zeros(3), end, axes=(1, 0, 2))
    if pole_mass > 0.0:
        hand = combine([hand, _pole(pole_mass, pole_length, GRIP * end)])
    return {
        f"humerus_{side}": _along(rows["upper_arm"], np.zeros(3), elbow),
        f"ulna_{side}": _share(forearm, _FOREARM_PARTS["ulna"], np.zeros(3)),
        f"radius_{side}": _share(forearm, _FOREARM_PARTS["radius"], radius),
        f"hand_{side}": hand,
    }


def _pole(mass: float, length: float, grip: Array) -> SegmentInertia:
    """Return a pole in a fist at ``grip`` (3,) m: a rod across the hand, whose tip points back when the arm hangs."""
    square = mass * length**2 / 12.0
    return SegmentInertia(mass, grip + POLE_DIRECTION * POLE_CENTRE * length, np.diag([0.0, square, square]))


def _foot(
    row: _Row, geometry: Geometry, side: str, worn: Footwear, boot_mass: float, binding_mass: float
) -> dict[str, SegmentInertia]:
    """Return talus, calcaneus with boot and binding, and toes, in the talus' frame, whose origin is the ankle."""
    origin = {"talus": np.zeros(3), "calcn": geometry.joint_in_parent[SEGMENT[f"calcn_{side}"]]}
    origin["toes"] = origin["calcn"] + geometry.joint_in_parent[SEGMENT[f"toes_{side}"]]
    toe_tip = origin["toes"] + geometry.segment_end[SEGMENT[f"toes_{side}"]]
    length = toe_tip[0] / (1.0 - worn.heel_share)
    com = np.array([toe_tip[0] - length * (1.0 - row.com), toe_tip[1] * row.com, 0.5 * toe_tip[2]])
    sagittal, transverse, longitudinal = row.mass * (row.radii * length) ** 2
    # The foot's long axis points forwards; turned up from the toes-down posture, its sagittal axis is the vertical.
    foot = SegmentInertia(row.mass, com, np.diag([longitudinal, transverse, sagittal]))
    boot_at = np.array([com[0], 0.0, worn.boot_rise])
    boot = _box(boot_mass, boot_at, worn.boot_length, worn.boot_width, worn.boot_height)
    binding_at = np.array([worn.boot_centre, 0.0, worn.binding_rise - geometry.ankle_to_ski_base])
    binding = _box(binding_mass, binding_at, worn.binding_length, worn.binding_width, worn.binding_height)
    total = sum(_FOOT_PARTS.values())
    parts = {name: _share(foot, share / total, origin[name]) for name, share in _FOOT_PARTS.items()}
    equipment = [_share(body, 1.0, origin["calcn"]) for body in (boot, binding)]
    parts["calcn"] = combine([parts["calcn"], *equipment])
    return {f"{name}_{side}": body for name, body in parts.items()}


def _share(body: SegmentInertia, share: float, origin: Array) -> SegmentInertia:
    """Return a share of a body with the centre and radii of the whole, seen from ``origin`` (axes parallel)."""
    return SegmentInertia(share * body.mass, body.com - origin, share * body.inertia)


def _box(mass: float, com: Array, x: float, y: float, z: float) -> SegmentInertia:
    return SegmentInertia(mass, com, mass / 12.0 * np.diag([y**2 + z**2, x**2 + z**2, x**2 + y**2]))
