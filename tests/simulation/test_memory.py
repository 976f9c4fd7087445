"""Many runs in one process: what Exudyn holds is given back."""

import os
import subprocess
import sys

import pytest

RUNS = """
import resource
from pathlib import Path

from gliding import model, standing

from sssi_exudyn.simulation.full.run import simulate


def resident():
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * resource.getpagesize() / 2**20


start, motion = model(), standing(0.5)
for _ in range(3):  # what is loaded and compiled on first use
    simulate(start, motion, stop=0.05)
before = resident()
for _ in range(6):
    simulate(start, motion, stop=0.05)
print(resident() - before)
"""
"""Prints by how many MB six runs make a process grow."""


@pytest.mark.long
def test_repeated_runs_do_not_grow() -> None:
    # a process of its own: in one that other tests have filled the allocator wanders by more
    done = subprocess.run(
        [sys.executable, "-c", RUNS],
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
        capture_output=True,
        text=True,
        check=True,
    )
    # A system that is kept costs 2 MB, and a run makes three; a tenth of that is the allocator's own wandering
    assert float(done.stdout.splitlines()[-1]) < 7.0
