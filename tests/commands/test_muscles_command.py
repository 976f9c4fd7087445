"""`sssi muscles`: a result gets muscle forces into its series, its page and files that OpenSim reads."""

import csv
import io
import json
import shutil
from dataclasses import asdict, replace
from pathlib import Path

import gliding
import numpy as np
import pandas as pd
import pytest
import standing
from no_plots import without_plots

import sssi_exudyn
from sssi_exudyn import cli
from sssi_exudyn.analysis.biomechanics import label_turns
from sssi_exudyn.analysis.turns import Turn, Turns
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.frames import slope_to_enu
from sssi_exudyn.io.storage import read_storage
from sssi_exudyn.muscle_forces.forces import JOINTS, MUSCLED
from sssi_exudyn.reports.report import write_run
from sssi_exudyn.results.stored import StoredRun
from sssi_exudyn.results.summary import Summary

pytestmark = pytest.mark.usefixtures("words_only")


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A skier who stands, in a result folder that says he turned: first to the left, then to the right."""
    model = replace(gliding.model(), inclination=0.0)
    stood = standing.standing(model, lead=0.1)
    turns = Turns((Turn("left", 0.0, 0.2, True), Turn("right", 0.2, 0.4, True)), ())
    series = label_turns(stood.to_frame(slope_to_enu(0.0, 0.0)), turns)
    folder = tmp_path_factory.mktemp("whole") / "result"
    summary = Summary(recording="stands")
    with without_plots():
        write_run(folder, StoredRun(summary, series, model, geometry=standing.geometry()))
    return folder


@pytest.fixture
def result(whole: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(whole, tmp_path / "result"))


@pytest.mark.long
def test_a_result_gets_its_muscles(result: Path) -> None:
    before = pd.read_parquet(result / "series.parquet")
    summary = sssi_exudyn.muscles(result, result).summary
    series = pd.read_parquet(result / "series.parquet")
    assert list(series.columns[: len(before.columns)]) == list(before.columns)
    activations = [name for name in series if name.startswith("muscle_") and name.endswith("_activation")]
    assert len(activations) == 322
    assert series[activations].to_numpy().min() >= 0.01
    figures = summary.muscles
    assert figures is not None
    assert figures.count == 322
    assert figures.muscle_set == "full"
    assert figures.lacking == ()
    assert set(figures.reserve) == set(MUSCLED)
    for joint in JOINTS:
        peak = figures.contact_peak_bodyweights[joint]
        assert series[f"muscles_{joint}_contact_bodyweights"].max() == pytest.approx(peak)
    assert json.loads((result / "summary.json").read_text(encoding="utf-8"))["muscles"]["power"] == 2
    heavier, lighter = (
        series[f"muscles_leg_quadriceps_femoris_{side}_activation"].mean() for side in ("right", "left")
    )
    assert heavier > lighter  # a fifth more of the weight stands on the right
    for name in ("muscle_activations.sto", "muscle_forces.sto"):
        path = result / name
        table = asdict(read_storage(path, path.read_text(encoding="utf-8")))
        assert table["values"].shape == (len(series), 323)
        assert not table["in_degrees"]
    k = table["columns"].index("soleus_r")
    assert np.allclose(table["values"][:, k], series["muscle_soleus_r_force_N"], rtol=1e-9)  # ten digits are written


@pytest.mark.long
def test_the_page_has_one_section_however_often(result: Path) -> None:
    plain = (result / "report.html").read_text(encoding="utf-8")
    for power in (2, 3):
        sssi_exudyn.muscles(result, result, power=power)
        page = (result / "report.html").read_text(encoding="utf-8")
        assert page.count("<h2") == plain.count("<h2") + 1
        assert page.count(">Muscles</a>") == 1
        assert f"to the power of {power} is least" in page
        assert "over a turn" in page
        assert "Instrumented knees" in page
        for group in ("gluteus maximus", "tibialis anterior", "hip adductors", "erector spinae", "latissimus dorsi"):
            assert page.count(f'<th scope="row">{group}</th>') == 1
        assert page.count('<th scope="row">psoas major</th>') == 2  # of the leg and of the trunk


@pytest.mark.long
def test_out_leaves_the_result_as_it_is(result: Path, tmp_path: Path) -> None:
    before = {path.name: path.read_bytes() for path in result.iterdir() if path.is_file()}
    sssi_exudyn.muscles(result, tmp_path / "out")
    assert {path.name: path.read_bytes() for path in result.iterdir() if path.name in before} == before
    assert (tmp_path / "out" / "muscle_forces.sto").is_file()
    assert (tmp_path / "out" / "model.toml").read_bytes() == before["model.toml"]


@pytest.mark.long
def test_no_result_no_out(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        cli.main(["muscles", str(tmp_path)])
    assert ended.value.code == 2
    assert "not a result" in capsys.readouterr().err


@pytest.mark.long
def test_a_result_without_lengths_says_so(result: Path) -> None:
    (result / "skeleton.json").unlink()
    with pytest.raises(InputError, match="did not keep the skier's lengths"):
        sssi_exudyn.muscles(result, result)


@pytest.mark.long
def test_the_papers_muscles_alone(result: Path) -> None:
    sssi_exudyn.muscles(result, result)
    summary = sssi_exudyn.muscles(result, result, muscles="paper").summary
    assert summary.muscles is not None
    assert (summary.muscles.count, summary.muscles.muscle_set) == (284, "paper")
    series = pd.read_parquet(result / "series.parquet")
    assert sum(name.startswith("muscle_") and name.endswith("_activation") for name in series) == 284
    assert "hip adductors" not in (result / "report.html").read_text(encoding="utf-8")


@pytest.mark.long
@pytest.mark.parametrize(("options", "number"), [([], 322), (["--muscles", "paper"], 284)])
def test_list_is_csv(options: list[str], number: int, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        cli.main(["muscles", "--list", *options])
    assert ended.value.code == 0
    text = capsys.readouterr().out
    assert text.startswith("name,side,region,group,max_isometric_force_N,")
    rows = list(csv.DictReader(io.StringIO(text)))
    assert len(rows) == number
    assert {row["region"] for row in rows} == {"leg", "lumbar"}


@pytest.mark.long
def test_nothing_given_is_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        cli.main(["muscles"])
    assert ended.value.code == 2
    assert capsys.readouterr().err.count("\n") == 1
