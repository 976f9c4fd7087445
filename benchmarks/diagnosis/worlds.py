"""Names by a classifier that learned from worlds of a recording, by tempered evidence, and by both, on the same hidden
effects; next to them what the best possible method would say.

    python benchmarks/diagnosis/worlds.py examples/beginner:0:6.5 [--seed 48001] [--draws 12]

Each stretch (folder, seconds left out, seconds) is fitted by the reduced model.  Effects of the benchmark, none of
which has the law of its hypothesis, act in the fitted run at all four sizes.  What they do is linear, by a ten
thousandth of each, since about an estimate of its own friction has taken up most of an effect.  Errors of the posture,
the snow and the instruments are linear, too, with noise.  Nothing of these effects was in the training.  No slope has a
roll of its own here.  The diagnosis itself refits and estimates again, which is not done here.

As in a diagnosis a run is weighed among worlds in which about as much is hidden as it shows; runs that show nearly the
same share these.  Clear effects that are in no list are weighed by worlds without the families like theirs, too.
"""

from __future__ import annotations

import argparse
import json
import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray
from scipy.special import logsumexp, softmax

from sssi_exudyn.commands.recordings import SILENT, read_folder
from sssi_exudyn.core.errors import SimulationDiverged
from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.number_ref import CLOCK_OFFSET
from sssi_exudyn.fitting.evidence import Uncertain, whiten_columns
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.runtime.threads import with_one_thread_for_products
from sssi_exudyn.simulation.reduced.run import simulate_reduced
from sssi_exudyn.validation.benchmark.effects import (
    EFFECTS,
    PHYSICS,
    SENSOR,
    SIZES,
    UNKNOWN,
    Effect,
    PlainRun,
    plain_run,
)
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
from sssi_exudyn.validation.diagnosis.worlds.catalogue import (
    NOT_IN_THE_LIST,
    TWO_AT_ONCE,
    UNLISTED,
    Answer,
    answers_of,
)
from sssi_exudyn.validation.diagnosis.worlds.drawn_worlds import Wanted, Worlds, draw_worlds, known_of, observe
from sssi_exudyn.validation.diagnosis.worlds.features import Features
from sssi_exudyn.validation.diagnosis.worlds.geometry import Geometry, geometry_of
from sssi_exudyn.validation.diagnosis.worlds.judge import learn_answers, shown_strengths, strengths_about

EVEN: Final = replace(THRESHOLDS, natural=0.0)
CLEAR: Final = 8.0
"""Standard errors from which an effect is clear."""
NAMEABLE: Final = 4.0
"""Standard errors that no other law takes away, from which a clear effect can be told from all others."""
NOTHING_SHARE: Final = 4
"""Draws with nothing hidden, for each of an effect."""
WEIGHERS: Final = ("tempered evidence", "evidence as it is", "worlds", "both", "best possible")
SHOWN: Final = (0.0, 2.0, 4.0, 6.0, 8.0, 12.0, 20.0, 40.0, np.inf)
"""Standard errors between which runs share their worlds."""
SHAPES: Final = 150
"""Further draws of each effect by which the best possible method knows its shapes."""
NOISIER: Final = 1.3
"""Variance of the worlds' noise on average over that of the levels which the evidence is computed with."""
SMALL: Final = 1e-4
"""Share of an effect by which its linear response is measured: a hundredth of a compaction moves the track by 0.6 m.
Half of it is measured, too, and takes the second order away: on a hill that was 43 standard errors of a compaction
of 14.
"""
LISTED: Final = (*PHYSICS, *SENSOR)
COUSINS: Final = {
    "external_push": {"Pulse", "WanderingForce"},
    "one_ski_slow": {"OneSki", "unexplained_friction", "unexplained_drag"},
    "edge_bite": {"OneSki", "unexplained_friction", "unexplained_drag"},
    "warming_snow": {"CourseOfFriction", "PowerOfSpeed"},
    "ruts": {"AlternatingForce", "CourseOfFriction"},
}
"""Families, and hypotheses without a cause, that are like an effect of no list."""
REPEATS: Final = 2000
"""Draws of stretches for an interval."""


class Row(NamedTuple):
    """What a weigher says of a run.

    hidden, standard_errors : what is, and how strong it is
    apart : standard errors that no other law of the list takes away
    p_nothing, p_best, p_truth : probability of nothing missing, of the ``best_name`` and of the truth
    right : whether the best name is
    """

    hidden: str
    standard_errors: float
    apart: float
    p_nothing: float
    best_name: str
    p_best: float
    right: bool
    p_truth: float


Named = tuple[list[str], Array]
"""Names, and the probabilities (D, names) of runs."""


@dataclass(frozen=True)
class Stretch:
    """A part of a recording, fitted and linearised."""

    fitted: FittedRun
    geometry: Geometry
    known: Uncertain

    @cached_property
    def plain(self) -> PlainRun:
        """The run, as makers of effects need it."""
        return plain_run(self.fitted.run)

    @cached_property
    def turned(self) -> Array:
        """(N,) what a capture turned by a radian does to the measurements."""
        probes = BY_NAME[HeadingMisalignment.name].probes(self.fitted)
        return responses_of(probes, self.fitted.prepared, self.fitted.measurements)[:, 0]

    def white(self, moved: Array) -> Array:
        """Return what is ``moved`` (N, D) in units of noise."""
        return whiten_columns(self.geometry.linear, self.geometry.levels, moved)


@dataclass(frozen=True)
class Drawn:
    """Runs of one stretch: what is hidden in each, its strength, and each weigher's probabilities by name.

    apart : (D,) standard errors that no other law of the list takes away
    left_out : which runs were weighed by worlds without the families like theirs, too, and their probabilities
    """

    hidden: list[str]
    strength: Array
    apart: Array
    weighed: dict[str, Named]
    left_out: tuple[NDArray[np.int_], Named]
    outside: Array
    seconds: float


def fit_stretch(stretch: str) -> Stretch:
    """Fit a stretch, FOLDER:SECONDS_LEFT_OUT:SECONDS, by the reduced model."""
    folder, begin, long = stretch.split(":")
    recording, motion = read_folder(Path(folder), SILENT)
    first = motion.start + float(begin)
    motion = replace(motion, start=first, stop=min(motion.stop, first + float(long)))
    problem, state, fit = first_fit(diagnosis_problem(recording, motion, model_of(recording, motion)))
    fitted, linear = fitted_run(problem, state, fit), linear_model(problem, state, fit)
    responses = {h.name: responses_of(h.probes(fitted), fitted.prepared, fitted.measurements) for h in HYPOTHESES}
    waves = 0.0 if problem.ground is None else problem.ground.amplitude * state.levels.surface
    geometry = geometry_of(linear, state.levels, fitted, HYPOTHESES, responses, waves)
    return Stretch(fitted, geometry, known_of(geometry))


def moved_by(stretch: Stretch, name: str, sizes: Sequence[float], draws: int, rng: np.random.Generator) -> Array:
    """Return what ``draws`` of an effect, each of one of ``sizes``, do to the measurements, (N, at most draws): those
    that cannot be simulated are left out.
    """
    columns = [np.zeros((len(stretch.fitted.prediction), 0))]
    for _ in range(draws):
        size = sizes[int(rng.integers(len(sizes)))] * float(rng.uniform(0.85, 1.15))
        same = deepcopy(rng)
        whole, half = (
            EFFECTS[name](rng, SMALL * size, stretch.plain),
            EFFECTS[name](same, 0.5 * SMALL * size, stretch.plain),
        )
        try:
            columns.append((4.0 * _moved_by(stretch, half) - _moved_by(stretch, whole))[:, None] / SMALL)
        except SimulationDiverged:
            continue
    return np.hstack(columns)


def _moved_by(stretch: Stretch, effect: Effect) -> Array:
    """Return what an effect does to the measurements, (N,).  Raises SimulationDiverged when the run with it does."""
    fitted = stretch.fitted
    model = replace(
        fitted.model, terms=(*fitted.model.terms, *effect.terms), sensors=(*fitted.model.sensors, *effect.sensors)
    )
    model = model.with_values({CLOCK_OFFSET: model.value(CLOCK_OFFSET) + effect.delay})
    moved = fitted.measurements.predict(model, simulate_reduced(model, fitted.prepared))
    return np.asarray(moved - fitted.prediction + effect.heading * stretch.turned)


def hidden_effects(stretch: Stretch, draws: int, rng: np.random.Generator) -> tuple[list[str], Array]:
    """Return names (D,) of hidden effects and what they do to the measurements (N, D)."""
    nothing = NOTHING_SHARE * draws
    names, columns = [NOTHING_MISSING] * nothing, [np.zeros((len(stretch.fitted.prediction), nothing))]
    for name in EFFECTS:
        columns.append(moved_by(stretch, name, SIZES, draws, rng))
        names += [name] * columns[-1].shape[1]
    return names, np.hstack(columns)


def drawn_runs(stretch: Stretch, seed: int, draws: int) -> tuple[list[str], Worlds]:
    """Return names (D,) of hidden effects, and the runs that have them."""
    rng = np.random.default_rng(seed)
    hidden, moved = hidden_effects(stretch, draws, rng)
    return hidden, observe(stretch.geometry, stretch.known, np.zeros(len(hidden), dtype=int), moved, rng)


def draw_and_weigh(stretch: Stretch, seed: int, draws: int) -> Drawn:
    """Return hidden effects in a stretch of a recording, weighed in each way."""
    geometry, known = stretch.geometry, stretch.known
    hidden, worlds = drawn_runs(stretch, seed, draws)
    begun = time.process_time()
    features = Features(geometry, known, EVEN)
    evidence, table, shown = (
        features.evidence(worlds.rest),
        features(worlds.rest),
        shown_strengths(features, worlds.rest),
    )
    answers = answers_of(geometry, HYPOTHESES, EVEN)
    names = [answer.name for answer in answers]
    by_worlds, outside = np.zeros((len(hidden), len(answers))), np.zeros(len(hidden))
    for low, high in pairwise(SHOWN):
        mine = np.flatnonzero((shown >= low) & (shown < high))
        if len(mine):
            by_worlds[mine], outside[mine] = _by_worlds(stretch, features, answers, table[mine], shown[mine])
    seconds = time.process_time() - begun
    fits, tempered, plain = _by_evidence(evidence)
    shapes, moves = hidden_effects(stretch, SHAPES, np.random.default_rng([seed, 1]))
    ceiling = best_possible(shapes, stretch.white(moves), known, worlds.rest, answers)
    ways = (fits, tempered), (fits, plain), (names, by_worlds), _by_both((fits, tempered), (names, by_worlds)), ceiling
    clear = np.flatnonzero([name in UNKNOWN and s >= CLEAR for name, s in zip(hidden, worlds.strength, strict=True)])
    left_out = _by_strangers(stretch, features, hidden, clear, table, shown)
    both = _by_both((fits, tempered[clear]), left_out)
    by_name = dict(zip(WEIGHERS, ways, strict=True))
    apart = apart_from_others(hidden, worlds.strength, known.remove_from(worlds.moved), features)
    return Drawn(hidden, worlds.strength, apart, by_name, (clear, both), outside, seconds)


def apart_from_others(hidden: Sequence[str], strength: Array, left: Array, features: Features) -> Array:
    """Return (D,) how many standard errors of what is ``hidden`` no other law of the list takes away, with the place
    and the size that do most; it leaves ``left`` (N, D) next to all that is uncertain.
    """
    apart = np.zeros(len(hidden))
    for name in set(hidden):
        mine = np.flatnonzero([other == name for other in hidden])
        taken = features.explained(left[:, mine], name)
        apart[mine] = np.sqrt(np.maximum(strength[mine] ** 2 - taken, 0.0))
    return apart


def _by_worlds(
    stretch: Stretch, features: Features, answers: Sequence[Answer], table: Array, shown: Array
) -> tuple[Array, Array]:
    """Return probabilities (D, answers) of runs by worlds as strong as what these show (D,), and the shares (D,) of
    worlds that are as far from the middle of their kind.
    """
    wanted = Wanted(features, THRESHOLDS.world_same, strengths_about(shown))
    rng = np.random.default_rng(1)
    examples = draw_worlds(stretch.geometry, stretch.known, answers, THRESHOLDS.worlds, rng, wanted)
    priors = np.array([answer.prior for answer in answers])
    learned, classifier = learn_answers(
        features(examples.rest), examples.labels, examples.tried.astype(float), priors, 1
    )
    weighed = np.zeros((len(table), len(answers)))
    weighed[:, learned] = classifier.probabilities(table)
    return weighed, classifier.outside(table)


def _by_strangers(
    stretch: Stretch,
    features: Features,
    hidden: Sequence[str],
    clear: NDArray[np.int_],
    table: Array,
    shown: Array,
) -> Named:
    """Return names and probabilities of ``clear`` runs of no list by worlds without the families like theirs."""
    names = [answer.name for answer in answers_of(stretch.geometry, HYPOTHESES, EVEN)]
    rows: dict[int, Array] = {}
    for kept_away in {frozenset(COUSINS[hidden[i]]) for i in clear}:
        unlisted = [family for family in UNLISTED if type(family).__name__ not in kept_away]
        hypotheses = [hypothesis for hypothesis in HYPOTHESES if hypothesis.name not in kept_away]
        answers = answers_of(stretch.geometry, hypotheses, EVEN, unlisted)
        for low, high in pairwise(SHOWN):
            mine = [int(i) for i in clear if frozenset(COUSINS[hidden[i]]) == kept_away and low <= shown[i] < high]
            if mine:
                weighed = _by_worlds(stretch, features, answers, table[mine], shown[mine])[0]
                rows |= dict(zip(mine, weighed, strict=True))
    return names, np.array([rows[int(i)] for i in clear]).reshape(len(clear), len(names))


def best_possible(
    hidden: Sequence[str], moved: Array, known: Uncertain, rest: Array, answers: Sequence[Answer]
) -> Named:
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


def _by_evidence(evidence: Mapping[str, Array]) -> tuple[list[str], Array, Array]:
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


def _by_both(tempered: Named, by_worlds: Named) -> Named:
    """Return names and (D, names) probabilities as ``worlds.weigh`` makes them of both, what has no cause as one."""
    names = [name for name in by_worlds[0] if name != TWO_AT_ONCE]
    of_fits, of_worlds = (np.zeros((len(table), len(names))) for _, table in (tempered, by_worlds))
    for name, column in zip(tempered[0], tempered[1].T, strict=True):
        unknown = name in BY_NAME and BY_NAME[name].kind == "unexplained"
        of_fits[:, names.index(NOT_IN_THE_LIST if unknown else name)] += column
    laws = np.array([name not in {NOTHING_MISSING, NOT_IN_THE_LIST} for name in names])
    share = np.where(laws, of_fits, 0.0)
    share[share.sum(axis=1) == 0.0] = laws  # where the fits have none of them, all alike
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


def rows_of(hidden: Sequence[str], strength: Array, apart: Array, weighed: Named) -> list[Row]:
    """Return a row for each run, what has no cause as one name."""
    names, table = weighed
    unknown, rows = answer_of(next(iter(UNKNOWN)), names), []
    for name, strong, away, p in zip(hidden, strength.tolist(), apart.tolist(), table, strict=True):
        together = {other: float(p[i]) for i, other in enumerate(names) if i not in unknown}
        together[NOT_IN_THE_LIST] = float(p[unknown].sum())
        nothing = together.pop(NOTHING_MISSING)
        best = max(together, key=lambda other: together[other])
        true = NOT_IN_THE_LIST if name in UNKNOWN else name
        p_true = nothing if name == NOTHING_MISSING else together.get(true, 0.0)
        rows.append(Row(name, strong, away, nothing, best, together[best], best == true, p_true))
    return rows


def is_found(row: Row) -> bool:
    """Tell whether a run has a finding."""
    return bool(row.p_nothing <= THRESHOLDS.stands_out)


def _is_clear(names: Sequence[str]) -> Callable[[Row], bool]:
    return lambda row: row.hidden in names and row.standard_errors >= CLEAR


def _is_nameable(names: Sequence[str]) -> Callable[[Row], bool]:
    return lambda row: row.hidden in names and row.standard_errors >= CLEAR and row.apart >= NAMEABLE


def _is_sure(row: Row) -> bool:
    return is_found(row) and row.p_best > THRESHOLDS.sure


def _is_null(row: Row) -> bool:
    return row.hidden == NOTHING_MISSING


def _is_right(row: Row) -> bool:
    return is_found(row) and row.right


def _log_score(row: Row) -> float:
    return float(np.log(max(row.p_truth, 1e-6)))


FIGURES: Final[dict[str, tuple[Callable[[Row], float], Callable[[Row], bool]]]] = {
    "nothing hidden, found": (is_found, _is_null),
    "nothing hidden, cannot tell": (lambda row: not is_found(row) and row.p_nothing < THRESHOLDS.likely, _is_null),
    "clear listed, right first": (_is_right, _is_clear(LISTED)),
    "of physics": (_is_right, _is_clear(tuple(PHYSICS))),
    "nameable listed, right first": (_is_right, _is_nameable(LISTED)),
    "nameable physics": (_is_right, _is_nameable(tuple(PHYSICS))),
    "said > 0.8, wrong": (lambda row: not row.right, _is_sure),
    "clear unlisted, called so": (_is_right, _is_clear(tuple(UNKNOWN))),
    "any strength, found": (is_found, lambda row: not _is_null(row)),
    "log score": (_log_score, lambda row: True),
    "log score of clear": (_log_score, _is_clear(tuple(EFFECTS))),
}
"""Each figure's mean of what, among which runs."""


def figures(by_stretch: Sequence[Sequence[Row]]) -> dict[str, dict[str, float]]:
    """Return each figure over the runs of all stretches: how many runs, the mean, and the 95 % interval of means over
    stretches drawn again.
    """
    rng, result = np.random.default_rng(0), {}
    for name, (of, among) in FIGURES.items():
        counted = [[float(of(row)) for row in rows if among(row)] for rows in by_stretch]
        count, total = np.array([len(some) for some in counted]), np.array([sum(some) for some in counted])
        drawn = rng.integers(len(by_stretch), size=(REPEATS, len(by_stretch)))
        means = total[drawn].sum(axis=1) / np.maximum(count[drawn].sum(axis=1), 1)
        low, high = np.quantile(means, [0.025, 0.975])
        mean = total.sum() / max(count.sum(), 1)
        result[name] = {"runs": int(count.sum()), "mean": mean, "low": float(low), "high": float(high)}
    return result


def print_table(result: Mapping[str, Mapping[str, Mapping[str, float]]]) -> None:
    """Print each figure of each weigher, with the interval of both."""
    for name in FIGURES:
        cells = [f"{way}: {of[name]['mean']:.3f}" for way, of in result.items()]
        both = result["both"][name]
        print(f"{name:30}{both['runs']:6.0f} runs", *cells, f"(both: {both['low']:.3f} to {both['high']:.3f})")


def print_names(runs: Sequence[Drawn]) -> None:
    """Print what each clear effect is called."""
    for name in EFFECTS:
        cells = []
        for weigher in WEIGHERS:
            rows = [row for run in runs for row in rows_of(run.hidden, run.strength, run.apart, run.weighed[weigher])]
            clear = [
                row.best_name if is_found(row) else "-"
                for row in rows
                if row.hidden == name and row.standard_errors >= CLEAR
            ]
            cells.append(", ".join(f"{called} {count}" for called, count in Counter(clear).most_common()))
        print(f"{name:26} " + "  |  ".join(cells[i] for i in (0, 2, 3, 4)))


def command_line(about: str | None, *, seed: int, draws: int) -> argparse.ArgumentParser:
    """Return what a benchmark of stretches is asked: which, the seed, how many draws of an effect, and a file."""
    parser = argparse.ArgumentParser(description=about, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("stretches", nargs="+")
    parser.add_argument("--seed", type=int, default=seed)
    parser.add_argument("--draws", type=int, default=draws)
    parser.add_argument("--json", type=Path)
    return parser


@with_one_thread_for_products
def main() -> None:
    parser = command_line(__doc__, seed=48001, draws=12)
    parser.add_argument("--rows", type=Path, help="keep what each weigher says of each run, as Parquet")
    chosen = parser.parse_args()
    runs: list[Drawn] = []
    for i, stretch in enumerate(chosen.stretches):
        runs.append(draw_and_weigh(fit_stretch(stretch), chosen.seed + i, chosen.draws))
        run = runs[-1]
        print(f"{stretch}: {len(run.hidden)} runs, learned in {run.seconds:.0f} s of computing, outside the worlds: "
              f"{np.mean(run.outside < THRESHOLDS.world_outside):.3f}", flush=True)  # fmt: skip
    rows = {way: [rows_of(run.hidden, run.strength, run.apart, run.weighed[way]) for run in runs] for way in WEIGHERS}
    result = {way: figures(by_stretch) for way, by_stretch in rows.items()}
    print_table(result)
    strange = [
        rows_of([run.hidden[int(i)] for i in which], run.strength[which], run.apart[which], weighed)
        for run in runs
        for which, weighed in [run.left_out]
        if len(which)
    ]
    called = figures(strange)["clear unlisted, called so"]
    print(f"without the families like theirs, both: {called['mean']:.3f} of {called['runs']:.0f} clear unlisted "
          f"({called['low']:.3f} to {called['high']:.3f})")  # fmt: skip
    print_names(runs)
    if chosen.json:
        kept = {"figures": result, "left_out": called, "stretches": chosen.stretches, "rows": rows, "strange": strange}
        chosen.json.write_text(json.dumps(kept, indent=None) + "\n", encoding="utf-8")
    if chosen.rows:
        table = [
            {"stretch": Path(stretch).name, "seed": chosen.seed, "weigher": way, **row._asdict()}
            for way, by_stretch in rows.items()
            for stretch, some in zip(chosen.stretches, by_stretch, strict=True)
            for row in some
        ]
        pq.write_table(pa.Table.from_pylist(table), chosen.rows)


if __name__ == "__main__":
    main()
