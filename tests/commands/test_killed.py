"""Killed at random moments, the same command goes on: finished parts stay, and the result is the same to the byte."""

from __future__ import annotations

import json
import os
import random
import subprocess
import sys
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest
from fuzz_seeds import EXAMPLES, cut

KILLS = int(os.environ.get("KILLS", "5"))
_SOONEST = 2.0
"""s; before that Python is still importing."""


def command(name: str, recording: Path, out: Path) -> list[str]:
    return [sys.executable, "-m", "sssi_exudyn", name, str(recording), "--out", str(out)]


def entries(out: Path) -> dict[str, int]:
    """Whole entries of the cache, and when each was written (ns)."""
    return {path.name: path.stat().st_mtime_ns for path in (out / "cache").glob("[!.]*.npz")}


def without_clocks(value: Any) -> Any:
    """A summary without how long things took, which no two runs share."""
    if isinstance(value, Mapping):
        return {name: without_clocks(item) for name, item in value.items() if name != "wall_s"}
    return [without_clocks(item) for item in value] if isinstance(value, list) else value


def content(out: Path) -> dict[str, Any]:
    """Every file of a result: bytes, and what of JSON and the page does not say how long things took."""
    content_of: dict[str, Any] = {}
    for path in out.rglob("*"):
        name = str(path.relative_to(out))
        if path.suffix == ".json":
            content_of[name] = without_clocks(json.loads(path.read_text(encoding="utf-8")))
        elif path.is_file() and path.suffix != ".html":
            content_of[name] = path.read_bytes()
        elif path.is_file():
            content_of[name] = "page"
    return content_of


@pytest.mark.slow
@pytest.mark.parametrize("name", ["run", "fit", "diagnose"])
def test_killed_and_given_again(tmp_path: Path, name: str) -> None:
    recording = tmp_path / "recording"
    recording.mkdir()
    for file, data in cut(EXAMPLES / "beginner").files.items():
        (recording / file).write_bytes(data)
    begin = time.monotonic()
    subprocess.run(command(name, recording, tmp_path / "whole"), check=True, capture_output=True)
    whole = time.monotonic() - begin
    rng = random.Random(f"{name} {os.environ.get('KILL_SEED', '1')}")
    killed = kept = ended = 0
    while killed < KILLS or ended == 0:
        out = tmp_path / f"killed_{ended}"
        before = entries(out)
        with subprocess.Popen(
            command(name, recording, out), stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
        ) as process:
            try:
                # what is left of it gets shorter with every kill
                process.communicate(timeout=None if killed >= KILLS else rng.uniform(_SOONEST, whole))
            except subprocess.TimeoutExpired:
                process.kill()
        assert process.returncode in (0, -9)
        if process.returncode == 0:
            ended += 1
            assert content(out) == content(tmp_path / "whole")
            continue
        killed += 1
        after = entries(out)
        if not (out / "summary.json").exists():  # from then on the finished parts are cleared away
            assert {entry: after.get(entry) for entry in before} == before  # nothing that was finished is done again
        kept = max(kept, len(after))
    summary = f"{name}: killed {killed} times, {ended} results compared, up to {kept} finished parts taken over"
    sys.stdout.write(f"\n{summary}\n")
