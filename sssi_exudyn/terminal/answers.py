"""Results as a few lines for a terminal: the answer first, then where its page is."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from sssi_exudyn.api.result import Result
    from sssi_exudyn.recording.recording import Recording
    from sssi_exudyn.results.day import Day
    from sssi_exudyn.season.season import Season

MORE: Final = "--verbose prints every figure"
_STRONGEST: Final = 3
"""Figures of a sweep of which the strongest parameter is named."""


def answer_lines(result: Result) -> list[str]:
    """Return friction, turns, agreement, verdict, and the page's path."""
    from sssi_exudyn.reports.answer import lines_of

    count = len(result.summary.notices)
    remarks = f"; {count} {'remark' if count == 1 else 'remarks'} on the recording" if count else ""
    return [*lines_of(result.summary), f"page: {_page(result.folder)} ({MORE}{remarks})"]


def diagnosis_lines(result: Result) -> list[str]:
    """Return the verdict, then where, what, how sure, how much better, friction, what next, whether to trust the run,
    and the page's path.
    """
    from sssi_exudyn.reports.diagnosis_tiles import lines_of_diagnosis
    from sssi_exudyn.reports.verdict import verdict_of

    diagnosis = result.diagnosis
    assert diagnosis is not None
    by = " (by the reduced model alone)" if diagnosis.tier == "reduced" else ""
    first = f"{diagnosis.recording}: {diagnosis.verdict.replace('_', ' ')}{by}"
    trust = verdict_of(result.summary)
    return [
        first,
        *lines_of_diagnosis(diagnosis),
        f"the run with this: {trust.words}. {trust.sentence}",
        f"page: {_page(result.folder)} (--verbose prints the sentence)",
    ]


def day_lines(day: Day, out: Path) -> list[str]:
    """Return the sentence about several runs, and the page's path."""
    return [day.sentence, f"page: {_page(out)}"]


def muscle_lines(result: Result) -> list[str]:
    """Return how often the muscles suffice, the largest loads of joints, what is lacking, and the page's path."""
    figures = result.summary.muscles
    assert figures is not None
    share = f"{100.0 * figures.strong_enough_share:.0f} %"
    largest = sorted(figures.contact_peak_bodyweights.items(), key=lambda load: -load[1])[:_STRONGEST]
    loads = ", ".join(f"{joint.replace('_', ' ')} {load:.1f}" for joint, load in largest)
    lacking = ", ".join(
        f"{joint.coordinate.replace('_', ' ')} {joint.worst_Nm:.0f} N m at {joint.at_s:.1f} s"
        for joint in figures.lacking[:_STRONGEST]
    )
    return [
        f"{result.summary.recording}: {figures.count} muscles make all joint moments in {share} of the samples",
        f"largest joint loads (body weights): {loads}",
        f"lacking at most: {lacking or 'nothing'}",
        f"page: {_page(result.folder)} ({MORE})",
    ]


def sweep_lines(counts: Mapping[str, object], folder: Path) -> list[str]:
    """Return how many runs are complete, what matters most, and the page's path where there is one."""
    from sssi_exudyn.sweeps.page import PAGE

    others = ", ".join(f"{counts[name]} {name}" for name in ("diverged", "failed", "crashed", "left") if counts[name])
    lines = [
        f"{counts['name']}: {counts['done']} of {counts['runs']} runs complete" + (f", {others}" if others else "")
    ]
    if counts.get("running"):
        rate, left = counts["per_minute"], counts["time_left_s"]
        pace = "" if rate is None else f", {rate:.0f} a minute"
        lines.append(f"running{pace}" + ("" if left is None else f", {left:.0f} s left"))
    if (folder / PAGE).is_file():
        lines += [*_strongest(folder), f"page: {folder / PAGE}"]
    return lines


def season_lines(season: Season, folder: Path) -> list[str]:
    """Return how many runs have a result, what stands out, and the page's path."""
    from sssi_exudyn.season.page import PAGE
    from sssi_exudyn.season.page_descents import sentences_of
    from sssi_exudyn.season.table import CSV, read_season_table

    table = read_season_table(folder)
    counts = season.runs
    others = ", ".join(f"{counts[name]} {name}" for name in ("diverged", "failed", "crashed", "left") if counts[name])
    lines = [f"{counts['done']} of {counts['runs']} runs have a result" + (f", {others}" if others else "")]
    without = len(table) - counts["runs"] + counts["left"]
    if without:
        lines.append(f"{without} rows of the import have no recording")
    lines += [
        f"stands out: {row.run}: {row.stands_out}" for row in table[table["stands_out"] != ""].head(3).itertuples()
    ]
    for descent in season.descents[:3]:
        about = f"descent {descent.place}, {len(descent.runs)} runs together"
        lines += [f"{about}: {sentence}" for sentence in sentences_of(descent)[:3]]
    return [*lines, f"table: {folder / CSV}", f"page: {folder / PAGE}"]


def import_lines(recording: Recording, out: Path) -> list[str]:
    """Return what was made, and what to do with it."""
    instruments = {"gps": recording.gps, "insoles": recording.insoles, "poles": recording.poles}
    names = ", ".join(["motion", *(name for name, instrument in instruments.items() if instrument is not None)])
    return [
        f"{out}: a recording of {recording.stop - recording.start:.1f} s with {names}",
        *(f"  note: {notice}" for notice in recording.notices),
        f"next: sssi inspect {out}, then sssi run {out} --out {out}_result",
    ]


def _page(folder: Path | None) -> str:
    from sssi_exudyn.results.folder import REPORT

    return "none was written" if folder is None else str(folder / REPORT)


def _strongest(folder: Path) -> list[str]:
    """Name the strongest parameter of the first figures of a sweep, for its first recording."""
    from sssi_exudyn.sweeps.sensitivity_indices import TOTAL
    from sssi_exudyn.sweeps.sweep import read_indices

    indices = read_indices(folder)
    ranked = indices[indices["index"].isin(TOTAL)]
    lines = []
    for output in list(dict.fromkeys(ranked["output"]))[:_STRONGEST]:
        rows = ranked[ranked["output"] == output]
        rows = rows[rows["recording"] == rows["recording"].iloc[0]].sort_values("value", ascending=False)
        lines.append(
            f"{output}: {rows['parameter'].iloc[0]} matters most ({rows['index'].iloc[0]} {rows['value'].iloc[0]:.2g})"
        )
    return lines
