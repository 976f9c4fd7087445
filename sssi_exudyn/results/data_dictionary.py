"""The meaning of every column of a result's tables: unit, frame and meaning, by the column's name.

The last part of a name is its unit: ``_m``, ``_mps`` (m/s), ``_N``, ``_Nm``, ``_J``, ``_deg``, ``_1`` (no unit).
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Final

from sssi_exudyn.bodies.skier.chain import PRESCRIBED, SEGMENTS, TRANSLATIONS
from sssi_exudyn.results.opensim_model import PELVIS, REVERSED
from sssi_exudyn.simulation.result import SIDES

SEASON: Final = "season.parquet"
SERIES, MEASURED, TURNS, SECOND_HALF, DRAWS = (
    "series.parquet",
    "measured.parquet",
    "turns.parquet",
    "second_half.parquet",
    "draws.parquet",
)
OPENSIM: Final = ("coordinates.mot", "joint_moments.sto", "snow_forces.mot")
ENU: Final = "east, north, up from the recording's origin"
"""Frame of the vectors of a series."""
SLOPE: Final = "slope: f down the fall line, l to the left, n along the slope's normal"
JOINT: Final = "joint"
GROUND: Final = "OpenSim's ground: x down the fall line's azimuth, y up, z to the right"
_AXES: Final = ("east", "north", "up")
_UNITS: Final = {
    "J_per_kg_m": "J/(kg m)",
    "Nm_per_kg": "N m/kg",
    "J_per_kg": "J/kg",
    "mps": "m/s",
    "Nm": "N m",
    "deg": "degree",
    "m": "m",
    "s": "s",
    "N": "N",
    "J": "J",
    "W": "W",
    "1": "1",
    "kg": "kg",
    "rad": "rad",
    "activation": "1",
    "band": "1",
    "bodyweights": "body weight",
    "C": "°C",
    "percent": "%",
    "share": "1",
}
"""Units by the end of a column's name, the longer ones first."""
JOINTS: Final[Mapping[str, str]] = {
    "pelvis_rotation": "turn of the pelvis to the left about gravity, from the fall line",
    "pelvis_list": "list of the pelvis to the right",
    "pelvis_tilt": "backward tilt of the pelvis",
    "hip_flexion": "flexion of the hip",
    "hip_adduction": "adduction of the hip",
    "hip_rotation": "internal rotation of the hip",
    "knee_angle": "flexion of the knee",
    "ankle_angle": "dorsiflexion of the ankle",
    "lumbar_extension": "extension of the lumbar joint",
    "lumbar_bending": "bending of the lumbar joint to the right",
    "lumbar_rotation": "rotation of the lumbar joint to the left",
    "arm_flex": "flexion of the shoulder",
    "arm_add": "adduction of the shoulder",
    "arm_rot": "internal rotation of the shoulder",
    "elbow_flex": "flexion of the elbow",
    "pro_sup": "pronation of the forearm",
    "wrist_flex": "flexion of the wrist towards the palm",
}
"""Positive direction of each prescribed coordinate, without its side."""
_ENERGY: Final[Mapping[str, str]] = {
    "posture": "work of the joints that move the skier",
    "contact": "work of the snow's normal forces",
    "friction": "work of friction",
    "skid": "work of friction and of the groove's walls where skis skid",
    "air": "work of the air",
    "body": "work of forces on the whole body, such as poles",
    "damping": "work of damping in the skis",
    "gravity": "work of gravity",
    "kinetic": "kinetic energy",
    "elastic": "elastic energy of skis and boots",
    "closure": "works less the change of kinetic and elastic energy; zero for an exact integration",
}
_VECTORS: Final[Mapping[str, tuple[str, str]]] = {
    "antenna": ("m", "place of the GPS antenna; empty where there is none"),
    "com": ("m", "centre of mass of skier, boots and skis"),
    "com_velocity": ("mps", "velocity of the centre of mass"),
    "pelvis": ("m", "place of the pelvis' origin"),
    "pelvis_velocity": ("mps", "velocity of the pelvis' origin"),
    "drag": ("N", "force of the air on the whole skier"),
}
_VECTORS_OF_A_SIDE: Final[Mapping[str, tuple[str, str]]] = {
    "friction": ("N", "friction on the {side} foot"),
    "foot": ("m", "place of the {side} foot: the running surface under the boot's centre"),
    "foot_velocity": ("mps", "velocity of the {side} foot's place"),
    "foot_forward": ("1", "unit vector forward along the {side} ski"),
    "snow_force": ("N", "whole force of the snow on the {side} ski"),
    "snow_normal": ("1", "unit normal of the snow under the {side} foot"),
    "pressure_centre": ("m", "centre of pressure of the {side} ski; the foot's place where it does not press"),
    "free_moment": ("Nm", "moment of the snow on the {side} ski about its centre of pressure"),
    "pole": ("N", "force of the {side} pole on the hand"),
}
_NUMBERS_OF_A_SIDE: Final[Mapping[str, tuple[str, str]]] = {
    "load_N": ("snow's normal", "sum of the snow's normal forces on the {side} ski"),
    "sole_N": ("sole", "force of the snow square to the {side} sole: what an insole feels"),
    "edge_angle_deg": ("ski", "angle between the base of the {side} ski and the snow about the ski's long axis"),
    "penetration_m": ("snow's normal", "depth of the deepest contact point of the {side} ski"),
    "tip_deflection_m": ("ski", "deflection of the {side} ski's tip from its unloaded shape, up is positive"),
    "tail_deflection_m": ("ski", "deflection of the {side} ski's tail from its unloaded shape, up is positive"),
    "ski_yaw_deg": ("foot", "turn of the {side} ski against the captured foot, to the left"),
    "ski_roll_deg": ("foot", "turn of the {side} ski against the captured foot, to the right edge"),
    "ski_heave_m": ("foot", "rise of the {side} ski against the captured foot"),
    "ski_pitch_deg": ("foot", "turn of the {side} ski against the captured foot, tip down"),
    "side_reserve_1": ("ski", "share of what the groove's wall bears along the {side} edge that is not used"),
    "ankle_edging_Nm": ("foot", "moment of the {side} shank on the foot about the foot's long axis forwards"),
    "cuff_flexion_Nm": (JOINT, "moment of the {side} boot's cuff on the ankle's dorsiflexion"),
    "cuff_edging_Nm": ("foot", "moment of the {side} boot's cuff on the foot about its long axis forwards"),
}
_OF_TURN: Final[Mapping[str, str]] = {
    "turn": "number of the turn, from 1",
    "side": "direction of the turn, left or right",
    "phase": "turn for the whole turn, or one of its thirds: initiation, control, completion",
    "complete": "whether both transitions of the turn are in the run",
    "start_s": "begin of the turn or phase",
    "end_s": "end of the turn or phase",
    "duration_s": "duration of the turn or phase",
    "mean_speed_mps": "mean speed of the centre of mass",
    "turn_radius_m": "radius of the path of the centre of mass; of few sensors, with the course that a sensor shows",
    "ski_angle_mean_deg": "mean angle between the skis, in the snow's plane",
    "steering_angle_mean_deg": "mean angle between a foot's direction of travel and its ski, both feet",
    "steering_angle_peak_deg": "largest angle between a foot's direction of travel and its ski",
    "inclination_mean_deg": "mean lean of the centre of mass into the turn, from the snow's normal",
    "inclination_peak_deg": "largest lean of the centre of mass into the turn",
    "com_inside_both_share": "share of the samples with the centre of mass inside of both skis",
    "com_inside_one_share": "share of the samples with the centre of mass inside of one ski",
    "outside_force_share": "mean share of the outside ski in the normal force",
    "outside_snow_force_share": "share of the outside ski in the snow's whole force",
    "snow_force_bodyweights": "mean of the snow's whole force on both skis over the skier's weight",
    "total_force_bodyweights": "mean normal force on both skis over the skier's weight",
    "total_force_peak_bodyweights": "largest normal force on both skis over the skier's weight",
    "lateral_ratio_p90": "90th percentile of the force across the path over the normal force",
    "drop_m": "drop of the centre of mass",
    "energy_lost_J_per_kg": "mechanical energy of the centre of mass that was lost, for a kilogram",
    "energy_lost_J_per_kg_m": "the same for a kilogram and a metre of drop",
    "effective_friction": "energy that the snow took over the normal force times the path of each ski",
    "air_share_of_losses": "share of the air in what snow and air took",
    "postural_shift_s": "time after the transition at which the hips' flexions cross",
    "postural_shift_percent": "the same in percent of the turn",
    "load_shift_s": "time after the transition at which the loads of both skis cross",
    "load_shift_percent": "the same in percent of the turn",
    "technique_carving": "probability that the whole turn was carved; of few sensors alone",
    "technique_skidding": "probability that it was skidded with parallel skis",
    "technique_wedge": "probability that it was skied in a wedge",
}
_OF_SEASON: Final[Mapping[str, str]] = {
    "run": "folder of the recording, and of its result, below those of the season",
    "recording": "name of the recording",
    "place": "descent that several runs share, A the one with the most; empty where it was skied once",
    "day": "date (UTC) on which the run began",
    "began_utc": "date and time of day (UTC) at which the recording's clock was zero",
    "skier": "name of the skier",
    "ski": "the ski of the catalogue, or its file",
    "snow_kind": "fresh, wet, groomed or icy, as the recording states it",
    "wax": "wax as the recording states it",
    "air_temperature_C": "temperature of the air as the recording states it",
    "snow_temperature_C": "temperature of the snow as the recording states it",
    "status": "done, diverged, failed or crashed; listed, failed or not read where the import made no recording",
    "error": "why the run has no result, in one line",
    "duration_s": "duration of the descent",
    "length_m": "length of the descent along the snow, from speeds that are averaged over 5 s",
    "vertical_m": "vertical drop of the descent",
    "slope_deg": "mean slope: the angle whose sine is vertical over length",
    "mean_speed_mps": "mean speed over ground",
    "top_speed_mps": "largest speed over ground, averaged over 5 s",
    "turns": "number of complete turns",
    "technique": "most likely technique of the run",
    "technique_carving": "probability that the skier carved",
    "technique_skidding": "probability that the skier skidded",
    "technique_wedge": "probability that the skier made a wedge",
    "mu_t": "friction along the skis",
    "mu_t_low": "lower end of its 90 % interval",
    "mu_t_high": "upper end of its 90 % interval",
    "effective_friction": "energy that the snow took over load times path",
    "effective_friction_low": "lower end of its 90 % interval",
    "effective_friction_high": "upper end of its 90 % interval",
    "energy_lost_J_per_kg_m": "mechanical energy lost in complete turns, for a kilogram and a metre of drop",
    "energy_lost_a_turn_J_per_kg": "mechanical energy lost in a complete turn for a kilogram, the median of the run",
    "air_share": "share of the air in what snow and air took",
    "track_error_m": "mean horizontal distance of the simulated antenna from the fixes",
    "stands_out": "figures far from the median of the same descent or day, in words",
    "key": "hash of all inputs of the run: files, settings and versions",
    "recording_sha256": "hash of the recording's files",
}
_WORDS: Final = frozenset(
    (
        "run",
        "recording",
        "place",
        "day",
        "began_utc",
        "skier",
        "ski",
        "snow_kind",
        "wax",
        "status",
        "error",
        "technique",
    )
    + ("stands_out", "key", "recording_sha256")
)
"""Columns of a season that hold words."""
_NO_UNIT: Final = frozenset(
    ("lateral_ratio_p90", "effective_friction", "air_share_of_losses", "turns", "mu_t", "mu_t_low", "mu_t_high")
    + ("effective_friction_low", "effective_friction_high", "technique_carving", "technique_skidding")
    + ("technique_wedge",)
)
_FIGURES: Final = {"mean": "mean", "min": "least", "max": "largest"}
_MUSCLES: Final = (
    (r"muscle_(\w+)_activation", "1", "activation of the muscle {0}, 0 to 1"),
    (r"muscle_(\w+)_force_N", "N", "force of the muscle {0} on its tendon"),
    (r"muscles_(\w+)_contact_band_bodyweights", "body weight", "half width of the 95 % band of the load of the {0}"),
    (r"muscles_(\w+)_contact_bodyweights", "body weight", "load of the joint {0} over the skier's weight"),
    (r"muscles_(\w+)_wanted_band_Nm", "N m", "half width of the 95 % band of the moment wanted at {0}"),
    (r"muscles_(\w+)_wanted_Nm", "N m", "moment that the muscles are to make at {0}"),
    (r"muscles_(\w+)_reserve_Nm", "N m", "moment at {0} that the muscles could not make"),
    (r"muscles_(\w+)_activation_band", "1", "half width of the 95 % band of the activation of {0}"),
    (r"muscles_(\w+)_activation", "1", "mean activation of {0}, each muscle weighted with its greatest force"),
)


@dataclass(frozen=True)
class Column:
    """One column of a file: its name, unit ("" for words and counts), frame ("" where there is none) and meaning."""

    file: str
    name: str
    unit: str
    frame: str
    meaning: str


def unit_of(name: str) -> str | None:
    """Return the unit of a column by its name; None where the name has none."""
    if name in _NO_UNIT:
        return "1"
    return next((unit for end, unit in _UNITS.items() if name == end or name.endswith(f"_{end}")), None)


def describe(file: str, names: Iterable[str]) -> list[Column]:
    """Return what columns of a file mean; a column that is not known has its unit alone."""
    known = _known()
    return [known.get((file, name)) or _other(file, name) for name in names]


def data_dictionary() -> list[Column]:
    """Return every column of a result's tables, except those named after muscles and numbers of the model."""
    return list(_known().values())


@cache
def _known() -> dict[tuple[str, str], Column]:
    columns = [*_of_series(), *_of_measured(), *_of_turns(), *_of_draws(), *_of_opensim(), *_of_season()]
    return {(column.file, column.name): column for column in columns}


def _other(file: str, name: str) -> Column:
    """Return the column of a muscle, of a number of the model, or of a name that is not known."""
    for pattern, unit, meaning in _MUSCLES:
        match = re.fullmatch(pattern, name)
        if match:
            return Column(file, name, unit, "", meaning.format(match[1].replace("_", " ")))
    if "." in name:
        return Column(file, name, "", "", "number of the model as drawn; sssi terms has its unit")
    return Column(file, name, unit_of(name) or "", "", "")


def _column(file: str, name: str, frame: str, meaning: str) -> Column:
    return Column(file, name, unit_of(name) or "", frame, meaning)


def _vector(file: str, name: str, unit: str, meaning: str) -> Iterator[Column]:
    for axis in _AXES:
        yield _column(file, f"{name}_{axis}_{unit}", ENU, f"{meaning}; part {axis if axis == 'up' else axis + 'wards'}")


def words_of(coordinate: str) -> str:
    """Return what a prescribed coordinate is, with its side, such as "flexion of the knee, left"."""
    base, _, letter = coordinate.rpartition("_")
    if letter in ("l", "r"):
        return f"{JOINTS[base]}, {'left' if letter == 'l' else 'right'}"
    return JOINTS[coordinate]


def _of_series() -> Iterator[Column]:
    yield _column(SERIES, "time_s", "", "time on the recording's clock")
    for name, (unit, meaning) in _VECTORS.items():
        yield from _vector(SERIES, name, unit, meaning)
    for side in SIDES:
        for name, (unit, meaning) in _VECTORS_OF_A_SIDE.items():
            yield from _vector(SERIES, f"{side}_{name}", unit, meaning.format(side=side))
        for name, (frame, meaning) in _NUMBERS_OF_A_SIDE.items():
            yield _column(SERIES, f"{side}_{name}", frame, meaning.format(side=side))
    yield _column(SERIES, "heading_offset_deg", "gravity", "turn of the whole skier against the captured heading")
    for name, direction in zip(TRANSLATIONS, ("down the fall line", "to the left", "along the normal"), strict=True):
        yield _column(SERIES, f"{name}_m", SLOPE, f"place of the pelvis' origin {direction}")
    for name in PRESCRIBED:
        yield _column(SERIES, f"{name}_deg", JOINT, words_of(name))
        residual = "residual moment, which nothing holds on a real skier: " if name.startswith("pelvis") else "moment: "
        yield _column(SERIES, f"{name}_moment_Nm", JOINT, residual + words_of(name))
    for name, meaning in _ENERGY.items():
        since = "" if name in ("kinetic", "elastic") else ", since the start"
        yield _column(SERIES, f"energy_{name}_J", "", meaning + since)
    for name, meaning in (
        ("turn", "number of the turn, 0 for none"),
        ("turn_side", "direction of the turn, left or right"),
        ("turn_phase", "initiation, control or completion"),
    ):
        yield _column(SERIES, name, "", meaning)


def _of_season() -> Iterator[Column]:
    for name, meaning in _OF_SEASON.items():
        yield Column(SEASON, name, "" if name in _WORDS else unit_of(name) or "", "", meaning)


def season_columns() -> tuple[Column, ...]:
    """Return the columns of a season's table in order; those without a unit hold words."""
    return tuple(_of_season())


def _of_measured() -> Iterator[Column]:
    yield _column(MEASURED, "time_s", "", "time on the recording's clock")
    yield from _vector(MEASURED, "gps", "m", "measured place of the GPS antenna")
    yield _column(MEASURED, "gps_sigma_m", "", "standard deviation of the fix, a coordinate")
    for side in SIDES:
        yield _column(MEASURED, f"{side}_insole_N", "sole", f"measured force square to the {side} sole")
    yield _column(SECOND_HALF, "time_s", "", "time on the recording's clock")
    yield _column(SECOND_HALF, "measured_mps", "", "measured speed over ground")
    yield _column(SECOND_HALF, "predicted_mps", "", "speed predicted from the first half of the fixes")
    yield _column(SECOND_HALF, "estimated_mps", "", "speed over ground estimated from all fixes")
    yield _column(SECOND_HALF, "height_m", "up", "estimated height of the snow, from the first fix")
    yield _column(SECOND_HALF, "slope_deg", "", "estimated slope of the snow along the path, downhill positive")
    yield _column(SECOND_HALF, "effective_friction", "", "work of the snow's friction over the path of the load")


def _of_turns() -> Iterator[Column]:
    for name, meaning in _OF_TURN.items():
        yield _column(TURNS, name, "", meaning)
    for which in ("outside", "inside"):
        for name, meaning in (
            (f"steering_angle_{which}_mean_deg", "mean angle between direction of travel and ski, {} ski"),
            (f"edge_angle_{which}_mean_deg", "mean edge angle of the {} ski"),
            (f"edge_angle_{which}_peak_deg", "largest edge angle of the {} ski"),
        ):
            yield _column(TURNS, name, "ski", meaning.format(which))
    paired = {name[:-2] for name in PRESCRIBED if name.endswith("_l")}
    for joint, direction in JOINTS.items():
        named = [(f"{joint}_{which}", f"{direction}, {which} limb") for which in ("outside", "inside")]
        for name, words in named if joint in paired else [(joint, direction)]:
            for figure, word in _FIGURES.items():
                yield _column(TURNS, f"{name}_{figure}_deg", JOINT, f"{word} angle: {words}")
                moment = f"{word} moment for a kilogram of the skier: {words}"
                yield _column(TURNS, f"{name}_moment_{figure}_Nm_per_kg", JOINT, moment)
    for name, meaning in _ENERGY.items():
        if name == "closure":
            continue
        change = f"change of the {meaning}" if name in ("kinetic", "elastic") else meaning
        yield _column(TURNS, f"work_{name}_J", "", change)
        yield _column(TURNS, f"power_{name}_W", "", f"mean power: {change}")


def _of_draws() -> Iterator[Column]:
    yield _column(DRAWS, "draw", "", "number of the draw, from 0")
    yield _column(DRAWS, "time_s", "", "time on the recording's clock")
    for name in PRESCRIBED:
        yield _column(DRAWS, f"{name}_rad", JOINT, f"angle added to the estimated posture: {words_of(name)}")
    yield _column(DRAWS, "skier_mass_kg", "", "mass of the skier as drawn")


def _of_opensim() -> Iterator[Column]:
    coordinates, moments, forces = OPENSIM
    for file in OPENSIM:
        yield Column(file, "time", "s", "", "time on the recording's clock")
    for axis in "xyz":
        yield Column(coordinates, f"pelvis_t{axis}", "m", GROUND, f"place of the pelvis' origin along {axis}")
    for name in PRESCRIBED:
        words = words_of(name)
        if name in REVERSED:
            words = words.replace("flexion", "extension")
        if name in PELVIS:
            words = f"{name.removeprefix('pelvis_')} of the pelvis against the ground, in OpenSim's order z, x, y"
        yield Column(coordinates, name, "degree", JOINT, words)
        yield Column(moments, f"{name}_moment", "N m", JOINT, f"moment: {words}")
    loads = [(f"{side}_{what}", words) for side in SIDES for what, words in _loads_of(side)]
    loads += [(f"air_{segment}", f"force of the air on {segment}") for segment in SEGMENTS]
    loads += [(f"unexplained_{segment}", f"share of a force on the whole body: {segment}") for segment in SEGMENTS]
    for name, words in loads:
        for axis in "xyz":
            yield Column(forces, f"{name}_force_v{axis}", "N", GROUND, f"{words} along {axis}")
            yield Column(forces, f"{name}_force_p{axis}", "m", GROUND, f"point at which it acts, {axis}: {words}")
            if not name.startswith(("air", "unexplained")) and "pole" not in name:
                yield Column(
                    forces, f"{name}_torque_{axis}", "N m", GROUND, f"moment about that point, {axis}: {words}"
                )


def _loads_of(side: str) -> tuple[tuple[str, str], ...]:
    return (
        ("snow", f"force of the snow on the {side} ski"),
        ("ski_bending", f"force of the bending {side} ski on the foot beyond that of a rigid ski"),
        ("pole", f"force of the {side} pole on the hand"),
    )
