"""The examples do what they say: scripts and notebooks, as a newcomer would start them."""

import json
import runpy
import shutil
from pathlib import Path

import matplotlib as mpl
import pytest
from notebook import run_notebook
from plugged import as_it_was

from sssi_exudyn.api.result import load_result
from sssi_exudyn.core.errors import InputError

EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.fixture
def copied(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with the examples, which is the working directory; figures are drawn into nothing."""
    folder = Path(shutil.copytree(EXAMPLES, tmp_path / "examples", ignore=shutil.ignore_patterns("results")))
    monkeypatch.chdir(folder)
    mpl.use("agg")
    return folder


@pytest.mark.long
def test_other_snow(copied: Path, capsys: pytest.CaptureFixture[str]) -> None:
    runpy.run_path(str(copied / "other_snow.py"), run_name="__main__")
    metres = [float(line.split()[2]) for line in capsys.readouterr().out.splitlines()]
    assert len(metres) == 3
    assert metres[0] > metres[1] > metres[2] > 8.0  # slower snow, a shorter way


@pytest.mark.slow
def test_one_run(copied: Path, capsys: pytest.CaptureFixture[str]) -> None:
    runpy.run_path(str(copied / "one_run.py"), run_name="__main__")
    value = float(capsys.readouterr().out.split()[2])
    assert value == pytest.approx(0.06, abs=0.01)  # what the recording was made with; three standard errors
    assert (copied / "results" / "one_run" / "summary.json").is_file()
    assert (copied / "results" / "one_run.html").is_file()


@pytest.mark.long(seconds=16)
def test_first_run_notebook(copied: Path) -> None:
    names, shown = run_notebook(copied / "first_run.ipynb")
    result = names["result"]
    assert result.friction.mu_t.value == pytest.approx(0.06, abs=4.0 * result.friction.mu_t.se)
    assert {"read", "fit", "simulate"} <= set(names["stages"])
    assert names["last"][1] > names["last"][0]
    assert (copied / "first_run.html").stat().st_size > 100_000
    for value in shown:
        assert len(repr(value)) < 5000
        assert len(getattr(value, "_repr_html_", str)() or "") < 20_000
    assert not (copied / "results").exists()  # nothing was asked to be written


@pytest.mark.long(seconds=15)
def test_own_law_notebook(copied: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with as_it_was():
        names, _ = run_notebook(copied / "own_law.ipynb")
    assert {"does_not_branch", "linearisation_is_exact"} <= set(names["kept"])
    assert names["slower"] < -0.05  # wet snow holds the skier up
    assert "digest" in capsys.readouterr().out
    with pytest.raises(InputError, match="needs the plug-in"):
        load_result(copied / "wet")


@pytest.mark.parametrize("path", sorted(EXAMPLES.glob("*.ipynb")), ids=lambda path: path.name)
def test_notebooks_are_kept_without_outputs(path: Path) -> None:
    cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
    assert [cell["outputs"] for cell in cells if cell["cell_type"] == "code" and cell["outputs"]] == []
