"""Disks that fill up, processes killed while a result is put in place, and parts that were finished before."""

from __future__ import annotations

import errno
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.io.writing import folder_lock
from sssi_exudyn.results.folder import SUMMARY, ResultContent, check_own, read_summary, write_result
from sssi_exudyn.results.summary import Summary
from sssi_exudyn.runtime.cache import Cache, Shapes

MODEL = {"format": 1}
FILES = {"summary.json", "series.parquet", "model.toml", "columns.csv", ".lock"}
_MAIN = """
import os, resource, signal, sys
from pathlib import Path
import pandas as pd
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.results.folder import ResultContent, write_result
from sssi_exudyn.results.summary import Summary
folder, fault, number = Path(sys.argv[1]), sys.argv[2], int(sys.argv[3])
rows = pd.DataFrame({"time_s": [float(i) for i in range(5000)]})
def stops(place):
    def replaced(self, target):
        global number
        if number == 0:
            os.kill(os.getpid(), signal.SIGKILL)
        number -= 1
        return place(self, target)
    return replaced
if fault == "kill":
    Path.replace = stops(Path.replace)
else:
    resource.setrlimit(resource.RLIMIT_FSIZE, (number, number))
try:
    write_result(folder, ResultContent(Summary(recording="new"), rows, {"format": 1}))
except InputError as error:
    sys.exit(str(error))
"""


def old_result(folder: Path) -> None:
    write_result(folder, ResultContent(Summary(recording="old"), pd.DataFrame({"time_s": [0.0]}), MODEL))


def other_process(folder: Path, fault: str, number: int) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-c", _MAIN, str(folder), fault, str(number)]
    return subprocess.run(command, check=False, capture_output=True, text=True)


@pytest.mark.parametrize("moves", [0, 1, 2])
@pytest.mark.long
def test_a_kill_while_files_are_moved_leaves_no_mixture(tmp_path: Path, moves: int) -> None:
    old_result(tmp_path)
    assert other_process(tmp_path, "kill", moves).returncode == -9
    assert not (tmp_path / "summary.json").exists()
    with pytest.raises(InputError, match="does not exist"):
        read_summary(tmp_path)
    old_result(tmp_path)
    assert {path.name for path in tmp_path.iterdir()} == FILES  # nothing half written is left
    assert read_summary(tmp_path).recording == "old"


@pytest.mark.parametrize("limit", [0, 100, 2000])
@pytest.mark.long
def test_a_disk_that_fills_up_leaves_the_old_result(tmp_path: Path, limit: int) -> None:
    old_result(tmp_path)
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    done = other_process(tmp_path, "full", limit)
    assert done.returncode == 1
    assert str(tmp_path) in done.stderr
    assert "too large" in done.stderr
    assert "check the path" in done.stderr
    assert done.stderr.count("\n") == 1
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before


def test_a_cache_that_cannot_be_written_is_one_clear_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object, **__: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(np, "savez", full)
    with pytest.raises(InputError, match="no space left") as info, folder_lock(tmp_path):
        Cache(tmp_path / "cache").get_or_make("key", lambda: {"x": np.zeros(3)}, {"x": (3,)})
    assert info.value.file == str(tmp_path)
    assert list((tmp_path / "cache").iterdir()) == []


def test_a_reader_that_goes_away_is_no_fault_of_the_folder(tmp_path: Path) -> None:
    with pytest.raises(BrokenPipeError), folder_lock(tmp_path):
        raise BrokenPipeError


def test_what_was_made_is_not_made_again(tmp_path: Path) -> None:
    calls = []

    def make() -> dict[str, np.ndarray]:
        calls.append(1)
        return {"x": np.array([0.1, -0.0]), "why": np.asarray("converged: the objective no longer changes")}

    shapes: Shapes = {"x": (2,), "why": ()}
    first = Cache(tmp_path).get_or_make("key", make, shapes)
    again = Cache(tmp_path).get_or_make("key", make, shapes)
    assert len(calls) == 1
    assert first["x"].tobytes() == again["x"].tobytes()
    assert str(again["why"]) == "converged: the objective no longer changes"


def test_results_of_another_recording_are_not_replaced(tmp_path: Path) -> None:
    check_own(None, "new")
    check_own(tmp_path, "new")  # there is nothing
    write_result(tmp_path, ResultContent(Summary(recording="old"), pd.DataFrame({"time_s": [0.0]}), MODEL))
    check_own(tmp_path, "old")
    with pytest.raises(InputError, match="holds the results of old") as caught:
        check_own(tmp_path, "new")
    assert "--out" in str(caught.value)
    (tmp_path / SUMMARY).write_text("{", encoding="utf-8")
    check_own(tmp_path, "new")
