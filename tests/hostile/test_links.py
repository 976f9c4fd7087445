"""Links where the program writes: what is written never follows one, and what they lead to stays as it was."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import pyarrow as pa
import pytest
from a_run import a_run
from tiny import Tiny

from sssi_exudyn.commands.diagnosis import diagnose_day
from sssi_exudyn.commands.runs import cache_in
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.new_files import unfinished
from sssi_exudyn.importing.answers import Answers
from sssi_exudyn.importing.many import import_many
from sssi_exudyn.io.writing import folder_lock, write_atomically
from sssi_exudyn.reports.report import write_run
from sssi_exudyn.runtime.cache import Cache, fingerprint
from sssi_exudyn.sweeps.records import Record, claim, gather, tidy, write_record, write_series

RECORD = Record("a" * 32, 0, "done", "", {}, 1.0, 1.0, 1, 300.0, 1.0, 2.0)
SERIES = pa.table({"time_s": [0.0, 1.0]})


@pytest.fixture
def outside(tmp_path: Path) -> Path:
    """Return a folder with a file that nothing may change."""
    folder = tmp_path / "outside"
    folder.mkdir()
    for name in ("mine.txt", "mine.json", ".profile"):
        (folder / name).write_text("mine", encoding="utf-8")
    return folder


def check_untouched(outside: Path) -> None:
    assert {path.name: path.read_text(encoding="utf-8") for path in outside.iterdir()} == dict.fromkeys(
        ("mine.txt", "mine.json", ".profile"), "mine"
    )


WRITERS: dict[str, tuple[str, Callable[[Path], object]]] = {
    "a cache": ("cache", lambda out: Cache(out / "cache").put(fingerprint("key"), {})),
    "a result's cache": ("cache", cache_in),
    "a lock": (".lock", lambda out: folder_lock(out).__enter__()),
    "records of a sweep": ("records", lambda out: write_record(out, RECORD)),
    "records that are gathered": ("records", gather),
    "series of a sweep": ("series", lambda out: write_series(out, RECORD.key, SERIES)),
    "series of some runs": ("series/aa", lambda out: write_series(out, RECORD.key, SERIES)),
    "claims of a sweep": ("running.lock", lambda out: claim(out, 3).__enter__()),
}


@pytest.mark.parametrize("name", WRITERS)
@pytest.mark.parametrize("target", ["", "mine.txt", "new"])
def test_a_link_in_the_place_of_a_folder_or_file_is_refused(
    tmp_path: Path, outside: Path, name: str, target: str
) -> None:
    place, write = WRITERS[name]
    link = tmp_path / "out" / place
    link.parent.mkdir(parents=True)
    link.symlink_to(outside / target)
    with pytest.raises((InputError, OSError), match=r"is a link|exists"):
        write(tmp_path / "out")
    check_untouched(outside)


def test_a_link_in_the_place_of_an_imported_run_costs_that_run(tmp_path: Path, outside: Path) -> None:
    for name in ("a", "b"):
        made = Tiny().write(tmp_path / "season" / name)
        (made / "recording.toml").unlink()
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "a").symlink_to(outside)
    rows = import_many(tmp_path / "season", tmp_path / "out", Answers(mass_kg=70.0, height_m=1.65))
    assert [row.status for row in rows] == ["failed", "imported"]
    assert "is a link" in rows[0].error
    check_untouched(outside)


def test_a_link_in_the_place_of_a_days_run_is_refused(tmp_path: Path, outside: Path) -> None:
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "b").symlink_to(outside)
    with pytest.raises(InputError, match="b is a link"):
        diagnose_day([tmp_path / "a", tmp_path / "b"], tmp_path / "out")
    check_untouched(outside)


@pytest.mark.parametrize("target", ["mine.txt", "new.txt"])
def test_a_link_under_the_name_of_an_unfinished_file_is_replaced(tmp_path: Path, outside: Path, target: str) -> None:
    path = tmp_path / "page.html"
    unfinished(path).symlink_to(outside / target)
    write_atomically(path, "text")
    assert path.read_text(encoding="utf-8") == "text"
    assert not path.is_symlink()
    check_untouched(outside)


def test_a_link_under_the_name_of_an_unfinished_entry_is_replaced(tmp_path: Path, outside: Path) -> None:
    cache, key = Cache(tmp_path / "cache"), fingerprint("key")
    cache.folder.mkdir()
    unfinished(cache.folder / f"{key}.npz").symlink_to(outside / "mine.txt")
    cache.put(key, {})
    assert cache.get(key) == {}
    check_untouched(outside)


@pytest.mark.usefixtures("words_only")
def test_links_under_the_names_of_a_results_files_are_replaced(tmp_path: Path, outside: Path) -> None:
    out = tmp_path / "out"
    out.mkdir()
    for name in ("summary.json", "series.parquet", "report.html", f".new.{os.getpid() + 1}"):
        (out / name).symlink_to(outside / ("" if name.startswith(".new") else "mine.txt"))
    write_run(out, a_run(3.0, 20.0))
    assert not (out / "summary.json").is_symlink()
    check_untouched(outside)


@pytest.mark.parametrize("place", ["series", "series/aa", "records"])
def test_tidying_a_sweep_removes_nothing_behind_a_link(tmp_path: Path, outside: Path, place: str) -> None:
    link = tmp_path / "out" / place
    link.parent.mkdir(parents=True)
    if place == "series":
        (outside.parent / "around").mkdir()
        outside = outside.rename(outside.parent / "around" / "aa")
        link.symlink_to(outside.parent)
    else:
        link.symlink_to(outside)
    tidy(tmp_path / "out")
    check_untouched(outside)


@pytest.mark.parametrize("letters", [200, 246, 251])
def test_a_long_name_is_written_as_any_other(tmp_path: Path, letters: int) -> None:
    path = tmp_path / ("x" * (letters - 5) + ".html")
    write_atomically(path, "text")
    assert [written.name for written in tmp_path.iterdir()] == [path.name]


def test_bytes_of_names_that_are_no_text_are_written_out(tmp_path: Path) -> None:
    path = tmp_path / os.fsdecode(b"page \xff.html")
    write_atomically(path, f"about {path.name}")
    assert path.read_text(encoding="utf-8") == "about page \\udcff.html"
