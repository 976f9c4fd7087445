"""The command line: reads arguments, calls one function of ``commands`` each, prints its result.

Exit status: 0 only when the result is whole; 2 for bad input, 1 for any other failure, 130 when interrupted.  Errors
are one line on stderr, where progress is shown too; stdout holds only the result.
"""

from __future__ import annotations

import argparse
import io
import os
import sys
import traceback
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import fields
from importlib import import_module, metadata
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

from sssi_exudyn.core.errors import InputError, SssiError
from sssi_exudyn.core.text import one_line
from sssi_exudyn.runtime.interrupts import INTERRUPTED, end_on_interrupt
from sssi_exudyn.runtime.progress import Progress, progress_on_stderr

if TYPE_CHECKING:
    from sssi_exudyn.importing.many import ImportedRun
    from sssi_exudyn.results.summary import Summary

BACKENDS = ("fastest", "compiled", "numpy", "symbolic", "python")
"""How the force terms are evaluated: machine code, arrays, Exudyn's expressions, or the interpreter as reference."""
METHODS = ("joint", "paper")
"""How friction is fitted: together with the recording's nuisance parameters, or the paper's two parameters alone."""
SNOWS = ("paper", "carving")
"""What lies under the skis: friction at the foot as in the paper, or snow that edges cut."""
HEADINGS = ("replay", "track", "free")
"""What holds the skier's heading on snow that edges cut."""
CONCEALED = ("all", "nothing", "listed", "unlisted", "pairs")
"""What cases of the benchmark conceal: everything in its turn, nothing, single effects that the diagnosis has a name
for, or has none for, or two effects at a time."""

_FUNCTIONS = {"import": "import_files", "ski": "identify", "benchmark": "diagnose"}
"""Functions of ``commands`` where they are not called as the command."""
_MOST_WORKERS = 10_000
SWEEP_VERBS = ("start", "resume", "retry", "status")


def main(arguments: Sequence[str] | None = None) -> NoReturn:
    """Read the arguments, do what they say, and end the process with its exit status."""
    with end_on_interrupt():  # argparse imports as it goes
        _prepare_streams()
        options = parser().parse_args(_with_verb(sys.argv[1:] if arguments is None else arguments))
    sys.exit(_status(options))


def _prepare_streams() -> None:
    """See to it that stdin, stdout and stderr are open, so that no file of a result becomes one of them, and that every
    text can be written to them.
    """
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # takes the lowest free number
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if stream is None:
            setattr(sys, name, Path(os.devnull).open("w", encoding="utf-8"))  # noqa: SIM115 - for as long as the process
        elif isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


def _with_verb(arguments: Sequence[str]) -> list[str]:
    """``sssi sweep FILE`` is short for ``sssi sweep start FILE``, whatever plug-ins stand before."""
    found = list(arguments)
    at = 0
    while at < len(found) and found[at].startswith("--plugin"):
        at += 1 if "=" in found[at] else 2
    rest = found[at + 1 :]
    if found[at : at + 1] == ["sweep"] and rest and rest[0] not in (*SWEEP_VERBS, "-h", "--help"):
        found.insert(at + 1, SWEEP_VERBS[0])
    return found


def parser() -> argparse.ArgumentParser:
    """The arguments that ``sssi`` takes."""
    top = argparse.ArgumentParser(
        prog="sssi",
        description="Skier, ski and snow, simulated from a recorded run.",
        epilog="Begin with: sssi example beginner, then sssi run beginner --out result, and open result/report.html.",
    )
    top.add_argument("--version", action="version", version=f"sssi {metadata.version('sssi-exudyn')}")
    plugin_help = "a file of Python, or an installed package, with force terms, hypotheses or readers; its code is run"
    top.add_argument("--plugin", action="append", default=[], metavar="FILE.py", help=plugin_help)
    every = argparse.ArgumentParser(add_help=False)
    every.add_argument("--plugin", action="append", default=[], dest="more_plugins", help=argparse.SUPPRESS)
    every.add_argument("--debug", action="store_true", help="show where in the program an error came from")
    verbosity = every.add_mutually_exclusive_group()
    verbosity.add_argument("--quiet", action="store_true", help="show no progress")
    verbosity.add_argument("--verbose", action="store_true", help="show every step, a line each")
    common = argparse.ArgumentParser(add_help=False, parents=[every])
    common.add_argument("--json", action="store_true", help="print the result as JSON")
    recorded = argparse.ArgumentParser(add_help=False)
    recorded.add_argument("folder", type=Path, metavar="FOLDER", help="the recording: a folder with recording.toml")
    written = argparse.ArgumentParser(add_help=False)
    written.add_argument("--out", type=Path, metavar="DIR", required=True, help="folder of the result")
    commands = top.add_subparsers(dest="command", metavar="COMMAND", required=True)

    example = commands.add_parser("example", parents=[common], help="copy a recording that comes with the program")
    example.add_argument("name", metavar="NAME", help="beginner or intermediate")
    example.add_argument("--out", type=Path, metavar="FOLDER", help="default: a folder of that name")
    inspect = commands.add_parser(
        "inspect", parents=[common, recorded], help="the content of a recording, and its problems"
    )
    inspect.add_argument("--out", type=Path, metavar="PICTURE", help="draw it too (.png, .svg or .pdf)")
    terrain = commands.add_parser("terrain", parents=[common, recorded], help="the snow surface under a run")
    terrain.add_argument("--dem", type=Path, metavar="FILE", help="elevation model of the slope (.tif or .asc)")
    terrain.add_argument("--out", type=Path, metavar="PICTURE", help="draw it too (.png, .svg or .pdf)")
    _add_import(commands.add_parser("import", parents=[common], help="make a recording from files of other formats"))
    simulate = commands.add_parser("simulate", parents=[common, recorded, written], help="simulate one run")
    simulate.add_argument("--model", type=Path, metavar="TOML", help="the model, such as a result's model.toml")
    _add_terms(simulate)
    _add_snow(simulate)
    simulate.add_argument(
        "--balanced",
        action="store_true",
        help="on snow that edges cut: lean the whole posture slowly so that the skier is in balance (minutes)",
    )
    simulate.add_argument("--backend", choices=BACKENDS, default=BACKENDS[0], help="how the force terms are evaluated")
    fit = commands.add_parser("fit", parents=[common, recorded, written], help="fit friction to the GPS track")
    fit.add_argument("--method", choices=METHODS, default=METHODS[0], help="default: %(default)s")
    fit.add_argument(
        "--model", type=Path, metavar="TOML", help="further force terms, such as those that a diagnosis found"
    )
    _add_terms(fit)
    _add_snow(fit)
    fit.add_argument(
        "--parameter",
        action="append",
        default=[],
        dest="parameters",
        metavar="TERM.NUMBER",
        help="a number of a force term to fit along; may be given several times",
    )
    validate = commands.add_parser(
        "validate", parents=[common, recorded, written], help="compare a result with GPS and insoles"
    )
    validate.add_argument("--result", type=Path, metavar="DIR", required=True, help="folder of the result to compare")
    diagnose = commands.add_parser(
        "diagnose", parents=[common, written], help="find physics that the model lacks, or a faulty instrument"
    )
    diagnose.add_argument(
        "folders", type=Path, nargs="+", metavar="FOLDER", help="the recording, or several of one day"
    )
    diagnose.add_argument(
        "--reduced", action="store_true", help="search by the reduced model alone: quicker, and stated in the result"
    )
    benchmark = commands.add_parser("benchmark", help="test the diagnosis on cases with known answers")
    of = benchmark.add_subparsers(dest="about", metavar="WHAT", required=True)
    blind = of.add_parser("diagnosis", parents=[common, written], help="on sealed cases")
    blind.add_argument("folders", type=Path, nargs="+", metavar="FOLDER", help="recordings to take the movements from")
    blind.add_argument("--cases", type=int, default=200, help="default: %(default)s")
    blind.add_argument("--seed", type=int, default=1, help="default: %(default)s")
    blind.add_argument("--workers", type=_count, metavar="N", help="processes (default: one a core)")
    blind.add_argument("--full", type=int, default=30, help="cases for the full model (%(default)s)")
    blind.add_argument("--conceal", choices=CONCEALED, default=CONCEALED[0], help="in its cases (%(default)s)")
    known = of.add_parser("recordings", parents=[common, written], help="on recordings with a truth.json")
    known.add_argument(
        "folders", type=Path, nargs="+", metavar="FOLDER", help="folders of recordings with a truth.json"
    )
    known.add_argument("--reduced", action="store_true", help="by the reduced model alone, as sssi diagnose --reduced")
    field = of.add_parser(
        "semi-real", parents=[common, written], help="on recordings in whose data faults are concealed"
    )
    field.add_argument("folders", type=Path, nargs="+", metavar="FOLDER", help="recordings from the field")
    field.add_argument(
        "--sizes",
        type=_positive,
        nargs="*",
        default=[3.0, 10.0],
        metavar="N",
        help="how many times the noise each fault moves the fixes (default: 3 10; none: the runs untouched)",
    )
    field.add_argument("--seconds", type=_positive, default=20.0, help="of each run's middle (default: %(default)s)")
    field.add_argument("--seed", type=int, default=1, help="default: %(default)s")
    run = commands.add_parser("run", parents=[common, recorded, written], help="fit, simulate, validate, report")
    _add_terms(run)
    _add_snow(run)
    report = commands.add_parser("report", parents=[common], help="the report of a result, or of several side by side")
    report.add_argument("results", type=Path, nargs="+", metavar="DIR", help="folder of a result")
    report.add_argument("--out", type=Path, metavar="FILE", required=True, help="the report (.html or .pdf)")
    _add_sweep(commands, common)
    commands.add_parser("terms", parents=[common], help="list every force term with its parameters")
    muscles = commands.add_parser(
        "muscles", parents=[common], help="compute the muscle forces behind a run's joint moments"
    )
    muscles.add_argument(
        "folder", type=Path, nargs="?", metavar="FOLDER", help="a result, or a recording, which is run first"
    )
    muscles.add_argument("--list", action="store_true", help="list every muscle with its parameters as CSV instead")
    muscles.add_argument("--out", type=Path, metavar="DIR", help="folder of the result (default: FOLDER itself)")
    muscles.add_argument(
        "--muscles",
        choices=("full", "paper"),
        default="full",
        help="all of the legs, 322 with the trunk's, or the paper's 284 (%(default)s)",
    )
    muscles.add_argument(
        "--power", type=int, choices=(2, 3), default=2, help="exponent of the activations (%(default)s)"
    )
    ski = commands.add_parser("ski", help="work on a ski alone")
    about = ski.add_subparsers(dest="about", metavar="COMMAND", required=True)
    identify = about.add_parser(
        "identify", parents=[common], help="identify stiffness, density and damping from bench tests"
    )
    identify.add_argument("folder", type=Path, metavar="FOLDER", help="folder with bench.toml and its tables")
    identify.add_argument("--out", type=Path, metavar="TOML", help="file for the ski, which recordings can name")
    _add_turn(about, every)
    return top


def _count(text: str) -> int:
    """A number of processes."""
    if not text.isdecimal() or not 1 <= int(text) <= _MOST_WORKERS:
        raise argparse.ArgumentTypeError(f"{text!r} is no number of processes, 1 to {_MOST_WORKERS}")
    return int(text)


def _positive(text: str) -> float:
    """A number above zero."""
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 0.0 < value < float("inf"):
        raise argparse.ArgumentTypeError(f"{text!r} is no number above zero")
    return value


def _add_terms(command: argparse.ArgumentParser) -> None:
    """The option for further force terms."""
    command.add_argument(
        "--term",
        action="append",
        default=[],
        dest="terms",
        metavar="NAME",
        help="a force term to add, with its default numbers (sssi terms); may be given several times",
    )


def _add_snow(command: argparse.ArgumentParser) -> None:
    """The options for the snow under the skis, and for the heading that a skier has on it."""
    command.add_argument(
        "--snow",
        choices=SNOWS,
        default=SNOWS[0],
        help="friction at the foot as in the paper, or snow that edges cut (default: %(default)s)",
    )
    command.add_argument(
        "--heading",
        choices=HEADINGS,
        help="the skier's, on snow that edges cut: as captured, held to that by a spring, or as the snow decides "
        "(default: the model's, replay)",
    )


def _add_import(command: argparse.ArgumentParser) -> None:
    """The options of ``sssi import``; those for answers are named as the fields of ``importing.Answers``."""
    command.add_argument(
        "files",
        type=Path,
        nargs="+",
        metavar="FILE",
        help="a motion capture, or PLACE=FILE of sensors (gyroscope and accelerometer may be two of a place); and files"
        " of fixes, insoles, poles; or a folder of many runs",
    )
    command.add_argument("--out", type=Path, metavar="FOLDER", required=True, help="the recording's folder")
    command.add_argument("--defaults", type=Path, metavar="TOML", help="a file of answers, such as mass_kg = 71")
    command.add_argument("--name", help="the recording's; default: the capture's file, of sensors the folder")
    command.add_argument("--sex", choices=("male", "female"), help="chooses the anthropometric table")
    command.add_argument("--skis", help="a ski of the catalogue")
    command.add_argument("--antenna-joint", metavar="JOINT", help="the joint the receiver moves with, such as Spine2")
    command.add_argument(
        "--antenna-offset-m", type=float, nargs=3, metavar=("LEFT", "UP", "FORWARD"), help="the receiver from there"
    )
    for option, meaning in (
        ("--mass-kg", "the skier, without boots and skis"),
        ("--height-m", "the skier"),
        ("--ski-mass-kg", "one ski with its binding"),
        ("--boot-mass-kg", "one boot"),
        ("--ankle-to-ski-base-m", "from the ankle joint down to the running surface"),
        ("--boot-centre-m", "from the ankle joint forward to the middle of the boot's sole"),
        ("--slope-deg", "inclination; estimated from the fixes if left out"),
        ("--fall-line-deg", "azimuth of the fall line, clockwise from north; likewise"),
        ("--heading-deg", "azimuth of the capture's forward axis, clockwise from north; likewise"),
        ("--gps-sigma-m", "standard deviation of a horizontal fix, where the file does not have it"),
        ("--gps-offset-s", "from the capture's first frame to the first fix, where the files' clocks do not give it"),
    ):
        command.add_argument(option, type=float, metavar=option.rsplit("-", 1)[1], help=meaning)


def _add_turn(about: Any, every: argparse.ArgumentParser) -> None:
    """The arguments of ``sssi ski turn``, whose ``--json`` names a file."""
    turn = about.add_parser("turn", parents=[every], help="compare skis in steady turns: radius, side reserve, losses")
    turn.add_argument("skis", nargs="+", metavar="SKI", help="a ski of the catalogue, or a file with one")
    turn.add_argument(
        "--edge", default="30:70", metavar="DEG", help="60, or 30,45,60, or FROM:TO[:STEP] (default: %(default)s)"
    )
    turn.add_argument("--speed", type=float, default=10.0, metavar="M/S", help="default: %(default)s")
    turn.add_argument(
        "--load", type=float, default=700.0, metavar="N", help="along the snow's normal (default: %(default)s)"
    )
    turn.add_argument("--json", type=Path, metavar="FILE", help="write the figures there instead of a table")
    turn.add_argument("--out", type=Path, metavar="PAGE", help="a page that sets the skis side by side (.html)")


def _add_sweep(commands: Any, common: argparse.ArgumentParser) -> None:
    """The arguments of ``sssi sweep``."""
    sweep = commands.add_parser(
        "sweep",
        help="run many parameter values: FILE --out DIR, or status, resume, retry of a DIR",
        usage="sssi sweep FILE --out DIR, or sssi sweep {status,resume,retry} DIR",
    )
    about = sweep.add_subparsers(dest="about", metavar="COMMAND", required=True, prog="sssi sweep")
    running = argparse.ArgumentParser(add_help=False)
    running.add_argument("--workers", type=_count, metavar="N", help="processes or cluster jobs (default: one a core)")
    running.add_argument("--scheduler", metavar="tcp://HOST:PORT", help="run on the workers of this Dask scheduler")
    running.add_argument("--cluster", choices=("local", "slurm"), help="start a Dask cluster and run there")
    started = argparse.ArgumentParser(add_help=False)
    started.add_argument("folder", type=Path, metavar="DIR", help="the sweep's folder")
    start = about.add_parser("start", parents=[common, running], help="start or continue a sweep")
    start.add_argument("file", type=Path, metavar="FILE", help="the sweep's TOML file")
    start.add_argument("--out", type=Path, metavar="DIR", required=True, help="folder of the sweep")
    about.add_parser("status", parents=[common, started], help="show the progress of a sweep")
    about.add_parser("resume", parents=[common, running, started], help="continue a sweep")
    retry = about.add_parser(
        "retry", parents=[common, running, started], help="continue a sweep and repeat its failed runs"
    )
    retry.add_argument("--failed", action="store_true", required=True, help="repeat failed runs")


def _status(options: argparse.Namespace) -> int:
    """Run the command; its exit status."""
    try:
        text = _call(options)
        try:
            sys.stdout.write(text)
            sys.stdout.flush()
        except OSError as error:
            # Python flushes once more at exit: not there
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            if isinstance(error, BrokenPipeError):  # the reader of stdout has closed it (sssi terms | head)
                return 1
            return _fail(options, 1, f"stdout cannot be written ({(error.strerror or str(error)).lower()})")
    except KeyboardInterrupt:
        return _fail(options, INTERRUPTED, "interrupted; resume with the same command")
    except BrokenPipeError:  # of stderr
        return 1
    except InputError as error:
        return _fail(options, 2, str(error))
    except SssiError as error:
        return _fail(options, 1, str(error))
    except Exception as error:  # noqa: BLE001 - the last line of defence; --debug shows the traceback
        if isinstance(error, ImportError) and "libGL" in str(error):
            return _fail(
                options, 1, "Exudyn needs the OpenGL library libGL.so.1; on Debian: sudo apt-get install libgl1"
            )
        fault = one_line(f"{type(error).__name__}: {error}", 500)
        return _fail(options, 1, f"{fault}; this is a bug of the program, --debug shows where")
    return 0


def _call(options: argparse.Namespace) -> str:
    """Call the command; its result as text for stdout."""
    # Here, so that --help and --version answer at once.
    with end_on_interrupt():
        from sssi_exudyn.runtime.exudyn_build import take_fast_build

        take_fast_build()
        from sssi_exudyn import commands
        from sssi_exudyn.io.writing import to_json, to_plain
        from sssi_exudyn.terminal import format_csv, format_summary, format_table

        if options.command == "sweep":
            import_module("sssi_exudyn.sweeps.sweep")
        else:
            getattr(commands, _FUNCTIONS.get(options.command, options.command), None)  # loads what the command needs

    named = [*options.plugin, *options.more_plugins]
    if named:
        from sssi_exudyn.plugins import use_plugins

        use_plugins(named)
    if not options.debug:
        warnings.simplefilter("ignore")  # of libraries, about figures that are checked here: the error line says it

    progress = progress_on_stderr(quiet=options.quiet, verbose=options.verbose)
    match options.command:
        case "example":
            copied = commands.example(options.name, options.out)
            return to_json({"recording": str(copied)}) if options.json else f"{copied}\n"
        case "inspect":
            from sssi_exudyn.recording.inspection import format_inspection

            inspection = commands.inspect(options.folder, options.out)
            return to_json(inspection) if options.json else format_inspection(inspection)
        case "terrain":
            from sssi_exudyn.recording.inspection import format_surface

            figures = commands.terrain(options.folder, options.dem, options.out)
            return to_json(figures) if options.json else f"{format_surface(figures)}\n"
        case "import":
            from sssi_exudyn.importing.answers import Answers
            from sssi_exudyn.recording.inspection import format_inspection

            given = {entry.name: getattr(options, entry.name) for entry in fields(Answers)}
            if len(options.files) == 1 and options.files[0].is_dir():
                imported = commands.import_folder(
                    options.files[0], options.out, Answers(**given), options.defaults, progress=progress
                )
                return _of_many(imported, options)
            inspection = commands.import_files(options.files, options.out, Answers(**given), options.defaults)
            return to_json(inspection) if options.json else format_inspection(inspection)
        case "terms":
            rows = commands.terms()
            return to_json(rows) if options.json else format_table(rows)
        case "muscles" if options.list:
            muscles = commands.muscles_list(options.muscles)
            return to_json(muscles) if options.json else format_csv(muscles)
        case "muscles":
            if options.folder is None:
                raise InputError("muscles", "FOLDER", "no folder is given", "give a result or a recording, or --list")
            summary = commands.muscles(
                options.folder, options.out, power=options.power, chosen=options.muscles, progress=progress
            )
            groups = _groups_of(summary)
            about = {name: groups[name] for name in ("recording", "muscles")}
            weak = format_table(about["muscles"]["lacking"])
            return to_json(about) if options.json else format_summary(about) + weak
        case "ski" if options.about == "turn":
            turns = commands.turn(
                options.skis,
                options.edge,
                options.speed,
                load=options.load,
                json=options.json,
                page=options.out,
                progress=progress,
            )
            return format_table(turns) if options.json is None else ""
        case "ski":
            found = commands.identify(options.folder, options.out)
            return to_json(found) if options.json else format_table(found)
        case "sweep":
            counts = _sweep(options, progress)
            return to_json(counts) if options.json else format_table([counts])
        case "simulate":
            summary = commands.simulate(
                options.folder,
                options.out,
                model=options.model,
                terms=options.terms,
                snow=options.snow,
                heading=options.heading,
                balanced=options.balanced,
                backend=options.backend,
                progress=progress,
            )
        case "fit":
            summary = commands.fit(
                options.folder,
                options.out,
                method=options.method,
                model=options.model,
                terms=options.terms,
                parameters=options.parameters,
                snow=options.snow,
                heading=options.heading,
                progress=progress,
            )
        case "benchmark" if options.about == "recordings":
            compared = commands.diagnose_known(options.folders, options.out, reduced=options.reduced, progress=progress)
            return to_json(compared) if options.json else format_table(to_plain(compared))
        case "benchmark" if options.about == "semi-real":
            answers = commands.semi_real(
                options.folders,
                options.out,
                sizes=options.sizes,
                seconds=options.seconds,
                seed=options.seed,
                progress=progress,
            )
            return to_json(answers) if options.json else format_table(to_plain(answers))
        case "benchmark":
            scores = commands.benchmark(
                options.folders,
                options.out,
                cases=options.cases,
                seed=options.seed,
                full=options.full,
                workers=options.workers,
                conceal=options.conceal,
                progress=progress,
            )
            return to_json(scores)
        case "diagnose":
            if len(options.folders) > 1:
                day = commands.diagnose_day(options.folders, options.out, reduced=options.reduced, progress=progress)
                return to_json(day) if options.json else f"{day.sentence}\n"
            diagnosis = commands.diagnose(options.folders[0], options.out, reduced=options.reduced, progress=progress)
            by = " (by the reduced model alone)" if diagnosis.tier == "reduced" else ""
            return to_json(diagnosis) if options.json else f"{diagnosis.verdict}{by}: {diagnosis.sentence}\n"
        case "report":
            written = commands.report(options.results, options.out)
            return to_json({"report": str(written)}) if options.json else f"{written}\n"
        case "validate":
            summary = commands.validate(options.folder, options.result, options.out, progress=progress)
        case _:
            summary = commands.run(
                options.folder,
                options.out,
                terms=options.terms,
                snow=options.snow,
                heading=options.heading,
                progress=progress,
            )
    groups = _groups_of(summary)
    return to_json(groups) if options.json else format_summary(groups)


def _of_many(rows: Sequence[ImportedRun], options: argparse.Namespace) -> str:
    """The rows as text; raises once they are shown where a run failed."""
    from sssi_exudyn.io.writing import to_json, to_plain
    from sssi_exudyn.terminal import format_table

    brief = [{name: row[name] for name in row if name not in ("assumed", "notes")} for row in to_plain(rows)]
    text = to_json(rows) if options.json else format_table(brief)
    failed = sum(row.status == "failed" for row in rows)
    if failed:
        sys.stdout.write(text)
        raise SssiError(
            f"{failed} of {len(rows)} runs could not be imported; {options.out / 'recordings.csv'} says why"
        )
    return text


def _groups_of(summary: Summary) -> dict[str, Any]:
    from sssi_exudyn.results.summary import summary_to_dict  # here: commands without a summary need not load it

    return summary_to_dict(summary)


def _sweep(options: argparse.Namespace, progress: Progress) -> Mapping[str, object]:
    from sssi_exudyn.sweeps import sweep as sweeps

    if options.about == "status":
        return sweeps.status(options.folder)
    where = {name: getattr(options, name) for name in ("workers", "scheduler", "cluster")}
    match options.about:
        case "start":
            return sweeps.sweep(options.file, options.out, progress=progress, **where)
        case "resume":
            return sweeps.resume(options.folder, progress=progress, **where)
        case _:
            return sweeps.retry(options.folder, progress=progress, **where)


def _fail(options: argparse.Namespace, status: int, line: str) -> int:
    if options.debug:
        traceback.print_exc()
    sys.stderr.write(f"sssi: {line}\n")
    return status
