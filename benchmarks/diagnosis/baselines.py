"""What simpler methods would name, on the runs of ``worlds.py``: each knows the covariance of all that is uncertain.

    python benchmarks/diagnosis/baselines.py examples/beginner:0:6.5 [--seed 48001] [--draws 12]

With the same stretches, seed and draws these are the runs of ``worlds.py``.  The methods:

BIC, AIC : the law, at its best place and of its best size, whose χ² is the least once its numbers are counted
    (Schwarz 1978, Akaike 1974); N is the number of measurements
force and nearest law : a Gaussian process for a force at the centre of mass, where its Bayes factor against none is
    above 20; then the law that explains most of what that force does, or none of the list below one half
residual correlation : the law with which the residual correlates best, where that is not chance (0.05, as often as
    laws are tried)
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2
from worlds import CLEAR, Stretch, answer_of, command_line, drawn_runs, fit_stretch

from sssi_exudyn.core.frames import Array
from sssi_exudyn.fitting.evidence import usual_columns
from sssi_exudyn.runtime.threads import with_one_thread_for_products
from sssi_exudyn.validation.benchmark.effects import PHYSICS, SENSOR, UNKNOWN
from sssi_exudyn.validation.diagnosis.diagnosis_data import NOTHING_MISSING
from sssi_exudyn.validation.diagnosis.hypotheses.catalogue import BY_NAME
from sssi_exudyn.validation.diagnosis.search.missing_force import gain_of, latent_covariance
from sssi_exudyn.validation.diagnosis.thresholds import THRESHOLDS
from sssi_exudyn.validation.diagnosis.worlds.catalogue import NOT_IN_THE_LIST

METHODS: Final = ("BIC", "AIC", "force and nearest law", "residual correlation")
STRONG_EVIDENCE: Final = np.log(20.0)
"""Log Bayes factor from which a force is found (Kass and Raftery 1995)."""
EXPLAINED: Final = 0.5
"""Share of what a force does that the nearest law explains at least."""
BY_CHANCE: Final = 0.05


@dataclass(frozen=True)
class Tried:
    """One law tried on D runs at all of its places.

    numbers : amplitudes and places that it fits;  amplitudes : how many;  places : at how many it was tried
    gained : (D,) decrease of χ² at the best place, all that is uncertain fitted along
    correlated : (D,) decrease of the residual's square by the law alone, in units of noise
    of_force : (D,) decrease of the χ² of what a force does
    """

    numbers: int
    amplitudes: int
    places: int
    gained: Array
    correlated: Array
    of_force: Array


def try_laws(stretch: Stretch, rest: Array, force: Array) -> dict[str, Tried]:
    """Try every law of the list on runs with ``rest`` (N, D), what is left of them, and on ``force`` (N, D), what is
    left of what a latent force does in each.
    """
    tried = {}
    for name, candidates in stretch.geometry.candidates.items():
        if BY_NAME[name].kind == "unexplained":
            continue
        columns = usual_columns([candidate.free for candidate in candidates])
        shape, width = columns.shape, columns.shape[2]
        white = stretch.white(columns.reshape(len(columns), -1))
        cleared = stretch.known.remove_from(white)
        alone, next_to = white.reshape(shape), cleared.reshape(shape)
        tried[name] = Tried(
            numbers=width + len(candidates[0].places),
            places=len(candidates),
            amplitudes=width,
            gained=_best(alone, next_to, rest),
            correlated=_best(alone, alone, rest),
            of_force=_best(alone, next_to, force),
        )
    return tried


def _best(columns: Array, measured: Array, rest: Array) -> Array:
    """Return (D,) the most that one of c laws, ``columns`` (N, c, w), takes off the χ² of ``rest`` (N, D); an
    amplitude's information is that of its column with what is ``measured`` (N, c, w) of it.
    """
    gram = np.einsum("nci,ncj->cij", columns, measured)
    pull = np.einsum("nci,nd->cid", columns, rest)
    solved = np.linalg.pinv(gram, rcond=1e-9, hermitian=True) @ pull
    return np.asarray(np.max(np.sum(pull * solved, axis=1), axis=0))


def latent_forces(stretch: Stretch, rest: Array) -> tuple[Array, Array]:
    """Return what a latent force does in runs with ``rest`` (N, D), as far as all that is uncertain leaves it, and its
    log Bayes factors (D,).
    """
    geometry = stretch.geometry
    white = stretch.white(geometry.by_body)
    cleared = stretch.known.remove_from(white)
    gram = white.T @ cleared
    prior = latent_covariance(geometry.edges, *THRESHOLDS.usual_force, held=THRESHOLDS.cell)
    pull = white.T @ rest
    gain, of_none = gain_of(prior, gram, np.zeros(len(prior)))  # the same in all runs
    forces = gain @ pull
    return cleared @ forces, of_none + 0.5 * np.sum(pull * forces, axis=0)


def names_of(stretch: Stretch, rest: Array) -> dict[str, list[str]]:
    """Return what each method names in runs with ``rest`` (N, D), in units of noise, without what is uncertain."""
    force, factors = latent_forces(stretch, rest)
    laws = try_laws(stretch, rest, force)
    total = np.maximum(np.sum(force**2, axis=0), 1e-12)
    count, length = rest.shape
    bic = {name: law.gained - law.numbers * np.log(count) for name, law in laws.items()}
    aic = {name: law.gained - 2.0 * law.numbers for name, law in laws.items()}
    share = {name: law.of_force / total for name, law in laws.items()}
    tries = sum(law.places for law in laws.values())
    by_chance = {name: -chi2.logsf(law.correlated, law.amplitudes) for name, law in laws.items()}
    rare = -np.log(BY_CHANCE / tries)
    nearest = [
        best if share[best][d] >= EXPLAINED else NOT_IN_THE_LIST for d, best in enumerate(_largest(share, length))
    ]
    return {
        "BIC": [best if bic[best][d] > 0.0 else NOTHING_MISSING for d, best in enumerate(_largest(bic, length))],
        "AIC": [best if aic[best][d] > 0.0 else NOTHING_MISSING for d, best in enumerate(_largest(aic, length))],
        "force and nearest law": [
            best if factor > STRONG_EVIDENCE else NOTHING_MISSING for best, factor in zip(nearest, factors, strict=True)
        ],
        "residual correlation": [
            best if by_chance[best][d] > rare else NOTHING_MISSING for d, best in enumerate(_largest(by_chance, length))
        ],
    }


def _largest(values: dict[str, Array], count: int) -> list[str]:
    """Return the name with the largest of ``values`` (count,) in each run."""
    return [max(values, key=lambda name: float(values[name][d])) for d in range(count)]


def figures(hidden: Sequence[str], strength: Array, named: Sequence[str]) -> dict[str, tuple[int, float]]:
    """Return of how many runs each figure is, and its mean."""
    right = np.array([bool(answer_of(true, [name])) for true, name in zip(hidden, named, strict=True)])
    named_something = np.array([name != NOTHING_MISSING for name in named])
    law = named_something & np.array([name != NOT_IN_THE_LIST for name in named])
    clear = strength >= CLEAR

    def among(names: Sequence[str]) -> NDArray[np.bool_]:
        return np.array([true in names for true in hidden])

    counted = {
        "nothing hidden, found": (named_something, among([NOTHING_MISSING])),
        "clear listed, right first": (right & named_something, among([*PHYSICS, *SENSOR]) & clear),
        "of physics": (right & named_something, among(list(PHYSICS)) & clear),
        "named from the list, wrong": (~right, law),
        "clear unlisted, called so": (right & named_something, among(list(UNKNOWN)) & clear),
    }
    return {
        name: (int(runs.sum()), float(of[runs].mean()) if runs.any() else 0.0) for name, (of, runs) in counted.items()
    }


@with_one_thread_for_products
def main() -> None:
    parser = command_line(__doc__, seed=48001, draws=12)
    chosen = parser.parse_args()
    hidden: list[str] = []
    strength: list[float] = []
    named: dict[str, list[str]] = {method: [] for method in METHODS}
    for i, text in enumerate(chosen.stretches):
        stretch = fit_stretch(text)
        names, worlds = drawn_runs(stretch, chosen.seed + i, chosen.draws)
        hidden += names
        strength += worlds.strength.tolist()
        for method, answers in names_of(stretch, worlds.rest).items():
            named[method] += answers
        print(f"{text}: {len(names)} runs", flush=True)
    result = {method: figures(hidden, np.array(strength), answers) for method, answers in named.items()}
    for name in next(iter(result.values())):
        print(f"{name:30}", *(f"{method}: {of[name][1]:.3f} of {of[name][0]}" for method, of in result.items()))
    if chosen.json:
        chosen.json.write_text(json.dumps(result) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
