"""The replay's numbers: the page is packed with the places where the run was."""

import base64
import re
from dataclasses import replace
from importlib import resources

import numpy as np
import pytest
from a_run import AZIMUTH, INCLINATION, MASS, SPEED, a_result, a_run

from sssi_exudyn.bodies.skier.chain import HANDS, SEGMENT
from sssi_exudyn.contact.terms.terrain import TerrainBump
from sssi_exudyn.core.frames import GRAVITY, slope_to_level
from sssi_exudyn.reports.plots import COLOURS
from sssi_exudyn.reports.sections.replay import RATE, STATIONS, pack, player, replay_of
from sssi_exudyn.results.stored import StoredRun


@pytest.fixture(scope="module")
def run() -> StoredRun:
    return a_run()


def test_frames_are_those_of_the_run_in_the_level_frame(run: StoredRun) -> None:
    assert run.geometry is not None
    scene = replay_of(run.series, run.geometry, run.model)
    assert len(scene.time) == round(14.0 * RATE) + 1
    result = a_result()
    path = (result.com - result.com[0]) @ slope_to_level(INCLINATION).T
    expected = np.stack([np.interp(scene.time, result.time, axis) for axis in path.T], axis=1)
    # samples 20 ms apart and frames 50 ms apart do not meet: half a sample at 8 m/s
    assert np.max(np.abs(scene.com - expected)) <= 0.5 * 0.02 * SPEED * 1.1
    # down the fall line is down
    assert scene.com[-1, 2] == pytest.approx(-scene.com[-1, 0] * np.tan(INCLINATION), abs=1e-6)
    assert AZIMUTH != 0.0  # so that the turn from east-north-up counts


def test_snow_pushes_along_the_slopes_normal_and_against_the_way(run: StoredRun) -> None:
    assert run.geometry is not None
    scene = replay_of(run.series, run.geometry, run.model)
    slope = scene.snow.sum(axis=1) @ slope_to_level(INCLINATION)
    np.testing.assert_allclose(slope[:, 2], MASS * GRAVITY, rtol=1e-9)  # a_run's loads add up to the weight
    assert np.all(slope[:, 0] < 0.0)


def test_skis_hang_on_the_feet_and_bend_by_what_was_computed(run: StoredRun) -> None:
    assert run.geometry is not None
    flat = run.series.copy()
    for side in ("left", "right"):
        flat[[f"{side}_tip_deflection_m", f"{side}_tail_deflection_m"]] = 0.0
    bent, straight = (replay_of(series, run.geometry, run.model).skis for series in (run.series, flat))
    moved = np.linalg.norm(bent - straight, axis=-1)
    np.testing.assert_allclose(moved[:, :, [0, -1]], 0.02, atol=1e-9)
    middle = STATIONS.index(0.5)
    np.testing.assert_allclose(moved[:, :, middle], 0.0, atol=1e-12)
    assert np.all(np.diff(moved[:, :, middle:], axis=2) > 0.0)
    length = np.linalg.norm(straight[:, :, -1].mean(axis=2) - straight[:, :, 0].mean(axis=2), axis=-1)
    # the straight line from tail to tip: 1.65 m along and 38 mm up
    np.testing.assert_allclose(length, np.hypot(1.65, 0.038), atol=1e-3)


def test_packed_numbers_come_back_within_a_step(run: StoredRun) -> None:
    assert run.geometry is not None
    scene = replay_of(run.series, run.geometry, run.model)
    data = pack(scene, run.name, run.model)
    path = np.frombuffer(base64.b64decode(data["path"]), "<f4").reshape(data["frames"], 3)
    around = np.frombuffer(base64.b64decode(data["around"]), "<i2").reshape(data["frames"], data["points"], 3)
    places = path[:, None] + data["step"] * around
    knee = SEGMENT["tibia_l"]
    # half a step of rounding, and float32's 7 digits of 80 m
    assert data["step"] < 2e-4
    np.testing.assert_allclose(places[:, knee], scene.joints[:, knee], atol=0.5 * data["step"] + 1e-5)
    np.testing.assert_allclose(places[:, data["feet"] + 1], scene.feet[:, 1], atol=0.5 * data["step"] + 1e-5)
    forces = np.frombuffer(base64.b64decode(data["forces"]), "<i2").reshape(data["frames"], 3, 3)
    np.testing.assert_allclose(data["newton"] * forces[:, :2], scene.snow, atol=0.5 * data["newton"] + 1e-9)
    assert data["points"] == data["skis"] + 4 * len(STATIONS)


def test_a_plane_is_drawn_as_one(run: StoredRun) -> None:
    assert run.geometry is not None
    scene = replay_of(run.series, run.geometry, run.model)
    assert scene.hill is None
    assert pack(scene, run.name, run.model)["hill"] is None


def test_a_hill_is_packed_where_it_is(run: StoredRun) -> None:
    """Raise a bump across the path, 0.5 m over the plane: it is as high, straight up, at its place on the slope."""
    assert run.geometry is not None
    com = a_result().com
    bump = TerrainBump(0.5, float(com[len(com) // 2, 0]), 8.0)
    model = replace(run.model, terms=(*run.model.terms, bump))
    hill = pack(replay_of(run.series, run.geometry, model), run.name, model)["hill"]
    heights = np.frombuffer(base64.b64decode(hill["heights"]), "<i2").reshape(hill["rows"], hill["columns"])
    start = (com[0] @ slope_to_level(INCLINATION).T)[:2]
    x, y = (hill["corner"][k] + start[k] + hill["spacing"] * np.arange(heights.shape[k]) for k in range(2))
    places = np.stack(np.meshgrid(x / np.cos(INCLINATION), y, indexing="ij"), axis=-1).reshape(-1, 2)
    expected = model.snow(places)[0].reshape(heights.shape) / np.cos(INCLINATION)
    np.testing.assert_allclose(hill["step"] * heights, expected, atol=hill["step"])  # rounded to steps
    assert np.max(expected) > 0.4
    # the snow reaches beyond the path on all sides
    path = com @ slope_to_level(INCLINATION).T
    assert x[0] < path[:, 0].min() - 10.0
    assert y[-1] > path[:, 1].max() + 10.0


def test_every_segment_is_drawn(run: StoredRun) -> None:
    assert run.geometry is not None
    data = pack(replay_of(run.series, run.geometry, run.model), run.name, run.model)
    drawn = {int(point) for bone in data["bones"] for point in bone[:2]} | set(data["head"])
    assert set(range(len(SEGMENT))) <= drawn
    assert max(drawn) < data["feet"]


def script(name: str) -> str:
    return (resources.files("sssi_exudyn.reports") / name).read_text(encoding="utf-8")


def test_script_and_page_speak_of_the_same_things(run: StoredRun) -> None:
    # Without a browser: all that the script takes from its data, its controls and the theme has to be there.
    assert run.geometry is not None
    data = pack(replay_of(run.series, run.geometry, run.model), run.name, run.model)
    code, html, theme = script("replay.js"), player(data), script("page.css")
    taken = set(re.findall(r"this\.data\.(\w+)", code))
    for names in re.findall(r"\{([\w, ]+)\} = this\.data", code):
        taken |= {name.strip() for name in names.split(",")}
    assert taken <= data.keys()
    assert data.keys() - taken <= {"name"}
    assert {"path", "around", "forces", "bones", "skis"} <= taken
    controls = set(re.findall(r'control\("(\w+)"\)|\[name=(\w+)\]', code))
    wanted = {first or second for first, second in controls}
    assert wanted == set(re.findall(r' name="(\w+)"', html))
    colours = set(re.findall(r'colour\("([\w-]+)"\)', code)) | set(re.findall(r'"(c\d)"', code))
    assert {"paper", "grid", "head", "trunk", "path", "c1", "c2"} <= colours
    assert colours <= set(re.findall(r"--([\w-]+):", theme))
    views = set(re.findall(r"(\w+): \[", code[code.index("VIEWS") : code.index("};", code.index("VIEWS"))]))
    assert views == set(re.findall(r"<option>(\w+)</option>", html))


def test_colours_of_plots_are_those_of_the_theme() -> None:
    light = script("page.css").partition("@media")[0]
    assert re.findall(r"--c\d: (#\w+);", light) == list(COLOURS)


def test_poles_hang_on_the_hands_and_are_as_long_as_the_skiers(run: StoredRun) -> None:
    assert run.geometry is not None
    scene = replay_of(run.series, run.geometry, run.model)
    data = pack(scene, run.name, run.model)
    path = np.frombuffer(base64.b64decode(data["path"]), "<f4").reshape(data["frames"], 3)
    around = np.frombuffer(base64.b64decode(data["around"]), "<i2").reshape(data["frames"], data["points"], 3)
    for point, hand in zip(data["hands"], HANDS, strict=True):
        reach = np.linalg.norm(path + data["step"] * around[:, point] - scene.joints[:, hand], axis=1)
        # from the wrist to the far end of the hand, to a step of rounding
        assert np.allclose(reach, np.linalg.norm(run.geometry.segment_end[hand]), atol=1e-3)
    assert data["pole"] == pytest.approx(0.7 * 1.75)
