"""Whole recordings whose instruments contradict each other: units, sides, clocks, frames; and none that do not."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from tiny import SKELETON, TOML, Columns, Tiny, loads, motion

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.frames import GRAVITY
from sssi_exudyn.recording.cross_checks.catalogue import CHECKS
from sssi_exudyn.recording.read import read_recording

WEIGHT = (70.0 + 2.0 * (2.4 + 1.9)) * GRAVITY


def notices(folder: Path, tiny: Tiny) -> str:
    return "\n".join(read_recording(tiny.write(folder)).notices)


def test_every_check_says_what_it_compares() -> None:
    words = [check.compares for check in CHECKS]
    assert len(set(words)) == len(CHECKS)
    assert all(" with " in sentence for sentence in words)


def test_a_recording_without_faults_is_left_alone(tmp_path: Path) -> None:
    assert notices(tmp_path, Tiny()) == ""


def scaled(factor: float) -> Columns:
    """Return insoles whose mean is the weight of skier, boots and skis, times ``factor``."""
    columns = loads(2)
    mean = float(np.mean(sum(column for name, column in columns.items() if name != "time_s")))
    return {name: column * (1.0 if name == "time_s" else factor * WEIGHT / mean) for name, column in columns.items()}


@pytest.mark.parametrize(
    ("factor", "unit"),
    [
        (1.0 / GRAVITY, "kilograms"),
        (100.0 / (70.0 * GRAVITY), "percent of the weight"),
        (0.93 / (0.45359 * GRAVITY), "pounds"),
        (0.9 / GRAVITY, "kilograms"),
        (0.001, "kilonewtons"),
    ],
)
def test_loads_in_another_unit_are_refused_with_the_factor(tmp_path: Path, factor: float, unit: str) -> None:
    with pytest.raises(InputError, match=f"that looks like {unit}; convert the forces to newtons"):
        read_recording(Tiny(insoles=scaled(factor)).write(tmp_path))


@pytest.mark.parametrize("factor", [0.4, 0.7, 1.2])
def test_loads_that_cuffs_and_turns_explain_are_taken(tmp_path: Path, factor: float) -> None:
    assert notices(tmp_path, Tiny(insoles=scaled(factor))) == ""


@pytest.mark.parametrize("factor", [1e3, 2e3 / 3.0])
def test_insoles_in_milliseconds(tmp_path: Path, factor: float) -> None:
    columns = loads(4)
    with pytest.raises(InputError, match="milliseconds: "):
        read_recording(Tiny(insoles=columns | {"time_s": factor * columns["time_s"]}).write(tmp_path))


def exchanged(columns: Columns) -> Columns:
    words = {"left": "right", "right": "left"}
    return {
        name if name == "time_s" else f"{words[name.partition('_')[0]]}_{name.partition('_')[2]}": column
        for name, column in columns.items()
    }


def later(columns: Columns) -> Columns:
    """Return loads half a turn later, which is the same as exchanged feet."""
    return columns | {name: np.roll(column, 100) for name, column in columns.items() if name != "time_s"}


@pytest.mark.parametrize("change", [exchanged, later, lambda c: exchanged(scaled(0.8))])
def test_the_inside_foot_is_not_the_loaded_one(tmp_path: Path, change: Callable[[Columns], Columns]) -> None:
    assert "the loaded foot is the inside one in the turns" in notices(tmp_path, Tiny(insoles=change(loads(4))))


def clipped(share: float, *names: str) -> Columns:
    """Return loads that end at a share of their largest value, in some columns."""
    columns = loads(2)
    return columns | {name: np.minimum(columns[name], share * np.max(columns[name])) for name in names}


@pytest.mark.parametrize(
    ("insoles", "words"),
    [
        (clipped(0.9, "left_1_N", "left_2_N"), "the left foot's load stands at its largest value for"),
        (clipped(0.95, "right_1_N"), "the right foot's load of 1 cell(s) stands at its largest value for"),
        (clipped(0.8, "right_1_N", "right_2_N", "left_1_N"), "the left foot's load of 1 cell(s) stands"),
    ],
)
def test_insoles_at_the_end_of_their_range_are_noticed(tmp_path: Path, insoles: Columns, words: str) -> None:
    assert words in notices(tmp_path, Tiny(insoles=insoles))


@pytest.mark.parametrize(("seconds", "factor"), [(4.0, 1.0), (4.0, 0.85), (5.5, 1.2)])
def test_a_turn_or_two_say_nothing_of_a_clock(tmp_path: Path, seconds: float, factor: float) -> None:
    rotations, gps = motion(swing=2.5)
    short = {name: column[: round(10.0 * seconds) + 1] for name, column in gps.items()}
    tiny = Tiny(toml=TOML.split("[insoles]")[0], rotations=rotations, gps=short, frame_time=factor / 60.0)
    assert "pace" not in notices(tmp_path, tiny)


EXAMPLES = Path(__file__).parents[3] / "examples"


@pytest.mark.parametrize(("name", "offset"), [("intermediate", 1.5), ("intermediate", -1.2), ("intermediate", 2.4)])
def test_a_clock_that_is_off_shows_in_the_turns(tmp_path: Path, name: str, offset: float) -> None:
    folder = tmp_path / name
    shutil.copytree(EXAMPLES / name, folder)
    toml = (folder / "recording.toml").read_text(encoding="utf-8")
    moved = toml.replace('file = "motion.bvh"', f'file = "motion.bvh"\ntime_offset_s = {offset}')
    (folder / "recording.toml").write_text(moved.replace("heading_deg", "# heading_deg"), encoding="utf-8")
    try:
        words = "\n".join(read_recording(folder).notices)
    except InputError as error:  # off by half a turn, it may also be a mirrored track
        words = str(error)
        assert "swapped, or the clocks" in words
    best_shift = float(words.split("add ")[1].partition(" s to")[0])
    assert best_shift == pytest.approx(-offset, abs=0.4)  # skidding skis turn up to half a second before the course


def frames(change: Callable[[Columns], None]) -> Tiny:
    tiny = Tiny()
    for name in tiny.rotations:
        tiny.rotations[name] = tiny.rotations[name] + (30.0 if name.endswith(("UpLeg", "Leg")) else 0.0) * np.array(
            [0.0, 1.0 if name.endswith("UpLeg") else -1.0, 0.0]
        )
    change(tiny.rotations)
    return tiny


def zero(rows: slice) -> Callable[[Columns], None]:
    def change(rotations: Columns) -> None:
        for angles in rotations.values():
            angles[rows] = 0.0

    return change


def straight(rotations: Columns) -> None:
    """Put a pose with arms down and straight legs first, which is not all zero."""
    for name, angles in rotations.items():
        angles[0] = 80.0 if name == "LeftArm" else 0.0


POSES: dict[str, tuple[Callable[[Columns], None], str]] = {
    "T-pose first": (zero(slice(0, 1)), "1 of 481 frame(s) without movement"),
    "another pose first": (straight, "1 of 481 frame(s) without movement"),
    "three T-poses last": (zero(slice(-3, None)), "3 of 481 frame(s) without movement"),
    "lost for a third of a second": (zero(slice(200, 220)), "20 of 481 frame(s) without movement"),
}


@pytest.mark.parametrize("kind", POSES)
def test_frames_without_movement_are_not_used(tmp_path: Path, kind: str) -> None:
    change, words = POSES[kind]
    recording = read_recording(frames(change).write(tmp_path))
    assert [notice for notice in recording.notices if words in notice]
    knee = recording.bvh.rotations[:, recording.bvh.index("RightLeg")]
    bent = np.degrees(np.arccos(0.5 * (np.trace(knee, axis1=1, axis2=2) - 1.0)))
    np.testing.assert_allclose(bent, 30.0, atol=0.3)  # the joint trembles by 0.1° about each axis
    # the clock stays: what is cut off at the start does not move the rest
    assert recording.bvh.time[0] == pytest.approx(1.0 / 60.0 if "first" in kind else 0.0, abs=1e-6)


def test_a_second_of_zeros_within_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="frame 201: the 90 frames from here on are zero"):
        read_recording(frames(zero(slice(200, 290))).write(tmp_path))


@pytest.mark.parametrize("bent", [35.0, 60.0, 100.0])
def test_a_capture_in_radians_is_taken_as_such(tmp_path: Path, bent: float) -> None:
    tiny = frames(lambda _: None)
    swing = bent * np.sin(np.linspace(0.0, 9.0, 481)) ** 2
    tiny.rotations["RightLeg"][:, 1] = swing
    expected = read_recording(tiny.write(tmp_path / "degrees"))
    tiny.rotations = {name: np.radians(angles) for name, angles in tiny.rotations.items()}
    recording = read_recording(tiny.write(tmp_path / "radians"))
    np.testing.assert_allclose(recording.bvh.rotations, expected.bvh.rotations, atol=2e-5)  # five digits of a radian
    assert [notice for notice in recording.notices if "taken as radians" in notice]


def test_a_capture_that_stops_and_joints_that_jump_are_noticed(tmp_path: Path) -> None:
    def stop(rotations: Columns) -> None:
        for angles in rotations.values():
            angles[100:200] = angles[100]
        rotations["LeftLeg"][300] += [0.0, 60.0, 0.0]

    words = notices(tmp_path, frames(stop))
    assert "nothing moves from 1.67 to 3.32 s" in words
    assert "turn faster than 1500 °/s 2 time(s), first at 4.98 s" in words


def test_a_way_up_is_no_run(tmp_path: Path) -> None:
    tiny = Tiny()
    heights = tiny.gps["altitude_m"]
    tiny.gps["altitude_m"] = 2.0 * heights[0] - heights
    with pytest.raises(InputError, match=r"gps.csv: column altitude_m: the track climbs by 1\d m"):
        read_recording(tiny.write(tmp_path))


@pytest.mark.parametrize("seconds", [3.0, 1.2, 5.0])
def test_a_capture_that_is_frozen_is_noticed(tmp_path: Path, seconds: float) -> None:
    def freeze(rotations: Columns) -> None:
        for angles in rotations.values():
            angles[60 : 61 + round(60.0 * seconds)] = angles[60]

    assert f"nothing moves from 1.00 to {1.0 + seconds:.2f} s: the capture stopped" in notices(tmp_path, frames(freeze))


def test_a_skier_who_hardly_moves_is_noticed(tmp_path: Path) -> None:
    tiny = Tiny()
    for name in ("latitude_deg", "longitude_deg", "altitude_m"):
        tiny.gps[name] = tiny.gps[name][0] + 0.08 * (tiny.gps[name] - tiny.gps[name][0])
    assert "the mean speed over ground is 0.6" in notices(tmp_path, tiny)


def test_a_capture_that_ends_too_early_is_read(tmp_path: Path) -> None:
    folder = Tiny().write(tmp_path)
    text = (folder / "motion.bvh").read_text(encoding="utf-8")
    (folder / "motion.bvh").write_text("\n".join(text.split("\n")[:-20])[:-10], encoding="utf-8")
    recording = read_recording(folder)
    assert len(recording.bvh.time) == 481 - 20  # 19 lines, and the torn one
    assert [notice for notice in recording.notices if "announces 481 frames" in notice]


def test_loads_with_text_and_torn_lines(tmp_path: Path) -> None:
    folder = Tiny().write(tmp_path)
    lines = (folder / "insoles.csv").read_text(encoding="utf-8").strip().split("\n")
    lines = [f"{line},{'comment' if number == 0 else 'ok'}" for number, line in enumerate(lines)]
    lines[50], lines[60] = lines[50][:30], lines[59]
    (folder / "insoles.csv").write_text("\n".join(lines), encoding="utf-8")
    words = "\n".join(read_recording(folder).notices)
    assert "1 of 401 line(s) that are torn" in words
    assert "1 of 400 line(s) whose time stands still" in words
    assert "columns not used: comment" in words


def test_names_of_the_skeleton_are_those_of_the_checks() -> None:
    names = {name for name, _, _ in SKELETON}
    assert {"LeftLeg", "RightLeg", "LeftFoot", "RightFoot"} <= names
    assert set(motion()[0]) == names
