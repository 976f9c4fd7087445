"""One signature a command: options of functions and of the command line are the same, but for what is listed here."""

from __future__ import annotations

import argparse
import inspect
from collections.abc import Iterator, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Annotated, Any, Literal, get_args, get_type_hints

import pytest

import sssi_exudyn
from sssi_exudyn import cli
from sssi_exudyn.api.diagnosis import diagnose, diagnose_day
from sssi_exudyn.api.recordings import import_day, import_files, import_folder
from sssi_exudyn.api.season import RunOptions
from sssi_exudyn.core import choices
from sssi_exudyn.core.command_line import Argument, Option, PythonOnly
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.importing.answers import AnswerOptions, Answers
from sssi_exudyn.terminal.command import Command
from sssi_exudyn.terminal.signature import add_parameter, parameters_of, summary_of
from sssi_exudyn.terminal.table import COMMANDS

PYTHON_ONLY = {
    "plugins": "--plugin stands before or after any command, and loads them before it",
    "progress": "--quiet and --verbose choose what is shown on stderr",
}
EVERYWHERE = {
    "-h": "help",
    "--help": "help",
    "--debug": "Python shows where an error came from by itself",
    "--quiet": "progress of Python is silent",
    "--verbose": "progress of Python calls a function",
    "--json": "Python returns objects",
    "--plugin": "use_plugin, and plugins of many functions",
}
COMMAND_LINE_ONLY = {
    ("muscles", "--list"): "a table that needs no result",
    ("ski turn", "--json"): "Python returns the rows",
    ("run", "--workers"): "of run_season",
    ("run", "--scheduler"): "of run_season",
    ("run", "--cluster"): "of run_season",
    ("sweep retry", "--failed"): "says what is repeated; Python repeats it by continuing in another folder",
}
NAMED_OTHERWISE = {
    "terms": "--term",  # one flag a term
    "parameters": "--parameter",  # one flag a number
    "changes": "--set",  # one flag a number
    "elevations": "--dem",
    "crs": "--dem-crs",
    "picture": "--out",  # every file or folder that a command writes
    "page": "--out",
}
SHORTER = {"sweep resume": {"file", "out"}, "sweep retry": {"file", "out"}}
"""Parameters of ``sweep`` that the folder of a sweep holds."""
NO_COMMAND = {
    *("build", "read_recording", "model_of", "read_model", "load"),  # they return objects
    *("use_plugin", "check_term", "quantity"),  # for laws of one's own
    "diagnose_day",  # is ``sssi diagnose`` of several recordings
    "run_season",
    "load_season",  # the first is ``sssi run`` of a folder of recordings
    "import_day",  # is ``sssi import`` of a track with several descents
}
NOT_PUBLIC = {"terrain", "benchmark", "diagnose_known", "semi_real"}
"""Functions of commands that are of no use without the command line."""


def parsers(parser: argparse.ArgumentParser, words: str = "") -> Iterator[tuple[str, argparse.ArgumentParser]]:
    """Every command with its parser."""
    groups = [action for action in parser._actions if isinstance(action, argparse._SubParsersAction)]
    if not groups:
        yield words, parser
    for group in groups:
        for word, inner in group.choices.items():
            yield from parsers(inner, f"{words} {word}".strip())


PARSERS = dict(parsers(cli.parser()))


def parameters(command: Command) -> dict[str, inspect.Parameter]:
    """The function's own parameters, and each answer of an import, as Python has them."""
    own = dict(inspect.signature(command.function).parameters)
    if own.pop("answers", None) is not None:
        by_name = inspect.Parameter.KEYWORD_ONLY
        for name, annotation in AnswerOptions.__annotations__.items():
            text = getattr(annotation, "__forward_arg__", str(annotation))
            own[name] = inspect.Parameter(name, by_name, default=None, annotation=text)
    return own


def test_every_command_is_in_the_table() -> None:
    assert sorted(PARSERS) == sorted(command.words for command in COMMANDS)


def test_every_public_function_is_a_command_and_the_other_way_round() -> None:
    public = {name for name in sssi_exudyn.__all__ if inspect.isfunction(getattr(sssi_exudyn, name))}
    behind = {command.function.__name__ for command in COMMANDS}
    assert public - behind == NO_COMMAND
    assert behind - public == NOT_PUBLIC
    for command in COMMANDS:
        name = command.function.__name__
        assert name in NOT_PUBLIC or getattr(sssi_exudyn, name) is command.function


@pytest.mark.parametrize("command", COMMANDS, ids=lambda command: command.words)
def test_options_of_python_and_of_the_command_line_are_the_same(command: Command) -> None:
    actions = {action.dest: action for action in PARSERS[command.words]._actions}
    expected = set()
    for name, parameter in parameters(command).items():
        if name in PYTHON_ONLY:
            assert name not in actions
            continue
        if name in SHORTER.get(command.words, ()):
            continue
        action = actions[name]
        assert action.help
        if not action.option_strings:
            expected.add(name)
            continue
        flag = NAMED_OTHERWISE.get(name, f"--{name.replace('_', '-')}")
        assert action.option_strings == [flag]
        expected.add(flag)
        default = parameter.default
        if default is parameter.empty:
            assert action.required
        else:
            assert action.default == (list(default) if isinstance(default, tuple) else default)
            assert not action.required or name == "out"
        words = getattr(choices, parameter.annotation.removesuffix(" | None"), None)
        assert action.choices == (words and get_args(words))
    there = {flag for action in actions.values() for flag in action.option_strings or (action.dest,)}
    own = {flag for words, flag in COMMAND_LINE_ONLY if words == command.words}
    if command.words in SHORTER:
        own.add("folder")
    assert there - set(EVERYWHERE) - expected == own - set(EVERYWHERE)
    assert expected <= there


@pytest.mark.parametrize(
    ("one", "several"), [(diagnose, diagnose_day), (import_files, import_folder), (import_files, import_day)]
)
def test_a_function_of_several_runs_has_the_options_of_one(one: Any, several: Any) -> None:
    first, second = (
        {
            name: parameter.default
            for name, parameter in inspect.signature(function).parameters.items()
            if parameter.kind is not parameter.POSITIONAL_OR_KEYWORD and name not in PYTHON_ONLY
        }
        for function in (one, several)
    )
    assert first == second


def test_a_season_has_the_options_of_a_run() -> None:
    one, several = (inspect.signature(function).parameters for function in (sssi_exudyn.run, sssi_exudyn.run_season))
    options = {name for name, parameter in one.items() if parameter.kind is parameter.KEYWORD_ONLY}
    assert set(RunOptions.__annotations__) == options - set(PYTHON_ONLY)
    further = {name for name, parameter in several.items() if parameter.kind is parameter.KEYWORD_ONLY}
    assert {f"--{name}" for name in further - set(PYTHON_ONLY)} == {
        flag for words, flag in COMMAND_LINE_ONLY if words == "run"
    }


def test_an_option_of_several_commands_has_one_text() -> None:
    texts: dict[str, set[str]] = {"terms": set(), "snow": set(), "heading": set(), "picture": set()}
    for command in COMMANDS:
        for parameter in command.parameters:
            texts.get(parameter.name, set()).add(parameter.help)
    assert {name: len(said) for name, said in texts.items()} == dict.fromkeys(texts, 1)


def test_answers_are_known_by_name_and_type_as_options_too() -> None:
    options = get_type_hints(AnswerOptions)
    declared = get_type_hints(Answers)
    assert list(options) == [entry.name for entry in fields(Answers)]
    assert options.pop("sex") == Literal["male", "female"] | None
    assert declared.pop("sex") == str | None  # a file may say anything, and is refused where it is read
    assert options == declared


def ski_down(
    folder: Annotated[str | Path, Argument("FOLDER", Path)],
    hills: Annotated[Sequence[str], Option("--hill")] = (),
    *,
    snow: Literal["hard", "soft"] = "hard",
    depth_m: float | None = None,
    steps: Annotated[Sequence[int], Option(metavar="N", count="*")] = (3, 10),
    wax: bool = False,
    gates: Annotated[int, Option(read=lambda text: check_gates(text))] = 20,
    skier: Annotated[object, PythonOnly("an object")] = None,
) -> object:
    """Ski down.  It takes a while.

    Parameters
    ----------
    folder : where the run is
    hills : the hills to ski, from the
        highest.  A tuple of names.
    snow : what is skied on, 100 % of it.  ``"hard"`` is faster.
    depth_m : how deep it is
    steps : in a row
    wax : put wax on
    gates : how many there are
    skier : the one who skis
    """
    return (folder, hills, snow, depth_m, steps, wax, gates, skier)


def check_gates(text: str) -> int:
    """A number of gates."""
    if text != "20":
        raise ValueError(f"{text!r} is no number of gates")
    return 20


@pytest.fixture
def parser() -> argparse.ArgumentParser:
    made = argparse.ArgumentParser(prog="ski")
    for parameter in parameters_of(ski_down):
        add_parameter(made, parameter)
    return made


def test_arguments_are_those_of_a_signature(parser: argparse.ArgumentParser) -> None:
    assert vars(parser.parse_args(["here"])) == {
        "folder": Path("here"),
        "hills": [],
        "snow": "hard",
        "depth_m": None,
        "steps": [3, 10],
        "wax": False,
        "gates": 20,
    }
    given = [
        "here",
        "--hill",
        "a",
        "--hill",
        "b",
        "--snow",
        "soft",
        "--depth-m",
        "0.5",
        "--steps",
        "1",
        "2",
        "3",
        "--wax",
        "--gates",
        "20",
    ]
    assert vars(parser.parse_args(given)) == {
        "folder": Path("here"),
        "hills": ["a", "b"],
        "snow": "soft",
        "depth_m": 0.5,
        "steps": [1, 2, 3],
        "wax": True,
        "gates": 20,
    }


def test_help_is_the_first_sentence_of_each_entry(parser: argparse.ArgumentParser) -> None:
    text = " ".join(parser.format_help().split())
    for line in (
        "FOLDER where the run is",
        "--hill HILLS the hills to ski, from the highest; may be given several times",
        "--snow {hard,soft} what is skied on, 100 % of it (default: hard)",
        "--depth-m m how deep it is",
        "--steps [N ...] in a row (default: 3 10)",
        "--wax put wax on",
        "--gates GATES how many there are (default: 20)",
    ):
        assert line in text
    assert "who skis" not in text
    assert "A tuple" not in text
    assert summary_of(ski_down) == "ski down"


def test_what_a_reader_refuses_is_said_as_it_says_it(
    parser: argparse.ArgumentParser, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit):
        parser.parse_args(["here", "--gates", "many"])
    assert "argument --gates: 'many' is no number of gates" in capsys.readouterr().err


@pytest.mark.parametrize(
    "arguments",
    [
        ["fit", "rec", "--out", "res", "--method", "x" * 100_000],
        ["benchmark", "semi-real", "rec", "--out", "res", "--seconds", "\x1b[31m\n" * 10_000],
        ["run", "rec", "--out", "res", "--" + "y" * 100_000],
        ["z" * 100_000],
    ],
    ids=["choice", "number", "option", "command"],
)
def test_a_wrong_argument_is_one_bounded_line(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as end:
        cli.main(arguments)
    assert end.value.code == 2
    usage, _, line = capsys.readouterr().err.partition("error: ")
    assert usage.startswith("usage: sssi")
    assert 10 < len(line) < 600
    assert line.count("\n") == 1
    assert line[:-1].isprintable()


def test_python_takes_the_names_of_terms_too() -> None:
    for function in (sssi_exudyn.run, sssi_exudyn.fit, sssi_exudyn.simulate):
        with pytest.raises(InputError, match=r"--term.*did you mean 'wind'"):
            function("nowhere", terms=["winds"])
