"""Coverage of an estimate's intervals on runs with errors drawn from the priors.

    python benchmarks/interval_coverage.py --json FILE [--runs 100] [--seconds 6] [--seed 1]

Every run begins with the bundled postures, alternately; its measurements are the reduced model's with errors of the
posture, the skier, snow, air and instruments drawn from their priors, and noise.  The results are kept in FILE after
each run: the same call continues from there.
"""

from __future__ import annotations

import argparse
import json
from dataclasses import replace
from pathlib import Path

import numpy as np

from sssi_exudyn.commands.recordings import SILENT, read_folder
from sssi_exudyn.core.errors import SimulationDiverged
from sssi_exudyn.fitting.estimate import setting_of
from sssi_exudyn.fitting.first_fit import problem_of
from sssi_exudyn.fitting.linearised_run import Setting
from sssi_exudyn.fitting.posterior import find_posterior
from sssi_exudyn.fitting.snow_surface import on_snow_surface
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.model.model import Model
from sssi_exudyn.runtime.threads import with_one_thread_for_products
from sssi_exudyn.validation.drawn_run import draw_run

EXAMPLES = Path(__file__).parents[1] / "examples"
FRICTION = {
    "beginner": {"friction.mu_t": 0.06, "friction.mu_n": 0.55},
    "intermediate": {"friction.mu_t": 0.19, "friction.mu_n": 0.9},
}
HALF = 1.6449
"""Standard deviations to either side that hold 90 % of a normal distribution."""


def example(name: str, seconds: float) -> tuple[Model, Setting]:
    """Return the model of a bundled recording's first seconds with the friction to be found, and the fit's setting."""
    recording, motion = read_folder(EXAMPLES / name, SILENT)
    model = on_snow_surface(model_of(recording, motion), recording, motion)
    motion = replace(motion, stop=min(motion.stop, motion.start + seconds))
    problem = problem_of(recording, motion, model, "joint")
    return setting_of(problem.model.with_values(FRICTION[name]), problem, recording, motion)


def judge(name: str, seconds: float, seed: int) -> dict[str, object]:
    """Judge one drawn run: the standard deviations of each number's estimate from the truth."""
    model, setting = example(name, seconds)
    drawn = draw_run(model, setting, np.random.default_rng(seed))
    posterior = find_posterior(model, drawn.setting)
    z = (posterior.values - drawn.values) / np.sqrt(np.diag(posterior.covariance))
    return {
        "recording": name,
        "seed": seed,
        "z": dict(zip(setting.names, z.tolist(), strict=True)),
        "sd": dict(zip(setting.names, np.sqrt(np.diag(posterior.covariance)).tolist(), strict=True)),
        "moved": posterior.moved,
        "rounds": posterior.rounds,
    }


@with_one_thread_for_products
def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", type=Path, required=True)
    parser.add_argument("--runs", type=int, default=100)
    parser.add_argument("--seconds", type=float, default=6.0)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    runs = json.loads(options.json.read_text())["runs"] if options.json.exists() else []
    for i in range(len(runs), options.runs):
        name = tuple(FRICTION)[i % 2]
        try:
            runs.append(judge(name, options.seconds, options.seed + i))
        except SimulationDiverged as error:
            runs.append({"recording": name, "seed": options.seed + i, "diverged": str(error)})
        complete = [run for run in runs if "z" in run]
        within = {
            number: float(np.mean([abs(run["z"][number]) <= HALF for run in complete]))
            for number in ("friction.mu_t", "friction.mu_n")
        }
        spread = {
            number: float(np.std([run["z"][number] for run in complete]))
            for number in ("friction.mu_t", "friction.mu_n")
        }
        result = {"coverage_90": within, "spread_of_z": spread, "diverged": len(runs) - len(complete), "runs": runs}
        options.json.write_text(json.dumps(result, indent=1))
        print(f"{i + 1} of {options.runs}: {within}, spread {spread}", flush=True)


if __name__ == "__main__":
    main()
