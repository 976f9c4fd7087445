"""``load`` and ``report``: results that are there.  The command line makes its options from ``report``'s signature."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from sssi_exudyn.api.arguments import AnyPath, Plugins, Results, use_plugins
from sssi_exudyn.core.checked import checked
from sssi_exudyn.core.command_line import Option
from sssi_exudyn.core.errors import InputError

if TYPE_CHECKING:
    from sssi_exudyn.api.result import Result


@checked
def load(folder: AnyPath, *, plugins: Plugins = ()) -> Result:
    """Load the result in a folder that ``run``, ``fit``, ``simulate`` or ``diagnose`` has written.

    Parameters
    ----------
    folder : the result's
    plugins : files of Python or installed packages to load first (``use_plugin``); their code is run

    Raises InputError where there is none, or where a file of it cannot be read.

    Examples
    --------
    >>> result = sssi_exudyn.load("results/beginner")
    >>> result.plot_track()
    """
    from sssi_exudyn.api.result import load_result

    use_plugins(plugins)
    return load_result(Path(folder))


@checked
def report(results: Results, out: Annotated[AnyPath, Option(metavar="FILE")]) -> Path:
    """Write the report of a result, or of several side by side.

    Parameters
    ----------
    results : folder of a result, or of a sweep.  Python takes one or several, also as a ``Result``.
    out : the report (.html or .pdf)

    Returns that file's path.  Raises InputError for another ending, and for a folder without a result.

    Examples
    --------
    >>> sssi_exudyn.report(["results/beginner", "results/intermediate"], "both.html")
    """
    from sssi_exudyn import commands
    from sssi_exudyn.api.result import Result, load_result
    from sssi_exudyn.commands.pages import write_report
    from sssi_exudyn.sweeps.sweep import is_sweep

    given = list(results) if isinstance(results, Sequence) and not isinstance(results, str) else [results]
    for result in given:
        if not isinstance(result, Result | str | os.PathLike):
            problem = f"a {type(result).__name__} is no result"
            raise InputError("report", "results", problem, "give results, or the paths of their folders")
    folders = [Path(result) for result in given if not isinstance(result, Result)]
    if folders and is_sweep(folders[0]):
        return commands.report(folders, Path(out))
    loaded = [result if isinstance(result, Result) else load_result(Path(result)) for result in given]
    named = [
        (result.stored, f"result {number}" if result.folder is None else result.folder.resolve().name)
        for number, result in enumerate(loaded, 1)
    ]
    return write_report(named, Path(out))
