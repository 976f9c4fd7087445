"""``summary.json``: all figures typed, null where there is none, files of other versions read, and its JSON Schema."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from importlib import resources
from pathlib import Path
from typing import Any

import pytest
from a_run import a_run
from no_plots import without_plots
from schema_check import check_against_schema
from tiny import Tiny

import sssi_exudyn
from sssi_exudyn import commands
from sssi_exudyn.io.typed import json_schema
from sssi_exudyn.io.writing import to_plain
from sssi_exudyn.reports.report import write_run
from sssi_exudyn.results.folder import read_summary
from sssi_exudyn.results.stored import read_run
from sssi_exudyn.results.summary import (
    Estimate,
    Fit,
    Posture,
    Prediction,
    Summary,
    Trajectory,
    summary_from_dict,
    summary_to_dict,
)

OLD = Path(__file__).parent / "old_result"
"""Folder with a ``summary.json`` of ``sssi simulate examples/beginner`` by version 0.1.0, before its figures were
typed, cut short: two segments and four moments.
"""


def schema() -> dict[str, Any]:
    text = (resources.files("sssi_exudyn.results") / "summary.schema.json").read_text(encoding="utf-8")
    return dict(json.loads(text))


def table_of(folder: Path) -> dict[str, Any]:
    return dict(json.loads((folder / "summary.json").read_text(encoding="utf-8")))


pytestmark = pytest.mark.usefixtures("words_only")


@pytest.fixture(scope="module")
def run_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("whole") / "result"
    with without_plots():
        write_run(folder, a_run(6.0, 25.0))
    return folder


@pytest.fixture
def result(run_folder: Path, tmp_path: Path) -> Path:
    """Copy the folder of a run."""
    return Path(shutil.copytree(run_folder, tmp_path / "result"))


def test_the_shipped_schema_is_that_of_the_dataclass() -> None:
    assert schema() == to_plain(json_schema(Summary))


def test_a_summary_fits_its_schema(result: Path) -> None:
    check_against_schema(table_of(result), schema())


def test_a_figure_that_does_not_apply_is_null_never_missing() -> None:
    table = summary_to_dict(summary_from_dict({"trajectory": {"mean_error_m": 0.1, "length_m": float("nan")}}))
    assert table["format"] == 1
    assert set(table["trajectory"]) == set(to_plain(Trajectory()))
    assert table["trajectory"]["mean_error_m"] == 0.1
    assert table["trajectory"]["length_m"] is None
    assert table["friction"]["mu_n"] == {"value": None, "se": None}
    assert table["solver"]["backend"] is None
    assert table["diverged"] is None


def test_groups_of_commands_that_were_not_run_are_not_there() -> None:
    assert not {"posture", "diagnosis", "muscles"} & summary_to_dict(Summary()).keys()


def test_an_old_summary_is_read_and_written_again_with_the_same_figures() -> None:
    old = table_of(OLD)
    check_against_schema(old, schema())
    summary = read_summary(OLD)
    assert summary.friction.mu_t == Estimate(0.1, None)
    assert summary.turns.each is not None
    assert summary.turns.each["turn_radius_m"].mean == old["turns"]["each"]["turn_radius_m"]["mean"]
    written = summary_to_dict(summary)
    assert list(written) == list(old)  # the same groups in the same order
    for name, group in old.items():
        if isinstance(group, dict):
            assert {key: written[name][key] for key in group} == group, name
        else:
            assert written[name] == group, name


@pytest.mark.long
def test_every_command_takes_an_old_result(result: Path, tmp_path: Path) -> None:
    shutil.copyfile(OLD / "summary.json", result / "summary.json")
    page = commands.report([result], tmp_path / "page.html").read_text(encoding="utf-8")
    assert "beginner" in page
    old = table_of(OLD)
    commands.validate(Tiny().write(tmp_path / "recording"), result, tmp_path / "validated")
    sssi_exudyn.muscles(result, tmp_path / "muscles")
    for folder, changed in (("validated", {"trajectory", "pressure_ratio"}), ("muscles", {"muscles"})):
        table = table_of(tmp_path / folder)
        assert {name for name in table if table[name] != old.get(name)} == changed


def test_groups_and_figures_of_a_newer_version_stay(result: Path, tmp_path: Path) -> None:
    table = table_of(result)
    table["helicopter"] = {"rotor_Hz": [4.5, None]}
    table["solver"]["bananas"] = 3
    (result / "summary.json").write_text(json.dumps(table), encoding="utf-8")
    out = tmp_path / "validated"
    commands.validate(Tiny().write(tmp_path / "recording"), result, out)
    assert table_of(out)["helicopter"] == table["helicopter"]
    assert table_of(out)["solver"] == table["solver"]


@pytest.mark.long
def test_validate_keeps_diagnosis_and_muscles(result: Path, tmp_path: Path) -> None:
    sssi_exudyn.muscles(result, result)
    out = tmp_path / "validated"
    summary = commands.validate(Tiny().write(tmp_path / "recording"), result, out)
    assert summary.muscles == read_summary(result).muscles
    assert (out / "muscle_forces.sto").read_bytes() == (result / "muscle_forces.sto").read_bytes()
    assert "Muscles" in (out / "report.html").read_text(encoding="utf-8")


def test_fitted_figures_come_back_as_they_were(tmp_path: Path) -> None:
    fit = Fit(converged=True, evaluations=3, parameters={"friction.mu_t": Estimate(0.1, 0.01)}, correlation=((1.0,),))
    summary = replace(Summary(recording="a"), fit=fit)
    write_run(tmp_path, replace(a_run(6.0, 25.0), summary=summary))
    assert read_run(tmp_path).summary == summary


def test_posture_comes_back_as_it_was() -> None:
    sigma = {"edge_deg": 5.0, "pitch_deg": 3.0, "heading_deg": 6.0, "height_m": 0.05}
    table = {
        "measured": ["both skis"],
        "assumed": ["knee flexion"],
        "sigma": sigma,
        "gps_lag_s": None,
        "unbalanced_rms_m": 0.02,
        "mu_t_se": {"track": 0.001, "posture": 0.004, "slope": 0.01, "steering": 0.02},
        "effective_friction": {"value": 0.2, "se": 0.01},
        "second_half": {"mu_t": 0.05, "speed_rms_mps": 0.4, "constant_speed_rms_mps": 0.9},
    }
    posture = summary_from_dict({"posture": table}).posture
    assert isinstance(posture, Posture)
    # an older file does not say where the halves part
    assert posture.second_half == Prediction(0.05, 0.4, 0.9, None)
    table["second_half"] = {**dict(table["second_half"]), "split_s": None}
    table |= dict.fromkeys(("effective_friction_90", "effective_friction_of_run", "speed_return_1_s"))
    assert to_plain(posture) == table
