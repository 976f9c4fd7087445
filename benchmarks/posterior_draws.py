"""Whether friction's interval, from an estimate linearised where it ended, is that of the model itself.

    python benchmarks/posterior_draws.py --json FILE [RECORDING …] [--draws 100]

Two ways beyond the linear form, by the reduced model, all that is uncertain together:

- importance sampling: draws of the linear posterior weighed by the run's own misfit, with the number that they count
  for and the shape k of the weights' tail (Vehtari et al. 2024: above 0.7 they are not to be trusted);
- randomised estimates: measurements and priors each off by a draw of their noise, all estimated again by the responses
  of the estimate (Bardsley et al. 2014, "randomise then optimise"); their spread is held against the linear one.
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
from sssi_exudyn.fitting.first_fit import problem_of
from sssi_exudyn.fitting.linearised_run import moved_point, point_at
from sssi_exudyn.fitting.noise import precision
from sssi_exudyn.fitting.posterior import Posterior, linear_run
from sssi_exudyn.fitting.snow_surface import on_snow_surface
from sssi_exudyn.model.from_recording import model_of

EXAMPLES = Path(__file__).parents[1] / "examples"
FRICTION = ("friction.mu_t", "friction.mu_n")
STEPS = 4
"""Of a randomised estimate, by responses that stay: what is left of it is less than a tenth of a standard deviation."""


class Draws:
    """What is uncertain of a run, in standard deviations of what is known beforehand: θ, then η."""

    def __init__(self, found: Posterior) -> None:
        self.found, self.point = found, point_at(found.setting, found.model, found.sizes, found.beyond)
        _, self.columns = linear_run(found).whitened(found.levels)
        self.factor = precision(self.columns)
        setting = found.setting
        self.count = len(setting.unknowns)
        self.begin = np.concatenate([(found.values - setting.means) / setting.sigmas, found.sizes])

    def residual(self, at: Array) -> Array:
        """(N,) measured less predicted by a run with ``at``, in units of noise.  Raises SimulationDiverged."""
        setting = self.found.setting
        values = setting.means + at[: self.count] * setting.sigmas
        moved = moved_point(setting, self.point, self.found.responses, values, at[self.count :])
        off = (setting.seen.measured - moved.predicted)[:, None]
        return np.asarray(setting.seen.whiten(self.found.levels, off)[:, 0])

    def log_weight(self, off: Array) -> float:
        """Of a draw whose independent numbers are ``off``, but for a constant."""
        at = self.begin + solve_triangular(self.factor[0], off, trans="T", lower=True)
        residual = self.residual(at)
        return -0.5 * float(residual @ residual + at @ at - off @ off)

    def randomised(self, rng: np.random.Generator) -> tuple[Array, float]:
        """An estimate with measurements and priors off by a draw, and how far its last step was (standard deviations
        of the linear posterior, root mean square).
        """
        of_measured, of_prior = (rng.standard_normal(n) for n in self.columns.shape)
        at, step = self.begin, np.zeros(len(self.begin))
        for _ in range(STEPS):
            pull = self.columns.T @ (self.residual(at) + of_measured) - (at - of_prior)
            step = cho_solve(self.factor, pull)
            at = at + step
        return at, float(np.sqrt(np.mean((np.tril(self.factor[0]).T @ step) ** 2)))


def tail_shape(logs: Array) -> float:
    """k of a generalised Pareto distribution fitted to the largest fifth of weights, from their logarithms."""
    weights = np.sort(np.exp(logs - np.max(logs)))
    first = len(weights) - max(len(weights) // 5, 5)
    return float(genpareto.fit(weights[first:] - weights[first - 1], floc=0.0)[0])


def judge(folder: Path, draws: int) -> dict[str, object]:
    recording, motion = read_folder(folder, SILENT)
    problem = problem_of(recording, motion, on_snow_surface(model_of(recording, motion), recording, motion), "joint")
    made = Draws(estimate(problem, recording, motion, full=False).posterior)
    setting, rng = made.found.setting, np.random.default_rng(1)
    logs, places, left, failed = [], [], [], 0
    for _ in range(draws):
        try:
            logs.append(made.log_weight(rng.standard_normal(len(made.begin))))
            at, last = made.randomised(rng)
            places.append(at)
            left.append(last)
        except SimulationDiverged:
            failed += 1
    weights = np.exp(np.array(logs) - max(logs))
    linear = np.diag(cho_solve(made.factor, np.eye(len(made.begin))))
    every = np.array(places)
    answer: dict[str, object] = {
        "recording": folder.name,
        "uncertain_numbers": len(made.begin),
        "draws": draws,
        "diverged": failed,
        "log_weight_sd": float(np.std(logs)),
        "effective_draws": float(np.sum(weights) ** 2 / np.sum(weights**2)),
        "pareto_k": tail_shape(np.array(logs)),
        "last_step_median": float(np.median(left)),
    }
    for name in FRICTION:
        i = setting.names.index(name)
        sigma = float(np.sqrt(linear[i]))
        answer[name] = {
            "linear_sd": float(sigma * setting.sigmas[i]),
            "randomised_sd_over_linear": float(np.std(every[:, i]) / sigma),
            "randomised_mean_less_estimate_in_sd": float((np.mean(every[:, i]) - made.begin[i]) / sigma),
        }
    return answer


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("recordings", type=Path, nargs="*", default=[EXAMPLES / "beginner", EXAMPLES / "intermediate"])
    parser.add_argument("--json", type=Path, required=True, help="file the figures go to")
    parser.add_argument("--draws", type=int, default=100)
    asked = parser.parse_args()
    found = []
    for folder in asked.recordings:
        found.append(judge(folder, asked.draws))
        print(json.dumps(found[-1], indent=1), flush=True)
    asked.json.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
