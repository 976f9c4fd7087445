"""Friction on hills: errors of an estimate where the snow has waves that its fixes hardly show.

    python benchmarks/hills.py --json FILE [--hills 24] [--seconds 9] [--seed 1]

Every run is a case of the diagnosis' benchmark with nothing concealed (``validation/benchmark/world``): another mass,
slope, snow, ski and clock, a capture with errors in every joint.  Its hill is steeper than there: waves of 8 to 60 m
with a root mean square slope of 0.015 to 0.05.  Half of the skiers, drawn, balance on it.  The results are kept in
FILE after each run: the same call continues from there.
"""

from __future__ import annotations

import argparse
import json
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from sssi_exudyn.commands.recordings import SILENT, read_folder
from sssi_exudyn.core.errors import SimulationDiverged
from sssi_exudyn.fitting.estimate import estimate
from sssi_exudyn.fitting.first_fit import problem_of
from sssi_exudyn.fitting.snow_surface import on_snow_surface
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.runtime.threads import with_one_thread_for_products
from sssi_exudyn.validation.benchmark.balanced_skier import balance_skier
from sssi_exudyn.validation.benchmark.cases import Recorded, record
from sssi_exudyn.validation.benchmark.run import base_of
from sssi_exudyn.validation.benchmark.world import draw_instruments, other_day

EXAMPLES: Final = Path(__file__).parents[1] / "examples"
STEEPNESS: Final = (0.015, 0.05)
HALF: Final = 1.6449
"""Standard deviations to either side that hold 90 % of a normal distribution."""
NUMBERS: Final = ("friction.mu_t", "friction.mu_n")


def judge(base: Recorded, seconds: float, seed: int) -> dict[str, object]:
    """Judge one drawn hill: true and estimated friction with standard errors."""
    rng = np.random.default_rng(seed)
    recording, motion, fitted = base
    begin = float(rng.uniform(motion.start, motion.stop - seconds))
    stated = replace(motion, start=begin, stop=begin + seconds)
    world, moved = other_day(rng, recording, stated, fitted, STEEPNESS)
    instruments = draw_instruments(rng, moved)
    balanced = bool(rng.integers(2))
    if balanced:
        moved = balance_skier(world, moved, recording)
    recorded, captured, model = record(rng, (recording, stated, fitted), moved, world, instruments, 0.0, 0.0)
    problem = problem_of(recorded, captured, on_snow_surface(model, recorded, captured), "joint")
    posterior = estimate(problem, recorded, captured, full=False).posterior
    assert world.surface is not None
    numbers = {}
    for name in NUMBERS:
        value, low, high = posterior.interval(name, HALF)
        numbers[name] = {"true": world.value(name), "value": value, "low": low, "high": high}
    return {
        "recording": recording.name,
        "seed": seed,
        "balanced": balanced,
        "height_rms_m": float(np.std(world.surface.mean)),
        "rounds": posterior.rounds,
        "numbers": numbers,
    }


def summary(runs: list[dict[str, Any]]) -> dict[str, Any]:
    """Return by number how many intervals hold the truth, and error over standard error: mean and root mean square."""
    complete = [run for run in runs if "numbers" in run]
    result: dict[str, Any] = {"runs": len(runs), "diverged": len(runs) - len(complete)}
    for name in NUMBERS:
        of_runs = [run["numbers"][name] for run in complete]
        z = np.array([2.0 * HALF * (n["value"] - n["true"]) / (n["high"] - n["low"]) for n in of_runs])
        result[name] = {
            "inside_90": int(np.sum([n["low"] <= n["true"] <= n["high"] for n in of_runs])),
            "mean_z": float(np.mean(z)),
            "rms_z": float(np.sqrt(np.mean(z**2))),
            "z": np.round(z, 2).tolist(),
        }
    return result


@with_one_thread_for_products
def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", type=Path, required=True)
    parser.add_argument("--hills", type=int, default=24)
    parser.add_argument("--seconds", type=float, default=9.0)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    runs = json.loads(options.json.read_text())["runs"] if options.json.exists() else []
    bases = []
    for name in ("beginner", "intermediate"):
        recording, motion = read_folder(EXAMPLES / name, SILENT)
        bases.append(base_of(recording, motion, model_of(recording, motion)))
    for i in range(len(runs), options.hills):
        seed = options.seed + i
        try:
            runs.append(judge(bases[i % 2], options.seconds, seed))
        except SimulationDiverged as error:
            runs.append({"seed": seed, "diverged": str(error)})
        result = {"summary": summary(runs), "runs": runs}
        options.json.write_text(json.dumps(result, indent=1))
        print(f"{i + 1} of {options.hills}: {json.dumps(runs[-1])}", flush=True)
    print(json.dumps(summary(runs), indent=1))


if __name__ == "__main__":
    main()
