"""Names by a classifier that learned from worlds of a recording, by tempered evidence, and by both, on the same hidden
effects.

    python benchmarks/worlds.py examples/beginner:0:6.5 examples/intermediate:2:6.5 [--seed 48001] [--draws 12]

Each stretch (folder, seconds left out, seconds) is fitted by the reduced model.  Effects of the benchmark, none of
which has the law of its hypothesis, act in the fitted run at all four sizes.  What they do is linear, by a ten
thousandth of each, since about an estimate of its own friction has taken up most of an effect.  Errors of the posture,
the snow and the instruments are linear, too, with noise.  Nothing of these effects was in the training.  No slope has a
roll of its own here.  The diagnosis itself refits and estimates again, which is not done here.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np
from scipy.special import logsumexp, softmax

from sssi_exudyn.commands.recordings import SILENT, read_folder
from sssi_exudyn.core.errors import SimulationDiverged
from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.number_ref import CLOCK_OFFSET
from sssi_exudyn.fitting.evidence import Uncertain, whiten_columns
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.runtime.threads import with_one_thread_for_products
from sssi_exudyn.simulation.reduced.run import simulate_reduced
from sssi_exudyn.validation.benchmark.effects import EFFECTS, PHYSICS, SENSOR, SIZES, UNKNOWN, plain_run
from sssi_exudyn.validation.diagnosis.context import diagnosis_problem
from sssi_exudyn.validation.diagnosis.diagnosis_data import NOTHING_MISSING
from sssi_exudyn.validation.diagnosis.hypotheses.catalogue import BY_NAME, HYPOTHESES
from sssi_exudyn.validation.diagnosis.hypotheses.hypothesis import FittedRun, responses_of
from sssi_exudyn.validation.diagnosis.hypotheses.instruments.heading_misalignment import HeadingMisalignment
from sssi_exudyn.validation.diagnosis.search.missing_force import DIRECTIONS
from sssi_exudyn.validation.diagnosis.search.probabilities import probabilities
from sssi_exudyn.validation.diagnosis.state import first_fit, fitted_run, linear_model
from sssi_exudyn.validation.diagnosis.thresholds import THRESHOLDS
from sssi_exudyn.validation.diagnosis.worlds.best_possible import log_shape_factors
from sssi_exudyn.validation.diagnosis.worlds.catalogue import NOT_IN_THE_LIST, TWO_AT_ONCE, Answer, answers_of
from sssi_exudyn.validation.diagnosis.worlds.classifier import learn
from sssi_exudyn.validation.diagnosis.worlds.drawn_worlds import Wanted, draw_worlds, known_of, observe
from sssi_exudyn.validation.diagnosis.worlds.features import Features
from sssi_exudyn.validation.diagnosis.worlds.geometry import geometry_of

EVEN: Final = replace(THRESHOLDS, natural=0.0)
CLEAR: Final = 8.0
"""Standard errors from which an effect is clear."""
NOTHING_SHARE: Final = 4
"""Draws with nothing hidden, for each of an effect."""
WEIGHERS: Final = ("tempered evidence", "evidence as it is", "worlds", "both", "best possible")
SHAPES: Final = 150
"""Further draws of each effect by which the best possible method knows its shapes."""
NOISIER: Final = 1.3
"""Variance of the worlds' noise on average over that of the levels which the evidence is computed with."""
SMALL: Final = 1e-4
"""Share of an effect by which its linear response is measured: a hundredth of a compaction moves the track by 0.6 m."""
LISTED: Final = (*PHYSICS, *SENSOR)

Row = tuple[str, float, float, str, float, bool, float]
"""What is hidden in a run and its strength; probabilities of nothing and of the best name; whether that is right; the
probability of the truth.
"""


@dataclass(frozen=True)
class Drawn:
    """Runs of one stretch: what is hidden in each, its strength, and each weigher's probabilities by name."""

    hidden: list[str]
    strength: Array
    weighed: dict[str, tuple[list[str], Array]]
    outside: Array
    seconds: float


def hidden_effects(fitted: FittedRun, draws: int, rng: np.random.Generator) -> tuple[list[str], Array]:
    """Return names (D,) of hidden effects and what they do to the measurements (N, D)."""
    plain, names, columns = plain_run(fitted.run), [NOTHING_MISSING] * (NOTHING_SHARE * draws), []
    turned = responses_of(BY_NAME[HeadingMisalignment.name].probes(fitted), fitted.prepared, fitted.measurements)
    for name, make in EFFECTS.items():
        for _ in range(draws):
            size = SIZES[int(rng.integers(len(SIZES)))] * float(rng.uniform(0.85, 1.15))
            effect = make(rng, SMALL * size, plain)
            model = replace(
                fitted.model,
                terms=(*fitted.model.terms, *effect.terms),
                sensors=(*fitted.model.sensors, *effect.sensors),
            )
            model = model.with_values({CLOCK_OFFSET: model.value(CLOCK_OFFSET) + effect.delay})
            try:
                moved = fitted.measurements.predict(model, simulate_reduced(model, fitted.prepared))
            except SimulationDiverged:
                continue
            names.append(name)
            columns.append((moved - fitted.prediction + effect.heading * turned[:, 0]) / SMALL)
    nothing = np.zeros((len(fitted.prediction), NOTHING_SHARE * draws))
    return names, np.column_stack([nothing, *columns])


def draw_and_weigh(folder: str, begin: float, long: float, seed: int, draws: int) -> Drawn:
    """Return hidden effects in a stretch of a recording, weighed in each way."""
    recording, motion = read_folder(Path(folder), SILENT)
    first = motion.start + begin
    motion = replace(motion, start=first, stop=min(motion.stop, first + long))
    problem, state, fit = first_fit(diagnosis_problem(recording, motion, model_of(recording, motion)))
    fitted, linear = fitted_run(problem, state, fit), linear_model(problem, state, fit)
    responses = {h.name: responses_of(h.probes(fitted), fitted.prepared, fitted.measurements) for h in HYPOTHESES}
    waves = 0.0 if problem.ground is None else problem.ground.amplitude * state.levels.surface
    geometry = geometry_of(linear, state.levels, fitted, HYPOTHESES, responses, waves)
    known, rng = known_of(geometry), np.random.default_rng(seed)
    hidden, moved = hidden_effects(fitted, draws, rng)
    worlds = observe(geometry, known, np.zeros(len(hidden), dtype=int), moved, rng)
    begun = time.process_time()
    features = Features(geometry, known, EVEN)
    answers = answers_of(geometry, HYPOTHESES, EVEN)
    examples = draw_worlds(
        geometry, known, answers, THRESHOLDS.worlds, np.random.default_rng(1), Wanted(features, THRESHOLDS.world_same)
    )
    counted = np.bincount(examples.labels, minlength=len(answers)) / examples.tried
    classifier = learn(features(examples.rest), examples.labels, counted * [a.prior for a in answers], 1)
    seconds = time.process_time() - begun
    table, evidence = features(worlds.rest), features.evidence(worlds.rest)
    by_worlds = [answer.name for answer in answers], classifier.probabilities(table)
    names, tempered, plain = _by_evidence(evidence)
    shapes, moves = hidden_effects(fitted, SHAPES, np.random.default_rng([seed, 1]))
    ceiling = best_possible(shapes, whiten_columns(linear, state.levels, moves), known, worlds.rest, answers)
    ways = (names, tempered), (names, plain), by_worlds, _by_both((names, tempered), by_worlds), ceiling
    weighed = dict(zip(WEIGHERS, ways, strict=True))
    return Drawn(hidden, worlds.strength, weighed, classifier.outside(table), seconds)


def best_possible(
    hidden: Sequence[str], moved: Array, known: Uncertain, rest: Array, answers: Sequence[Answer]
) -> tuple[list[str], Array]:
    """Return names and (D, names) probabilities of runs with ``rest`` (N, D), by Bayes' rule on effects whose names
    (J,) are ``hidden`` and which do ``moved`` (N, J), in units of noise.

    These are other draws of the same effects: what a method could say that knew their shapes and sizes.
    """
    priors = {answer.name: answer.prior for answer in answers}
    names = [NOTHING_MISSING, *LISTED, NOT_IN_THE_LIST]
    pull, strength = moved.T @ rest / NOISIER, np.sum(moved * known.remove_from(moved), axis=0)[:, None] / NOISIER
    logs = log_shape_factors(pull, strength)
    called = np.array([NOT_IN_THE_LIST if name in UNKNOWN else name for name in hidden])
    columns = [np.zeros(rest.shape[1])]
    for name in names[1:]:
        mine = logs[called == name]
        columns.append(logsumexp(mine, axis=0) - np.log(len(mine)) if len(mine) else np.full(rest.shape[1], -np.inf))
    with np.errstate(divide="ignore"):
        weighed = np.stack(columns, axis=1) + np.log([priors.get(name, 0.0) for name in names])
    return names, np.asarray(softmax(weighed, axis=1))


def _by_evidence(evidence: dict[str, Array]) -> tuple[list[str], Array, Array]:
    """Return names and (D, names) probabilities by the diagnosis' own weighing, and by evidence without temper."""
    laws = [h.name for h in HYPOTHESES if h.name in evidence]
    values = {name: evidence[name] for name in laws}
    memories = [f"{memory:g} s" for memory in THRESHOLDS.force_memories]
    every = [evidence[f"any {memory}"] for memory in memories]
    alone = [evidence[f"{way} {memory}"] for way in DIRECTIONS for memory in memories]
    means = [np.logaddexp.reduce(some, axis=0) - np.log(len(some)) for some in (every, alone)]
    free_form = np.logaddexp(*means) - np.log(2.0)
    latent = laws[-1]
    values[latent] = np.logaddexp(values[latent], free_form)
    weights = np.array([BY_NAME[name].weight for name in laws])
    as_is = replace(THRESHOLDS, temper=1.0)
    columns = np.stack([values[name] for name in laws], axis=1)
    tempered, plain = (
        np.array([probabilities(0.0, row, weights, thresholds) for row in columns])
        for thresholds in (THRESHOLDS, as_is)
    )
    return [NOTHING_MISSING, *laws], tempered, plain


def _by_both(tempered: tuple[list[str], Array], by_worlds: tuple[list[str], Array]) -> tuple[list[str], Array]:
    """Return names and (D, names) probabilities as ``worlds.weigh`` makes them of both, what has no cause as one."""
    names = [name for name in by_worlds[0] if name != TWO_AT_ONCE]
    of_fits, of_worlds = (np.zeros((len(table), len(names))) for _, table in (tempered, by_worlds))
    for name, column in zip(tempered[0], tempered[1].T, strict=True):
        unknown = name in BY_NAME and BY_NAME[name].kind == "unexplained"
        of_fits[:, names.index(NOT_IN_THE_LIST if unknown else name)] += column
    laws = np.array([name not in {NOTHING_MISSING, NOT_IN_THE_LIST} for name in names])
    share = np.where(laws, of_fits, 0.0)
    share /= share.sum(axis=1, keepdims=True)
    for name, column in zip(by_worlds[0], by_worlds[1].T, strict=True):
        of_worlds += share * column[:, None] if name == TWO_AT_ONCE else 0.0
        if name != TWO_AT_ONCE:
            of_worlds[:, names.index(name)] += column
    return names, 0.5 * (of_fits + of_worlds)


def answer_of(hidden: str, names: Sequence[str]) -> list[int]:
    """Return which of ``names`` are right for what is hidden."""
    if hidden in UNKNOWN:
        unknown = {h.name for h in HYPOTHESES if h.kind == "unexplained"} | {NOT_IN_THE_LIST}
        return [i for i, name in enumerate(names) if name in unknown]
    return [i for i, name in enumerate(names) if name == hidden]


def figures(runs: Sequence[Drawn], weigher: str) -> dict[str, float]:
    """Return the figures of a weigher over the runs of all stretches."""
    rows: list[Row] = []
    for run in runs:
        names, table = run.weighed[weigher]
        unknown = answer_of(next(iter(UNKNOWN)), names)
        for hidden, strength, p in zip(run.hidden, run.strength, table, strict=True):
            together = {name: float(p[i]) for i, name in enumerate(names) if i not in unknown}
            together[NOT_IN_THE_LIST] = float(p[unknown].sum())
            nothing = together.pop(NOTHING_MISSING)
            best = max(together, key=lambda name: together[name])
            true = NOT_IN_THE_LIST if hidden in UNKNOWN else hidden
            p_true = nothing if hidden == NOTHING_MISSING else together.get(true, 0.0)
            rows.append((hidden, float(strength), nothing, best, together[best], best == true, p_true))

    def share(of: Callable[[Row], bool], among: Callable[[Row], bool]) -> float:
        chosen = [of(row) for row in rows if among(row)]
        return round(float(np.mean(chosen)), 3) if chosen else float("nan")

    def is_found(row: Row) -> bool:
        return bool(row[2] <= THRESHOLDS.stands_out)

    def clear(names: Sequence[str]) -> Callable[[Row], bool]:
        return lambda row: row[0] in names and row[1] >= CLEAR

    def said(row: Row) -> bool:
        return is_found(row) and row[4] > THRESHOLDS.sure

    def something(row: Row) -> bool:
        return bool(row[0] != NOTHING_MISSING)

    return {
        "nothing hidden, found": share(is_found, lambda row: row[0] == NOTHING_MISSING),
        "clear listed": sum(clear(LISTED)(row) for row in rows),
        "found and right first": share(lambda row: is_found(row) and row[5], clear(LISTED)),
        "of physics": share(lambda row: is_found(row) and row[5], clear(tuple(PHYSICS))),
        "said > 0.8": sum(said(row) for row in rows),
        "of these wrong": share(lambda row: not row[5], said),
        "clear unlisted": sum(clear(tuple(UNKNOWN))(row) for row in rows),
        "found and called so": share(lambda row: is_found(row) and row[5], clear(tuple(UNKNOWN))),
        "any strength: found": share(is_found, something),
        "log score": round(float(np.mean([np.log(max(row[6], 1e-6)) for row in rows])), 3),
        "two at once, most probable": share(lambda row: row[3] == TWO_AT_ONCE, something),
    }


@with_one_thread_for_products
def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("stretches", nargs="+")
    parser.add_argument("--seed", type=int, default=48001)
    parser.add_argument("--draws", type=int, default=12)
    parser.add_argument("--json", type=Path)
    chosen = parser.parse_args()
    runs = []
    for stretch in chosen.stretches:
        folder, begin, long = stretch.split(":")
        runs.append(draw_and_weigh(folder, float(begin), float(long), chosen.seed, chosen.draws))
        run = runs[-1]
        print(f"{stretch}: {len(run.hidden)} runs, learned in {run.seconds:.0f} s of computing, outside the worlds: "
              f"{np.mean(run.outside < THRESHOLDS.world_outside):.3f}", flush=True)  # fmt: skip
    result = {weigher: figures(runs, weigher) for weigher in WEIGHERS}
    for name in result[WEIGHERS[0]]:
        print(f"{name:28}", *(f"{weigher}: {result[weigher][name]:8}" for weigher in WEIGHERS))
    for name in EFFECTS:
        cells = []
        for weigher in WEIGHERS:
            counts: dict[str, int] = {}
            for run in runs:
                names, table = run.weighed[weigher]
                for hidden, strength, p in zip(run.hidden, run.strength, table, strict=True):
                    if hidden == name and strength >= CLEAR:
                        best = names[1 + int(np.argmax(p[1:]))] if p[0] <= THRESHOLDS.stands_out else "-"
                        counts[best] = counts.get(best, 0) + 1
            cells.append(", ".join(f"{k} {v}" for k, v in sorted(counts.items(), key=lambda item: -item[1])[:3]))
        print(f"{name:26} " + "  |  ".join(cells[i] for i in (0, 2, 3, 4)))
    if chosen.json:
        chosen.json.write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
