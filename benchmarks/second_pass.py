"""A patch of snow or a gust hidden in a run, and another pass of the slope: names given without it and with it.

``python benchmarks/second_pass.py [--seeds 11 12] [--json FILE]`` prints a row a case, a patch and a gust a seed, and
then how often a name was settled rightly and wrongly; some minutes of computing a case.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Final

from sssi_exudyn.fitting.first_fit import fit_reduced, problem_of
from sssi_exudyn.io.writing import to_json, write_atomically
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.motion.from_recording import motion_from_recording
from sssi_exudyn.recording.read import read_recording
from sssi_exudyn.runtime.threads import with_one_thread_for_products
from sssi_exudyn.simulation.reduced.prepared import prepare
from sssi_exudyn.validation.benchmark.cases import Recorded
from sssi_exudyn.validation.benchmark.second_pass import first_finding, two_passes
from sssi_exudyn.validation.diagnosis.diagnosis_data import NOTHING_MISSING
from sssi_exudyn.validation.diagnosis.hypotheses.catalogue import BY_NAME
from sssi_exudyn.validation.diagnosis.several_runs.second_pass import ask_other_runs, best_of
from sssi_exudyn.validation.diagnosis.thresholds import THRESHOLDS

EXAMPLES: Final = Path(__file__).parents[1] / "examples"
HIDDEN: Final = ("snow_patch", "gust")


@dataclass(frozen=True)
class Row:
    """A case: the hidden effect of the first run, and probabilities by name without and with the second pass.

    ``after`` is empty where the second pass was not used, as nothing was found or nothing that may keep to its place.

    gains : log evidence of the second pass, by the names of effects that keep to a place
    """

    hidden: str
    size: float
    seed: int
    before: dict[str, float]
    after: dict[str, float]
    gains: dict[str, float | None]

    @property
    def line(self) -> str:
        return f"| {self.hidden} | {self.seed} | {_listed(self.before)} | {_listed(self.after)} |"

    def says(self, *, with_second: bool, by_name: bool) -> str:
        """State whether the name, or else place or time, is right or wrong, sure or not, or that nothing is found."""
        odds = (self.after or self.before) if with_second else self.before
        hidden = self.hidden
        if not by_name:
            kind = _keeps_to(hidden)
            total: dict[str, float] = {}
            for name, probability in odds.items():
                total[_keeps_to(name)] = total.get(_keeps_to(name), 0.0) + probability
            odds, hidden = total, kind
        name, probability = best_of(odds)
        if name == NOTHING_MISSING:
            return "nothing"
        return ("sure" if probability >= THRESHOLDS.sure else "unsure") + (", right" if name == hidden else ", wrong")


def _keeps_to(name: str) -> str:
    """Return what an explanation keeps to; "all" for one that acts all the time."""
    if name == NOTHING_MISSING:
        return name
    hypothesis = BY_NAME[name]
    return "time" if not hypothesis.comes_again else "place" if hypothesis.lines else "all"


def _listed(odds: dict[str, float]) -> str:
    ranked = sorted(odds.items(), key=lambda item: -item[1])
    return ", ".join(f"{name} {probability:.2f}" for name, probability in ranked if probability >= 0.03)


def base_of(name: str) -> Recorded:
    """Return a recorded run with the result of its fit."""
    recording = read_recording(EXAMPLES / name)
    motion = motion_from_recording(recording)
    problem = problem_of(recording, motion, model_of(recording, motion), "joint")
    return recording, motion, problem.model_at(fit_reduced(problem, prepare(problem.model, motion)).values)


def case(hidden: str, size: float, base: Recorded, seed: int) -> Row:
    passes = two_passes(hidden, size, base, seed)
    first = first_finding(passes.first)
    if not first.accepted:
        return Row(hidden, size, seed, {NOTHING_MISSING: 1.0}, {}, {})
    alone = {item.name: item.probability for item in first.accepted[0].searched.explanations}
    findings = ask_other_runs({"first": first, "second": first_finding(passes.second)})
    of_first = [finding for finding in findings if finding.run == "first"]
    if not of_first:
        return Row(hidden, size, seed, alone, {}, {})
    return Row(hidden, size, seed, alone, of_first[0].after, of_first[0].passes[0].log_evidence)


def summary(rows: Sequence[Row]) -> str:
    """Count the cases by answer, without and with the second pass."""
    kinds = ("sure, right", "sure, wrong", "unsure, right", "unsure, wrong", "nothing")
    lines = [f"| hidden | cases | | | {' | '.join(kinds)} |", "|---|---|---|---|" + "---|" * len(kinds)]
    for hidden in (*HIDDEN, "both"):
        some = [row for row in rows if hidden in (row.hidden, "both")]
        for by_name, what in ((True, "name"), (False, "place or time")):
            for with_second, words in ((False, "first run alone"), (True, "with the second")):
                answers = [row.says(with_second=with_second, by_name=by_name) for row in some]
                counts = " | ".join(str(answers.count(kind)) for kind in kinds)
                lines.append(f"| {hidden} | {len(some)} | {what} | {words} | {counts} |")
    return "\n".join(lines)


@with_one_thread_for_products
def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, nargs="+", default=[11, 12])
    parser.add_argument("--size", type=float, default=2.0, help="in units of the benchmark's effect")
    parser.add_argument("--recording", default="intermediate", help="example whose movements are used")
    parser.add_argument("--json", type=Path, help="file of the rows, written again after each")
    options = parser.parse_args()
    base, rows = base_of(options.recording), []
    print("| hidden | seed | by the first run alone | with the second |\n|---|---|---|---|")
    for seed in options.seeds:
        for hidden in HIDDEN:
            rows.append(case(hidden, options.size, base, seed))
            print(rows[-1].line, flush=True)
            if options.json:
                write_atomically(options.json, to_json([asdict(row) for row in rows]))
    print(f"\n{summary(rows)}")


if __name__ == "__main__":
    main()
