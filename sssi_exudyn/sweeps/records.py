"""What a sweep has done so far, on disk: one small file a finished run, gathered into larger ones from time to time.

A record is written whole under another name and moved into place by the worker that made it, so it outlives the
worker, the process that started it, and any scheduler between them.  While a run is worked on, its byte of
``running.lock`` is locked: a worker whose parent is gone and the sweep that was resumed meanwhile never do the same
run, and the operating system lets go of the byte when its owner dies.  Of a retried run the last attempt counts.

The folder has to be one file system for all workers, with POSIX locks.
"""

from __future__ import annotations

import errno
import fcntl
import json
import os
import sys
import uuid
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

import pyarrow as pa
import pyarrow.parquet as pq

from sssi_exudyn.io.writing import clear_errors

RECORDS: Final = "records"
SERIES: Final = "series"
_RUNNING: Final = "running.lock"
DONE: Final = "done"
STATUSES: Final = (DONE, "diverged", "failed", "crashed")
"""How a run may end: whole, given up by the solver, by another error, with the death of its worker."""
_GATHERED: Final = "part-"

Record = dict[str, Any]


@contextmanager
def claimed(folder: Path, row: int) -> Iterator[bool]:
    """Claim the run of ``row`` while inside; False where another process has it."""
    with (folder / _RUNNING).open("ab") as file:
        try:
            fcntl.lockf(file, fcntl.LOCK_EX | fcntl.LOCK_NB, 1, row)
        except OSError as error:
            if error.errno not in (errno.EACCES, errno.EAGAIN):
                raise
            yield False
            return
        yield True


def write_record(folder: Path, record: Record) -> None:
    """Keep a finished run's record.  Raises InputError where it cannot be written."""
    name = f"{record['key']}-{record['attempt']}.{uuid.uuid4().hex[:8]}.json"
    path = folder / RECORDS / name
    made = path.with_name(f".{name}")
    with clear_errors(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        made.write_text(json.dumps(record, allow_nan=False), encoding="utf-8")
        made.replace(path)


def is_recorded(folder: Path, key: str, attempt: int) -> bool:
    """True when that attempt at the run has ended and was not gathered yet."""
    return any((folder / RECORDS).glob(f"{key}-{attempt}.*.json"))


def series_path(folder: Path, key: str) -> Path:
    """Where a run's time series stands."""
    return folder / SERIES / key[:2] / f"{key}.parquet"


def write_series(folder: Path, key: str, series: pa.Table) -> None:
    """Keep a run's time series.  Raises InputError where it cannot be written."""
    path = series_path(folder, key)
    with clear_errors(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        made = path.with_name(f".{path.name}.{os.getpid()}")
        pq.write_table(series, made, compression="zstd")
        made.replace(path)


def read_records(folder: Path) -> Iterator[tuple[str, Record]]:
    """Every record there is, with the name that it was written under; a name may come twice.

    The small files first: those that are gathered meanwhile are then in the larger ones.
    """
    for path in (folder / RECORDS).glob("*.json"):
        text = _read(path)
        if text is not None:
            yield path.name, _parsed(text)
    for path in sorted((folder / RECORDS).glob(f"{_GATHERED}*.parquet")):
        table = pq.read_table(path)
        for name, text in zip(table["name"].to_pylist(), table["record"].to_pylist(), strict=True):
            yield name, _parsed(text)


def last_records(folder: Path) -> tuple[dict[str, Record], int]:
    """The last attempt's record of every run that has ended, by key; and how many attempts ended more than once.

    The second is a check on the claims: it is always 0.
    """
    found: dict[str, Record] = {}
    names: set[str] = set()
    attempts: set[tuple[str, int]] = set()
    for name, record in read_records(folder):
        key, attempt = record["key"], record["attempt"]
        names.add(name)
        attempts.add((key, attempt))
        if key not in found or found[key]["attempt"] < attempt:
            found[key] = record
    return found, len(names) - len(attempts)


def gather(folder: Path, only: Collection[str] | None = None) -> None:
    """Put the small files of ended runs, of all or only of those with the keys given, together into one.

    A run that is still to be handed out is not among them: its worker looks for a small file.  Interrupted between the
    two steps, it leaves records twice under one name, which does no harm.
    """
    paths = [path for path in (folder / RECORDS).glob("*.json") if only is None or path.name.partition("-")[0] in only]
    texts = {path.name: text for path in sorted(paths) if (text := _read(path)) is not None}
    if not texts:
        return
    made = folder / RECORDS / f".{_GATHERED}{uuid.uuid4().hex}.parquet"
    with clear_errors(made):
        table = pa.table({"name": list(texts), "record": list(texts.values())})
        pq.write_table(table, made, compression="zstd")
        made.replace(made.with_name(made.name.removeprefix(".")))
        for path in paths:
            path.unlink(missing_ok=True)


def tidy(folder: Path) -> None:
    """Take away what killed workers left half written."""
    for place in (folder / RECORDS, *(folder / SERIES).glob("*")):
        for path in place.glob(".*"):
            path.unlink(missing_ok=True)


def _parsed(text: str) -> Record:
    """A record whose names are those of all others: a million records share them."""
    found: Record = json.loads(text, object_pairs_hook=lambda pairs: {sys.intern(name): each for name, each in pairs})
    return found


def _read(path: Path) -> str | None:
    """A record's text; None where a power cut left it torn: the run is then done again."""
    try:
        text = path.read_text(encoding="utf-8")
        json.loads(text)
    except (OSError, ValueError):
        return None
    return text
