"""Intervals of friction with a telephone's fixes, by what is declared of the noise of its class of receivers.

    python benchmarks/telephone_noise.py [--draws 60] [--seed 47101] [--stated 2.0]

The first seconds of ``examples/beginner`` are linearised about their fit.  All that is uncertain is drawn from its
prior and noise of the fixes, one a second, as two kinds of telephone may have it: as far off as stated for some
seconds, or slow and below what is stated.  Levels are then sought and friction is estimated, with the noise declared
of all receivers alike, and by class.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np

from sssi_exudyn.commands.recordings import SILENT, read_folder
from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.noise import ExponentialNoise
from sssi_exudyn.fitting import observations
from sssi_exudyn.fitting.autocorrelated_noise import draw_uneven_noise
from sssi_exudyn.fitting.evidence import Freedom, LinearModel, best_levels
from sssi_exudyn.fitting.linear_fit import averaged_covariance, estimate_amounts
from sssi_exudyn.fitting.noise import NOISE, UsualLevels, usual_levels
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.runtime.threads import with_one_thread_for_products
from sssi_exudyn.validation.diagnosis.context import diagnosis_problem
from sssi_exudyn.validation.diagnosis.state import first_fit, linear_model

EXAMPLES: Final = Path(__file__).parents[1] / "examples"
SECONDS: Final = 10.0
HALF: Final = 1.6449
KINDS: Final = {"as stated, 3 s": (1.0, 3.0), "0.35 of what is stated, 30 s": (0.35, 30.0)}
"""Size of the noise over what is stated, and its memory (s)."""


def linearised(stated: float) -> tuple[LinearModel, list[int]]:
    """Return the run with a fix a second, ``stated`` (m) off, and the columns of mu_t and mu_n among what is free."""
    recording, motion = read_folder(EXAMPLES / "beginner", SILENT)
    motion = replace(motion, stop=motion.start + SECONDS)
    problem, state, fit = first_fit(diagnosis_problem(recording, motion, model_of(recording, motion)))
    linear = linear_model(problem, state, fit)
    seen = linear.measurements
    every = max(1, round(1.0 / float(np.median(np.diff(seen.fixes)))))
    rows = np.zeros(len(linear.residual), dtype=bool)
    for name, place in seen.blocks.items():
        rows[place.start : place.stop : every if name in ("x", "y", "height") else 1] = True
    seen = replace(
        seen, fixes=seen.fixes[::every], place=seen.place[::every], gps_sigma=stated,
        stated=np.ones(len(seen.fixes[::every])), counts=np.ones(len(seen.fixes[::every])),
    )  # fmt: skip
    thinned = LinearModel(
        seen, linear.residual[rows], Freedom(linear.free.columns[rows], linear.free.scales),
        {name: columns[rows] for name, columns in linear.sized.items()},
    )  # fmt: skip
    first = len(linear.free.scales) - len(fit.parameters)
    names = [str(parameter.names[0]) for parameter in fit.parameters]
    return thinned, [first + names.index(f"friction.{key}") for key in ("mu_t", "mu_n")]


def alike(fix: float, height: float, load: float, moment: float) -> UsualLevels:
    """Return usual levels with the noise of a receiver with carrier phases, whatever is stated."""
    gps = ExponentialNoise(NOISE.gps.size * fix, NOISE.gps.memory)
    return replace(usual_levels(fix, height, load, moment), gps=gps, receiver=NOISE.gps)


def judge(linear: LinearModel, at: list[int], kind: tuple[float, float], rng: np.random.Generator) -> tuple[Array, ...]:
    """Return errors (2,) of friction in standard errors, and these, of one draw."""
    seen = linear.measurements
    usual = seen.usual
    free = linear.all_free(usual)
    true = rng.standard_normal(len(free.scales))
    measured = free.columns @ (free.scales * true)
    levels = replace(usual, gps=ExponentialNoise(kind[0] * seen.gps_sigma, kind[1]))
    for name, place in seen.blocks.items():
        if place.stop > place.start:
            measured[place] += draw_uneven_noise(rng, seen.time_of(name), levels.of(name), seen.scale[place])
    drawn = replace(linear, residual=measured)
    shown, _ = best_levels(drawn, usual)
    mean, _ = estimate_amounts(drawn, shown)
    spread = np.sqrt(np.diag(averaged_covariance(drawn, shown)))[at]
    return (mean[at] - true[at]) / spread, spread * free.scales[at], np.array([shown.gps.sigma / seen.gps_sigma])


@with_one_thread_for_products
def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--draws", type=int, default=60)
    parser.add_argument("--seed", type=int, default=47101)
    parser.add_argument("--stated", type=float, default=2.0)
    chosen = parser.parse_args()
    linear, at = linearised(chosen.stated)
    by_class = usual_levels
    for kind, noise in KINDS.items():
        for declared, usual in (("alike", alike), ("by class", by_class)):
            observations.usual_levels = usual  # type: ignore[attr-defined]
            rng = np.random.default_rng(chosen.seed)
            z, errors, sizes = (
                np.array(rows)
                for rows in zip(*(judge(linear, at, noise, rng) for _ in range(chosen.draws)), strict=True)
            )
            held = np.count_nonzero(np.abs(z) < HALF, axis=0)
            print(
                f"{kind}; declared {declared}: 90 % intervals that hold mu_t, mu_n {held.tolist()} of {chosen.draws}; "
                f"rms z {np.sqrt(np.mean(z**2, axis=0)).round(2).tolist()}; standard error, mean "
                f"{errors.mean(axis=0).round(4).tolist()}; noise found over stated {np.exp(np.log(sizes).mean()):.2f}"
            )


if __name__ == "__main__":
    main()
