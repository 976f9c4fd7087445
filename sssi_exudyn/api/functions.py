"""The functions of ``sssi_exudyn``.

Each loads what it needs when it is called, so that importing the package takes milliseconds and starts no solver.
Recordings and results are given as objects or as their folders; without ``out`` nothing is written.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

if TYPE_CHECKING:
    from sssi_exudyn.api.result import Result
    from sssi_exudyn.api.sweep_result import SweepResult
    from sssi_exudyn.bodies.muscles.muscles import MuscleSet
    from sssi_exudyn.commands.runs import Snow
    from sssi_exudyn.contact.term import Term
    from sssi_exudyn.fitting.first_fit import Method
    from sssi_exudyn.model.heading import HeadingMode
    from sssi_exudyn.model.model import Model
    from sssi_exudyn.recording.inspection import Inspection
    from sssi_exudyn.recording.recording import Recording
    from sssi_exudyn.results.day import Day
    from sssi_exudyn.simulation.full.forces import Backend
    from sssi_exudyn.sweeps.workers.pools import Cluster

AnyPath: TypeAlias = "str | os.PathLike[str]"
RecordingOrFolder: TypeAlias = "Recording | AnyPath"
ResultOrFolder: TypeAlias = "Result | AnyPath"
ModelOrFile: TypeAlias = "Model | AnyPath"
ProgressWanted: TypeAlias = "bool | Callable[[str, float | None, str], None]"


def example(name: str, out: AnyPath | None = None) -> Path:
    """Copy a recording that comes with the program, ``"beginner"`` or ``"intermediate"``; the folder.

    Parameters
    ----------
    name : of the recording
    out : the folder to make; one of its name in the working directory where it is left out

    Raises InputError for an unknown name and where something of that name is there.

    Examples
    --------
    >>> recording = sssi_exudyn.read_recording(sssi_exudyn.example("beginner"))
    """
    from sssi_exudyn import commands

    return commands.example(name, _path(out))


def read_recording(folder: AnyPath) -> Recording:
    """Read a recording: the folder of one run with its ``recording.toml``, checked and on one clock.

    Parameters
    ----------
    folder : the recording's folder

    Raises InputError, with file, place and fix, for whatever cannot be used.

    Examples
    --------
    >>> recording = sssi_exudyn.read_recording("examples/beginner")
    >>> recording.skier.mass
    70.0
    """
    from sssi_exudyn.recording.read import read_recording as read

    return read(Path(folder))


def inspect(recording: AnyPath, picture: AnyPath | None = None) -> Inspection:
    """What is in a recording: durations, rates, gaps, estimated slope and heading, the snow surface.

    Parameters
    ----------
    recording : its folder
    picture : file to draw it into (.png, .svg or .pdf)

    Examples
    --------
    >>> sssi_exudyn.inspect("examples/beginner").notices
    ()
    """
    from sssi_exudyn import commands

    return commands.inspect(Path(recording), None if picture is None else Path(picture))


def import_files(
    files: AnyPath | Sequence[AnyPath], out: AnyPath, *, defaults: AnyPath | None = None, **answers: Any
) -> Recording:
    """Make a recording's folder out of files of other formats (MVNX, C3D, .mot, BVH, GPX, FIT, NMEA, phone CSV).

    Parameters
    ----------
    files : a motion capture, or ``"PLACE=FILE"`` of single sensors; and files of fixes, insoles, poles
    out : the recording's folder, made here
    defaults : TOML file of answers, by the same names
    answers : what no file holds, by the names of ``Answers``, such as ``mass_kg`` or ``antenna_joint``

    What nobody says is assumed where something is usual; the recording's notices say what.  Raises InputError for files
    that cannot be used, for other answers that are missing, and where ``out`` holds a recording.

    Examples
    --------
    >>> sssi_exudyn.import_files(["run.mvnx", "run.gpx"], "monday", mass_kg=70.0, height_m=1.75)
    """
    from sssi_exudyn.core.errors import InputError
    from sssi_exudyn.core.text import did_you_mean
    from sssi_exudyn.importing.answers import Answers
    from sssi_exudyn.importing.assemble import import_recording
    from sssi_exudyn.importing.defaults import fill, read_defaults

    names = list(Answers.__dataclass_fields__)
    for name in answers:
        if name not in names:
            raise InputError("import_files", name, "no answer has that name", did_you_mean(name, names))
    given = [files] if isinstance(files, str | os.PathLike) else files
    known = Answers(**answers)
    if defaults is not None:
        known = fill(known, read_defaults(Path(defaults)))
    return import_recording([Path(file) for file in given], Path(out), known)


def model_of(recording: RecordingOrFolder) -> Model:
    """The paper's model of a recorded skier before anything is fitted, with default friction, started from the GPS.

    Examples
    --------
    >>> model = sssi_exudyn.model_of("examples/beginner")
    >>> slower = model.with_values({"friction.mu_t": 0.12})
    """
    from sssi_exudyn.commands.recordings import SILENT, read_folder
    from sssi_exudyn.model.from_recording import model_of as make

    return make(*read_folder(_recording(recording), SILENT))


def read_model(file: AnyPath, *, plugins: Sequence[AnyPath] = ()) -> Model:
    """The model in a ``model.toml``, such as a result's.

    Parameters
    ----------
    file : the model's file, with what it names beside it
    plugins : files of Python or installed packages to load first (``use_plugin``); their code is run

    Raises InputError for whatever is missing, unknown or outside its bounds.

    Examples
    --------
    >>> model = sssi_exudyn.read_model("results/beginner/model.toml")
    """
    from sssi_exudyn.model.toml import read_model as read

    _use(plugins)
    return read(Path(file))


def simulate(
    recording: RecordingOrFolder,
    out: AnyPath | None = None,
    *,
    model: ModelOrFile | None = None,
    terms: Sequence[Term] = (),
    snow: Snow = "paper",
    heading: HeadingMode | None = None,
    balanced: bool = False,
    backend: Backend = "fastest",
    plugins: Sequence[AnyPath] = (),
    progress: ProgressWanted = False,
) -> Result:
    """Simulate a recorded run once.

    Parameters
    ----------
    recording : the recording, or its folder
    out : folder for the result; left out, nothing is written
    model : the model, or its ``model.toml``; default friction where it is left out
    terms : force terms to add to it, such as one of your own
    snow : ``"paper"``, friction at the foot, or ``"carving"``, snow that edges cut
    heading : the skier's, on snow that edges cut: ``"replay"``, as captured, ``"track"``, held to that by a spring, or
        ``"free"``, as the snow decides; the model's where it is left out
    balanced : on such snow, lean the whole posture slowly so that the skier is in balance
    backend : how the force terms are evaluated
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
    from sssi_exudyn.commands.runs import make_simulation

    _use(plugins)
    made = make_simulation(
        _recording(recording),
        _path(out),
        model=_model(model),
        terms=terms,
        snow=snow,
        heading=heading,
        balanced=balanced,
        backend=backend,
        progress=progress_of(progress),
    )
    return result_of(made, _path(out))


def fit(
    recording: RecordingOrFolder,
    out: AnyPath | None = None,
    *,
    method: Method = "joint",
    model: ModelOrFile | None = None,
    terms: Sequence[Term] = (),
    parameters: Sequence[str] = (),
    snow: Snow = "paper",
    heading: HeadingMode | None = None,
    plugins: Sequence[AnyPath] = (),
    progress: ProgressWanted = False,
) -> Result:
    """Fit friction to the GPS track, with all else that is uncertain, and simulate with it.

    Parameters
    ----------
    recording : the recording, or its folder
    out : folder for the result; with one, an interrupted fit goes on when it is called again
    method : ``"joint"``, or ``"paper"`` for the paper's two parameters alone
    model : what else acts, such as the model of a diagnosis
    terms : force terms to add, such as one of your own
    parameters : numbers of force terms to fit along, such as ``"my_friction.c"``
    snow : ``"paper"``, friction at the foot, or ``"carving"``, snow that edges cut
    heading : the skier's, on snow that edges cut: ``"replay"``, as captured, ``"track"``, held to that by a spring, or
        ``"free"``, as the snow decides; the model's where it is left out
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
    from sssi_exudyn.commands.runs import make_fit

    _use(plugins)
    made = make_fit(
        _recording(recording),
        _path(out),
        method=method,
        model=_model(model),
        terms=terms,
        parameters=parameters,
        snow=snow,
        heading=heading,
        progress=progress_of(progress),
    )
    return result_of(made, _path(out))


def run(
    recording: RecordingOrFolder,
    out: AnyPath | None = None,
    *,
    terms: Sequence[Term] = (),
    snow: Snow = "paper",
    heading: HeadingMode | None = None,
    progress: ProgressWanted = False,
) -> Result:
    """The whole chain: fit where there is a GPS, simulate, compare with the measurements.

    Parameters
    ----------
    recording : the recording, or its folder
    out : folder for the result and its report; left out, nothing is written
    terms : further force terms, such as ``PostureAir()``
    snow : ``"paper"``, friction at the foot, or ``"carving"``, snow that edges cut
    heading : the skier's, on snow that edges cut: ``"replay"``, as captured, ``"track"``, held to that by a spring, or
        ``"free"``, as the snow decides; the model's where it is left out
    progress : True for lines on stderr, or a function of stage, share done (None where unknown) and detail

    Examples
    --------
    >>> result = sssi_exudyn.run("examples/beginner", "results/beginner", progress=True)
    >>> result.report("beginner.html")
    """
    from sssi_exudyn.api.progress import progress_of
    from sssi_exudyn.api.result import result_of
    from sssi_exudyn.commands.runs import make_run

    made = make_run(
        _recording(recording), _path(out), terms=terms, snow=snow, heading=heading, progress=progress_of(progress)
    )
    return result_of(made, _path(out))


def diagnose(
    recording: RecordingOrFolder,
    out: AnyPath | None = None,
    *,
    reduced: bool = False,
    plugins: Sequence[AnyPath] = (),
    progress: ProgressWanted = False,
) -> Result:
    """Find what physics the model lacks, or which instrument is at fault.

    Parameters
    ----------
    recording : the recording, or its folder
    out : folder for the extended model's run; with one, an interrupted diagnosis goes on when it is called again
    reduced : search by the reduced model alone: quicker, and stated in the result
    plugins : files of Python or installed packages whose hypotheses are weighed too; their code is run
    progress : True for lines on stderr, or a function of stage, share done (None where unknown) and detail

    The result's ``diagnosis`` has the findings with their probabilities, its ``model`` is the extended one.

    Examples
    --------
    >>> result = sssi_exudyn.diagnose("examples/beginner", "results/diagnosis")
    >>> print(result.diagnosis.verdict, result.diagnosis.sentence)
    """
    from sssi_exudyn.api.progress import progress_of
    from sssi_exudyn.api.result import result_of
    from sssi_exudyn.commands.diagnosis import make_diagnosis

    _use(plugins)
    made = make_diagnosis(_recording(recording), _path(out), reduced=reduced, progress=progress_of(progress))
    return result_of(made, _path(out))


def diagnose_day(recordings: Sequence[AnyPath], out: AnyPath, *, progress: ProgressWanted = False) -> Day:
    """Diagnose several runs of one day, each into a folder of its recording's name in ``out``, and compare them.

    Examples
    --------
    >>> day = sssi_exudyn.diagnose_day(["monday_1", "monday_2"], "results/monday")
    >>> print(day.sentence)
    """
    from sssi_exudyn import commands
    from sssi_exudyn.api.progress import progress_of

    folders = [Path(recording) for recording in recordings]
    return commands.diagnose_day(folders, Path(out), progress=progress_of(progress))


def validate(recording: AnyPath, result: AnyPath, out: AnyPath, *, progress: ProgressWanted = False) -> Result:
    """Compare a result's folder with a recording's GPS and insoles again, into ``out``.

    Examples
    --------
    >>> sssi_exudyn.validate("examples/beginner", "results/beginner", "results/again").trajectory.mean_error_m
    """
    from sssi_exudyn import commands
    from sssi_exudyn.api.progress import progress_of

    commands.validate(Path(recording), Path(result), Path(out), progress=progress_of(progress))
    return load(out)


def muscles(
    run: RecordingOrFolder | Result,
    out: AnyPath | None = None,
    *,
    muscles: MuscleSet = "full",
    power: int = 2,
    progress: ProgressWanted = False,
) -> Result:
    """The forces of the muscles that made a run's joint moments.

    Parameters
    ----------
    run : a result, a recording, which is run first, or the folder of either
    out : folder for the result with its muscles; left out, nothing is written
    muscles : "paper", the paper's 284, or "full", with all of the legs' 322
    power : exponent of the activations in the sum that is least, 2 or 3
    progress : True for lines on stderr, or a function of stage, share done (None where unknown) and detail

    Examples
    --------
    >>> result = sssi_exudyn.muscles("results/beginner")
    >>> result.series["muscle_soleus_r_force_N"].max()
    """
    from sssi_exudyn.api.progress import progress_of
    from sssi_exudyn.api.result import Result, result_of
    from sssi_exudyn.commands.muscles_command import make_muscles
    from sssi_exudyn.commands.runs import Made, make_run
    from sssi_exudyn.recording.recording import Recording
    from sssi_exudyn.results.folder import SUMMARY

    shown = progress_of(progress)
    if isinstance(run, Result):
        made = Made(run.stored, run.opensim)
    elif isinstance(run, Recording) or not (Path(run) / SUMMARY).is_file():
        made = make_run(_recording(run), None, progress=shown)
    else:
        found = load(run)
        made = Made(found.stored, found.opensim)
    result = result_of(make_muscles(made, power=power, chosen=muscles, progress=shown), None)
    return result if out is None else result.save(out)


def report(results: ResultOrFolder | Sequence[ResultOrFolder], out: AnyPath) -> Path:
    """Write the report of a result, of several side by side, or of a sweep's folder.

    Parameters
    ----------
    results : results, or their folders
    out : the file, a page (.html) or a document to print (.pdf)

    Returns that file's path.

    Examples
    --------
    >>> sssi_exudyn.report(["results/beginner", "results/intermediate"], "both.html")
    """
    from sssi_exudyn import commands
    from sssi_exudyn.api.result import Result
    from sssi_exudyn.commands.runs import write_report
    from sssi_exudyn.sweeps.sweep import is_sweep

    given = [results] if isinstance(results, Result | str | os.PathLike) else list(results)
    folders = [Path(each) for each in given if not isinstance(each, Result)]
    if folders and is_sweep(folders[0]):
        return commands.report(folders, Path(out))
    found = [each if isinstance(each, Result) else load(each) for each in given]
    named = [
        (each.stored, f"result {number}" if each.folder is None else each.folder.resolve().name)
        for number, each in enumerate(found, 1)
    ]
    return write_report(named, Path(out))


def load(folder: AnyPath, *, plugins: Sequence[AnyPath] = ()) -> Result:
    """The result in a folder that ``run``, ``fit``, ``simulate`` or ``diagnose`` has written.

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

    _use(plugins)
    return load_result(Path(folder))


def sweep(
    file: AnyPath | Mapping[str, Any],
    out: AnyPath,
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    cluster: Cluster | None = None,
    plugins: Sequence[AnyPath] = (),
    progress: ProgressWanted = False,
) -> SweepResult:
    """Do a sweep of many parameter values, or continue the one in ``out``.

    Parameters
    ----------
    file : the sweep's TOML file, or a mapping of the same content, whose paths count from the working directory
    out : folder of the sweep
    workers : processes, one a core where it is left out; 1 works in this process, without starting any
    scheduler : address of a Dask scheduler
    cluster : a Dask cluster to start, ``"local"`` or ``"slurm"``
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

    _use(plugins)
    given = file if isinstance(file, Mapping) else Path(file)
    do(
        given,
        Path(out),
        workers=workers,
        scheduler=scheduler,
        cluster=cluster,
        progress=progress_of(progress),
        in_this_process=workers == 1 and scheduler is None and cluster is None,
    )
    return SweepResult(Path(out))


def load_sweep(folder: AnyPath) -> SweepResult:
    """The sweep in a folder, finished or not.  Raises InputError where there is none.

    Examples
    --------
    >>> sssi_exudyn.load_sweep("results/edge_angle").counts["done"]
    35
    """
    from sssi_exudyn.api.sweep_result import SweepResult
    from sssi_exudyn.sweeps.sweep import status

    status(Path(folder))
    return SweepResult(Path(folder))


def terms() -> list[dict[str, str | float]]:
    """Every force term and its parameters, a row a parameter: origin (built in, or a plug-in), unit, default, bounds,
    source, meaning, formula.

    Examples
    --------
    >>> pandas.DataFrame(sssi_exudyn.terms())
    """
    from sssi_exudyn import commands

    return commands.terms()


def turn(
    skis: str | Sequence[str],
    edge: str = "30:70",
    speed: float = 10.0,
    *,
    load: float = 700.0,
    page: AnyPath | None = None,
    progress: ProgressWanted = False,
) -> list[dict[str, str | float | None]]:
    """Compare skis in steady turns on snow that their edges cut: radius with its bar, and side reserve, a row a ski and
    edge angle.

    Parameters
    ----------
    skis : a ski, or several: names of the catalogue, or paths of files
    edge : edge angles in degrees: ``"60"``, ``"30,45,60"`` or a range ``"30:70:5"``
    speed : m/s
    load : N along the snow's normal
    page : where a page that sets the skis side by side is written (.html)
    progress : True for lines on stderr, or a function of stage, share done (None where unknown) and detail

    Raises InputError for what is no ski or no edge angle.

    Examples
    --------
    >>> rows = sssi_exudyn.turn(["slalom_165", "volkl_kendo_184"], "45,60")
    """
    from sssi_exudyn import commands
    from sssi_exudyn.api.progress import progress_of

    names = [skis] if isinstance(skis, str) else list(skis)
    where = None if page is None else Path(page)
    return commands.turn(names, edge, speed, load=load, page=where, progress=progress_of(progress))


def use_plugin(plugin: AnyPath | object) -> None:
    """Put other people's force terms, hypotheses and readers to use; their code is run.

    Parameters
    ----------
    plugin : a file that ends in .py, the name of an installed package with entry points, or a class that was defined
        here, in a notebook or a script

    Raises InputError where its code fails, where it offers nothing, or where a name is taken.

    Examples
    --------
    >>> sssi_exudyn.use_plugin("examples/my_snow.py")
    """
    from sssi_exudyn.plugins import use_plugin as use

    use(os.fspath(plugin) if isinstance(plugin, os.PathLike) else plugin)


def _use(plugins: Sequence[AnyPath]) -> None:
    for plugin in plugins:
        use_plugin(plugin)


def _path(path: AnyPath | None) -> Path | None:
    return None if path is None else Path(path)


def _recording(given: RecordingOrFolder) -> Path | Recording:
    return Path(given) if isinstance(given, str | os.PathLike) else given


def _model(given: ModelOrFile | None) -> Path | Model | None:
    return Path(given) if isinstance(given, str | os.PathLike) else given
