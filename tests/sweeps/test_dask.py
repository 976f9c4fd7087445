"""Sweeps on Dask: the same bytes as on this machine's processes; a scheduler's death costs no finished run."""

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

import pandas as pd
import psutil
import pytest
import tomli_w
from distributed import Security
from thread_pool import thread_pool

import sssi_exudyn
from sssi_exudyn.core.errors import SssiError
from sssi_exudyn.sweeps import sweep as sweeps
from sssi_exudyn.sweeps.records import read_records
from sssi_exudyn.sweeps.workers.pools import pool_of

EXAMPLES = Path(__file__).parents[2] / "examples"
ROOT = EXAMPLES.parent
RUNS = 150
"""Number of runs, more than end between two looks of a test that has to wait for a core."""
PATIENCE = 120.0
"""Longest wait (s) for what takes seconds; no test measures time."""


def settings(count: int) -> dict[str, Any]:
    parameter = {"name": "friction.mu_t", "low": 0.04, "high": 0.12, "count": count}
    common = {"format": 1, "name": "swept", "recordings": [str(EXAMPLES / "beginner")], "duration_s": 1.0}
    return {**common, "parameter": [parameter]}


def until(true: Any) -> None:
    end = time.monotonic() + PATIENCE
    while not true():
        assert time.monotonic() < end
        time.sleep(0.02)


def free_port() -> int:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        return int(free.getsockname()[1])


def nannied(pid: int) -> list[psutil.Process]:
    children = psutil.Process(pid).children(recursive=True)
    return [child for child in children if "spawn_main" in " ".join(child.cmdline())]


def certificates(folder: Path) -> list[str]:
    """Write a key and a certificate into ``folder`` and return the options of Dask's programs for them."""
    security = Security.temporary()
    options = []
    for option, name, text in (
        ("ca-file", "ca", security.tls_ca_file),
        ("cert", "cert", security.tls_client_cert),
        ("key", "key", security.tls_client_key),
    ):
        (folder / f"{name}.pem").write_text(text, encoding="ascii")
        options += [f"--tls-{option}", str(folder / f"{name}.pem")]
    return options


@contextmanager
def running(*command: str) -> Iterator[subprocess.Popen[bytes]]:
    """Start a Dask process, and end it and whatever it starts when the block ends."""
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


@pytest.mark.long(seconds=35)
@pytest.mark.usefixtures("words_only")
def test_death_of_a_worker_and_of_the_scheduler_costs_no_finished_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Use a scheduler that asks for certificates, which Dask's own configuration names."""
    address = f"tls://127.0.0.1:{free_port()}"
    out = tmp_path / "out"
    tls = certificates(tmp_path)
    scheduling = ("distributed.cli.dask_scheduler", "--no-dashboard", "--host", address, *tls)
    working = ("distributed.cli.dask_worker", address, "--nworkers", "2", "--nthreads", "1", "--no-dashboard", *tls)
    prefix = "DASK_DISTRIBUTED__COMM__TLS__"
    monkeypatch.setenv(f"{prefix}CA_FILE", tls[1])
    monkeypatch.setenv(f"{prefix}CLIENT__CERT", tls[3])
    monkeypatch.setenv(f"{prefix}CLIENT__KEY", tls[5])
    file = tmp_path / "swept.toml"
    file.write_text(tomli_w.dumps(settings(RUNS)), encoding="utf-8")
    command = [sys.executable, "-m", "sssi_exudyn", "sweep", str(file), "--out", str(out), "--scheduler", address]
    with running(*scheduling) as scheduler, running(*working) as workers:
        sweep = subprocess.Popen(command, cwd=ROOT, stderr=subprocess.PIPE, text=True)
        until(lambda: len(list((out / "records").glob("*.json"))) >= 5)
        nannied(workers.pid)[0].kill()
        until(lambda: len(list((out / "records").glob("*.json"))) >= 15)
        scheduler.kill()
        _, errors = sweep.communicate(timeout=PATIENCE)
    assert sweep.returncode == 1
    assert errors.splitlines()[-1].startswith("sssi: the connection to the scheduler is lost")
    assert "Traceback" not in errors
    finished = {name for name, _ in read_records(out)}
    counts = sweeps.resume(out, workers=1, cluster="local")
    assert (counts["done"], counts["left"], counts["repeated"]) == (RUNS, 0, 0)
    assert finished <= {name for name, _ in read_records(out)}
    at_once = tmp_path / "here"
    monkeypatch.setattr(sweeps, "pool_of", lambda *_: thread_pool)
    sweeps.sweep(settings(RUNS), at_once)
    assert (at_once / "runs.parquet").read_bytes() == (out / "runs.parquet").read_bytes()


@pytest.mark.long(seconds=25)
@pytest.mark.usefixtures("words_only")
def test_what_ifs_are_answered_though_a_worker_dies(tmp_path: Path) -> None:
    result, out = tmp_path / "results" / "beginner", tmp_path / "out"
    sssi_exudyn.simulate(EXAMPLES / "beginner", result, seconds=":2.1")
    wind = {"name": "wind.w_f", "low": -20.0, "high": 0.0, "count": 12}
    asked = {
        "format": 1,
        "name": "asked",
        "task": "whatif",
        "recordings": [str(result)],
        "keep": "movement",
        "parameter": [wind],
    }
    address = f"tcp://127.0.0.1:{free_port()}"
    file = tmp_path / "asked.toml"
    file.write_text(tomli_w.dumps(asked), encoding="utf-8")
    working = ("distributed.cli.dask_worker", address, "--nworkers", "2", "--nthreads", "1", "--no-dashboard")
    command = [sys.executable, "-m", "sssi_exudyn", "sweep", str(file), "--out", str(out), "--scheduler", address]
    with (
        running("distributed.cli.dask_scheduler", "--no-dashboard", "--host", address),
        running(*working) as workers,
    ):
        sweep = subprocess.Popen(command, cwd=ROOT, stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
        until(lambda: len(list((out / "records").glob("*.json"))) >= 2)
        nannied(workers.pid)[0].kill()
        assert sweep.wait(PATIENCE) == 0
    rows = pd.read_parquet(out / "runs.parquet").sort_values("wind.w_f")
    assert (rows["status"] == "done").all()
    assert list(rows["skiable"].iloc[[0, -1]]) == [0.0, 1.0]  # a storm from ahead, and the recorded air
    sweeps.sweep(asked, tmp_path / "here", in_this_process=True)
    assert (tmp_path / "here" / "runs.parquet").read_bytes() == (out / "runs.parquet").read_bytes()


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:9", "tls://127.0.0.1:9", "nonsense://x"])
def test_scheduler_that_does_not_answer_is_one_line(
    address: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sssi_exudyn.sweeps.workers.pools.SCHEDULER_TIMEOUT", "1s")
    with pytest.raises(SssiError, match="no Dask scheduler answers"), pool_of(address, None, tmp_path)(1):
        pass


@pytest.mark.parametrize("package", ["distributed", "cryptography"])
def test_missing_package_is_one_line(package: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, package, None)
    message = rf"{package}: pip install 'sssi-exudyn\[sweep\]'"
    with pytest.raises(SssiError, match=message), pool_of(None, "local", tmp_path)(1):
        pass
