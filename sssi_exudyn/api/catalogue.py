"""``terms``, ``turn`` and ``ski identify``: force terms and skis alone, without a run; and plug-ins.

Each function is the one signature of its command: the command line makes its options from it.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from sssi_exudyn.api.arguments import AnyPath, ProgressWanted, path_of
from sssi_exudyn.core.checked import checked
from sssi_exudyn.core.command_line import Argument, Option
from sssi_exudyn.runtime.threads import with_one_thread_for_products

if TYPE_CHECKING:
    from sssi_exudyn.bodies.ski.identification import IdentifiedSki


@checked
def terms() -> list[dict[str, str | float]]:
    """List every force term with its parameters.

    A row is a parameter: origin (built in, or a plug-in), unit, default, bounds, source, meaning, formula.

    Examples
    --------
    >>> pandas.DataFrame(sssi_exudyn.terms())
    """
    from sssi_exudyn import commands

    return commands.terms()


@checked
def hypotheses() -> list[dict[str, str | float]]:
    """List every hypothesis of the diagnosis.

    A row is a hypothesis.  It has its name, what it adds to the model, what it proposes and its prior probability.
    Its origin is built in, or a plug-in.

    Examples
    --------
    >>> pandas.DataFrame(sssi_exudyn.hypotheses())
    """
    from sssi_exudyn import commands

    return commands.hypotheses()


@checked
def data_dictionary() -> list[dict[str, str]]:
    """List every column of a result's tables.

    A row is a column: file, name, unit, frame, meaning.  A result's ``columns.csv`` lists those that it has.

    Examples
    --------
    >>> columns = pandas.DataFrame(sssi_exudyn.data_dictionary())
    >>> columns[columns["name"] == "pelvis_f_m"]
    """
    from sssi_exudyn import commands

    return commands.data_dictionary()


@checked
@with_one_thread_for_products
def turn(
    skis: Annotated[AnyPath | Sequence[AnyPath], Argument("SKI", count="+")],
    edge: Annotated[str | float | Sequence[float], Option(metavar="DEG", read=str)] = "30:70",
    speed: Annotated[float, Option(metavar="M/S")] = 10.0,
    *,
    load: Annotated[float, Option(metavar="N")] = 700.0,
    page: Annotated[AnyPath, Option("--out", metavar="PAGE")] | None = None,
    progress: ProgressWanted = False,
) -> list[dict[str, str | float | None]]:
    """Compare skis in steady turns: radius, side reserve, losses.

    Their edges cut the snow.  A row is a ski and an edge angle, and the radius has its bar.

    Parameters
    ----------
    skis : a ski of the catalogue, or a file with one.  Python takes one or several.
    edge : edge angles in degrees: 60, or 30,45,60, or FROM:TO[:STEP].  Python takes numbers too.
    speed : of the ski, in m/s
    load : along the snow's normal, in N
    page : a page that sets the skis side by side (.html)
    progress : True for lines on stderr, or a function of stage, share done (None where unknown) and detail

    Raises InputError for what is no ski or no edge angle.

    Examples
    --------
    >>> rows = sssi_exudyn.turn(["slalom_165", "volkl_kendo_184"], "45,60")
    """
    from sssi_exudyn.api.progress import progress_of
    from sssi_exudyn.commands.ski_turn import compare_skis, edge_angles

    names = [os.fspath(ski) for ski in ([skis] if isinstance(skis, str | os.PathLike) else skis)]
    numbers = {"speed": speed, "load": load}
    return compare_skis(names, edge_angles(edge), numbers, path_of(page), progress_of(progress))


@checked
def identify(
    folder: Annotated[AnyPath, Argument("FOLDER", Path)],
    out: Annotated[AnyPath, Option(metavar="TOML")] | None = None,
    *,
    report: Annotated[AnyPath, Option(metavar="PAGE")] | None = None,
) -> IdentifiedSki:
    """Identify stiffness, density and damping of a ski from bench tests.

    Parameters
    ----------
    folder : folder with bench.toml and its tables
    out : file for the ski, which recordings and sssi ski turn can name
    report : a page with the tests and their fits (.html)

    Returns the ski, and each number with its 95 % interval.  Raises InputError for bench tests that cannot be used.

    Examples
    --------
    >>> identified = sssi_exudyn.identify("bench", "my_ski.toml")
    >>> identified.ski.sidecut_radius(), identified.young_modulus.low
    """
    from sssi_exudyn import commands

    return commands.identify(Path(folder), path_of(out), path_of(report))


@checked
def use_plugin(plugin: AnyPath | object) -> dict[str, Any]:
    """Put other people's force terms, hypotheses and readers to use, and return them by name; their code is run.

    Parameters
    ----------
    plugin : a file that ends in .py, the name of an installed package with entry points, or a class that was defined
        here, in a notebook or a script

    A file may import modules that stand next to it.  Raises InputError where its code fails, where it offers nothing,
    or where a name is taken.

    Examples
    --------
    >>> WetSnow = sssi_exudyn.use_plugin("examples/my_snow.py")["WetSnow"]
    >>> sssi_exudyn.check_term(WetSnow)
    """
    from sssi_exudyn.plugins import use_plugin as use

    return use(os.fspath(plugin) if isinstance(plugin, os.PathLike) else plugin)
