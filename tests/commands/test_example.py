"""`sssi example`: a newcomer's first recording."""

from __future__ import annotations

from pathlib import Path

import pytest

import sssi_exudyn
from sssi_exudyn.cli import main
from sssi_exudyn.core.errors import InputError


def test_a_recording_is_copied_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as end:
        main(["example", "beginner"])
    assert end.value.code == 0
    assert capsys.readouterr().out == "beginner\n"
    assert sssi_exudyn.read_recording("beginner").name == "beginner"
    with pytest.raises(InputError, match="there already"):
        sssi_exudyn.example("beginner")
    assert sssi_exudyn.example("intermediate", tmp_path / "mine") == tmp_path / "mine"


def test_an_unknown_one_is_refused_with_the_nearest() -> None:
    with pytest.raises(InputError, match="did you mean 'beginner'"):
        sssi_exudyn.example("begginer")
