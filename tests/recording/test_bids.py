"""A motion capture as a BIDS dataset: names of files, required fields and columns, and what the numbers mean."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bundled import bundled
from scipy.spatial.transform import Rotation
from strapped import write_few

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.recording.instruments.bvh import joint_positions, world_rotations
from sssi_exudyn.recording.read import read_recording

RECORDING = bundled("beginner")[0]
STEM = "sub-07_task-skiing_tracksys-capture"
TYPES = {"ACCEL", "ANGACCEL", "GYRO", "JNTANG", "LATENCY", "MAGN", "MISC", "ORNT", "POS", "VEL"}
"""Types of channels that the specification has for motion."""
COMPONENTS = {"x", "y", "z", "quat_x", "quat_y", "quat_z", "quat_w", "n/a"}


@pytest.fixture(scope="module")
def dataset(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("shared") / "skiers"
    file = RECORDING.to_bids(folder, "07")
    assert file == folder / "sub-07" / "motion" / f"{STEM}_motion.tsv"
    return folder


def read_json(path: Path) -> Any:
    return json.loads(path.read_text(encoding="utf-8"))


def channels(dataset: Path) -> list[dict[str, str]]:
    with (dataset / "sub-07" / "motion" / f"{STEM}_channels.tsv").open(encoding="utf-8") as table:
        return list(csv.DictReader(table, delimiter="\t"))


def test_the_dataset_has_the_files_of_the_specification(dataset: Path) -> None:
    files = {path.relative_to(dataset).as_posix() for path in dataset.rglob("*") if path.is_file()}
    own = {f"sub-07/motion/{STEM}_{end}" for end in ("motion.tsv", "motion.json", "channels.tsv", "channels.json")}
    assert files == own | {"dataset_description.json", "README.md"}
    description = read_json(dataset / "dataset_description.json")
    assert {"Name", "BIDSVersion"} <= set(description)  # the required ones


def test_required_fields_and_columns_are_there(dataset: Path) -> None:
    sidecar = read_json(dataset / "sub-07" / "motion" / f"{STEM}_motion.json")
    assert sidecar["TaskName"] == "skiing"
    rows = channels(dataset)
    assert list(rows[0])[:5] == ["name", "component", "type", "tracked_point", "units"]  # in this order
    assert len({row["name"] for row in rows}) == len(rows) == sidecar["MotionChannelCount"]
    assert {row["type"] for row in rows} <= TYPES
    assert {row["component"] for row in rows} <= COMPONENTS
    for kind in ("POS", "ORNT", "LATENCY"):
        assert sidecar[f"{kind}ChannelCount"] == sum(row["type"] == kind for row in rows)
    levels = read_json(dataset / "sub-07" / "motion" / f"{STEM}_channels.json")["reference_frame"]["Levels"]
    assert {row["reference_frame"] for row in rows} - {"n/a"} == set(levels)


def test_the_numbers_are_the_capture(dataset: Path) -> None:
    values = np.loadtxt(dataset / "sub-07" / "motion" / f"{STEM}_motion.tsv")  # without a headline
    names = [row["name"] for row in channels(dataset)]
    bvh = RECORDING.bvh
    assert values.shape == (len(bvh.time), len(names))
    # six digits: a place of 100 m to 0.1 mm, times of 100 s to 0.1 ms
    np.testing.assert_allclose(values[:, 0], bvh.time - bvh.time[0], atol=1e-4)
    world = world_rotations(bvh)
    places = bvh.root_position[:, None] + joint_positions(bvh, world)
    joint = bvh.index("LeftFoot")
    of_foot = [names.index(f"LeftFoot_{axis}") for axis in "xyz"]
    np.testing.assert_allclose(values[:, of_foot], places[:, joint], atol=1e-4)
    turn = values[:, [names.index(f"LeftFoot_quat_{part}") for part in "xyzw"]]
    np.testing.assert_allclose(Rotation.from_quat(turn).as_matrix(), world[:, joint], atol=1e-5)


def test_a_dataset_has_many_subjects_and_each_once(dataset: Path) -> None:
    RECORDING.to_bids(dataset, "08")
    assert (dataset / "sub-08").is_dir()
    with pytest.raises(InputError, match="has this subject already"):
        RECORDING.to_bids(dataset, "07")


@pytest.mark.long
def test_what_is_no_label_and_no_capture_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="use letters and digits alone"):
        RECORDING.to_bids(tmp_path / "new", "../7")
    few = read_recording(write_few(RECORDING, ("left_ski", "right_ski"), tmp_path / "few"))
    with pytest.raises(InputError, match="estimated from few sensors, not captured"):
        few.to_bids(tmp_path / "new")
    assert not (tmp_path / "new").exists()
