"""A skier who swings every joint, as coordinates of the chain and as OpenSim's ``.mot``."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from sssi_exudyn.bodies.skier.chain import COORDINATES, PRESCRIBED
from sssi_exudyn.core.frames import Array
from sssi_exudyn.io.storage import GROUND_FROM_LEVEL, Storage, storage_text

RATE, COUNT, HEIGHT = 60.0, 120, 1.75
KNEES = ("knee_angle_r", "knee_angle_l")


def chain_coordinates(seed: int = 5) -> Array:
    """Return coordinates (COUNT, 31) rad: every angle swings by 0.3 about a bent stance."""
    rng = np.random.default_rng(seed)
    time = np.arange(COUNT)[:, None] / RATE
    q = 0.3 * np.sin(rng.uniform(2.0, 4.0, len(COORDINATES)) * time + rng.uniform(0.0, 6.0, len(COORDINATES)))
    q[:, [COORDINATES.index(name) for name in KNEES]] += 0.9
    q[:, [COORDINATES.index(f"elbow_flex_{side}") for side in "rl"]] += 1.2
    return q


def mot(q: Array, *, degrees: bool = True, extends: bool = False, without: tuple[str, ...] = ()) -> str:
    """Return the text of the coordinates, the pelvis about z, x, y of OpenSim's ground."""
    columns = {name: q[:, COORDINATES.index(name)] for name in PRESCRIBED}
    turned = Rotation.from_euler(
        "ZXY", np.column_stack([columns["pelvis_rotation"], columns["pelvis_list"], -columns["pelvis_tilt"]])
    ).as_matrix()
    ground = Rotation.from_matrix(GROUND_FROM_LEVEL @ turned @ GROUND_FROM_LEVEL.T).as_euler("ZXY").T
    columns |= dict(zip(("pelvis_tilt", "pelvis_list", "pelvis_rotation"), ground, strict=True))
    if extends:
        columns |= {name: -columns[name] for name in KNEES}
    kept = {name: np.rad2deg(column) if degrees else column for name, column in columns.items() if name not in without}
    table = np.column_stack([np.arange(COUNT) / RATE, *kept.values()])
    return storage_text(Storage("run", ("time", *kept), table, degrees))
