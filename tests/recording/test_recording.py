"""A whole folder: what is read from it, and everything that can be wrong with it."""

from __future__ import annotations

import hashlib
import os
import pickle
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import tomli_w
from tiny import AZIMUTH_DEG, HEADING_DEG, INCLINATION_DEG, ORIGIN, TOML, Tiny, loads, motion

from sssi_exudyn.bodies.ski.ski import read_ski, ski_to_table
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.frames import Array
from sssi_exudyn.io.bounds import MAX_BYTES
from sssi_exudyn.recording.read import read_recording


def caught(folder: Path) -> InputError:
    """Return the one clear line that a folder gives, which names a file and a fix."""
    with pytest.raises(InputError) as info:
        read_recording(folder)
    error = info.value
    assert error.file
    assert error.fix
    assert "\n" not in str(error)
    return error


def test_whole_recording_in_si_units(tmp_path: Path) -> None:
    folder = Tiny().write(tmp_path)
    recording = read_recording(folder)
    assert recording.name == "tiny"
    assert (recording.skier.mass, recording.skier.height, recording.skier.sex) == (70.0, 1.65, "male")
    assert (recording.equipment.skis, recording.equipment.ski_mass) == ("slalom_165", 2.4)
    assert recording.slope.inclination == pytest.approx(np.deg2rad(INCLINATION_DEG))
    assert recording.slope.fall_line_azimuth == pytest.approx(np.deg2rad(AZIMUTH_DEG))
    assert recording.heading.value == pytest.approx(np.deg2rad(HEADING_DEG))
    assert not recording.slope.estimated
    assert not recording.heading.estimated
    assert recording.gps is not None
    assert recording.gps.segment == "Spine2"
    assert (recording.start, recording.stop) == pytest.approx((0.0, 8.0))
    assert recording.notices == ()
    digest = hashlib.sha256((folder / "motion.bvh").read_bytes()).hexdigest()
    assert recording.hashes["motion.bvh"] == f"sha256:{digest}"
    assert set(recording.hashes) == {"recording.toml", "motion.bvh", "gps.csv", "insoles.csv"}
    assert pickle.loads(pickle.dumps(recording)).skier == recording.skier


def test_boots_as_stated(tmp_path: Path) -> None:
    stated = "boot_centre_m = 0.065\nboot_sole_length_m = 0.305\nramp_angle_deg = 1.5"
    recording = read_recording(Tiny(toml=TOML.replace("boot_centre_m = 0.0", stated)).write(tmp_path))
    gear = recording.equipment
    assert (gear.boot_centre, gear.boot_sole_length) == (0.065, 0.305)
    assert gear.ramp_angle == pytest.approx(np.deg2rad(1.5))
    assert recording.notices == ()


def test_boots_that_are_not_stated_are_reported_as_assumed(tmp_path: Path) -> None:
    recording = read_recording(Tiny(toml=TOML.replace("boot_centre_m = 0.0\n", "")).write(tmp_path))
    assert recording.equipment.boot_centre == 0.0
    assert [notice for notice in recording.notices if "(boot_centre_m) is not stated" in notice]


def test_boot_off_the_foot(tmp_path: Path) -> None:
    problem = caught(Tiny(toml=TOML.replace("boot_centre_m = 0.0", "boot_centre_m = 7.0")).write(tmp_path))
    assert problem.place == "[equipment] boot_centre_m"
    assert problem.fix == "7 centimetres would be 0.07 m: give m"


def test_instruments_may_be_absent(tmp_path: Path) -> None:
    head = TOML.split("[gps]")[0]
    recording = read_recording(Tiny(toml=head).write(tmp_path))
    assert recording.gps is None
    assert recording.insoles is None


def test_time_offsets_move_every_instrument(tmp_path: Path) -> None:
    toml = TOML.replace('"gps.csv"', '"gps.csv"\ntime_offset_s = 0.5').replace(
        '"insoles.csv"', '"insoles.csv"\ntime_offset_s = -1.0'
    )
    recording = read_recording(Tiny(toml=toml).write(tmp_path))
    assert (recording.start, recording.stop) == pytest.approx((0.5, 7.0))
    assert any("together cover" in notice for notice in recording.notices)


def test_own_ski_file_is_read_from_the_folder_and_hashed(tmp_path: Path) -> None:
    folder = Tiny(toml=TOML.replace('"slalom_165"', '"skis/mine.toml"')).write(tmp_path)
    (folder / "skis").mkdir()
    own = {"mine": ski_to_table(read_ski("slalom_165", folder))}
    (folder / "skis" / "mine.toml").write_text(tomli_w.dumps(own), encoding="utf-8")
    recording = read_recording(folder)
    assert recording.equipment.skis == "skis/mine.toml"
    assert "skis/mine.toml" in recording.hashes


def slope_of_60_megabytes(path: Path) -> None:
    """Write the plane under the tiny run as an elevation model, with cells of a metre."""
    rasterio = pytest.importorskip("rasterio")
    cells, size = 3900, 1e-5
    row, column = np.ogrid[0:cells, 0:cells]
    down = np.cos(np.radians(AZIMUTH_DEG)) * -(row - cells / 2) * 1.112
    down = down + np.sin(np.radians(AZIMUTH_DEG)) * (column - cells / 2) * 1.112 * np.cos(np.radians(ORIGIN[0]))
    heights = (ORIGIN[2] - np.tan(np.radians(INCLINATION_DEG)) * down).astype("float32")
    corner = (ORIGIN[1] - size * cells / 2, ORIGIN[0] + size * cells / 2)
    transform = rasterio.transform.from_origin(*corner, size, size)
    about = {"width": cells, "height": cells, "count": 1, "dtype": "float32", "crs": "EPSG:4326"}
    with rasterio.open(path, "w", driver="GTiff", transform=transform, **about) as dataset:
        dataset.write(heights, 1)


@pytest.mark.long
def test_an_elevation_model_of_a_recording_may_be_as_large_as_any(tmp_path: Path) -> None:
    folder = Tiny(toml=TOML + '\n[terrain]\nfile = "dem.tif"\n').write(tmp_path)
    slope_of_60_megabytes(folder / "dem.tif")
    assert (folder / "dem.tif").stat().st_size > MAX_BYTES
    recording = read_recording(folder)
    assert recording.hashes["dem.tif"] == f"sha256:{hashlib.sha256((folder / 'dem.tif').read_bytes()).hexdigest()}"
    assert not [notice for notice in recording.notices if "dem.tif" in notice]


def with_runs(*names: str) -> str:
    return TOML + f"\n[terrain]\nruns = {list(names)}\n"


def test_other_runs_of_the_slope_are_read_too(tmp_path: Path) -> None:
    other = Tiny(toml=with_runs("../first")).write(tmp_path / "other")  # each names the other
    recording = read_recording(Tiny(toml=with_runs("../other")).write(tmp_path / "first"))
    assert [run.folder.resolve() for run in recording.runs] == [other]
    assert recording.runs[0].runs == ()
    assert recording.elevations is None
    assert recording.hashes["../other/gps.csv"] == recording.runs[0].hashes["gps.csv"]
    assert pickle.loads(pickle.dumps(recording)).runs[0].name == "tiny"


def north(metres: float) -> dict[str, Array]:
    columns = motion()[1]
    return {**columns, "latitude_deg": columns["latitude_deg"] + metres / 111_200.0}


RUNS: dict[str, tuple[str, str]] = {
    "none there": (with_runs("../none"), "no folder '../none'"),
    "a file": (with_runs("gps.csv"), "no folder 'gps.csv'"),
    "farther away": (with_runs("../../out/other"), "no folder '../../out/other' next to this recording"),
    "by its whole path": (with_runs("/"), "no folder '/' next to"),
    "above": (with_runs(".."), "no folder '..' next to"),
    "within": (with_runs("inner"), "no folder 'inner' next to"),
    "behind a link that leads away": (with_runs("../link"), "no folder '../link' next to"),
    "itself": (with_runs("."), "is this run or named before"),
    "twice": (with_runs("../near", "../near/../near"), "is this run or named before"),
    "without fixes": (with_runs("../blind"), "'../blind' has no fixes"),
    "elsewhere": (with_runs("../far"), "'../far' lies 2"),
    "no list": (TOML + '\n[terrain]\nruns = "../near"\n', "no list of folders"),
    "numbers": (TOML + "\n[terrain]\nruns = [1]\n", "no list of folders"),
    "too many": (with_runs(*[f"../{n}" for n in range(9)]), "9 runs"),
    "null byte": (TOML + '\n[terrain]\nruns = ["a\\u0000"]\n', "no folder"),
    "nothing to look at": (TOML.split("[gps]")[0] + '\n[terrain]\nruns = ["../near"]\n', "no fixes"),
}


@pytest.mark.parametrize("fault", RUNS)
def test_runs_that_show_nothing_of_the_slope_are_refused(tmp_path: Path, fault: str) -> None:
    toml, problem = RUNS[fault]
    Tiny(gps=north(90.0)).write(tmp_path / "near")
    Tiny(gps=north(250.0)).write(tmp_path / "far")  # the path is 64 m long
    Tiny(toml=TOML.split("[gps]")[0]).write(tmp_path / "blind")
    Tiny(gps=north(90.0)).write(tmp_path / "run" / "inner")
    Tiny(gps=north(90.0)).write(tmp_path / "out" / "other")
    (tmp_path / "link").symlink_to(tmp_path / "out" / "other")
    error = caught(Tiny(toml=toml).write(tmp_path / "run"))
    assert error.place.startswith("[terrain]")
    assert problem in str(error)


def test_what_is_wrong_in_another_run_is_named_there(tmp_path: Path) -> None:
    Tiny(toml=TOML.replace("mass_kg = 70.0", "mass_kg = 700.0")).write(tmp_path / "other")
    error = caught(Tiny(toml=with_runs("../other")).write(tmp_path / "run"))
    assert "other" in str(error.file)
    assert error.place == "[skier] mass_kg"


def without(name: str) -> Callable[[str], str]:
    return lambda toml: "\n".join(line for line in toml.split("\n") if not line.startswith(name))


def instead(old: str, new: str) -> Callable[[str], str]:
    return lambda toml: toml.replace(old, new)


SETTINGS: dict[str, tuple[Callable[[str], str], str, str]] = {
    "700 kg": (instead("mass_kg = 70.0", "mass_kg = 700.0"), "[skier] mass_kg", "700 is outside 20 to 200 kg"),
    "grams": (instead("mass_kg = 70.0", "mass_kg = 70000"), "[skier] mass_kg", "grams"),
    "feet for metres": (instead("height_m = 1.65", "height_m = 5.41"), "[skier] height_m", "feet"),
    "centimetres": (instead("height_m = 1.65", "height_m = 165"), "[skier] height_m", "centimetres"),
    "slope of 80°": (instead("_deg = 16.0", "_deg = 80.0"), "[slope] inclination_deg", "80 is outside 0 to 60 deg"),
    "antenna in centimetres": (instead("[0.0, 0.1, -0.16]", "[0, 10, -16]"), "[gps] offset_m", "centimetres"),
    "offset of two": (instead("[0.0, 0.1, -0.16]", "[0.1, -0.16]"), "[gps] offset_m", "three numbers"),
    "text for a number": (instead("mass_kg = 70.0", 'mass_kg = "70"'), "[skier] mass_kg", "not a number"),
    "NaN": (instead("mass_kg = 70.0", "mass_kg = nan"), "[skier] mass_kg", "not a number"),
    "true": (instead("mass_kg = 70.0", "mass_kg = true"), "[skier] mass_kg", "not a number"),
    "beyond floats": (instead("mass_kg = 70.0", "mass_kg = 1" + "0" * 400), "[skier] mass_kg", "not a number"),
    "no mass": (without("mass_kg"), "[skier] mass_kg", "missing"),
    "no skier": (instead("[skier]", "[skyer]"), "skyer", "did you mean 'skier'"),
    "slip of a key": (instead("height_m", "heigth_m"), "[skier] heigth_m", "did you mean 'height_m'"),
    "half a slope": (without("inclination"), "[slope] inclination_deg", "missing"),
    "no motion": (lambda t: t.split("[motion]")[0], "[motion]", "missing"),
    "skier as text": (lambda t: t.split("[skier]")[0] + 'skier = "me"\n', "[skier]", "must be a table"),
    "sex": (instead('"male"', '"both"'), "[skier] sex", "anthropometric"),
    "no format": (without("format"), "format", "format = 1"),
    "later format": (instead("format = 1", "format = 2"), "format", "2 is not known"),
    "name of spaces": (instead('"tiny"', '" "'), "name", "not a text"),
    "unknown joint": (instead('"Spine2"', '"Backpack"'), "[gps] segment", "no joint 'Backpack'"),
    "not TOML": (instead("mass_kg = 70.0", "mass_kg 70.0"), "", "line 5"),
    "bottomless": (lambda t: "x = " + "[" * 5000, "", "not TOML"),
    "missing file": (instead('"gps.csv"', '"fixes.csv"'), "", "does not exist"),
    "folder as a file": (instead('"gps.csv"', '"."'), "", "not a file"),
    "climbs out": (instead('"gps.csv"', '"../gps.csv"'), "[gps] file", "out of the recording's folder"),
    "absolute": (instead('"gps.csv"', '"/etc/hostname"'), "[gps] file", "relative path"),
    "drive": (instead('"gps.csv"', "'C:\\gps.csv'"), "[gps] file", "relative path"),
    "null byte": (instead('"gps.csv"', '"gps\\u0000.csv"'), "[gps] file", "not a file name"),
    "skis climb out": (instead('"slalom_165"', '"../ski.toml"'), "[equipment] skis", "out of the recording's folder"),
    "video as motion": (instead('"motion.bvh"', '"gps.csv"'), "[motion] file", "no reader"),
    "clocks apart": (instead('"gps.csv"', '"gps.csv"\ntime_offset_s = 3600'), "time_offset_s", "do not overlap"),
    "backwards": (instead("heading_deg = 25.0", "heading_deg = 205.0"), "[motion] heading_deg", "course and skis"),
    "uphill": (instead("azimuth_deg = 70.0", "azimuth_deg = 250.0"), "fall_line_azimuth_deg", "falls towards"),
}  # fmt: skip


@pytest.mark.parametrize("fault", SETTINGS)
def test_faulty_settings_are_named_with_place_and_fix(tmp_path: Path, fault: str) -> None:
    change, place, problem = SETTINGS[fault]
    assert change(TOML) != TOML
    error = caught(Tiny(toml=change(TOML)).write(tmp_path / "run"))
    assert place in error.place
    assert problem in str(error)


def test_times_in_nanoseconds_leave_one_fix_within_the_motion(tmp_path: Path) -> None:
    folder = Tiny().write(tmp_path / "run")
    table = pd.read_csv(folder / "gps.csv")
    table.assign(time_s=1e9 * table["time_s"]).to_csv(folder / "gps.csv", index=False)
    error = caught(folder)
    assert error.place == "[gps]"
    assert "1 fixes between" in error.problem
    assert "seconds?" in error.fix


@pytest.mark.parametrize("name", ["recording.toml", "motion.bvh", "gps.csv", "insoles.csv"])
class TestEveryFile:
    """Faults that any of the files may have."""

    def test_missing(self, tmp_path: Path, name: str) -> None:
        folder = Tiny().write(tmp_path)
        (folder / name).unlink()
        error = caught(folder)
        assert name in error.file
        assert "does not exist" in error.problem

    def test_empty(self, tmp_path: Path, name: str) -> None:
        folder = Tiny().write(tmp_path)
        (folder / name).write_bytes(b"")
        error = caught(folder)
        assert name in error.file
        assert "empty" in error.problem

    def test_far_too_large_is_refused_unread(self, tmp_path: Path, name: str) -> None:
        folder = Tiny().write(tmp_path)
        os.truncate(folder / name, 10 * MAX_BYTES)  # sparse: takes no room on the disk
        error = caught(folder)
        assert name in error.file
        assert "500 MB" in error.problem

    def test_symlink_out_of_the_folder(self, tmp_path: Path, name: str) -> None:
        folder = Tiny().write(tmp_path / "run")
        (folder / name).rename(tmp_path / name)
        (folder / name).symlink_to(tmp_path / name)
        error = caught(folder)
        assert name in str(error)
        assert "out of the recording's folder" in error.problem

    def test_symlink_to_itself(self, tmp_path: Path, name: str) -> None:
        folder = Tiny().write(tmp_path)
        (folder / name).unlink()
        (folder / name).symlink_to(name)
        assert name in str(caught(folder))

    def test_pipe(self, tmp_path: Path, name: str) -> None:
        folder = Tiny().write(tmp_path)
        (folder / name).unlink()
        os.mkfifo(folder / name)
        assert "not a file" in caught(folder).problem

    def test_bytes_that_are_no_text(self, tmp_path: Path, name: str) -> None:
        folder = Tiny().write(tmp_path)
        (folder / name).write_bytes(bytes(range(128, 256)) * 10)
        error = caught(folder)
        assert name in error.file
        assert "UTF-8" in error.problem


def test_symlink_within_the_folder_is_fine(tmp_path: Path) -> None:
    folder = Tiny().write(tmp_path)
    (folder / "gps.csv").rename(folder / "fixes.csv")
    (folder / "gps.csv").symlink_to("fixes.csv")
    assert read_recording(folder).gps is not None


def test_no_folder(tmp_path: Path) -> None:
    assert "does not exist" in caught(tmp_path / "nowhere").problem
    path = tmp_path / "file"
    path.write_text("x", encoding="utf-8")
    assert "not a recording's folder" in caught(path).problem


@pytest.mark.parametrize("known", ["heading_deg = 25.0", ""])
def test_latitude_and_longitude_swapped_where_both_are_possible(tmp_path: Path, known: str) -> None:
    tiny = Tiny(toml=TOML.replace("heading_deg = 25.0", known))
    tiny.gps["latitude_deg"], tiny.gps["longitude_deg"] = tiny.gps["longitude_deg"], tiny.gps["latitude_deg"]
    error = caught(tiny.write(tmp_path))
    assert "gps.csv" in error.file
    assert "swapped" in error.problem


def test_altitude_in_feet_against_the_slope(tmp_path: Path) -> None:
    tiny = Tiny()
    tiny.gps["altitude_m"] = tiny.gps["altitude_m"] / 0.3048
    error = caught(tiny.write(tmp_path))
    assert error.place == "column altitude_m"
    assert "feet" in error.problem


@pytest.mark.parametrize(("unit", "size"), [("metres", 0.01), ("millimetres", 10.0), ("inches", 1.0 / 2.54)])
def test_capture_in_another_unit_against_the_height(tmp_path: Path, unit: str, size: float) -> None:
    tiny = Tiny()
    tiny.skeleton = tuple((name, above, (x * size, y * size, z * size)) for name, above, (x, y, z) in tiny.skeleton)
    error = caught(tiny.write(tmp_path))
    assert "motion.bvh" in error.file
    assert unit in error.problem


def test_oddities_are_noticed_but_read(tmp_path: Path) -> None:
    toml = TOML.replace("heading_deg = 25.0", "heading_deg = 45.0").replace('sex = "male"', "")
    toml = toml.replace("inclination_deg = 16.0", "inclination_deg = 22.0").replace("_deg = 70.0", "_deg = 92.0")
    tiny = Tiny(toml=toml)
    tiny.insoles = {name: column / (1.0 if name == "time_s" else 50.0) for name, column in loads(4).items()}
    notices = " ".join(read_recording(tiny.write(tmp_path)).notices)
    odd = ("heading_deg is 45.0", "inclination_deg is 22.0", "azimuth_deg is 92.0", "sex is not stated", "newtons")
    for words in odd:
        assert words in notices


def test_without_fixes_slope_and_heading_have_to_be_given(tmp_path: Path) -> None:
    head = TOML.split("[gps]")[0]
    error = caught(Tiny(toml=head.replace("heading_deg = 25.0", "")).write(tmp_path / "heading"))
    assert error.place == "[motion] heading_deg"
    slope = head[head.index("[slope]") : head.index("[motion]")]
    error = caught(Tiny(toml=head.replace(slope, "")).write(tmp_path / "slope"))
    assert error.place == "[slope]"


def test_nothing_is_written_into_the_folder(tmp_path: Path) -> None:
    folder = Tiny().write(tmp_path)
    before = sorted(path.name for path in folder.iterdir())
    read_recording(folder)
    assert sorted(path.name for path in folder.iterdir()) == before


def test_cuffs_as_stated(tmp_path: Path) -> None:
    stated = "boot_centre_m = 0.0\ncuff_flexion_Nm_per_deg = 5.0\ncuff_lean_deg = 13.0\ncuff_edging_Nm_per_deg = 12.0"
    gear = read_recording(Tiny(toml=TOML.replace("boot_centre_m = 0.0", stated)).write(tmp_path)).equipment
    assert gear.cuff_flexion == pytest.approx(5.0 * 180.0 / np.pi)
    assert gear.cuff_lean == pytest.approx(np.radians(13.0))
    assert gear.cuff_edging == pytest.approx(12.0 * 180.0 / np.pi)
    error = caught(
        Tiny(toml=TOML.replace("boot_centre_m = 0.0", "cuff_flexion_Nm_per_deg = 500")).write(tmp_path / "b")
    )
    assert error.place == "[equipment] cuff_flexion_Nm_per_deg"


def test_poles_as_stated(tmp_path: Path) -> None:
    stated = "boot_centre_m = 0.0\npole_mass_kg = 0.24\npole_length_m = 1.2"
    gear = read_recording(Tiny(toml=TOML.replace("boot_centre_m = 0.0", stated)).write(tmp_path)).equipment
    assert (gear.pole_mass, gear.pole_length) == (0.24, 1.2)
