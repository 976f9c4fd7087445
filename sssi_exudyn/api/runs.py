"""``simulate``, ``fit``, ``run`` and ``validate``: from a recording to a result.

Each function is the one signature of its command: the command line makes its options from it.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from sssi_exudyn.api.arguments import (
    AnyPath,
    ModelOrFile,
    OutFolder,
    Plugins,
    ProgressWanted,
    RecordingFolder,
    RecordingOrFolder,
    Seconds,
    Terms,
    model_in,
    path_of,
    recording_of,
    stretch_of,
    use_plugins,
)
from sssi_exudyn.core.checked import checked
from sssi_exudyn.core.choices import Backend, HeadingMode, Method, Snow
from sssi_exudyn.core.command_line import Option
from sssi_exudyn.runtime.threads import with_one_thread_for_products

if TYPE_CHECKING:
    from sssi_exudyn.api.exudyn_model import ExudynModel
    from sssi_exudyn.api.result import Result
    from sssi_exudyn.model.model import Model


@checked
def model_of(recording: RecordingOrFolder) -> Model:
    """Make the paper's model of a recorded skier: nothing is fitted, friction is the default, the GPS gives the start.

    Examples
    --------
    >>> model = sssi_exudyn.model_of("examples/beginner")
    >>> slower = model.with_values({"friction.mu_t": 0.12})
    """
    from sssi_exudyn.commands.recordings import SILENT, read_folder
    from sssi_exudyn.model.from_recording import model_of as make

    return make(*read_folder(recording_of(recording), SILENT))


@checked
def read_model(file: AnyPath, *, plugins: Plugins = ()) -> Model:
    """Read the model in a ``model.toml``, such as a result's.

    Parameters
    ----------
    file : the model's file, in whose folder are the files that it names
    plugins : files of Python or installed packages to load first (``use_plugin``); their code is run

    Raises InputError for whatever is missing, unknown or outside its bounds.

    Examples
    --------
    >>> model = sssi_exudyn.read_model("results/beginner/model.toml")
    """
    from sssi_exudyn.model.toml import read_model as read

    use_plugins(plugins)
    return read(Path(file))


@checked
def build(
    recording: RecordingOrFolder,
    model: ModelOrFile | None = None,
    *,
    terms: Terms = (),
    snow: Snow = "paper",
    seconds: Seconds | None = None,
    plugins: Plugins = (),
    progress: ProgressWanted = False,
) -> ExudynModel:
    """Build the model in Exudyn, settled on the snow at the start of the run.

    Parameters
    ----------
    recording : the recording: a folder with recording.toml, or a ``Recording``
    model : the model, such as a result's model.toml.  Without one friction is the default.
    terms : force terms to add, by name with their default numbers (sssi terms), or objects
    snow : friction at the foot as in the paper, or snow that edges cut.  It is ``"paper"`` or ``"carving"``.
    seconds : the stretch of the recording to use, in s of its clock, such as 3:12.5 (default: all of it)
    plugins : files of Python or installed packages to load first (``use_plugin``); their code is run
    progress : True for lines on stderr, or a function of stage, share done (None where unknown) and detail

    Raises InputError for bad input, such as a model whose heading is to be found.

    Examples
    --------
    >>> model = sssi_exudyn.build("examples/beginner", seconds=":3")
    >>> model.objects["skier"], model.nodes["left_ski_node_0"]
    >>> result = model.run()
    """
    from sssi_exudyn.api.exudyn_model import ExudynModel
    from sssi_exudyn.api.progress import progress_of
    from sssi_exudyn.commands.recordings import SHORTEST_RUN
    from sssi_exudyn.commands.runs import build_model, choose_model, open_recording, terms_named

    use_plugins(plugins)
    added = terms_named(terms)
    source, stretch = recording_of(recording), stretch_of(seconds)
    with open_recording(source, None, progress_of(progress), stretch, SHORTEST_RUN) as work:
        opened = build_model(work, choose_model(work, model_in(model), added, snow, None))
    return ExudynModel(**vars(opened), recording=work.recording)


@checked
@with_one_thread_for_products
def simulate(
    recording: RecordingOrFolder,
    out: OutFolder | None = None,
    *,
    model: ModelOrFile | None = None,
    terms: Terms = (),
    snow: Snow = "paper",
    heading: HeadingMode | None = None,
    balanced: bool = False,
    backend: Backend = "fastest",
    seconds: Seconds | None = None,
    csv: bool = False,
    plugins: Plugins = (),
    progress: ProgressWanted = False,
) -> Result:
    """Simulate one run.

    Parameters
    ----------
    recording : the recording: a folder with recording.toml.  It may be a ``Recording`` too.
    out : folder of the result.  Without one, Python writes nothing.
    model : the model, such as a result's model.toml.  Without one friction is the default.
    terms : force terms to add, by name with their default numbers (sssi terms).  Objects add terms of your own.
    snow : friction at the foot as in the paper, or snow that edges cut.  It is ``"paper"`` or ``"carving"``.
    heading : the skier's, on snow that edges cut: as captured, held to that by a spring, or as the snow decides
        (default: the model's, replay).  It is ``"replay"``, ``"track"`` or ``"free"``.
    balanced : on snow that edges cut: lean the whole posture slowly so that the skier is in balance (minutes)
    backend : how the force terms are evaluated
    seconds : the stretch of the recording to use, in s of its clock, such as 3:12.5 (default: all of it)
    csv : write the result's tables as CSV too, next to Parquet
    plugins : files of Python or installed packages to load first (``use_plugin``); their code is run
    progress : True for lines on stderr, or a function of stage, share done (None where unknown) and detail

    Raises InputError for bad input and SimulationDiverged when the solver gives up.

    Examples
    --------
    >>> run = sssi_exudyn.simulate("examples/beginner")
    >>> run.series["left_load_N"].mean()
    """
    from sssi_exudyn.api.progress import progress_of
    from sssi_exudyn.api.result import result_of
    from sssi_exudyn.commands.runs import choose_model, open_recording, simulate_recording, terms_named

    use_plugins(plugins)
    added = terms_named(terms)
    with open_recording(recording_of(recording), path_of(out), progress_of(progress), stretch_of(seconds)) as work:
        chosen = choose_model(work, model_in(model), added, snow, heading)
        made = simulate_recording(work, chosen, balanced=balanced, backend=backend)
        return result_of(made, work.out, csv=csv)


@checked
@with_one_thread_for_products
def fit(
    recording: RecordingOrFolder,
    out: OutFolder | None = None,
    *,
    method: Method = "joint",
    model: ModelOrFile | None = None,
    terms: Terms = (),
    snow: Snow = "paper",
    heading: HeadingMode | None = None,
    parameters: Annotated[Sequence[str], Option("--parameter", metavar="TERM.NUMBER")] = (),
    quick: bool = False,
    seconds: Seconds | None = None,
    csv: bool = False,
    plugins: Plugins = (),
    progress: ProgressWanted = False,
) -> Result:
    """Fit friction to the GPS track.

    All else that is uncertain is estimated with it, and the run is simulated with what was found.

    Parameters
    ----------
    recording : the recording: a folder with recording.toml.  It may be a ``Recording`` too.
    out : folder of the result.  Without one, Python writes nothing; with one, an interrupted fit goes on when it is
        called again.
    method : friction with everything else that is uncertain, or the paper's two parameters alone.  It is ``"joint"`` or
        ``"paper"``.
    model : further force terms, such as those that a diagnosis found.  It is a model or its ``model.toml``.
    terms : force terms to add, by name with their default numbers (sssi terms).  Objects add terms of your own.
    snow : friction at the foot as in the paper, or snow that edges cut.  It is ``"paper"`` or ``"carving"``.
    heading : the skier's, on snow that edges cut: as captured, held to that by a spring, or as the snow decides
        (default: the model's, replay).  It is ``"replay"``, ``"track"`` or ``"free"``.
    parameters : numbers of force terms to fit along, such as my_friction.c
    quick : a first answer in half the time, posture and instruments as they are, without standard errors
    seconds : the stretch of the recording to use, in s of its clock, such as 3:12.5 (default: all of it)
    csv : write the result's tables as CSV too, next to Parquet
    plugins : files of Python or installed packages to load first (``use_plugin``); their code is run
    progress : True for lines on stderr, or a function of stage, share done (None where unknown) and detail

    Raises InputError for bad input, such as a recording without GPS, and SimulationDiverged when the solver gives up.

    Examples
    --------
    >>> result = sssi_exudyn.fit("examples/beginner", "results/beginner")
    >>> result.friction.mu_t.value, result.friction.mu_t.se
    """
    from sssi_exudyn.api.progress import progress_of
    from sssi_exudyn.api.result import result_of
    from sssi_exudyn.commands.runs import choose_model, fit_recording, open_recording, terms_named

    use_plugins(plugins)
    added = terms_named(terms)
    with open_recording(recording_of(recording), path_of(out), progress_of(progress), stretch_of(seconds)) as work:
        chosen = choose_model(work, model_in(model), added, snow, heading)
        made = fit_recording(work, chosen, method=method, parameters=parameters, quick=quick)
        return result_of(made, work.out, csv=csv)


@checked
@with_one_thread_for_products
def run(
    recording: RecordingOrFolder,
    out: OutFolder | None = None,
    *,
    terms: Terms = (),
    snow: Snow = "paper",
    heading: HeadingMode | None = None,
    quick: bool = False,
    seconds: Seconds | None = None,
    csv: bool = False,
    progress: ProgressWanted = False,
) -> Result:
    """Fit, simulate, validate, report.

    This is the whole chain; without a GPS nothing is fitted.

    Parameters
    ----------
    recording : the recording: a folder with recording.toml.  It may be a ``Recording`` too.
    out : folder of the result.  Without one, Python writes nothing.
    terms : force terms to add, by name with their default numbers (sssi terms).  Objects add terms of your own.
    snow : friction at the foot as in the paper, or snow that edges cut.  It is ``"paper"`` or ``"carving"``.
    heading : the skier's, on snow that edges cut: as captured, held to that by a spring, or as the snow decides
        (default: the model's, replay).  It is ``"replay"``, ``"track"`` or ``"free"``.
    quick : a first answer in half the time, posture and instruments as they are, without standard errors
    seconds : the stretch of the recording to use, in s of its clock, such as 3:12.5 (default: all of it)
    csv : write the result's tables as CSV too, next to Parquet
    progress : True for lines on stderr, or a function of stage, share done (None where unknown) and detail

    Examples
    --------
    >>> result = sssi_exudyn.run("examples/beginner", "results/beginner", progress=True)
    >>> result.report("beginner.html")
    """
    from sssi_exudyn.commands.runs import terms_named
    from sssi_exudyn.recording.read import read_recording

    added = terms_named(terms)
    source = recording_of(recording)
    whole = read_recording(source) if isinstance(source, Path) else source
    chain = simulate if whole.gps is None else partial(fit, quick=quick)
    return chain(whole, out, terms=added, snow=snow, heading=heading, seconds=seconds, csv=csv, progress=progress)


@checked
@with_one_thread_for_products
def validate(
    recording: RecordingFolder,
    result: Annotated[AnyPath, Option(metavar="DIR")],
    out: OutFolder,
    *,
    progress: ProgressWanted = False,
) -> Result:
    """Compare a result with GPS and insoles.

    Parameters
    ----------
    recording : the recording: a folder with recording.toml
    result : folder of the result to compare
    out : folder of the new result
    progress : True for lines on stderr, or a function of stage, share done (None where unknown) and detail

    Examples
    --------
    >>> sssi_exudyn.validate("examples/beginner", "results/beginner", "results/again").trajectory.mean_error_m
    """
    from sssi_exudyn import commands
    from sssi_exudyn.api.progress import progress_of
    from sssi_exudyn.api.result import load_result

    commands.validate(Path(recording), Path(result), Path(out), progress=progress_of(progress))
    return load_result(Path(out))
