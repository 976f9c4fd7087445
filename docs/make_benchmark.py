"""Makes ``docs/notebook/diagnosis-benchmark.md`` from the blind benchmark's answers in ``docs/notebook/diagnosis-benchmark.parquet``.

    python docs/make_benchmark.py FOLDER COMMIT   keep the answers of a folder that ``sssi benchmark diagnosis`` made
    python docs/make_benchmark.py                 make the page of what is kept, and the rows about it in README.md

COMMIT names the version that answered.  A folder whose cases conceal one kind alone (``--conceal``) is kept next to the
other.  The three clearest failures have pictures, each the worst of its kind: something was found where nothing was
hidden, a clear effect was not named, and the name with the greatest probability was wrong.  The missing force is kept
of failures alone, other curves of none.
"""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import matplotlib as mpl
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

mpl.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from scipy.stats import chisquare, norm

from sssi_exudyn.io.parquet import read_texts
from sssi_exudyn.io.typed import decode, read_json
from sssi_exudyn.io.writing import to_json
from sssi_exudyn.reports.sections.diagnosis import draw_force, draw_probabilities
from sssi_exudyn.validation.benchmark.cases import Case
from sssi_exudyn.validation.benchmark.page import benchmark_page, shares_table
from sssi_exudyn.validation.benchmark.run import SEAL
from sssi_exudyn.validation.benchmark.scores import STRONG, CaseResult, Scores, Share, is_right, score
from sssi_exudyn.validation.diagnosis.diagnosis_data import NOTHING_MISSING, Weighed

README = Path(__file__).parents[1] / "README.md"
NOTEBOOK = Path(__file__).parent / "notebook"
KEPT = NOTEBOOK / "diagnosis-benchmark.parquet"
PAGE = NOTEBOOK / "diagnosis-benchmark.md"
TEXT = NOTEBOOK / "diagnosis-benchmark-text.txt"
"""Text below the figures."""
PICTURES = Path(__file__).parent / "images"
_COLUMNS = ("case", "result", "seal", "commit")
WHOLE = 10.0
"""s; a case that is longer is a whole run."""
INSIDE = 1.645
"""Standard deviations of a 90 % interval."""
STRENGTHS = ((0.0, 3.0), (3.0, 5.0), (5.0, 8.0), (8.0, 12.0), (12.0, 1e3))
"""Standard errors of effects that are counted together."""


class Alone(NamedTuple):
    """Runs that conceal one kind alone: the words about them, and their figures."""

    title: str
    words: str
    figures: tuple[str, ...]

    def kept(self, kind: str) -> Path:
        """Return the file of the answers of a ``kind``."""
        return NOTEBOOK / f"diagnosis-benchmark-{kind}.parquet"


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
        ("pairs_both_named", "seen_pairs_both_named", "wrong_and_sure", "friction_inside_90"),
    ),
    "whole_runs": Alone(
        "Whole runs",
        "12 to 15 s long, in every fourth of which nothing is hidden, and in the others one effect that the diagnosis "
        "has a name for, of the two larger strengths",
        (
            "false_alarms",
            "nothing_not_adequate",
            "right_name_first",
            "strong_right_or_small_set",
            "strong_right_name_first",
            "wrong_and_sure",
            "sure_right",
            "interval_coverage_90",
            "friction_inside_90",
        ),
    ),
}
"""Runs that conceal one kind alone, by the kind of all their cases, and whole runs."""


def keep(folder: Path, commit: str) -> None:
    """Keep the answers of a benchmark's folder, a row a case that was diagnosed."""
    rows = []
    cases = []
    for path in sorted((folder / "made").glob("*.json")):
        case = read_json(path, Case)
        answered = folder / f"case_{case.index:03d}.json"
        if not answered.exists():
            continue
        result = read_json(answered, CaseResult)
        cases.append((case, result))
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
    kinds = {_group(case) for case, _ in cases}
    kind = min(kinds)
    alone = kinds == {kind}
    path = ALONE[kind].kept(kind) if alone else KEPT
    if kind in ("none", "whole_runs") and alone and path.exists():
        # false alarms and whole runs are few: those of earlier methods still count
        before = pq.read_table(path)
        table = pa.concat_tables([before.filter(pc.not_equal(before["seal"], seal)), table])
    pq.write_table(table, path, compression="zstd")
    for old in PICTURES.glob("benchmark_*.png"):
        old.unlink()
    for number, (_, case, result) in enumerate(failures(), 1):
        draw(case, result, PICTURES / f"benchmark_{number}.png")


def _group(case: Case) -> str:
    """Return what a case is counted with where all cases of a folder are alike."""
    if (case.seconds or 0.0) > WHOLE:
        return "whole_runs"
    return "listed" if case.kind in ("physics", "sensor") else case.kind


def failures() -> list[tuple[str, Case, CaseResult]]:
    """Return the three clearest failures, where they exist, each with the name of its runs."""
    files = [("all", KEPT), *((kind, alone.kept(kind)) for kind, alone in ALONE.items())]
    answers = [(name, *pair) for name, path in files if path.exists() for pair in kept_answers(path)]
    worst: list[tuple[str, Case, CaseResult]] = []
    for kind, measure in enumerate((_said, _oracle, _said)):
        left = [answer for answer in answers if answer not in worst and _failed(*answer[1:])[kind]]
        worst += [max(left, key=lambda answer: measure(answer[1:]))] if left else []
    return worst


def _failed(case: Case, result: CaseResult) -> tuple[bool, bool, bool]:
    """Tell whether something was found where nothing was hidden, a clear effect was not named, a name was wrong."""
    listed = case.kind in ("physics", "sensor")
    missed = listed and (result.oracle or 0.0) >= STRONG and result.first_name != case.name
    wrong = bool(result.findings) and not is_right(case, result.findings[0])
    return case.kind == "none" and bool(result.findings), missed, wrong


def _said(pair: tuple[Case, CaseResult]) -> float:
    """Return the probability of the first finding."""
    return pair[1].findings[0].probability


def _oracle(pair: tuple[Case, CaseResult]) -> float:
    """Return the strength of the effect in standard errors."""
    return pair[1].oracle or 0.0


def draw(case: Case, result: CaseResult, path: Path) -> None:
    """Draw the missing force and the probabilities of a case, shaded while the hidden effect acts."""
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
    """Return the first finding with its alternatives; without a finding, the explanations compared first."""
    assert result.diagnosis is not None
    if result.findings:
        first = result.findings[0]
        return tuple(Weighed(named.name, named.probability, None) for named in (first, *first.alternatives))
    return result.diagnosis.weighed[0] if result.diagnosis.weighed else ()


def caption(case: Case, result: CaseResult) -> str:
    """State the hidden effect, the answer, and its effect on friction."""
    assert result.diagnosis is not None
    hidden = "nothing hidden" if case.kind == "none" else f"hidden: {case.name}"
    strong = f" ({result.oracle:.0f} standard errors)" if result.oracle is not None else ""
    odds = ", ".join(
        f"{'nothing missing' if explanation.name == NOTHING_MISSING else explanation.name} {explanation.probability:.2f}"
        for explanation in _answer(result)[:3]
    )
    shown = (result.diagnosis.friction_averaged or {}).get("mu_t")
    friction = "" if shown is None else f"; μ_t {shown.low:.3f} to {shown.high:.3f} for {case.mu_t:.3f}"
    return f"case {case.index}, {hidden}{strong}. The answer: {odds}; verdict {result.diagnosis.verdict}{friction}."


def failures_text() -> str:
    """Return the failures with their pictures."""
    lines = ["## Failures that show most", ""]
    for number, (runs, case, result) in enumerate(failures(), 1):
        words = f"Of the runs `{runs}`: {caption(case, result)}"
        lines += [words, "", f"![{words}](../images/benchmark_{number}.png)", ""]
    lines.append(
        "On the left the force that the model lacks before anything was found, shaded while what is hidden acts."
    )
    return "\n".join(lines) + "\n"


def alone_text(kind: str) -> str:
    """Return the figures of runs that conceal that kind alone; "" where none are kept."""
    alone = ALONE[kind]
    path = alone.kept(kind)
    if not path.exists():
        return ""
    scores, _ = kept_scores(path)
    by_run = Counter((commit, seal) for _, _, seal, commit in read_texts(path, _COLUMNS))
    methods = ", ".join(
        f"{count} by method `{commit}` (sha256 of the answers `{seal}`)" for (commit, seal), count in by_run.items()
    )
    counts = Counter(
        f"{case.name}: {result.first_name}" if kind != "none" else f"{result.first_name}"
        for case, result in kept_answers(path)
        if result.findings
    )
    said = ", ".join(f"{words} ({count})" for words, count in sorted(counts.items()))
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


def ranks_text() -> str:
    """Return where truths stand in what is said of runs with nothing hidden, by tenths of its distribution."""
    nothing = [pair for pair in kept_answers(ALONE["none"].kept("none")) if pair[1].diagnosis is not None]
    rows: dict[str, list[float]] = {"μ_t": [], "μ_n": [], "`chance`": []}
    for case, result in nothing:
        assert result.diagnosis is not None
        said = result.diagnosis.friction_averaged or {}
        for name, number, true in (("μ_t", said.get("mu_t"), case.mu_t), ("μ_n", said.get("mu_n"), case.mu_n)):
            if number is not None and true is not None:
                side = number.high - number.value if true > number.value else number.value - number.low
                rows[name].append(float(norm.cdf(INSIDE * (true - number.value) / max(side, 1e-9))))
        if result.diagnosis.chance is not None:
            rows["`chance`"].append(result.diagnosis.chance.as_strong)
    lines = [
        "## Ranks",
        "",
        "Where the truth stands in the distribution that is said of it, in runs with nothing hidden, and `chance`: runs in each "
        "tenth. A right distribution has as many in each.",
        "",
        f"| | {' | '.join(f'{k / 10:.1f}' for k in range(1, 11))} | a right one is as uneven in |",
        "|---|" + "---|" * 11,
    ]
    for name, ranks in rows.items():
        counts = np.histogram(ranks, bins=10, range=(0.0, 1.0))[0]
        as_uneven = f"{100.0 * float(chisquare(counts).pvalue):.0f} %"
        lines.append(f"| {name} | {' | '.join(map(str, counts))} | {as_uneven} |")
    return "\n".join(lines) + "\n\n"


def detection_text() -> str:
    """Return how well a finding can be told from nothing by the first comparison's probability of it."""
    missing: dict[str, list[float]] = {"nothing": []}
    for kind, alone in ALONE.items():
        for case, result in kept_answers(alone.kept(kind)) if alone.kept(kind).exists() else []:
            if result.diagnosis is None or not result.diagnosis.weighed:
                continue
            by_name = {one.name: one.probability for one in result.diagnosis.weighed[0]}
            strong = result.oracle or 0.0
            group = next((f"{low} to {high}" for low, high in STRENGTHS if low <= strong < high), "")
            missing.setdefault("nothing" if case.kind == "none" else group, []).append(1.0 - by_name[NOTHING_MISSING])
    null = np.sort(missing.pop("nothing"))
    lines = [
        "## Detection",
        "",
        f"How often something is more probably missing than in {len(null)} runs with nothing hidden (the area under the "
        "receiver's operating characteristic), and in how many runs it is so at a probability that 1 % or 5 % of those reach.",
        "",
        "| standard errors of the effect, or of two | runs | area | found at 1 % false alarms | at 5 % |",
        "|---|---|---|---|---|",
    ]
    for low, high in STRENGTHS:
        reached = np.array(missing.get(f"{low} to {high}", []))
        if len(reached):
            area = np.mean(0.5 * (np.searchsorted(null, reached) + np.searchsorted(null, reached, "right"))) / len(null)
            shares = [f"{100.0 * np.mean(reached > np.quantile(null, level)):.0f} %" for level in (0.99, 0.95)]
            words = f"{low:g} to {high:g}" if high < STRENGTHS[-1][1] else f"{low:g} or more"
            lines.append(f"| {words} | {len(reached)} | {area:.2f} | {shares[0]} | {shares[1]} |")
    return "\n".join(lines) + "\n\n"


def kept_answers(path: Path) -> list[tuple[Case, CaseResult]]:
    """Return the cases and the answers that a file keeps."""
    return list(map(_decoded, read_texts(path, _COLUMNS)))


def _decoded(row: Sequence[str | None]) -> tuple[Case, CaseResult]:
    """Return the case and the answer of a row."""
    case, result, *_ = row
    assert case is not None
    assert result is not None
    return decode(case.encode(), Case), decode(result.encode(), CaseResult)


def kept_scores(path: Path) -> tuple[Scores, str]:
    """Return the figures of a file's answers, and the version that answered."""
    cases, results = zip(*kept_answers(path), strict=True)
    _, _, seal, commit = read_texts(path, _COLUMNS)[0]
    return score(cases, results, seal or ""), commit or ""


def last_scores(kind: str) -> Scores:
    """Return the figures of the last version that answered runs which conceal a ``kind`` alone."""
    rows = read_texts(ALONE[kind].kept(kind), _COLUMNS)
    _, _, last, _ = rows[-1]
    cases, results = zip(*(_decoded(row) for row in rows if row[2] == last), strict=True)
    return score(cases, results, last or "")


def readme_rows() -> list[str]:
    """Return the rows of the README's table of results that are about these answers."""
    whole, listed, pairs, nothing = map(last_scores, ("whole_runs", "listed", "pair", "none"))
    all_whole, all_nothing = (kept_scores(ALONE[kind].kept(kind))[0] for kind in ("whole_runs", "none"))
    sure = whole.wrong_and_sure.hits + listed.wrong_and_sure.hits, whole.wrong_and_sure.of + listed.wrong_and_sure.of
    return [
        "| diagnosis: single effects that it names first, 12 skiers; of these clear ones | "
        f"whole runs {_of(whole.right_name_first)}, 6 s {_of(listed.right_name_first)}; "
        f"{_of(whole.strong_right_name_first)} and {_of(listed.strong_right_name_first)} "
        f"(in whole runs by all versions {_of(all_whole.strong_right_name_first)}) "
        "| [benchmark](docs/notebook/diagnosis-benchmark.md) |",
        "| the same: wrong names above 80 %; next to a second effect; both of two effects that are to be seen | "
        f"{sure[0]} of {sure[1]} (in whole runs by all versions {_of(all_whole.wrong_and_sure)}); "
        f"{_of(pairs.wrong_and_sure)}; {_of(pairs.seen_pairs_both_named)} | |",
        "| false alarms where nothing is hidden, in 6 s by all versions; by the last; in whole runs by all | "
        f"{_of(all_nothing.false_alarms)}; {_of(nothing.false_alarms)}; {_of(all_whole.false_alarms)} "
        "| [targets](docs/notebook/diagnosis.md#targets-next-to-the-best-that-can-be-said) |",
    ]


def _of(share: Share) -> str:
    return f"{share.hits} of {share.of}"


def readme_with(rows: Sequence[str]) -> str:
    """Return the README in which each of the ``rows`` takes the place of the one with the same first cell."""
    by_cell = {row.split(" | ")[0]: row for row in rows}
    lines = README.read_text(encoding="utf-8").splitlines()
    return "\n".join(by_cell.get(line.split(" | ")[0], line) for line in lines) + "\n"


def page() -> str:
    """Return the page."""
    scores, commit = kept_scores(KEPT)
    text = TEXT.read_text(encoding="utf-8").replace("COMMIT", commit)
    figures = f"{''.join(map(alone_text, ALONE))}{ranks_text()}{detection_text()}"
    return f"{benchmark_page(scores)}\n{figures}{failures_text()}\n{text}"


if __name__ == "__main__":
    if len(sys.argv) > 1:
        keep(Path(sys.argv[1]), sys.argv[2])
    PAGE.write_text(page(), encoding="utf-8")
    README.write_text(readme_with(readme_rows()), encoding="utf-8")
