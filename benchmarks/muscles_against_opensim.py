"""Muscle lengths and moment arms compared with OpenSim's own.

    python benchmarks/muscles_against_opensim.py MODEL.osim …     the reader, in random postures
    python benchmarks/muscles_against_opensim.py --skier FBLSmodel.osim   the skier's table, over the range of motion

It needs OpenSim's Python package (``pip install opensim``), which the program itself does not.
"""

import sys
from pathlib import Path

import numpy as np
import opensim

from sssi_exudyn.bodies.muscles.muscles import muscles_table, own_geometry, skier_muscles
from sssi_exudyn.bodies.muscles.osim import read_osim
from sssi_exudyn.bodies.muscles.paths import muscle_paths
from sssi_exudyn.bodies.skier.chain import PRESCRIBED
from sssi_exudyn.core.frames import Array

POSTURES = 12
STEPS = 21
MUSCLED = ("hip", "knee", "ankle", "lumbar", "flex_ext", "lat_bend", "axial", "L5_S1")
RANGES = {  # of the chain's coordinate (degrees), the model's name, the model's unit in ours
    "hip_flexion_r": (-30, 110, "hip_flexion_r", 1.0),
    "hip_adduction_r": (-40, 20, "hip_adduction_r", 1.0),
    "hip_rotation_r": (-30, 30, "hip_rotation_r", 1.0),
    "knee_angle_r": (0, 110, "knee_angle_r", -1.0),
    "ankle_angle_r": (-30, 30, "ankle_angle_r", 1.0),
    "lumbar_extension": (-50, 10, "flex_extension", 1.0 / 0.934345),  # a unit turns the torso by less than one
    "lumbar_bending": (-25, 25, "lat_bending", 1.0),
    "lumbar_rotation": (-10, 10, "axial_rotation", 1.0 / 0.381723),
}


def reference(path: str, names: tuple[str, ...], q: Array, wanted: list[str]) -> tuple[list[str], Array, Array]:
    """Return OpenSim's muscle names, lengths (n, m) and moment arms (n, m, k) at coordinates ``q`` (n, c)."""
    opensim.Logger.setLevelString("Error")
    model = opensim.Model(path)
    state = model.initSystem()
    coordinates = [model.getCoordinateSet().get(name) for name in names]
    for coordinate in coordinates:
        coordinate.setLocked(state, False)
    about = [model.getCoordinateSet().get(name) for name in wanted]
    muscles = [model.getMuscles().get(i) for i in range(model.getMuscles().getSize())]
    lengths, arms = np.empty((len(q), len(muscles))), np.empty((len(q), len(muscles), len(wanted)))
    for i, row in enumerate(q):
        for coordinate, value in zip(coordinates, row, strict=True):
            coordinate.setValue(state, float(value), False)
        model.assemble(state)
        model.realizePosition(state)
        for k, muscle in enumerate(muscles):
            lengths[i, k] = muscle.getGeometryPath().getLength(state)
            arms[i, k] = [muscle.computeMomentArm(state, coordinate) for coordinate in about]
    return [muscle.getName() for muscle in muscles], lengths, arms


def compare_reader(path: str) -> None:
    model = read_osim(Path(path))
    names = model.bones.coordinates
    dependent = {coupling.dependent for coupling in model.bones.couplings}
    wanted = [n for n in names if n.startswith(MUSCLED) and n not in dependent and not n.endswith("beta")]
    rng = np.random.default_rng(1)
    q = np.tile(model.defaults, (POSTURES, 1))
    flexes = -1.0 if model.name == "RaabeFullBody" else 1.0
    for j, name in enumerate(names):
        if name.startswith("knee"):
            q[:, j] = flexes * rng.uniform(0.05, 1.6, POSTURES)
        elif name.startswith("hip_flexion"):
            q[:, j] = rng.uniform(-0.2, 1.4, POSTURES)
        elif name in wanted:
            q[:, j] = rng.uniform(-0.25, 0.25, POSTURES)
    paths = muscle_paths(model, q, wanted)
    theirs, lengths, arms = reference(path, names, q, wanted)
    order = [theirs.index(muscle.name) for muscle in model.muscles]
    length_error, arm_error = (
        np.abs(paths.length - lengths[:, order]).max(axis=0),
        np.abs(paths.moment_arm - arms[:, order]).max(axis=(0, 2)),
    )
    kinds = {surface.name: surface.kind for surface in model.surfaces}
    print(f"\n{model.name}: {len(model.muscles)} muscles, {POSTURES} postures, {len(wanted)} coordinates (mm)\n")
    print("| paths | muscles | length: median of the muscles' largest errors, largest | moment arm: the same |")
    print("|---|---|---|---|")
    for title in ("straight", "one cylinder", "two and more", "ellipsoid"):
        of = [k for k, muscle in enumerate(model.muscles) if title == _title([kinds[w.surface] for w in muscle.wraps])]
        if of:
            figures = [
                f"{1e3 * np.median(error[of]):.4f}, {1e3 * error[of].max():.3f}" for error in (length_error, arm_error)
            ]
            print(f"| {title} | {len(of)} | {figures[0]} | {figures[1]} |")


def _title(kinds: list[str]) -> str:
    if not kinds:
        return "straight"
    return "ellipsoid" if "ellipsoid" in kinds else "one cylinder" if len(kinds) == 1 else "two and more"


def compare_skier(path: str) -> None:
    model, skier = read_osim(Path(path)), skier_muscles(own_geometry())
    q = np.zeros((len(RANGES) * STEPS, len(PRESCRIBED)))
    theirs = np.tile(model.defaults, (len(q), 1))
    for i, (name, (low, high, other, factor)) in enumerate(RANGES.items()):
        rows = slice(i * STEPS, (i + 1) * STEPS)
        angles = np.radians(np.linspace(low, high, STEPS))
        q[rows, PRESCRIBED.index(name)] = angles
        theirs[rows, model.bones.coordinates.index(other)] = angles * factor
    paths = muscle_paths(skier.model, q, list(RANGES))
    names, _, arms = reference(
        path, model.bones.coordinates, theirs, [model_name for _, _, model_name, _ in RANGES.values()]
    )
    rows_of = muscles_table()
    right = [k for k, row in enumerate(rows_of) if row["side"] == "right"]
    order = [names.index(str(rows_of[k]["name"])) for k in right]
    back = [row["group"] == "latissimus_dorsi" for row in rows_of]
    print(f"\nThe skier's muscles against {model.name}, right side, {STEPS} angles a coordinate (mm)\n")
    print(
        "| coordinate | muscles that turn it | moment arms from … to | median of the largest errors | largest | whose |"
    )
    print("|---|---|---|---|---|---|")
    for i, (name, (_, _, _, factor)) in enumerate(RANGES.items()):
        rows = slice(i * STEPS, (i + 1) * STEPS)
        ours, reference_arms = paths.moment_arm[rows][:, right, i], arms[rows][:, order, i] * factor
        turning = np.abs(reference_arms).max(axis=0) > 1e-4
        error = np.abs(ours - reference_arms).max(axis=0)
        worst = int(np.argmax(error))
        others = max((e for e, k in zip(error, right, strict=True) if not back[k]), default=0.0)
        largest = f"{1e3 * error[worst]:.2f} ({1e3 * others:.2f} without latissimus)"
        print(
            f"| {name} | {turning.sum()} | {1e3 * reference_arms.min():.0f} … {1e3 * reference_arms.max():.0f} | "
            f"{1e3 * np.median(error[turning]):.3f} | {largest} | "
            f"{rows_of[right[worst]]['name']} |"
        )


if __name__ == "__main__":
    if sys.argv[1] == "--skier":
        compare_skier(sys.argv[2])
    else:
        for file in sys.argv[1:]:
            compare_reader(file)
