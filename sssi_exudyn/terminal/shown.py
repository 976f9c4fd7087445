"""Results of commands as text for stdout, or as JSON where it is asked for."""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sssi_exudyn.core.errors import SssiError

if TYPE_CHECKING:
    from sssi_exudyn.api.result import Result
    from sssi_exudyn.bodies.ski.identification import IdentifiedSki
    from sssi_exudyn.importing.days.day import DayPiece
    from sssi_exudyn.importing.many import ImportedRun
    from sssi_exudyn.recording.inspection import Inspection
    from sssi_exudyn.recording.recording import Recording
    from sssi_exudyn.results.day import Day
    from sssi_exudyn.season.season import Season
    from sssi_exudyn.terrain.profile import SurfaceFigures
    from sssi_exudyn.what_if.answer import WhatIf

Show = Callable[[Any, argparse.Namespace], str]


def show_path(name: str) -> Show:
    """Return what shows the path that a command has written, called ``name`` in JSON."""

    def show(path: Path, options: argparse.Namespace) -> str:
        return to_json({name: str(path)}) if options.json else f"{path}\n"

    return show


def to_json(value: object) -> str:
    """Write a value as JSON."""
    from sssi_exudyn.io.writing import to_json as write

    return write(value)


def show_json(value: object, _options: argparse.Namespace) -> str:
    """Show a value as JSON in any case."""
    return to_json(value)


def show_rows(rows: Sequence[object], options: argparse.Namespace) -> str:
    """Show rows as a table."""
    from sssi_exudyn.io.writing import to_plain
    from sssi_exudyn.terminal.text import format_table

    return to_json(rows) if options.json else format_table(to_plain(rows))


def show_identified(identified: IdentifiedSki, options: argparse.Namespace) -> str:
    """Show the numbers of an identified ski as a table, what an interval says, and the files that were written."""
    from sssi_exudyn.commands.catalogue import identified_rows
    from sssi_exudyn.reports.bench_page import INTERVALS, NUMBER_COLUMNS, number_rows
    from sssi_exudyn.terminal.text import format_table

    if options.json:
        return to_json(identified_rows(identified))
    columns = (identified.ski.name, *NUMBER_COLUMNS)
    rows = [dict(zip(columns, row, strict=True)) for row in number_rows(identified)]
    written = [f"{what}: {path}" for what, path in (("ski", options.out), ("page", options.report)) if path]
    return format_table(rows) + _lines([INTERVALS, *written])


def show_counts(counts: Mapping[str, object], options: argparse.Namespace) -> str:
    """Show the counts of a sweep, what matters most in it, and the path of its page."""
    from sssi_exudyn.terminal.answers import sweep_lines

    folder = options.folder if hasattr(options, "folder") else options.out
    return to_json(counts) if options.json else _lines(sweep_lines(counts, folder))


def show_turns(rows: Sequence[Mapping[str, object]], options: argparse.Namespace) -> str:
    """Show skis in turns as a table, and nothing where the rows went to a file."""
    from sssi_exudyn.terminal.text import format_table

    return format_table(rows) if options.json is None else ""


def show_result(result: Result, options: argparse.Namespace) -> str:
    """Show the answer of a result in five lines; with ``--verbose`` every figure of its summary too."""
    from sssi_exudyn.results.summary import summary_to_dict
    from sssi_exudyn.terminal.answers import answer_lines
    from sssi_exudyn.terminal.text import format_summary

    groups = summary_to_dict(result.summary)
    if options.json:
        return to_json(groups)
    return (format_summary(groups) if options.verbose else "") + _lines(answer_lines(result))


def show_whatif(answer: WhatIf, options: argparse.Namespace) -> str:
    """Show the answer of a what-if in a few lines."""
    from sssi_exudyn.what_if.answer import lines_of

    return to_json(answer) if options.json else _lines([*lines_of(answer), f"folder: {options.out}"])


def show_run(shown: Result | Season, options: argparse.Namespace) -> str:
    """Show the answer of a result, or how many runs of a season have one.

    Raises SssiError once a season is shown, where a run of it has no result.
    """
    from sssi_exudyn.season.season import Season
    from sssi_exudyn.terminal.answers import season_lines

    if not isinstance(shown, Season):
        return show_result(shown, options)
    text = to_json(shown) if options.json else _lines(season_lines(shown, options.out))
    missing = shown.runs["runs"] - shown.runs["done"]
    if missing:
        sys.stdout.write(text)
        raise SssiError(f"{missing} of {shown.runs['runs']} runs have no result; {options.out / 'season.csv'} says why")
    return text


def show_inspection(inspection: Inspection, options: argparse.Namespace) -> str:
    """Show what is in a recording."""
    from sssi_exudyn.recording.inspection import format_inspection

    return to_json(inspection) if options.json else format_inspection(inspection)


def show_surface(figures: SurfaceFigures, options: argparse.Namespace) -> str:
    """Show the snow surface in a line."""
    from sssi_exudyn.recording.inspection import format_surface

    return to_json(figures) if options.json else f"{format_surface(figures)}\n"


def show_imported(imported: Recording | Sequence[ImportedRun] | Sequence[DayPiece], options: argparse.Namespace) -> str:
    """Show what is in an imported recording, or the runs of a folder or of a day as a table.

    Raises SssiError once the table is shown, where a run has no recording.
    """
    from sssi_exudyn.importing.days.day import DayPiece
    from sssi_exudyn.recording.inspection import inspect_recording
    from sssi_exudyn.recording.recording import Recording
    from sssi_exudyn.terminal.answers import import_lines

    if isinstance(imported, Recording):
        if options.json or options.verbose:
            return show_inspection(inspect_recording(imported), options)
        return _lines(import_lines(imported, options.out))
    from sssi_exudyn.io.writing import to_plain
    from sssi_exudyn.terminal.text import format_table

    days = [row for row in imported if isinstance(row, DayPiece)]
    if days:
        return _show_day(days, options)
    hidden = ("assumed", "notes", "start_utc", "vertical_m", "mean_mps", "top_mps")
    brief = [{name: row[name] for name in row if name not in hidden} for row in to_plain(imported)]
    text = to_json(imported) if options.json else format_table(brief)
    words = _not_imported([row.status for row in imported])
    if words:
        sys.stdout.write(text)
        raise SssiError(f"{words}; {options.out / 'recordings.csv'} says why")
    return text


def _not_imported(statuses: Sequence[str]) -> str:
    """Count what has no recording after an import of a folder; "" where all of it has one."""
    counts = Counter(statuses)
    runs = len(statuses) - counts["not read"]
    words = [
        f"{counts['failed']} of {runs} runs could not be imported" if counts["failed"] else "",
        f"{counts['not read']} files were not read" if counts["not read"] else "",
        f"{counts['listed']} of {runs} runs have no recording" if counts["listed"] else "",
    ]
    return ", ".join(filter(None, words))


def _show_day(pieces: Sequence[DayPiece], options: argparse.Namespace) -> str:
    """Show the pieces of a day as a table after a line about them.

    Raises SssiError once they are shown, where a run has no recording.
    """
    from sssi_exudyn.importing.days.day import TABLE
    from sssi_exudyn.io.writing import to_plain
    from sssi_exudyn.terminal.text import format_table

    runs = [piece for piece in pieces if piece.run is not None]
    hidden = ("first_fix", "last_fix", "file", "sha256", "start_s" if pieces[0].start_utc else "start_utc")
    brief = [{name: row[name] for name in row if name not in hidden} for row in to_plain(pieces)]
    made = sum(bool(piece.recording) for piece in runs)
    words = f"{pieces[0].file} holds {len(runs)} runs: a folder of each in {options.out}; --run N takes one alone\n"
    text = to_json(pieces) if options.json else words * bool(made) + format_table(brief)
    if made == len(runs):
        return text
    sys.stdout.write(text)
    table = options.out / TABLE
    if not made and all(piece.status == "listed" for piece in runs):
        reason = "a recording needs the skier's motion too: add a sensor (such as pocket=phone.csv) or a capture"
        raise SssiError(f"{table} lists the {len(runs)} runs of {pieces[0].file}; {reason}")
    raise SssiError(f"{len(runs) - made} of {len(runs)} runs have no recording; {table} says why")


def show_muscles(shown: Result | Sequence[Mapping[str, object]], options: argparse.Namespace) -> str:
    """Show the muscles of a result in a few lines, all of it with ``--verbose``, or the list of all muscles as CSV."""
    from sssi_exudyn.terminal.answers import muscle_lines
    from sssi_exudyn.terminal.text import format_csv, format_summary, format_table

    if isinstance(shown, Sequence):
        return to_json(shown) if options.json else format_csv(shown)
    from sssi_exudyn.results.summary import summary_to_dict

    groups = summary_to_dict(shown.summary)
    about = {name: groups[name] for name in ("recording", "muscles")}
    if options.json:
        return to_json(about)
    every = format_summary(about) + format_table(about["muscles"]["lacking"]) if options.verbose else ""
    return every + _lines(muscle_lines(shown))


def show_diagnosis(diagnosed: Result | Day, options: argparse.Namespace) -> str:
    """Show a diagnosis: where, what, how sure, how much better, what next; or the sentence about several runs."""
    from sssi_exudyn.results.day import Day
    from sssi_exudyn.terminal.answers import day_lines, diagnosis_lines

    if isinstance(diagnosed, Day):
        return to_json(diagnosed) if options.json else _lines(day_lines(diagnosed, options.out))
    diagnosis = diagnosed.diagnosis
    assert diagnosis is not None
    if options.json:
        return to_json(diagnosis)
    return (f"{diagnosis.sentence}\n" if options.verbose else "") + _lines(diagnosis_lines(diagnosed))


def _lines(lines: Sequence[str]) -> str:
    return "".join(f"{line}\n" for line in lines)
