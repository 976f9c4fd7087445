"""Fixes of receivers, watches and telephones: the same track from each, and broken files."""

from __future__ import annotations

import io
import sys
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from fix_files import START, fit, gnss_logger, nmea, phone, rtklib, ski_app, tcx
from tiny import Columns, motion

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.recording.instruments.gps import read_fixes


def track(step: int = 1) -> Columns:
    """Return every ``step``-th of the tiny recording's fixes, ten per second."""
    return {name: column[::step] for name, column in motion()[1].items()}


def write(folder: Path, name: str, content: str | bytes) -> Path:
    path = folder / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


# name, content, track, and what the format resolves: degrees and metres
FORMATS: dict[str, tuple[str | bytes, Columns, float, float]] = {
    "track.nmea": (nmea(track()), track(), 1e-9, 1e-3),  # seven digits of a minute; millimetres
    "watch.fit": (fit(track(10)), track(10), 5e-8, 0.1),  # half a semicircle of 84 nano-degrees; 1/5 m
    "Location.csv": (phone(track()), track(), 1e-9, 1e-3),
    "watch.tcx": (tcx(track()), track(), 1e-9, 1e-3),
    "day.skiz": (ski_app(track(), ".skiz"), track(), 1e-9, 1e-3),
    "day.slopes": (ski_app(track(), ".slopes"), track(), 1e-9, 1e-3),
    "gnss_log.txt": (gnss_logger(track()), track(), 1e-9, 1e-3),
    "untitled.txt": (gnss_logger(track(), titles=False), track(), 1e-9, 1e-3),
    "degrees.pos": (rtklib(track()), track(), 1e-9, 1e-3),
    "minutes.pos": (rtklib(track(), "minutes"), track(), 1e-9, 1e-3),
    "ecef.pos": (rtklib(track(), "ecef"), track(), 2e-9, 1e-3),  # tenths of a millimetre
    "weeks.pos": (rtklib(track(), weeks=True), track(), 1e-9, 1e-3),
    "utc.pos": (rtklib(track(), clock="UTC"), track(), 1e-9, 1e-3),
    "japan.pos": (rtklib(track(), clock="JST"), track(), 1e-9, 1e-3),
}


@pytest.mark.parametrize("name", FORMATS)
def test_every_format_gives_the_track(tmp_path: Path, name: str) -> None:
    content, expected, degrees, metres = FORMATS[name]
    fixes = read_fixes(write(tmp_path, name, content))
    np.testing.assert_allclose(fixes.columns["time_s"], expected["time_s"] - expected["time_s"][0], atol=1e-6)
    for angle in ("latitude_deg", "longitude_deg"):
        np.testing.assert_allclose(fixes.columns[angle], expected[angle], atol=degrees)
    np.testing.assert_allclose(fixes.columns["altitude_m"], expected["altitude_m"], atol=metres)
    assert fixes.began == pytest.approx(START.timestamp(), abs=1e-6)
    assert not fixes.common_clock
    assert len(fixes.places) == len(expected["time_s"])


def test_nmea_speed_course_and_spread(tmp_path: Path) -> None:
    columns = read_fixes(write(tmp_path, "track.nmea", nmea(track(), knots=8.0, course=160.0))).columns
    assert columns["speed_mps"] == pytest.approx(8.0 * 1852.0 / 3600.0)
    assert columns["course_deg"] == pytest.approx(160.0)
    assert columns["sigma_m"] == pytest.approx(np.hypot(0.03, 0.04) / np.sqrt(2.0))


def test_a_spread_holds_until_the_next_one(tmp_path: Path) -> None:
    """Receivers send fewer GST than fixes: here every fourth, in which the first fix has none."""
    lines = nmea(track(), knots=8.0, course=160.0).split("\r\n")
    spreads = [i for i, line in enumerate(lines) if "GST" in line]
    kept = [line for i, line in enumerate(lines) if i not in spreads or spreads.index(i) % 4 == 1]
    whole = read_fixes(write(tmp_path, "whole.nmea", "\r\n".join(lines)))
    sparse = read_fixes(write(tmp_path, "sparse.nmea", "\r\n".join(kept)))
    assert len(sparse.columns["time_s"]) == len(whole.columns["time_s"])
    np.testing.assert_allclose(sparse.columns["sigma_m"], whole.columns["sigma_m"])


def test_nmea_torn_and_lost_sentences_are_left_out_and_noted(tmp_path: Path) -> None:
    lines = nmea(track()).split("\r\n")
    lines[40] = lines[40][:30]
    lines[80] = lines[80].replace("E,4,", "E,0,").rsplit("*", 1)[0]
    lines[80] += f"*{int(np.bitwise_xor.reduce(np.frombuffer(lines[80][1:].encode(), np.uint8))):02X}"
    fixes = read_fixes(write(tmp_path, "track.nmea", "\n".join(lines)))
    assert len(fixes.places) == len(track()["time_s"]) - 2
    assert any("1 of 243 sentence(s) that are torn" in note and "line 41" in note for note in fixes.notes)
    assert any("1 of 243 sentence(s) without a fix" in note and "line 81" in note for note in fixes.notes)


def signed(body: str) -> str:
    """Return a sentence with its checksum."""
    return f"${body}*{int(np.bitwise_xor.reduce(np.frombuffer(body.encode(), np.uint8))):02X}"


def test_the_calendar_of_a_receiver_without_a_fix_is_no_date(tmp_path: Path) -> None:
    """At a cold start the clock stands at the receiver's own zero until the satellites set it."""
    cold = [signed(f"GPRMC,23594{second}.00,V,,,,,,,050180,,,N") for second in range(6)]
    fixes = read_fixes(write(tmp_path, "cold.nmea", "\r\n".join([*cold, nmea(track())])))
    assert fixes.began == pytest.approx(START.timestamp(), abs=1e-6)
    alone = "\r\n".join([*cold, *(line for line in nmea(track()).split("\r\n") if "RMC" not in line)])
    assert read_fixes(write(tmp_path, "alone.nmea", alone)).began is None


def test_sentences_among_binary_messages_of_the_receiver_are_read(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    text, log = nmea(track()), b""
    for line in text.splitlines(keepends=True):
        log += b"\xb5b\x02\x15" + rng.bytes(80) + b"$GPGGA,$\xd3\n" + line.encode()
    whole, mixed = (read_fixes(write(tmp_path, f"{n}.nmea", content)) for n, content in enumerate((text, log)))
    for name, column in whole.columns.items():
        np.testing.assert_array_equal(mixed.columns[name], column)
    assert mixed.began == whole.began
    assert any("% of its bytes are binary and not read" in note for note in mixed.notes)
    torn = log.replace(text.splitlines()[41].encode(), text.splitlines()[41].replace(",8.00,", ",9.00,").encode())
    notes = read_fixes(write(tmp_path, "torn.nmea", torn)).notes
    assert any("1 of 243 sentence(s) that are torn" in note and "line 42" in note for note in notes)


def test_bytes_without_a_sentence_are_no_log(tmp_path: Path) -> None:
    for content in (b"\xb5b" + b"$" * 90_000, b"\xb5b$GPGGA," + b"1" * 90_000, nmea(track()).encode("utf-16")):
        with pytest.raises(InputError, match="not UTF-8"):
            read_fixes(write(tmp_path, "a.nmea", content))


def test_tcx_speed_torn_end_and_points_without_a_place(tmp_path: Path) -> None:
    text = tcx(track(), speed=7.25)
    fixes = read_fixes(write(tmp_path, "watch.tcx", text))
    assert fixes.columns["speed_mps"] == pytest.approx(7.25)
    assert any("1 of 82 point(s) without a fix" in note and "Trackpoint 1" in note for note in fixes.notes)
    torn = read_fixes(write(tmp_path, "torn.tcx", text[: len(text) // 2]))
    assert 30 < len(torn.places) < 45
    assert any("ends too early" in note for note in torn.notes)
    with pytest.raises(InputError, match="0 track points"):
        read_fixes(write(tmp_path, "empty.tcx", "<TrainingCenterDatabase></TrainingCenterDatabase>"))
    with pytest.raises(InputError, match="DTD"):
        read_fixes(write(tmp_path, "bomb.tcx", "<!DOCTYPE a [<!ENTITY b 'c'>]>" + text))


RADIUS_68 = np.sqrt(-2.0 * np.log(0.32))
"""Radius around 68 % of fixes, in standard deviations of one direction."""


@pytest.mark.parametrize("before", [" " * 10, "\ufeff", "\ufeff \r\n", "\n\t"])
def test_blanks_before_xml_are_left_out(before: str, tmp_path: Path) -> None:
    fixes = read_fixes(write(tmp_path, "watch.tcx", before + tcx(track())))
    np.testing.assert_allclose(fixes.columns["latitude_deg"], track()["latitude_deg"], atol=1e-9)
    with pytest.raises(InputError, match="broken XML"):
        read_fixes(write(tmp_path, "blank.tcx", before + " "))


@pytest.mark.parametrize("suffix", [".skiz", ".slopes"])
def test_ski_apps_speed_course_and_spread(suffix: str, tmp_path: Path) -> None:
    columns = read_fixes(write(tmp_path, f"day{suffix}", ski_app(track(), suffix, speed=7.25))).columns
    assert columns["speed_mps"][1:] == pytest.approx(7.25)
    assert columns["course_deg"][1:] == pytest.approx(160.5)
    assert columns["sigma_m"] == pytest.approx(4.5 / RADIUS_68)


def test_archives_that_cannot_be_used_are_one_clear_line(tmp_path: Path) -> None:
    whole = ski_app(track(), ".skiz")

    def refusal(content: bytes, name: str = "day.skiz") -> str:
        with pytest.raises(InputError) as caught:
            read_fixes(write(tmp_path, name, content))
        return str(caught.value)

    assert "damaged, or no archive" in refusal(whole[: len(whole) // 2])
    assert "damaged, or no archive" in refusal(b"not an archive")
    at = whole.index(b"Nodes.csv") + 20
    assert "damaged or encrypted" in refusal(whole[:at] + bytes([whole[at] ^ 255]) + whole[at + 1 :])
    assert "it holds no RawGPS.csv or GPS.csv, but Nodes.csv, Segment.csv, Track.xml" in refusal(whole, "day.slopes")
    held = io.BytesIO()
    with zipfile.ZipFile(held, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("Nodes.csv", b"0" * 60_000_000)
    assert "Nodes.csv: it has more than 50 MB" in refusal(held.getvalue())
    held = io.BytesIO()
    with zipfile.ZipFile(held, "w") as archive:
        for number in range(5000):
            archive.writestr(f"{number}.csv", "")
    assert "more files than any app writes" in refusal(held.getvalue())
    held = io.BytesIO()
    with zipfile.ZipFile(held, "w") as archive:
        archive.writestr("Nodes.csv", "1,2\n3,4\n5,6\n")
    assert "3 rows of 2 columns are no table of fixes" in refusal(held.getvalue())


def test_a_torn_row_of_a_ski_app_costs_itself(tmp_path: Path) -> None:
    held = io.BytesIO(ski_app(track(), ".skiz"))
    with zipfile.ZipFile(held) as archive:
        lines = archive.read("Nodes.csv").decode().split("\n")
    lines[20] = lines[20][:30]
    held = io.BytesIO()
    with zipfile.ZipFile(held, "w") as archive:
        archive.writestr("Nodes.csv", "\n".join(lines))
    fixes = read_fixes(write(tmp_path, "day.skiz", held.getvalue()))
    assert len(fixes.places) == len(track()["time_s"]) - 1
    assert any("1 of 81 line(s) that are torn" in note and "line 21" in note for note in fixes.notes)


def test_a_gnss_log_has_the_receivers_own_fixes(tmp_path: Path) -> None:
    fixes = read_fixes(write(tmp_path, "gnss_log.txt", gnss_logger(track())))
    assert fixes.columns["speed_mps"] == pytest.approx(8.1)
    assert fixes.columns["course_deg"] == pytest.approx(160.5)
    assert fixes.columns["sigma_m"] == pytest.approx(4.5 / RADIUS_68)
    assert any("those of the provider gps; others are left out: 81 of flp, 81 of nlp" in note for note in fixes.notes)
    fused = read_fixes(write(tmp_path, "fused.txt", gnss_logger(track()).replace("Fix,GPS", "Fix,FLP")))
    assert any("those of the provider flp" in note for note in fused.notes)
    with pytest.raises(InputError, match="no line begins with Fix"):
        read_fixes(write(tmp_path, "other.txt", "a text\n" * 5))
    poor = "\n".join(f"Fix,NLP,46.8,9.8,,,900.0,,{1000 * number}" for number in range(20))
    with pytest.raises(InputError, match="without a height"):
        read_fixes(write(tmp_path, "poor.txt", poor))


def test_a_solutions_speed_course_and_spread(tmp_path: Path) -> None:
    columns = read_fixes(write(tmp_path, "run.pos", rtklib(track()))).columns
    assert columns["speed_mps"] == pytest.approx(5.0)
    assert columns["course_deg"] == pytest.approx(np.degrees(np.arctan2(4.0, -3.0)))
    assert columns["sigma_m"] == pytest.approx(np.hypot(0.03, 0.04) / np.sqrt(2.0))
    south = rtklib({name: column.copy() for name, column in track().items()}, "minutes").replace(" 46 ", " -46 ")
    assert read_fixes(write(tmp_path, "south.pos", south)).columns["latitude_deg"][0] == pytest.approx(
        -track()["latitude_deg"][0], abs=1e-9
    )


def test_solutions_that_cannot_be_used_are_one_clear_line(tmp_path: Path) -> None:
    lines = rtklib(track()).split("\n")
    lines[20], lines[40] = lines[20][:40], "reconnected"
    fixes = read_fixes(write(tmp_path, "torn.pos", "\n".join(lines)))
    assert len(fixes.places) == len(track()["time_s"]) - 2
    for old, new, words in (
        ("latitude(deg)", "e-baseline(m)", "distances from a base; write the solution as latitude"),
        ("%  GPST", "   GPST", "no line that begins with % names the columns"),
        ("latitude(deg)", "lat", "it holds no latitude"),
    ):
        with pytest.raises(InputError, match=words):
            read_fixes(write(tmp_path, "bad.pos", rtklib(track()).replace(old, new)))
    with pytest.raises(InputError, match="2 fixes are no recording"):
        read_fixes(write(tmp_path, "short.pos", "\n".join(rtklib(track()).split("\n")[:4])))


def test_fit_speed_and_records_without_a_place(tmp_path: Path) -> None:
    fixes = read_fixes(write(tmp_path, "watch.fit", fit(track(10), speed=8.1)))
    assert fixes.columns["speed_mps"] == pytest.approx(8.1)
    assert fixes.places[0] == "record 2"
    assert any("1 of 10 record(s) without a fix" in note for note in fixes.notes)


@pytest.mark.parametrize(
    ("ties", "late"),
    [
        (("timestamp_correlation",), 0.0),
        (("gps_metadata",), -0.25),  # its UTC has whole seconds only
        (("gps_metadata", "timestamp_correlation"), 0.0),
    ],
)
def test_fit_of_a_clock_since_power_on_has_the_date_of_a_message_with_both(
    tmp_path: Path, ties: tuple[str, ...], late: float
) -> None:
    fixes = read_fixes(write(tmp_path, "camera.fit", fit(track(10), uptime=67, ties=ties)))
    assert fixes.began == pytest.approx(START.timestamp() + late, abs=1e-6)
    np.testing.assert_allclose(fixes.columns["time_s"], np.arange(9.0), atol=1e-6)
    assert not [note for note in fixes.notes if "no date" in note]


def test_fit_of_a_clock_since_power_on_alone_has_no_date(tmp_path: Path) -> None:
    fixes = read_fixes(write(tmp_path, "camera.fit", fit(track(10), uptime=67)))
    assert fixes.began is None
    np.testing.assert_allclose(fixes.columns["time_s"], np.arange(9.0))
    assert [note for note in fixes.notes if "no date: its clock counts from power-on" in note]
    tied = fit(track(10), ties=("timestamp_correlation",))  # no message about the time since power-on
    assert read_fixes(write(tmp_path, "watch.fit", tied)).began == pytest.approx(START.timestamp())


def test_fit_without_heights_is_not_without_places(tmp_path: Path) -> None:
    columns = track(10)
    content = fit(columns | {"altitude_m": np.full(len(columns["time_s"]), np.nan)})
    with pytest.raises(InputError, match=r"9 records have a place, but only 0 of them a height; export .* GPX or TCX"):
        read_fixes(write(tmp_path, "watch.fit", content))


def test_phone_accuracy_is_a_radius_and_poor_fixes_go(tmp_path: Path) -> None:
    fixes = read_fixes(write(tmp_path, "Location.csv", phone(track(), radius=4.5)))
    rng = np.random.default_rng(1)
    scattered = np.linalg.norm(fixes.columns["sigma_m"][0] * rng.standard_normal((100_000, 2)), axis=1)
    # of 100 000 the share within the radius is known to ± 0.0015 (one sigma)
    assert np.mean(scattered < 4.5) == pytest.approx(0.68, abs=0.005)
    assert fixes.places[0] == "line 3"
    assert any("1 of 82 fix(es) of poor" in note for note in fixes.notes)


def spoil_fit(change: Callable[[bytearray], None]) -> bytes:
    data = bytearray(fit(track(10)))
    change(data)
    return bytes(data)


def flip(data: bytearray) -> None:
    data[16] ^= 0x55  # the number of fields of the first message


FAULTS: dict[str, tuple[str, str | bytes, str]] = {
    "torn log": ("a.nmea", nmea(track()).replace("1", "2", 400), "are torn"),
    "no fixes": ("a.nmea", "\n".join(nmea(track()).split("\r\n")[3::4]), "0 GGA sentences"),
    "other text": ("a.nmea", "time,x\n1,2\n", "0 GGA sentences"),
    "damaged at once": ("a.fit", spoil_fit(flip), "damaged"),
    "cut short": ("a.fit", fit(track(10))[:150], "damaged"),
    "no FIT": ("a.fit", b"hello, this is no FIT file", "damaged"),
    "no places": ("a.fit", fit({name: column[:0] for name, column in track().items()}), "0 records with a place"),
    "no accuracy": ("a.csv", phone(track()).replace(",4.5,", ",-1,"), "no three fixes"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_broken_files_are_one_clear_line(tmp_path: Path, fault: str) -> None:
    name, content, problem = FAULTS[fault]
    path = write(tmp_path, name, content)
    with pytest.raises(InputError) as info:
        read_fixes(path)
    assert info.value.file == str(path)
    assert problem in info.value.problem
    assert info.value.fix
    assert "\n" not in str(info.value)


def test_a_missing_library_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "fitdecode", None)
    with pytest.raises(InputError, match=r"need the library fitdecode; pip install 'sssi-exudyn\[import\]'"):
        read_fixes(write(tmp_path, "watch.fit", fit(track(10))))
