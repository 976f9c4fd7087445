"""The command line's edge: what it passes on, what it prints where, and the exit status of every ending."""

import json
import os
import re
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from functools import wraps
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from a_diagnosis import diagnosis_of

from sssi_exudyn import cli
from sssi_exudyn.core.errors import InputError, SimulationDiverged
from sssi_exudyn.io.typed import convert
from sssi_exudyn.results.summary import Summary, summary_from_dict, summary_to_dict
from sssi_exudyn.runtime.progress import Progress
from sssi_exudyn.terminal import table
from sssi_exudyn.validation.benchmark.known_answers import Comparison
from sssi_exudyn.validation.benchmark.semi_real import Answer
from sssi_exudyn.validation.diagnosis.diagnosis_data import Diagnosis

SUMMARY = summary_from_dict(
    {
        "recording": "little hill",
        "friction": {"mu_t": {"value": 0.0612345, "se": 0.001}},
        "trajectory": {"mean_error_m": 0.25},
        "fit": {"converged": True},
    }
)
COMMANDS = {
    "simulate": ["simulate", "rec", "--out", "res"],
    "fit": ["fit", "rec", "--out", "res"],
    "validate": ["validate", "rec", "--result", "res", "--out", "res2"],
    "run": ["run", "rec", "--out", "res"],
}


@pytest.fixture
def behind(monkeypatch: pytest.MonkeyPatch) -> Callable[[str, Callable[..., Any]], None]:
    """Put a function of the test's behind a command; a summary or a diagnosis that it returns is that of a result."""

    def put(name: str, function: Callable[..., Any]) -> None:
        @wraps(function)
        def called(*places: Any, **names: Any) -> Any:
            value = function(*places, **names)
            if not isinstance(value, Summary | Diagnosis):
                return value
            summary = value if isinstance(value, Summary) else SUMMARY
            return SimpleNamespace(summary=summary, diagnosis=value, folder=Path("res"))

        changed = [
            replace(command, call=called) if command.function.__name__ == name else command
            for command in table.COMMANDS
        ]
        monkeypatch.setattr(table, "COMMANDS", tuple(changed))

    return put


def status(arguments: list[str]) -> int:
    with pytest.raises(SystemExit) as end:
        cli.main(arguments)
    assert isinstance(end.value.code, int)
    return end.value.code


@pytest.mark.parametrize("name", COMMANDS)
def test_summary_goes_to_stdout_as_text_or_json(
    name: str, behind: Callable[..., None], capsys: pytest.CaptureFixture[str]
) -> None:
    behind(name, lambda *_, **__: SUMMARY)
    assert status(COMMANDS[name]) == 0
    answer = capsys.readouterr().out.splitlines()
    assert len(answer) == 5
    assert answer[0] == "little hill: μ_t 0.061 (± 0.001)"
    assert "track 0.250 m" in answer[2]
    assert answer[3].startswith("verdict: ")
    assert "res/report.html" in answer[4]
    assert status([*COMMANDS[name], "--verbose"]) == 0
    text = capsys.readouterr().out
    assert "0.06123 ± 0.001" in text
    assert text.endswith("\n".join(answer) + "\n")
    assert "null" not in text
    assert "None" not in text
    assert status([*COMMANDS[name], "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == summary_to_dict(SUMMARY)


def test_a_report_says_where_it_is(behind: Callable[..., None], capsys: pytest.CaptureFixture[str]) -> None:
    behind("report", lambda results, out: out.with_name(f"{len(results)}-{out.name}"))
    assert status(["report", "one", "two", "--out", "page.html"]) == 0
    assert capsys.readouterr().out == "2-page.html\n"
    assert status(["report", "one", "--out", "page.html", "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == {"report": "1-page.html"}


def test_a_reduced_diagnosis_says_so(behind: Callable[..., None], capsys: pytest.CaptureFixture[str]) -> None:
    seen: list[object] = []

    def diagnose(*_: object, reduced: bool, **__: object) -> Diagnosis:
        seen.append(reduced)
        return replace(diagnosis_of(), tier="reduced" if reduced else "full")

    behind("diagnose", diagnose)
    assert status(["diagnose", "rec", "--out", "res", "--reduced"]) == 0
    assert "by the reduced model alone" in capsys.readouterr().out
    assert status(["diagnose", "rec", "--out", "res"]) == 0
    assert "reduced" not in capsys.readouterr().out
    assert seen == [True, False]


@pytest.mark.parametrize("command", ["run", "fit", "simulate"])
def test_the_snow_is_chosen(command: str, behind: Callable[..., None]) -> None:
    seen: list[tuple[str, str | None]] = []

    def made(*_: object, snow: str, heading: str | None, **__: object) -> Summary:
        seen.append((snow, heading))
        return SUMMARY

    behind(command, made)
    assert status([command, "rec", "--out", "res", "--snow", "carving", "--heading", "free", "--quiet"]) == 0
    assert status([command, "rec", "--out", "res", "--quiet"]) == 0
    assert seen == [("carving", "free"), ("paper", None)]


@pytest.mark.parametrize("option", [[], ["--quiet"], ["--verbose"]])
def test_how_much_is_said_is_chosen(
    option: list[str], behind: Callable[..., None], capsys: pytest.CaptureFixture[str]
) -> None:
    def run(
        *_: object, terms: list[str], snow: str, heading: str | None, progress: Progress, **_more: object
    ) -> Summary:
        assert terms == []
        assert snow == "paper"
        assert heading is None
        with progress.stage("fit") as stage:
            stage.advance(0.5, "half")
        return SUMMARY

    behind("run", run)
    assert status(["run", "rec", "--out", "res", *option]) == 0
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == {"": 1, "--quiet": 0, "--verbose": 2}[option[0] if option else ""]


def test_quiet_and_verbose_exclude_each_other() -> None:
    assert status(["run", "rec", "--out", "res", "--quiet", "--verbose"]) == 2


def test_arguments_arrive_as_paths_and_words(behind: Callable[..., None]) -> None:
    seen: dict[str, Any] = {}

    def fit(*arguments: Any, **named: Any) -> Summary:
        seen.update(named, arguments=arguments)
        return SUMMARY

    behind("fit", fit)
    assert status(["fit", "rec", "--out", "res", "--method", "paper"]) == 0
    assert seen["arguments"] == (Path("rec"), Path("res"))
    assert seen["method"] == "paper"


@pytest.mark.parametrize(
    ("error", "expected", "line"),
    [
        (InputError("gps.csv", "line 7", "not a number", "correct it"), 2, "gps.csv: line 7: not a number; correct it"),
        (SimulationDiverged(1.25, "penetration"), 1, "diverged at 1.250 s: penetration"),
        (KeyboardInterrupt(), 130, "resume with the same command"),
        (ZeroDivisionError("division by zero"), 1, "a bug of the program"),
        (
            ImportError("Tried, in order:\n  exudynCPP: libGL.so.1: cannot open shared object file"),
            1,
            "apt-get install libgl1",
        ),
    ],
    ids=["bad input", "diverged", "interrupted", "fault", "no OpenGL"],
)
def test_every_failure_is_one_line_with_its_status(
    error: BaseException, expected: int, line: str, behind: Callable[..., None], capsys: pytest.CaptureFixture[str]
) -> None:
    def fail(*_: Any, **__: Any) -> None:
        raise error

    behind("run", fail)
    assert status(COMMANDS["run"]) == expected
    shown = capsys.readouterr()
    assert shown.out == ""
    assert shown.err.startswith("sssi: ")
    assert shown.err.count("\n") == 1
    assert line in shown.err
    assert status([*COMMANDS["run"], "--debug"]) == expected
    assert "Traceback" in capsys.readouterr().err


@pytest.mark.parametrize(
    "arguments",
    [[], ["run", "rec"], ["fit", "rec", "--out", "r", "--method", "x"]],
    ids=["no command", "no out", "unknown method"],
)
def test_wrong_usage_has_status_two(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert status(arguments) == 2
    assert "usage: sssi" in capsys.readouterr().err


@pytest.mark.parametrize("command", ["run", "fit", "simulate"])
def test_terms_are_added(command: str, behind: Callable[..., None]) -> None:
    seen = []

    def made(*_: object, terms: list[str], **__: object) -> Summary:
        seen.append(terms)
        return SUMMARY

    behind(command, made)
    assert status([command, "rec", "--out", "res", "--term", "posture_air", "--term", "wind", "--quiet"]) == 0
    assert seen == [["posture_air", "wind"]]


def test_terms_are_a_table(behind: Callable[..., None], capsys: pytest.CaptureFixture[str]) -> None:
    behind("terms", lambda: [{"name": "friction", "low": 0.01}, {"name": "air", "low": 0.5}])
    assert status(["terms"]) == 0
    assert capsys.readouterr().out == "name      low\nfriction  0.01\nair       0.5\n"


def test_a_diagnosis_is_an_answer_a_sentence_or_its_file(
    behind: Callable[..., None], capsys: pytest.CaptureFixture[str]
) -> None:
    diagnosis = replace(diagnosis_of(), sentence="nothing is missing")
    behind("diagnose", lambda *_, **__: diagnosis)
    assert status(["diagnose", "rec", "--out", "res"]) == 0
    answer = capsys.readouterr().out
    first, *tiles, trust, page = answer.splitlines()
    assert trust.startswith("the run with this: ")
    assert first == "hill: none"
    names = [tile.partition(":")[0] for tile in tiles]
    assert names == ["where", "what", "how sure", "how much better", "friction", "what next"]
    assert "res/report.html" in page
    assert status(["diagnose", "rec", "--out", "res", "--verbose"]) == 0
    assert capsys.readouterr().out == f"nothing is missing\n{answer}"
    assert status(["diagnose", "rec", "--out", "res", "--json"]) == 0
    assert convert(json.loads(capsys.readouterr().out), Diagnosis) == diagnosis


def test_known_answers_are_a_table(behind: Callable[..., None], capsys: pytest.CaptureFixture[str]) -> None:
    rows = [
        Comparison("a", "none", "none", None, (), "right", "none", *[None] * 8),
        Comparison(
            "b",
            "gust",
            "wind",
            0.61234,
            ("gust", "nothing"),
            "in the set",
            "ambiguous",
            0.09,
            0.08,
            0.1,
            0.095,
            0.72,
            0.7,
            0.74,
            None,
        ),
    ]
    behind("diagnose_known", lambda *_, **__: rows)
    assert status(["benchmark", "recordings", "folder", "--out", "res"]) == 0
    lines = [re.split(" {2,}", line) for line in capsys.readouterr().out.splitlines()]
    friction = [f"{name}{end}" for name in ("mu_t", "mu_n") for end in ("", "_low", "_high", "_true")]
    assert lines[0] == ["recording", "hidden", "found", "probability", "alternatives", "answer", "verdict", *friction]
    assert lines[1] == ["a", "none", "none", "right", "none"]
    assert lines[2][:7] == ["b", "gust", "wind", "0.6123", "gust, nothing", "in the set", "ambiguous"]
    assert lines[2][7:] == ["0.09", "0.08", "0.1", "0.095", "0.72", "0.7", "0.74"]


def test_faults_concealed_in_real_runs_are_a_table(
    behind: Callable[..., None], capsys: pytest.CaptureFixture[str]
) -> None:
    rows = [Answer("glacier", "gps_jump", 10.0, "explained", "gps_jump", 0.99, (), "right", 0.92, True)]
    asked: dict[str, object] = {}
    behind("semi_real", lambda *_, **settings: asked.update(settings) or rows)
    assert status(["benchmark", "semi-real", "a", "b", "--out", "res", "--sizes", "3", "10"]) == 0
    assert (asked["sizes"], asked["seconds"], asked["seed"]) == ([3.0, 10.0], 20.0, 1)
    lines = [re.split(" {2,}", line) for line in capsys.readouterr().out.splitlines()]
    assert lines[1][:4] == ["glacier", "gps_jump", "10", "explained"]
    for wrong in ("0", "-3", "inf", "many"):
        assert status(["benchmark", "semi-real", "a", "--out", "res", "--seconds", wrong]) == 2
        assert f"'{wrong}' is no number above zero" in capsys.readouterr().err


def test_a_reader_that_stops_early_is_no_traceback() -> None:
    # `sssi terms | head -0`: the pipe is closed before anything is written.
    reading, writing = os.pipe()
    os.close(reading)
    script = (
        "from dataclasses import replace\n"
        "import sssi_exudyn.cli as cli\n"
        "from sssi_exudyn.terminal import table\n"
        "(terms,) = (command for command in table.COMMANDS if command.words == 'terms')\n"
        "table.COMMANDS = (replace(terms, call=lambda: [{'name': 'x' * 100000}]),)\n"
        "cli.main(['terms'])\n"
    )
    done = subprocess.run([sys.executable, "-c", script], stdout=writing, stderr=subprocess.PIPE, check=False)
    os.close(writing)
    assert done.stderr == b""
    assert done.returncode == 1


def test_help_and_import_start_no_solver() -> None:
    # The point of lazy loading: neither numbers nor the solver are imported before there is work.
    script = (
        "import sys, contextlib, io\n"
        "import sssi_exudyn\n"
        "from sssi_exudyn import cli\n"
        "with contextlib.redirect_stdout(io.StringIO()), contextlib.suppress(SystemExit):\n"
        "    cli.main(['--help'])\n"
        "print(sorted({'exudyn', 'numpy', 'matplotlib', 'pandas', 'numba'} & set(sys.modules)))\n"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"
