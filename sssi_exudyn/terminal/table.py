"""Every command of ``sssi``: its function in ``api``, and what the command line does differently from Python."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

from sssi_exudyn.api import benchmark, catalogue, diagnosis, muscles, recordings, results, runs, season, sweeps, whatif
from sssi_exudyn.core.choices import Cluster
from sssi_exudyn.core.command_line import Argument, Option
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.runtime.progress import Progress
from sssi_exudyn.terminal import shown
from sssi_exudyn.terminal.command import Command, Group
from sssi_exudyn.terminal.signature import Parameter


def _diagnose(folders: list[Path], out: Path, *, progress: Progress, **options: Any) -> Any:
    """Diagnose one recording, or several of one day together."""
    if len(folders) > 1:
        return diagnosis.diagnose_day(folders, out, progress=progress, **options)
    return diagnosis.diagnose(folders[0], out, progress=progress, **options)


def _run(
    folder: Path,
    out: Path,
    *,
    progress: Progress,
    workers: int | None,
    scheduler: str | None,
    cluster: Cluster | None,
    **options: Any,
) -> Any:
    """Run one recording, or every recording of a folder; a worker is a process even where it is the only one."""
    from sssi_exudyn.recording.recording import FILE

    where = (workers, scheduler, cluster)
    if (folder / FILE).exists() or not _holds_folders(folder):
        if any(where):
            problem = "workers are for a folder of recordings, and this is one"
            raise InputError(folder, "", problem, "leave --workers, --scheduler and --cluster out")
        return runs.run(folder, out, progress=progress, **options)
    return season.do_season(folder, out, options, progress, where)


def _holds_folders(folder: Path) -> bool:
    """Tell whether a path is a folder with folders in it, so that recordings may be there."""
    return folder.is_dir() and any(path.is_dir() for path in folder.iterdir())


def _muscles(run: Path | None, out: Path | None, *, listed: bool, progress: Progress, **options: Any) -> Any:
    """List muscles, or compute those of a result, into its own folder where no other is given."""
    if listed:
        return muscles.list_muscles(options["muscles"])
    if run is None:
        raise InputError("muscles", "FOLDER", "no folder is given", "give a result or a recording, or --list")
    from sssi_exudyn.results.folder import SUMMARY

    if out is None and not (run / SUMMARY).is_file():
        raise InputError(run, "", "this is not a result", "give a result's folder, or a recording's and --out")
    return muscles.muscles(run, out or run, progress=progress, **options)


def _turn(skis: list[str], edge: str, speed: float, *, json: Path | None, progress: Progress, **options: Any) -> Any:
    """Compare skis, and write the rows to a file where one is given."""
    rows = catalogue.turn(skis, edge, speed, progress=progress, **options)
    if json is not None:
        from sssi_exudyn.io.writing import write_atomically

        write_atomically(json, shown.to_json(rows))
    return rows


def _sweep(file: Path, out: Path, *, progress: Progress, **where: Any) -> Any:
    """Do a sweep; one worker is a process too, so that a run that kills it does not end the sweep."""
    from sssi_exudyn.sweeps import sweep as work

    return work.sweep(file, out, progress=progress, **where)


def _status(folder: Path) -> Any:
    """Count the runs of a sweep."""
    from sssi_exudyn.sweeps import sweep as work

    return work.status(folder)


def _resume(folder: Path, *, progress: Progress, **where: Any) -> Any:
    """Continue a sweep."""
    from sssi_exudyn.sweeps import sweep as work

    return work.resume(folder, progress=progress, **where)


def _retry(folder: Path, *, failed: bool, progress: Progress, **where: Any) -> Any:
    """Continue a sweep and repeat its failed runs."""
    from sssi_exudyn.sweeps import sweep as work

    return work.retry(folder, progress=progress, **where)


_LIST: Final = Parameter(
    "listed", bool, Option("--list"), "list every muscle with its parameters as CSV instead", False
)
_JSON_FILE: Final = Parameter(
    "json", Path, Option(metavar="FILE"), "write the figures there instead of a table", default=None
)
_SWEEP_FOLDER: Final = Parameter("folder", Path, Argument("DIR", Path), "the sweep's folder", by_name=False)
_FAILED: Final = Parameter("failed", bool, Option(), "repeat failed runs")
_NOT_OF_BEGUN: Final = ("file", "out")
"""What a sweep that was begun holds itself."""
GROUPS: Final = {
    "benchmark": Group("test the diagnosis on cases with known answers", "WHAT"),
    "sweep": Group(
        "run many parameter values: FILE --out DIR, or status, resume, retry of a DIR",
        usage="sssi sweep FILE --out DIR, or sssi sweep {status,resume,retry} DIR",
    ),
    "ski": Group("work on a ski alone"),
}
COMMANDS: Final = (
    Command("example", recordings.example, shown.show_path("recording"), "commands.examples"),
    Command("inspect", recordings.inspect, shown.show_inspection, "commands.recordings"),
    Command("terrain", recordings.terrain, shown.show_surface, "commands.recordings"),
    Command("import", recordings.import_files, shown.show_imported, "commands.recordings", call=recordings.import_any),
    Command("simulate", runs.simulate, shown.show_result, "commands.runs"),
    Command("fit", runs.fit, shown.show_result, "commands.runs"),
    Command("validate", runs.validate, shown.show_result, "commands.pages"),
    Command("diagnose", diagnosis.diagnose, shown.show_diagnosis, "commands.diagnosis", call=_diagnose),
    Command("benchmark diagnosis", benchmark.benchmark, shown.show_json, "commands.diagnosis"),
    Command("benchmark recordings", benchmark.diagnose_known, shown.show_rows, "commands.diagnosis"),
    Command("benchmark semi-real", benchmark.semi_real, shown.show_rows, "commands.diagnosis"),
    Command("run", runs.run, shown.show_run, "commands.runs", call=_run, several=season.run_season),
    Command("whatif", whatif.whatif, shown.show_whatif, "commands.what_if"),
    Command("report", results.report, shown.show_path("report"), "commands.pages"),
    Command("sweep start", sweeps.sweep, shown.show_counts, "sweeps.sweep", call=_sweep),
    Command(
        "sweep status",
        sweeps.load_sweep,
        shown.show_counts,
        "sweeps.sweep",
        help="show the progress of a sweep",
        call=_status,
    ),
    Command(
        "sweep resume",
        sweeps.sweep,
        shown.show_counts,
        "sweeps.sweep",
        help="continue a sweep",
        without=_NOT_OF_BEGUN,
        more=(_SWEEP_FOLDER,),
        call=_resume,
    ),
    Command(
        "sweep retry",
        sweeps.sweep,
        shown.show_counts,
        "sweeps.sweep",
        help="continue a sweep and repeat its failed runs",
        without=_NOT_OF_BEGUN,
        more=(_SWEEP_FOLDER, _FAILED),
        call=_retry,
    ),
    Command("terms", catalogue.terms, shown.show_rows, "commands.catalogue"),
    Command("muscles", muscles.muscles, shown.show_muscles, "commands.muscles_command", more=(_LIST,), call=_muscles),
    Command("hypotheses", catalogue.hypotheses, shown.show_rows, "commands.catalogue"),
    Command("columns", catalogue.data_dictionary, shown.show_rows, "commands.catalogue"),
    Command("ski identify", catalogue.identify, shown.show_identified, "commands.catalogue"),
    Command("ski turn", catalogue.turn, shown.show_turns, "commands.ski_turn", more=(_JSON_FILE,), call=_turn),
)
