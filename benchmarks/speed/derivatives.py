"""Costs of exact derivatives against differences, of runs side by side against one by one, and of a diagnosis:

    python benchmarks/speed/derivatives.py --json FILE [--diagnose RECORDING …]

The figures are ratios within one run of this script; everything is compiled before it is timed.
"""

import os

os.environ["OPENBLAS_NUM_THREADS"] = "1"

import argparse
import json
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from sssi_exudyn.runtime.exudyn_build import take_fast_build

take_fast_build()  # as the command line does

import sssi_exudyn
from sssi_exudyn.contact.terms.terrain import SlopeChange, TerrainBump
from sssi_exudyn.contact.terms.wind import Wind
from sssi_exudyn.fitting.first_fit import problem_of
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.model.model import Model
from sssi_exudyn.motion.from_recording import motion_from_recording
from sssi_exudyn.recording.read import read_recording
from sssi_exudyn.simulation.full.run import simulate
from sssi_exudyn.simulation.reduced.derivatives import TableChange, run_tangents
from sssi_exudyn.simulation.reduced.prepared import Prepared, ReducedRun, prepare
from sssi_exudyn.simulation.reduced.run import simulate_reduced
from sssi_exudyn.simulation.reduced.sensitivities import simulate_each
from sssi_exudyn.validation.capture_error import CaptureError, with_error

EXAMPLES = Path(__file__).parents[2] / "examples"
NAMES = ("beginner", "intermediate")
COUNT = 40
BATCH = 64
LAWS = (
    "friction.mu_t", "friction.mu_n", "friction.eps", "air.c_d", "air.rho", "penetration.k", "penetration.c",
    "penetration.m1", "penetration.m3", "wind.w_f", "wind.w_l", "slope_change.delta", "terrain_bump.rise",
    "start.f", "start.l", "start.velocity_f", "start.velocity_l", "start.heading_offset",
)  # fmt: skip


def least(work: Callable[[], Any], repeats: int, clock: Callable[[], float]) -> float:
    """Return the least time (s) of some repeats."""
    walls = []
    for _ in range(repeats):
        begin = clock()
        work()
        walls.append(clock() - begin)
    return min(walls)


def changes_of(prepared: Prepared, count: int) -> list[TableChange]:
    """Return so many errors of the feet that vary."""
    span = float(prepared.time[-1] - prepared.time[0])
    errors = [
        CaptureError(kind, side, (float(prepared.time[0]) + share * span, 0.4 * span))
        for share in (0.0, 0.4, 0.8)
        for kind in ("yaw", "roll", "pitch", "height")
        for side in range(2)
    ]
    changes = [partial(lambda error, tables, size: with_error(tables, error, size), error) for error in errors]
    return [TableChange(change) for change in changes[:count]]


def derivatives(model: Model, prepared: Prepared) -> dict[str, float]:
    """Return processor time of ``COUNT`` tangents and of a run, and the tangents' speed-up over differences."""
    changes = changes_of(prepared, COUNT - len(LAWS))
    assert len(LAWS) + len(changes) == COUNT

    def tangents() -> None:
        run_tangents(model, prepared, LAWS, changes)

    tangents()
    cost = least(tangents, 3, time.process_time)
    run = least(lambda: simulate_reduced(model, prepared), 3, time.process_time)
    return {"run_s": run, "tangents_s": cost, "runs": cost / run, "speedup": (COUNT + 1) * run / cost}


def batches(model: Model, prepared: Prepared) -> dict[str, Any]:
    """Return runs a second one by one and in batches by the cores used, and the speed-up of the batches."""
    models = [model.with_values({"friction.mu_t": 0.05 + 0.001 * i}) for i in range(BATCH)]

    def observed(_model: Model, run: ReducedRun) -> Any:
        return run.antenna[-1]

    simulate_each(models[:2], prepared, observed)
    alone = BATCH / least(lambda: [simulate_reduced(changed, prepared) for changed in models], 2, time.perf_counter)
    together = {
        cores: BATCH / least(partial(simulate_each, models, prepared, observed, cores=cores), 2, time.perf_counter)
        for cores in range(1, (os.cpu_count() or 1) + 1)
    }
    return {
        "runs_a_second_one_by_one": alone,
        "runs_a_second_by_cores": together,
        "speedup_by_cores": {cores: rate / alone for cores, rate in together.items()},
    }


def diagnosis_wall(folder: Path) -> float:
    """Return the wall time (s) of ``sssi diagnose`` on a recording, from reading it to its report."""
    with tempfile.TemporaryDirectory() as out:
        begin = time.perf_counter()
        sssi_exudyn.diagnose(folder, out)
        return time.perf_counter() - begin


def keep(path: Path, figures: dict[str, Any]) -> None:
    """Print the figures so far and write them, so that nothing is lost where a later part ends early."""
    text = json.dumps(figures, indent=1)
    print(text, flush=True)
    path.write_text(text + "\n", encoding="utf-8")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", type=Path, required=True, help="file the figures go to")
    parser.add_argument("--diagnose", type=Path, nargs="*", default=[], help="recordings whose diagnosis is timed")
    options = parser.parse_args()
    for folder in options.diagnose:
        read_recording(folder)  # a wrong folder shows now, not after minutes
    parts = ("gradient_speedup", "batch_speedup", "diagnosis_wall_s", "detail")
    figures: dict[str, Any] = {"cores": os.cpu_count(), **{part: {} for part in parts}}
    for name in NAMES:
        recording = read_recording(EXAMPLES / name)
        motion = motion_from_recording(recording)
        model = problem_of(recording, motion, model_of(recording, motion), "joint").model
        hills = (Wind(0.5, 0.5), SlopeChange(0.01, model.start.f + 10.0), TerrainBump(0.05, model.start.f + 20.0))
        model = replace(model, terms=(*model.terms, *hills))
        prepared = prepare(model, motion)
        gradient, batch = derivatives(model, prepared), batches(model, prepared)
        figures["gradient_speedup"][name] = gradient["speedup"]
        figures["batch_speedup"][name] = max(batch["speedup_by_cores"].values())
        figures["detail"][name] = {"gradient": gradient, "batch": batch}
        keep(options.json, figures)
    if options.diagnose:
        simulate(model, motion, stop=motion.start + 0.1)  # compiles what a diagnosis needs in addition
    for folder in options.diagnose:
        figures["diagnosis_wall_s"][folder.resolve().name] = diagnosis_wall(folder)
        keep(options.json, figures)


if __name__ == "__main__":
    main()
