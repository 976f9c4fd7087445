"""Telemetry of GoPro cameras: fixes and sensors from films and from telemetry alone, and damaged ones."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from fix_files import START
from gopro_file import film, payloads
from tiny import Columns, motion

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.frames import GRAVITY, Array
from sssi_exudyn.importing.sensors.sensor_logs import read_logs
from sssi_exudyn.recording.instruments.gopro import read_telemetry
from sssi_exudyn.recording.instruments.gps import read_fixes

STEP = 0.005


def track() -> Columns:
    return {name: column[:80] for name, column in motion()[1].items()}  # eight seconds, ten fixes in each


def sensor() -> tuple[Array, Array, Array]:
    time = np.arange(0.0, 8.0, STEP)
    rate = np.column_stack([np.sin(time), 0.5 * np.cos(2.0 * time), 0.1 * time])
    force = np.column_stack([2.0 * np.sin(3.0 * time), np.cos(time), GRAVITY + 0.1 * time])
    return time, rate, force


def parts(**how: object) -> list[bytes]:
    return payloads(track(), *sensor(), **how)  # type: ignore[arg-type]


def write(path: Path, content: bytes) -> Path:
    path.write_bytes(content)
    return path


def films(folder: Path) -> list[Path]:
    """Return the same run as a film and as telemetry alone, with both kinds of fixes."""
    return [
        write(folder / "GX01.MP4", film(parts())),
        write(folder / "GH01.mp4", film(parts(own_clock=False), in_chunk=3)),
        write(folder / "new.gpmf", b"".join(parts())),
        write(folder / "old.raw", b"".join(parts(own_clock=False))),
    ]


def test_every_form_gives_the_track(tmp_path: Path) -> None:
    for path in films(tmp_path):
        fixes = read_fixes(path)
        # telemetry alone has payloads of 1.001 s where it has no stamps
        slack = 8e-3 if path.suffix == ".raw" else 1e-6
        np.testing.assert_allclose(fixes.columns["time_s"], track()["time_s"], atol=slack + 1e-9)
        for angle in ("latitude_deg", "longitude_deg"):
            np.testing.assert_allclose(fixes.columns[angle], track()[angle], atol=5.1e-8)  # steps of 1e-7
        np.testing.assert_allclose(fixes.columns["altitude_m"], track()["altitude_m"], atol=5.1e-4)
        assert fixes.columns["speed_mps"] == pytest.approx(8.1)
        assert fixes.began == pytest.approx(START.timestamp(), abs=slack + 1e-3)  # milliseconds are written
        assert fixes.clock_of_sensors


def test_rates_and_forces_are_in_the_cameras_axes(tmp_path: Path) -> None:
    time, rate, force = sensor()
    for path in films(tmp_path):
        telemetry = read_telemetry(path)
        np.testing.assert_allclose(telemetry.rate[:, 0], time, atol=8e-3 if path.suffix == ".raw" else 1e-6)
        np.testing.assert_allclose(telemetry.rate[:, 1:], rate, atol=0.51 / 939.0)
        np.testing.assert_allclose(telemetry.force[:, 1:], force, atol=0.51 / 418.0)
    other = read_telemetry(write(tmp_path / "other.gpmf", b"".join(parts(axes="ZXY"))))
    np.testing.assert_allclose(other.rate[:, 1:], rate, atol=0.51 / 939.0)


def test_a_film_is_a_sensor_with_its_place(tmp_path: Path) -> None:
    (log,) = read_logs([("helmet", films(tmp_path)[0])])
    assert log.place == "helmet"
    time, rate, force = sensor()
    np.testing.assert_allclose(log.table.columns["time_s"], time, atol=1e-6)
    np.testing.assert_allclose(log.table.columns["rate_y_radps"], rate[:, 1], atol=0.51 / 939.0)
    np.testing.assert_allclose(log.table.columns["acceleration_z_mps2"], force[:, 2], atol=0.51 / 418.0)


def test_a_damaged_payload_costs_itself(tmp_path: Path) -> None:
    one = parts()
    place = one[3].index(b"SCAL")
    one[3] = one[3][: place + 8] + b"\0\0\0\0" + one[3][place + 12 :]
    telemetry = read_telemetry(write(tmp_path / "damaged.mp4", film(one)))
    assert len(telemetry.force) == len(sensor()[0]) - round(1.0 / STEP)
    assert telemetry.notes == ("damaged.mp4: 1 of 8 payload(s) that are damaged left out (first: payload 4)",)
    torn = film(parts())
    lost = write(tmp_path / "torn.mp4", torn.replace(b"moov", b"free"))
    with pytest.raises(InputError, match="its index is missing"):
        read_telemetry(lost)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (film([]), "no telemetry"),
        (film(parts()).replace(b"gpmd", b"avc1"), "no telemetry"),
        (film(parts(fix=0)), "0 fixes are no recording; switch GPS on"),
        (film(parts()).replace(b"stsz", b"xxxx"), "the index of the film is damaged"),
        (film(parts(), lasting=0), "the index of the film is damaged"),
        (b"not a film at all", "no MP4 file"),
        (b"", "no MP4 file"),
    ],
)
def test_films_that_cannot_be_used_are_one_clear_line(content: bytes, words: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=words) as caught:
        read_fixes(write(tmp_path / "film.mp4", content))
    assert "\n" not in str(caught.value)


def test_an_index_that_claims_more_than_any_run_has_is_refused_before_memory_is_taken(tmp_path: Path) -> None:
    content = film(parts())
    place = content.index(b"stsz")
    huge = content[: place + 8] + b"\x7f\xff\xff\xff\x7f\xff\xff\xff" + content[place + 16 :]
    with pytest.raises(InputError, match="more than any run has"):
        read_telemetry(write(tmp_path / "huge.mp4", huge))
