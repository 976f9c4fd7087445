"""A result in memory and on disk: shapes, names, whole files or none, one clear line for every refusal."""

import errno
import json
import multiprocessing
import os
import pickle
import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from sssi_exudyn.core.errors import InputError, SimulationDiverged
from sssi_exudyn.core.frames import slope_to_enu
from sssi_exudyn.io.writing import folder_lock
from sssi_exudyn.results.folder import ResultContent, read_series, read_summary, write_result
from sssi_exudyn.results.summary import Summary
from sssi_exudyn.simulation.result import SimulationResult, SnowWrench

MODEL = {"format": 1, "friction": {"mu_t": 0.1, "terms": ["penetration", "air"]}}
SERIES = pd.DataFrame({"time_s": [0.0, 0.005], "left_load_N": [350.0, np.nan]})


def some_result(n: int = 4) -> SimulationResult:
    rng = np.random.default_rng(1)

    def some(*shape: int) -> np.ndarray:
        return rng.normal(size=(n, *shape))

    return SimulationResult(
        coordinate_names=("pelvis_f", "pelvis_l", "pelvis_n", "knee_angle_r"),
        moment_names=("knee_angle_r",),
        time=np.arange(n) / 200.0,
        pelvis=some(3),
        pelvis_velocity=some(3),
        com=some(3),
        com_velocity=some(3),
        antenna=some(3),
        coordinates=some(4),
        foot_load=some(2),
        sole_force=some(2),
        foot_friction=some(2, 3),
        foot_position=some(2, 3),
        foot_velocity=some(2, 3),
        foot_forward=some(2, 3),
        snow=SnowWrench(some(2, 3), some(2, 3), some(2, 3)),
        edge_angle=some(2),
        penetration=some(2),
        drag=some(3),
        joint_moments=some(1),
        ski_deflection=some(2, 2),
        energy={"gravity": np.linspace(0.0, 200.0, n), "kinetic": np.linspace(0.0, 150.0, n)},
        energy_closure=np.array([0.0, 0.5, -1.0, 0.25])[:n],
        statistics={"steps": n, "backend": "symbolic"},
    )


def hold(folder: Path, held: Any, release: Any) -> None:
    with folder_lock(folder):
        held.set()
        release.wait(30.0)


def test_a_wrong_shape_is_refused_by_name() -> None:
    result = some_result()
    with pytest.raises(ValueError, match="foot_load"):
        replace(result, foot_load=np.zeros((4, 3)))
    with pytest.raises(ValueError, match="energy gravity"):
        replace(result, energy={"gravity": np.zeros(3)})


def test_results_cross_process_boundaries() -> None:
    result = some_result()
    back = pickle.loads(pickle.dumps(result))
    np.testing.assert_array_equal(back.foot_friction, result.foot_friction)
    assert back.statistics == result.statistics


def test_closure_is_a_share_of_the_energy_turned_over() -> None:
    assert some_result().closure_percent == pytest.approx(100.0 * 1.0 / 200.0)


def test_frame_has_units_in_its_names_and_vectors_east_north_up() -> None:
    result = some_result()
    frame = result.to_frame(slope_to_enu(0.0, 0.0))
    # A level "slope" that falls towards north: f is north and left of it is west.
    np.testing.assert_allclose(frame["com_north_m"], result.com[:, 0])
    np.testing.assert_allclose(frame["com_east_m"], -result.com[:, 1])
    np.testing.assert_allclose(frame["com_up_m"], result.com[:, 2])
    np.testing.assert_allclose(frame["right_load_N"], result.foot_load[:, 1])
    np.testing.assert_allclose(np.radians(frame["knee_angle_r_deg"]), result.coordinates[:, 3])
    np.testing.assert_allclose(frame["pelvis_n_m"], result.coordinates[:, 2])
    np.testing.assert_allclose(frame["knee_angle_r_moment_Nm"], result.joint_moments[:, 0])
    np.testing.assert_allclose(frame["left_tail_deflection_m"], result.ski_deflection[:, 0, 1])


def test_without_an_antenna_its_columns_are_empty_not_missing() -> None:
    frame = replace(some_result(), antenna=None).to_frame(np.eye(3))
    assert frame[["antenna_east_m", "antenna_north_m", "antenna_up_m"]].isna().all(axis=None)


def test_what_is_written_comes_back(tmp_path: Path) -> None:
    folder = tmp_path / "deep" / "result"
    frame = some_result().to_frame(np.eye(3))
    content = ResultContent(Summary(recording="a"), frame, MODEL, diagnosis={"cause": None})
    write_result(folder, content, lambda _: "<p>ä</p>")
    assert read_summary(folder) == Summary(recording="a")
    pd.testing.assert_frame_equal(pd.read_parquet(folder / "series.parquet"), frame)
    assert tomllib.loads((folder / "model.toml").read_text(encoding="utf-8")) == MODEL
    assert json.loads((folder / "diagnosis.json").read_text()) == {"cause": None}
    assert (folder / "report.html").read_text(encoding="utf-8") == "<p>ä</p>"


def test_nothing_of_an_older_run_stays_with_a_new_one(tmp_path: Path) -> None:
    write_result(tmp_path, ResultContent(Summary(), SERIES, MODEL, diagnosis={}), lambda _: "old")
    write_result(tmp_path, ResultContent(Summary(), SERIES, MODEL))
    visible = sorted(path.name for path in tmp_path.iterdir() if not path.name.startswith("."))
    assert visible == ["columns.csv", "model.toml", "series.parquet", "summary.json"]


def test_a_full_disk_leaves_the_old_result_whole(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write_result(tmp_path, ResultContent(Summary(recording="old"), SERIES, MODEL))
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}

    def full(*_: Any, **__: Any) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(Path, "write_text", full)
    with pytest.raises(InputError, match="no space left"):
        write_result(tmp_path, ResultContent(Summary(recording="new"), SERIES, MODEL))
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before


def test_a_place_that_cannot_be_written_is_one_clear_line(tmp_path: Path) -> None:
    # A file where a folder should be: refused for every user, while permissions do not bind an administrator.
    file = tmp_path / "file"
    file.write_text("")
    with pytest.raises(InputError, match=r"not a directory; check the path"):
        write_result(file / "result", ResultContent(Summary(), SERIES, MODEL))


@pytest.mark.long
def test_two_processes_do_not_write_one_folder(tmp_path: Path) -> None:
    context = multiprocessing.get_context("spawn")
    held, release = context.Event(), context.Event()
    other = context.Process(target=hold, args=(tmp_path, held, release))
    other.start()
    try:
        assert held.wait(30.0)
        with pytest.raises(InputError, match="another process is writing here"):
            write_result(tmp_path, ResultContent(Summary(), SERIES, MODEL))
    finally:
        release.set()
        other.join()
    write_result(tmp_path, ResultContent(Summary(), SERIES, MODEL))


def test_one_process_may_hold_a_folder_and_write_into_it(tmp_path: Path) -> None:
    with folder_lock(tmp_path):
        write_result(tmp_path, ResultContent(Summary(recording="a"), SERIES, MODEL))
        write_result(tmp_path, ResultContent(Summary(recording="b"), SERIES, MODEL))
    assert read_summary(tmp_path).recording == "b"


@pytest.mark.parametrize(
    ("content", "problem"),
    [
        (None, "does not exist"),
        ("{", "not JSON"),
        ("[]", "no table of figures"),
        ('{"format": 2}', "format 1"),
        ('{"format": 1, "fit": {"evaluations": "many"}}', r"\$\.fit\.evaluations: expected"),
    ],
    ids=["missing", "torn", "a list", "another format", "another type"],
)
def test_a_summary_that_cannot_be_read_says_so(tmp_path: Path, content: str | None, problem: str) -> None:
    if content is not None:
        (tmp_path / "summary.json").write_text(content)
    with pytest.raises(InputError, match=problem):
        read_summary(tmp_path)


def test_a_series_that_cannot_be_read_says_so(tmp_path: Path) -> None:
    (tmp_path / "series.parquet").write_bytes(b"PAR1 torn")
    with pytest.raises(InputError, match="not a Parquet file"):
        read_series(tmp_path)


def test_errors_come_back_whole_from_another_process() -> None:
    for error in (InputError("gps.csv", "line 3", "it is text", "give a number"), SimulationDiverged(1.5, "too fast")):
        again = pickle.loads(pickle.dumps(error))
        assert type(again) is type(error)
        assert str(again) == str(error)
        assert vars(again) == vars(error)
