"""Files of a telephone's app, paired by the names that the app gives them; and sensors' files without their place."""

from __future__ import annotations

import zipfile
from pathlib import Path

import pytest
from gopro_file import film, payloads
from pymap3d import enu2geodetic
from strapped import LAG, strapped

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.importing.answers import Answers
from sssi_exudyn.importing.assemble import import_recording, sort_sources
from sssi_exudyn.importing.sensors.app_exports import app_files, files_given, with_places
from sssi_exudyn.recording.read import read_recording

SENSOR_LOGGER = ("Location", "Gyroscope", "Accelerometer", "Gravity", "TotalAcceleration", "Barometer", "Orientation")
PHYPHOX = ("Location", "Gyroscope", "Accelerometer", "Pressure", "Magnetometer")


def export(folder: Path, names: tuple[str, ...]) -> list[Path]:
    for name in names:
        (folder / f"{name}.csv").write_text("time,seconds_elapsed,z,y,x\n", encoding="utf-8")
    return [folder / f"{name}.csv" for name in names]


def given(folder: Path) -> list[str]:
    """Return the files of an export with their places, without the folder."""
    return sorted(str(path).replace(f"{folder}/", "") for path in with_places(app_files(folder))[0])


def test_an_export_is_one_sensor_in_a_pocket(tmp_path: Path) -> None:
    export(tmp_path, SENSOR_LOGGER)
    paired = ["Location.csv", "barometer=Barometer.csv", "pocket=Gyroscope.csv", "pocket=TotalAcceleration.csv"]
    assert given(tmp_path) == paired
    (tmp_path / "TotalAcceleration.csv").unlink()
    assert given(tmp_path)[3:] == ["pocket=Gravity.csv", "pocket=Gyroscope.csv"]
    assert given(tmp_path)[2] == "pocket=Accelerometer.csv"


def test_phyphox_is_paired_as_well(tmp_path: Path) -> None:
    export(tmp_path, PHYPHOX)
    paired = ["Location.csv", "barometer=Pressure.csv", "pocket=Accelerometer.csv", "pocket=Gyroscope.csv"]
    assert given(tmp_path) == paired


def test_a_place_that_is_given_is_kept(tmp_path: Path) -> None:
    location, gyro, accel, *_ = export(tmp_path, PHYPHOX)
    files = [Path(f"chest={gyro}"), Path(f"chest={accel}"), location]
    assert with_places(files) == (files, ())
    files, notes = with_places([gyro, accel, location])
    assert files == [Path(f"pocket={gyro}"), Path(f"pocket={accel}"), location]
    assert len(notes) == 1


def test_a_film_is_fixes_and_a_sensor_on_the_helmet(tmp_path: Path) -> None:
    path = tmp_path / "GX010001.MP4"
    files, notes = with_places([path])
    assert files == [path, Path(f"helmet={path}")]
    assert "on the helmet" in notes[0]
    assert with_places([Path(f"chest={path}"), path]) == ([Path(f"chest={path}"), path], ())


@pytest.mark.long
def test_a_film_alone_makes_a_recording(tmp_path: Path) -> None:
    whole = read_recording(Path(__file__).parents[3] / "examples" / "intermediate")
    one, gps = strapped(whole, "pocket", 4), whole.gps
    assert gps is not None
    latitude, longitude, altitude = enu2geodetic(*gps.enu.T, *gps.origin)
    columns = {"latitude_deg": latitude, "longitude_deg": longitude, "altitude_m": altitude}
    made = payloads({"time_s": gps.time + LAG - gps.time[0], **columns}, one.time - one.time[0], one.rate, one.force)
    (tmp_path / "GX010001.MP4").write_bytes(film(made))
    recording = import_recording([tmp_path / "GX010001.MP4"], tmp_path / "out", Answers())
    assert recording.completed is not None
    assert recording.completed.lag is not None
    assert recording.completed.lag.value == pytest.approx(LAG, abs=0.5)  # as of a telephone's sensor
    assert recording.gps is not None
    assert recording.gps.segment == "Head"


def test_a_folder_without_gyroscope_or_fixes_is_no_export(tmp_path: Path) -> None:
    assert app_files(tmp_path) == []
    export(tmp_path, ("Gyroscope", "Accelerometer"))
    assert app_files(tmp_path) == []


def test_an_archive_of_an_app_stands_for_its_files(tmp_path: Path) -> None:
    paths = export(tmp_path, SENSOR_LOGGER)
    with zipfile.ZipFile(tmp_path / "export.zip", "w", zipfile.ZIP_DEFLATED) as archive:
        for path in paths:
            archive.write(path, f"2026-02-01_10-00/{path.name}")
        archive.writestr("../Gravity.csv", "outside")
    with files_given([tmp_path / "export.zip"]) as given_files:
        names = [path.name for path in given_files]
        folder = given_files[0].parent
        assert folder.is_dir()
        assert (folder / "Orientation.csv").exists() is False
        assert (folder / "Gravity.csv").read_text(encoding="utf-8") == "outside"  # and nothing outside the folder
    assert names[:3] == ["Gyroscope.csv", "Location.csv", "TotalAcceleration.csv"]
    assert not folder.exists()
    with zipfile.ZipFile(tmp_path / "other.zip", "w") as archive:
        archive.writestr("Location.csv", "time")
    with pytest.raises(InputError, match=r"it holds no Gyroscope\.csv"), files_given([tmp_path / "other.zip"]):
        pass
    (tmp_path / "torn.zip").write_bytes((tmp_path / "export.zip").read_bytes()[:200])
    with pytest.raises(InputError, match="damaged, or no archive"), files_given([tmp_path / "torn.zip"]):
        pass


def test_a_sensors_file_without_its_place_is_told_so(tmp_path: Path) -> None:
    log = tmp_path / "sensor.csv"
    log.write_text("t_s,ax,ay,az,gx,gy,gz\n0,1,2,3,4,5,6\n", encoding="utf-8")
    fixes = tmp_path / "gps.csv"
    fixes.write_text("time_s,latitude_deg,longitude_deg,altitude_m\n", encoding="utf-8")
    for files in ([log, fixes], [fixes, log]):
        with pytest.raises(
            InputError, match=r"sensor.csv: it is a sensor's file.*write its place before it: pocket=sensor"
        ):
            import_recording(files, tmp_path / "out", Answers())
    telephone = log.rename(tmp_path / "monday_imu.csv")
    sources = sort_sources([telephone, fixes])
    assert sources.sensors == (("pocket", telephone),)
    assert "assumed to have been in a pocket" in " ".join(sources.notes)
    both = tmp_path / "both.csv"  # a table of a logger that has everything is fixes without a place, a sensor with one
    both.write_text("t_s,lat,lon,alt_m,ax,ay,az,gx,gy,gz\n", encoding="utf-8")
    assert sort_sources([Path(f"chest={both}"), both]).gps == both
    with pytest.raises(InputError, match=r"'phone' is no place of a sensor; write one of left_ski=, .*insoles="):
        import_recording([Path(f"phone={log}"), fixes], tmp_path / "out", Answers())
    with pytest.raises(InputError, match=r"pocket=phone.csv"):
        import_recording([fixes], tmp_path / "out", Answers())
