"""Joints' centres of a skier of known posture under the labels of several systems, in a TRC file."""

from __future__ import annotations

import numpy as np

from sssi_exudyn.bodies.skier.chain import SEGMENT, Poses
from sssi_exudyn.core.frames import Array

KNEE, ANKLE = 0.11, 0.08
"""Widths of knee and ankle, m."""
_POSE2SIM = {"hip": "Hip", "knee": "Knee", "ankle": "Ankle", "heel": "Heel", "toe": "BigToe", "shoulder": "Shoulder",
             "elbow": "Elbow", "wrist": "Wrist"}  # fmt: skip


def joint_places(poses: Poses) -> dict[str, Array]:
    """Return the place (n, 3) m of every joint, by side and name."""

    def at(segment: str, x: float = 0.0, y: float = 0.0, z: float = 0.0) -> Array:
        i = SEGMENT[segment]
        return np.asarray(poses.origin[:, i] + poses.rotation[:, i] @ np.array([x, y, z]))

    places = {"neck": at("head"), "pelvis_front": at("pelvis", 0.1), "pelvis_back": at("pelvis", -0.1)}
    for side, word, left in (("l", "left", 1.0), ("r", "right", -1.0)):
        places |= {
            f"{word}_hip": at(f"femur_{side}"),
            f"{word}_knee": at(f"tibia_{side}"),
            f"{word}_ankle": at(f"talus_{side}"),
            f"{word}_heel": at(f"calcn_{side}", -0.05, 0.0, -0.06),
            f"{word}_toe": at(f"calcn_{side}", 0.13, 0.0, -0.06),
            f"{word}_shoulder": at(f"humerus_{side}"),
            f"{word}_elbow": at(f"ulna_{side}"),
            f"{word}_wrist": at(f"hand_{side}"),
        }
        for name, segment, width in (("knee", f"femur_{side}", KNEE), ("ankle", f"tibia_{side}", ANKLE)):
            out = 0.5 * left * width * poses.rotation[:, SEGMENT[segment], :, 1]
            places[f"{word}_{name}_outside"] = places[f"{word}_{name}"] + out
            places[f"{word}_{name}_inside"] = places[f"{word}_{name}"] - out
    return places


def pose2sim(places: dict[str, Array]) -> dict[str, Array]:
    """Return the joints under the labels of BODY_25 and HALPE_26."""
    labels = {"neck": "Neck"}
    labels |= {f"{word}_{name}": word[0].upper() + of for word in ("left", "right") for name, of in _POSE2SIM.items()}
    return {label: places[name] for name, label in labels.items()}


def mediapipe(places: dict[str, Array]) -> dict[str, Array]:
    """Return the joints under the labels of MediaPipe, which has no neck."""
    sided = {
        name: place for name, place in places.items() if name.removeprefix("left_").removeprefix("right_") in _POSE2SIM
    }
    return {name.replace("toe", "foot_index"): place for name, place in sided.items()}


def opencap(places: dict[str, Array]) -> dict[str, Array]:
    """Return augmented markers: two at every knee and ankle, four at the pelvis."""
    made = {"C7_study": places["neck"]}
    for word, letter in (("left", "L"), ("right", "r")):
        outwards = 0.12 * (1.0 if word == "left" else -1.0) * np.array([0.0, 1.0, 0.0])
        made |= {
            f"{letter}.ASIS_study": places["pelvis_front"] + outwards,
            f"{letter}.PSIS_study": places["pelvis_back"] + outwards,
            f"{letter.upper()}HJC_study": places[f"{word}_hip"],
            f"{letter}_calc_study": places[f"{word}_heel"],
            f"{letter}_toe_study": places[f"{word}_toe"],
            f"{letter}_shoulder_study": places[f"{word}_shoulder"],
        }
        for name in ("knee", "ankle"):
            made[f"{letter}_{name}_study"] = places[f"{word}_{name}_outside"]
            made[f"{letter}_m{name}_study"] = places[f"{word}_{name}_inside"]
        for name in ("elbow", "wrist"):
            made[f"{letter}_l{name}_study"] = places[f"{word}_{name}"] + [0.02, 0.0, 0.01]
            made[f"{letter}_m{name}_study"] = places[f"{word}_{name}"] - [0.02, 0.0, 0.01]
    return made


def trc(places: dict[str, Array], rate: float, unit: str = "m", *, y_up: bool = True) -> str:
    """Return the text; NaN becomes an empty cell."""
    factor = {"m": 1.0, "mm": 1000.0}[unit]
    order = [1, 2, 0] if y_up else [0, 1, 2]
    table = np.concatenate([factor * place[:, order] for place in places.values()], axis=1)
    count = len(table)
    names = "\t\t\t".join(places)
    axes = "\t".join(f"{axis}{number}" for number in range(1, len(places) + 1) for axis in "XYZ")
    head = [
        "PathFileType\t4\t(X/Y/Z)\trun.trc",
        "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames",
        f"{rate}\t{rate}\t{count}\t{len(places)}\t{unit}\t{rate}\t1\t{count}",
        f"Frame#\tTime\t{names}\t\t",
        f"\t\t{axes}",
        "",
    ]
    rows = [
        "\t".join([str(i + 1), f"{i / rate:.6f}", *("" if np.isnan(value) else f"{value:.7f}" for value in row)])
        for i, row in enumerate(table)
    ]
    return "\n".join([*head, *rows]) + "\n"
