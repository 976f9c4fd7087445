"""The records of a sweep's finished runs on disk: one small file each, gathered into larger ones from time to time.

The worker that did the run writes its record under another name and moves it into place, so the record outlives the
worker, the process that started it, and any scheduler between them.  While a run is computed, its byte of
``running.lock`` is locked: a worker whose parent is gone and a resumed sweep never do the same run at once, and the
operating system releases the byte when its owner dies; without such locks, as on Windows, each run has a lock file.
Of a retried run the last attempt counts.

The folder has to be on one file system for all workers, with POSIX locks where they are of that kind.
"""

from __future__ import annotations

import errno
import uuid
from collections.abc import Collection, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import filelock
import pyarrow as pa
import pyarrow.parquet as pq

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.new_files import check_no_link, make_folder, open_new, unfinished
from sssi_exudyn.io.files import read_bytes
from sssi_exudyn.io.parquet import read_texts
from sssi_exudyn.io.typed import decode, encode
from sssi_exudyn.io.writing import clear_errors
from sssi_exudyn.runtime.posix import posix_module

RECORDS: Final = "records"
SERIES: Final = "series"
_RUNNING: Final = "running.lock"
_ROWS: Final = "running"
DONE: Final = "done"
STATUSES: Final = (DONE, "diverged", "failed", "crashed")
"""End of a run: complete, or stopped by the solver, by another error, or by the death of its worker."""
_GATHERED: Final = "part-"
_MAX_RECORD: Final = 100_000
"""Greatest size of a record in bytes; one with all figures and a long error has some thousand."""
_PART: Final = pa.schema([("name", pa.string()), ("record", pa.string())])


@dataclass(frozen=True, slots=True)
class Record:
    """Record of a finished run.

    key, attempt : those of the run;  status : one of ``STATUSES``;  error : "" where it is done
    figures : figures by column of the table, None where there is none
    wall_s, cpu_s, memory_MB : time and memory of the run;  worker : process that did it; None where that died
    begin, end : s since 1970
    """

    key: str
    attempt: int
    status: str
    error: str
    figures: dict[str, float | None]
    wall_s: float | None
    cpu_s: float | None
    worker: int | None
    memory_MB: float | None
    begin: float
    end: float


@contextmanager
def claim(folder: Path, row: int) -> Iterator[bool]:
    """Hold the run of ``row`` while inside; yield False where another process holds it."""
    fcntl = posix_module("fcntl")
    if fcntl is None:
        with _claim_file(folder / _ROWS / f"{row}.lock") as mine:
            yield mine
        return
    check_no_link(folder / _RUNNING)
    with (folder / _RUNNING).open("ab") as file:
        try:
            fcntl.lockf(file, fcntl.LOCK_EX | fcntl.LOCK_NB, 1, row)
        except OSError as error:
            if error.errno not in (errno.EACCES, errno.EAGAIN):
                raise
            yield False
            return
        yield True


@contextmanager
def _claim_file(path: Path) -> Iterator[bool]:
    """Hold a separate lock for each run, where the system has none for single bytes."""
    make_folder(path.parent)
    lock = filelock.FileLock(path, timeout=0)
    try:
        lock.acquire()
    except filelock.Timeout:
        yield False
        return
    try:
        yield True
    finally:
        lock.release()
        with suppress(OSError):  # another process may have it already; a later one finds the record
            path.unlink()


def write_record(folder: Path, record: Record) -> None:
    """Keep a finished run's record.  Raises InputError where it cannot be written."""
    name = f"{record.key}-{record.attempt}.{uuid.uuid4().hex[:8]}.json"
    path = folder / RECORDS / name
    partial = path.with_name(f".{name}")
    with clear_errors(path):
        make_folder(path.parent)
        with open_new(partial) as file:
            file.write(encode(record))
        partial.replace(path)


def is_recorded(folder: Path, key: str, attempt: int) -> bool:
    """Tell whether that attempt at the run has ended and was not gathered yet."""
    return any((folder / RECORDS).glob(f"{key}-{attempt}.*.json"))


def series_path(folder: Path, key: str) -> Path:
    """Return the path of a run's time series."""
    return folder / SERIES / key[:2] / f"{key}.parquet"


def write_series(folder: Path, key: str, series: pa.Table) -> None:
    """Keep a run's time series.  Raises InputError where it cannot be written."""
    path = series_path(folder, key)
    with clear_errors(path):
        make_folder(path.parents[1])
        make_folder(path.parent)
        partial = unfinished(path)
        with open_new(partial) as file:
            pq.write_table(series, file, compression="zstd")
        partial.replace(path)


def read_records(folder: Path) -> Iterator[tuple[str, Record]]:
    """Yield all records, each with the name it was written under; a name may come twice.  Torn files are skipped.

    The small files come first: those that are gathered meanwhile are then in the larger ones.
    """
    for path in (folder / RECORDS).glob("*.json"):
        record = _parse(_read(path))
        if record is not None:
            yield path.name, record
    for path in sorted((folder / RECORDS).glob(f"{_GATHERED}*.parquet")):
        for name, text in _read_part(path):
            record = _parse(text.encode())
            if record is not None:
                yield name, record


def last_records(folder: Path) -> tuple[dict[str, Record], int]:
    """Return the last attempt's record of every ended run, by key, and how many attempts ended more than once.

    The second number checks the claims: it is always 0.
    """
    records: dict[str, Record] = {}
    names: set[str] = set()
    attempts: set[tuple[str, int]] = set()
    for name, record in read_records(folder):
        names.add(name)
        attempts.add((record.key, record.attempt))
        if record.key not in records or records[record.key].attempt < record.attempt:
            records[record.key] = record
    return records, len(names) - len(attempts)


def gather(folder: Path, only: Collection[str] | None = None) -> None:
    """Put the small files of finished runs, of all or only of those with the given keys, together into one.

    A run that is still to be handed out must not be among them: its worker looks for a small file.  An interrupt
    between the two steps leaves records twice under one name, which does no harm.
    """
    with clear_errors(folder):
        check_no_link(folder / RECORDS)
    paths = [path for path in (folder / RECORDS).glob("*.json") if only is None or path.name.partition("-")[0] in only]
    read = ((path.name, _read(path)) for path in sorted(paths))
    texts = {name: text.decode() for name, text in read if text is not None and _parse(text) is not None}
    if not texts:
        return
    merged = folder / RECORDS / f".{_GATHERED}{uuid.uuid4().hex}.parquet"
    with clear_errors(merged):
        table = pa.table({"name": list(texts), "record": list(texts.values())}, _PART)
        pq.write_table(table, merged, compression="zstd", write_statistics=False)  # which would hold whole records
        merged.replace(merged.with_name(merged.name.removeprefix(".")))
        for path in paths:
            path.unlink(missing_ok=True)


def tidy(folder: Path) -> None:
    """Remove the files that killed workers left half written; links are not followed."""
    series = folder / SERIES
    for place in (folder / RECORDS, *(series.glob("*") if not series.is_symlink() else ())):
        for path in place.glob(".*") if not place.is_symlink() else ():
            path.unlink(missing_ok=True)


def _parse(text: bytes | None) -> Record | None:
    """Read the record in a text; None where it is incomplete: the run is then done again."""
    try:
        return None if text is None else decode(text, Record)
    except ValueError:
        return None


def _read(path: Path) -> bytes | None:
    """Read a record's file; None for anything else."""
    try:
        return read_bytes(path, _MAX_RECORD)
    except InputError:
        return None


def _read_part(path: Path) -> Iterator[tuple[str, str]]:
    """Yield names and texts of gathered records; none where a power cut tore the file: its runs are done again."""
    try:
        rows = read_texts(path, _PART.names)
    except InputError:
        return
    for name, text in rows:
        if name is not None and text is not None and len(text) <= _MAX_RECORD:
            yield name, text
