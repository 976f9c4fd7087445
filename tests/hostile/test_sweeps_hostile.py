"""Begun sweeps from other people: runs without a whole record are done again, other faults give one clear line."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from fuzz_seeds import begun_sweep
from fuzz_uses import resume_without_runs
from limited import run_limited
from tiny import Tiny

from sssi_exudyn.commands.pages import report

Spoil = Callable[[Path], object]


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Write a sweep of three runs, of which two have ended, one with a record in a file of its own."""
    folder = tmp_path_factory.mktemp("whole")
    written = Tiny().write(folder / "tiny")
    recording = {path.name: path.read_bytes() for path in written.iterdir()}
    sweep = begun_sweep(folder / "sweep", recording)
    copy = Path(shutil.copytree(sweep, folder / "copy"))
    assert resume_without_runs(copy)["done"] == 2
    report([copy], folder / "page.html")
    return sweep


@pytest.fixture
def sweep(whole: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(whole, tmp_path / "sweep"))


def record(folder: Path) -> Path:
    (path,) = (folder / "records").glob("*.json")
    return path


def part(folder: Path) -> Path:
    (path,) = (folder / "records").glob("part-*.parquet")
    return path


def in_record(**changes: Any) -> Spoil:
    def spoil(folder: Path) -> None:
        table = json.loads(record(folder).read_text(encoding="utf-8"))
        record(folder).write_text(json.dumps(table | changes), encoding="utf-8")

    return spoil


def pipe(of: Callable[[Path], Path]) -> Spoil:
    def spoil(folder: Path) -> None:
        path = of(folder)
        path.unlink()
        os.mkfifo(path)

    return spoil


def long_texts(folder: Path) -> None:
    """Write 200 000 rows of one text of 10 MB, which are 10 kB on disk."""
    text = pa.array(["x" * 10_000_000])
    rows = pa.DictionaryArray.from_arrays(pa.array([0] * 200_000, pa.int32()), text)
    pq.write_table(pa.table({"name": rows, "record": rows}), part(folder), compression="zstd")


def swelling(folder: Path) -> None:
    """Write a text of 300 MB, which is 30 kB on disk."""
    text = pa.array([b"\0" * 300_000_000]).cast(pa.string())
    table = pa.table({"name": pa.array(["a"]), "record": text})
    # statistics would take seconds
    pq.write_table(table, part(folder), compression="zstd", use_dictionary=False, write_statistics=False)


def beyond_the_texts(folder: Path) -> None:
    """Write a row that points to the sixth text where there is one."""
    rows = pa.DictionaryArray.from_arrays(pa.array([5], pa.int32()), pa.array(["a"]), safe=False)
    pq.write_table(pa.table({"name": rows, "record": rows}), part(folder))


DONE_AGAIN: dict[str, Spoil] = {
    "record: cut": lambda folder: record(folder).write_bytes(record(folder).read_bytes()[:50]),
    "record: nested": lambda folder: record(folder).write_bytes(b"[" * 90_000),
    "record: large": lambda folder: record(folder).write_bytes(b" " * 60_000_000),
    "record: key that is a list": in_record(key=[1]),
    "record: digits": lambda folder: record(folder).write_text(f'{{"attempt": {"9" * 5000}}}', encoding="utf-8"),
    "record: infinite": in_record(wall_s=1e999),
    "record: a pipe": pipe(record),
    "part: torn": lambda folder: part(folder).write_bytes(part(folder).read_bytes()[:-40]),
    "part: of numbers": lambda folder: pq.write_table(pa.table({"name": [1], "record": [2]}), part(folder)),
    "part: long texts": long_texts,
    "part: a text that swells": swelling,
    "part: beyond the texts": beyond_the_texts,
    "part: a pipe": pipe(part),
}


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[pytest.mark.long] if "swells" in name else []) for name in DONE_AGAIN]
)
def test_runs_without_a_whole_record_are_done_again(sweep: Path, name: str) -> None:
    DONE_AGAIN[name](sweep)
    outcome = run_limited(lambda: check_one_done(sweep))
    assert outcome.verdict == "taken", outcome


def check_one_done(folder: Path) -> None:
    """Check that of the two runs that had ended one is left."""
    assert resume_without_runs(folder)["done"] == 1


def origin(change: Callable[[dict[str, Any]], object]) -> Spoil:
    def spoil(folder: Path) -> None:
        table = json.loads((folder / "sweep.json").read_text(encoding="utf-8"))
        change(table)
        (folder / "sweep.json").write_text(json.dumps(table), encoding="utf-8")

    return spoil


def text(name: str, content: str) -> Spoil:
    return lambda folder: (folder / name).write_text(content, encoding="utf-8")


REFUSED: dict[str, tuple[Spoil, str]] = {
    "origin: inputs as a list": (origin(lambda t: t.update(inputs=[])), "sweep.json: $.inputs"),
    "origin: no runs": (origin(lambda t: t.pop("runs")), "runs"),
    "origin: another sweep": (origin(lambda t: t.update(identity="x")), "another sweep"),
    "origin: other versions": (origin(lambda t: t["versions"].update(exudyn="0")), "other versions"),
    "origin: digits": (text("sweep.json", '{"format": ' + "9" * 5000 + "}"), "larger than any"),
    "origin: a pipe": (pipe(lambda folder: folder / "sweep.json"), "this is not a file"),
    "file: a pipe": (pipe(lambda folder: folder / "sweep.toml"), "this is not a file"),
    "file: dotted": (text("sweep.toml", ".".join(["a"] * 40_000) + " = 1\n"), "too many parts"),
    "file: another folder's recording": (
        text("sweep.toml", 'format = 1\nname = "begun"\nrecordings = ["/etc"]\n'),
        "recording.toml",
    ),
}


@pytest.mark.parametrize("name", REFUSED)
def test_a_sweep_that_is_none_is_one_clear_line(sweep: Path, name: str) -> None:
    spoil, problem = REFUSED[name]
    spoil(sweep)
    outcome = run_limited(lambda: resume_without_runs(sweep))
    assert outcome.verdict == "refused", outcome
    assert problem in outcome.text


def in_table(**columns: Any) -> Spoil:
    def spoil(folder: Path) -> None:
        table = pq.read_table(folder / "runs.parquet").to_pandas().assign(**columns)
        table.to_parquet(folder / "runs.parquet", index=False)

    return spoil


def without(name: str) -> Spoil:
    def spoil(folder: Path) -> None:
        pq.write_table(pq.read_table(folder / "runs.parquet").drop_columns([name]), folder / "runs.parquet")

    return spoil


TABLES: dict[str, tuple[Spoil, str]] = {
    "no status": (without("status"), "column status: the column is missing"),
    "no friction": (without("friction.mu_t"), "column friction.mu_t: the column is missing"),
    "words for a figure": (in_table(run="first"), "in place of numbers"),
    "names of 9000 letters": (in_table(recording="x" * 9000), "texts that are no names"),
    "a pipe": (pipe(lambda folder: folder / "runs.parquet"), "this is not a file"),
    "torn": (lambda folder: (folder / "runs.parquet").write_bytes(b"PAR1"), "not a Parquet file"),
}


@pytest.mark.parametrize("name", TABLES)
def test_a_table_that_is_none_has_no_page(sweep: Path, name: str) -> None:
    spoil, problem = TABLES[name]
    spoil(sweep)
    outcome = run_limited(lambda: report([sweep], sweep.parent / "page.html"))
    assert outcome.verdict == "refused", outcome
    assert problem in outcome.text
    assert not (sweep.parent / "page.html").exists()


def test_errors_of_runs_are_shown_on_one_line(sweep: Path) -> None:
    in_table(status="failed", error="one\ntwo \x1b[31m<script>" + "x" * 9000)(sweep)
    page = sweep.parent / "page.html"
    outcome = run_limited(lambda: report([sweep], page))
    assert outcome.verdict == "taken", outcome
    shown = page.read_text(encoding="utf-8")
    assert "one two \\x1b[31m&lt;script&gt;xxx" in shown
