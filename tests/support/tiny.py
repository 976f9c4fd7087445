"""A small recording with a known answer: a rigid, leaning skier who swings down a plane on carving skis.

Skis point where the skier goes, the body leans along the acceleration and stands on the plane, and every joint trembles
a little.  So slope, heading and all sums are known.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pymap3d
from scipy.spatial.transform import Rotation

from sssi_exudyn.core.frames import GRAVITY, Array, slope_to_enu
from sssi_exudyn.importing.answers import Answers

INCLINATION_DEG, AZIMUTH_DEG, HEADING_DEG = 16.0, 70.0, 25.0
ORIGIN = (46.8, 9.8, 2000.0)
DURATION = 8.0
ANKLE_TO_SKI_BASE = 0.13
SPINE2 = 0.08 + 0.17 + 0.12
LEG = 0.40 + 0.40
OFFSET = np.array([0.0, 0.1, -0.16])
ANSWERS = Answers(
    mass_kg=70.0,
    height_m=1.65,
    sex="male",
    skis="slalom_165",
    ski_mass_kg=2.4,
    boot_mass_kg=1.9,
    ankle_to_ski_base_m=0.13,
    boot_centre_m=0.0,
    slope_deg=INCLINATION_DEG,
    fall_line_deg=AZIMUTH_DEG,
    heading_deg=HEADING_DEG,
    antenna_joint="Spine2",
    antenna_offset_m=(float(OFFSET[0]), float(OFFSET[1]), float(OFFSET[2])),
    gps_sigma_m=0.02,
)
"""Answers that an import of its files needs."""

# name, parent, OFFSET in cm: a skier of 1.65 m
SKELETON: tuple[tuple[str, str, tuple[float, float, float]], ...] = (
    ("Hips", "", (0.0, 91.0, 0.0)),
    ("RightUpLeg", "Hips", (-9.0, 0.0, 0.0)),
    ("RightLeg", "RightUpLeg", (0.0, -40.0, 0.0)),
    ("RightFoot", "RightLeg", (0.0, -40.0, 0.0)),
    ("LeftUpLeg", "Hips", (9.0, 0.0, 0.0)),
    ("LeftLeg", "LeftUpLeg", (0.0, -40.0, 0.0)),
    ("LeftFoot", "LeftLeg", (0.0, -40.0, 0.0)),
    ("Spine", "Hips", (0.0, 8.0, 0.0)),
    ("Spine1", "Spine", (0.0, 17.0, 0.0)),
    ("Spine2", "Spine1", (0.0, 12.0, 0.0)),
    ("Neck", "Spine2", (0.0, 17.0, 0.0)),
    ("Neck1", "Neck", (0.0, 4.5, 0.0)),
    ("Head", "Neck1", (0.0, 4.5, 0.0)),
    ("RightShoulder", "Spine2", (-2.6, 12.0, 0.0)),
    ("RightArm", "RightShoulder", (-12.6, 0.0, 0.0)),
    ("RightForeArm", "RightArm", (-25.0, 0.0, 0.0)),
    ("RightHand", "RightForeArm", (-25.0, 0.0, 0.0)),
    ("LeftShoulder", "Spine2", (2.6, 12.0, 0.0)),
    ("LeftArm", "LeftShoulder", (12.6, 0.0, 0.0)),
    ("LeftForeArm", "LeftArm", (25.0, 0.0, 0.0)),
    ("LeftHand", "LeftForeArm", (25.0, 0.0, 0.0)),
)

TOML = f"""format = 1
name = "tiny"

[skier]
mass_kg = 70.0
height_m = 1.65
sex = "male"

[equipment]
skis = "slalom_165"
ski_mass_kg = 2.4
boot_mass_kg = 1.9
ankle_to_ski_base_m = {ANKLE_TO_SKI_BASE}
boot_centre_m = 0.0

[slope]
inclination_deg = {INCLINATION_DEG}
fall_line_azimuth_deg = {AZIMUTH_DEG}

[motion]
file = "motion.bvh"
heading_deg = {HEADING_DEG}

[gps]
file = "gps.csv"
segment = "Spine2"
offset_m = [0.0, 0.1, -0.16]
sigma_m = 0.02

[insoles]
file = "insoles.csv"
"""

Columns = dict[str, Array]


@dataclass
class Tiny:
    """The parts of a recording, which a test may change one by one before they are written."""

    toml: str = TOML
    skeleton: tuple[tuple[str, str, tuple[float, float, float]], ...] = SKELETON
    rotations: Columns = field(default_factory=lambda: motion()[0])
    gps: Columns = field(default_factory=lambda: motion()[1])
    insoles: Columns = field(default_factory=lambda: loads(4))
    frame_time: float = 1.0 / 60.0

    def write(self, folder: Path) -> Path:
        """Write all files and return the folder."""
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "recording.toml").write_text(self.toml, encoding="utf-8")
        (folder / "motion.bvh").write_text(self.bvh(), encoding="utf-8")
        (folder / "gps.csv").write_text(csv(self.gps), encoding="utf-8")
        (folder / "insoles.csv").write_text(csv(self.insoles), encoding="utf-8")
        return folder

    def bvh(self) -> str:
        """Return the motion as BVH text: three rotation channels per joint, in degrees, Y X Z."""
        frames = len(self.rotations["Hips"])
        columns = [np.zeros((frames, 3))] + [self.rotations[name] for name, _, _ in self.skeleton]
        table = np.hstack(columns)
        form = " ".join(["%.5f"] * table.shape[1])  # of a row: ten thousands of values
        rows = "\n".join(form % tuple(row) for row in table.tolist())
        header = f"MOTION\nFrames: {frames}\nFrame Time: {self.frame_time:.8f}\n"
        return "HIERARCHY\n" + self._joint("") + header + rows + "\n"

    def _joint(self, parent: str) -> str:
        text = ""
        for name, above, (x, y, z) in self.skeleton:
            if above == parent:
                kind = "JOINT" if parent else "ROOT"
                places = "" if parent else "Xposition Yposition Zposition "
                count = 3 if parent else 6
                inner = self._joint(name) or "End Site\n{\nOFFSET 0.0 5.0 0.0\n}\n"
                text += f"{kind} {name}\n{{\nOFFSET {x} {y} {z}\n"
                text += f"CHANNELS {count} {places}Yrotation Xrotation Zrotation\n{inner}}}\n"
        return text


def csv(columns: Columns) -> str:
    """Return columns as CSV text: degrees to a tenth of a millimetre, the rest to 0.1 mm or 0.1 mN."""
    names = list(columns)
    rows = np.column_stack([columns[name] for name in names])
    form = ",".join("%.9f" if name.startswith(("lat", "lon")) else "%.4f" for name in names)
    lines = [form % tuple(row) for row in rows.tolist()]
    return ",".join(names) + "\n" + "\n".join(lines) + "\n"


def motion(noise: float = 0.01, seed: int = 1, swing: float = 1.5) -> tuple[Columns, Columns]:
    """Return BVH angles (n, 3) deg by joint in the order Y X Z, and GPS columns, of one run.

    Its turns are ±``swing`` m wide.
    """
    random = np.random.default_rng(seed)
    clock = np.arange(0.0, DURATION + 1e-9, 1.0 / 60.0)
    yaw, pitch, roll = _attitude(clock, swing)[1:]
    rotations = {
        name: 0.1 * np.sin(clock[:, None] * random.uniform(2.0, 9.0, 3) + random.uniform(0.0, 6.0, 3))
        for name, _, _ in SKELETON
    }
    rotations["Hips"] = np.rad2deg(np.column_stack([yaw, pitch, roll]))
    fixes = np.arange(0.0, DURATION + 1e-9, 0.1)
    base, yaw, pitch, roll = _attitude(fixes, swing)
    body = Rotation.from_euler("YXZ", np.column_stack([yaw, pitch, roll]))
    above = body.apply(np.array([0.0, ANKLE_TO_SKI_BASE + LEG + SPINE2, 0.0]) + OFFSET)
    heading = np.deg2rad(HEADING_DEG)
    forward, left = above[:, 2], above[:, 0]
    east = forward * np.sin(heading) - left * np.cos(heading)
    north = forward * np.cos(heading) + left * np.sin(heading)
    antenna = base + np.column_stack([east, north, above[:, 1]]) + noise * random.standard_normal((len(fixes), 3))
    lat, lon, alt = pymap3d.enu2geodetic(*antenna.T, *ORIGIN)
    return rotations, {"time_s": fixes, "latitude_deg": lat, "longitude_deg": lon, "altitude_m": alt}


def loads(cells: int, seed: int = 2) -> Columns:
    """Return insole columns of a skier of 70 kg whose weight swings from foot to foot."""
    random = np.random.default_rng(seed)
    clock = np.arange(0.0, DURATION + 1e-9, 0.02)
    share = 0.5 + 0.3 * np.sin(2.0 * np.pi * clock / 4.0)
    columns = {"time_s": clock}
    for foot, weight in (("left", share), ("right", 1.0 - share)):
        for cell in range(1, cells + 1):
            force = 70.0 * GRAVITY * weight / cells
            columns[f"{foot}_{cell}_N"] = force + random.standard_normal(len(clock))
    return columns


def _attitude(time: Array, swing: float) -> tuple[Array, Array, Array, Array]:
    """Return the ski base (n, 3) m east-north-up, and the body's yaw, pitch, roll about the BVH's y, x, z (rad)."""
    omega, speed = 2.0 * np.pi / 4.0, 8.0
    to_enu = slope_to_enu(np.deg2rad(INCLINATION_DEG), np.deg2rad(AZIMUTH_DEG))
    plane = np.column_stack([speed * time, swing * np.sin(omega * time), np.zeros_like(time)])
    velocity = np.column_stack([np.full_like(time, speed), swing * omega * np.cos(omega * time), np.zeros_like(time)])
    pull = np.column_stack([np.zeros_like(time), -swing * omega**2 * np.sin(omega * time), np.zeros_like(time)])
    base, velocity, pull = plane @ to_enu.T, velocity @ to_enu.T, pull @ to_enu.T
    azimuth = np.arctan2(velocity[:, 0], velocity[:, 1])
    right = np.column_stack([np.cos(azimuth), -np.sin(azimuth)])
    roll = np.arctan2(np.sum(pull[:, :2] * right, axis=1), GRAVITY + pull[:, 2])
    return base, np.deg2rad(HEADING_DEG) - azimuth, np.deg2rad(2.0 + np.sin(3.0 * time)), roll
