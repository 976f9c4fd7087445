"""Sweeps on Dask: the same bytes as on this machine's processes, and a scheduler's death costs no finished run."""

import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import psutil
import pytest
import tomli_w

from sssi_exudyn.core.errors import SssiError
from sssi_exudyn.sweeps import sweep as sweeps
from sssi_exudyn.sweeps.pools import pool_of, slurm_cluster
from sssi_exudyn.sweeps.records import read_records

EXAMPLES = Path(__file__).parents[2] / "examples"
ROOT = EXAMPLES.parent
RUNS = 150
"""More than end between two looks of a test that has to wait for a core."""
PATIENCE = 120.0
"""s that may pass until something happens that takes seconds; no test measures time."""


def settings(count: int) -> dict[str, Any]:
    parameter = {"name": "friction.mu_t", "low": 0.04, "high": 0.12, "count": count}
    common = {"format": 1, "name": "swept", "recordings": [str(EXAMPLES / "beginner")], "duration_s": 1.0}
    return {**common, "parameter": [parameter]}


def until(true: Any) -> None:
    end = time.monotonic() + PATIENCE
    while not true():
        assert time.monotonic() < end
        time.sleep(0.02)


def nannied(pid: int) -> list[psutil.Process]:
    children = psutil.Process(pid).children(recursive=True)
    return [child for child in children if "spawn_main" in " ".join(child.cmdline())]


@contextmanager
def running(*command: str) -> Iterator[subprocess.Popen[bytes]]:
    """A Dask process and whatever it starts, ended at the end."""
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}
    process = subprocess.Popen(
        [sys.executable, "-m", *command],
        cwd=ROOT,
        env=environment,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    try:
        yield process
    finally:
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()


def test_death_of_a_worker_and_of_the_scheduler_costs_no_finished_run(tmp_path: Path) -> None:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        address = f"tcp://127.0.0.1:{free.getsockname()[1]}"
    out = tmp_path / "out"
    scheduling = ("distributed.cli.dask_scheduler", "--no-dashboard", "--host", address)
    working = ("distributed.cli.dask_worker", address, "--nworkers", "2", "--nthreads", "1", "--no-dashboard")
    file = tmp_path / "swept.toml"
    file.write_text(tomli_w.dumps(settings(RUNS)), encoding="utf-8")
    command = [sys.executable, "-m", "sssi_exudyn", "sweep", str(file), "--out", str(out), "--scheduler", address]
    with running(*scheduling) as scheduler, running(*working) as workers:
        sweep = subprocess.Popen(command, cwd=ROOT, stderr=subprocess.PIPE, text=True)
        until(lambda: len(list((out / "records").glob("*.json"))) >= 5)
        nannied(workers.pid)[0].kill()
        until(lambda: len(list((out / "records").glob("*.json"))) >= 15)
        scheduler.kill()
        _, told = sweep.communicate(timeout=PATIENCE)
    assert sweep.returncode == 1
    assert told.splitlines()[-1].startswith("sssi: the scheduler went away")
    assert "Traceback" not in told
    kept = {name for name, _ in read_records(out)}
    counts = sweeps.resume(out, workers=2, cluster="local")
    assert (counts["done"], counts["left"], counts["repeated"]) == (RUNS, 0, 0)
    assert kept <= {name for name, _ in read_records(out)}
    here = tmp_path / "here"
    sweeps.sweep(settings(RUNS), here, workers=1)
    assert (here / "runs.parquet").read_bytes() == (out / "runs.parquet").read_bytes()


def test_slurm_jobs_have_a_core_and_a_thread_each() -> None:
    with slurm_cluster() as cluster:
        script = cluster.job_script()
    assert "#SBATCH --cpus-per-task=1" in script
    assert "--nthreads 1" in script


def test_scheduler_that_does_not_answer_is_told_in_a_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sssi_exudyn.sweeps.pools._PATIENCE", "1s")
    with pytest.raises(SssiError, match="no Dask scheduler answers"), pool_of("tcp://127.0.0.1:9", None)(1):
        pass


def test_missing_package_is_told_in_a_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(SssiError, match=r"distributed: pip install 'sssi-exudyn\[sweep\]'"), pool_of(None, "local")(1):
        pass
