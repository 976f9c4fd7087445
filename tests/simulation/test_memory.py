"""Many runs in one process: what Exudyn holds is given back."""

import resource
from pathlib import Path

import pytest
from gliding import model, standing

from sssi_exudyn.simulation.full.run import simulate


def resident() -> float:
    """MB of this process."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * resource.getpagesize() / 2**20


@pytest.mark.long
def test_repeated_runs_do_not_grow() -> None:
    start, motion = model(), standing(0.5)
    for _ in range(3):  # what is loaded and compiled on first use
        simulate(start, motion, stop=0.05)
    before = resident()
    for _ in range(6):
        simulate(start, motion, stop=0.05)
    # A system that is kept costs 2 MB, and a run makes three; a tenth of that is the allocator's own wandering
    assert resident() - before < 7.0
