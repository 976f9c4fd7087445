"""New files where something is already."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from sssi_exudyn.core.new_files import make_folder, open_new, unfinished


def test_a_file_that_a_killed_process_left_is_replaced(tmp_path: Path) -> None:
    path = tmp_path / "file"
    path.write_bytes(b"half of it")
    with open_new(path) as file:
        file.write(b"all")
    assert path.read_bytes() == b"all"


def test_a_pipe_is_replaced_and_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "file")
    with open_new(tmp_path / "file") as file:
        file.write(b"all")
    assert (tmp_path / "file").is_file()


def test_a_folder_is_none_of_its_files(tmp_path: Path) -> None:
    (tmp_path / "file").mkdir()
    with pytest.raises(OSError, match=r"irectory|permitted"):
        open_new(tmp_path / "file")


def test_folders_are_made_with_those_around_them(tmp_path: Path) -> None:
    make_folder(tmp_path / "a" / "b")
    make_folder(tmp_path / "a" / "b")
    assert (tmp_path / "a" / "b").is_dir()


@pytest.mark.parametrize("name", ["x", "x" * 255, "丘" * 85, os.fsdecode(b"\xff" * 255)])
def test_an_unfinished_file_has_a_name_that_can_be(tmp_path: Path, name: str) -> None:
    partial = unfinished(tmp_path / name)
    partial.write_bytes(b"")
    assert partial.parent == tmp_path
    assert partial.name.endswith(f".{os.getpid()}")
    assert unfinished(tmp_path / f"{name[:-1]}y") != partial
