"""A law that is in no list: found where it is the truth, and not offered where a law of the list is, or nothing."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pymap3d
import pytest
from a_day import fits_of_two_runs
from a_law import NUMBERS, VARIABLES, law_as_found, number
from a_linear_model import LEVELS, covariance, linear_model
from bundled import bundled

import sssi_exudyn
from sssi_exudyn.contact.maths import ArrayMath
from sssi_exudyn.contact.term import FootState
from sssi_exudyn.contact.terms.friction_law import FrictionLaw
from sssi_exudyn.core.errors import SimulationDiverged
from sssi_exudyn.core.frames import Array, slope_to_enu
from sssi_exudyn.fitting.evidence import Freedom
from sssi_exudyn.fitting.snow_surface import on_snow_surface
from sssi_exudyn.io.typed import read_json
from sssi_exudyn.io.writing import to_json
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.model.model import Model
from sssi_exudyn.model.toml import model_files, model_to_dict, read_model
from sssi_exudyn.reports.day_page import day_page, sentence_of_day
from sssi_exudyn.results.day import Day
from sssi_exudyn.results.folder import write_model
from sssi_exudyn.results.summary import Provenance
from sssi_exudyn.simulation.reduced.prepared import prepare
from sssi_exudyn.simulation.reduced.run import simulate_reduced
from sssi_exudyn.validation.benchmark.concealed_terms import WorldMinimum
from sssi_exudyn.validation.diagnosis.several_runs import friction_regression
from sssi_exudyn.validation.diagnosis.several_runs.friction_regression import (
    BASIS,
    downhill,
    find_law,
    formula_of,
    log_prior_of,
    model_with_law,
    probability_of_sum,
    select,
    what_runs_know,
)
from sssi_exudyn.validation.diagnosis.several_runs.joint_fit import (
    DayExplanation,
    DayRun,
    compare_for_day,
    joint_evidence,
)
from sssi_exudyn.validation.diagnosis.thresholds import THRESHOLDS

RUNS = 3
NAMED = "drag_area"


def day_of(rng: np.random.Generator, effects: dict[str, float], named: float = 0.0) -> tuple[list[DayRun], list[Array]]:
    """Runs as they are measured where products have these ``effects`` and a law of the list that size; and responses
    (N, 1 + k) to the law of the list, which is much like the square of the speed, and to the products.
    """
    runs, columns, friction = [], [], rng.normal(size=2)
    for seed in range(RUNS):
        linear = linear_model(seed)
        free = linear.free.columns * linear.free.scales
        noise = np.linalg.cholesky(covariance(linear) + free[:, 1:2] @ free[:, 1:2].T)
        scale = 2.0 * np.abs(linear.residual).mean() / THRESHOLDS.product_size
        shapes = np.random.default_rng(seed + 50).normal(size=(len(linear.residual), 1 + len(BASIS))) * scale
        shapes[linear.measurements.blocks["load"].start :] *= 0.1
        shapes[:, 0] = 0.9 * shapes[:, 1 + BASIS.index("speed2")] + 0.44 * shapes[:, 0]
        seen = shapes[:, 0] * named + free[:, [0, 2]] @ friction
        seen += sum(size * shapes[:, 1 + BASIS.index(name)] for name, size in effects.items())
        runs.append(DayRun(replace(linear, residual=noise @ rng.normal(size=len(noise)) + seen), LEVELS, (0, 2)))
        columns.append(shapes)
    return runs, columns


def compared(runs: list[DayRun], columns: list[Array]) -> tuple[tuple[str, ...], float, list[DayExplanation]]:
    """Return the best sum, its probability next to nothing and the law of the list, and these two."""
    selection = select(*what_runs_know(runs, [of_run[:, 1:] for of_run in columns]))
    nothing, _, _ = joint_evidence(runs)
    by_size = [
        joint_evidence(runs, [Freedom(c[:, :1], np.array([s * THRESHOLDS.product_size])) for c in columns])[0]
        for s in THRESHOLDS.sizes
    ]
    explanations = [
        DayExplanation("nothing", 0.5, nothing, {}),
        DayExplanation(NAMED, 0.5, float(np.logaddexp.reduce(by_size) - np.log(len(THRESHOLDS.sizes))), {}),
    ]
    best = selection.subsets[selection.best]
    evidence = nothing + float(selection.log_evidence[selection.best])
    return tuple(BASIS[i] for i in best), probability_of_sum(explanations, evidence, len(best)), explanations


def test_evidence_of_a_sum_is_that_of_all_runs_with_everything_integrated_out() -> None:
    runs, columns = day_of(np.random.default_rng(1), {"edge": 0.02})
    products = [of_run[:, 1:] for of_run in columns]
    selection = select(*what_runs_know(runs, products))
    nothing, _, _ = joint_evidence(runs)
    for place in (1, 40, 300):
        subset = list(selection.subsets[place])
        scales = np.full(len(subset), THRESHOLDS.product_size)
        by_size = [
            joint_evidence(runs, [Freedom(p[:, subset], s * scales) for p in products])[0] for s in THRESHOLDS.sizes
        ]
        expected = np.logaddexp.reduce(by_size) - np.log(len(THRESHOLDS.sizes)) - nothing
        assert selection.log_evidence[place] == pytest.approx(expected, abs=1e-7)  # rounding of some hundreds


@pytest.mark.parametrize(
    "effects", [{"slip": 0.03}, {"speed2": 0.03, "edge": -0.02}, {"place2": 0.02, "speed_edge": 0.02, "load": -0.02}]
)
def test_the_products_of_a_law_are_found(effects: dict[str, float]) -> None:
    runs, columns = day_of(np.random.default_rng(2), effects)
    best, probability, _ = compared(runs, columns)
    assert set(best) == set(effects)
    assert probability > THRESHOLDS.law_offered
    selection = select(*what_runs_know(runs, [of_run[:, 1:] for of_run in columns]))
    for i, name in enumerate(BASIS):
        assert (selection.inclusion(i) > 0.95) == (name in effects)


def test_nothing_stays_nothing() -> None:
    empty, offered = [], []
    for seed in range(40):
        runs, columns = day_of(np.random.default_rng(seed), {})
        offered.append(compared(runs, columns)[1] > THRESHOLDS.law_offered)
        empty.append(select(*what_runs_know(runs, [of_run[:, 1:] for of_run in columns])).probability[0])
    assert not any(offered)
    assert np.median(empty) > 1.5 * np.exp(log_prior_of(0))  # which it has without any measurement


@pytest.mark.parametrize("size", [0.01, 0.03, 0.1])
def test_a_law_of_the_list_that_is_the_truth_stays(size: float) -> None:
    for seed in range(20):
        runs, columns = day_of(np.random.default_rng(seed), {}, named=size)
        _, probability, (nothing, named) = compared(runs, columns)
        assert probability < 0.5
        if size > 0.01:
            assert named.log_evidence > nothing.log_evidence + 20.0  # so that there is something to be replaced


def test_one_product_that_is_a_law_of_the_list_is_not_offered_next_to_it() -> None:
    runs, columns = day_of(np.random.default_rng(4), {"speed": 0.03})
    for of_run in columns:
        of_run[:, 0] = of_run[:, 1 + BASIS.index("speed")]
    best, probability, (nothing, named) = compared(runs, columns)
    assert best == ("speed",)
    assert named.log_evidence > nothing.log_evidence + 20.0
    assert probability < 0.1
    # without the law in the list it would be
    evidence = named.log_evidence
    assert (
        probability_of_sum([nothing, replace(named, log_evidence=nothing.log_evidence)], evidence, 1)
        > THRESHOLDS.law_offered
    )


def test_a_law_in_characters() -> None:
    assert formula_of(NUMBERS, VARIABLES) == (
        "μ_t = 0.210 + 0.025·x_speed² − 0.010·x_speed·x_edge; x_speed = (speed − 10.6 m/s)/(0.871 m/s);"
        " x_edge = (edge angle − 34.4°)/(14.3°)"
    )


def test_a_found_law_in_the_day(tmp_path: Path) -> None:
    recording, motion = bundled("intermediate")
    model = model_of(recording, motion)
    explanations = (
        DayExplanation(NAMED, 0.9, 22.0, {**NUMBERS, "drag_area.share": number(0.5)}),
        DayExplanation("nothing", 0.1, 4.0, NUMBERS),
    )
    offered, other = law_as_found(offered=True), law_as_found(offered=False)
    plain = sentence_of_day(explanations, 3, model)
    assert "(90% probable)" in plain
    assert sentence_of_day(explanations, 3, model, replace(other, probability=0.001)) == plain
    unsure_of_law = sentence_of_day(explanations, 3, model, replace(other, probability=0.4))
    assert "(54% probable; " in unsure_of_law
    assert "a law in no list" in unsure_of_law
    sentence = sentence_of_day(explanations, 3, model, offered)
    assert sentence.startswith("In 3 runs together friction along the ski follows a law that is in no list (98%")
    assert offered.formula in sentence
    day = Day(
        1, ("a", "b", "c"), sentence, explanations, Provenance(inputs={"a/gps.csv": "0a"}, seed=0), found_law=offered
    )
    (tmp_path / "day.json").write_text(to_json(day), encoding="utf-8")
    assert read_json(tmp_path / "day.json", Day) == day
    written = json.loads((tmp_path / "day.json").read_text(encoding="utf-8"))
    assert written["found_law"]["inclusion_probability"]["speed2"] == 0.99
    del written["found_law"]  # as files before it are
    (tmp_path / "day.json").write_text(json.dumps(written), encoding="utf-8")
    assert read_json(tmp_path / "day.json", Day) == replace(day, found_law=None)
    page = day_page(day)
    for text in (
        "A law of friction that is in no list",
        "0.025 <span>(0.023 to 0.027)</span>",
        "speed × edge",
        "RUN/law/model.toml",
    ):
        assert text in page
    unsure = day_page(replace(day, found_law=other))
    assert "so it is not offered" in unsure
    assert "RUN/law/model.toml" not in unsure
    assert "no list" not in day_page(replace(day, sentence=plain, found_law=None))


def test_places_count_from_the_first_run() -> None:
    """A recording whose first fix is 50 m farther down the fall line and 9 m to the side of it."""
    recording, motion = bundled("intermediate")
    model = model_of(recording, motion)
    assert recording.gps is not None
    there = slope_to_enu(model.inclination, model.fall_line_azimuth) @ [50.0, 9.0, 0.0]
    origin = pymap3d.enu2geodetic(*there, *recording.gps.origin)
    moved = replace(recording, gps=replace(recording.gps, origin=origin))

    def fit(of: Any) -> Any:
        return SimpleNamespace(problem=SimpleNamespace(gps=of.gps), fit=SimpleNamespace(model=model))

    assert downhill(fit(moved), fit(recording)) == pytest.approx(50.0, abs=0.01)  # the earth's curvature
    assert downhill(fit(recording), fit(recording)) == pytest.approx(0.0, abs=1e-6)  # rounding of degrees


def saved(folder: Path, model: Model) -> Model:
    """Return a model as it is read back from its files."""
    write_model(folder, model_to_dict(model), model_files(model))
    return read_model(folder / "model.toml")


@pytest.mark.long(seconds=10)
@pytest.mark.usefixtures("words_only")
def test_a_run_is_simulated_with_the_law_that_was_saved(tmp_path: Path) -> None:
    recording, motion = bundled("intermediate")
    short = replace(recording, stop=recording.start + 1.0)
    plain = on_snow_surface(model_of(recording, motion), recording, motion)
    law = FrictionLaw(c_speed2=0.05, c_slip=0.03, speed_ref=7.0, place_ref=-12.0)
    stored = saved(tmp_path, replace(plain, terms=(*plain.terms, law)))
    assert law in stored.terms
    with_law, without = (
        sssi_exudyn.simulate(short, tmp_path / str(i), model=model).summary
        for i, model in enumerate((tmp_path / "model.toml", plain))
    )
    assert with_law.diverged is None
    work = [summary.energy.work_J["friction"] for summary in (with_law, without)]
    assert work[0] < 1.05 * work[1] < 0.0


def test_a_run_that_cannot_be_estimated_again_keeps_its_fit(monkeypatch: pytest.MonkeyPatch) -> None:
    fitted: Any = SimpleNamespace(problem=None, state=None, fit=SimpleNamespace(model="as fitted"))

    def diverge(*_: Any, **__: Any) -> None:
        raise SimulationDiverged(1.0, "speed")

    monkeypatch.setattr(friction_regression, "last_estimate", diverge)
    assert model_with_law(fitted) == "as fitted"


@pytest.mark.long(seconds=60)
def test_friction_that_is_least_at_a_speed_is_found_in_two_runs(tmp_path: Path) -> None:
    """No law of the list has a minimum; that of the world is no polynomial."""
    hidden = WorldMinimum(0.06, 11.0, 1.0)
    own = fits_of_two_runs(hidden)
    explanations = compare_for_day(own)
    law, with_law = find_law(own, explanations)
    assert law.offered
    assert law.fitted
    assert "speed2" in law.products
    assert law.inclusion_probability["speed2"] > 0.95
    assert law.log_evidence_over_best_named > 19.0
    assert law.numbers["friction_law.c_speed2"].low > 0.0
    # the law as it is used: friction at the speeds of the runs, against that of the world
    speeds = np.linspace(10.0, 12.0, 7)
    feet = FootState(500.0, speeds, 0.0, 0.6, 0.0, 0.0, law.variables["place"].mean, 0.0, 1.0)
    stored = saved(tmp_path, model_with_law(with_law[0]))
    term = stored.owner("friction_law")
    assert isinstance(term, FrictionLaw)
    fitted = stored.friction.mu_t + term.change(ArrayMath(), feet)
    true = 0.19 - hidden.force(ArrayMath(), feet)[0] / (500.0 * speeds / np.hypot(speeds, 0.1))
    assert np.std(fitted - true) < 0.5 * np.std(true)
    # what is saved is what was found, and meets the track
    for name, found_number in law.numbers.items():
        assert stored.value(name) == pytest.approx(found_number.value, rel=1e-9)
    problem = own[0].problem
    track = slice(problem.measurements.blocks["x"].start, problem.measurements.blocks["y"].stop)
    run = simulate_reduced(stored, prepare(stored, problem.motion))
    missed = (problem.measurements.measured - problem.measurements.predict(stored, run))[track]
    # what the receiver states; it is 0.12 where the start does not move with the law
    assert np.sqrt(np.mean(missed**2)) < 0.02
