"""The skier's muscles on his own skeleton: the paper's 284, or with all of the legs' 322.

The table ``muscles.toml`` gives them on the full-body lumbar spine model, the right side alone.  Here they are brought
to a chain of given lengths.  Points of limbs are scaled along with their segment and turned by the small angle that
brings the model's far joint to the chain's.  The trunk, from the hips to the shoulders, is scaled as one; the pelvis
has the skier's width between the hips.  Optimal fibre and tendon slack lengths are scaled by the muscle's whole length
in anatomical zero, as in OpenSim.

Greatest forces F are scaled by volume V over fibre length l, as a muscle's cross section.  The volume is scaled by the
skier's mass m and height h like that of all muscles of a leg (24 people in magnetic resonance: G. G. Handsfield et al.,
J. Biomech. 47 (2014) 631-638):

    F = F₀ · V(m, h)/V(m₀, h₀) · l₀/l,   V = 47 cm³/(kg m) · m h + 1285 cm³

The chain has one lumbar joint; here five vertebrae and the torso share its rotations, and the knee slides while it
bends.  So bones do not turn exactly about the chain's joints.  A moment that is compared with these muscles has to be
transferred to where the bones turn (``joint_shift``).

Some of the model's trunk muscles have fibres of twice their optimal length in the upright posture already, unlike
measured sarcomeres.  Here a trunk muscle's fibre, upright, is within ``UPRIGHT`` of its optimal length, and its tendon
has the length that leaves it that.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
from scipy.spatial.transform import Rotation

from sssi_exudyn.bodies.muscles.bones import Bone, Bones, Drive, Stance
from sssi_exudyn.bodies.muscles.curves import line, spline
from sssi_exudyn.bodies.muscles.paths import Muscle, MuscleModel, PathPoint, Surface, Wrap, muscle_paths
from sssi_exudyn.bodies.skier.chain import JOINTS, PRESCRIBED, SEGMENT, Geometry, average_geometry
from sssi_exudyn.core.choices import MuscleSet
from sssi_exudyn.core.frames import Array

TABLE: Final = Path(__file__).with_name("muscles.toml")
SIDES: Final = ("right", "left")
LEG_GROUPS: Final = (
    "gluteus_maximus",
    "psoas_major",
    "gluteus_medius",
    "hip_abductors",
    "quadriceps_femoris",
    "hamstrings",
    "triceps_surae",
    "tibialis_anterior",
)
LUMBAR_GROUPS: Final = (
    "erector_spinae",
    "rectus_abdominis",
    "external_obliques",
    "internal_obliques",
    "multifidus",
    "quadratus_lumborum",
    "psoas_major",
    "latissimus_dorsi",
)
"""The paper's major groups (2.2.1).  The iliacus is counted to the leg's psoas major, with which it moves the leg."""
OTHER_LEG_GROUPS: Final = (
    "hip_adductors",
    "sartorius",
    "deep_hip_rotators",
    "deep_calf",
    "peroneals",
    "toe_extensors",
)
"""Other groups of the leg: with them it has 42 muscles, and 43 with the psoas, whose fascicles are the trunk's."""
OWN_BODY: Final = (75.339, 1.80)
"""kg and m of the model that the table's figures belong to."""
_VOLUME: Final = (47.0, 1285.0)
"""cm³/(kg m) and cm³ of a leg's muscles: Handsfield et al. 2014."""
_MIDDLE: Final = ("pelvis", "torso", "abdomen", "back", "L5", "L4", "L3", "L2", "L1")
_VERTEBRAE: Final = ("L5", "L4", "L3", "L2", "L1")
_LUMBAR: Final = ("lumbar_extension", "lumbar_bending", "lumbar_rotation")
UPRIGHT: Final = (0.8, 1.2)
"""Least and greatest length of a trunk muscle's fibre in anatomical zero, in optimal ones.  Sarcomeres measured there,
of 2.7 µm at the optimum: rectus abdominis 2.83, quadratus lumborum 2.39, erector spinae 2.37 µm (Delp et al. 2001),
multifidus 2.27 µm (Ward et al. 2009), psoas 3.11 µm (Regev et al. 2011).
"""


@dataclass(frozen=True)
class NamedMuscle:
    """A muscle with its side (``SIDES``), region ("leg", "lumbar") and group."""

    side: str
    region: str
    group: str
    muscle: Muscle


@dataclass(frozen=True)
class SkierMuscles:
    """The skier's muscles: the model (coordinates ``chain.PRESCRIBED``, ground the pelvis), and side, region and group.

    torso_origin : (3,) m, in anatomical zero, of the torso's bone from the pelvis' origin
    ligament : by "r" and "l" the ends (3,) m of the patella's ligament, in the tibia and in the patella
    """

    model: MuscleModel
    named: tuple[NamedMuscle, ...]
    torso_origin: Array
    ligament: Mapping[str, tuple[Array, Array]]


def skier_muscles(geometry: Geometry, body: tuple[float, float] = OWN_BODY, chosen: MuscleSet = "full") -> SkierMuscles:
    """Return the muscles on a chain of these lengths, of a skier of mass and height ``body`` (kg, m)."""
    table = _read_table(chosen)
    volume = leg_volume(*body) / leg_volume(*OWN_BODY)
    ours = _Scales(table, geometry)
    # the reference: a chain that has the model's own lengths
    theirs = _Scales(table, _own_geometry(table))
    model, own_model = (
        MuscleModel("skier", _bones(table, scales), _muscles(table, scales), _surfaces(table, scales), _upright())
        for scales in (ours, theirs)
    )
    upright_length = muscle_paths(model, _upright()[None]).length[0]
    length_ratio = upright_length / muscle_paths(own_model, _upright()[None]).length[0]
    named = []
    for muscle, (row, side), ratio, length in zip(
        model.muscles, _rows(table), length_ratio, upright_length, strict=True
    ):
        scaled = replace(
            muscle,
            optimal_fibre=float(muscle.optimal_fibre * ratio),
            tendon_slack=float(muscle.tendon_slack * ratio),
            max_isometric_force=float(muscle.max_isometric_force * volume / ratio),
        )
        if row["region"] == "lumbar":
            scaled = _within_upright(scaled, float(length))
        named.append(NamedMuscle(side, row["region"], row["group"], scaled))
    return SkierMuscles(
        replace(model, muscles=tuple(entry.muscle for entry in named)),
        tuple(named),
        ours.torso_origin,
        _ligament(table, ours),
    )


def leg_groups(chosen: MuscleSet) -> tuple[str, ...]:
    """Return the names of the leg's muscle groups."""
    return LEG_GROUPS + OTHER_LEG_GROUPS if chosen == "full" else LEG_GROUPS


def leg_volume(mass: float, height: float) -> float:
    """Return the volume (cm³) of all muscles of a leg, of a person of mass (kg) and height (m)."""
    return _VOLUME[0] * mass * height + _VOLUME[1]


def _ligament(table: dict[str, Any], scales: _Scales) -> dict[str, tuple[Array, Array]]:
    ends = table["knee"]["ligament"]
    ligaments = {}
    for side, left in (("r", 1.0), ("l", -1.0)):
        mirror = np.array([1.0, left, 1.0])
        tibia, patella = (scales.point(f"{bone}_{side}", mirror * ends[bone]) for bone in ("tibia", "patella"))
        ligaments[side] = tibia, patella
    return ligaments


def _within_upright(muscle: Muscle, length: float) -> Muscle:
    """Give a muscle a tendon that leaves its fibre a length within ``UPRIGHT``; ``length`` m is that of the muscle,
    upright.
    """
    width = muscle.optimal_fibre * np.sin(muscle.pennation)
    shortest, longest = (np.sqrt((bound * muscle.optimal_fibre) ** 2 - width**2) for bound in UPRIGHT)
    slack = np.clip(muscle.tendon_slack, length - longest, length - shortest)
    return replace(muscle, tendon_slack=float(max(slack, 0.0)))


def joint_shift(skier: SkierMuscles, geometry: Geometry, stance: Stance) -> dict[str, dict[str, Array]]:
    """Return how the chain's joints of torso and tibiae move on these bones.

    The result gives by segment and coordinate the velocity (n, 3) a unit rate, in the pelvis' frame.

    A force F that the inner part exerts on the outer part at the chain's joint does F · shift more work here than in
    the chain.  The moment of the muscles is greater by as much.
    """
    tree = skier.model.bones
    origin = geometry.joint_in_parent[SEGMENT["torso"]] - skier.torso_origin
    shifts: dict[str, dict[str, Array]] = {}
    for segment, point, names in (
        ("torso", origin, _LUMBAR),
        *((f"tibia_{side}", np.zeros(3), (f"knee_angle_{side}",)) for side in "rl"),
    ):
        i = tree.index(segment)
        place = stance.origin[:, i] + stance.rotation[:, i] @ point
        columns = [PRESCRIBED.index(name) for name in names]
        moving = stance.moving[:, i, columns] + np.cross(stance.turning[:, i, columns], place[:, None])
        shifts[segment] = {name: moving[:, k] for k, name in enumerate(names)}
    return shifts


def muscles_table(chosen: MuscleSet = "full") -> list[dict[str, str | float]]:
    """Return every muscle of a set, a row each: right side, then left; figures of the model, not scaled."""
    return [
        {
            "name": f"{row['name']}_{side[0]}",
            "side": side,
            "region": row["region"],
            "group": row["group"],
            "max_isometric_force_N": row["max_isometric_force_N"],
            "optimal_fibre_m": row["optimal_fibre_m"],
            "tendon_slack_m": row["tendon_slack_m"],
            "pennation_deg": round(float(np.degrees(row["pennation_rad"])), 3),
            "path_points": len(row["path"]),
        }
        for row, side in _rows(_read_table(chosen))
    ]


def own_geometry() -> Geometry:
    """Return a chain with the lengths of the model that the table's figures belong to."""
    return _own_geometry(_read_table("paper"))


def _read_table(chosen: MuscleSet) -> dict[str, Any]:
    table = tomllib.loads(TABLE.read_text(encoding="utf-8"))
    if chosen == "paper":
        table["muscle"] = [row for row in table["muscle"] if row["group"] not in OTHER_LEG_GROUPS]
    return table


def _own_geometry(table: dict[str, Any]) -> Geometry:
    average = average_geometry(1.80)  # what no muscle of the table reaches stays as it is there
    joint = average.joint_in_parent.copy()
    length = {name: np.array(value) for name, value in table["reference"].items()}
    lumbar = _lumbar_centre(table)
    joint[SEGMENT["torso"]] = lumbar
    for side, left in (("r", -1.0), ("l", 1.0)):
        mirror = np.array([1.0, -left, 1.0])
        joint[SEGMENT[f"femur_{side}"]] = (0.0, left * table["reference"]["hip_from_middle"], 0.0)
        for segment, name in (("tibia", "knee_from_hip"), ("talus", "ankle_from_knee"), ("toes", "toes_from_ankle")):
            joint[SEGMENT[f"{segment}_{side}"]] = mirror * length[name]
        shoulder = length["shoulders_from_hips"] + [0.0, left * 0.17, 0.0]
        joint[SEGMENT[f"humerus_{side}"]] = shoulder - lumbar
        joint[SEGMENT[f"ulna_{side}"]] = mirror * length["elbow_from_shoulder"]
    return replace(average, joint_in_parent=joint)


def _lumbar_centre(table: dict[str, Any]) -> Array:
    """Return the mean (3,) m, from the middle of the hips, of the vertebrae's joints by their shares of extension.

    About this point a small extension that the vertebrae share turns the torso.
    """
    rows = [table["lumbar"][name] for name in _VERTEBRAE]
    place, centre, total = np.zeros(3), np.zeros(3), 0.0
    for row in rows:
        place = place + row["joint"]
        centre, total = centre + row["shares"][0] * place, total + row["shares"][0]
        place = place + row["origin_from_joint"]
    return centre / total


def _upright() -> Array:
    return np.zeros(len(PRESCRIBED))


class _Scales:
    """Scales and small turns (3, 3), and shifts (3,) m, that bring points of the table's bones to those of a chain."""

    def __init__(self, table: dict[str, Any], geometry: Geometry) -> None:
        joint, reference = geometry.joint_in_parent, table["reference"]
        hips = [joint[SEGMENT[f"femur_{side}"]] for side in "lr"]
        shoulders = [joint[SEGMENT["torso"]] + joint[SEGMENT[f"humerus_{side}"]] for side in "lr"]
        self.geometry = geometry
        self.table = table
        self.hips = 0.5 * (hips[0] + hips[1])
        height = float(np.linalg.norm(0.5 * (shoulders[0] + shoulders[1]) - self.hips))
        self.trunk = height / float(np.linalg.norm(reference["shoulders_from_hips"]))
        width = 0.5 * float(np.linalg.norm(hips[0] - hips[1])) / reference["hip_from_middle"]
        self.matrix = {name: self.trunk * np.eye(3) for name in _MIDDLE}
        self.matrix["pelvis"] = np.diag([self.trunk, width, self.trunk])
        for side, left in (("r", -1.0), ("l", 1.0)):
            mirror = np.array([1.0, -left, 1.0])
            for bone, beyond, name in (
                ("femur", "tibia", "knee_from_hip"),
                ("tibia", "talus", "ankle_from_knee"),
                ("humerus", "ulna", "elbow_from_shoulder"),
            ):
                self.matrix[f"{bone}_{side}"] = _onto(mirror * reference[name], joint[SEGMENT[f"{beyond}_{side}"]])
            toes = joint[SEGMENT[f"calcn_{side}"]] + joint[SEGMENT[f"toes_{side}"]]
            self.matrix[f"calcn_{side}"] = toes[0] / reference["toes_from_ankle"][0] * np.eye(3)
            self.matrix[f"patella_{side}"] = self.matrix[f"femur_{side}"]

    @property
    def torso_origin(self) -> Array:
        """Origin (3,) m of the torso's own frame in the pelvis, upright."""
        rows = [self.table["lumbar"][name] for name in (*_VERTEBRAE, "torso")]
        from_hips = np.sum([np.array(row["joint"]) + row["origin_from_joint"] for row in rows], axis=0)
        return np.asarray(self.hips + self.trunk * from_hips)

    def point(self, bone: str, place: Array) -> Array:
        """Return a point of the table on the chain's bone."""
        moved = self.matrix[bone] @ place
        if bone == "pelvis":
            return np.asarray(moved + self.hips)
        if bone.startswith("calcn"):
            return np.asarray(moved - self.geometry.joint_in_parent[SEGMENT[bone]])
        return np.asarray(moved)


def _onto(theirs: Array, ours: Array) -> Array:
    """Return scale and smallest turn (3, 3) that bring ``theirs`` (3,) to ``ours`` (3,)."""
    size = float(np.linalg.norm(ours) / np.linalg.norm(theirs))
    axis = np.cross(theirs, ours)
    sine = float(np.linalg.norm(axis))
    turn = axis / sine * np.arctan2(sine, theirs @ ours) if sine > 0.0 else axis
    return np.asarray(size * Rotation.from_rotvec(turn).as_matrix())


def _joint(segment: str, geometry: Geometry, slides: tuple[Drive, ...] = ()) -> Bone:
    """Return a bone that hangs on its parent as in the chain."""
    i = SEGMENT[segment]
    joint = JOINTS[i]
    turns = tuple(Drive(np.array(axis), line(1.0), name) for name, axis in joint.rotations)
    return Bone(
        segment, joint.parent, geometry.joint_in_parent[i], geometry.attitude_in_parent[i], turns, slides=slides
    )


def _bones(table: dict[str, Any], scales: _Scales) -> Bones:
    bones = [Bone("pelvis", None), *_spine(table, scales)]
    lower = scales.geometry.joint_in_parent[SEGMENT["torso"]] - scales.torso_origin
    for side in "rl":
        bones += _leg(table, scales, side)
        humerus = _joint(f"humerus_{side}", scales.geometry)
        bones.append(replace(humerus, place=humerus.place + lower))
    return Bones(tuple(bones), PRESCRIBED)


def _leg(table: dict[str, Any], scales: _Scales, side: str) -> list[Bone]:
    """Return femur to calcaneus, and the patella; tibia and patella glide on the femur, by the femur's scale."""
    matrix = scales.matrix[f"femur_{side}"]
    size = float(np.linalg.norm(matrix[:, 0]))
    turned = matrix / size
    knee = f"knee_angle_{side}"
    curves = {name: spline(entry["x"], entry["y"]) for name, entry in table["knee"].items() if "x" in entry}

    def slide(name: str, axis: int, extended: float) -> Drive:
        curve = curves[name].lift(-extended).scale(y=size)
        return Drive(turned[:, axis], curve, knee)

    straight = {axis: float(curves[f"tibia_{axis}"](np.zeros(1))[0][0]) for axis in "xz"}
    glides = tuple(slide(f"tibia_{axis}", "xyz".index(axis), straight[axis]) for axis in "xz")
    patella = Bone(
        f"patella_{side}",
        f"femur_{side}",
        scales.geometry.joint_in_parent[SEGMENT[f"tibia_{side}"]],
        np.eye(3),
        (Drive(np.array([0.0, 1.0, 0.0]), curves["patella_turn"], knee),),
        tuple(slide(f"patella_{axis}", "xyz".index(axis), straight[axis]) for axis in "xz"),
    )
    femur, tibia, talus, calcn = (f"{name}_{side}" for name in ("femur", "tibia", "talus", "calcn"))
    geometry = scales.geometry
    return [
        _joint(femur, geometry),
        patella,
        _joint(tibia, geometry, glides),
        _joint(talus, geometry),
        _joint(calcn, geometry),
    ]


def _spine(table: dict[str, Any], scales: _Scales) -> Iterator[Bone]:
    """Yield vertebrae and torso, one on the other, turning by their shares, and the frames that turn with extension."""
    rows = table["lumbar"]
    total = np.sum([rows[name]["shares"] for name in (*_VERTEBRAE, "torso")], axis=0)
    parent, place = "pelvis", scales.hips + scales.trunk * np.array(rows["L5"]["joint"])
    axes = [axis for _, axis in JOINTS[SEGMENT["torso"]].rotations]
    for name in (*_VERTEBRAE, "torso"):
        shares = np.array(rows[name]["shares"]) / total
        turns = tuple(
            Drive(np.array(axis), line(float(share)), coordinate)
            for axis, share, coordinate in zip(axes, shares, _LUMBAR, strict=True)
        )
        if name != "L5":
            place = scales.trunk * np.array(rows[name]["joint"])
        end = -scales.trunk * np.array(rows[name]["origin_from_joint"])
        yield Bone(name, parent, place, turns=turns, end_place=end)
        parent = name
    for name in ("abdomen", "back"):
        row = rows[name]
        turn = Drive(np.array(axes[0]), line(row["turn"] / float(total[0])), _LUMBAR[0])
        slides = tuple(
            Drive(np.eye(3)[k], line(scales.trunk * row["slide"][k] / float(total[0])), _LUMBAR[0])
            for k in range(3)
            if row["slide"][k] != 0.0
        )
        place = scales.hips + scales.trunk * np.array(row["joint"])
        end = -scales.trunk * np.array(row["origin_from_joint"])
        yield Bone(name, "pelvis", place, turns=(turn,), slides=slides, end_place=end)


def _rows(table: dict[str, Any]) -> Iterator[tuple[dict[str, Any], str]]:
    """Yield every muscle of the table on the right, then on the left."""
    for side in SIDES:
        for row in table["muscle"]:
            yield row, side


def _muscles(table: dict[str, Any], scales: _Scales) -> tuple[Muscle, ...]:
    return tuple(_muscle(row, side, scales) for row, side in _rows(table))


def _muscle(row: dict[str, Any], side: str, scales: _Scales) -> Muscle:
    letter, mirror = side[0], np.array([1.0, 1.0 if side == "right" else -1.0, 1.0])
    points = []
    for bone, x, y, z, *condition in row["path"]:
        name = bone if bone in _MIDDLE else f"{bone}_{letter}"
        place = scales.point(name, mirror * np.array([x, y, z]))
        when = (f"{condition[0]}_{letter}", condition[1], condition[2]) if condition else None
        points.append(PathPoint(name, place, condition=when))
    wraps = (Wrap(f"{row['surface']}_{letter}", 0, len(points) - 1),) if "surface" in row else ()
    return Muscle(
        name=f"{row['name']}_{letter}",
        points=tuple(points),
        max_isometric_force=row["max_isometric_force_N"],
        optimal_fibre=row["optimal_fibre_m"],
        tendon_slack=row["tendon_slack_m"],
        pennation=row["pennation_rad"],
        wraps=wraps,
    )


def _surfaces(table: dict[str, Any], scales: _Scales) -> tuple[Surface, ...]:
    """Return every surface on both sides; the left one's own frame is mirrored along z, so it stays right-handed."""
    surfaces = []
    for side in SIDES:
        left = side == "left"
        bone_mirror, own_mirror = np.diag([1.0, -1.0 if left else 1.0, 1.0]), np.diag([1.0, 1.0, -1.0 if left else 1.0])
        for row in table["surface"]:
            place = scales.trunk * bone_mirror @ row["place"]
            attitude = bone_mirror @ Rotation.from_rotvec(row["attitude"]).as_matrix() @ own_mirror
            direction, axis = (
                (0.0, "x") if row["side"] == "all" else (1.0 if row["side"][0] == "+" else -1.0, row["side"][1])
            )
            sign = -direction if left and axis == "z" else direction
            surfaces.append(
                Surface(
                    f"{row['name']}_{side[0]}",
                    row["bone"],
                    row["kind"],
                    place,
                    attitude,
                    scales.trunk * np.array(row["size"]),
                    "xyz".index(axis),
                    sign,
                )
            )
    return tuple(surfaces)
