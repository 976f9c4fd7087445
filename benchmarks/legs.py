"""Bands of joint moments, and snow, of runs whose legs give or hold, with the legs' compliance estimated or not.

    python benchmarks/legs.py --json FILE [--runs 8] [--seed 0] [--compliance 4e-5] [--held]

Runs are of the diagnosis' benchmark world with nothing hidden: stretches of 6 s of the bundled recordings, the beginner
on even seeds.  Moments are those of the reduced model.  The results are kept in FILE after each run.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from sssi_exudyn.bodies.skier.chain import PRESCRIBED
from sssi_exudyn.commands.recordings import SILENT, read_folder
from sssi_exudyn.core.errors import SimulationDiverged
from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.noise import NORMAL_90
from sssi_exudyn.core.number_ref import COMPLIANCE, DAMPING, EPS, MU_N, MU_T, STIFFNESS
from sssi_exudyn.fitting.estimate import estimate
from sssi_exudyn.fitting.first_fit import problem_of
from sssi_exudyn.fitting.posterior import Posterior, draw_numbers
from sssi_exudyn.fitting.posture_errors import grown
from sssi_exudyn.fitting.snow_surface import on_snow_surface
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.model.model import Model
from sssi_exudyn.motion.motion import Motion
from sssi_exudyn.muscle_forces.loads import joint_moments, movement_of
from sssi_exudyn.recording.recording import Recording
from sssi_exudyn.runtime.threads import with_one_thread_for_products
from sssi_exudyn.simulation.assembly import Parts, correct_motion
from sssi_exudyn.simulation.reduced.prepared import prepare
from sssi_exudyn.simulation.reduced.run import simulate_reduced
from sssi_exudyn.validation.benchmark.balanced_skier import balance_skier
from sssi_exudyn.validation.benchmark.cases import record
from sssi_exudyn.validation.benchmark.world import draw_instruments, other_day

EXAMPLES = Path(__file__).parents[1] / "examples"
FRICTION = {
    "beginner": {MU_T: 0.06, MU_N: 0.55},
    "intermediate": {MU_T: 0.19, MU_N: 0.9},
}
SECONDS = 6.0
KNEES, HIPS = ([PRESCRIBED.index(f"{joint}_{side}") for side in "lr"] for joint in ("knee_angle", "hip_flexion"))
DRAWS = 16
NUMBERS = (MU_T, MU_N, EPS, STIFFNESS, DAMPING, COMPLIANCE)


@dataclass(frozen=True)
class World:
    """A recorded run with the truth: the model as stated, the true model and the true movement."""

    recording: Recording
    captured: Motion
    stated: Model
    model: Model
    motion: Motion


def make(seed: int, compliance: float) -> World:
    """Record a run on legs of that compliance (m/N)."""
    rng = np.random.default_rng([seed, 77])
    name = tuple(FRICTION)[seed % 2]
    recording, motion = read_folder(EXAMPLES / name, SILENT)
    fitted = model_of(recording, motion).with_values(FRICTION[name])
    begin = float(rng.uniform(motion.start, motion.stop - SECONDS))
    stretch = replace(motion, start=begin, stop=begin + SECONDS)
    model, motion = other_day(rng, recording, stretch, fitted)
    instruments = draw_instruments(rng, motion)
    model = model.with_values({COMPLIANCE: compliance})
    motion = balance_skier(model, motion, recording)
    known = replace(recording, name=f"run_{seed}"), stretch, fitted
    return World(*record(rng, known, motion, model, instruments, 0.0, 0.0), model, motion)


def loads_of(model: Model, motion: Motion, instants: Array) -> dict[str, Array]:
    """Return flexion moments (n, 2) N m of knees and hips, and both feet's loads (n, 2) N."""
    run = simulate_reduced(model, prepare(model, motion, step=0.01))
    parts = Parts(model, correct_motion(model, motion))
    rows = np.clip(np.searchsorted(run.time, instants - 1e-9), 0, len(run.time) - 1)
    moments = joint_moments(parts, movement_of(parts, run, rows), run.foot_position[rows], run.snow_moment[rows])
    return {"knees": moments[:, KNEES], "hips": moments[:, HIPS], "loads": run.foot_load[rows]}


def drawn_models(posterior: Posterior) -> list[Model]:
    """Draw models from the posterior, posture and mass included."""
    setting, posture = posterior.setting, posterior.responses.posture
    mass, sigma = setting.mass
    models = []
    for values, sizes in zip(*draw_numbers(posterior, DRAWS, np.random.default_rng(0)), strict=True):
        pairs = zip(setting.unknowns, values.tolist(), strict=True)
        model = posterior.model.with_values({name: value for unknown, value in pairs for name in unknown.names})
        change = posture.angles((sizes - posterior.sizes)[:-1])
        skier = replace(model.skier, mass=mass + float(sizes[-1]) * sigma)
        models.append(replace(model, posture=grown(model.posture, posture.time, change), skier=skier))
    return models


def judge(seed: int, compliance: float, *, held: bool) -> dict[str, object]:
    """Judge the estimate of one run: bands against the truth, and the numbers of the snow."""
    world = make(seed, compliance)
    recording, motion = world.recording, world.captured
    if held:
        recording = replace(recording, uncertainty=replace(recording.uncertainty, leg_compliance=0.0))
    problem = problem_of(recording, motion, on_snow_surface(world.stated, recording, motion), "joint")
    posterior = estimate(problem, recording, motion, full=False).posterior
    instants = np.arange(motion.start + 0.2, motion.stop - 0.1, 0.05)

    def loads(model: Model) -> dict[str, Array]:
        return loads_of(model, motion, instants)

    truth, nominal = loads_of(world.model, world.motion, instants), loads(posterior.model)
    errors = [{name: drawn[name] - nominal[name] for name in nominal} for drawn in _complete(posterior, loads)]
    bands: dict[str, object] = {}
    for name, estimated in nominal.items():
        half = NORMAL_90 * np.sqrt(np.mean([error[name] ** 2 for error in errors], axis=0))
        off = estimated - truth[name]
        bands[name] = {
            "inside": float(np.mean(np.abs(off) <= half)),
            "error_rms": float(np.sqrt(np.mean(off**2))),
            "half_width": float(np.mean(half)),
            "largest_over_true": float(np.max(np.abs(estimated)) / np.max(np.abs(truth[name]))),
        }
    names = posterior.setting.names
    sigmas = np.sqrt(np.diag(posterior.covariance_of_numbers))
    numbers = {
        name: (posterior.model.value(name), float(sigmas[names.index(name)]), world.model.value(name))
        for name in NUMBERS
        if name in names
    }
    return {"seed": seed, "bands": bands, "numbers": numbers, "rounds": posterior.rounds, "draws": len(errors)}


def _complete(posterior: Posterior, loads: Callable[[Model], dict[str, Array]]) -> list[dict[str, Array]]:
    """Return the loads of those draws that can be run."""
    complete = []
    for model in drawn_models(posterior):
        try:
            complete.append(loads(model))
        except SimulationDiverged:
            continue
    return complete


@with_one_thread_for_products
def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", type=Path, required=True)
    parser.add_argument("--runs", type=int, default=8)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--compliance", type=float, default=4e-5)
    parser.add_argument("--held", action="store_true", help="hold the legs in the estimate")
    options = parser.parse_args()
    runs: list[dict[str, object]] = []
    for seed in range(options.seed, options.seed + options.runs):
        runs.append(judge(seed, options.compliance, held=options.held))
        options.json.write_text(json.dumps(runs, indent=1))
        print(json.dumps(runs[-1]), flush=True)


if __name__ == "__main__":
    main()
