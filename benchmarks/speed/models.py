"""Speed of the models, relative to the run itself:  python benchmarks/speed/models.py --json FILE

It uses one core (BLAS kept to one thread) except for the fits, which use all; everything is compiled before it is
timed.  The figures are ratios within one run of this script; all of them contain the machine's noise.
"""

import os

os.environ["OPENBLAS_NUM_THREADS"] = "1"

import argparse
import json
import resource
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from sssi_exudyn.runtime.exudyn_build import take_fast_build

take_fast_build()  # as the command line does

from backends import backends

from sssi_exudyn.fitting.first_fit import fit, problem_of
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.model.model import PRESETS, Model
from sssi_exudyn.motion.from_recording import motion_from_recording
from sssi_exudyn.motion.motion import Motion
from sssi_exudyn.recording.read import read_recording
from sssi_exudyn.simulation.full.run import simulate
from sssi_exudyn.simulation.reduced.prepared import prepare
from sssi_exudyn.simulation.reduced.run import simulate_reduced

EXAMPLES = Path(__file__).parents[2] / "examples"
NAMES = ("beginner", "intermediate")
REFERENCE = 0.001
"""s; the step with which the others' errors are computed."""
FAST = "the preset fast"
OTHERS = (0.005, 0.010)
"""s; other steps than the default."""


def timed(work: Callable[[], Any], repeats: int = 1) -> tuple[float, Any]:
    """Return the least wall time (s) of some repeats, and the last result."""
    walls, result = [], None
    for _ in range(repeats):
        begin = time.perf_counter()
        result = work()
        walls.append(time.perf_counter() - begin)
    return min(walls), result


def full_model(model: Model, motion: Motion) -> dict[str, Any]:
    """Return real-time factor and largest error of the antenna's path by step.

    At the default step it also runs with the skeleton's tree; the last run is the one that judges estimates.
    """
    usual, fine = model.solver.step, model.solver.elements
    fast = PRESETS["fast"]
    runs = [(name_of(step), step, False, fine) for step in (REFERENCE, *sorted((usual, *OTHERS)))]
    runs.append((f"{name_of(usual)} with the tree", usual, True, fine))
    runs.append((FAST, fast.step, False, fast.elements))
    rows: dict[str, Any] = {}
    reference = None
    for name, step, tree, elements in runs:
        chosen = replace(model, solver=replace(model.solver, step=step, elements=elements))
        if reference is None:
            chosen = replace(chosen, solver=replace(chosen.solver, relative_tolerance=1e-6))
        repeats = 1 if reference is None else 2
        wall, run = timed(partial(simulate, chosen, motion, tree=tree), repeats)
        reference = run if reference is None else reference
        place = np.stack([np.interp(run.time, reference.time, column) for column in reference.antenna.T], axis=1)
        error = float(np.max(np.linalg.norm(run.antenna - place, axis=1)))
        rows[name] = {
            "real_time_factor": float(np.ptp(run.time)) / wall,
            "largest_error_mm": 1e3 * error,
            **{name: run.statistics[name] for name in ("steps", "newton_iterations", "jacobians")},
        }
    return rows


def name_of(step: float) -> str:
    """Return a step (s) in words."""
    return f"{1e3 * step:.3g} ms"


def linearity(model: Model, motion: Motion) -> dict[str, Any]:
    """Return wall seconds by simulated seconds, and by elements."""
    lengths = {s: timed(partial(simulate, model, motion, stop=motion.start + s))[0] for s in (2.0, 4.0, 8.0)}
    elements = {
        n: timed(
            partial(simulate, replace(model, solver=replace(model.solver, elements=n)), motion, stop=motion.start + 2.0)
        )[0]
        for n in (20, 50, 100)
    }
    return {"wall_s_by_simulated_s": lengths, "wall_s_by_elements": elements}


def memory(model: Model, motion: Motion, runs: int) -> dict[str, Any]:
    """Return resident megabytes of this process before, and after each quarter of many runs of 0.5 s; and its peak."""
    now = [resident()]
    for _ in range(4):
        for _ in range(runs // 4):
            simulate(model, motion, stop=motion.start + 0.5)
        now.append(resident())
    return {"runs": runs, "resident_MB": now, "peak_MB": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0}


def resident() -> float:
    """Return the resident memory of this process, MB."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * resource.getpagesize() / 2**20


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", type=Path, required=True, help="file the figures go to")
    parser.add_argument("--runs", type=int, default=100, help="repeated simulations of the memory test")
    options = parser.parse_args()
    factors: dict[str, dict[str, float]] = {"full": {}, "full_fast": {}, "reduced": {}}
    figures: dict[str, Any] = {"real_time_factor": factors, "fit_wall_s": {}, "full_by_step": {}}
    figures["cores"] = os.cpu_count()
    for name in NAMES:
        recording = read_recording(EXAMPLES / name)
        motion = motion_from_recording(recording)
        problem = problem_of(recording, motion, model_of(recording, motion), "joint")
        begin = time.perf_counter()
        fitted = fit(problem, motion)
        figures["fit_wall_s"][name] = time.perf_counter() - begin
        model = fitted.model
        rows = full_model(model, motion)
        figures["full_by_step"][name] = rows
        usual = name_of(model.solver.step)
        factors["full"][name] = rows[usual]["real_time_factor"]
        factors["full_fast"][name] = rows[FAST]["real_time_factor"]
        prepared = prepare(model, motion)
        wall, run = timed(partial(simulate_reduced, model, prepared), 3)
        factors["reduced"][name] = float(np.ptp(run.time)) / wall
        if name == NAMES[0]:
            figures["backends"] = backends(model, motion)
            figures["linearity"] = linearity(model, motion)
            figures["memory"] = memory(model, motion, options.runs)
        print(json.dumps(figures, indent=1), flush=True)
    options.json.write_text(json.dumps(figures, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
