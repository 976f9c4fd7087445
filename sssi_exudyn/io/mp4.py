"""Timed samples of one kind of track in an MP4 file (ISO/IEC 14496-12), read by seeking: films are never held."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO, Final

import numpy as np

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.io.files import open_regular

MAX_SAMPLES: Final = 36_000
"""Maximum number of samples of a track: ten hours at one a second."""
_MOST_BOXES: Final = 20_000
_INDEX: Final = 60_000_000
"""Maximum size of a film's index, bytes: ten hours at 240 frames a second."""
_CONTAINERS: Final = (b"moov", b"trak", b"mdia", b"minf", b"stbl")


@dataclass(frozen=True)
class Sample:
    """A sample of a track: its content, and when it begins and ends, s."""

    content: bytes
    start: float
    stop: float


def samples_of(path: Path, codec: bytes, most: int) -> list[Sample]:
    """Read the samples of the first track with the ``codec``, such as ``b"gpmd"``; none where there is no such track.

    Raises InputError for a damaged index, and for samples of more than ``most`` bytes together.
    """
    with open_regular(path) as stream:
        try:
            index = _index(path, stream)
            for track in _children(index, b"trak"):
                tables = dict(_boxes(track))
                if tables.get(b"stsd", b"")[12:16] == codec:
                    return _read(path, stream, tables, most)
        except (struct.error, ValueError, KeyError, IndexError, OverflowError):
            raise InputError(
                path, "moov", "the index of the film is damaged", "copy it from the camera again"
            ) from None
    return []


def _index(path: Path, stream: BinaryIO) -> bytes:
    """Return the content of the box ``moov``.  Raises InputError where there is none, or too large a one."""
    size = stream.seek(0, 2)
    at = 0
    for _ in range(_MOST_BOXES):
        stream.seek(at)
        head = stream.read(16)
        if len(head) < 8:
            break
        length, name = struct.unpack(">I4s", head[:8])
        begin = 8
        if length == 1:
            (length,) = struct.unpack(">Q", head[8:16])
            begin = 16
        elif length == 0:
            length = size - at
        if length < begin:
            break
        if name == b"moov":
            if length > _INDEX:
                raise InputError(path, "moov", "a longer index than any film has", "copy it from the camera again")
            stream.seek(at + begin)
            return stream.read(length - begin)
        at += length
    raise InputError(path, "", "no MP4 file, or its index is missing", "copy it from the camera again")


def _boxes(data: bytes) -> Iterator[tuple[bytes, bytes]]:
    """Yield name and content of the boxes in a box and in the containers below it."""
    pending = [(0, len(data))]
    for _ in range(_MOST_BOXES):
        if not pending:
            return
        at, end = pending.pop()
        if end - at < 8:
            continue
        length, name = struct.unpack_from(">I4s", data, at)
        if not 8 <= length <= end - at:
            continue
        pending.append((at + length, end))
        if name in _CONTAINERS:
            pending.append((at + 8, at + length))
        yield name, data[at + 8 : at + length]


def _children(index: bytes, name: bytes) -> list[bytes]:
    return [content for kind, content in _boxes(index) if kind == name]


def _read(path: Path, stream: BinaryIO, tables: dict[bytes, bytes], most: int) -> list[Sample]:
    """Read the samples that a track's tables list."""
    sizes = _sizes(tables[b"stsz"])
    count = len(sizes)
    if count > MAX_SAMPLES or int(sizes.sum()) > most:
        problem = f"{count} samples of {sizes.sum() / 1e6:.0f} MB are more than any run has"
        raise InputError(path, "stsz", problem, "cut the film to the run")
    if not count:
        return []
    starts = _starts(tables, sizes)
    times = _times(tables, count)
    samples = []
    for i in range(count):
        stream.seek(int(starts[i]))
        content = stream.read(int(sizes[i]))
        if len(content) < sizes[i]:  # of a camera that stopped: what comes before is whole
            break
        samples.append(Sample(content, float(times[i]), float(times[i + 1])))
    return samples


def _sizes(table: bytes) -> np.ndarray[tuple[int, ...], np.dtype[np.int64]]:
    equal, count = struct.unpack_from(">II", table, 4)
    if equal:
        return np.full(min(count, MAX_SAMPLES + 1), equal, np.int64)
    return np.frombuffer(table, ">u4", count, 12).astype(np.int64)


def _starts(
    tables: dict[bytes, bytes], sizes: np.ndarray[tuple[int, ...], np.dtype[np.int64]]
) -> np.ndarray[tuple[int, ...], np.dtype[np.int64]]:
    """Return the place of every sample in the file, from the places of chunks and the numbers of samples in them."""
    wide = b"co64" in tables
    table = tables[b"co64" if wide else b"stco"]
    (chunks,) = struct.unpack_from(">I", table, 4)
    places = np.frombuffer(table, ">u8" if wide else ">u4", chunks, 8).astype(np.int64)
    (rows,) = struct.unpack_from(">I", tables[b"stsc"], 4)
    runs = np.frombuffer(tables[b"stsc"], ">u4", 3 * rows, 8).reshape(-1, 3).astype(np.int64)
    ends = np.r_[runs[1:, 0], chunks + 1]
    if np.any(runs[:, 0] < 1) or np.any(ends <= runs[:, 0]) or ends[-1] > chunks + 1:
        raise ValueError
    in_chunk = np.repeat(runs[:, 1], ends - runs[:, 0])
    if len(in_chunk) != chunks or np.any(in_chunk < 1) or np.any(in_chunk > MAX_SAMPLES):
        raise ValueError
    first = np.r_[0, np.cumsum(in_chunk)]
    if first[-1] < len(sizes):
        raise ValueError
    before = np.r_[0, np.cumsum(sizes)]
    chunk = np.searchsorted(first, np.arange(len(sizes)), side="right") - 1
    starts = places[chunk] + before[:-1] - before[np.minimum(first[chunk], len(sizes))]
    if np.any(starts < 0):
        raise ValueError
    return np.asarray(starts)


def _times(tables: dict[bytes, bytes], count: int) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    """Return when each sample begins, and the last one ends (count + 1,), s."""
    header = tables[b"mdhd"]
    (scale,) = struct.unpack_from(">I", header, 20 if header[0] else 12)
    (rows,) = struct.unpack_from(">I", tables[b"stts"], 4)
    runs = np.frombuffer(tables[b"stts"], ">u4", 2 * rows, 8).reshape(-1, 2).astype(np.int64)
    repeats = np.minimum(runs[:, 0], count)
    if scale == 0 or repeats.sum() < count or len(runs) > count or np.any(runs[:, 1] == 0):
        raise ValueError
    lasting = np.repeat(runs[:, 1], repeats)[:count]
    return np.asarray(np.r_[0, np.cumsum(lasting)] / scale)
