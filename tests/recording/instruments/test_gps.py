"""Readers of fixes: east-north-up, gaps, units, and broken files."""

from __future__ import annotations

from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest
from tiny import Columns, csv, motion

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.recording.instruments.gps import Gps, read_gps

OFFSET = np.array([0.0, 0.1, -0.16])


def read(path: Path, sigma: float | None = 0.02, time_offset: float = 0.0) -> Gps:
    return read_gps(path, segment="Spine2", offset=OFFSET, sigma=sigma, time_offset=time_offset)


def write_csv(folder: Path, columns: Columns) -> Path:
    path = folder / "gps.csv"
    path.write_text(csv(columns), encoding="utf-8")
    return path


def write_gpx(folder: Path, columns: Columns, head: str = "") -> Path:
    start = datetime(2026, 2, 1, 10, 0, 0, tzinfo=UTC)
    points = "".join(
        f'<trkpt lat="{lat:.9f}" lon="{lon:.9f}"><ele>{ele:.4f}</ele>'
        f"<time>{(start + timedelta(seconds=time)).isoformat()}</time></trkpt>\n"
        for time, lat, lon, ele in zip(*columns.values(), strict=True)
    )
    path = folder / "gps.gpx"
    path.write_text(
        f'<?xml version="1.0"?>\n{head}<gpx version="1.1" xmlns="http://www.topografix.com/GPX/1/1">'
        f"<trk><trkseg>\n{points}</trkseg></trk></gpx>",
        encoding="utf-8",
    )
    return path


def test_east_north_up_against_the_ellipsoids_radii(tmp_path: Path) -> None:
    lat, lon, alt = np.deg2rad(46.8), np.deg2rad(9.8), 2000.0
    a, f = 6378137.0, 1.0 / 298.257223563
    e2 = f * (2.0 - f)
    w = np.sqrt(1.0 - e2 * np.sin(lat) ** 2)
    meridian, normal = a * (1.0 - e2) / w**3, a / w
    step = np.linspace(0.0, 1.0, 11)
    east, north, up = 30.0 * step, -40.0 * step, -10.0 * step
    columns = {
        "time_s": 5.0 * step,
        "latitude_deg": np.rad2deg(lat + north / (meridian + alt)),
        "longitude_deg": np.rad2deg(lon + east / ((normal + alt) * np.cos(lat))),
        "altitude_m": alt + up,
    }
    gps = read(write_csv(tmp_path, columns))
    # nine digits of a degree are 0.1 mm; the earth's curve over 50 m lowers by 0.2 mm and, as the height changes by
    # 10 m, stretches 40 m by 0.06 mm
    np.testing.assert_allclose(gps.enu, np.column_stack([east, north, up]), atol=5e-4)
    assert gps.origin == pytest.approx((46.8, 9.8, 2000.0))


def test_gpx_and_csv_agree(tmp_path: Path) -> None:
    columns = motion()[1]
    one, other = read(write_csv(tmp_path, columns)), read(write_gpx(tmp_path, columns), time_offset=1.5)
    np.testing.assert_allclose(one.enu, other.enu, atol=1e-9)  # the same digits in both files
    np.testing.assert_allclose(one.time + 1.5, other.time, atol=1e-6)  # GPX has microseconds


def test_optional_columns_are_read_in_si(tmp_path: Path) -> None:
    columns = motion()[1]
    count = len(columns["time_s"])
    columns["speed_mps"] = np.full(count, 8.1)
    columns["course_deg"] = (np.linspace(350.0, 370.0, count)) % 360.0
    columns["sigma_m"] = np.linspace(0.02, 0.05, count)
    columns["satellites"] = np.full(count, 12.0)
    gps = read(write_csv(tmp_path, columns), sigma=None)
    assert gps.speed is not None
    assert gps.course is not None
    assert gps.speed[0] == 8.1
    assert np.all(np.diff(gps.course) > 0.0)  # unwrapped over north
    assert np.ptp(gps.course) == pytest.approx(np.deg2rad(20.0), abs=1e-6)  # four digits in the file
    assert gps.sigma[-1] == 0.05
    assert any("satellites" in note for note in gps.notes)


def test_short_gap_is_bridged_and_noted(tmp_path: Path) -> None:
    whole = read(write_csv(tmp_path, motion(noise=0.0)[1]))
    columns = {name: np.delete(column, slice(30, 35)) for name, column in motion(noise=0.0)[1].items()}
    gps = read(write_csv(tmp_path, columns))
    np.testing.assert_allclose(gps.time, whole.time, atol=1e-9)
    # a straight line would cut the turn's corner by a·t²/8 = 3.7 m/s²·(0.6 s)²/8 = 0.17 m; a curve must do far better
    np.testing.assert_allclose(gps.enu, whole.enu, atol=0.04)
    assert np.all(gps.sigma[30:35] > 0.1)  # ½·5 m/s²·(0.3 s)²
    assert np.all(np.delete(gps.sigma, slice(30, 35)) == 0.02)
    assert any("interpolated" in note and "2.90 to 3.50" in note for note in gps.notes)


def test_long_gap_splits_and_the_longest_part_stays(tmp_path: Path) -> None:
    columns = {name: np.delete(column, slice(20, 45)) for name, column in motion()[1].items()}
    gps = read(write_csv(tmp_path, columns))
    assert gps.time[0] == pytest.approx(4.5)
    assert gps.time[-1] == pytest.approx(8.0)
    assert any("split" in note for note in gps.notes)


def test_slow_receiver_has_no_gaps(tmp_path: Path) -> None:
    columns = {name: column[::10] for name, column in motion()[1].items()}
    gps = read(write_csv(tmp_path, columns))
    assert len(gps.time) == 9
    assert gps.notes == ()


def put(name: str, row: int, value: float) -> Callable[[Columns], Columns]:
    def change(columns: Columns) -> Columns:
        columns[name][row] = value
        return columns

    return change


def whole(name: str, value: float) -> Callable[[Columns], Columns]:
    def change(columns: Columns) -> Columns:
        return columns | {name: np.full_like(columns["time_s"], value)}

    return change


def swap(columns: Columns) -> Columns:
    lat, lon = columns["latitude_deg"], columns["longitude_deg"]
    return columns | {"latitude_deg": lon + 100.0, "longitude_deg": lat}


FAULTS: dict[str, tuple[Callable[[Columns], Columns], str, str]] = {
    "time stands still": (lambda c: c | {"time_s": c["time_s"] // 1.0}, "line 3", "time stands still"),
    "time runs back": (lambda c: c | {"time_s": c["time_s"][::-1].copy()}, "line 2", "runs back"),
    "swapped": (swap, "line 2, latitude_deg", "swapped"),
    "no longitude": (whole("longitude_deg", 200.0), "longitude_deg", "no longitude"),
    "constant latitude": (whole("latitude_deg", 46.8), "column latitude_deg", "constant"),
    "constant altitude": (whole("altitude_m", 2000.0), "column altitude_m", "constant"),
    "altitude in feet": (lambda c: c | {"altitude_m": c["altitude_m"] + 9500.0}, "line 2, altitude_m", "outside"),
    "jumps": (lambda c: c | {"latitude_deg": c["latitude_deg"] + np.arange(81) % 2}, "line", "no skier jumps"),
    "kilometres an hour": (whole("speed_mps", 8.1 * 3.6), "column speed_mps", "km/h"),
    "knots": (whole("speed_mps", 8.1 * 1.944), "column speed_mps", "knots"),
    "speed of sound": (whole("speed_mps", 340.0), "speed_mps", "outside"),
    "negative sigma": (whole("sigma_m", -1.0), "sigma_m", "outside"),
    "column missing": (lambda c: {n: v for n, v in c.items() if n != "altitude_m"}, "header", "altitude_m"),
    "one sample": (lambda c: {n: v[:1] for n, v in c.items()}, "", "1 samples"),
    "only gaps": (lambda c: c | {"time_s": c["time_s"] + 5.0 * (np.arange(81) // 5)}, "time_s", "gap"),
    "at rest": (lambda c: {n: v[:2].repeat(2) + 1e-7 * np.arange(4) * (n != "time_s") for n, v in c.items()}
                | {"time_s": np.arange(4.0)}, "", "lies within"),
    "radians": (lambda c: c | {n: np.deg2rad(c[n]) for n in ("latitude_deg", "longitude_deg")}, "", "lies within"),
}  # fmt: skip


@pytest.mark.parametrize("fault", FAULTS)
def test_faulty_columns_are_named_with_place_and_fix(tmp_path: Path, fault: str) -> None:
    change, place, problem = FAULTS[fault]
    path = write_csv(tmp_path, change(motion()[1]))
    with pytest.raises(InputError) as caught:
        read(path)
    assert str(path) in str(caught.value)
    assert place in caught.value.place
    assert problem in caught.value.problem
    assert caught.value.fix
    assert "\n" not in str(caught.value)


def ride(speed_unit: float, *, noise: float, turns: float, course: bool) -> Columns:
    """Return two minutes of a receiver's fixes, one a second: 6 to 9 m/s over ground, 12° down.

    Parameters
    ----------
    speed_unit : unit of the speed, in a m/s;  noise : standard deviation of a fix, m
    turns : the largest angle of the track from the fall line, rad, in turns of 5 s;  course : whether it is written
    """
    time = np.arange(0.0, 120.0, 0.1)
    speed = 7.5 + 1.5 * np.sin(time / 9.0)
    heading = np.pi + turns * np.sin(2.0 * np.pi * time / 5.0)
    north, east = (0.1 * np.cumsum(speed * part(heading)) for part in (np.cos, np.sin))
    lost = np.random.default_rng(4).normal(0.0, noise, (2, 120))
    columns = {
        "time_s": time[::10],
        "latitude_deg": 46.8 + (north[::10] + lost[0]) / 111_200.0,
        "longitude_deg": 9.8 + (east[::10] + lost[1]) / 76_200.0,
        "altitude_m": 2500.0 - np.tan(np.radians(12.0)) * 0.1 * np.cumsum(speed)[::10],
        "speed_mps": speed_unit * speed[::10],
        "sigma_m": np.full(120, max(noise, 0.02)),
    }
    return columns | ({"course_deg": np.degrees(heading[::10]) % 360.0} if course else {})


RIDES: dict[str, tuple[Columns, str]] = {
    "km/h, noise and a course": (ride(3.6, noise=3.0, turns=0.2, course=True), "like km/h;"),
    "km/h and noise": (ride(3.6, noise=3.0, turns=0.2, course=False), "like km/h or feet per second;"),
    "feet, noise and a course": (ride(3.281, noise=3.0, turns=0.2, course=True), "like feet per second;"),
    "knots, turns and a course": (ride(1.944, noise=0.0, turns=0.8, course=True), "like knots;"),
    "knots and turns": (ride(1.944, noise=0.0, turns=0.8, course=False), "like knots;"),
    "mph and turns": (ride(2.237, noise=0.0, turns=0.8, course=False), "like mph;"),
}


@pytest.mark.parametrize("kind", RIDES)
def test_the_unit_of_a_speed_shows_through_noise_and_turns(tmp_path: Path, kind: str) -> None:
    columns, words = RIDES[kind]
    with pytest.raises(InputError, match=words):
        read(write_csv(tmp_path, columns))


@pytest.mark.parametrize("course", [True, False])
@pytest.mark.parametrize(("noise", "turns"), [(0.0, 0.1), (5.0, 0.2), (0.0, 1.2), (3.0, 1.2)])
def test_a_speed_in_metres_per_second_is_taken(tmp_path: Path, noise: float, turns: float, course: bool) -> None:
    assert read(write_csv(tmp_path, ride(1.0, noise=noise, turns=turns, course=course))).speed is not None


TEXT_FAULTS = {
    "text": (lambda t: t.replace(",46.", ",N46."), "line 2"),
    "no header": (lambda t: t.split("\n", 1)[1], "line 1"),
    "column twice": (lambda t: t.replace("altitude_m", "time_s"), "line 1"),
    "header only": (lambda t: t.split("\n", 1)[0], ""),
    "empty": (lambda t: "", ""),
    "blank": (lambda t: "\n \n", ""),
}


@pytest.mark.parametrize("fault", TEXT_FAULTS)
def test_broken_text_is_named_with_its_line(tmp_path: Path, fault: str) -> None:
    change, place = TEXT_FAULTS[fault]
    path = tmp_path / "gps.csv"
    path.write_text(change(csv(motion()[1])), encoding="utf-8")
    with pytest.raises(InputError) as caught:
        read(path)
    assert caught.value.place.startswith(place)
    assert caught.value.fix


def test_text_in_another_encoding(tmp_path: Path) -> None:
    path = tmp_path / "gps.csv"
    path.write_bytes(csv(motion()[1]).encode("utf-16"))
    with pytest.raises(InputError, match="UTF-8"):
        read(path)


def test_byte_order_mark_carriage_returns_and_blank_lines_are_harmless(tmp_path: Path) -> None:
    path = tmp_path / "gps.csv"
    plain = read(write_csv(tmp_path, motion()[1]))
    path.write_bytes(b"\xef\xbb\xbf" + csv(motion()[1]).replace("\n", "\r\n").encode() + b"\r\n\r\n")
    np.testing.assert_array_equal(read(path).enu, plain.enu)


@pytest.mark.parametrize(
    "head",
    [
        '<!DOCTYPE gpx [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;&a;&a;">]>\n',
        '<!DOCTYPE gpx [<!ENTITY a SYSTEM "file:///etc/hostname">]>\n',
        '<!DOCTYPE gpx SYSTEM "gpx.dtd">\n',
    ],
)
def test_gpx_with_entities_is_refused(tmp_path: Path, head: str) -> None:
    with pytest.raises(InputError, match="entities are not accepted"):
        read(write_gpx(tmp_path, motion()[1], head))


GPX_FAULTS = {
    "broken XML": (lambda t: t.replace("</ele>", "</height>", 1), "line"),
    "torn at once": (lambda t: t[:300], "line"),
    "no time": (lambda t: t.replace("time>", "when>"), "trkpt 1"),
    "no elevation": (lambda t: t.replace("ele>", "el>"), "trkpt 1"),
    "text": (lambda t: t.replace("<ele>", "<ele>high"), "trkpt 1"),
    "not a date": (lambda t: t.replace("<time>2026-02-01T", "<time>noon"), "trkpt 1"),
    "no track": (lambda t: t.replace("trkpt", "wpt"), ""),
}


@pytest.mark.parametrize("fault", GPX_FAULTS)
def test_faulty_gpx_is_named_with_place_and_fix(tmp_path: Path, fault: str) -> None:
    change, place = GPX_FAULTS[fault]
    path = write_gpx(tmp_path, motion()[1])
    text = path.read_text(encoding="utf-8")
    assert change(text) != text
    path.write_text(change(text), encoding="utf-8")
    with pytest.raises(InputError) as caught:
        read(path)
    assert caught.value.place.startswith(place)
    assert caught.value.fix


def test_unknown_format_and_missing_sigma(tmp_path: Path) -> None:
    path = tmp_path / "gps.kml"
    path.write_bytes(b"x")
    with pytest.raises(InputError, match=r"no reader for '\.kml'"):
        read(path)
    with pytest.raises(InputError, match="sigma_m"):
        read(write_csv(tmp_path, motion()[1]), sigma=None)
