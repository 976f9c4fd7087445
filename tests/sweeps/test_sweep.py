"""Sweeps as they run: the same bytes from any workers, and nothing lost or done twice when processes are killed."""

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import pandas as pd
import psutil
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import tomli_w
from deadly import perform_or_die
from thread_pool import thread_pool

from sssi_exudyn import commands
from sssi_exudyn.core.errors import InputError, SssiError
from sssi_exudyn.io.typed import decode, encode
from sssi_exudyn.sweeps import sweep as sweeps
from sssi_exudyn.sweeps.plan import Job, SweepRun, plan_sweep
from sssi_exudyn.sweeps.records import claim, gather, last_records, read_records, write_record
from sssi_exudyn.sweeps.run import crash_record
from sssi_exudyn.sweeps.workers import scheduler as sweep_scheduler
from sssi_exudyn.sweeps.workers.worker import perform

EXAMPLES = Path(__file__).parents[2] / "examples"
ROOT = EXAMPLES.parent
PATIENCE = 120.0
"""Longest wait (s) for what takes seconds; no test measures time."""


def settings(**others: Any) -> dict[str, Any]:
    """Return a sweep of a second's run, which takes 50 ms."""
    parameter = {"name": "friction.mu_t", "low": 0.04, "high": 0.12, "count": 5}
    common = {"format": 1, "recordings": [str(EXAMPLES / "beginner")], "duration_s": 1.0, "parameter": [parameter]}
    return {**common, **others}


def written(folder: Path, **others: Any) -> Path:
    path = folder / "swept.toml"
    path.write_text(tomli_w.dumps(settings(**others)), encoding="utf-8")
    return path


@pytest.fixture
def within(monkeypatch: pytest.MonkeyPatch) -> None:
    """Run sweeps within this process."""
    monkeypatch.setattr(sweeps, "pool_of", lambda *_: thread_pool)


@pytest.fixture(scope="module")
def swept(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("sweep") / "out"
    counts = sweeps.sweep(settings(), out, workers=2)
    assert (counts["done"], counts["left"], counts["repeated"]) == (5, 0, 0)
    return out


@pytest.mark.long
def test_table_has_a_row_a_run_with_inputs_units_and_figures(swept: Path) -> None:
    table = pd.read_parquet(swept / "runs.parquet")
    assert table["friction.mu_t"].tolist() == pytest.approx([0.04, 0.06, 0.08, 0.1, 0.12])
    assert set(table["status"]) == {"done"}
    assert table["end_speed_mps"].is_monotonic_decreasing  # more friction, less speed
    assert table["mean_load_N"].between(300.0, 1500.0).all()  # half to twice the weight of 70 kg and gear
    schema = pq.read_schema(swept / "runs.parquet")
    assert schema.field("skier.mass" if "skier.mass" in schema.names else "friction.mu_t").metadata[b"unit"] == b"1"
    assert schema.field("end_speed_mps").metadata[b"unit"] == b"m/s"
    origin = json.loads(schema.metadata[b"sssi_sweep"])
    assert "beginner/motion.bvh" in origin["inputs"]
    assert str(EXAMPLES) not in json.dumps(origin)
    units = pd.read_csv(swept / "columns.csv")
    assert units["name"].tolist() == table.columns.tolist()
    for row in table.itertuples():
        series = pd.read_parquet(swept / str(row.series))
        # the series is kept in single precision
        assert series["com_f_m"].iloc[-1] - series["com_f_m"].iloc[0] == pytest.approx(row.down_m, rel=1e-5)
    timings = pd.read_parquet(swept / "timings.parquet")
    assert sorted(timings["key"]) == sorted(table["key"])
    assert (timings["wall_s"] > 0).all()


@pytest.mark.long
@pytest.mark.usefixtures("within", "words_only")
def test_same_file_gives_the_same_bytes_on_another_number_of_workers(swept: Path, tmp_path: Path) -> None:
    sweeps.sweep(settings(), tmp_path / "deeper" / "one", workers=1)
    for name in ("runs.parquet", "columns.csv"):
        assert (tmp_path / "deeper" / "one" / name).read_bytes() == (swept / name).read_bytes()


@pytest.mark.long
def test_the_page_is_made_again_from_the_folder_alone(swept: Path, tmp_path: Path) -> None:
    moved = tmp_path / "deep" / "moved"  # its sweep.toml now names a recording that is not there
    shutil.copytree(swept, moved)
    commands.report([moved], tmp_path / "page.html")
    assert (tmp_path / "page.html").read_bytes() == (swept / "summary.html").read_bytes()
    with pytest.raises(InputError, match="this is a sweep"):
        commands.report([moved], tmp_path / "page.pdf")


@pytest.mark.long
def test_finished_sweep_is_not_run_again(swept: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    before = (swept / "runs.parquet").read_bytes()
    ends = pd.read_parquet(swept / "timings.parquet")["end"].tolist()
    counts = sweeps.resume(swept)
    assert counts["done"] == 5
    assert pd.read_parquet(swept / "timings.parquet")["end"].tolist() == ends
    assert (swept / "runs.parquet").read_bytes() == before
    with pytest.raises(InputError, match="another sweep"):
        sweeps.sweep(settings(duration_s=1.5), swept)
    monkeypatch.setattr("sssi_exudyn.sweeps.plan.versions", lambda: {"sssi_exudyn": "0"})
    with pytest.raises(InputError, match="other versions"):
        sweeps.resume(swept)


@pytest.mark.long
@pytest.mark.usefixtures("within")
def test_failed_runs_leave_their_error_and_may_be_retried(tmp_path: Path) -> None:
    # a boot centre 1.9 m from the tail of a ski of 1.65 m is within its own bounds, but off the ski
    boots = {"name": "ski.boot_centre", "values": [0.7, 1.9]}
    counts = sweeps.sweep(settings(parameter=[boots]), tmp_path, workers=1)
    assert (counts["done"], counts["failed"]) == (1, 1)
    table = pd.read_parquet(tmp_path / "runs.parquet")
    assert "boot centre" in table["error"][1]
    assert pd.isna(table["end_speed_mps"][1])
    assert table["series"].notna().tolist() == [True, False]
    assert sweeps.resume(tmp_path, workers=1)["failed"] == 1
    assert pd.read_parquet(tmp_path / "timings.parquet")["attempt"].max() == 0
    counts = sweeps.retry(tmp_path, workers=1)
    assert (counts["done"], counts["failed"], counts["repeated"]) == (1, 1, 0)
    assert sorted(pd.read_parquet(tmp_path / "timings.parquet")["attempt"]) == [0, 1]


@pytest.mark.long
def test_recording_that_has_changed_stops_the_sweep(tmp_path: Path) -> None:
    shutil.copytree(EXAMPLES / "beginner", tmp_path / "beginner")
    plan = plan_sweep(sweeps.read_sweep(written(tmp_path, recordings=["beginner"])))
    toml = tmp_path / "beginner" / "recording.toml"
    toml.write_text(toml.read_text(encoding="utf-8") + "\n", encoding="utf-8")
    work = sweep_scheduler.Work(tmp_path, plan.job, perform, "")
    with pytest.raises(InputError, match="has changed"):
        sweep_scheduler.do_all(work, plan.runs(), thread_pool, 1, lambda _run, _status: None)


@pytest.mark.long
@pytest.mark.usefixtures("words_only")
def test_run_that_kills_its_worker_is_found_and_the_others_go_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sweeps, "perform", perform_or_die)
    counts = sweeps.sweep(settings(), tmp_path, workers=2)
    assert (counts["done"], counts["crashed"], counts["left"], counts["repeated"]) == (4, 1, 0, 0)
    monkeypatch.undo()
    monkeypatch.setattr(sweeps, "pool_of", lambda *_: thread_pool)
    counts = sweeps.retry(tmp_path, workers=1)
    assert (counts["done"], counts["crashed"], counts["repeated"]) == (5, 0, 0)


def test_claim_holds_against_another_process_and_ends_with_it(tmp_path: Path) -> None:
    code = (
        "import sys, time, pathlib; from sssi_exudyn.sweeps.records import claim\n"
        "with claim(pathlib.Path(sys.argv[1]), 7) as mine: print(mine, flush=True); time.sleep(600)"
    )
    other = subprocess.Popen([sys.executable, "-c", code, str(tmp_path)], stdout=subprocess.PIPE, text=True)
    try:
        assert other.stdout is not None
        assert other.stdout.readline() == "True\n"
        with claim(tmp_path, 7) as mine, claim(tmp_path, 8) as next_one:
            assert (mine, next_one) == (False, True)
    finally:
        other.kill()
        other.wait()
    with claim(tmp_path, 7) as mine:
        assert mine


def test_records_survive_gathering_and_its_interruption(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    plan = plan_sweep(sweeps.sweep_from(settings(), EXAMPLES / "swept.toml"))
    runs = list(plan.runs())
    for run in runs:
        write_record(tmp_path, crash_record(run))
    gather(tmp_path, {runs[0].key})
    assert len(list((tmp_path / "records").glob("*.json"))) == 4
    monkeypatch.setattr(Path, "unlink", lambda _path, missing_ok: None)  # as if killed before it takes them away
    gather(tmp_path)
    assert len(list(read_records(tmp_path))) == 5 + 4
    records, repeated = last_records(tmp_path)
    assert (len(records), repeated) == (5, 0)
    write_record(tmp_path, crash_record(runs[0]))
    assert last_records(tmp_path)[1] == 1  # a run that ended twice is seen


@pytest.mark.parametrize("torn", [b"", b"PAR1", b"PAR1 \0\0 PAR1", b"half"])
def test_torn_records_are_passed_over_and_their_runs_done_again(torn: bytes, tmp_path: Path) -> None:
    plan = plan_sweep(sweeps.sweep_from(settings(), EXAMPLES / "swept.toml"))
    for run in plan.runs():
        write_record(tmp_path, crash_record(run))
    gather(tmp_path)
    (part,) = (tmp_path / "records").glob("part-*.parquet")
    content = part.read_bytes()
    part.write_bytes(content[: len(content) // 2] if torn == b"half" else torn)
    write_record(tmp_path, crash_record(plan.run(0)))
    (tmp_path / "records" / "x-0.0.json").write_bytes(torn)
    (tmp_path / "records" / "y-0.0.json").write_text('{"key": "y", "attempt": "first"}', encoding="utf-8")
    os.mkfifo(tmp_path / "records" / "z-0.0.json")
    os.mkfifo(tmp_path / "records" / "part-z.parquet")
    assert list(last_records(tmp_path)[0]) == [plan.keys[0]]
    pq.write_table(pa.table({"words": ["no", "record"]}), tmp_path / "records" / "part-y.parquet")
    gather(tmp_path)
    assert list(last_records(tmp_path)[0]) == [plan.keys[0]]


@pytest.mark.long
@pytest.mark.usefixtures("words_only")
@pytest.mark.parametrize("kind", ["plain", "given"])
def test_sweep_of_an_earlier_version_is_continued(kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Take folders left by version 0.1.0, one with a ``model =``; two runs of three had ended when it was killed."""
    out = tmp_path / "out"
    shutil.copytree(Path(__file__).with_name("begun") / kind, out)
    file = out / "sweep.toml"
    text = file.read_text(encoding="utf-8")
    file.write_text(text.replace("../../../../examples", EXAMPLES.as_posix()), encoding="utf-8")
    origin = json.loads((out / "sweep.json").read_text(encoding="utf-8"))
    monkeypatch.setattr("sssi_exudyn.sweeps.plan.versions", lambda: origin["versions"])
    monkeypatch.setattr("sssi_exudyn.sweeps.run.versions", lambda: origin["versions"])
    before = last_records(out)[0]
    assert (sweeps.status(out)["done"], sweeps.status(out)["left"]) == (2, 1)
    monkeypatch.setattr(sweeps, "pool_of", lambda *_: thread_pool)
    counts = sweeps.resume(out)
    assert (counts["done"], counts["left"], counts["repeated"]) == (3, 0, 0)
    after = last_records(out)[0]
    assert {key: after[key] for key in before} == before
    speeds = pd.read_parquet(out / "runs.parquet")["end_speed_mps"]
    assert speeds.is_monotonic_decreasing  # with friction, the new run among the old ones


def test_job_and_run_reach_a_worker_as_they_are() -> None:
    file = settings(term=[{"name": "wind", "w_f": -0.1 - 0.2}], parameter=[{"name": "skier.mass", "values": [70.1]}])
    plan = plan_sweep(sweeps.sweep_from(file, EXAMPLES / "swept.toml"))
    task = encode((plan.job, plan.run(0)))
    assert decode(task, tuple[Job, SweepRun]) == (plan.job, plan.run(0))
    with pytest.raises(ValueError, match="Expected"):
        decode(task.replace(b'"row":0', b'"row":"0"'), tuple[Job, SweepRun])


@pytest.fixture
def started(tmp_path: Path) -> Callable[..., tuple[subprocess.Popen[str], Path]]:
    """Start a sweep of that many runs in a process of its own."""

    def start(count: int) -> tuple[subprocess.Popen[str], Path]:
        many = [{"name": "friction.mu_t", "low": 0.04, "high": 0.12, "count": count}]
        file, out = written(tmp_path, parameter=many), tmp_path / "out"
        command = [sys.executable, "-m", "sssi_exudyn", "sweep", str(file), "--out", str(out), "--workers", "2"]
        # a shell that runs the tests in its background has its children ignore interrupts
        listen = partial(signal.signal, signal.SIGINT, signal.SIG_DFL)
        return subprocess.Popen(command, cwd=ROOT, stderr=subprocess.PIPE, text=True, preexec_fn=listen), out

    return start


def until(true: Callable[[], bool]) -> None:
    end = time.monotonic() + PATIENCE
    while not true():
        assert time.monotonic() < end
        time.sleep(0.02)


def ended(out: Path) -> int:
    return len(list((out / "records").glob("*.json")))


def workers_of(pid: int) -> list[psutil.Process]:
    return [
        child for child in psutil.Process(pid).children(recursive=True) if "spawn_main" in " ".join(child.cmdline())
    ]


def gone(process: psutil.Process) -> bool:
    try:
        return not process.is_running() or process.status() == psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return True


@pytest.mark.long(seconds=20)
@pytest.mark.usefixtures("words_only")
def test_killed_worker_then_killed_sweep_lose_nothing_and_repeat_nothing(
    started: Callable[[int], tuple[subprocess.Popen[str], Path]], monkeypatch: pytest.MonkeyPatch
) -> None:
    count = 150  # more than end between two looks of a test that has to wait for a core
    process, out = started(count)
    until(lambda: ended(out) >= 5)
    workers_of(process.pid)[0].kill()
    until(lambda: ended(out) >= 15)
    orphans = workers_of(process.pid)
    process.kill()
    process.wait()
    until(lambda: all(gone(orphan) for orphan in orphans))
    finished = {record.key: record for _, record in read_records(out)}
    assert 15 <= len(finished) < count
    status = sweeps.status(out)
    assert (status["done"], status["left"], status["running"]) == (len(finished), count - len(finished), False)
    monkeypatch.setattr(sweeps, "pool_of", lambda *_: thread_pool)
    counts = sweeps.resume(out)
    assert (counts["done"], counts["left"], counts["repeated"]) == (count, 0, 0)
    records = [record for _, record in read_records(out)]
    assert len(records) == count
    assert {record.key: record for record in records if record.key in finished} == finished
    assert len(pd.read_parquet(out / "runs.parquet")) == count


@pytest.mark.long
def test_interrupt_stops_workers_and_says_how_to_go_on(
    started: Callable[[int], tuple[subprocess.Popen[str], Path]],
) -> None:
    process, out = started(1000)
    until(lambda: ended(out) >= 2)
    workers = workers_of(process.pid)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=PATIENCE)
    assert process.returncode == 130
    assert errors.splitlines()[-1] == "sssi: interrupted; resume with the same command"
    assert "Traceback" not in errors
    until(lambda: all(gone(worker) for worker in workers))
    assert sweeps.status(out)["done"] < 1000


def test_two_ways_to_a_cluster_exclude_each_other(tmp_path: Path) -> None:
    with pytest.raises(SssiError, match="exclude"):
        sweeps.sweep(settings(), tmp_path, scheduler="tcp://127.0.0.1:1", cluster="local")
