"""Time and memory of whole commands, against another revision of the program in the same run.

    python benchmarks/speed/commands.py --json FILE [--against v0.1.0] [--fit FOLDER…] [--run FOLDER…]
        [--diagnose FOLDER…]

Each command runs in a process of its own, this revision and the other by turns, so that other work on the machine
affects both.  Before that, an untimed fit compiles the kernels of each.  The table has for each command

- wall, cpu: s, of which the second is processor time of all cores;  length: s of skiing
- memory: MB at most
- wall and cpu against the other revision: below 1 is faster

and before it how long a fixed piece of Python and NumPy takes on this machine.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from sssi_exudyn.motion.from_recording import motion_from_recording
from sssi_exudyn.recording.read import read_recording

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "examples"
MEGABYTE = 1024.0
"""Of the kilobytes that the system counts."""


@dataclass(frozen=True)
class Cost:
    """What a command took: s by the clock, s of processors, MB of memory at most."""

    wall: float
    cpu: float
    memory: float


@contextmanager
def worktree(revision: str) -> Iterator[Path]:
    """Give a folder with that revision's files."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "revision"
        subprocess.run(["git", "-C", ROOT, "worktree", "add", "--quiet", "--detach", path, revision], check=True)
        try:
            yield path
        finally:
            subprocess.run(["git", "-C", ROOT, "worktree", "remove", "--force", path], check=True)


def cost_of(root: Path, command: str, recording: Path) -> Cost:
    """Run a command of the program in ``root``.  Raises RuntimeError where it fails."""
    with tempfile.TemporaryDirectory() as folder:
        words = [sys.executable, "-m", "sssi_exudyn", command, str(recording), "--out", f"{folder}/out"]
        begin = time.perf_counter()
        process = subprocess.Popen(
            words, cwd=root, env=os.environ | {"PYTHONPATH": str(root)},
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        _, status, usage = os.wait4(process.pid, 0)
        wall = time.perf_counter() - begin
    if status:
        raise RuntimeError(f"{' '.join(words)} failed in {root}")
    return Cost(wall, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / MEGABYTE)


def machine_speed() -> float:
    """Return the s that a fixed piece of work takes: loops of Python, and products and sorts of NumPy."""
    rng = np.random.default_rng(1)
    begin = time.process_time()
    sum(i * i % 7 for i in range(3_000_000))
    table = rng.standard_normal((600, 600))
    for _ in range(10):
        table = np.sort(table @ table.T / 600.0, axis=1)
    return time.process_time() - begin


def _line(length: float, name: str, now: Cost, before: Cost) -> str:
    ratios = f"{now.wall / before.wall:.2f}, {now.cpu / before.cpu:.2f}"
    costs = f"{now.wall:.0f} s | {now.cpu:.0f} s | {now.memory:.0f} MB"
    return f"| {name} | {length:.1f} s | {costs} | {ratios} |"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", type=Path, required=True)
    parser.add_argument("--against", default="v0.1.0", help="revision to compare with")
    parser.add_argument("--fit", type=Path, nargs="*", default=[EXAMPLES / "beginner", EXAMPLES / "intermediate"])
    parser.add_argument("--run", type=Path, nargs="*", default=[EXAMPLES / "intermediate"])
    parser.add_argument("--diagnose", type=Path, nargs="*", default=[])
    given = parser.parse_args()
    speed = machine_speed()
    print(f"this machine: {speed:.2f} s for a fixed piece of work, {os.cpu_count()} cores; against {given.against}")
    print("| command | length | wall | cpu | memory | wall, cpu against it |\n|---|---|---|---|---|---|")
    rows = []
    with worktree(given.against) as other:
        for root in (ROOT, other):
            cost_of(root, "fit", EXAMPLES / "beginner")
        for command in ("fit", "run", "diagnose"):
            for folder in getattr(given, command):
                recording = folder.resolve()
                motion = motion_from_recording(read_recording(recording))
                now, before = (cost_of(root, command, recording) for root in (ROOT, other))
                length = motion.stop - motion.start
                row = {"command": command, "recording": recording.name, "length_s": length}
                rows.append(row | {"now": asdict(now), "before": asdict(before)})
                print(_line(length, f"{command} {recording.name}", now, before), flush=True)
                given.json.write_text(
                    json.dumps({"machine_s": speed, "against": given.against, "rows": rows}, indent=1)
                )


if __name__ == "__main__":
    main()
