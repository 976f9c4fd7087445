"""A damaged file among what is compiled is a miss: it is made again, and no command stops at it."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

PROGRAM = """
import json, sys
from pathlib import Path
from docs_script import module_from
from sssi_exudyn.contact.codegen.compiled import compile_kernel
rows = {}
for path in sorted(Path(sys.argv[1]).glob("*.py")):
    kernel = compile_kernel(module_from(path))
    rows[path.stem] = kernel.twice(3.0), sum(kernel.twice.stats.cache_hits.values()), kernel.__file__
print(json.dumps(rows))
"""
TEMPLATE = """
from sssi_exudyn.runtime.jit import njit

@njit(cache=True, error_model="numpy")
def twice(x):
    return 2.0 * x + 0.0 * {number}
"""
DAMAGES: dict[str, Callable[[bytes], bytes]] = {
    "empty": lambda _: b"",
    "cut": lambda content: content[: len(content) // 2],
    "cut_at_the_end": lambda content: content[:-1],
    "cut_after_the_head": lambda content: content[:16],
    "zeros": lambda content: bytes(len(content)),
    "another_file": lambda _: b"<html>404</html>",
}
KINDS = ("nbi", "nbc", "pyc", "py")
NAMES = tuple(f"{kind}_{damage}" for kind in KINDS for damage in DAMAGES)


def run(templates: Path, kept: Path) -> dict[str, tuple[float, int, str]]:
    """Return for each kernel what it gives, how often it came from the disk, and its file."""
    paths = os.pathsep.join([str(Path(__file__).parents[1] / "support"), *sys.path])
    environment = os.environ | {"SSSI_CACHE_DIR": str(kept), "PYTHONPATH": paths}
    environment.pop("PYTHONDONTWRITEBYTECODE", None)
    command = [sys.executable, "-c", PROGRAM, str(templates)]
    done = subprocess.run(command, check=False, capture_output=True, text=True, timeout=300, env=environment)
    assert done.returncode == 0, done.stderr
    return {name: (row[0], row[1], row[2]) for name, row in json.loads(done.stdout).items()}


@pytest.mark.long
def test_damaged_files_are_made_again(tmp_path: Path) -> None:
    """Each kernel has files of one kind damaged in one form, so that four processes try them all."""
    templates, kept = tmp_path / "templates", tmp_path / "own"
    templates.mkdir()
    kept.mkdir(mode=0o700)
    for number, name in enumerate(NAMES):
        (templates / f"{name}.py").write_text(TEMPLATE.format(number=number), encoding="utf-8")
    rows = run(templates, kept)
    assert {name: row[:2] for name, row in rows.items()} == dict.fromkeys(NAMES, (6.0, 0))
    assert {row[:2] for row in run(templates, kept).values()} == {(6.0, 1)}
    for name, (_, _, file) in rows.items():
        kind, damage = name.split("_", 1)
        files = list(kept.rglob(f"{Path(file).stem}*.{kind}"))
        assert files
        for path in files:
            path.write_bytes(DAMAGES[damage](path.read_bytes()))
    assert {row[0] for row in run(templates, kept).values()} == {6.0}
    assert {row[:2] for row in run(templates, kept).values()} == {(6.0, 1)}, "they are kept again"
