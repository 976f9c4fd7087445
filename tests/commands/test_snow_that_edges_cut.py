"""``--snow carving``: what is run, what the result and its report tell, and what does not go with it."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from bundled import EXAMPLES, bundled
from no_plots import without_plots

import sssi_exudyn
from sssi_exudyn.commands.outcome import Outcome, write_outcome
from sssi_exudyn.commands.runs import add_terms
from sssi_exudyn.contact.terms.carving import Carving
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.model.heading import Heading
from sssi_exudyn.model.toml import read_model
from sssi_exudyn.results.stored import read_run
from sssi_exudyn.results.summary import Estimate, Fit
from sssi_exudyn.simulation.full.run import simulate

pytestmark = pytest.mark.usefixtures("words_only")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The result of half a second on such snow."""
    out = tmp_path_factory.mktemp("carved") / "result"
    recording, motion = bundled("intermediate")
    model = add_terms(model_of(recording, motion), (Carving(mu=0.1),))
    result = simulate(model, motion, stop=motion.start + 0.5)
    fit = Fit(method="joint", parameters={"carving.mu": Estimate(0.1, 0.004)})
    with without_plots():
        write_outcome(out, recording, motion, model, result, Outcome({"command": "simulate"}, fit))
    return out


@pytest.mark.long
def test_the_result_tells_what_the_edges_do(folder: Path) -> None:
    summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    assert summary["friction"] == {"mu_t": {"value": None, "se": None}, "mu_n": {"value": None, "se": None}}
    cut = summary["carving"]
    assert cut["tier"] == "full"
    assert cut["mu"] == {"value": 0.1, "se": 0.004}
    assert cut["hardness_N_m3"] == {"value": 1e8, "se": None}
    # friction is on the resultant, and what is compacted comes on top; on level snow it would be μ
    assert 0.1 < cut["equivalent_mu_t"] < 0.3
    assert 0.3 < cut["equivalent_mu_n"] < 3.0
    assert cut["side_reserve_least"] <= cut["side_reserve_mean"] <= 1.0
    series = read_run(folder).series
    assert {"left_ski_yaw_deg", "right_ski_roll_deg", "left_side_reserve_1", "energy_skid_J"} <= set(series.columns)
    heave = series[["left_ski_heave_m", "right_ski_heave_m"]].to_numpy(dtype=float)
    assert cut["ski_heave_rms_m"] == pytest.approx(np.sqrt(np.mean(heave**2)), rel=1e-3)  # figures are rounded
    assert 0.0 < cut["ski_pitch_rms_deg"] < 20.0


@pytest.mark.long
def test_the_report_has_its_own_section_and_limits(folder: Path) -> None:
    page = (folder / "report.html").read_text(encoding="utf-8")
    assert "Edges that cut the snow" in page
    assert "Its edges cut the snow: friction along them (0.100 of the resultant)" in page
    assert "Friction acts at the foot" not in page


@pytest.mark.long
def test_the_model_is_read_back_whole(folder: Path) -> None:
    model = read_model(folder / "model.toml")
    assert model.term("carving") == Carving(mu=0.1)
    assert {term.name for term in model.terms} == {"air", "carving"}


@pytest.fixture(scope="module")
def freed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same with a heading that the snow decides."""
    out = tmp_path_factory.mktemp("freed") / "result"
    recording, motion = bundled("intermediate")
    model = add_terms(model_of(recording, motion), (Carving(mu=0.1),)).with_heading("free")
    result = simulate(model, motion, stop=motion.start + 0.5)
    with without_plots():
        write_outcome(out, recording, motion, model, result, Outcome({"command": "simulate"}))
    return out


@pytest.mark.long
def test_the_result_tells_where_the_skier_heads(folder: Path, freed: Path) -> None:
    captured, turning = (
        json.loads((result / "summary.json").read_text(encoding="utf-8"))["carving"] for result in (folder, freed)
    )
    assert (captured["heading"], captured["heading_rms_deg"]) == ("replay", 0.0)
    assert turning["heading"] == "free"
    offset = read_run(freed).series["heading_offset_deg"].to_numpy(dtype=float)
    assert turning["heading_rms_deg"] == pytest.approx(np.sqrt(np.mean(offset**2)), rel=1e-3)  # figures are rounded
    assert turning["heading_rms_deg"] > 0.1
    # the first steps, in which the run begins from rest, are counted
    assert turning["yaw_residual_rms_Nm"] < 0.5 * captured["yaw_residual_rms_Nm"]
    assert turning["roll_residual_rms_Nm"] > 0.0
    page = (freed / "report.html").read_text(encoding="utf-8")
    assert "free, moved by snow and air" in page
    assert "the skier&#x27;s balance is captured" in page or "the skier's balance is captured" in page


@pytest.mark.long
def test_the_model_keeps_its_heading(folder: Path, freed: Path, tmp_path: Path) -> None:
    assert read_model(freed / "model.toml").heading == Heading("free")
    assert "[heading]" not in (folder / "model.toml").read_text(encoding="utf-8")
    file = tmp_path / "model.toml"
    text = (freed / "model.toml").read_text(encoding="utf-8")
    for old, new, problem in (
        ('mode = "free"', 'mode = "loose"', r"\[heading\] mode: 'loose' is not known; use one of: replay, track, free"),
        ("stiffness = 500.0", "stiffness = 0.0", r"\[heading\] stiffness: 0 is outside 1 to 1e\+06 N m/rad"),
    ):
        assert old in text
        file.write_text(text.replace(old, new), encoding="utf-8")
        with pytest.raises(InputError, match=problem):
            read_model(file)


@pytest.mark.long
def test_friction_at_the_foot_decides_no_heading() -> None:
    for make in (sssi_exudyn.simulate, sssi_exudyn.fit):
        with pytest.raises(InputError, match="--heading: free: friction at the foot has no yaw moment"):
            make(EXAMPLES / "beginner", None, heading="free")


@pytest.mark.long
def test_a_model_with_two_kinds_of_snow_is_one_clear_line(folder: Path, tmp_path: Path) -> None:
    file = tmp_path / "model.toml"
    text = (folder / "model.toml").read_text(encoding="utf-8")
    file.write_text(f'{text}\n[[term]]\nname = "friction"\n', encoding="utf-8")
    with pytest.raises(InputError, match=r"\[\[term\]\] 3: friction: carving stands in the place of all other laws"):
        read_model(file)


def test_what_does_not_go_with_a_fit() -> None:
    with pytest.raises(InputError, match="the paper's method fits the paper's snow"):
        sssi_exudyn.fit(EXAMPLES / "beginner", None, method="paper", snow="carving")
    recording, _ = bundled("beginner")
    with pytest.raises(InputError, match="there is no GPS to fit to"):
        sssi_exudyn.fit(replace(recording, gps=None), None, snow="carving")


def test_balance_is_sought_on_snow_that_edges_cut() -> None:
    with pytest.raises(InputError, match="--balanced: the lean that balances a skier is sought on snow that edges cut"):
        sssi_exudyn.simulate(EXAMPLES / "beginner", None, balanced=True)
