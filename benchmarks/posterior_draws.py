"""Test whether friction's interval, from an estimate linearised at its end, is that of the model itself.

    python benchmarks/posterior_draws.py --json FILE [RECORDING …] [--draws 100]

Two methods go beyond the linear form, by the reduced model, with all uncertain quantities together:

- importance sampling: draws of the linear posterior weighed by the run's own misfit, with their effective number and
  the shape k of the weights' tail (Vehtari et al. 2024: above 0.7 they are not to be trusted);
- randomised estimates: measurements and priors are each changed by a draw of their noise, and everything is estimated
  again by the responses of the estimate (Bardsley et al. 2014, "randomise then optimise"); their spread is compared
  with the linear one.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import numpy as np
from scipy.linalg import cho_solve, solve_triangular
from scipy.stats import genpareto

from sssi_exudyn.commands.recordings import SILENT, read_folder
from sssi_exudyn.core.errors import SimulationDiverged
from sssi_exudyn.core.frames import Array
from sssi_exudyn.fitting.estimate import estimate
from sssi_exudyn.fitting.evidence import uncertain
from sssi_exudyn.fitting.first_fit import problem_of
from sssi_exudyn.fitting.linearised_run import moved_point, point_at
from sssi_exudyn.fitting.posterior import Posterior
from sssi_exudyn.fitting.snow_surface import on_snow_surface
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.runtime.threads import with_one_thread_for_products

EXAMPLES = Path(__file__).parents[1] / "examples"
FRICTION = ("friction.mu_t", "friction.mu_n")
STEPS = 4
"""Steps of a randomised estimate, with fixed responses: its remaining error is less than a tenth of a standard
deviation.
"""


class Draws:
    """Uncertain numbers of a run, in standard deviations of their priors: θ, then η, then the changing drag."""

    def __init__(self, posterior: Posterior) -> None:
        setting = posterior.setting
        self.posterior = posterior
        self.point = point_at(setting, posterior.model, posterior.sizes, posterior.beyond)
        known = uncertain(posterior.linear, posterior.levels)
        self.columns, self.factor = known.columns, known.factor
        self.count = len(setting.unknowns)
        self.drag = posterior.responses.by_drag
        values = (posterior.values - setting.means) / setting.sigmas
        self.begin = np.concatenate([values, posterior.sizes, np.zeros(self.drag.shape[1])])

    def residual(self, numbers: Array) -> Array:
        """Return (N,) measured less predicted by a run with ``numbers``, in units of noise.

        Raises SimulationDiverged.
        """
        setting = self.posterior.setting
        values = setting.means + numbers[: self.count] * setting.sigmas
        sizes, drag = np.split(numbers[self.count :], [len(self.posterior.sizes)])
        moved = moved_point(setting, self.point, self.posterior.responses, values, sizes)
        difference = (setting.seen.measured - moved.predicted - self.drag @ drag)[:, None]
        return np.asarray(setting.seen.whiten(self.posterior.levels, difference)[:, 0])

    def log_weight(self, off: Array) -> float:
        """Return the log weight, except for a constant, of a draw whose independent numbers are ``off``."""
        numbers = self.begin + solve_triangular(self.factor[0], off, trans="T", lower=True)
        residual = self.residual(numbers)
        return -0.5 * float(residual @ residual + numbers @ numbers - off @ off)

    def randomised(self, rng: np.random.Generator) -> tuple[Array, float]:
        """Estimate with measurements and priors changed by a draw, and return also the length of the last step.

        The length is in standard deviations of the linear posterior, root mean square.
        """
        of_measured, of_prior = (rng.standard_normal(n) for n in self.columns.shape)
        numbers, step = self.begin, np.zeros(len(self.begin))
        for _ in range(STEPS):
            pull = self.columns.T @ (self.residual(numbers) + of_measured) - (numbers - of_prior)
            step = cho_solve(self.factor, pull)
            numbers = numbers + step
        return numbers, float(np.sqrt(np.mean((np.tril(self.factor[0]).T @ step) ** 2)))


def tail_shape(logs: Array) -> float:
    """Return k of a generalised Pareto distribution fitted to the largest fifth of weights, from their logarithms."""
    weights = np.sort(np.exp(logs - np.max(logs)))
    first = len(weights) - max(len(weights) // 5, 5)
    return float(genpareto.fit(weights[first:] - weights[first - 1], floc=0.0)[0])


def judge(folder: Path, draws: int) -> dict[str, object]:
    recording, motion = read_folder(folder, SILENT)
    problem = problem_of(recording, motion, on_snow_surface(model_of(recording, motion), recording, motion), "joint")
    sampler = Draws(estimate(problem, recording, motion, full=False).posterior)
    setting, rng = sampler.posterior.setting, np.random.default_rng(1)
    logs, places, last_steps, failed = [], [], [], 0
    for _ in range(draws):
        try:
            logs.append(sampler.log_weight(rng.standard_normal(len(sampler.begin))))
            numbers, step = sampler.randomised(rng)
            places.append(numbers)
            last_steps.append(step)
        except SimulationDiverged:
            failed += 1
    weights = np.exp(np.array(logs) - max(logs))
    linear = np.diag(cho_solve(sampler.factor, np.eye(len(sampler.begin))))
    estimates = np.array(places)
    answer: dict[str, object] = {
        "recording": folder.name,
        "uncertain_numbers": len(sampler.begin),
        "draws": draws,
        "diverged": failed,
        "log_weight_sd": float(np.std(logs)),
        "effective_draws": float(np.sum(weights) ** 2 / np.sum(weights**2)),
        "pareto_k": tail_shape(np.array(logs)),
        "last_step_median": float(np.median(last_steps)),
    }
    for name in FRICTION:
        i = setting.names.index(name)
        sigma = float(np.sqrt(linear[i]))
        answer[name] = {
            "linear_sd": float(sigma * setting.sigmas[i]),
            "randomised_sd_over_linear": float(np.std(estimates[:, i]) / sigma),
            "randomised_mean_less_estimate_in_sd": float((np.mean(estimates[:, i]) - sampler.begin[i]) / sigma),
        }
    return answer


@with_one_thread_for_products
def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("recordings", type=Path, nargs="*", default=[EXAMPLES / "beginner", EXAMPLES / "intermediate"])
    parser.add_argument("--json", type=Path, required=True, help="file the figures go to")
    parser.add_argument("--draws", type=int, default=100)
    options = parser.parse_args()
    answers = []
    for folder in options.recordings:
        answers.append(judge(folder, options.draws))
        print(json.dumps(answers[-1], indent=1), flush=True)
    options.json.write_text(json.dumps(answers, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
