"""Every file that once cost too much, or ended in a fault of the program; each is now refused in one clear line."""

from __future__ import annotations

from pathlib import Path

import pytest
from bombs import Bomb, bombs
from fuzz_uses import read_any
from limited import run_limited
from tiny import Tiny


@pytest.fixture(scope="module", autouse=True)
def _imported(tmp_path_factory: pytest.TempPathFactory) -> None:
    """Import every module before a case is forked off, so that no case imports it again."""
    folder = Tiny().write(tmp_path_factory.mktemp("whole"))
    for imports in ([], ["motion.bvh", "gps.csv"]):
        read_any(folder, imports, folder / "out", bool(imports))


@pytest.mark.parametrize(
    "bomb", [pytest.param(bomb, id=bomb.name, marks=[pytest.mark.long] if bomb.large else []) for bomb in bombs()]
)
def test_a_hostile_file_is_refused_in_one_clear_line(tmp_path: Path, bomb: Bomb) -> None:
    folder = bomb.write(tmp_path / "in")
    outcome = run_limited(lambda: read_any(folder, list(bomb.imports), tmp_path / "out", bool(bomb.imports)))
    assert outcome.verdict == "refused" or (bomb.taken and outcome.verdict == "taken"), outcome
