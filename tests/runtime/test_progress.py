"""Messages of long steps on a terminal and in a log, and what a result says of its origin."""

import io
import itertools
import time
from importlib import metadata
from pathlib import Path

import pytest

from sssi_exudyn.core.advance import part_of
from sssi_exudyn.runtime.compiling import compiling
from sssi_exudyn.runtime.progress import Progress, Stage, about, progress_on_stderr
from sssi_exudyn.runtime.provenance import _versions, provenance, source_digest, versions


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


class Clock:
    now = 0.0

    def __call__(self) -> float:
        return self.now


def seconds() -> itertools.count:
    return itertools.count(0.0, 1.0)


def test_a_log_gets_one_line_a_stage() -> None:
    log, clock = io.StringIO(), Clock()
    with Progress(log, clock).stage("fit") as stage:
        for k in range(10):
            stage.advance(k / 10, f"error {k} m")
        clock.now = 1.0
    assert log.getvalue() == "fit: done after 1.0 s (error 9 m)\n"


def test_a_terminal_is_rewritten_in_place() -> None:
    terminal = Terminal()
    with Progress(terminal, seconds().__next__).stage("simulate") as stage:
        stage.advance(0.5, "4.8 of 9.6 s")
    shown = terminal.getvalue()
    assert "\r\x1b[Ksimulate  50 % 4.8 of 9.6 s" in shown
    assert shown.count("\n") == 1


def test_a_terminal_is_not_flooded() -> None:
    terminal = Terminal()
    with Progress(terminal, lambda: 0.0).stage("simulate") as stage:
        for k in range(1000):
            stage.advance(k / 1000)
    assert terminal.getvalue().count("\r") == 2  # the first line and the last


def test_a_log_gets_a_line_now_and_then_with_share_and_time_left(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sssi_exudyn.runtime.progress.LOG_EVERY", 0.001)
    log, clock = io.StringIO(), Clock()
    with Progress(log, clock).stage("fit", expected=300.0) as stage:
        clock.now = 60.0
        stage.advance(0.25, "error 3 m")
        while "25 %" not in log.getvalue():  # written by a thread, since the work may be silent for minutes
            time.sleep(0.001)
    lines = log.getvalue().splitlines()
    assert lines[0] == "fit: begins, about 5 min"
    assert "fit:  25 % after 1 min 0 s, about 3 min left (error 3 m)" in lines
    assert lines[-1] == "fit: done after 60.0 s (error 3 m)"


def test_the_expected_duration_gives_the_time_left_where_no_share_does() -> None:
    log, clock = io.StringIO(), Clock()
    stage = Stage("fit", log, clock, expected=100.0)
    for now in (40.0, 200.0):
        clock.now = now
        stage.write()
    assert log.getvalue().splitlines() == [
        "fit: begins, about 2 min",
        "fit: after 40 s, about 60 s left",
        "fit: after 3 min 20 s",  # nothing is known any more
    ]


def test_a_share_stays_where_a_detail_brings_no_news_of_it() -> None:
    log, clock = io.StringIO(), Clock()
    stage = Stage("diagnose", log, clock, expected=100.0)
    clock.now = 200.0
    stage.advance(0.5)
    for now in (300.0, 500.0):
        clock.now = now
        stage.advance(None, "full model")
        stage.write()
    assert log.getvalue().splitlines()[-2:] == [
        "diagnose:  50 % after 5 min 0 s, about 2 min left (full model)",
        "diagnose:  50 % after 8 min 20 s (full model)",  # what was predicted is over, and nothing new is known
    ]


def test_the_share_of_a_part_is_one_of_the_whole() -> None:
    log, clock = io.StringIO(), Clock()
    stage = Stage("diagnose", log, clock)
    part = part_of(part_of(stage.advance, 0.5, 1.0), 0.0, 0.5)
    part(0.5, "half of the first half of the second")
    assert stage.fraction == 0.625
    part(None, "no news")
    assert stage.fraction == 0.625


def test_a_stage_says_once_that_it_waits_for_the_compiler() -> None:
    log = io.StringIO()
    with Progress(log, lambda: 0.0).stage("fit"):
        compiling()
        compiling()
    compiling()  # nothing listens any more
    begin = "fit: compiling the force laws, once for each set of laws on this computer"
    assert len([line for line in log.getvalue().splitlines() if line.startswith(begin)]) == 1


def test_the_compiler_s_time_says_nothing_of_the_rest() -> None:
    log, clock = io.StringIO(), Clock()
    stage = Stage("fit", log, clock, expected=200.0)
    stage.compile()
    for now, share in ((90.0, 0.2), (100.0, 0.4)):  # the first share came with the compiler
        clock.now = now
        stage.advance(share)
        stage.write()
    assert log.getvalue().splitlines()[-2:] == [
        "fit:  20 % after 1 min 30 s, about 2 min left",
        "fit:  40 % after 1 min 40 s, about 30 s left",
    ]


def test_short_stages_say_nothing_of_their_time() -> None:
    log = io.StringIO()
    with Progress(log, lambda: 0.0).stage("read", expected=2.0):
        pass
    assert log.getvalue() == "read: done after 0.0 s\n"


def test_those_who_want_it_see_every_second() -> None:
    terminal, clock = Terminal(), Clock()
    with Progress(terminal, clock, verbose=True).stage("fit") as stage:
        for k in range(30):
            clock.now = 0.1 * k
            stage.advance(None, f"step {k}")
    assert "\r" not in terminal.getvalue()
    assert [line.rpartition("(")[2] for line in terminal.getvalue().splitlines()[1:-1]] == ["step 10)", "step 20)"]


def test_the_command_line_is_quiet_where_it_shall_be(capsys: pytest.CaptureFixture[str]) -> None:
    with progress_on_stderr(quiet=True).stage("fit", expected=100.0) as stage:
        stage.advance(0.5)
    assert capsys.readouterr() == ("", "")


@pytest.mark.parametrize(
    ("seconds", "words"),
    [(3.0, "about 10 s"), (47.0, "about 50 s"), (100.0, "about 2 min"), (5000.0, "about 83 min"), (9e3, "about 2.5 h")],
)
def test_rough_times_are_rough(seconds: float, words: str) -> None:
    assert about(seconds) == words


def test_a_stage_left_by_an_error_stopped() -> None:
    log = io.StringIO()
    with pytest.raises(KeyboardInterrupt), Progress(log, lambda: 0.0).stage("fit"):
        raise KeyboardInterrupt
    assert log.getvalue() == "fit: stopped after 0.0 s\n"


def test_silence_says_nothing(capfd: pytest.CaptureFixture[str]) -> None:
    with Progress().stage("fit") as stage:
        stage.advance(0.5, "x")
    assert capfd.readouterr() == ("", "")


def test_provenance_names_versions_and_no_place() -> None:
    made = provenance({"motion.bvh": "sha256:0"}, {"method": "joint", "model": "model.toml"}, 3)
    assert made["inputs"] == {"motion.bvh": "sha256:0"}
    assert {"sssi_exudyn", "exudyn", "numpy", "python"} <= made["versions"].keys()
    assert made["sources"] == source_digest()
    assert made["seed"] == 3
    assert str(Path.cwd()) not in str(made)
    assert str(Path.home()) not in str(made)


def test_a_package_that_is_missing_is_said_to_be(monkeypatch: pytest.MonkeyPatch) -> None:
    real = metadata.version

    def without_numba(package: str) -> str:
        if package == "numba":
            raise metadata.PackageNotFoundError(package)
        return real(package)

    monkeypatch.setattr(metadata, "version", without_numba)
    # as in a process that has not asked before
    monkeypatch.setattr("sssi_exudyn.runtime.provenance._versions", _versions.__wrapped__)
    packages = versions()
    assert packages["numba"] == "not installed"
    assert packages["numpy"] == real("numpy")


@pytest.mark.parametrize("value", [Path("model.toml"), "/somewhere/model.toml"])
def test_provenance_refuses_paths_of_a_machine(value: object) -> None:
    with pytest.raises(ValueError, match="path of this machine"):
        provenance({}, {"model": value}, None)
