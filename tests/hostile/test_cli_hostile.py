"""The command line in odd surroundings: streams closed or of other encodings, interrupts, odd --out."""

from __future__ import annotations

import errno
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import pytest
from a_run import a_run
from tiny import Tiny

from sssi_exudyn import cli
from sssi_exudyn.reports.report import write_run
from sssi_exudyn.terminal import table

MODULE = [sys.executable, "-m", "sssi_exudyn"]


def sssi(arguments: Sequence[str], shell: str = "", **environment: str) -> subprocess.CompletedProcess[bytes]:
    """Run ``sssi`` with those arguments; ``shell`` is text that a shell would have after them."""
    command = ["sh", "-c", f'"$@" {shell}', "sh", *MODULE, *arguments]
    env = {name: value for name, value in os.environ.items() if not name.startswith(("LC_", "LANG"))}
    return subprocess.run(command, check=False, capture_output=True, env=env | environment, timeout=120)


def end_of(arguments: Sequence[str], capsys: pytest.CaptureFixture[str]) -> tuple[int, str]:
    """Return exit status and stderr of the command, run within this process."""
    with pytest.raises(SystemExit) as end:
        cli.main(arguments)
    assert isinstance(end.value.code, int)
    return end.value.code, capsys.readouterr().err


@pytest.fixture(scope="module")
def without_fixes(recording: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the recording without GPS, for tests in other processes.

    The snow under fixes takes most of the time of ``sssi inspect``.
    """
    folder = Path(shutil.copytree(recording, tmp_path_factory.mktemp("without") / "tiny"))
    path = folder / "recording.toml"
    before, _, fixes = path.read_text(encoding="utf-8").partition("[gps]\n")
    path.write_text(before + fixes[fixes.index("[insoles]") :], encoding="utf-8")
    return folder


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = Tiny().write(tmp_path_factory.mktemp("recording") / "tiny")
    path = folder / "recording.toml"
    text = path.read_text(encoding="utf-8").splitlines()
    lines = ['name = "Hügel 丘"' if line.startswith("name") else line for line in text]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return folder


@pytest.mark.parametrize(
    "environment",
    [{"PYTHONIOENCODING": "ascii"}, {"LC_ALL": "C"}, {"LC_ALL": "C", "PYTHONCOERCECLOCALE": "0", "PYTHONUTF8": "0"}],
)
@pytest.mark.long
def test_a_terminal_of_another_encoding_gets_every_result(without_fixes: Path, environment: dict[str, str]) -> None:
    done = sssi(["inspect", str(without_fixes)], **environment)
    assert done.returncode == 0, done.stderr
    assert done.stderr == b""
    assert b"H" in done.stdout


@pytest.mark.parametrize("megabytes", [50, 200, 600, 950])
def test_too_few_addresses_are_one_line(without_fixes: Path, megabytes: int) -> None:
    command = f"import resource; resource.setrlimit(resource.RLIMIT_AS, ({megabytes}000000,) * 2)\n"
    program = command + "from sssi_exudyn.__main__ import start; start()"
    started = [sys.executable, "-c", program, "inspect", str(without_fixes)]
    done = subprocess.run(started, check=False, capture_output=True, text=True, timeout=120)
    assert done.returncode == 1
    line = f"sssi: the limit of {megabytes} MB (ulimit -v) is less than the program's libraries take"
    assert done.stderr == f"{line}; raise it to 1000 MB or more\n"


@pytest.mark.parametrize(
    "error",
    [
        MemoryError("Unable to allocate 1.31 MiB"),
        ImportError("libblas.so: failed to map segment from shared object"),
        OSError(errno.ENOMEM, "Cannot allocate memory"),
    ],
)
def test_memory_that_ends_is_one_line(
    error: Exception, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def inspect(*_: object) -> None:
        raise error

    changed = [replace(one, call=inspect) if one.words == "inspect" else one for one in table.COMMANDS]
    monkeypatch.setattr(table, "COMMANDS", tuple(changed))
    status, shown = end_of(["inspect", "folder"], capsys)
    assert status == 1
    assert shown == "sssi: there is not enough memory; end other programs, or raise the limit (ulimit -v)\n"


@pytest.mark.parametrize("shell", [">&-", "2>&-", ">&- 2>&-", "<&- >&- 2>&-"])
@pytest.mark.long
def test_closed_streams_are_no_fault(without_fixes: Path, tmp_path: Path, shell: str) -> None:
    picture = tmp_path / "picture.svg"
    done = sssi(["inspect", str(without_fixes), "--out", str(picture)], shell)
    assert done.returncode == 0, done.stderr
    assert done.stderr == b""
    assert picture.read_text(encoding="utf-8").rstrip().endswith("</svg>")  # nothing was printed into it
    assert sssi(["--version"], shell).returncode == 0


@pytest.mark.long
def test_a_full_disk_behind_stdout_is_one_line() -> None:
    done = sssi(["terms"], ">/dev/full")
    assert done.returncode == 1
    assert done.stderr == b"sssi: stdout cannot be written (no space left on device)\n"


def test_an_interrupt_while_libraries_are_imported_is_one_line(tmp_path: Path) -> None:
    # a library that takes long to import and then mistakes the interrupt for a fault of its own
    (tmp_path / "exudyn.py").write_text(
        "import sys, time\n"
        "sys.stderr.write('importing')\n"
        "sys.stderr.flush()\n"
        "try:\n"
        "    time.sleep(60)\n"
        "except BaseException as error:\n"
        "    raise ImportError('half imported') from error\n",
        encoding="utf-8",
    )
    path = os.pathsep.join([str(tmp_path), *sys.path])
    process = subprocess.Popen([*MODULE, "terms"], stderr=subprocess.PIPE, env=os.environ | {"PYTHONPATH": path})
    assert process.stderr is not None
    assert process.stderr.read(9) == b"importing"
    process.send_signal(signal.SIGINT)
    assert process.stderr.read() == b"sssi: interrupted; resume with the same command\n"
    assert process.wait(60) == 130


def test_an_interrupt_while_arguments_are_read_is_one_line() -> None:
    # the standard library imports more as the arguments are read: here without end
    script = """
import sys, time
import sssi_exudyn.__main__ as program

class Slow:
    def find_spec(self, name, path=None, target=None):
        if name == "email.feedparser":
            sys.stderr.write("importing")
            sys.stderr.flush()
            time.sleep(60)

import sssi_exudyn.cli
sys.meta_path.insert(0, Slow())
program.start()
"""
    process = subprocess.Popen([sys.executable, "-c", script, "terms"], stdout=-3, stderr=subprocess.PIPE)
    assert process.stderr is not None
    assert process.stderr.read(9) == b"importing"
    process.send_signal(signal.SIGINT)
    assert process.stderr.read() == b"sssi: interrupted; resume with the same command\n"
    assert process.wait(60) == 130


@pytest.mark.long
@pytest.mark.parametrize("after", [0.0, 0.1, 0.3, 0.6, 1.0])
def test_an_interrupt_at_any_time_shows_no_traceback_of_the_program(after: float, tmp_path: Path) -> None:
    """Before Python has reached the program at all, the traceback is Python's own."""
    script = "import sssi_exudyn.__main__ as m, sys; sys.stderr.write('!'); sys.stderr.flush(); m.start()"
    command = [sys.executable, "-c", script, "diagnose", "missing", "--out", str(tmp_path)]
    process = subprocess.Popen(command, stdout=-3, stderr=subprocess.PIPE)
    assert process.stderr is not None
    assert process.stderr.read(1) == b"!"
    time.sleep(after + 0.02)
    process.send_signal(signal.SIGINT)
    text = process.stderr.read()
    assert b"Traceback" not in text
    status = process.wait(60)
    ended = status == 2 and text.startswith(b"sssi: missing") and text.count(b"\n") == 1
    assert ended or (status, text) == (130, b"sssi: interrupted; resume with the same command\n")


@pytest.mark.parametrize(
    ("arguments", "out", "folder"),
    [
        (["simulate"], "taken", False),
        (["fit"], "taken", False),
        (["diagnose"], "taken", False),
        (["simulate"], "taken/below", False),
        (["inspect"], "taken.png", True),
        (["inspect"], "missing/taken.png", False),
    ],
    ids=lambda value: str(value),
)
def test_an_output_that_cannot_be_is_one_clear_line(
    recording: Path, tmp_path: Path, arguments: list[str], out: str, folder: bool, capsys: pytest.CaptureFixture[str]
) -> None:
    place = tmp_path / out.partition("/")[0]
    if folder:
        place.mkdir()
    elif not out.startswith("missing"):
        place.write_text("mine", encoding="utf-8")
    status, errors = end_of([*arguments, str(recording), "--out", str(tmp_path / out)], capsys)
    assert status == 2, errors
    assert sum(line.startswith("sssi: ") for line in errors.splitlines()) == 1
    assert "Traceback" not in errors
    assert not place.is_file() or place.read_text(encoding="utf-8") == "mine"


@pytest.mark.usefixtures("words_only")
def test_a_report_into_a_folder_is_one_clear_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_run(tmp_path / "result", a_run(3.0, 20.0))
    (tmp_path / "page.html").mkdir()
    status, errors = end_of(["report", str(tmp_path / "result"), "--out", str(tmp_path / "page.html")], capsys)
    assert status == 2
    assert errors.count("\n") == 1
    assert "page.html" in errors
