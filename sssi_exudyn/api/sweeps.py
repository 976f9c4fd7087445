"""``sweep`` and ``load_sweep``: many runs.  The command line makes its options from the functions' signatures."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from sssi_exudyn.api.arguments import AnyPath, OutFolder, Plugins, ProgressWanted, Workers, use_plugins
from sssi_exudyn.core.checked import checked
from sssi_exudyn.core.choices import Cluster
from sssi_exudyn.core.command_line import Argument, Option
from sssi_exudyn.runtime.threads import with_one_thread_for_products

if TYPE_CHECKING:
    from sssi_exudyn.api.sweep_result import SweepResult


@checked
@with_one_thread_for_products
def sweep(
    file: Annotated[AnyPath | Mapping[str, Any], Argument("FILE", Path)],
    out: OutFolder,
    *,
    workers: Workers | None = None,
    scheduler: Annotated[str, Option(metavar="tcp://HOST:PORT")] | None = None,
    cluster: Cluster | None = None,
    plugins: Plugins = (),
    progress: ProgressWanted = False,
) -> SweepResult:
    """Start or continue a sweep.

    Parameters
    ----------
    file : the sweep's TOML file.  It may be a mapping of the same content, whose paths count from the working
        directory.
    out : folder of the sweep
    workers : processes or cluster jobs (default: one a core).  In Python 1 works in this process, without starting any.
    scheduler : run on the workers of this Dask scheduler
    cluster : start a Dask cluster and run there
    plugins : files of Python or installed packages to load first (``use_plugin``); their code is run
    progress : True for lines on stderr, or a function of stage, share done (None where unknown) and detail

    Several workers import the calling script: call it below ``if __name__ == "__main__":``.

    Examples
    --------
    >>> swept = sssi_exudyn.sweep("examples/sweep_edge_angle.toml", "results/edge_angle", workers=1)
    >>> swept.table.plot.scatter("friction.mu_t", "mean_speed_mps")
    """
    from sssi_exudyn.api.progress import progress_of
    from sssi_exudyn.api.sweep_result import SweepResult
    from sssi_exudyn.sweeps.sweep import sweep as do

    use_plugins(plugins)
    do(
        file if isinstance(file, Mapping) else Path(file),
        Path(out),
        workers=workers,
        scheduler=scheduler,
        cluster=cluster,
        progress=progress_of(progress),
        in_this_process=workers == 1 and scheduler is None and cluster is None,
    )
    return SweepResult(Path(out))


@checked
def load_sweep(folder: Annotated[AnyPath, Argument("DIR", Path)]) -> SweepResult:
    """Load the sweep in a folder, finished or not.

    Parameters
    ----------
    folder : the sweep's folder

    Raises InputError where there is none.

    Examples
    --------
    >>> sssi_exudyn.load_sweep("results/edge_angle").counts["done"]
    35
    """
    from sssi_exudyn.api.sweep_result import SweepResult
    from sssi_exudyn.sweeps.sweep import status

    status(Path(folder))
    return SweepResult(Path(folder))
