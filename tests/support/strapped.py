"""Single sensors strapped to the skier of a full capture: their readings of the same run, and the truth."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.spatial.transform import Rotation, RotationSpline

from sssi_exudyn.core.frames import BODY_FROM_BVH, GRAVITY, Array, level_to_enu, slope_to_enu
from sssi_exudyn.core.rotations import lowpass
from sssi_exudyn.recording.instruments.bvh import joint_positions, world_rotations
from sssi_exudyn.recording.recording import Recording

JOINT = {"left_ski": "LeftFoot", "right_ski": "RightFoot", "chest": "Spine2", "pocket": "RightUpLeg"}
LAG = 1.5
FIXES_PER_SECOND = 5.0


@dataclass(frozen=True)
class Strapped:
    """A sensor's channels, and its mounting (3, 3) segment → sensor."""

    place: str
    time: Array
    rate: Array
    force: Array
    mounting: Array


def _to_enu(recording: Recording) -> Array:
    return level_to_enu(recording.heading.value) @ BODY_FROM_BVH


def strapped(recording: Recording, place: str, seed: int) -> Strapped:
    """Return a sensor with a random mounting, a gyroscope's bias (0.5 °/s) and noise of both channels."""
    rng = np.random.default_rng(seed)
    bvh, gps = recording.bvh, recording.gps
    assert gps is not None
    world = world_rotations(bvh)
    to_enu, joint, carrier = _to_enu(recording), bvh.index(JOINT[place]), bvh.index(gps.segment)
    places = joint_positions(bvh, world)
    time, rate = bvh.time, 1.0 / float(bvh.time[1] - bvh.time[0])
    antenna = np.column_stack([np.interp(time, gps.time, column) for column in gps.enu.T])
    arm = (places[:, joint] - places[:, carrier] - world[:, carrier] @ gps.offset) @ to_enu.T
    path = lowpass(antenna, rate, 1.2) + lowpass(arm, rate, 6.0)  # differentiated, noise of fixes would dominate
    acceleration = np.gradient(np.gradient(path, time, axis=0), time, axis=0)
    turned = Rotation.from_matrix(to_enu @ world[:, joint] @ BODY_FROM_BVH.T)
    mounting = Rotation.random(random_state=seed)
    spin = mounting.apply(RotationSpline(time, turned)(time, 1))
    force = mounting.apply(turned.inv().apply(acceleration + [0.0, 0.0, GRAVITY]))
    bias = np.radians(0.5) * rng.standard_normal(3)
    return Strapped(
        place,
        time,
        spin + bias + rng.normal(0.0, 0.005, spin.shape),
        force + rng.normal(0.0, 0.3, force.shape),
        mounting.as_matrix(),
    )


def truth(recording: Recording, joint: str, time: Array) -> tuple[Array, Array]:
    """Return heading and roll (n,) rad of a joint's segment in the slope frame at ``time`` (n,) s.

    Left and right are positive.
    """
    to_slope = slope_to_enu(recording.slope.inclination, recording.slope.fall_line_azimuth).T @ _to_enu(recording)
    turned = to_slope @ world_rotations(recording.bvh)[:, recording.bvh.index(joint)] @ BODY_FROM_BVH.T
    heading = np.unwrap(np.arctan2(turned[:, 1, 0], turned[:, 0, 0]))
    roll = np.arcsin(turned[:, 2, 1])
    return np.interp(time, recording.bvh.time, heading), np.interp(time, recording.bvh.time, roll)


def write_few(recording: Recording, places: tuple[str, ...], folder: Path) -> Path:
    """Write a recording's folder with those sensors instead of its capture, and fixes 5 times a second that lag."""
    (folder / "sensors").mkdir(parents=True)
    tables = []
    for seed, place in enumerate(places):
        one = strapped(recording, place, seed)
        axes = [
            f"{kind}_{axis}_{unit}" for kind, unit in (("rate", "radps"), ("acceleration", "mps2")) for axis in "xyz"
        ]
        table = pd.DataFrame(np.hstack([one.time[:, None], one.rate, one.force]), columns=["time_s", *axes])
        table.to_csv(folder / "sensors" / f"{place}.csv", index=False)
        tables.append(f'[[sensors]]\nfile = "sensors/{place}.csv"\non = "{place}"\n')
    fixes = pd.read_csv(recording.folder / "gps.csv")
    fixes = fixes.iloc[:: max(1, round(1.0 / FIXES_PER_SECOND / float(fixes.time_s.diff().median())))]
    fixes.assign(time_s=fixes.time_s + LAG).to_csv(folder / "gps.csv", index=False)
    old = (recording.folder / "recording.toml").read_text(encoding="utf-8")
    head, rest = old.split("[motion]")
    gps = "[gps]" + rest.split("[gps]")[1].split("[insoles]")[0]
    (folder / "recording.toml").write_text(head + "\n".join(tables) + "\n" + gps, encoding="utf-8")
    return folder
