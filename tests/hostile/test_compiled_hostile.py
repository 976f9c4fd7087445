"""A damaged file among what is compiled is a miss: it is made again, and no command stops at it."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

PROGRAM = """
import sys
from pathlib import Path
import numpy as np
from docs_script import module_from
from sssi_exudyn.contact.codegen.compiled import compile_kernel
kernel = compile_kernel(module_from(Path(sys.argv[1])))
print(kernel.twice(3.0), sum(kernel.twice.stats.cache_hits.values()))
"""
TEMPLATE = """
from sssi_exudyn.runtime.jit import njit

@njit(cache=True, error_model="numpy")
def twice(x):
    return 2.0 * x
"""
DAMAGES: dict[str, Callable[[bytes], bytes]] = {
    "empty": lambda _: b"",
    "cut": lambda content: content[: len(content) // 2],
    "cut at the end": lambda content: content[:-1],
    "cut after the head": lambda content: content[:16],
    "zeros": lambda content: bytes(len(content)),
    "another file": lambda _: b"<html>404</html>",
}


@pytest.fixture
def template(tmp_path: Path) -> Path:
    path = tmp_path / "template.py"
    path.write_text(TEMPLATE, encoding="utf-8")
    return path


def run(template: Path) -> list[str]:
    """Return what the kernel gives, and how often it came from the disk."""
    folder = template.parent / "own"
    folder.mkdir(mode=0o700, exist_ok=True)
    paths = os.pathsep.join([str(Path(__file__).parents[1] / "support"), *sys.path])
    environment = os.environ | {"SSSI_CACHE_DIR": str(folder), "PYTHONPATH": paths}
    environment.pop("PYTHONDONTWRITEBYTECODE", None)
    command = [sys.executable, "-c", PROGRAM, str(template)]
    done = subprocess.run(command, check=False, capture_output=True, text=True, timeout=120, env=environment)
    assert done.returncode == 0, done.stderr
    return done.stdout.split()


@pytest.mark.parametrize(("kind", "fresh"), [("nbi", True), ("nbc", True), ("pyc", False), ("py", True)])
@pytest.mark.long
def test_a_damaged_file_is_made_again(template: Path, kind: str, fresh: bool) -> None:
    assert run(template) == ["6.0", "0"]
    assert run(template) == ["6.0", "1"]
    files = [path for path in (template.parent / "own").rglob(f"*.{kind}") if path.is_file()]
    assert files
    for damage in DAMAGES.values():
        for path in files:
            path.write_bytes(damage(path.read_bytes()))
        assert run(template)[0] == "6.0"
    assert run(template) == ["6.0", "1"], "it is kept again"
