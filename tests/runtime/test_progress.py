"""What long steps say, on a terminal and in a log; and what a result says of its origin."""

import io
import itertools
from importlib import metadata
from pathlib import Path

import pytest

from sssi_exudyn.runtime.progress import Progress
from sssi_exudyn.runtime.provenance import provenance, versions


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def seconds() -> itertools.count:
    return itertools.count(0.0, 1.0)


def test_a_log_gets_one_line_a_stage() -> None:
    log = io.StringIO()
    with Progress(log, seconds().__next__).stage("fit") as stage:
        for k in range(10):
            stage.advance(k / 10, f"error {k} m")
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
    found = versions()
    assert found["numba"] == "not installed"
    assert found["numpy"] == real("numpy")


@pytest.mark.parametrize("value", [Path("model.toml"), "/somewhere/model.toml"])
def test_provenance_refuses_paths_of_a_machine(value: object) -> None:
    with pytest.raises(ValueError, match="path of this machine"):
        provenance({}, {"model": value}, None)
