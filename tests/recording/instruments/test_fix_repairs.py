"""Bad fixes cost themselves: heights and places that no skier reaches, marks for unknown, torn and repeated records."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from fix_files import fit, gpx, nmea, phone
from tiny import Columns, csv, motion

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.frames import Array
from sssi_exudyn.recording.instruments.gps import Gps, read_gps

Spoil = Callable[[str], str]


def read(folder: Path, name: str, content: str | bytes, covered: tuple[float, float] | None = None) -> Gps:
    path = folder / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return read_gps(path, segment="Spine2", offset=np.zeros(3), sigma=0.05, covered=covered)


def length(gps: Gps) -> float:
    return float(np.sum(np.linalg.norm(np.diff(gps.enu, axis=0), axis=1)))


def down() -> Columns:
    """Return a watch's fixes, one a second for 80 s: 8 m/s in wide turns, 2 m/s down from 2600 m."""
    time = np.arange(80.0)
    north, east = 7.0 * time, 25.0 * np.sin(time / 6.0)
    latitude = 47.1 - north / 111_200.0
    return {
        "time_s": time,
        "latitude_deg": latitude,
        "longitude_deg": 11.3 + east / 75_700.0,
        "altitude_m": 2600.0 - 2.0 * time,
    }


def with_heights(columns: Columns, rows: slice | list[int], value: float) -> Columns:
    heights = columns["altitude_m"].copy()
    heights[rows] = value
    return columns | {"altitude_m": heights}


HEIGHTS: dict[str, tuple[str, str | bytes]] = {
    "zero before the barometer wakes": ("a.csv", csv(with_heights(down(), slice(0, 3), 0.0))),
    "raw zero of FIT": ("a.fit", fit(with_heights(down(), [30, 31], -500.0))),
    "a spike": ("a.gpx", gpx(with_heights(down(), [55], 2640.0 + 150.0))),
    "32767 at the end": ("a.csv", csv(with_heights(down(), slice(78, None), 32767.0))),
}


@pytest.mark.parametrize("kind", HEIGHTS)
def test_heights_that_no_skier_reaches_are_not_used_and_counted(tmp_path: Path, kind: str) -> None:
    gps = read(tmp_path, *HEIGHTS[kind])
    whole = read(tmp_path, "whole.csv", csv(down()))
    assert len(gps.time) == len(whole.time)
    # FIT has steps of 0.2 m; gaps of two seconds are bridged by a curve through turns of 0.7 m/s²
    assert length(gps) == pytest.approx(length(whole), rel=0.01)
    np.testing.assert_allclose(gps.enu[:, 2], whole.enu[:, 2] - (whole.enu[0, 2] - gps.enu[0, 2]), atol=0.5)
    assert [note for note in gps.notes if "of 80 height(s) that no skier reaches" in note]


def test_where_a_third_of_the_heights_is_wrong_the_file_is_refused_at_the_first(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"line 42: 25 of 80 height\(s\)"):
        read(tmp_path, "a.csv", csv(with_heights(down(), slice(40, 65), 0.0)))


PLACES: dict[str, tuple[str, str]] = {
    "jump in degrees": ("latitude_deg", "no skier jumps"),
    "longitude of a reset": ("longitude_deg", "no skier jumps"),
}


@pytest.mark.parametrize("kind", PLACES)
def test_a_jump_costs_one_fix(tmp_path: Path, kind: str) -> None:
    column, words = PLACES[kind]
    columns = down()
    columns[column][44] += 0.01
    gps = read(tmp_path, "a.csv", csv(columns))
    assert len(gps.time) == 80  # bridged
    assert length(gps) == pytest.approx(length(read(tmp_path, "whole.csv", csv(down()))), rel=0.01)
    assert [note for note in gps.notes if words in note and "(first: line 46)" in note]


def test_a_lost_fix_at_zero_zero_is_left_out(tmp_path: Path) -> None:
    columns = down()
    columns["latitude_deg"][7] = columns["longitude_deg"][7] = 0.0
    assert [note for note in read(tmp_path, "a.csv", csv(columns)).notes if "1 of 80 fix(es) at latitude" in note]


def with_repeats(columns: Columns, rows: list[int]) -> Columns:
    order = np.sort(np.r_[np.arange(len(columns["time_s"])), rows])
    return {name: column[order] for name, column in columns.items()}


REPEATS: dict[str, tuple[str, str | bytes, str]] = {
    "second written twice": ("a.fit", fit(with_repeats(down(), [12, 50])), "2 of 82 fix(es) whose time"),
    "segments that share a point": ("a.gpx", gpx(with_repeats(down(), [33])), "1 of 81 fix(es) whose time"),
    "clock set back once": (
        "a.csv",
        csv(down() | {"time_s": np.where(np.arange(80) == 40, 3.0, np.arange(80.0))}),
        "1 of 80 fix(es) whose time",
    ),
}


@pytest.mark.parametrize("kind", REPEATS)
def test_repeated_and_disordered_times_cost_themselves(tmp_path: Path, kind: str) -> None:
    name, content, words = REPEATS[kind]
    gps = read(tmp_path, name, content)
    assert (len(gps.time), gps.time[0], gps.time[-1]) == (80, 0.0, 79.0)
    assert [note for note in gps.notes if words in note]


def first_without(tag: str, count: int) -> Spoil:
    return lambda text: text.replace(f"<{tag}>", "<x>", count).replace(f"</{tag}>", "</x>", count)


TORN: dict[str, tuple[str, str | bytes, int, str]] = {
    "no height at first": ("a.gpx", first_without("ele", 5)(gpx(down())), 75, "5 of 80 point(s) without a height"),
    "no time once": ("a.gpx", first_without("time", 1)(gpx(down())), 79, "1 of 80 point(s) without a time"),
    "the app was ended": ("a.gpx", gpx(down())[:8000], 69, "the file ends too early"),
    "the watch died": ("a.fit", fit(down())[:1000], 44, "damaged or ends too early at record 46"),
    "one flipped bit": ("a.fit", fit(down())[:-2] + b"ab", 80, "a wrong checksum"),
    "a torn line": ("a.csv", csv(down()).replace("\n70.0000,", "\n70.", 1), 80, "1 of 80 line(s) that are torn"),
    "text for a number": ("a.csv", csv(down()).replace("\n70.0000,", "\nn/a,", 1), 80, "1 of 80 line(s)"),
    "a torn end": ("a.csv", csv(down())[:-20], 79, "1 of 80 line(s) that are torn"),
    "an empty height": ("a.csv", csv(down()).replace(",2520.0000", ",", 1), 80, "1 of 80 fix(es) without a height"),
}


@pytest.mark.parametrize("kind", TORN)
def test_one_bad_record_costs_one_record(tmp_path: Path, kind: str) -> None:
    name, content, count, words = TORN[kind]
    gps = read(tmp_path, name, content)
    assert len(gps.time) == count
    assert [note for note in gps.notes if words in note]


def between(tag: str, rows: slice) -> Spoil:
    """Take an element from the points of a track at ``rows``."""

    def change(text: str) -> str:
        lines = text.split("\n")
        points = [number for number, line in enumerate(lines) if line.startswith("<trkpt")]
        for number in points[rows]:
            lines[number] = lines[number].replace(f"{tag}>", "x>")
        return "\n".join(lines)

    return change


APART: dict[str, tuple[str, str, str]] = {
    "time and height": (
        "a.gpx",
        between("time", slice(0, 50))(between("ele", slice(50, 78))(gpx(down()))),
        r"50 of 80 point\(s\) without a time; 28 of 80 point\(s\) without a height: the 2 others are no recording",
    ),
    "all of a ride": (
        "a.gpx",
        between("time", slice(0, 50))(between("ele", slice(50, None))(gpx(down()))),
        r"50 of 80 point\(s\) without a time; 30 of 80 point\(s\) without a height: the 0 others",
    ),
    "place and height": (
        "a.csv",
        "\n".join(
            [
                "time_s,latitude_deg,longitude_deg,altitude_m",
                *(f"{n},0,0,500" if n < 40 else f"{n},47.{n},11.3," for n in range(80)),
            ]
        ),
        r"40 of 80 fix\(es\) at latitude and longitude 0; 40 of 80 fix\(es\) without a height: the 0 others",
    ),
}


@pytest.mark.parametrize("kind", APART)
def test_repairs_that_together_leave_no_recording_are_one_clear_line(tmp_path: Path, kind: str) -> None:
    name, content, words = APART[kind]
    with pytest.raises(InputError, match=words) as caught:
        read(tmp_path, name, content)
    assert caught.value.fix.startswith("export the run alone")


def moving(column: str, values: Array) -> str:
    """Return a table of the tiny run with speed and course, one of which is as given."""
    columns = motion(noise=0.0)[1]
    east, north = (np.gradient(x) for x in flat(columns))
    velocity = {
        "speed_mps": 10.0 * np.hypot(east, north),
        "course_deg": np.degrees(np.arctan2(east, north)) % 360.0,
    }
    return csv(columns | velocity | {column: np.where(np.isnan(values), velocity[column], values)})


def flat(columns: Columns) -> tuple[Array, Array]:
    latitude, longitude = columns["latitude_deg"], columns["longitude_deg"]
    return 111_320.0 * np.cos(np.radians(latitude[0])) * (longitude - longitude[0]), 111_170.0 * (
        latitude - latitude[0]
    )


def marks(value: float, rows: slice | list[int]) -> Array:
    column = np.full(81, np.nan)
    column[rows] = value
    return column


UNKNOWN: dict[str, tuple[str, str]] = {
    "course -1 at two of three": (moving("course_deg", marks(-1.0, [i for i in range(81) if i % 3])), "54 of 81"),
    "course 655.35": (moving("course_deg", marks(655.35, [4, 5, 40])), "3 of 81"),
    "speed 32767": (moving("speed_mps", marks(32767.0, [60])), "1 of 81"),
    "speed -1 at first": (moving("speed_mps", marks(-1.0, slice(0, 4))), "4 of 81"),
    "course empty": (moving("course_deg", marks(-77.25, [30, 31])).replace("-77.2500", ""), "2 of 81"),
}


@pytest.mark.parametrize("kind", UNKNOWN)
def test_marks_for_unknown_cost_no_fix_and_are_completed(tmp_path: Path, kind: str) -> None:
    content, share = UNKNOWN[kind]
    gps = read(tmp_path, "a.csv", content)
    whole = read(tmp_path, "whole.csv", moving("speed_mps", np.full(81, np.nan)))
    assert gps.speed is not None
    assert whole.speed is not None
    assert gps.course is not None
    assert whole.course is not None
    assert len(gps.time) == 81
    # linear over 0.4 s of turns of 50 °/s, whose rate changes by 80 °/s²: ½ · 80 · 0.2²
    np.testing.assert_allclose(np.degrees(gps.course - whole.course), 0.0, atol=2.0)
    np.testing.assert_allclose(gps.speed, whole.speed, atol=0.3)  # at the start, 0.4 s at up to 0.7 m/s²
    assert [note for note in gps.notes if share in note and "completed" in note]


def test_a_column_that_is_mostly_unknown_is_left_out_with_its_count(tmp_path: Path) -> None:
    gps = read(tmp_path, "a.csv", moving("course_deg", marks(-1.0, slice(10, 75))))
    assert gps.course is None
    assert [note for note in gps.notes if "65 of 81 fix(es) without course_deg" in note]


def test_a_course_in_signed_degrees_keeps_its_minus_one(tmp_path: Path) -> None:
    columns = motion(noise=0.0)[1]
    columns["course_deg"] = np.linspace(-20.0, 20.0, 81)
    columns["course_deg"][38] = -1.0
    columns["speed_mps"] = np.full(81, 8.1)
    assert read(tmp_path, "a.csv", csv(columns)).notes == ()


def sentences(change: Callable[[str], str]) -> str:
    """Return the tiny run's log with sentences that were changed, and the checksums of these."""
    lines = []
    for number, line in enumerate(nmea(motion()[1]).strip().split("\r\n")):
        body = change(f"{number},{line}").partition(",")[2].partition("*")[0]
        total = int(np.bitwise_xor.reduce(np.frombuffer(body[1:].encode(), np.uint8)))
        lines.append(f"{body}*{total:02X}")
    return "\n".join(lines)


def standing(line: str) -> str:
    number, _, body = line.partition(",")
    if int(number) < 80 and body.startswith("$GPRMC"):
        body = body.replace(",8.00,160.0,", ",0.02,,")
    return f"{number},{body}"


def no_spread(line: str) -> str:
    """Leave the spread of every sixth fix empty."""
    return line.replace(",0.02,,,,0.03,0.04,0.05", ",,,,,,,") if int(line.partition(",")[0]) % 24 == 6 else line


def quality(mark: str) -> Spoil:
    def change(line: str) -> str:
        number, _, body = line.partition(",")
        return f"{number},{body.replace(',4,12,0.8,', mark) if 100 <= int(number) < 112 else body}"

    return change


LOGS: dict[str, tuple[str, int, str]] = {
    "no course while standing": (sentences(standing), 81, "20 of 81 fix(es) without course_deg"),
    "a logger's clock behind the checksum": (
        "\n".join(f"NMEA,{line},{1_700_000_000_000 + n}" for n, line in enumerate(sentences(str).split("\n"))),
        81,
        "",
    ),
    "a logger's clock before it": ("\n".join(f"12:00:01.25 > {line}" for line in sentences(str).split("\n")), 81, ""),
    "spread left empty": (sentences(no_spread), 81, ""),
    "dilution 99.99": (sentences(quality(",1,03,99.99,")), 81, "3 of 243 sentence(s) marked as not exact"),
    "no fix": (sentences(quality(",0,00,0.8,")), 81, "3 of 243 sentence(s) without a fix"),
    "quality left empty": (sentences(quality(",,00,0.8,")), 81, "3 of 243 sentence(s) without a fix"),
    "dead reckoning": (sentences(quality(",6,00,0.8,")), 81, "3 of 243 sentence(s) of places that were estimated"),
    "typed in": (sentences(quality(",7,00,0.8,")), 81, "3 of 243 sentence(s) of places that were estimated"),
    "a simulator": (sentences(quality(",8,00,0.8,")), 81, "3 of 243 sentence(s) of places that were estimated"),
}


@pytest.mark.parametrize("kind", LOGS)
def test_empty_and_marked_fields_of_sentences_are_not_torn(tmp_path: Path, kind: str) -> None:
    content, count, words = LOGS[kind]
    gps = read(tmp_path, "a.nmea", content)
    assert len(gps.time) == count  # what is left out is bridged
    assert gps.speed is not None
    assert not [note for note in gps.notes if "torn" in note]
    assert words == "" or [note for note in gps.notes if words in note]


def test_altitude_in_feet_by_its_own_unit(tmp_path: Path) -> None:
    feet = sentences(lambda line: line.replace(",M,48.0", ",F,48.0"))
    gps = read(tmp_path, "a.nmea", feet)
    whole = read(tmp_path, "b.nmea", sentences(str))
    assert np.ptp(gps.enu[:, 2]) == pytest.approx(0.3048 * np.ptp(whole.enu[:, 2]), rel=1e-3)


def test_altitudes_in_feet_by_a_small_letter(tmp_path: Path) -> None:
    feet = sentences(lambda line: line.replace(",M,48.0", ",f,48.0"))
    large = sentences(lambda line: line.replace(",M,48.0", ",F,48.0"))
    np.testing.assert_array_equal(read(tmp_path, "a.nmea", feet).enu, read(tmp_path, "b.nmea", large).enu)


@pytest.mark.parametrize("mark", ["6", "8"])
def test_a_log_of_places_that_nobody_measured_is_refused(tmp_path: Path, mark: str) -> None:
    log = sentences(lambda line: line.replace(",4,12,0.8,", f",{mark},12,0.8,"))
    fixes_alone = "\n".join(line for line in log.split("\n") if "GGA" in line)
    with pytest.raises(InputError, match=r"estimated, typed in or simulated.*log what the receiver measures"):
        read(tmp_path, "a.nmea", fixes_alone)


def second_60(line: str) -> str:
    """Write the first whole minute as second 60 of the one before, as in a leap second."""
    return line.replace(",000000.", ",235960.")


def test_second_60_is_the_next_minutes_first(tmp_path: Path) -> None:
    text = sentences(str)
    leap = sentences(second_60)
    assert leap.count(",235960.") > 3
    np.testing.assert_allclose(read(tmp_path, "a.nmea", leap).enu, read(tmp_path, "b.nmea", text).enu, atol=1e-9)
    assert read(tmp_path, "a.nmea", leap).notes == read(tmp_path, "a.nmea", text).notes


@pytest.mark.parametrize("clock", ["235961.00", "236060.00", "24:00:60", "60"])
def test_a_second_that_no_clock_has_is_torn(tmp_path: Path, clock: str) -> None:
    log = sentences(lambda line: line.replace(",000000.00,", f",{clock},"))
    assert any("torn" in note for note in read(tmp_path, "a.nmea", log).notes)


UNUSED: dict[str, Callable[[int], str]] = {
    "a provider": lambda line: "fused" if line else "provider",
    "nothing": lambda line: "" if line else "msl_m",
    "a note here and there": lambda line: "note" if line in (0, 9) else "7.5",
}


@pytest.mark.parametrize("kind", UNUSED)
def test_columns_that_are_not_used_may_hold_anything(tmp_path: Path, kind: str) -> None:
    lines = enumerate(csv(down()).strip().split("\n"))
    gps = read(tmp_path, "a.csv", "\n".join(f"{line},{UNUSED[kind](number)}" for number, line in lines))
    assert len(gps.time) == 80
    assert gps.notes[0].startswith("a.csv: columns not used")


def test_a_telephone_leaves_cells_empty_that_are_not_used(tmp_path: Path) -> None:
    header, *rows = phone(motion()[1]).strip().split("\n")
    text = "\n".join([f"{header},altitudeAboveMeanSeaLevel", *(f"{row}," for row in rows)])
    gps = read(tmp_path, "Location.csv", text)
    assert len(gps.time) == 81


def day() -> Columns:
    """Return fixes, two a second: 100 s up a lift, a pause of 20 s, and 40 s of skiing down at 8 m/s."""
    time = np.r_[np.arange(0.0, 100.0, 0.5), np.arange(120.0, 160.0, 0.5)]
    along = np.where(time < 110.0, 4.0 * time, 440.0 - 8.0 * (time - 120.0))
    return {
        "time_s": time,
        "latitude_deg": 46.2 + along / 111_200.0,
        "longitude_deg": 8.1 + 3.0 * np.sin(time / 2.0) / 77_000.0,
        "altitude_m": 1500.0 + 0.3 * along,
    }


@pytest.mark.parametrize("covered", [(118.0, 150.0), None, (-5.0, 400.0), (99.0, 135.0)])
def test_of_a_track_with_pauses_the_skiing_is_kept(tmp_path: Path, covered: tuple[float, float] | None) -> None:
    gps = read(tmp_path, "day.gpx", gpx(day()), covered)
    assert (gps.time[0], gps.time[-1]) == pytest.approx((120.0, 159.5))
    assert [note for note in gps.notes if "the others are left out: 0.00 to 99.50 s" in note]


def test_where_only_the_way_up_was_captured_that_part_is_kept(tmp_path: Path) -> None:
    gps = read(tmp_path, "day.csv", csv(day()), (10.0, 40.0))
    assert (gps.time[0], gps.time[-1]) == pytest.approx((0.0, 99.5))


def test_fixes_that_a_logger_repeats_count_once(tmp_path: Path) -> None:
    columns = {name: np.repeat(column, 5) for name, column in down().items()}
    columns["time_s"] = np.arange(400) / 5.0
    gps = read(tmp_path, "a.csv", csv(columns))
    np.testing.assert_allclose(gps.time, np.arange(80.0))
    assert [note for note in gps.notes if "320 of 400 fix(es) that repeat the one before" in note]


@pytest.mark.parametrize(("digits", "error"), [(5, 0.32), (4, 3.2)])
def test_rounded_degrees_widen_the_fixes(tmp_path: Path, digits: int, error: float) -> None:
    columns = down()
    rounded = {name: np.round(columns[name], digits) for name in ("latitude_deg", "longitude_deg")}
    gps = read(tmp_path, "a.csv", csv(columns | rounded))
    assert gps.sigma[10] == pytest.approx(np.hypot(0.05, error), rel=0.01)  # a step of 10⁻ᵈ · 111.2 km over √12
    assert [note for note in gps.notes if f"{digits} decimals" in note]
