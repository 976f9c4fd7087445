"""Substitutes where the system has no POSIX, forced on this system: the same locks and the same refusals."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.importing.motion_capture.c3d_points import read_points
from sssi_exudyn.runtime.posix import pages, posix_module
from sssi_exudyn.sweeps.plan import Job, SweepRun
from sssi_exudyn.sweeps.records import claim
from sssi_exudyn.sweeps.run import record_of

HOLDER = (
    "import sys, time, pathlib\n"
    "from sssi_exudyn.sweeps.records import claim\n"
    "with claim(pathlib.Path(sys.argv[1]), 7) as mine:\n"
    "    print(mine, flush=True)\n"
    "    time.sleep(600)\n"
)


@pytest.fixture
def _without(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SSSI_WITHOUT_POSIX", "1")


@pytest.mark.usefixtures("_without")
def test_no_posix_module_is_there() -> None:
    assert posix_module("fcntl") is None
    assert posix_module("resource") is None
    assert pages() is None


@pytest.mark.usefixtures("_without")
def test_a_sweeps_record_leaves_out_memory_that_is_unknown(tmp_path: Path) -> None:
    job = Job("", (), (str(tmp_path / "missing"),), ("",), None, (), "simulate", "reduced", "joint", None, False)
    record = record_of(job, SweepRun(0, "0" * 32, 0, ()), tmp_path / "sweep")
    assert (record.status, record.memory_MB) == ("failed", None)


def test_memory_is_reported_where_it_can_be(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("SSSI_WITHOUT_POSIX", raising=False)
    memory = pages()
    if memory is None:
        assert not Path("/proc/self/statm").exists()
    else:
        assert 1e7 < memory[1] <= memory[0]


@pytest.mark.usefixtures("_without")
def test_a_run_is_held_by_one_process_until_it_dies(tmp_path: Path) -> None:
    other = subprocess.Popen([sys.executable, "-c", HOLDER, str(tmp_path)], stdout=subprocess.PIPE, text=True)
    assert other.stdout is not None
    assert other.stdout.readline() == "True\n"
    with claim(tmp_path, 7) as mine, claim(tmp_path, 8) as next_one:
        assert (mine, next_one) == (False, True)
    other.kill()
    other.wait()
    with claim(tmp_path, 7) as mine:
        assert mine
    assert not (tmp_path / "running.lock").exists()


@pytest.mark.usefixtures("_without")
def test_captures_are_read_and_refused_as_elsewhere(tmp_path: Path) -> None:
    path = tmp_path / "damaged.c3d"
    path.write_bytes(b"\x02P" + b"\xff" * 2000)
    with pytest.raises(InputError, match=r"damaged, or no C3D file|are no capture"):
        read_points(path)
