"""Loggers' tables of single sensors and of pressure cells, made into a recording of few sensors."""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pymap3d
import pytest
from strapped import LAG, strapped, truth

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.frames import GRAVITY
from sssi_exudyn.importing.answers import Answers
from sssi_exudyn.importing.assemble import import_recording
from sssi_exudyn.importing.sensors.sensor_logs import holds_channels, read_logs, write_pressure, write_sensors
from sssi_exudyn.recording.instruments.fixes import fixes_csv
from sssi_exudyn.recording.instruments.imu import read_imu
from sssi_exudyn.recording.instruments.insoles import read_insoles
from sssi_exudyn.recording.read import read_recording
from sssi_exudyn.recording.recording import Recording

EXAMPLE = Path(__file__).parents[3] / "examples" / "intermediate"
ANSWERS = Answers(
    mass_kg=84.0,
    height_m=1.8,
    sex="male",
    skis="slalom_165",
    ski_mass_kg=2.4,
    boot_mass_kg=1.9,
    ankle_to_ski_base_m=0.13,
    antenna_joint="Spine2",
    antenna_offset_m=(0.0, 0.1, -0.16),
    gps_sigma_m=0.02,
)


@pytest.fixture(scope="module")
def whole() -> Recording:
    return read_recording(EXAMPLE)


@pytest.fixture
def logs(whole: Recording, tmp_path: Path) -> dict[str, Path]:
    """Write the files of two loggers and a telephone, with text columns among the numbers."""
    made = {}
    for seed, place in enumerate(("left_ski", "right_ski")):
        one = strapped(whole, place, seed)
        table = pd.DataFrame(
            np.hstack([one.force, one.rate]), columns=["ax", "ay", "az(m/s2)", "gx", "gy", "gz(rad/s)"]
        )
        table.insert(0, "t_s", one.time)
        made[place] = tmp_path / f"imu_{place}.csv"
        table.assign(status="RUN").to_csv(made[place], index=False)
    fixes = whole.gps
    assert fixes is not None
    east, north, up = fixes.enu[::2].T
    table = pd.DataFrame({"t_s": fixes.time[::2] + LAG, "east_m": east, "north_m": north, "alt_m": 2000.0 + up})
    made["fixes"] = tmp_path / "track.csv"
    table.to_csv(made["fixes"], index=False)
    return made


def named(logs: dict[str, Path], *places: str) -> list[Path]:
    return [*(Path(f"{place}={logs[place]}") for place in places), logs["fixes"]]


@pytest.mark.long
def test_the_receiver_of_a_telephone_is_where_that_is(logs: dict[str, Path], tmp_path: Path) -> None:
    answers = replace(ANSWERS, antenna_joint=None, antenna_offset_m=None)
    alone = import_recording([Path(f"pocket={logs['left_ski']}"), logs["fixes"]], tmp_path / "alone", answers)
    assert alone.gps is not None
    assert alone.gps.segment == "Hips"
    assert any("carried at the joint Hips" in notice for notice in alone.notices)
    named = replace(answers, antenna_joint="Head")
    placed = import_recording([Path(f"pocket={logs['left_ski']}"), logs["fixes"]], tmp_path / "named", named)
    assert placed.gps is not None
    assert placed.gps.segment == "Head"
    assert not np.any(placed.gps.offset)
    both = [Path(f"{place}={logs[place]}") for place in ("left_ski", "right_ski")]
    several = import_recording([*both, logs["fixes"]], tmp_path / "several", answers)
    assert several.gps is not None
    assert several.gps.segment == "Spine2"


@pytest.mark.long
def test_loggers_tables_become_a_recording(whole: Recording, logs: dict[str, Path], tmp_path: Path) -> None:
    made = import_recording(named(logs, "left_ski", "right_ski"), tmp_path / "made", ANSWERS)
    assert made.completed is not None
    assert made.completed.steered
    time = made.bvh.time
    roll = truth(made, "LeftFoot", time)[1] - truth(whole, "LeftFoot", time)[1]
    # as with the recording's own files: tilts are 1 to 2° off, a constant is the mounting
    assert np.degrees(np.std(roll)) < 3.0
    assert sorted(path.name for path in (tmp_path / "made" / "sensors").iterdir()) == ["left_ski.csv", "right_ski.csv"]
    assert made.gps is not None
    assert made.gps.origin[0] == pytest.approx(46.0, abs=0.01)  # local coordinates are set down somewhere


def test_repeated_places_and_missing_channels_are_reported(logs: dict[str, Path], tmp_path: Path) -> None:
    twice = [*named(logs, "left_ski"), Path(f"left_ski={logs['right_ski']}")]
    with pytest.raises(InputError, match="a sensor on 'left_ski' already"):
        import_recording(twice, tmp_path / "twice", ANSWERS)
    with pytest.raises(InputError, match="no time and channels"):
        import_recording([Path(f"chest={logs['fixes']}"), logs["fixes"]], tmp_path / "none", ANSWERS)
    assert not (tmp_path / "none" / "recording.toml").exists()


@pytest.mark.parametrize("slope_deg", [None, 15.0])
def test_single_sensors_without_fixes_are_asked_for_a_file_of_them(
    slope_deg: float | None, logs: dict[str, Path], tmp_path: Path
) -> None:
    answers = replace(ANSWERS, slope_deg=slope_deg, fall_line_deg=slope_deg)
    with pytest.raises(InputError, match=r"there are no fixes.*add a file of fixes \(.csv, .gpx") as info:
        import_recording([Path(f"pocket={logs['left_ski']}")], tmp_path / "out", answers)
    assert info.value.file == str(logs["left_ski"])


@pytest.mark.parametrize(("zero", "shared"), [(1_234_567.0, True), (1_551_007_195.0, True), (1_551_007_195.0, False)])
def test_a_clock_that_began_long_ago_begins_with_the_run(
    zero: float, shared: bool, logs: dict[str, Path], tmp_path: Path
) -> None:
    files = named(logs, "left_ski")
    expected = import_recording(files, tmp_path / "expected", ANSWERS)
    for path in [logs["left_ski"], logs["fixes"]] if shared else [logs["left_ski"]]:
        table = pd.read_csv(path)
        table["t_s"] += zero
        table.to_csv(path, index=False, float_format="%.9f")
    answers = ANSWERS if shared else replace(ANSWERS, gps_offset_s=zero)
    made = import_recording(files, tmp_path / "made", answers)
    assert f"time 0 is {zero:.0f} s of the sensors' clock" in made.note
    assert made.gps is not None
    assert expected.gps is not None
    np.testing.assert_allclose(made.gps.time, expected.gps.time, rtol=0.0, atol=1e-5)
    np.testing.assert_allclose(made.bvh.time, expected.bvh.time, rtol=0.0, atol=1e-5)
    np.testing.assert_allclose(made.bvh.rotations, expected.bvh.rotations, rtol=0.0, atol=1e-3)


def apart(log: Path, folder: Path, header: str, began: float = 1.7e9) -> list[Path]:
    """Write the log as an app with one file per instrument does.

    The accelerometer begins later, and samples at other times.
    """
    table = pd.read_csv(log)
    gyro, accel = table[["t_s", "gx", "gy", "gz(rad/s)"]], table[["t_s", "ax", "ay", "az(m/s2)"]]
    time = accel.t_s.to_numpy()[20:-20:2] + 0.003
    later = np.column_stack([time, *(np.interp(time, accel.t_s, accel[name]) for name in accel.columns[1:])])
    made = []
    for name, values, title in (
        ("Gyroscope", gyro.to_numpy(), "Gyroscope {} (rad/s)"),
        ("TotalAcceleration", later, "Acceleration {} (m/s^2)"),
    ):
        if header == "by file":
            whole = pd.DataFrame(values, columns=["seconds_elapsed", "x", "y", "z"])
            whole.insert(0, "time", np.round((began + whole.seconds_elapsed) * 1e9).astype("int64"))
        else:
            whole = pd.DataFrame(values, columns=["Time (s)", *(title.format(axis) for axis in "xyz")])
        path = folder / f"{name}.csv"
        whole.to_csv(path, index=False, quoting=csv.QUOTE_NONNUMERIC)
        made.append(path)
    return made


@pytest.mark.parametrize("header", ["by file", "by column"])
def test_gyroscope_and_accelerometer_may_be_two_files(header: str, logs: dict[str, Path], tmp_path: Path) -> None:
    gyro, accel = apart(logs["left_ski"], tmp_path, header)
    (whole,) = read_logs([("pocket", logs["left_ski"])])
    for files in ([gyro, accel], [accel, gyro]):
        (log,) = read_logs([("pocket", path) for path in files])
        assert log.table.file == gyro
        assert log.began == (pytest.approx(1.7e9, abs=1e-3) if header == "by file" else None)
        first = log.table.lines[0] - 2  # the accelerometer begins after the gyroscope
        assert first >= 20
        same = slice(first, first + len(log.table.lines))
        for name, column in log.table.columns.items():
            at_same = whole.table.columns[name][same]
            if name.startswith("acceleration"):  # straight lines over two samples
                assert np.corrcoef(column, at_same)[0, 1] > 0.97
            else:
                np.testing.assert_allclose(column, at_same, atol=1e-9)


def test_files_of_an_app_share_its_clock(logs: dict[str, Path], whole: Recording, tmp_path: Path) -> None:
    gyro, accel = apart(logs["left_ski"], tmp_path, "by file")
    fixes = whole.gps
    assert fixes is not None
    east, north, up = fixes.enu[::2].T
    degrees = np.column_stack([46.0 + north / 111_149.0, 8.0 + east / 77_469.0, 2000.0 + up])
    time = fixes.time[::2] + LAG
    table = pd.DataFrame(degrees, columns=["latitude", "longitude", "altitude"])
    table = table.assign(seconds_elapsed=time, speed=-1.0, bearing=-1.0, horizontalAccuracy=1.0)
    table.insert(0, "time", np.round((1.7e9 + time) * 1e9).astype("int64"))
    table.to_csv(tmp_path / "Location.csv", index=False)
    pressure = 1013.25 * (1.0 - degrees[:, 2] / 44330.8) ** 5.2559
    clock = {"time": table.time + 5_000_000_000, "seconds_elapsed": table.seconds_elapsed}  # of a recording begun later
    pd.DataFrame({**clock, "relativeAltitude": 0.0, "pressure": pressure}).to_csv(
        tmp_path / "Barometer.csv", index=False
    )
    files = [Path(f"pocket={gyro}"), Path(f"pocket={accel}"), tmp_path / "Location.csv"]
    made = import_recording([*files, Path(f"barometer={tmp_path / 'Barometer.csv'}")], tmp_path / "monday", ANSWERS)
    assert made.name == "monday"
    assert made.gps is not None
    text = (tmp_path / "monday" / "recording.toml").read_text(encoding="utf-8")
    assert 'file = "sensors/barometer.csv"\ntime_offset_s = 5.0' in text
    with pytest.raises(InputError, match=r"--gps-offset-s 0 where motion and fixes count from the same zero"):
        import_recording([Path(f"pocket={logs['left_ski']}"), files[-1]], tmp_path / "asked", ANSWERS)


def test_files_that_do_not_make_one_sensor_are_reported(logs: dict[str, Path], tmp_path: Path) -> None:
    gyro, accel = apart(logs["left_ski"], tmp_path, "by file")

    def refusal(*files: Path) -> str:
        with pytest.raises(InputError) as caught:
            read_logs([("pocket", path) for path in files])
        return str(caught.value)

    assert "Gyroscope.csv: header: it holds no acceleration; add the other instrument's file as pocket=FILE too" in (
        refusal(gyro)
    )
    assert "TotalAcceleration.csv: header: it holds no rates" in refusal(accel)
    assert "there is a sensor on 'pocket' already" in refusal(gyro, gyro)
    assert "Gyroscope.csv has the acceleration" not in refusal(accel, accel)
    assert "has the acceleration already" in refusal(logs["left_ski"], accel)
    late = pd.read_csv(accel)
    late.assign(time=late.time + 10**12).to_csv(accel, index=False)
    assert "it has no time in common with" in refusal(gyro, accel)
    table = pd.read_csv(logs["left_ski"]).rename(columns={"gz(rad/s)": "gz(deg/s)"})
    table.to_csv(tmp_path / "degrees.csv", index=False)
    assert "degrees.csv: header, gz: its unit is 'deg/s'; convert it to rad/s" in refusal(tmp_path / "degrees.csv")
    table = pd.read_csv(gyro)
    table.loc[30, "y"] = 200.0
    table.to_csv(gyro, index=False)
    assert "Gyroscope.csv: line 32, rate_y_radps: 200 rad/s is more" in refusal(gyro)


def test_a_barometer_and_pressure_cells_come_along(logs: dict[str, Path], tmp_path: Path) -> None:
    track = pd.read_csv(logs["fixes"])
    baro = pd.DataFrame({"t_s": track.t_s, "pressure_Pa": 101325.0 * (1.0 - track.alt_m / 44330.8) ** 5.2559})
    baro.to_csv(tmp_path / "baro.csv", index=False)
    counts(tmp_path / "foot.csv", dead=None)
    files = [
        *named(logs, "left_ski"),
        Path(f"barometer={tmp_path / 'baro.csv'}"),
        Path(f"insoles={tmp_path / 'foot.csv'}"),
    ]
    made = import_recording(files, tmp_path / "made", ANSWERS)
    assert made.insoles is not None
    assert any("heights are the barometer's" in notice for notice in made.notices)


def counts(path: Path, dead: str | None) -> None:
    """Write a pressure logger's lines: the feet alternate, and the load shifts between them every two seconds."""
    rng = np.random.default_rng(2)
    time = np.arange(0.0, 16.0, 0.025)
    side = np.where(np.arange(len(time)) % 2 == 0, "L", "R")
    load = 500.0 + 300.0 * np.sin(1.5 * time) * np.where(side == "L", 1.0, -1.0)
    table = pd.DataFrame({"t_s": time, "side": side})
    for cell in ("toes_adc", "heel_adc"):
        table[cell] = np.round(load + rng.normal(0.0, 10.0, len(time)))
    if dead is not None:
        table.loc[table.side == "R", dead] = 0
    table.to_csv(path, index=False)


def test_counts_of_pressure_cells_carry_the_weight_and_dead_cells_are_listed(tmp_path: Path) -> None:
    counts(tmp_path / "foot.csv", dead="heel_adc")
    write_pressure(tmp_path / "foot.csv", tmp_path, 70.0)
    insoles = read_insoles(tmp_path / "insoles.csv")
    assert insoles.dead_cells == ("right_2_N",)
    assert np.mean(insoles.left + insoles.right) == pytest.approx(70.0 * GRAVITY, rel=1e-6)
    # right foot's one cell against left foot's two
    assert np.mean(insoles.right) / np.mean(insoles.left) == pytest.approx(0.5, abs=0.05)
    with pytest.raises(InputError, match="no counts of cells"):
        write_pressure(tmp_path / "insoles.csv", tmp_path, 70.0)


def phyphox(whole: Recording, folder: Path, sign: float = 1.0) -> list[Path]:
    """Write an experiment of phyphox with three sensors: times count from the same zero, titles have capitals."""
    one, fixes = strapped(whole, "pocket", 4), whole.gps
    assert fixes is not None
    latitude, longitude, height = pymap3d.enu2geodetic(*fixes.enu[::10].T, *fixes.origin)
    tables = {
        "Gyroscope": (one.time, one.rate, [f"{axis} (rad/s)" for axis in "XYZ"]),
        "Accelerometer": (one.time, sign * one.force, [f"{axis} (m/s^2)" for axis in "XYZ"]),
        "Location": (
            fixes.time[::10] + LAG,
            np.column_stack([latitude, longitude, height, *np.full((4, len(height)), np.nan)]),
            ["Latitude (°)", "Longitude (°)", "Height (m)", "Velocity (m/s)", "Direction (°)",
             "Horizontal Accuracy (m)", "Vertical Accuracy (°)"],
        ),
    }  # fmt: skip
    tables["Location"][1][:, 5] = 4.0
    made = []
    for name, (time, values, titles) in tables.items():
        table = pd.DataFrame(np.column_stack([time, values]), columns=["Time (s)", *titles])
        made.append(folder / f"{name}.csv")
        table.to_csv(made[-1], index=False, quoting=csv.QUOTE_NONNUMERIC, float_format="%.9e")
    return made


def test_an_experiment_of_phyphox_has_one_clock(whole: Recording, tmp_path: Path) -> None:
    gyro, accel, fixes = phyphox(whole, tmp_path)
    made = import_recording([Path(f"pocket={gyro}"), Path(f"pocket={accel}"), fixes], tmp_path / "made", ANSWERS)
    assert made.completed is not None
    assert made.completed.lag is not None
    assert made.completed.lag.value == pytest.approx(LAG, abs=0.5)  # as of the few sensors' own files
    assert made.gps is not None
    assert made.gps.speed is None  # the phone wrote none
    with pytest.raises(InputError, match="--gps-offset-s"):  # but a capture has another clock
        import_recording([EXAMPLE / "motion.bvh", fixes], tmp_path / "captured", ANSWERS)


@pytest.mark.parametrize(("separator", "point"), [(";", "."), (";", ","), ("\t", "."), ("\t", ",")])
def test_an_experiment_of_phyphox_may_have_other_separators(
    separator: str, point: str, whole: Recording, tmp_path: Path
) -> None:
    files = phyphox(whole, tmp_path)
    expected = read_logs([("pocket", path) for path in files[:2]])
    fixes = fixes_csv(files[2])
    for path in files:
        text = path.read_text(encoding="utf-8").replace(",", separator).replace(".", point)
        path.write_text(text, encoding="utf-8")
    assert holds_channels(files[0])
    for log, same in zip(read_logs([("pocket", path) for path in files[:2]]), expected, strict=True):
        for name, column in same.table.columns.items():
            np.testing.assert_array_equal(log.table.columns[name], column)
    for name, column in fixes_csv(files[2]).columns.items():
        np.testing.assert_array_equal(column, fixes.columns[name])


def test_titles_with_capitals_and_the_instruments_name(whole: Recording, tmp_path: Path) -> None:
    gyro, accel, _ = phyphox(whole, tmp_path)
    (expected,) = read_logs([("chest", gyro), ("chest", accel)])
    both = pd.read_csv(gyro).join(pd.read_csv(accel).drop(columns="Time (s)"))
    both.columns = [
        "Time (s)",
        *(f"Gyroscope {a} (rad/s)" for a in "XYZ"),
        *(f"Acceleration {a} (m/s^2)" for a in "XYZ"),
    ]
    both.assign(battery="90 %").to_csv(tmp_path / "log.csv", index=False, quoting=csv.QUOTE_NONNUMERIC)
    (log,) = read_logs([("chest", tmp_path / "log.csv")])
    for name, column in expected.table.columns.items():
        np.testing.assert_allclose(log.table.columns[name], column)


def test_an_acceleration_that_points_down_gives_the_same_posture(whole: Recording, tmp_path: Path) -> None:
    made = []
    for sign in (1.0, -1.0):
        (tmp_path / str(sign)).mkdir()
        gyro, accel, fixes = phyphox(whole, tmp_path / str(sign), sign)
        files = [Path(f"pocket={gyro}"), Path(f"pocket={accel}"), fixes]
        made.append(import_recording(files, tmp_path / str(sign) / "made", ANSWERS))
    right, down = (one.completed for one in made)
    assert right is not None
    assert down is not None
    np.testing.assert_allclose(down.edge, right.edge, atol=1e-9)
    assert [notice for notice in made[1].notices if "its sign was turned" in notice]
    assert not [notice for notice in made[0].notices if "its sign was turned" in notice]


def test_torn_lines_of_a_logger_cost_themselves(logs: dict[str, Path], tmp_path: Path) -> None:
    (whole,) = read_logs([("left_ski", logs["left_ski"])])
    lines = logs["left_ski"].read_text(encoding="utf-8").strip().split("\n")
    lines[40], lines[90] = "reconnected", lines[90].rpartition(",")[0][:20]
    lines[200] = lines[199]
    (tmp_path / "torn.csv").write_text("\n".join(lines), encoding="utf-8")
    (log,) = read_logs([("left_ski", tmp_path / "torn.csv")])
    assert len(log.table.lines) == len(whole.table.lines) - 3
    assert any("2 of" in note and "torn" in note for note in log.notes)
    assert any("1 of" in note and "stands still" in note for note in log.notes)


@pytest.mark.parametrize("zero", [1_234_567.891, 1_551_007_195.25])
def test_a_clock_that_began_long_ago_keeps_its_samples(zero: float, logs: dict[str, Path], tmp_path: Path) -> None:
    table = pd.read_csv(logs["left_ski"])
    table["t_s"] += zero
    table.to_csv(tmp_path / "uptime.csv", index=False, float_format="%.6f")
    (log,) = read_logs([("left_ski", tmp_path / "uptime.csv")])
    write_sensors([log], tmp_path)
    written = read_imu(tmp_path / "sensors" / "left_ski.csv", "left_ski")
    np.testing.assert_allclose(written.time, log.table.columns["time_s"], rtol=0.0, atol=1e-6)
