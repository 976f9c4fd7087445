"""Time and memory of whole commands, against another revision of the program in the same run, and over length.

    python benchmarks/speed/commands.py --json FILE [--against v0.1.0] [--fit FOLDER…] [--run FOLDER…]
        [--quick FOLDER…] [--diagnose FOLDER…] [--lengths FOLDER…]

Each command runs in a process of its own, this revision and the other by turns, so that other work on the machine
affects both.  Before that, an untimed fit compiles the kernels of each.  The table has for each command

- wall, processor: s, of which the second is of all cores;  length: s of skiing
- memory: MB at most
- wall and processor against the other revision: below 1 is faster

and before it how long a fixed piece of Python and NumPy takes on this machine.  A ``--quick`` run stands next to the
run of the same recording, as the other revision may have none.  ``--lengths`` fits the first 10, 30 and 100 s of a
recording, as far as it has them, with this revision alone; its ratios are for each second of skiing, against the
shortest.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from itertools import chain
from pathlib import Path
from typing import Any, Final

import numpy as np

from sssi_exudyn.motion.from_recording import motion_from_recording
from sssi_exudyn.recording.read import read_recording

ROOT: Final = Path(__file__).parents[2]
EXAMPLES: Final = ROOT / "examples"
LENGTHS: Final = (10.0, 30.0, 100.0)
"""s of a recording that are fitted, to see how time and memory grow."""
MEGABYTE: Final = 1024.0
"""Of the kilobytes that the system counts."""


@dataclass(frozen=True)
class Cost:
    """What a command took: s by the clock, s of processors, MB of memory at most."""

    wall: float
    cpu: float
    memory: float


@dataclass(frozen=True)
class Row:
    """A line of the table.

    before : what is compared with, of ``before_s`` s of skiing: another revision, a run that is not quick, or the
        shortest stretch
    """

    command: str
    recording: str
    length_s: float
    now: Cost
    before: Cost
    before_s: float

    def line(self) -> str:
        """Return the line as Markdown; its ratios are for each second of skiing."""
        now, before, shorter = self.now, self.before, self.before_s / self.length_s
        ratios = f"{now.wall / before.wall * shorter:.2f}, {now.cpu / before.cpu * shorter:.2f}"
        costs = f"{now.wall:.0f} s | {now.cpu:.0f} s | {now.memory:.0f} MB"
        return f"| {self.command} `{self.recording}` | {self.length_s:.1f} s | {costs} | {ratios} |"


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


def run_measured(words: Sequence[str], root: Path = ROOT) -> tuple[Cost, str]:
    """Return what the program in ``root`` took, and the last line of its errors where it failed."""
    command = [sys.executable, "-m", "sssi_exudyn", *words]
    with tempfile.TemporaryFile("w+") as errors:
        begin = time.perf_counter()
        process = subprocess.Popen(
            command, cwd=root, env=os.environ | {"PYTHONPATH": str(root)}, stdout=subprocess.DEVNULL, stderr=errors
        )
        _, status, usage = os.wait4(process.pid, 0)
        wall = time.perf_counter() - begin
        errors.seek(0)
        said = errors.read().strip().splitlines() if status else []
    cost = Cost(wall, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / MEGABYTE)
    return cost, said[-1] if said else f"exit status {status}" if status else ""


def cost_of(root: Path, command: str, recording: Path, options: Sequence[str] = ()) -> Cost:
    """Run a command of the program in ``root``.  Raises RuntimeError where it fails."""
    with tempfile.TemporaryDirectory() as folder:
        cost, said = run_measured([command, str(recording), "--out", f"{folder}/out", *options], root)
    if said:
        raise RuntimeError(f"{command} {recording} failed in {root}: {said}")
    return cost


def machine_speed() -> float:
    """Return the s that a fixed piece of work takes: loops of Python, and products and sorts of NumPy."""
    rng = np.random.default_rng(1)
    begin = time.process_time()
    sum(i * i % 7 for i in range(3_000_000))
    table = rng.standard_normal((600, 600))
    for _ in range(10):
        table = np.sort(table @ table.T / 600.0, axis=1)
    return time.process_time() - begin


def length_of(recording: Path) -> float:
    """Return how many s of skiing a recording has."""
    motion = motion_from_recording(read_recording(recording))
    return motion.stop - motion.start


def compare(given: argparse.Namespace, other: Path) -> Iterator[Row]:
    """Yield a row for each command, compared with the revision in ``other``, and for each quick run."""
    for command in ("fit", "run", "diagnose"):
        for folder in getattr(given, command):
            recording = folder.resolve()
            length = length_of(recording)
            now, before = (cost_of(root, command, recording) for root in (ROOT, other))
            yield Row(command, recording.name, length, now, before, length)
    for folder in given.quick:
        recording = folder.resolve()
        length = length_of(recording)
        now, before = (cost_of(ROOT, "run", recording, options) for options in (["--quick"], []))
        yield Row("run --quick", recording.name, length, now, before, length)


def over_length(recording: Path) -> Iterator[Row]:
    """Yield a row for each of ``LENGTHS`` that the recording has, compared with the first of them."""
    whole = length_of(recording)
    shortest, first = min(LENGTHS[0], whole), None
    for length in (shortest, *(length for length in LENGTHS[1:] if length <= whole)):
        now = cost_of(ROOT, "fit", recording, ["--seconds", f":{length:g}"])
        first = first or now
        yield Row("fit", recording.name, length, now, first, shortest)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", type=Path, required=True)
    parser.add_argument("--against", default="v0.1.0", help="revision to compare with")
    parser.add_argument("--fit", type=Path, nargs="*", default=[EXAMPLES / "beginner", EXAMPLES / "intermediate"])
    parser.add_argument("--run", type=Path, nargs="*", default=[EXAMPLES / "intermediate"])
    parser.add_argument("--quick", type=Path, nargs="*", default=[EXAMPLES / "intermediate"])
    parser.add_argument("--diagnose", type=Path, nargs="*", default=[])
    parser.add_argument("--lengths", type=Path, nargs="*", default=[])
    given = parser.parse_args()
    figures: dict[str, Any] = {"machine_s": machine_speed(), "against": given.against, "rows": []}
    speed = figures["machine_s"]
    print(f"this machine: {speed:.2f} s for a fixed piece of work, {os.cpu_count()} cores; against {given.against}")
    with worktree(given.against) as other:
        for root in (ROOT, other):
            cost_of(root, "fit", EXAMPLES / "beginner")
        print("| command | length | wall | processor | memory | wall, processor against it |")
        print("|---|---|---|---|---|---|")
        for row in chain(compare(given, other), *(over_length(folder.resolve()) for folder in given.lengths)):
            print(row.line(), flush=True)
            figures["rows"].append(asdict(row))
            given.json.write_text(json.dumps(figures, indent=1), encoding="utf-8")


if __name__ == "__main__":
    main()
