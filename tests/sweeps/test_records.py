"""Records of runs: gathered records are read again, whatever their length."""

from __future__ import annotations

from pathlib import Path

import pyarrow.parquet as pq
import pytest

from sssi_exudyn.sweeps.records import RECORDS, Record, gather, last_records, write_record


def record_of(key: str, figures: int) -> Record:
    """Return a run with that many figures: those of the full model fill some thousand bytes."""
    return Record(
        key=key, attempt=0, status="done", error="", figures={f"max_moment_{i}_Nm": 1.0 / 3.0 for i in range(figures)},
        wall_s=1.0, cpu_s=1.0, worker=1, memory_MB=1.0, begin=0.0, end=1.0,
    )  # fmt: skip


@pytest.mark.parametrize("figures", [3, 100, 1000])
def test_gathered_records_are_read_again(figures: int, tmp_path: Path) -> None:
    records = {key: record_of(key, figures) for key in ("a" * 32, "b" * 32)}
    for record in records.values():
        write_record(tmp_path, record)
    gather(tmp_path)
    assert not list((tmp_path / RECORDS).glob("*.json"))
    assert last_records(tmp_path) == (records, 0)


def test_records_that_were_gathered_with_statistics_are_read_too(tmp_path: Path) -> None:
    record = record_of("a" * 32, 1000)
    write_record(tmp_path, record)
    gather(tmp_path)
    (part,) = (tmp_path / RECORDS).glob("*.parquet")
    pq.write_table(pq.read_table(part), part, compression="zstd")
    assert last_records(tmp_path) == ({record.key: record}, 0)
