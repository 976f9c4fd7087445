"""Makes ``docs/diagnosis-benchmark.md`` of the blind benchmark's answers, which ``docs/diagnosis-benchmark.parquet`` holds.

    python docs/make_benchmark.py FOLDER COMMIT   keep the answers of a folder that ``sssi benchmark diagnosis`` made
    python docs/make_benchmark.py                 make the page of what is kept

COMMIT names the version that answered.  A folder whose cases conceal one kind alone (``--conceal``) is kept beside the
other.  The three failures of all of them that show most have pictures: nothing was hidden and something was found, what
was clear was not named, and what was named with the greatest probability was wrong; each the worst of its kind.  The
missing force is kept of failures alone, other curves of none.
"""

from __future__ import annotations

import sys
from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import matplotlib as mpl
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

mpl.use("Agg")
import matplotlib.pyplot as plt

from sssi_exudyn.io.parquet import read_texts
from sssi_exudyn.io.typed import decode, read_json
from sssi_exudyn.io.writing import to_json
from sssi_exudyn.reports.sections.diagnosis import draw_force, draw_probabilities
from sssi_exudyn.validation.benchmark.cases import Case
from sssi_exudyn.validation.benchmark.page import benchmark_page, shares_table
from sssi_exudyn.validation.benchmark.run import SEAL
from sssi_exudyn.validation.benchmark.scores import STRONG, CaseResult, Scores, is_right, score
from sssi_exudyn.validation.diagnosis.diagnosis_data import NOTHING_MISSING, Weighed

DOCS = Path(__file__).parent
KEPT = DOCS / "diagnosis-benchmark.parquet"
PAGE = DOCS / "diagnosis-benchmark.md"
TEXT = DOCS / "diagnosis-benchmark-text.txt"
"""What stands below the figures."""
PICTURES = DOCS / "images"
_COLUMNS = ("case", "result", "seal", "commit")


class Alone(NamedTuple):
    """Runs that conceal one kind alone: where their answers are kept, what is said of them, and the figures they have."""

    title: str
    words: str
    figures: tuple[str, ...]

    def kept(self, kind: str) -> Path:
        """The file of those of a ``kind``."""
        return DOCS / f"diagnosis-benchmark-{kind}.parquet"


ALONE = {
    "none": Alone(
        "Runs with nothing hidden",
        "in none of which anything is hidden",
        (
            "false_alarms",
            "false_alarms_bic",
            "false_alarms_in_sample",
            "false_alarms_force",
            "nothing_not_adequate",
            "friction_inside_90",
        ),
    ),
    "listed": Alone(
        "Effects that the list has",
        "in each of which one effect is hidden that the diagnosis has a name for, of the two larger strengths",
        (
            "right_name_first",
            "strong_right_or_small_set",
            "strong_right_name_first",
            "strong_right_bic",
            "strong_seen_force",
            "set_coverage_where_found",
            "wrong_and_sure",
            "sure_right",
            "interval_coverage_90",
            "friction_inside_90",
            "strong_better_than_placebos",
        ),
    ),
    "unexplained": Alone(
        "Effects that the list lacks",
        "in each of which something acts that the diagnosis has no name for, of the two larger strengths",
        ("unexplained_called_so", "unexplained_where_found", "unexplained_wrongly_named", "friction_inside_90"),
    ),
    "pair": Alone(
        "Two effects at a time",
        "in each of which two effects are hidden, of the two larger strengths",
        ("pairs_both_named", "wrong_and_sure", "friction_inside_90"),
    ),
}
"""By the kind of all their cases."""


def keep(folder: Path, commit: str) -> None:
    """Keep the answers of a benchmark's folder, a row a case that was diagnosed."""
    rows = []
    whole = []
    for path in sorted((folder / "made").glob("*.json")):
        case = read_json(path, Case)
        answered = folder / f"case_{case.index:03d}.json"
        if not answered.exists():
            continue
        result = read_json(answered, CaseResult)
        whole.append((case, result))
        if result.diagnosis is not None:
            force = result.diagnosis.latent_force if any(_failed(case, result)) else None
            short = replace(result.diagnosis, latent_force=force, track_distance=None, way=None)
            result = replace(result, diagnosis=short)
        rows.append((to_json(case), to_json(result)))
    seal = (folder / SEAL).read_text(encoding="utf-8").strip()
    table = pa.table({"case": [c for c, _ in rows], "result": [r for _, r in rows]})
    columns = {"seal": pa.array([seal] * len(rows)), "commit": pa.array([commit] * len(rows))}
    for name, column in columns.items():
        table = table.append_column(name, column)
    kinds = {"listed" if case.kind in ("physics", "sensor") else case.kind for case, _ in whole}
    kind = min(kinds)
    alone = kinds == {kind}
    path = ALONE[kind].kept(kind) if alone else KEPT
    if kind == "none" and alone and path.exists():
        # false alarms are few: those of methods before count on
        before = pq.read_table(path)
        table = pa.concat_tables([before.filter(pc.not_equal(before["seal"], seal)), table])
    pq.write_table(table, path, compression="zstd")
    for old in PICTURES.glob("benchmark_*.png"):
        old.unlink()
    for number, (_, case, result) in enumerate(failures(), 1):
        draw(case, result, PICTURES / f"benchmark_{number}.png")


def failures() -> list[tuple[str, Case, CaseResult]]:
    """The three failures that show most, those that there are, each with the name of the runs it is one of."""
    every = [("all", KEPT), *((kind, alone.kept(kind)) for kind, alone in ALONE.items())]
    answers = [(name, *pair) for name, path in every if path.exists() for pair in kept_answers(path)]
    found: list[tuple[str, Case, CaseResult]] = []
    for kind, measure in enumerate((_said, _oracle, _said)):
        left = [each for each in answers if each not in found and _failed(*each[1:])[kind]]
        found += [max(left, key=lambda each: measure(each[1:]))] if left else []
    return found


def _failed(case: Case, result: CaseResult) -> tuple[bool, bool, bool]:
    """Whether something was found where nothing was hidden, what was clear was not named, a wrong name was given."""
    listed = case.kind in ("physics", "sensor")
    missed = listed and (result.oracle or 0.0) >= STRONG and result.first_name != case.name
    wrong = bool(result.findings) and not is_right(case, result.findings[0])
    return case.kind == "none" and bool(result.findings), missed, wrong


def _said(pair: tuple[Case, CaseResult]) -> float:
    """The probability of the first finding."""
    return pair[1].findings[0].probability


def _oracle(pair: tuple[Case, CaseResult]) -> float:
    """Standard errors that the effect is strong."""
    return pair[1].oracle or 0.0


def draw(case: Case, result: CaseResult, path: Path) -> None:
    """The missing force and the probabilities of a case, shaded while what is hidden acts."""
    assert result.diagnosis is not None
    latent = result.diagnosis.latent_force
    figure, (force, odds) = plt.subplots(1, 2, figsize=(9.0, 3.0), layout="constrained", width_ratios=[1.4, 1.0])
    if latent is not None:
        draw_force(force, latent.before)
        force.legend(frameon=False, fontsize="small")
    if case.window is not None:
        force.axvspan(*case.window, color="0.5", alpha=0.15, linewidth=0)
    draw_probabilities(odds, _answer(result))
    figure.savefig(path, dpi=80, metadata={"Software": ""})
    plt.close(figure)


def _answer(result: CaseResult) -> tuple[Weighed, ...]:
    """The first finding with what else it may be, as it stands at the end; where none is, what was compared first."""
    assert result.diagnosis is not None
    if result.findings:
        first = result.findings[0]
        return tuple(Weighed(each.name, each.probability, None) for each in (first, *first.alternatives))
    return result.diagnosis.weighed[0] if result.diagnosis.weighed else ()


def caption(case: Case, result: CaseResult) -> str:
    """What was hidden, what was found, and what that did to friction."""
    assert result.diagnosis is not None
    hidden = "nothing hidden" if case.kind == "none" else f"hidden: {case.name}"
    strong = f" ({result.oracle:.0f} standard errors)" if result.oracle is not None else ""
    odds = ", ".join(
        f"{'nothing missing' if each.name == NOTHING_MISSING else each.name} {each.probability:.2f}"
        for each in _answer(result)[:3]
    )
    shown = (result.diagnosis.friction_averaged or {}).get("mu_t")
    friction = "" if shown is None else f"; μ_t {shown.low:.3f} to {shown.high:.3f} for {case.mu_t:.3f}"
    return f"case {case.index}, {hidden}{strong}. The answer: {odds}; verdict {result.diagnosis.verdict}{friction}."


def failures_text() -> str:
    """The failures with their pictures."""
    lines = ["## Failures that show most", ""]
    for number, (runs, case, result) in enumerate(failures(), 1):
        words = f"Of the runs `{runs}`: {caption(case, result)}"
        lines += [words, "", f"![{words}](images/benchmark_{number}.png)", ""]
    lines.append(
        "On the left the force that the model lacks before anything was found, shaded while what is hidden acts."
    )
    return "\n".join(lines) + "\n"


def alone_text(kind: str) -> str:
    """The figures of runs that conceal that kind alone; "" where none are kept."""
    alone = ALONE[kind]
    path = alone.kept(kind)
    if not path.exists():
        return ""
    scores, _ = kept_scores(path)
    by_run = Counter((commit, seal) for _, _, seal, commit in read_texts(path, _COLUMNS))
    methods = ", ".join(
        f"{count} by method `{commit}` (sha256 of the answers `{seal}`)" for (commit, seal), count in by_run.items()
    )
    found = Counter(
        f"{case.name}: {result.first_name}" if kind != "none" else f"{result.first_name}"
        for case, result in kept_answers(path)
        if result.findings
    )
    said = ", ".join(f"{words} ({count})" for words, count in sorted(found.items()))
    lines = [
        f"## {alone.title}",
        "",
        f"{scores.cases} runs, {alone.words}; by the reduced model, seeds not opened before: {methods}.",
        "",
        *shares_table(scores, alone.figures),
        "",
        f"Named first: {said or 'nothing'}.",
    ]
    return "\n".join(lines) + "\n\n"


def kept_answers(path: Path) -> list[tuple[Case, CaseResult]]:
    """The cases and the answers that a file keeps."""
    found = []
    for case, result, _, _ in read_texts(path, _COLUMNS):
        assert case is not None
        assert result is not None
        found.append((decode(case.encode(), Case), decode(result.encode(), CaseResult)))
    return found


def kept_scores(path: Path) -> tuple[Scores, str]:
    """The figures of what a file keeps, and the version that answered."""
    cases, results = zip(*kept_answers(path), strict=True)
    _, _, seal, commit = read_texts(path, _COLUMNS)[0]
    return score(cases, results, seal or ""), commit or ""


def page() -> str:
    """The page."""
    scores, commit = kept_scores(KEPT)
    text = TEXT.read_text(encoding="utf-8").replace("COMMIT", commit)
    return f"{benchmark_page(scores)}\n{''.join(map(alone_text, ALONE))}{failures_text()}\n{text}"


if __name__ == "__main__":
    if len(sys.argv) > 1:
        keep(Path(sys.argv[1]), sys.argv[2])
    PAGE.write_text(page(), encoding="utf-8")
