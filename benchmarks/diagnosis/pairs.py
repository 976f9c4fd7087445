"""Are both of two effects named: where laws are compared one after the other, two together, and at best.

    python benchmarks/diagnosis/pairs.py examples/beginner:0:6.5 examples/intermediate:2:6.5 [--seed 50801] [--draws 10]

Runs are linear, as those of ``worlds.py``.  Two effects of the benchmark act, of its two larger strengths: its four
pairs and as many others.  All ways have the same evidence of exact laws, of a force of any form and of that force next
to a law.  "One after the other" takes the most probable cause first and looks for a second one next to it, as a
diagnosis does.  "Together" gives each law what all pairs with it have.  "Best possible" is Bayes' rule on other draws
of the same effects, single and in pairs.  Single effects show what each way says too much.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from itertools import combinations
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp, softmax
from worlds import CLEAR, EVEN, LISTED, NOISIER, SHAPES, Stretch, command_line, fit_stretch, hidden_effects, moved_by

from sssi_exudyn.core.frames import Array
from sssi_exudyn.fitting.evidence import Information, usual_columns
from sssi_exudyn.runtime.threads import with_one_thread_for_products
from sssi_exudyn.validation.benchmark.cases import PAIRS
from sssi_exudyn.validation.benchmark.effects import PHYSICS, SIZES, UNKNOWN
from sssi_exudyn.validation.diagnosis.diagnosis_data import NOTHING_MISSING
from sssi_exudyn.validation.diagnosis.hypotheses.catalogue import BY_NAME, HYPOTHESES, LATENT_FORCE
from sssi_exudyn.validation.diagnosis.search.missing_force import latent_covariance
from sssi_exudyn.validation.diagnosis.thresholds import THRESHOLDS
from sssi_exudyn.validation.diagnosis.worlds.best_possible import SPREAD, log_shape_factors
from sssi_exudyn.validation.diagnosis.worlds.catalogue import NOT_IN_THE_LIST, TWO_AT_ONCE, answers_of
from sssi_exudyn.validation.diagnosis.worlds.drawn_worlds import observe

SEEN: Final = 5.0
"""Standard errors next to the other from which an effect of a pair is to be seen."""
ANY: Final = "a force of any form"
FIRST_SIZES: Final = (0.7, 1.6)
"""Usual sizes of the first of two laws; the second has those of the diagnosis."""
OTHERS: Final = "other pairs"
WAYS: Final = ("one after the other", "together", "best possible")

Causes = tuple[str, ...]
"""One cause or two."""


@dataclass(frozen=True)
class Run:
    """What is hidden in a run, its strength, and what each way names; a pair is as strong as the weaker next to the
    other.
    """

    hidden: Causes
    strength: float
    named: dict[str, dict[str, float]]

    @property
    def truth(self) -> set[str]:
        """Return the names that are right; none where nothing is hidden."""
        return {NOT_IN_THE_LIST if name in UNKNOWN else name for name in self.hidden} - {NOTHING_MISSING}

    @property
    def kind(self) -> str | None:
        """In words what is hidden; None where it is too weak."""
        if self.hidden in PAIRS:
            return " + ".join(self.hidden) if self.strength >= SEEN else None
        if len(self.hidden) > 1:
            return OTHERS if self.strength >= SEEN else None
        (name,) = self.hidden
        if name == NOTHING_MISSING:
            return "nothing hidden"
        kind = "no list" if name in UNKNOWN else "physics" if name in PHYSICS else "instruments"
        return f"one effect, {kind}" if self.strength >= CLEAR else None


@dataclass(frozen=True)
class Evidence:
    """Log evidence (D,) over nothing of each law, of two laws, of a force of any form, and of that next to a law."""

    one: Mapping[str, Array]
    two: Mapping[Causes, Array]
    any_form: Array
    next_to_any: Mapping[str, Array]


def evidence_of(stretch: Stretch, rest: Array) -> Evidence:
    """Return the evidence of runs whose measurements are ``rest`` (N, D), as worlds have them."""
    geometry, known = stretch.geometry, stretch.known
    names = [h.name for h in HYPOTHESES if h.name in geometry.candidates and h is not LATENT_FORCE]
    blocks = {name: usual_columns([candidate.free for candidate in geometry.candidates[name]]) for name in names}
    white = stretch.white(np.hstack([some.reshape(len(some), -1) for some in blocks.values()]))
    left = known.remove_from(white)
    gram, pull = white.T @ left, white.T @ rest
    rows, first = {}, 0
    for name, some in blocks.items():
        shape = some.shape[1:]
        rows[name] = first + np.arange(np.prod(shape)).reshape(shape)
        first = rows[name].max() + 1

    def next_to(name: str, shared: Array, covariance: Array, rest_of_pull: Array) -> Array:
        mine = rows[name]
        known_here = gram[mine[:, :, None], mine[:, None, :]]
        gone = np.einsum("cwi,ij,cvj->cwv", shared[mine], covariance, shared[mine])
        return _mean_factor(known_here - gone, rest_of_pull[mine], THRESHOLDS.sizes)

    one = {
        name: _mean_factor(gram[r[:, :, None], r[:, None, :]], pull[r], THRESHOLDS.sizes) for name, r in rows.items()
    }
    two: dict[Causes, list[Array]] = {pair: [] for pair in combinations(sorted(names, key=lambda n: len(rows[n])), 2)}
    for name in names:
        partners = [pair for pair in two if pair[0] == name]
        for r in rows[name] if partners else ():
            for size in FIRST_SIZES:
                inside = gram[np.ix_(r, r)]
                covariance = np.asarray(np.linalg.inv(np.eye(len(r)) / size**2 + inside), dtype=np.float64)
                alone = _log_factor(size**2 * inside, size * pull[r])
                remaining = pull - gram[:, r] @ (covariance @ pull[r])
                for pair in partners:
                    two[pair].append(alone + next_to(pair[1], gram[:, r], covariance, remaining))
    newtons = stretch.white(geometry.by_body)
    any_form: list[Array] = []
    next_to_any: dict[str, list[Array]] = {name: [] for name in names}
    for weight, kept, size, memory in _forms(geometry.middles):
        covariance_before = latent_covariance(geometry.edges, size, memory, THRESHOLDS.cell)[np.ix_(kept, kept)]
        acting = newtons[:, kept] @ np.linalg.cholesky(covariance_before + 1e-9 * size**2 * np.eye(len(kept)))
        of_force = known.remove_from(acting)
        inside, pulled = acting.T @ of_force, acting.T @ rest
        covariance = np.asarray(np.linalg.inv(np.eye(len(inside)) + inside), dtype=np.float64)
        any_form.append(np.log(weight) + _log_factor(inside, pulled))
        shared = white.T @ of_force
        remaining = pull - shared @ (covariance @ pulled)
        for name in names:
            next_to_any[name].append(any_form[-1] + next_to(name, shared, covariance, remaining))
    return Evidence(
        one,
        {pair: logsumexp(some, axis=0) - np.log(len(some)) for pair, some in two.items()},
        logsumexp(any_form, axis=0),
        {name: logsumexp(some, axis=0) for name, some in next_to_any.items()},
    )


def _forms(middles: Array) -> list[tuple[float, NDArray[np.int_], float, float]]:
    """Return forms of a force: weight, its cells in all directions or in one, size and memory; either half of it."""
    cells, count = np.arange(3 * len(middles)), len(THRESHOLDS.force_sizes) * len(THRESHOLDS.force_memories)
    ways = [(0.5, cells), *((0.5 / 3.0, way) for way in cells.reshape(3, -1))]
    return [
        (weight / count, way, size, memory)
        for weight, way in ways
        for size in THRESHOLDS.force_sizes
        for memory in THRESHOLDS.force_memories
    ]


def _log_factor(known: Array, pull: Array) -> Array:
    """Return the log Bayes factor (D,) of amplitudes of usual size one."""
    inner = np.eye(len(known)) + known
    gain = 0.5 * np.sum(pull * np.linalg.solve(inner, pull), axis=0)
    return np.asarray(gain - 0.5 * np.linalg.slogdet(inner)[1])


def _mean_factor(gram: Array, pull: Array, sizes: Sequence[float]) -> Array:
    """Return the log Bayes factor (D,), averaged over candidates and sizes."""
    information = Information(gram)
    factors = information.log_factors(information.along(pull), sizes)
    return np.asarray(logsumexp(factors, axis=(0, 1)) - np.log(factors.shape[0] * factors.shape[1]))


def one_after_the_other(evidence: Evidence, run: int) -> dict[str, float]:
    """Return what is named, each with its probability: the most probable cause, and the most probable second one."""
    alone = {**evidence.one, ANY: evidence.any_form}
    first = _most_probable({name: float(of[run]) for name, of in alone.items()}, THRESHOLDS.stands_out)
    if first is None:
        return {}
    (name, _), base = first, float(alone[first[0]][run])
    of_pairs = evidence.next_to_any if name == ANY else _next_to(evidence, name)
    second = _most_probable(
        {other: float(of[run]) - base for other, of in of_pairs.items()}, THRESHOLDS.stands_out_again
    )
    return dict([first] if second is None else [first, second])


def _next_to(evidence: Evidence, name: str) -> dict[str, Array]:
    return {next(n for n in pair if n != name): of for pair, of in evidence.two.items() if name in pair}


def _most_probable(evidence: Mapping[str, float], allowed: float) -> tuple[str, float] | None:
    """Return the most probable cause with its probability; None where nothing is more probable than ``allowed``."""
    logs = [np.log(THRESHOLDS.nothing), *(_log_prior((name,)) + THRESHOLDS.temper * e for name, e in evidence.items())]
    nothing, *shares = softmax(logs)
    best = int(np.argmax(shares))
    return None if nothing > allowed else (list(evidence)[best], float(shares[best]))


def _weight(name: str) -> float:
    return 1.0 if name == ANY else BY_NAME[name].weight


def _log_prior(causes: Causes) -> float:
    """Return the log of how probable causes are beforehand: a pair as much as its laws' weights, ``world_pair`` once
    that of a law in all.
    """
    total = sum(hypothesis.weight for hypothesis in HYPOTHESES)
    shares = np.prod([_weight(name) / total for name in causes])
    return float(
        np.log((1.0 - THRESHOLDS.nothing) * shares * (2.0 * THRESHOLDS.world_pair if len(causes) > 1 else 1.0))
    )


def together(evidence: Evidence, run: int) -> dict[str, float]:
    """Return what is named with more than one half: what each law has alone, with any other, and with any form."""
    causes: dict[Causes, float] = {(name,): float(of[run]) for name, of in evidence.one.items()}
    causes |= {pair: float(of[run]) for pair, of in evidence.two.items()}
    causes |= {(ANY,): float(evidence.any_form[run])}
    causes |= {(ANY, name): float(of[run]) for name, of in evidence.next_to_any.items()}
    logs = [_log_prior(some) + THRESHOLDS.temper * e for some, e in causes.items()]
    nothing, *shares = softmax([np.log(THRESHOLDS.nothing), *logs])
    return {} if nothing > THRESHOLDS.stands_out else _named(dict(zip(causes, shares, strict=True)))


def _named(shares: Mapping[Causes, float]) -> dict[str, float]:
    """Return the causes with more than one half, of one cause or two each with its probability."""
    names = {name for some in shares for name in some}
    of = {name: float(sum(p for some, p in shares.items() if name in some)) for name in names}
    return {name: p for name, p in of.items() if p > 0.5}


def best_possible(stretch: Stretch, rest: Array, seed: int) -> list[dict[str, float]]:
    """Return what Bayes' rule names on other draws of all effects, single and in pairs, in each run of ``rest``."""
    hidden, moves = hidden_effects(stretch, SHAPES, np.random.default_rng(seed))
    white = stretch.white(moves)
    gram, pulls = white.T @ stretch.known.remove_from(white) / NOISIER, white.T @ rest / NOISIER
    strength, names = np.diag(gram), np.array(hidden)
    prior = {answer.name: answer.prior for answer in answers_of(stretch.geometry, HYPOTHESES, EVEN)}
    mine = {name: np.flatnonzero(names == name) for name in LISTED if name in prior}
    mine[NOT_IN_THE_LIST] = np.flatnonzero(np.isin(names, list(UNKNOWN)))
    pairs = list(combinations([name for name in mine if name != NOT_IN_THE_LIST], 2))
    prior_of_pair = np.log(prior[TWO_AT_ONCE] / len(pairs))
    named = []
    for pull in pulls.T:
        single = log_shape_factors(pull[:, None], strength[:, None])[:, 0]
        logs: dict[Causes, float] = {
            (name,): np.log(prior[name]) + _log_mean(single[some]) for name, some in mine.items()
        }
        for one, other in pairs:
            i, j = mine[one], mine[other]
            factors = _two_shapes(pull[i][:, None], pull[j], strength[i][:, None], strength[j], gram[np.ix_(i, j)])
            logs[one, other] = prior_of_pair + _log_mean(factors)
        nothing, *shares = softmax([np.log(prior[NOTHING_MISSING]), *logs.values()])
        some = dict(zip(logs, (float(share) for share in shares), strict=True))
        named.append({} if nothing > THRESHOLDS.stands_out else _named(some))
    return named


def _log_mean(logs: Array) -> float:
    return float(logsumexp(logs) - np.log(logs.size))


def _two_shapes(pull: Array, other_pull: Array, known: Array, other_known: Array, shared: Array) -> Array:
    """Return log Bayes factors of two shapes against none, both sizes integrated as in ``log_shape_factors``."""
    exact = pull + other_pull - 0.5 * (known + other_known + 2.0 * shared)
    left, other_left = pull - known - shared, other_pull - other_known - shared
    a, b = SPREAD**-2 + known, SPREAD**-2 + other_known
    determinant = a * b - shared**2
    gain = (left**2 * b + other_left**2 * a - 2.0 * left * other_left * shared) / determinant
    return np.asarray(exact + 0.5 * gain - 0.5 * np.log(SPREAD**4 * determinant))


def hidden_pairs(stretch: Stretch, draws: int, rng: np.random.Generator) -> tuple[list[Causes], Array, Array]:
    """Return pairs (D,), what they do to the measurements (N, D), and the standard errors (D,) of the weaker of both
    next to the other.
    """
    others = [pair for pair in combinations(LISTED, 2) if pair not in PAIRS and pair[::-1] not in PAIRS]
    chosen = [pair for pair in PAIRS for _ in range(draws)]
    chosen += [others[int(i)] for i in rng.permutation(len(others))[: draws * len(PAIRS)]]
    pairs: list[Causes] = []
    moves: list[Array] = []
    weaker: list[float] = []
    for pair in chosen:
        parts = [moved_by(stretch, name, SIZES[2:], 1, rng) for name in pair]
        if all(part.shape[1] for part in parts):
            moved = np.hstack(parts)
            white = stretch.white(moved)
            known = white.T @ stretch.known.remove_from(white)
            pairs.append(pair)
            moves.append(moved.sum(axis=1))
            weaker.append(float(np.sqrt(max(np.linalg.det(known), 0.0) / known.diagonal().max())))
    return pairs, np.stack(moves, axis=1), np.array(weaker)


def named_in(stretch: Stretch, seed: int, draws: int) -> list[Run]:
    """Return what is hidden in runs of a stretch, and what each way names."""
    rng = np.random.default_rng(seed)
    pairs, moved, weaker = hidden_pairs(stretch, draws, rng)
    single, moved_alone = hidden_effects(stretch, draws, rng)
    moved = np.hstack([moved, moved_alone])
    runs = observe(stretch.geometry, stretch.known, np.zeros(moved.shape[1], dtype=int), moved, rng)
    hidden: list[Causes] = [*pairs, *((name,) for name in single)]
    strength = np.concatenate([weaker, runs.strength[len(pairs) :]])
    evidence = evidence_of(stretch, runs.rest)
    best = best_possible(stretch, runs.rest[:, : len(pairs)], seed + 1)
    rows = []
    for i, (causes, strong) in enumerate(zip(hidden, strength.tolist(), strict=True)):
        ways = {WAYS[0]: one_after_the_other(evidence, i), WAYS[1]: together(evidence, i)}
        if i < len(best):
            ways[WAYS[2]] = best[i]
        rows.append(Run(causes, strong, ways))
    return rows


def print_figures(runs: Sequence[Run]) -> None:
    """Print how often each way names all that is hidden, at least one of it, and surely what is not there."""
    kinds: dict[str, list[Run]] = {"the benchmark's pairs": []}
    for run in runs:
        if run.kind is not None:
            kinds.setdefault(run.kind, []).append(run)
            kinds["the benchmark's pairs"] += [run] if run.hidden in PAIRS else []
    for kind, some in kinds.items():
        cells = []
        for way in WAYS:
            of = [(run.truth, _by_name(run.named[way])) for run in some if way in run.named]
            if of:
                every = np.mean([truth <= set(named) if truth else not named for truth, named in of])
                any_of = np.mean([bool(truth & set(named)) for truth, named in of])
                wrong = np.mean([any(_is_wrong(name, p, truth) for name, p in named.items()) for truth, named in of])
                cells.append(f"{way}: all {every:.2f}, one {any_of:.2f}, wrong {wrong:.2f}")
        print(f"{kind:32}{len(some):5} runs  " + " | ".join(cells))


def _by_name(named: Mapping[str, float]) -> dict[str, float]:
    """Return what is named, all that is in no list by one name."""
    unknown = {ANY, *(hypothesis.name for hypothesis in HYPOTHESES if hypothesis.kind == "unexplained")}
    return {NOT_IN_THE_LIST if name in unknown else name: p for name, p in named.items()}


def _is_wrong(name: str, probability: float, truth: set[str]) -> bool:
    """Tell whether a name of the list is sure and not what is hidden."""
    return probability > THRESHOLDS.sure and name in LISTED and name not in truth


@with_one_thread_for_products
def main() -> None:
    parser = command_line(__doc__, seed=50801, draws=10)
    chosen = parser.parse_args()
    runs: list[Run] = []
    for i, stretch in enumerate(chosen.stretches):
        runs += named_in(fit_stretch(stretch), chosen.seed + 10 * i, chosen.draws)
        print(f"{stretch}: {len(runs)} runs so far", flush=True)
    print_figures(runs)
    if chosen.json:
        chosen.json.write_text(json.dumps([asdict(run) for run in runs]) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
