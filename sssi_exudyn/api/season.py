"""``run_season`` and ``load_season``: every recording of a folder.  ``sssi run`` of a folder of recordings is the same.

The command line takes the options of ``run`` and those that only ``run_season`` has.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypedDict, Unpack

from sssi_exudyn.api.arguments import (
    AnyPath,
    OutFolder,
    Plugins,
    ProgressWanted,
    Workers,
    stretch_of,
    use_plugins,
)
from sssi_exudyn.core.checked import checked
from sssi_exudyn.core.choices import Cluster, HeadingMode, Snow
from sssi_exudyn.core.command_line import Argument, Option
from sssi_exudyn.runtime.threads import with_one_thread_for_products

if TYPE_CHECKING:
    from sssi_exudyn.api.season_result import SeasonResult
    from sssi_exudyn.contact.term import Term
    from sssi_exudyn.recording.recording import Recording
    from sssi_exudyn.season.plan import Options
    from sssi_exudyn.season.season import Season


class RunOptions(TypedDict, total=False):
    """Options of ``run``, which a season has for all its runs."""

    terms: Sequence[Any]
    snow: Snow
    heading: HeadingMode | None
    seconds: str | tuple[float, float] | None
    csv: bool
    quick: bool


@checked
@with_one_thread_for_products
def run_season(
    folder: Annotated[AnyPath, Argument("FOLDER", Path)],
    out: OutFolder,
    *,
    workers: Workers | None = None,
    scheduler: Annotated[str, Option(metavar="tcp://HOST:PORT")] | None = None,
    cluster: Cluster | None = None,
    plugins: Plugins = (),
    progress: ProgressWanted = False,
    **options: Unpack[RunOptions],
) -> SeasonResult:
    """Fit, simulate, validate and report every recording of a folder, with one table and one page of all.

    A run that fails does not stop the others.  Runs that are done are not done again, unless their files, the options
    or the versions have changed.

    Parameters
    ----------
    folder : the folder of the recordings, which may be in folders within it
    out : folder of the results
    workers : of a folder of recordings: processes or cluster jobs (default: one a core).  In Python 1 works in this
        process, without starting any.
    scheduler : of a folder of recordings: run on the workers of this Dask scheduler
    cluster : of a folder of recordings: start a Dask cluster and run there
    plugins : files of Python or installed packages to load first (``use_plugin``); their code is run
    progress : True for lines on stderr, or a function of stage, share done (None where unknown) and detail
    options : those of ``run``: ``terms``, ``snow``, ``heading``, ``seconds``, ``csv`` and ``quick``

    Several workers import the calling script: call it below ``if __name__ == "__main__":``.  Raises InputError where no
    recording is in the folder, or where ``out`` cannot be written.

    Examples
    --------
    >>> season = sssi_exudyn.run_season("runs", "results", workers=1)
    >>> season.table.groupby("place")["effective_friction"].median()
    """
    from sssi_exudyn.api.season_result import SeasonResult

    use_plugins(plugins)
    here = workers == 1 and scheduler is None and cluster is None
    season = do_season(Path(folder), Path(out), options, progress, (workers, scheduler, cluster), in_this_process=here)
    return SeasonResult(Path(out), season)


@checked
def load_season(folder: AnyPath) -> SeasonResult:
    """Load the season in a folder that ``run_season`` has written.

    Parameters
    ----------
    folder : the season's folder

    Raises InputError where there is none.

    Examples
    --------
    >>> sssi_exudyn.load_season("results").table.sort_values("top_speed_mps").tail(3)
    """
    from sssi_exudyn.api.season_result import SeasonResult
    from sssi_exudyn.season.season import read_season

    return SeasonResult(Path(folder), read_season(Path(folder)))


def do_season(
    folder: Path,
    out: Path,
    options: Mapping[str, Any],
    progress: ProgressWanted,
    where: tuple[int | None, str | None, Cluster | None],
    *,
    in_this_process: bool = False,
) -> Season:
    """Do the runs of a season ``where`` says: number of workers, a Dask scheduler, a cluster; or all of them here."""
    from sssi_exudyn.api.progress import progress_of
    from sssi_exudyn.commands.runs import terms_named
    from sssi_exudyn.season.plan import options_of
    from sssi_exudyn.season.season import Where
    from sssi_exudyn.season.season import run_season as work
    from sssi_exudyn.sweeps.workers.pools import pool_of, this_process

    workers, scheduler, cluster = where
    added = terms_named(options.get("terms", ()))
    stretch = stretch_of(options.get("seconds"))
    snow, heading = options.get("snow", "paper"), options.get("heading")
    csv, quick = options.get("csv", False), options.get("quick", False)
    chosen = options_of(added, snow, heading, stretch, csv=csv, quick=quick)
    pool = this_process if in_this_process else pool_of(scheduler, cluster, out.resolve())
    return work(folder, out, chosen, added, perform, Where(pool, workers), progress_of(progress))


def perform(folder: Path, task: bytes) -> str:
    """Do a run of a season in a worker process, with the command line's build of Exudyn, and return its status.

    Raises ValueError where the task does not hold a job and a run.
    """
    from sssi_exudyn.runtime.exudyn_build import take_fast_build

    take_fast_build()
    from sssi_exudyn.io.typed import decode
    from sssi_exudyn.season.plan import SeasonJob
    from sssi_exudyn.season.season import perform_run
    from sssi_exudyn.sweeps.plan import SweepRun

    return perform_run(folder, *decode(task, tuple[SeasonJob, SweepRun]), _run_one)


def _run_one(recording: Recording, out: Path, options: Options, terms: tuple[Term, ...]) -> None:
    """Do one run of a season as ``run`` does it."""
    from sssi_exudyn.api.runs import run

    chosen: dict[str, Any] = {
        "snow": options.snow,
        "heading": options.heading,
        "csv": options.csv,
        "quick": options.quick,
    }
    if options.seconds is not None:
        first, last = options.seconds
        chosen["seconds"] = (-float("inf") if first is None else first, float("inf") if last is None else last)
    run(recording, out, terms=terms, **chosen)
