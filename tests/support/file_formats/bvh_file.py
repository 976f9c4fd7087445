"""BVH files of other skeletons: CMU's library in two conversions, and Rokoko's, of a skier of known posture.

Names, axes, order of channels and lengths are those of ``01_02.bvh`` of github.com/una-dinosauria/cmu-mocap and of
``examples/bvh/cmu1/jumping_jacks.bvh`` and ``examples/bvh/rokoko/jesse_dance.bvh`` of
github.com/facebookresearch/AnimatedDrawings.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping

import numpy as np
from scipy.spatial.transform import Rotation

from sssi_exudyn.bodies.skier.chain import SEGMENT, Poses
from sssi_exudyn.core.frames import BODY_FROM_BVH, Array
from sssi_exudyn.motion.capture_to_chain import hanging_from_t_pose

Row = tuple[str, str, tuple[float, float, float], str, Array]
"""A joint: its name, the one that carries it, its OFFSET, the segment that it moves, and left, up and forward of the
T-pose (columns) in its axes."""
SEGMENTS = {
    "Hips": "pelvis", "Spine2": "torso", "Head": "head",
    **{
        f"{word}{joint}": f"{segment}_{word[0].lower()}"
        for word in ("Left", "Right")
        for joint, segment in (
            ("UpLeg", "femur"), ("Leg", "tibia"), ("Foot", "calcn"), ("Arm", "humerus"), ("ForeArm", "radius"),
            ("Hand", "hand"),
        )
    },
}  # fmt: skip
"""Segments of the skier by the joints of a recording that move them."""
SPREAD = np.deg2rad(20.0)
"""Angle by which CMU's legs point outwards where all rotations are zero."""
SLOPE = np.deg2rad(25.0)
"""Angle by which Rokoko's foot slopes from the ankle to the ball."""
CMU_JOINTS = {
    "UpLeg": "Hip", "Leg": "Knee", "Foot": "Ankle", "ToeBase": "Toe",
    "Shoulder": "Collar", "Arm": "Shoulder", "ForeArm": "Elbow", "Hand": "Wrist",
}  # fmt: skip
_SAME = np.eye(3)


_END = "End Site\n{\nOFFSET 0 1 0\n}\n"


def from_t_pose(poses: Poses) -> dict[str, Array]:
    """Return the rotation (n, 3, 3) of every segment from the T-pose, in BVH axes, by a recording's joint."""
    return {
        joint: BODY_FROM_BVH.T @ poses.rotation[:, SEGMENT[segment]] @ hanging_from_t_pose(joint).T @ BODY_FROM_BVH
        for joint, segment in SEGMENTS.items()
    }


def cmu(world: Mapping[str, Array], rate: float, *, by_joints: bool = False) -> str:
    """Return the text of a skier in CMU's skeleton, with names of bones or of joints.

    ``world`` is the rotation (n, 3, 3) of every segment from the T-pose, by a recording's joint.
    """
    down = np.array([0.0, -1.0, 0.0])
    rows: list[Row] = [("Hips", "", (0.0, 0.0, 0.0), "Hips", _SAME)]
    for letter, word, left in (("L", "Left", 1.0), ("R", "Right", -1.0)):
        turned = Rotation.from_euler("z", left * SPREAD).as_matrix()
        bone = tuple(7.0 * turned @ down)
        rows += [
            (f"{letter}HipJoint", "Hips", (0.0, 0.0, 0.0), "Hips", _SAME),
            (f"{word}UpLeg", f"{letter}HipJoint", (left * 1.86, -1.74, 0.85), f"{word}UpLeg", turned),
            (f"{word}Leg", f"{word}UpLeg", bone, f"{word}Leg", turned),
            (f"{word}Foot", f"{word}Leg", bone, f"{word}Foot", turned),
            (f"{word}ToeBase", f"{word}Foot", tuple(turned @ [0.0, -0.47, 1.95]), f"{word}Foot", turned),
        ]
    rows += [
        ("LowerBack", "Hips", (0.0, 0.0, 0.0), "Hips", _SAME),
        ("Spine", "LowerBack", (0.0, 2.0, -0.1), "Spine2", _SAME),
        ("Spine1", "Spine", (0.0, 2.0, 0.0), "Spine2", _SAME),
        ("Neck", "Spine1", (0.0, 0.0, 0.0), "Spine2", _SAME),
        ("Neck1", "Neck", (0.0, 1.6, 0.3), "Spine2", _SAME),
        ("Head", "Neck1", (0.0, 1.6, -0.3), "Head", _SAME),
    ]
    for word, left in (("Left", 1.0), ("Right", -1.0)):
        # arms hang in the conversion by joints, as in its file
        turned = Rotation.from_euler("z", -left * 0.5 * np.pi).as_matrix() if by_joints else _SAME
        rows += [
            (f"{word}Shoulder", "Spine1", (0.0, 0.0, 0.0), "Spine2", _SAME),
            (f"{word}Arm", f"{word}Shoulder", (left * 3.4, 0.8, -0.2), f"{word}Arm", turned),
            (f"{word}ForeArm", f"{word}Arm", tuple(turned @ [left * 5.1, 0.0, 0.0]), f"{word}ForeArm", turned),
            (f"{word}Hand", f"{word}ForeArm", tuple(turned @ [left * 3.4, 0.0, 0.0]), f"{word}Hand", turned),
        ]
    if by_joints:
        names = {"LowerBack": "lowerback", "Spine": "Chest", "Spine1": "Chest2", "Neck": "lowerneck", "Neck1": "Neck"}
        names |= {f"{word}{bone}": f"{word}{joint}" for word in ("Left", "Right") for bone, joint in CMU_JOINTS.items()}
        rows = [(names.get(n, n), names.get(p, p), offset, segment, axes) for n, p, offset, segment, axes in rows]
    return _text(rows, world, rate, "ZYX")


def rokoko(world: Mapping[str, Array], rate: float) -> str:
    """Return the text of a skier in Rokoko's skeleton, whose bones lie along x."""
    trunk, leg, right_arm = (
        Rotation.from_euler(axes, angles, degrees=True).as_matrix()
        for axes, angles in (("z", -90.0), ("z", 90.0), ("y", 180.0))
    )
    level = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])  # toes: x forward, y up, z right
    foot = Rotation.from_euler("z", SLOPE).as_matrix() @ level
    rows: list[Row] = [
        ("Hips", "", (0.0, 94.0, 0.0), "Hips", _SAME),
        ("Spine", "Hips", (0.0, 13.0, 0.0), "Spine2", trunk),
        ("Spine1", "Spine", (12.7, 0.0, 0.0), "Spine2", trunk),
        ("Spine2", "Spine1", (12.8, 0.0, 0.0), "Spine2", trunk),
        ("Neck", "Spine2", (18.2, 0.0, 0.0), "Spine2", trunk),
        ("Head", "Neck", (11.0, 0.0, 0.0), "Head", _SAME),
    ]
    for word, left in (("Left", 1.0), ("Right", -1.0)):
        arm = _SAME if word == "Left" else right_arm
        rows += [
            (f"{word}Shoulder", "Spine2", (10.4, -7.0 * left, 1.9), "Spine2", arm),
            (f"{word}Arm", f"{word}Shoulder", (13.5, 0.0, 0.0), f"{word}Arm", arm),
            (f"{word}ForeArm", f"{word}Arm", (26.1, 0.0, 0.0), f"{word}ForeArm", arm),
            (f"{word}Hand", f"{word}ForeArm", (28.9, 0.0, 0.0), f"{word}Hand", arm),
            (f"{word}UpLeg", "Hips", (8.1 * left, 0.0, 0.0), f"{word}UpLeg", leg),
            (f"{word}Leg", f"{word}UpLeg", (43.2, 0.0, 0.0), f"{word}Leg", leg),
            (f"{word}Foot", f"{word}Leg", (43.3, 0.0, 0.0), f"{word}Foot", foot),
            (f"{word}ToeBase", f"{word}Foot", (14.6, 0.0, 0.0), f"{word}Foot", level),
        ]
    return _text(rows, world, rate, "YXZ")


def _text(rows: list[Row], world: Mapping[str, Array], rate: float, order: str) -> str:
    turned = {name: world[segment] @ axes.T for name, _, _, segment, axes in rows}
    channels = " ".join(f"{axis}rotation" for axis in order)
    columns = [np.zeros((len(world["Hips"]), 3))]

    def joint(name: str, parent: str, offset: tuple[float, float, float]) -> str:
        local = np.swapaxes(turned[parent], -1, -2) @ turned[name] if parent else turned[name]
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # where one angle is free, any choice is the rotation
            columns.append(Rotation.from_matrix(local).as_euler(order, degrees=True))
        below = "".join(joint(n, p, o) for n, p, o, *_ in rows if p == name)
        head = f"{'JOINT' if parent else 'ROOT'} {name}\n{{\nOFFSET {' '.join(f'{value:.6f}' for value in offset)}\n"
        count = "3" if parent else "6 Xposition Yposition Zposition"
        return f"{head}CHANNELS {count} {channels}\n{below or _END}}}\n"

    tree = joint(*rows[0][:3])
    frames = np.hstack(columns)
    lines = "\n".join(" ".join(f"{value:.6f}" for value in frame) for frame in frames)
    return f"HIERARCHY\n{tree}MOTION\nFrames: {len(frames)}\nFrame Time: {1.0 / rate:.9f}\n{lines}\n"
