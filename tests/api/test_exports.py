"""A result for maps and for 3D viewers."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import geojson
import gpxpy
import numpy as np
import pygltflib
import pytest
from a_run import a_run
from bundled import bundled
from defusedxml import ElementTree

from sssi_exudyn.api.result import Result
from sssi_exudyn.bodies.skier.chain import SEGMENTS
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.recording.instruments.gps import enu_from

RECORDING = bundled("beginner")[0]


@pytest.fixture(scope="module")
def result() -> Result:
    return Result(a_run(4.0), {})


def test_a_track_is_where_the_antenna_is(result: Result, tmp_path: Path) -> None:
    assert RECORDING.gps is not None
    gpx = gpxpy.parse(result.to_track(tmp_path / "run.gpx", RECORDING).read_text(encoding="utf-8"))
    (track,) = gpx.tracks
    assert track.name == result.name  # a name with markup in it
    points = [(p.latitude, p.longitude, p.elevation) for p in track.segments[0].points]
    assert len(points) == 41  # 4 s, ten a second
    last = enu_from(np.zeros((1, 3)), points[-1], RECORDING.gps.origin)[0]
    row = result.series.iloc[-1]
    # m: degrees to 1e-8 are a millimetre, altitudes to 1 mm
    np.testing.assert_allclose(last, [row[f"antenna_{axis}_m"] for axis in ("east", "north", "up")], atol=2e-3)
    line = geojson.loads(result.to_track(tmp_path / "run.geojson", RECORDING).read_text(encoding="utf-8"))
    assert line.is_valid
    np.testing.assert_allclose(line["features"][0]["geometry"]["coordinates"][-1][:2], points[-1][1::-1], atol=1e-8)
    kml = ElementTree.parse(result.to_track(tmp_path / "run.kml", RECORDING))
    (coordinates,) = kml.iter("{http://www.opengis.net/kml/2.2}coordinates")
    assert len((coordinates.text or "").split()) == 41


def test_a_scene_moves_every_segment_and_ski(result: Result, tmp_path: Path) -> None:
    scene = pygltflib.GLTF2().load(str(result.to_gltf(tmp_path / "run.glb")))
    assert [node.name for node in scene.nodes] == [*SEGMENTS, "left_ski", "right_ski"]
    (animation,) = scene.animations
    assert len(animation.channels) == 2 * len(scene.nodes)
    blob = scene.binary_blob()

    def numbers(index: int) -> np.ndarray:
        accessor = scene.accessors[index]
        view = scene.bufferViews[accessor.bufferView]
        raw = blob[view.byteOffset : view.byteOffset + view.byteLength]
        return np.frombuffer(raw, np.float32).reshape(accessor.count, -1)

    pelvis = numbers(animation.samplers[0].output)
    end = result.series.iloc[(result.series["time_s"] - numbers(animation.samplers[0].input)[-1, 0]).abs().argmin()]
    start = result.series.iloc[0]
    fall = [end[f"pelvis_{axis}_m"] - start[f"pelvis_{axis}_m"] for axis in ("east", "north", "up")]
    assert pelvis[-1, 1] == pytest.approx(fall[2], abs=1e-4)  # y is up; single precision
    assert np.hypot(pelvis[-1, 0], pelvis[-1, 2]) == pytest.approx(np.hypot(fall[0], fall[1]), abs=1e-4)
    quaternions = numbers(animation.samplers[1].output)
    np.testing.assert_allclose(np.linalg.norm(quaternions, axis=1), 1.0, atol=1e-6)  # single precision


def test_what_cannot_be_exported_is_said(result: Result, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"end its name in \.gpx, \.kml, \.geojson"):
        result.to_track(tmp_path / "run.shp", RECORDING)
    with pytest.raises(InputError, match="place is unknown"):
        result.to_track(tmp_path / "run.gpx", replace(RECORDING, gps=None))
    with pytest.raises(InputError, match="no skeleton"):
        replace(result, stored=replace(result.stored, geometry=None)).to_gltf(tmp_path / "run.glb")
