"""Parquet files of results: tables of numbers and a few texts, with bounds checked before anything is decoded."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO, Final

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.text import one_line
from sssi_exudyn.io.bounds import MAX_COLUMNS, MAX_NAME, MAX_NUMBER, MAX_ROWS, MAX_TABLE, MAX_TEXT
from sssi_exudyn.io.files import open_regular

if TYPE_CHECKING:
    import pandas as pd

_BYTES: Final = 8
"""Number of bytes of a number."""
_HEAD: Final = 4096
"""Number of bytes in which the head of most pages ends."""
_LARGEST_HEAD: Final = 1_000_000
"""Maximum bytes of a page's head whose least and greatest value are long texts, such as whole records of runs."""
_PAGES: Final = 200_000
MAX_DECODED: Final = _BYTES * MAX_TABLE
"""Maximum number of bytes of all pages of a file once they are decompressed."""


def read_parquet(
    path: Path, needed: Sequence[str] = (), names: Sequence[str] = (), sentences: Sequence[str] = ()
) -> pd.DataFrame:
    """Read a table of float or whole numbers, truth values and texts.

    Parameters
    ----------
    needed : columns that must be present
    names : columns that may hold names, ``MAX_NAME`` characters at most; one that is missing is no error
    sentences : columns that may hold any text, which is put on one line and cut

    Raises InputError for anything but a regular and whole Parquet file, and for more rows, columns or bytes than any
    result has.  Raises it too for a column that is missing, comes twice, or is of another type.
    """
    from pandas import CategoricalDtype  # here: what only writes tables need not load it

    with _checked(path, needed, (*names, *sentences)) as file:
        table = file.read()
        if table.num_rows != file.metadata.num_rows:
            raise InputError(path, "", "the file is torn", "run again")
        table.validate(full=True)  # a damaged file may point beyond a dictionary's end
        frame: pd.DataFrame = table.to_pandas(ignore_metadata=True)
    for name, kind in frame.dtypes.items():
        if isinstance(kind, CategoricalDtype):
            known = frame[name].cat.categories
            if name in sentences:
                clean = {word: one_line(word, MAX_TEXT) for word in known}
                frame[name] = frame[name].astype(known.dtype).map(clean)
                continue
            if any(len(word) > MAX_NAME or one_line(word) != word for word in known):
                raise InputError(path, f"column {name}", "texts that are no names", "run again")
            frame[name] = frame[name].astype(known.dtype)
        elif kind.kind == "f" and np.any(np.abs(frame[name].to_numpy()) > MAX_NUMBER):
            raise InputError(path, f"column {name}", "larger than any quantity of a run", "run again")
    return frame


def column_names(path: Path) -> list[str]:
    """Return the names of a table's columns.  Raises InputError as ``read_parquet`` does."""
    try:
        with open_regular(path) as file:
            return [one_line(name, MAX_NAME) for name in pq.read_schema(file).names[:MAX_COLUMNS]]
    except pa.ArrowException as error:
        raise InputError(path, "", f"no table ({one_line(error)})", "run again") from None


def read_texts(path: Path, columns: Sequence[str]) -> list[tuple[str | None, ...]]:
    """Read the rows of a table whose ``columns`` hold texts of any content; other columns are left out.

    Raises InputError as ``read_parquet`` does.
    """
    with _checked(path, columns, columns) as file:
        table = file.read(list(columns))
        table.validate(full=True)  # as above
        return list(zip(*(_texts(table[name]) for name in columns), strict=True))


@contextmanager
def _checked(path: Path, needed: Sequence[str], texts: Sequence[str]) -> Iterator[pq.ParquetFile]:
    """Open the file for reading, with equal texts held once.

    Raises InputError as ``read_parquet`` does, also for faults that show while it is read.
    """
    with open_regular(path) as stream:
        try:
            file = pq.ParquetFile(stream, thrift_string_size_limit=10_000_000, thrift_container_size_limit=100_000)
            _check_columns(path, file, needed, texts)
            _check_pages(path, file.metadata, stream)
            words = [name for name in texts if name in file.schema_arrow.names]
            yield pq.ParquetFile(stream, metadata=file.metadata, read_dictionary=words)
        except (pa.ArrowException, OSError, ValueError) as error:
            problem = "not a Parquet file, or a torn one"
            raise InputError(path, "", f"{problem} ({one_line(error)})", "run again") from None


def _texts(column: pa.ChunkedArray) -> Iterator[str | None]:
    """Yield the texts of a column with a dictionary, equal ones as one object; a column of another type yields none."""
    for chunk in column.chunks:
        if pa.types.is_dictionary(chunk.type):
            known = chunk.dictionary.to_pylist()
            yield from (None if index is None else known[index] for index in chunk.indices.to_pylist())


def _check_columns(path: Path, file: pq.ParquetFile, needed: Sequence[str], texts: Sequence[str]) -> None:
    schema, rows = file.schema_arrow, file.metadata.num_rows
    if len(schema) > MAX_COLUMNS:
        raise InputError(path, "", f"{len(schema)} columns, more than any result has", "run again")
    if not 0 <= rows <= MAX_ROWS or rows * len(schema) > MAX_TABLE:
        raise InputError(path, "", f"{rows} rows of {len(schema)} columns are more than any result has", "run again")
    for field in schema:
        place = f"column {field.name}"
        if len(field.name) > MAX_NAME or one_line(field.name) != field.name:
            raise InputError(path, place, "this is no name of a column", "run again")
        if len(schema.get_all_field_indices(field.name)) > 1:
            raise InputError(path, place, "the column comes twice", "run again")
        kind = field.type.value_type if pa.types.is_dictionary(field.type) else field.type
        if field.name in texts and (pa.types.is_string(kind) or pa.types.is_large_string(kind)):
            continue
        if not (pa.types.is_floating(kind) or pa.types.is_integer(kind) or pa.types.is_boolean(kind)):
            raise InputError(path, place, f"{kind} in place of numbers", "run again")
    for name in needed:
        if name not in schema.names:
            raise InputError(path, f"column {name}", "the column is missing", "run again with this version")


def _check_pages(path: Path, about: pq.FileMetaData, stream: BinaryIO) -> None:
    """Raise InputError where pages would decompress to more than any table has, or where a column has two names.

    A page states its own size, whatever the file's metadata say of it.
    """
    total = count = 0
    for group in range(about.num_row_groups):
        for column in range(about.num_columns):
            chunk = about.row_group(group).column(column)
            if chunk.path_in_schema != about.schema.column(column).path:
                raise InputError(path, f"column {one_line(chunk.path_in_schema)}", "the file is damaged", "run again")
            at = chunk.dictionary_page_offset if chunk.has_dictionary_page else chunk.data_page_offset
            end = at + chunk.total_compressed_size
            while at < end:
                decoded, stored, size = _page_at(stream, at)
                total += max(decoded, stored)
                count += 1
                at += size + stored
                if min(decoded, stored) < 0 or total > MAX_DECODED or count > _PAGES:
                    raise InputError(path, "", "more bytes than any result has", "run again")
    stream.seek(0)


def _page_at(stream: BinaryIO, at: int) -> tuple[int, int, int]:
    """Return ``_page`` of the page that begins at byte ``at``."""
    stream.seek(at)
    head = stream.read(_HEAD)
    try:
        return _page(head)
    except ValueError:
        if len(head) < _HEAD:
            raise
        return _page(head + stream.read(_LARGEST_HEAD - _HEAD))


def _page(head: bytes) -> tuple[int, int, int]:
    """Return a page's bytes once decompressed, its bytes as stored, and the bytes of its head.

    The head is a structure of Thrift's compact protocol: a byte with the distance to the last field and the type, then
    the value.  Fields 2 and 3 are the sizes.  Raises ValueError for anything else.
    """
    reader = _Thrift(head)
    fields = reader.structure()
    return fields.get(2, -1), fields.get(3, -1), reader.at


class _Thrift:
    """A reader of structures of whole numbers, texts and structures, which make up a page's head."""

    def __init__(self, data: bytes) -> None:
        self.data, self.at = data, 0

    def structure(self, depth: int = 0) -> dict[int, int]:
        """Read the fields of a structure that are whole numbers, by their number."""
        if depth > 4:
            raise ValueError("a page's head is nested")
        whole_numbers, field = {}, 0
        while (head := self._byte()) != 0:
            kind = head & 15
            field = field + (head >> 4) if head >> 4 else self._whole()
            if kind in (4, 5, 6):
                whole_numbers[field] = self._whole()
            elif kind == 8:
                length = self._length()
                self.at += length
            elif kind == 12:
                self.structure(depth + 1)
            elif kind not in (1, 2):  # true and false have no value
                raise ValueError("a page's head is torn")
        return whole_numbers

    def _byte(self) -> int:
        if self.at >= len(self.data):
            raise ValueError("a page's head is torn")
        self.at += 1
        return self.data[self.at - 1]

    def _length(self) -> int:
        value = shift = 0
        while (byte := self._byte()) & 128:
            value |= (byte & 127) << shift
            shift += 7
        return value | byte << shift

    def _whole(self) -> int:
        value = self._length()
        return value >> 1 ^ -(value & 1)


def check_time(path: Path, frame: pd.DataFrame, longest: float, *, strict: bool) -> None:
    """Raise InputError where ``time_s`` is not finite, falls, or spans more than ``longest`` s.  With ``strict``, equal
    times are refused too.
    """
    time = frame["time_s"].to_numpy(dtype=float)
    steps = np.diff(time)
    if not np.all(np.isfinite(time)) or np.any(steps <= 0.0 if strict else steps < 0.0):
        raise InputError(path, "column time_s", "time does not rise throughout", "run again")
    if len(time) and time[-1] - time[0] > longest:
        raise InputError(path, "column time_s", f"more than {longest:.0f} s", "check that time is in seconds")


def check_finite(path: Path, frame: pd.DataFrame, names: Sequence[str]) -> None:
    """Raise InputError where one of the columns holds anything but a finite number."""
    for name in names:
        if not np.all(np.isfinite(frame[name].to_numpy(dtype=float))):
            raise InputError(path, f"column {name}", "not a number in every row", "run again")
