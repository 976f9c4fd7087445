"""Makes ``bodies/muscles/muscles.toml`` from the full-body lumbar spine model (Raabe & Chaudhari 2016).

    python docs/make_muscle_table.py FBLSmodel.osim > bodies/muscles/muscles.toml

It reads the right side: 23 muscles of the leg that the paper's skier has, the leg's other 19, and the 119 that cross
the lumbar joint; the left side is its mirror image.  It writes figures in the axes of this program's segments
(x forward, y left, z up) and reports, on stderr, how far the model's own left side is from that image.
"""

import sys
from collections.abc import Iterable
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from sssi_exudyn.bodies.muscles.osim import read_osim
from sssi_exudyn.bodies.muscles.paths import Muscle, MuscleModel
from sssi_exudyn.core.frames import Array

AXES = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
"""The model's x forward, y up, z right → x forward, y left, z up."""
MIRROR = np.array([1.0, 1.0, -1.0])
LEG = {
    "gluteus_maximus": ("glut_max1", "glut_max2", "glut_max3"),
    "gluteus_medius": ("glut_med1", "glut_med2", "glut_med3"),
    "hip_abductors": ("glut_min1", "glut_min2", "glut_min3", "tfl"),
    "psoas_major": ("iliacus",),
    "quadriceps_femoris": ("rect_fem", "vas_med", "vas_int", "vas_lat"),
    "hamstrings": ("semimem", "semiten", "bifemlh", "bifemsh"),
    "triceps_surae": ("med_gas", "lat_gas", "soleus"),
    "tibialis_anterior": ("tib_ant",),
}
OTHERS_OF_LEG = {
    "hip_adductors": ("add_long", "add_brev", "add_mag1", "add_mag2", "add_mag3", "pect", "grac"),
    "sartorius": ("sar",),
    "deep_hip_rotators": ("quad_fem", "gem", "peri"),
    "deep_calf": ("tib_post", "flex_dig", "flex_hal"),
    "peroneals": ("per_brev", "per_long", "per_tert"),
    "toe_extensors": ("ext_dig", "ext_hal"),
}
LUMBAR = {
    "erector_spinae": ("IL_", "LTp"),
    "rectus_abdominis": ("rect_abd",),
    "external_obliques": ("EO",),
    "internal_obliques": ("IO",),
    "multifidus": ("MF_",),
    "quadratus_lumborum": ("QL_",),
    "psoas_major": ("Ps_",),
    "latissimus_dorsi": ("LD_",),
}
BONES = {"lumbar5": "L5", "lumbar4": "L4", "lumbar3": "L3", "lumbar2": "L2", "lumbar1": "L1", "sacrum": "pelvis"}
BONES |= {"Abdomen": "abdomen", "LB_wrap": "back"} | {f"{name}_r": name for name in ("femur", "patella", "tibia")}
BONES |= {"calcn_r": "calcn", "toes_r": "calcn", "humerus_r": "humerus", "pelvis": "pelvis", "torso": "torso"}
LUMBAR_ROTATIONS = ("flex_extension", "lat_bending", "axial_rotation")
HEADER = """\
# The skier's 322 muscles: of each leg the 23 that the paper's skier has and the other 19, and 238 that cross the lumbar
# joint.  Made by docs/make_muscle_table.py; only the right side is written, the left is its mirror image.
#
# Figures: M. E. Raabe & A. M. W. Chaudhari, "An investigation of jogging biomechanics using the full-body lumbar spine
# model: model development and validation", J. Biomech. 49 (2016) 1238-1243, as the model's file has them.  It has
# taken them
#   legs    from S. L. Delp et al., IEEE Trans. Biomed. Eng. 37 (1990) 757-767, with the greatest forces of OpenSim's
#           gait2392, some of them half as large again; the knee and the patella from G. T. Yamaguchi & F. E. Zajac,
#           J. Biomech. 22 (1989) 1-10, and E. M. Arnold et al., Ann. Biomed. Eng. 38 (2010) 269-279
#           Paths, fibres, tendons and pennation of the 19 are, number by number, those of gait2392 as OpenSim gives it
#           (D. G. Thelen, A. Seth, F. C. Anderson & S. L. Delp; Creative Commons Attribution 3.0)
#   trunk   from M. Christophy et al., Biomech. Model. Mechanobiol. 11 (2012) 19-34, and what that cites; so do the
#           shares of the lumbar rotations
#
# Axes of every frame: x forward, y left, z up in anatomical zero.  Lengths in m, forces in N, angles in rad.
#   pelvis            from the middle of the hip joint centres
#   femur, humerus    from their joints; tibia from where the knee is when it is straight; calcn from the ankle,
#                     the toes with it, which do not move in a boot
#   patella           its own frame, which glides on the femur with the knee
#   L5 ... L1, torso  their own frames, which stand upright in anatomical zero
#   abdomen, back     that carry points and surfaces in front of and behind the lumbar spine, and turn with it
# A path is a list of points [bone, x, y, z]; with [coordinate, least, greatest] after it, the path takes the point only
# then.  Angles are those of the chain: a bent knee's is positive.
"""


def number(value: float) -> str:
    """Format with seven digits, more than the model's."""
    return f"{float(value) + 0.0:.7g}" if value else "0.0"


def numbers(values: Iterable[float]) -> str:
    return "[" + ", ".join(word if "." in word or "e" in word else word + ".0" for word in map(number, values)) + "]"


def source_of_points(model: MuscleModel) -> dict[str, Array]:
    """Return offsets of points of some bones: sacrum, calcaneus and toes are given from the pelvis and the ankle."""
    bone = {item.name: item for item in model.bones.bones}
    hips = 0.5 * (bone["femur_r"].place + bone["femur_l"].place)
    heel = bone["calcn_r"].place
    return {
        "pelvis": -hips,
        "sacrum": bone["sacrum"].place - hips,
        "calcn_r": heel,
        "toes_r": heel + bone["toes_r"].place,
    }


def share(model: MuscleModel, name: str, turn: int, coordinate: str) -> float:
    """Return how much a bone turns about its ``turn``-th axis a unit of a lumbar rotation: the mean over ±0.3 rad."""
    tree = model.bones
    drive = tree.bones[tree.index(name)].turns[turn]
    if drive.coordinate is None:
        return 0.0
    q = np.zeros((2, len(tree.coordinates)))
    q[:, tree.coordinates.index(coordinate)] = -0.3, 0.3
    completed, _ = tree.complete(q)
    low, high = drive.curve(completed[:, tree.coordinates.index(drive.coordinate)])[0]
    return float(high - low) / 0.6


def slides(model: MuscleModel, name: str, coordinate: str) -> Array:
    """Return the slide (3,) m of a bone in its parent a unit of a coordinate, in the model's axes."""
    tree = model.bones
    q = np.zeros((2, len(tree.coordinates)))
    q[:, tree.coordinates.index(coordinate)] = -0.3, 0.3
    completed, _ = tree.complete(q)
    moved = np.zeros(3)
    for drive in tree.bones[tree.index(name)].slides:
        if drive.coordinate is not None:
            low, high = drive.curve(completed[:, tree.coordinates.index(drive.coordinate)])[0]
            moved += (high - low) / 0.6 * drive.axis
    return moved


def spline(x: Array, y: Array) -> str:
    return f"{{ x = {numbers(x)}, y = {numbers(y)} }}"


def knots(model: MuscleModel, name: str, kind: str, index: int, sign: float) -> str:
    """Return a spline of a drive by its knots, over the flexion of the knee."""
    bone = model.bones.bones[model.bones.index(name)]
    drive = (bone.turns if kind == "turn" else bone.slides)[index]
    x = drive.curve.knots
    y = drive.curve(x)[0]
    flexion = x if drive.coordinate == "knee_angle_r_beta" else -x  # beta counts flexion positive
    order = np.argsort(flexion)
    return spline(flexion[order], sign * y[order])


def print_bones(model: MuscleModel) -> None:
    bone = {item.name: item for item in model.bones.bones}
    hips = 0.5 * (bone["femur_r"].place + bone["femur_l"].place)
    slide = [drive.curve(np.zeros(1))[0][0] * drive.axis for drive in bone["tibia_r"].slides]
    knee = np.sum(slide, axis=0)
    # upright, all frames of the trunk are parallel: places add up
    place, at = {}, bone["sacrum"].place - hips
    for name in ("lumbar5", "lumbar4", "lumbar3", "lumbar2", "lumbar1", "torso"):
        at = at + bone[name].place - bone[name].end_place
        place[name] = at
    print("# Lengths of the model that the figures belong to; each segment's are scaled by the skier's.")
    print("[reference]")
    print(f"hip_from_middle = {number(bone['femur_r'].place[2])}")
    print(f"knee_from_hip = {numbers(AXES @ knee)}")
    print(f"ankle_from_knee = {numbers(AXES @ bone['talus_r'].place)}")
    print(f"toes_from_ankle = {numbers(AXES @ (bone['calcn_r'].place + bone['toes_r'].place))}")
    shoulder = place["torso"] + bone["humerus_r"].place * [1.0, 1.0, 0.0]
    print(f"shoulders_from_hips = {numbers(AXES @ shoulder)}")
    print(f"elbow_from_shoulder = {numbers(AXES @ bone['ulna_r'].place)}")
    print("\n# How the tibia slides on the femur, and where the patella is on it, over the flexion of the knee: cubic")
    print(
        "# splines through x (rad) and y (m, the turn about the left axis in rad); the ends of the patella's ligament."
    )
    print("[knee]")
    # the model turns about its right axis, this program about the left one
    print(f"tibia_x = {knots(model, 'tibia_r', 'slide', 0, 1.0)}")
    print(f"tibia_z = {knots(model, 'tibia_r', 'slide', 1, 1.0)}")
    print(f"patella_x = {knots(model, 'patella_r', 'slide', 0, 1.0)}")
    print(f"patella_z = {knots(model, 'patella_r', 'slide', 1, 1.0)}")
    print(f"patella_turn = {knots(model, 'patella_r', 'turn', 0, -1.0)}")
    ligament = next(muscle for muscle in model.muscles if muscle.name == "patlig_r")
    ends = {BONES[point.bone]: numbers(AXES @ point.place) for point in ligament.points}
    print(f"ligament = {{ tibia = {ends['tibia']}, patella = {ends['patella']} }}")
    print(
        "\n# The lumbar joint: place of each vertebra's joint from the one below it (L5's from the middle of the hips),"
    )
    print(
        "# the vertebra's origin from its joint, and its shares of extension, bending and rotation to the left, which"
    )
    print("# are divided by their sums so that together they are the skier's; torso: what is left for the last joint.")
    for name in place:
        before = AXES @ (bone[name].place + (bone["sacrum"].place - hips if name == "lumbar5" else 0.0))
        if name == "torso":
            shares = [0.0, 0.0, share(model, name, 0, "axial_rotation")]
        else:
            shares = [share(model, name, k, coordinate) for k, coordinate in enumerate(LUMBAR_ROTATIONS)]
        print(f"[lumbar.{BONES[name]}]")
        print(f"joint = {numbers(before)}")
        print(f"origin_from_joint = {numbers(AXES @ -bone[name].end_place)}")
        print(f"shares = {numbers(shares)}")
    print(
        "\n# Frames before and behind the spine: place from the middle of the hips, turn and slide with extension, of"
    )
    print("# the model's extension, not divided.")
    for name in ("Abdomen", "LB_wrap"):
        slid = AXES @ slides(model, name, "flex_extension")
        print(f"[lumbar.{BONES[name]}]")
        held = bone[name].place + bone["sacrum"].place - hips
        print(f"joint = {numbers(AXES @ held)}")
        print(f"origin_from_joint = {numbers(AXES @ -bone[name].end_place)}")
        print(f"turn = {number(share(model, name, 0, 'flex_extension'))}")
        print(f"slide = {numbers(slid)}")


def print_surfaces(model: MuscleModel, taken: list[Muscle]) -> None:
    print(
        "\n# Surfaces that paths are led around; attitude: rotation vector, surface's frame -> bone's; size: radius and"
    )
    print("# length of a cylinder about z, or half axes; side: where it is active.")
    used = {wrap.surface for muscle in taken for wrap in muscle.wraps}
    for surface in model.surfaces:
        if surface.name not in used:
            continue
        print("[[surface]]")
        print(f'name = "{surface.name.removesuffix("_r")}"')
        print(f'bone = "{BONES[surface.bone]}"')
        print(f'kind = "{surface.kind}"')
        print(f"place = {numbers(AXES @ surface.place)}")
        print(f"attitude = {numbers(Rotation.from_matrix(AXES @ surface.attitude).as_rotvec())}")
        print(f"size = {numbers(surface.size)}")
        print(
            f'side = "{"all" if surface.sign == 0.0 else ("+" if surface.sign > 0.0 else "-") + "xyz"[surface.axis]}"'
        )


def print_muscle(muscle: Muscle, region: str, group: str, shift: dict[str, Array]) -> None:
    print("[[muscle]]")
    print(f'name = "{muscle.name.removesuffix("_r")}"')
    print(f'region = "{region}"')
    print(f'group = "{group}"')
    print(f"max_isometric_force_N = {number(muscle.max_isometric_force)}")
    print(f"optimal_fibre_m = {number(muscle.optimal_fibre)}")
    print(f"tendon_slack_m = {number(muscle.tendon_slack)}")
    print(f"pennation_rad = {number(muscle.pennation)}")
    if muscle.wraps:
        (wrap,) = muscle.wraps
        print(f'surface = "{wrap.surface.removesuffix("_r")}"')
    print("path = [")
    for point in muscle.points:
        x, y, z = AXES @ (point.place + shift.get(point.bone, np.zeros(3)))
        words = [f'"{BONES[point.bone]}"', *numbers([x, y, z])[1:-1].split(", ")]
        if point.condition is not None:
            coordinate, low, high = point.condition
            name = coordinate.removesuffix("_r")
            if name == "knee_angle":  # the model's is negative in flexion
                low, high = -high, -low
            words += [f'"{name}"', *numbers([low, high])[1:-1].split(", ")]
        print(f"  [{', '.join(words)}],")
    print("]")


def compare_sides(muscles: dict[str, Muscle], names: list[str]) -> None:
    """Report how far the model's left side is from the right one's mirror image."""
    apart = {}
    for name in names:
        right, left = muscles[f"{name}_r"], muscles[f"{name}_l"]
        if {p.bone.removesuffix("_r") for p in right.points} == {p.bone.removesuffix("_l") for p in left.points}:
            apart[name] = max(
                float(np.max(np.abs(p.place - MIRROR * q.place)))
                for p, q in zip(right.points, left.points, strict=True)
            )
        else:
            sys.stderr.write(f"{name}: the left side takes other bones\n")
    worst = sorted(apart, key=lambda name: -apart[name])[:5]
    differ = sum(distance > 1e-4 for distance in apart.values())
    sys.stderr.write(f"{differ} of {len(apart)} paths differ by more than 0.1 mm from their mirror image; most: ")
    sys.stderr.write(", ".join(f"{name} {1e3 * apart[name]:.1f} mm" for name in worst) + "\n")


def chosen(muscles: dict[str, Muscle]) -> list[tuple[Muscle, str, str]]:
    """Return the right side's muscles that the skier has, each with region and group."""
    of_leg = LEG | OTHERS_OF_LEG
    muscles_of_skier = [(muscles[f"{name}_r"], "leg", group) for group, names in of_leg.items() for name in names]
    for group, starts in LUMBAR.items():
        for name, muscle in muscles.items():
            if name.endswith("_r") and name.startswith(starts):
                muscles_of_skier.append((muscle, "lumbar", group))
    return muscles_of_skier


def main() -> None:
    model = read_osim(Path(sys.argv[1]))
    muscles = {muscle.name: muscle for muscle in model.muscles}
    taken = chosen(muscles)
    print(HEADER)
    print_bones(model)
    print_surfaces(model, [muscle for muscle, _, _ in taken])
    print()
    shift = source_of_points(model)
    for muscle, region, group in taken:
        print_muscle(muscle, region, group, shift)
    compare_sides(muscles, [muscle.name.removesuffix("_r") for muscle, _, _ in taken])


if __name__ == "__main__":
    main()
