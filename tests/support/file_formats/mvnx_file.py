"""An MVNX file of a skeleton with known orientations, written as Xsens MVN does."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from sssi_exudyn.core.frames import Array

# segment, the joint at its origin, the segment that carries it, the joint's place there (m; x forward, y left, z up)
SEGMENTS: tuple[tuple[str, str, str, tuple[float, float, float]], ...] = (
    ("Pelvis", "pHipOrigin", "", (0.0, 0.0, 0.0)),
    ("L5", "jL5S1", "Pelvis", (0.0, 0.0, 0.11)),
    ("L3", "jL4L3", "L5", (0.0, 0.0, 0.09)),
    ("T12", "jL1T12", "L3", (0.0, 0.0, 0.08)),
    ("T8", "jT9T8", "T12", (0.0, 0.0, 0.08)),
    ("Neck", "jT1C7", "T8", (0.0, 0.0, 0.12)),
    ("Head", "jC1Head", "Neck", (0.0, 0.0, 0.09)),
    *(
        row
        for side, left in (("Right", -1.0), ("Left", 1.0))
        for row in (
            (f"{side}Shoulder", f"j{side}T4Shoulder", "T8", (0.0, 0.03 * left, 0.07)),
            (f"{side}UpperArm", f"j{side}Shoulder", f"{side}Shoulder", (0.0, 0.13 * left, 0.0)),
            (f"{side}ForeArm", f"j{side}Elbow", f"{side}UpperArm", (0.0, 0.26 * left, 0.0)),
            (f"{side}Hand", f"j{side}Wrist", f"{side}ForeArm", (0.0, 0.22 * left, 0.0)),
        )
    ),
    *(
        row
        for side, left in (("Right", -1.0), ("Left", 1.0))
        for row in (
            (f"{side}UpperLeg", f"j{side}Hip", "Pelvis", (0.0, 0.09 * left, 0.0)),
            (f"{side}LowerLeg", f"j{side}Knee", f"{side}UpperLeg", (0.0, 0.0, -0.4)),
            (f"{side}Foot", f"j{side}Ankle", f"{side}LowerLeg", (0.0, 0.0, -0.4)),
            (f"{side}Toe", f"j{side}BallFoot", f"{side}Foot", (0.15, 0.0, -0.07)),
        )
    ),
)
RATE = 60.0
BEGAN = 1_700_000_000.25


def orientations(frames: int, seed: int = 3) -> Array:
    """Return rotations (frames, 23, 3, 3) segment → world: every segment wanders smoothly about its own axes."""
    rng = np.random.default_rng(seed)
    time = np.arange(frames)[:, None, None] / RATE
    waves = 0.5 * np.sin(rng.uniform(2.0, 4.0, (len(SEGMENTS), 3)) * time + rng.uniform(0.0, 6.0, (len(SEGMENTS), 3)))
    return Rotation.from_rotvec(waves.reshape(-1, 3)).as_matrix().reshape(frames, len(SEGMENTS), 3, 3)


def mvnx(rotations: Array, *, index: list[int] | None = None, began: float = BEGAN) -> str:
    """Return the file's text.

    ``index`` gives the frames' numbers where some are missing, ``began`` the UTC of frame 0 (s).
    """
    points: dict[str, list[str]] = {name: [_point(joint, (0.0, 0.0, 0.0))] for name, joint, _, _ in SEGMENTS}
    joints = []
    for name, joint, parent, place in SEGMENTS[1:]:
        points[parent].append(_point(joint, place))
        joints.append(
            f'<joint label="{joint}"><connector1>{parent}/{joint}</connector1>'
            f"<connector2>{name}/{joint}</connector2></joint>"
        )
    segments = "".join(
        f'<segment label="{name}" id="{number}"><points>{"".join(points[name])}</points></segment>\n'
        for number, (name, *_) in enumerate(SEGMENTS, 1)
    )
    numbers = index if index is not None else list(range(len(rotations)))
    frames = [_frame("tpose", None, began, np.tile(np.eye(3), (len(SEGMENTS), 1, 1)))]
    frames += [_frame("normal", number, began, frame) for number, frame in zip(numbers, rotations, strict=True)]
    return (
        '<?xml version="1.0" encoding="UTF-8"?>\n'
        '<mvnx xmlns="http://www.xsens.com/mvn/mvnx" version="4">\n'
        f'<subject label="skier" frameRate="{RATE:g}" segmentCount="23">\n<segments>\n{segments}</segments>\n'
        f"<joints>\n{''.join(joints)}</joints>\n<frames>\n{''.join(frames)}</frames>\n</subject>\n</mvnx>\n"
    )


def _point(label: str, place: tuple[float, float, float]) -> str:
    return f'<point label="{label}"><pos_b>{" ".join(f"{x:.6f}" for x in place)}</pos_b></point>'


def _frame(kind: str, number: int | None, began: float, rotations: Array) -> str:
    quaternions = Rotation.from_matrix(rotations).as_quat(scalar_first=True).ravel()
    known = "" if number is None else f'index="{number}" ms="{round(1000 * (began + number / RATE))}" '
    zeros = " ".join(["0.000000"] * 3 * len(SEGMENTS))
    return (
        f'<frame time="0" {known}type="{kind}"><orientation>{" ".join(f"{q:.6f}" for q in quaternions)}</orientation>'
        f"<position>{zeros}</position></frame>\n"
    )
