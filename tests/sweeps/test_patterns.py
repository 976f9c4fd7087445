"""Recordings that a pattern names, whatever the pattern."""

from __future__ import annotations

from pathlib import Path

import pytest
from limited import run_limited

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.sweeps import patterns
from sssi_exudyn.sweeps.patterns import matching_recordings


@pytest.fixture
def season(tmp_path: Path) -> Path:
    """Return a folder of recordings at several depths, with other folders, files and a loop of links."""
    for name in ("a/run_1", "a/run_2", "b/deep/run_1", "run_3", ".hidden/run_4"):
        folder = tmp_path / "season" / name
        folder.mkdir(parents=True)
        (folder / "recording.toml").write_text("format = 1\n", encoding="utf-8")
    (tmp_path / "season" / "a" / "notes.txt").write_text("", encoding="utf-8")
    (tmp_path / "season" / "b" / "loop").symlink_to(tmp_path / "season")
    (tmp_path / "sweeps").mkdir()
    return tmp_path


@pytest.mark.parametrize(
    ("pattern", "names"),
    [
        ("season/*/*", [".hidden/run_4", "a/run_1", "a/run_2", "b/loop"][:3]),
        ("season/a/run_[12]", ["a/run_1", "a/run_2"]),
        ("season/*_?", ["run_3"]),
        ("season/**/run_1", ["a/run_1", "b/deep/run_1"]),
        ("season/**", [".hidden/run_4", "a/run_1", "a/run_2", "b/deep/run_1", "run_3"]),
        ("season/**/**/run_3", ["run_3"]),
        ("sweeps/../season/a/*", ["a/run_1", "a/run_2"]),
    ],
)
def test_a_pattern_names_the_folders_of_recordings(season: Path, pattern: str, names: list[str]) -> None:
    matches = matching_recordings(season, pattern, season / "sweep.toml")
    assert [match.resolve() for match in matches] == [season / "season" / name for name in names]
    whole = matching_recordings(Path(), str(season / pattern), season / "sweep.toml")
    assert whole == matches


@pytest.mark.parametrize(
    ("pattern", "words"),
    [
        ("season/z*", "no recording matches"),
        ("season/*/../*", "cannot be in a pattern"),
        ("season/**run", "cannot be in a pattern"),
        ("season/" + "*/../" * 40 + "*", "cannot be in a pattern"),
    ],
)
def test_a_pattern_of_no_use_is_refused(season: Path, pattern: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        matching_recordings(season, pattern, season / "sweep.toml")


@pytest.mark.parametrize(
    "pattern", ["**/" * 66 + "x", "*a" * 90 + "b", "**/*/" * 40 + "x", "[" * 200 + "]", "?*" * 100, "*/" * 99 + "x"]
)
def test_a_pattern_of_200_bytes_ends(tmp_path: Path, pattern: str) -> None:
    folder = tmp_path
    for _ in range(
        12
    ):  # 2 to the power of 12 paths, by two folders in each, would be walked 66 times within each other
        folder = folder / ("a" * 40)
        folder.mkdir()
        (folder / ("a" * 41)).mkdir()
    outcome = run_limited(lambda: matching_recordings(tmp_path, pattern, tmp_path / "sweep.toml"))
    assert outcome.verdict == "refused", outcome
    assert outcome.seconds < 5.0


def test_more_folders_than_a_season_has_are_refused(season: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(patterns, "_MOST", 10)
    with pytest.raises(InputError, match="more than 10 files and folders"):
        matching_recordings(season, "**/run_1", season / "sweep.toml")
