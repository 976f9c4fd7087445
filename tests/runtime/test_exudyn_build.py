"""The build of Exudyn without range checks, which the command line takes."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.motion.from_recording import motion_from_recording
from sssi_exudyn.recording.read import read_recording
from sssi_exudyn.simulation.full.run import simulate

EXAMPLE = Path(__file__).parents[2] / "examples" / "beginner"
SECONDS = 0.3

PROGRAM = """
import json, sys
from pathlib import Path
from sssi_exudyn.runtime.exudyn_build import take_fast_build
take_fast_build()
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.motion.from_recording import motion_from_recording
from sssi_exudyn.recording.read import read_recording
from sssi_exudyn.simulation.full.run import simulate
recording = read_recording(Path(sys.argv[1]))
motion = motion_from_recording(recording)
run = simulate(model_of(recording, motion), motion, stop=motion.start + float(sys.argv[2]))
taken = [name for name in sys.modules if name.startswith("exudyn.exudynCPP")]
print(json.dumps({"taken": taken, "pelvis": run.pelvis.tolist(), "moments": run.joint_moments[-1].tolist()}))
"""


def has_avx2() -> bool:
    flags = Path("/proc/cpuinfo")
    return flags.is_file() and " avx2 " in flags.read_text(encoding="ascii", errors="replace")


@pytest.fixture(scope="module")
def fast() -> dict[str, list[float]]:
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, str(EXAMPLE), str(SECONDS)], capture_output=True, text=True, check=True
    )
    run: dict[str, list[float]] = json.loads(done.stdout)  # nothing else is printed
    return run


@pytest.mark.long
def test_which_is_taken(fast: dict[str, list[float]]) -> None:
    assert ("exudyn.exudynCPPfast" in fast["taken"]) == has_avx2()


@pytest.mark.long
def test_it_gives_the_same_run(fast: dict[str, list[float]]) -> None:
    recording = read_recording(EXAMPLE)
    motion = motion_from_recording(recording)
    run = simulate(model_of(recording, motion), motion, stop=motion.start + SECONDS)
    # rounding in another order (vector instructions), through 45 steps of Newton's method that stops at 2e-4
    np.testing.assert_allclose(fast["pelvis"], run.pelvis, atol=1e-7)
    np.testing.assert_allclose(fast["moments"], run.joint_moments[-1], rtol=1e-3, atol=1e-3)
