"""Makes ``docs/notebook/semi-real.md`` from the answers in ``docs/notebook/semi-real.parquet``.

    python docs/make_semi_real.py COMMIT FOLDER…   keep the answers of folders that ``sssi benchmark semi-real`` made,
                                                   replacing those of the same recordings
    python docs/make_semi_real.py                  make the page of the kept answers

COMMIT names the version that answered.  The path, the track and the curves over time of each diagnosis are left out, so
that only the answers of a recording are kept.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import groupby
from pathlib import Path
from typing import Final

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from sssi_exudyn.io.parquet import read_texts
from sssi_exudyn.io.typed import decode, read_json
from sssi_exudyn.io.writing import to_json
from sssi_exudyn.validation.benchmark.known_answers import NOTHING
from sssi_exudyn.validation.benchmark.page import interval_in_words, share_in_words
from sssi_exudyn.validation.benchmark.scores import share
from sssi_exudyn.validation.benchmark.semi_real import FAULTS, Answer, SemiReal, judge
from sssi_exudyn.validation.diagnosis.diagnosis_data import Number

NOTEBOOK = Path(__file__).parent / "notebook"
KEPT = NOTEBOOK / "semi-real.parquet"
PAGE = NOTEBOOK / "semi-real.md"
TEXT = NOTEBOOK / "semi-real-text.txt"
"""Text below the figures."""
PLACED: Final = 0.5
"""Least overlap in time of a finding at the fault's place."""
_SHOWN: Final = {
    "clock_offset": (1.0, ".2f", " s"),
    "heading_offset": (180.0 / np.pi, ".1f", "°"),
    "x": (1.0, ".1f", " m"),
    "y": (1.0, ".1f", " m"),
}
"""Factor, digits and unit of each number."""
Judged = tuple[SemiReal, Answer]


def keep(commit: str, folders: Sequence[Path]) -> None:
    """Keep the answers of a benchmark's folders, a row a case, next to those of other recordings."""
    cases = [read_json(path, SemiReal) for folder in folders for path in sorted(folder.glob("*/*.json"))]
    answered = {case.recording for case in cases}
    rows = [(case, version) for case, version in kept() if case.recording not in answered] + [
        (case, commit) for case in cases
    ]
    order = [NOTHING, *FAULTS]
    rows.sort(key=lambda row: (row[0].recording, order.index(row[0].fault), row[0].times))
    columns = {"case": [to_json(_short(case)) for case, _ in rows], "commit": [version for _, version in rows]}
    pq.write_table(pa.table(columns), KEPT, compression="zstd")


def _short(case: SemiReal) -> SemiReal:
    if case.diagnosis is None:
        return case
    return replace(case, diagnosis=replace(case.diagnosis, latent_force=None, track_distance=None, way=None))


def kept() -> list[tuple[SemiReal, str]]:
    """Return the kept cases, and the version that answered each."""
    return [(decode((case or "").encode(), SemiReal), by or "") for case, by in read_texts(KEPT, ("case", "commit"))]


def page() -> str:
    """Return the page."""
    judged = [(case, judge(case)) for case, _ in kept()]
    parts = [_head(judged), _totals(judged), _by_size(judged), _ceilings(judged), _runs(judged), _answers(judged)]
    return "\n".join([*("\n".join([*part, ""]) for part in parts), TEXT.read_text(encoding="utf-8")])


def _head(judged: Sequence[Judged]) -> list[str]:
    faults = [answer for _, answer in judged if answer.fault != NOTHING]
    runs = {answer.recording for answer in faults}
    return [
        "# Faults concealed in runs from the field",
        "",
        f"{len(runs)} recordings from the field ([real runs](real-runs.md)), in whose data faults of instruments were "
        f"concealed: {len(faults)} cases, and {len(judged) - len(faults)} untouched runs, diagnosed by the reduced model.",
    ]


def _totals(judged: Sequence[Judged]) -> list[str]:
    untouched = [answer for _, answer in judged if answer.fault == NOTHING]
    faults = [answer for _, answer in judged if answer.fault != NOTHING]
    right = [answer for answer in faults if answer.answer == "right"]
    placed = [answer.overlap >= PLACED for answer in right if answer.overlap is not None]
    rows = [
        ("untouched runs: one of the three faults is claimed", [a.answer == "claimed" for a in untouched]),
        ("untouched runs: anything is claimed", [a.found != NOTHING for a in untouched]),
        ("all faults: the right name is found", [a.answer == "right" for a in faults]),
        ("all faults: the right name, or a set that holds it", [a.answer in ("right", "in the set") for a in faults]),
        ("all faults: another name alone", [a.answer == "wrong name" for a in faults]),
        ("all faults: nothing is found", [a.answer == "not found" for a in faults]),
        ("all cases: could not be diagnosed", [a.answer == "failed" for a in (*untouched, *faults)]),
        (f"rightly named, with a place: times overlap by {PLACED} or more", placed),
        ("rightly named: 90 % intervals hold the concealed size", [bool(a.sized) for a in right]),
        ("all faults: the 90 % interval of μ_t holds the untouched run's μ_t", _friction_kept(judged)),
    ]
    return ["| | result | 95 % interval |", "|---|---|---|", *(_share_row(*row) for row in rows)]


def _friction_kept(judged: Sequence[Judged]) -> list[bool]:
    untouched = {case.recording: _mu_t(case) for case, _ in judged if case.fault == NOTHING}
    pairs = [(untouched[case.recording], _mu_t(case)) for case, _ in judged if case.fault != NOTHING]
    return [now.low <= before.value <= now.high for before, now in pairs if before and now]


def _mu_t(case: SemiReal) -> Number | None:
    """Return μ_t averaged over all explanations."""
    averaged = None if case.diagnosis is None else case.diagnosis.friction_averaged
    return None if averaged is None else averaged["mu_t"]


def _mu_t_in_words(case: SemiReal) -> str:
    number = _mu_t(case)
    return "–" if number is None else f"{number.value:.3f} ({number.low:.3f} to {number.high:.3f})"


def _share_row(meaning: str, answers: Sequence[bool]) -> str:
    figure = share(sum(answers), len(answers))
    return f"| {meaning} | {share_in_words(figure)} | {interval_in_words(figure)} |"


def _by_size(judged: Sequence[Judged]) -> list[str]:
    faults = [pair for pair in judged if pair[1].fault != NOTHING]

    def group(pair: Judged) -> tuple[int, float]:
        return list(FAULTS).index(pair[1].fault), pair[0].times

    lines = ["| fault | size asked for | size, in the noise | right | in the set | another name | nothing |"]
    lines.append("|---|---|---|---|---|---|---|")
    for (_, times), pairs in groupby(sorted(faults, key=group), group):
        answers = [answer for _, answer in pairs]
        counts = [sum(a.answer == kind for a in answers) for kind in ("right", "in the set", "wrong name", "not found")]
        sizes = [answer.times for answer in answers]
        counted = " | ".join(f"{count} of {len(answers)}" for count in counts)
        lines.append(f"| {answers[0].fault} | {times:g} | {min(sizes):.1f} to {max(sizes):.1f} | {counted} |")
    return lines


def _ceilings(judged: Sequence[Judged]) -> list[str]:
    """Return how many faults the untouched run's own information would show, and how many of them were named."""
    noticed = {
        case.recording: case.diagnosis.smallest_noticed
        for case, _ in judged
        if case.fault == NOTHING and case.diagnosis is not None
    }
    lines = [
        "| fault | size over the smallest that would be noticed | larger than that | of these, right | of the others, right |",
        "|---|---|---|---|---|",
    ]
    for fault in FAULTS:
        pairs = [
            (float(np.linalg.norm(list(case.numbers.values()))) / noticed[case.recording][fault].value, answer)
            for case, answer in judged
            if case.fault == fault
        ]
        large = [answer for ratio, answer in pairs if ratio >= 1.0]
        small = [answer for ratio, answer in pairs if ratio < 1.0]
        right = [f"{sum(answer.answer == 'right' for answer in group)} of {len(group)}" for group in (large, small)]
        ratios = [ratio for ratio, _ in pairs]
        lines.append(
            f"| {fault} | {min(ratios):.2f} to {max(ratios):.2f} | {len(large)} of {len(pairs)} | {right[0]} | {right[1]} |"
        )
    return lines


def _runs(judged: Sequence[Judged]) -> list[str]:
    lines = [
        "| run | stretch | fixes | σ stated | noise | untouched | μ_t, 90 % interval |",
        "|---|---|---|---|---|---|---|",
    ]
    for case, answer in judged:
        if case.fault == NOTHING:
            noise = None if case.diagnosis is None else np.sqrt(2.0) * case.diagnosis.noise.gps_sigma_m
            lines.append(
                f"| {case.recording} | {case.begin_s:.0f} to {case.end_s:.0f} s | {case.fixes} | {case.stated_m:.1f} m | "
                f"{'–' if noise is None else f'{noise:.1f} m'} | {_found(answer)} | {_mu_t_in_words(case)} |"
            )
    return lines


def _answers(judged: Sequence[Judged]) -> list[str]:
    lines = ["| run | concealed | in the noise | answer | found | time overlaps | found, 90 % interval | μ_t |"]
    lines.append("|---|---|---|---|---|---|---|---|")
    for case, answer in judged:
        if answer.fault != NOTHING:
            numbers = ", ".join(_number(name, value) for name, value in case.numbers.items())
            overlap = "" if answer.overlap is None else f"{answer.overlap:.2f}"
            lines.append(
                f"| {case.recording} | {case.fault}: {numbers} | {answer.times:.1f} | {answer.answer} | {_found(answer)} | "
                f"{overlap} | {', '.join(_intervals(case))} | {_mu_t_in_words(case)} |"
            )
    return lines


def _found(answer: Answer) -> str:
    if answer.found == NOTHING:
        return {"none": "nothing missing", "not_adequate": "cannot tell"}.get(answer.verdict, answer.verdict)
    return f"{answer.found} {answer.probability:.2f}" + (" (not adequate)" if answer.verdict == "not_adequate" else "")


def _intervals(case: SemiReal) -> Iterator[str]:
    """Yield the findings for the fault's own numbers."""
    for finding in () if case.diagnosis is None else case.diagnosis.findings:
        if finding.name == case.fault:
            for name in case.numbers:
                number = finding.parameters[name]
                yield f"{_number(name, number.value)} ({_number(name, number.low)} to {_number(name, number.high)})"


def _number(name: str, value: float) -> str:
    factor, digits, unit = _SHOWN[name]
    return f"{factor * value:{digits}}{unit}"


if __name__ == "__main__":
    if len(sys.argv) > 1:
        keep(sys.argv[1], [Path(folder) for folder in sys.argv[2:]])
    PAGE.write_text(page(), encoding="utf-8")
