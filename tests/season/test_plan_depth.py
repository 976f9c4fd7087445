"""How deep recordings of a season may lie."""

from __future__ import annotations

from pathlib import Path

from sssi_exudyn.importing.days.run_files import DEEPEST
from sssi_exudyn.season.plan import find_recordings


def test_descents_of_the_deepest_day_that_an_import_reads_are_found(tmp_path: Path) -> None:
    folder = tmp_path.joinpath("runs", *map(str, range(DEEPEST)), "day", "run_01")
    folder.mkdir(parents=True)
    (folder / "recording.toml").touch()
    assert list(find_recordings(tmp_path / "runs", tmp_path / "out")) == [folder]
