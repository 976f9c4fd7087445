"""Laws that act on three runs of a day alike: their probabilities by each run alone and by all three together.

It also shows how often a law that is in no list is offered where there is one, and where there is none.

``python benchmarks/day.py [--seeds 1 2]`` prints a row a day, ten days a seed, and then a table by law; about two
minutes of computing a day.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from multiprocessing import get_context
from pathlib import Path

import numpy as np

from sssi_exudyn.contact.term import Term
from sssi_exudyn.contact.terms.friction_corrections import (
    EdgeDependentFriction,
    LoadDependentFriction,
    SpeedDependentFriction,
)
from sssi_exudyn.contact.terms.wind import DragArea, Wind
from sssi_exudyn.core.errors import SimulationDiverged
from sssi_exudyn.fitting.first_fit import fit_reduced, problem_of
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.motion.from_recording import motion_from_recording
from sssi_exudyn.recording.read import read_recording
from sssi_exudyn.runtime.threads import with_one_thread_for_products
from sssi_exudyn.simulation.reduced.prepared import prepare
from sssi_exudyn.validation.benchmark.cases import Recorded, record
from sssi_exudyn.validation.benchmark.concealed_terms import WorldEdgeAtSpeed, WorldMinimum, WorldPlace, WorldSlip
from sssi_exudyn.validation.benchmark.world import draw_instruments, other_day
from sssi_exudyn.validation.diagnosis.context import diagnosis_problem
from sssi_exudyn.validation.diagnosis.diagnose import separate_fit
from sssi_exudyn.validation.diagnosis.several_runs.friction_regression import FoundLaw, find_law
from sssi_exudyn.validation.diagnosis.several_runs.joint_fit import compare_for_day
from sssi_exudyn.validation.diagnosis.state import first_fit
from sssi_exudyn.validation.diagnosis.thresholds import THRESHOLDS

EXAMPLE = Path(__file__).parents[1] / "examples" / "intermediate"
_TERMS: tuple[Term, ...] = (
    DragArea(1.0),
    Wind(-5.0, 0.5),
    SpeedDependentFriction(0.012, 10.0),
    EdgeDependentFriction(0.2, 0.3),
    LoadDependentFriction(-0.06, 400.0),
)
_UNLISTED: tuple[Term, ...] = (
    WorldMinimum(0.04, 10.7, 1.0),
    WorldSlip(0.05, 0.06),
    WorldEdgeAtSpeed(0.15, 10.7, 0.6),
    WorldPlace(0.05, 85.0, 20.0),
)
"""Changes of mu_t as large as those of the list's laws: 0.02, where these have 0.01 to 0.05."""
LISTED: dict[str, tuple[Term, ...]] = {"nothing": (), **{term.name: (term,) for term in _TERMS}}
LAWS: dict[str, tuple[Term, ...]] = {**LISTED, **{term.name: (term,) for term in _UNLISTED}}
RUNS, LONG = 3, 6.0


def runs_of(law: str, seed: int) -> list[Recorded]:
    """Make stretches of the intermediate's run (s) on one snow, recorded by the benchmark's world."""
    recording = read_recording(EXAMPLE)
    motion = motion_from_recording(recording)
    problem = problem_of(recording, motion, model_of(recording, motion), "joint")
    fitted = problem.model_at(fit_reduced(problem, prepare(problem.model, motion)).values)
    rng = np.random.default_rng([seed, 77])
    runs: list[Recorded] = []
    snow = instruments = None
    while len(runs) < RUNS:
        begin = float(rng.uniform(motion.start, motion.stop - LONG))
        stretch = replace(motion, start=begin, stop=begin + LONG)
        drawn, _ = other_day(rng, recording, stretch, fitted)
        snow, instruments = snow or drawn, instruments or draw_instruments(rng, stretch)
        world = replace(snow, start=drawn.start, surface=drawn.surface, terms=(*snow.terms, *LAWS[law]))
        skied = replace(stretch, inclination=snow.inclination)
        own = replace(instruments, lost=None)
        try:
            runs.append(record(rng, (recording, stretch, fitted), skied, world, own, 0.0, 0.0))
        except SimulationDiverged:
            continue  # it begins in the air: another stretch
    return runs


@dataclass(frozen=True)
class Answer:
    """Result of a day.

    It holds the law's probability by each run alone, were it in the list, all explanations by all runs together, and
    the law that is in no list.
    """

    law: str
    seed: int
    alone: tuple[float, ...]
    together: tuple[tuple[str, float], ...]
    unlisted: FoundLaw

    @property
    def row(self) -> str:
        listed = ", ".join(f"{name} {probability:.2f}" for name, probability in self.together if probability > 0.05)
        offer = f"{'offered' if self.unlisted.offered else 'not offered'}, {', '.join(self.unlisted.products)}"
        apart = f"{self.unlisted.log_evidence_over_nothing:+.0f}, {self.unlisted.log_evidence_over_best_named:+.0f}"
        alone = ", ".join(f"{p:.2f}" for p in self.alone)
        return f"| {self.law} | {self.seed} | {alone} | {listed} | {offer} ({apart}) |"


def day(case: tuple[str, int]) -> Answer:
    law, seed = case
    own = [separate_fit(*first_fit(diagnosis_problem(*run))) for run in runs_of(law, seed)]
    alone = [
        {explanation.name: explanation.probability for explanation in compare_for_day([one])}[law]
        for one in own
        if law in LISTED
    ]
    explanations = compare_for_day(own)
    together = tuple((explanation.name, explanation.probability) for explanation in explanations)
    return Answer(law, seed, tuple(alone), together, find_law(own, explanations)[0])


def summary(answers: Sequence[Answer]) -> str:
    """Count days by law: how often it is most probable, and the names with more than 0.8, right and wrong.

    It also counts how often a law that is in no list is offered.
    """
    head = "days | most probable | above 0.8, right | above 0.8, wrong | found | law in no list offered"
    lines = [f"| hidden in all three runs | {head} |", "|---|---|---|---|---|---|---|"]
    groups = {"of the list or nothing": tuple(LISTED), "in no list": tuple(law for law in LAWS if law not in LISTED)}
    for title, laws in {**{law: (law,) for law in LAWS}, **groups}.items():
        some = [answer for answer in answers if answer.law in laws]
        best = [answer.together[0] for answer in some]
        right = [name == answer.law for answer, (name, _) in zip(some, best, strict=True)]
        # less the share of the probability that the law in no list takes
        certain = [
            p * (1.0 - answer.unlisted.probability) > THRESHOLDS.sure for answer, (_, p) in zip(some, best, strict=True)
        ]
        counts = (
            len(some),
            sum(right),
            sum(a and b for a, b in zip(right, certain, strict=True)),
            sum(b and not a for a, b in zip(right, certain, strict=True)),
            sum(dict(answer.together)["nothing"] <= THRESHOLDS.stands_out for answer in some),
            sum(answer.unlisted.offered for answer in some),
        )
        lines.append(f"| {title} | " + " | ".join(str(count) for count in counts) + " |")
    return "\n".join(lines)


@with_one_thread_for_products
def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2])
    seeds = parser.parse_args().seeds
    print(
        "| hidden | seed | its probability by each run alone | by all together | law in no list (log evidence over"
        " nothing, over the list's best) |\n|---|---|---|---|---|"
    )
    answers = []
    with ProcessPoolExecutor(mp_context=get_context("spawn")) as pool:
        for answer in pool.map(day, [(law, seed) for law in LAWS for seed in seeds]):
            answers.append(answer)
            print(answer.row, flush=True)
    print(f"\n{summary(answers)}")


if __name__ == "__main__":
    main()
