"""The diagnosis on runs whose hidden effect is known, made by the benchmark's world; with the reduced model."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
import tomli_w
from a_diagnosis import diagnosis_of, finding_of
from a_linear_model import LEVELS
from bundled import bundled, coarse, steady
from coarse_skis import in_less_detail
from explanations import NOWHERE, refitted
from schema_check import check_against_schema

from sssi_exudyn.contact.terms.body_forces import UnexplainedForce
from sssi_exudyn.contact.terms.friction_corrections import SnowPatch, UnexplainedDrag, UnexplainedFriction
from sssi_exudyn.contact.terms.terrain import SlopeChange
from sssi_exudyn.contact.terms.wind import Gust
from sssi_exudyn.core.errors import SimulationDiverged
from sssi_exudyn.core.number_ref import NumberRef
from sssi_exudyn.fitting import linear_fit
from sssi_exudyn.fitting.evidence import Freedom
from sssi_exudyn.fitting.first_fit import fit_reduced, problem_of
from sssi_exudyn.fitting.linear_fit import refit
from sssi_exudyn.fitting.objective import Prior
from sssi_exudyn.fitting.observations import predict_fixes, track_of
from sssi_exudyn.fitting.parameters import Parameter
from sssi_exudyn.io.typed import read_json
from sssi_exudyn.io.writing import to_json
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.model.model import Model
from sssi_exudyn.model.toml import model_files, model_to_dict, read_model
from sssi_exudyn.motion.motion import Motion
from sssi_exudyn.recording.recording import Recording
from sssi_exudyn.reports.html import section_html
from sssi_exudyn.reports.section import Section
from sssi_exudyn.reports.sections.diagnosis import diagnosis_blocks
from sssi_exudyn.simulation.full.run import simulate
from sssi_exudyn.simulation.reduced.prepared import prepare
from sssi_exudyn.simulation.reduced.run import simulate_reduced
from sssi_exudyn.simulation.reduced.sensitivities import sensitivities
from sssi_exudyn.validation.benchmark.cases import Case, Made, Planned, make, plan
from sssi_exudyn.validation.benchmark.effects import UNKNOWN
from sssi_exudyn.validation.benchmark.page import benchmark_page
from sssi_exudyn.validation.benchmark.run import seal
from sssi_exudyn.validation.benchmark.scores import CaseResult, score, share
from sssi_exudyn.validation.diagnosis import diagnose as diagnose_module
from sssi_exudyn.validation.diagnosis.context import DiagnosisProblem, diagnosis_problem, no_nuisances
from sssi_exudyn.validation.diagnosis.diagnose import compare_again, diagnose
from sssi_exudyn.validation.diagnosis.diagnosis_data import Alternative, Change, Diagnosis, Evidence, Finding
from sssi_exudyn.validation.diagnosis.hypotheses.catalogue import BY_NAME
from sssi_exudyn.validation.diagnosis.hypotheses.hypothesis import Candidate, FittedRun, responses_of
from sssi_exudyn.validation.diagnosis.search.compare_hypotheses import compare_hypotheses, extended_parameters
from sssi_exudyn.validation.diagnosis.search.search_result import Accepted
from sssi_exudyn.validation.diagnosis.state import (
    Reestimate,
    State,
    first_fit,
    fit_model,
    linear_model,
    linear_without,
    noise_whitener,
    remove,
)
from sssi_exudyn.validation.diagnosis.thresholds import THRESHOLDS
from sssi_exudyn.validation.diagnosis.wording.description import most_gain_first, verdict_of

ROOT = Path(__file__).parents[3]
SCHEMA = ROOT / "validation" / "diagnosis" / "diagnosis.schema.json"
FEW = [BY_NAME[name] for name in ("gps_jump", "unexplained_force")]
FEWER_WORLDS = replace(THRESHOLDS, worlds=1000)
"""What the diagnosis learns from simulated runs is tested in ``worlds``; here it has to be there, however coarse."""
KEYS = {"format", "recording", "verdict", "sentence", "findings", "friction", "noise"}


pytestmark = pytest.mark.usefixtures("coarse_skis")


@pytest.fixture(scope="module")
def base() -> tuple[Recording, Motion, Model]:
    recording, motion = bundled("beginner")
    motion = replace(motion, stop=motion.start + 8.0)  # two turns: what is hidden is seen as well as in 11 s
    model = coarse(model_of(recording, motion))  # the world is a full model still
    problem = problem_of(recording, motion, model, "joint")
    with in_less_detail():
        return recording, motion, problem.model_at(fit_reduced(problem, prepare(problem.model, motion)).values)


def state_of(problem: DiagnosisProblem) -> State:
    """Nothing is uncertain but what instruments usually show."""
    size = len(problem.measurements.measured)
    return State(problem.measurements.usual, no_nuisances(size), np.zeros(size))


def shown(diagnosis: Diagnosis) -> str:
    return section_html(Section("", diagnosis_blocks(diagnosis)), "part")


def diagnose_case(made: Made, tmp_path: Path) -> tuple[Case, dict[str, Any]]:
    shares: list[float] = []

    def report(share: float | None, _detail: str) -> None:
        shares.extend([] if share is None else [share])

    diagnosed = diagnose(made.recording, made.motion, made.model, full=False, thresholds=FEWER_WORLDS, progress=report)
    assert shares == sorted(shares)  # progress never goes back
    assert shares[0] >= 0.0
    assert shares[-1] <= 1.0
    diagnosis = diagnosed.diagnosis
    assert diagnosis.sentence.split(":")[0] in shown(diagnosis)
    path = tmp_path / "diagnosis.json"
    path.write_text(to_json(diagnosis))
    assert read_json(path, Diagnosis) == diagnosis
    written = json.loads(path.read_text())
    check_against_schema(written, json.loads(SCHEMA.read_text()))
    return made.case, written


@pytest.mark.long(seconds=65)
def test_a_patch_of_slow_snow_is_found_named_and_placed(base: Any, tmp_path: Path) -> None:
    case, written = diagnose_case(make(0, Planned("snow_patch", "physics", 3), [base], seed=4), tmp_path)
    assert written.keys() >= KEYS
    finding = written["findings"][0]
    names = [finding["name"], *(other["name"] for other in finding["alternatives"])]
    assert "snow_patch" in names[:3]
    begin, end = case.window
    both = min(end, finding["where"]["t1_s"]) - max(begin, finding["where"]["t0_s"])
    assert both > 0.6 * (end - begin)
    errors = finding["evidence"]["held_out_error_m"]
    assert errors["after"] < 0.7 * errors["before"]  # 0.62: the fit without it has bent posture and snow to the run
    placebos = finding["evidence"]["placebo_held_out_error_m"]
    assert placebos["least"] <= placebos["median"]
    assert errors["after"] < placebos["median"]  # in a fifth of blind cases the best of 19 is better
    assert finding["evidence"]["trajectory_error_m"]["after"] < finding["evidence"]["trajectory_error_m"]["before"]
    # 0.86: the world's patch has other edges, and noise leaves some force; a wind that swells has 0.2
    assert 0.7 < finding["evidence"]["force_explained"] <= 1.0


@pytest.mark.long(seconds=25)
def test_where_nothing_is_hidden_nothing_is_found(base: Any, tmp_path: Path) -> None:
    _, written = diagnose_case(make(0, Planned("none", "none", 0), [base], seed=6), tmp_path)
    assert written["verdict"] == "none"
    assert written["findings"] == []
    assert abs(written["friction"]["after"]["mu_t"] - written["friction"]["before"]["mu_t"]) < 1e-12


def test_the_plan_follows_from_its_seed_and_the_answers_are_sealed(tmp_path: Path) -> None:
    planned = plan(200, 3)
    assert len(planned) == 200
    assert sum(case.kind == "none" for case in planned) == 50
    assert planned == plan(200, 3)
    assert planned != plan(200, 4)
    assert {case.kind for case in plan(20, 3, "nothing")} == {"none"}
    assert {case.name for case in plan(20, 3, "unlisted")} == set(UNKNOWN)
    assert {case.kind for case in plan(20, 3, "pairs")} == {"pair"}
    assert {(case.name, case.kind) for case in planned if case.kind in ("physics", "sensor")} == {
        (case.name, case.kind) for case in plan(21, 3, "listed")
    }
    assert {case.strength for case in planned if case.kind == "physics"} == {0, 1, 2, 3}
    whole = plan(20, 3, "whole_runs")
    assert {case.lengths for case in whole} == {(12.0, 15.0)}
    assert [case.name for case in whole if case.name != "none"] == [case.name for case in plan(15, 3, "listed")]
    digest = seal(tmp_path, [])
    assert (tmp_path / "answers.sha256").read_text().strip() == digest
    (tmp_path / "answers.sha256").write_text("of others")
    with pytest.raises(ValueError, match="the seal of other answers"):
        seal(tmp_path, [])


def test_shares_have_exact_intervals() -> None:
    estimate = share(0, 59)
    # 0 of 59 bounds a rate below 1 − 0.025^(1/59)
    assert estimate.high == pytest.approx(1.0 - 0.025 ** (1.0 / 59.0))
    assert share(3, 3).low == pytest.approx(0.025 ** (1.0 / 3.0))
    scores = score([], [], "0a")
    assert scores.cases == 0
    assert "0 cases" in benchmark_page(scores)


def answer(*findings: Finding, oracle: float | None = None) -> CaseResult:
    """What is kept of one case."""
    return CaseResult(0, None, True, diagnosis_of(*findings), None, 0.04, 0.03, "gust", "wind", oracle)


def test_scores_count_the_answers() -> None:
    def case(name: str, kind: str, strength: int = 0) -> Case:
        return Case(0, "beginner", name, kind, strength, (2.0, 4.5), {"w_f": -4.5} if name == "gust" else {})

    rows = [
        (case("none", "none"), answer()),
        (case("none", "none"), answer(finding_of("wind", 0.9))),  # a false alarm, and a sure one
        (case("gust", "physics", 3), answer(finding_of("gust", 0.97), oracle=20.0)),
        (case("gust", "physics", 2), answer(finding_of("wind", 0.6, ("gust", 0.36)), oracle=9.0)),
        (case("gust", "physics", 2), answer(finding_of("wind", 0.6, ("drag_area", 0.38)), oracle=9.0)),
        (case("gust", "physics", 0), answer(oracle=1.0)),
        (case("wind", "physics", 1), answer(finding_of("gust", 0.99, after=0.2), oracle=8.5)),  # wrong and sure
        (case("push", "unexplained", 3), answer(finding_of("unexplained_force", 0.7))),
        (case("gust+wind", "pair", 2), answer(finding_of("wind", 0.9), finding_of("gust", 0.9))),
    ]
    scores = score([c for c, _ in rows], [d for _, d in rows], "0a")
    assert (scores.false_alarms.hits, scores.false_alarms.of) == (1, 2)
    assert (scores.strong_right_or_small_set.hits, scores.strong_right_or_small_set.of) == (2, 4)
    assert scores.strong_right_name_first.hits == 1
    assert scores.strong_right_bic.hits == 3
    assert (scores.set_coverage_where_found.hits, scores.set_coverage_where_found.of) == (2, 4)
    assert (scores.interval_coverage_90.hits, scores.interval_coverage_90.of) == (1, 1)
    assert (scores.wrong_and_sure.hits, scores.wrong_and_sure.of) == (2, 5)
    assert scores.right_name_first.hits == 1
    assert (scores.false_alarms_force.hits, scores.strong_seen_force.of) == (0, 4)
    assert scores.friction_inside_90.of == 0
    assert scores.unexplained_called_so.hits == 1
    assert scores.pairs_both_named.hits == 1
    assert scores.overlap_in_time.mean == pytest.approx(2.0 / 2.5)
    back = scores.strong_within_noise
    assert (back.hits, back.of) == (3, 4)  # 0.05 m against 1.5 · 0.04, one of 0.2
    assert scores.strong_within_plain.hits == 0  # 0.05 m against 1.5 · 0.03
    assert scores.nothing_within_noise.share == 1.0
    assert scores.strong_better_than_placebos.hits == 3  # 0.05 m against 0.1, one of 0.2
    assert scores.placebo_after_over_before_strong == pytest.approx(0.9)
    assert [level.right.hits for level in scores.calibration] == [0, 1, 2, 1]
    assert [level.right.of for level in scores.calibration] == [0, 3, 3, 2]
    assert "| gust | wind 2, gust 1, nothing 1 |" in benchmark_page(scores)


class Scripted:
    """Rounds that are written beforehand, in place of the search's own functions; fits are words."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, *rounds: Any) -> None:
        self.rounds, self.asked = list(rounds), []
        replaced = self.compare_hypotheses, self.remove, self.estimate_rivals, self.linear_model, self.weigh_finding
        for function in replaced:
            monkeypatch.setattr(diagnose_module, function.__name__, function)

    def compare_hypotheses(self, problem: Any, state: State, base: str) -> Any:
        self.asked.append(base)
        return self.rounds.pop(0)

    def remove(self, problem: Any, state: State, fit: str, candidate: str) -> tuple[State, str]:
        return state, f"{fit} less {candidate}"

    def estimate_rivals(
        self, problem: Any, state: State, latest: Any, *, full: bool
    ) -> tuple[Any, dict[str, Reestimate]]:
        return latest, {latest.best.name: Reestimate(problem, state, latest.best.fit)}

    def linear_model(self, problem: Any, state: State, fit: str) -> str:
        return f"about {fit}"

    def weigh_finding(self, latest: Any, finding: Any, estimates: Any) -> tuple[Any, Any]:
        return latest, finding

    def compare_again(self, accepted: list[Any]) -> list[Any]:
        state, problem = State(LEVELS, no_nuisances(0), np.zeros(0)), cast(Any, NOWHERE)
        return compare_again(problem, state, accepted, full=False)[1]


def round_with(name: str, nothing: float) -> Any:
    best = refitted(name, candidate=name, fit=f"with {name}", levels=LEVELS)
    return SimpleNamespace(best=best, nothing=SimpleNamespace(probability=nothing))


def test_the_first_finding_is_compared_again_next_to_the_others(monkeypatch: pytest.MonkeyPatch) -> None:
    first, second = round_with("lever_arm", 0.0), round_with("slope_change", 0.0)
    accepted: list[Any] = [
        Accepted(searched, searched.best, searched.best.fit, cast(Any, None)) for searched in (first, second)
    ]
    same = Scripted(monkeypatch, round_with("lever_arm", 0.01))
    assert len(same.compare_again(accepted)) == 2
    assert same.asked == ["with slope_change less lever_arm"]
    better = Scripted(monkeypatch, round_with("gps_delay", 0.01), round_with("slope_change", 0.0))
    after = better.compare_again(accepted)
    assert better.asked == ["with slope_change less lever_arm", "with gps_delay less slope_change"]
    assert [finding.explanation.name for finding in after] == ["gps_delay", "slope_change"]
    superfluous = Scripted(monkeypatch, round_with("lever_arm", 0.6), round_with("gust", 0.6))
    assert superfluous.compare_again(accepted) == []
    twice = [accepted[0], accepted[0], accepted[1]]
    assert Scripted(monkeypatch).compare_again(twice) == twice


def test_what_explains_most_is_read_first() -> None:
    nothing = SimpleNamespace(log_evidence=30.0)
    findings = [
        Accepted(cast(Any, SimpleNamespace(nothing=nothing)), refitted(name, gain, fit=name), *cast(Any, (None, None)))
        for name, gain in (("unexplained_force", 45.0), ("snow_compaction", 110.0), ("gust", 40.0))
    ]
    evidence: list[Any] = ["of a force", "of compaction", "of a gust"]
    read = most_gain_first(findings, evidence)
    assert [(finding.explanation.name, its) for finding, its in read] == [
        ("snow_compaction", "of compaction"), ("unexplained_force", "of a force"), ("gust", "of a gust"),
    ]  # fmt: skip


@pytest.mark.long
def test_what_is_put_in_and_taken_out_leaves_the_fit_as_it_was(base: Any) -> None:
    recording, motion, model = base
    problem = diagnosis_problem(recording, replace(motion, stop=motion.start + 4.0), model)
    problem, state, fit = first_fit(problem)
    part = SlopeChange(0.0, model.start.f + 8.0, 3.0)
    candidate = Candidate(
        replace(fit.model, terms=(*fit.model.terms, part)),
        Freedom(np.zeros((len(fit.predicted), 1)), np.array([0.02])),
        ((NumberRef("slope_change.delta"),),),
        {NumberRef("slope_change.f0"): 1.0},
    )
    parameters, places = extended_parameters(fit, candidate)
    more = fit_model(problem, state, candidate.model, (*parameters, *places), state.levels)
    assert len(more.parameters) == len(fit.parameters) + 2
    bare, usual = linear_without(problem, state, more, candidate), linear_model(problem, state, more)
    assert bare.free.columns.shape[1] == usual.free.columns.shape[1] - 2
    # what it does is its response times its size, and no longer a part of the prediction
    moved = more.sensitivity[:, -2] * more.values[-2]
    placed = usual.residual - more.sensitivity[:, -1] * more.pulls[-1]
    np.testing.assert_allclose(bare.residual, placed, atol=1e-9)
    np.testing.assert_allclose(
        bare.residual,
        problem.measurements.measured - more.predicted + more.sensitivity[:, :-2] @ more.pulls[:-2] + moved,
        atol=1e-9,
    )
    _, again = remove(problem, state, more, candidate)
    assert [p.names for p in again.parameters] == [p.names for p in fit.parameters]
    assert [term.name for term in again.model.terms] == [term.name for term in fit.model.terms]
    # fits stop when a step is a twentieth of the standard errors
    spread = np.sqrt(np.diag(fit.covariance))
    assert np.all(np.abs(again.values - fit.values) < 0.3 * spread)


@pytest.mark.long
def test_what_is_physically_impossible_is_refused(base: Any) -> None:
    _, _, model = base

    def possible(part: Any) -> bool:
        return BY_NAME[part.name].possible(replace(model, terms=(*model.terms, part)))

    assert possible(Gust(w_f=-12.0, w_l=9.0))
    assert not possible(Gust(w_f=24.0, w_l=10.0))
    assert not possible(Gust(w_f=12.0, t0=3.0, t1=3.5))  # comes and goes within a second
    assert possible(SnowPatch(delta_mu_t=-0.5 * model.friction.mu_t))
    assert not possible(SnowPatch(delta_mu_t=-model.friction.mu_t))  # snow that does not brake at all
    assert possible(SlopeChange(0.2))


@pytest.mark.long
def test_a_push_is_found_where_it_was_from_nearby(base: Any) -> None:
    recording, motion, model = base
    problem = diagnosis_problem(recording, replace(motion, stop=motion.start + 5.0), model)
    begin = motion.start + 2.1

    def pushed(force: float, t0: float, t1: float) -> Model:
        part = UnexplainedForce(force, 0.5 * force, 0.0, t0, t1)
        return replace(problem.model, terms=(*problem.model.terms, part))

    true = pushed(150.0, begin, begin + 0.5)
    seen = problem.measurements.predict(true, simulate_reduced(true, problem.prepared))
    # nothing but the push: what is left of the measurements is taken out again
    offset = problem.measurements.measured - seen
    amplitudes = [Parameter((f"unexplained_force.force_{axis}",), Prior(0.0, 100.0)) for axis in "fl"]
    places = [
        Parameter((f"unexplained_force.{key}",), Prior(t, 0.4)) for key, t in (("t0", begin - 0.3), ("t1", begin + 0.5))
    ]
    noise = noise_whitener(problem, state_of(problem), problem.measurements.usual, problem.model)
    start = pushed(0.0, begin - 0.3, begin + 0.5)
    fit = refit(
        start, (*amplitudes, *places), problem.prepared, problem.measurements, noise, lambda model: (model, offset)
    )
    force_f, force_l, t0, t1 = fit.values
    # fits stop within a twentieth of the standard errors; priors draw by a few per cent
    assert abs(0.5 * (t0 + t1) - begin - 0.25) < 0.02
    assert force_f * (t1 - t0) == pytest.approx(75.0, rel=0.05)
    assert force_l * (t1 - t0) == pytest.approx(37.5, rel=0.05)


@pytest.mark.long
@pytest.mark.parametrize("more", [0.04, -0.04])
def test_which_ski_glides_worse_follows_from_loads_and_track(base: Any, more: float) -> None:
    recording, motion, model = base
    problem = diagnosis_problem(recording, replace(motion, stop=motion.start + 5.0), model)
    mu_t = problem.model.value("friction.mu_t")
    true = replace(problem.model, terms=(*problem.model.terms, UnexplainedFriction(more)))
    seen = problem.measurements.predict(true, simulate_reduced(true, problem.prepared))
    offset = problem.measurements.measured - seen
    start = replace(problem.model, terms=(*problem.model.terms, UnexplainedFriction()))
    sought = [
        Parameter(("unexplained_friction.delta_mu",), Prior(0.0, 0.1)),
        Parameter(("friction.mu_t",), Prior(mu_t, 0.1)),
    ]
    noise = noise_whitener(problem, state_of(problem), problem.measurements.usual, problem.model)
    fit = refit(start, sought, problem.prepared, problem.measurements, noise, lambda model: (model, offset))
    delta, mean = fit.values
    # fits stop within a twentieth of the standard errors; priors draw by a few per cent
    assert delta == pytest.approx(more, rel=0.05)
    assert mean == pytest.approx(mu_t, abs=0.001)


def test_a_refit_steps_back_where_a_run_diverges(base: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    recording, motion, model = base
    problem = diagnosis_problem(recording, replace(motion, stop=motion.start + 2.0), model)
    seen = problem.measurements.predict(problem.model, simulate_reduced(problem.model, problem.prepared))
    offset = problem.measurements.measured - seen  # the model is right
    mu_t = problem.model.value("friction.mu_t")
    start = problem.model.with_values({"friction.mu_t": mu_t + 0.02})
    sought = [Parameter(("friction.mu_t",), Prior(mu_t, 0.1))]
    noise = noise_whitener(problem, state_of(problem), problem.measurements.usual, problem.model)
    calls = 0

    def diverging(*arguments: Any) -> Any:
        nonlocal calls
        calls += 1
        if calls == 2:
            raise SimulationDiverged(1.0, "made to")
        return sensitivities(*arguments)

    monkeypatch.setattr(linear_fit, "sensitivities", diverging)
    fit = refit(start, sought, problem.prepared, problem.measurements, noise, lambda model: (model, offset))
    assert calls > 2
    assert fit.values == pytest.approx([mu_t], abs=0.001)  # fits stop within a twentieth of the standard errors


@pytest.mark.long
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_which_ski_is_held_back_follows_from_loads_and_track(base: Any, side: float) -> None:
    recording, motion, model = base
    problem = diagnosis_problem(recording, replace(motion, stop=motion.start + 5.0), model)
    begin = motion.start + 2.1

    def held(brake: float, side: float) -> Model:
        part = UnexplainedDrag(brake, brake, begin, begin + 0.4, 0.05, side)
        return replace(problem.model, terms=(*problem.model.terms, part))

    true = held(120.0, side)
    seen = problem.measurements.predict(true, simulate_reduced(true, problem.prepared))
    offset = problem.measurements.measured - seen
    amplitudes = [Parameter((f"unexplained_drag.brake_{way}",), Prior(0.0, 100.0)) for way in "tn"]
    noise = noise_whitener(problem, state_of(problem), problem.measurements.usual, problem.model)
    right, wrong = (
        refit(
            held(50.0, tried), amplitudes, problem.prepared, problem.measurements, noise, lambda model: (model, offset)
        )
        for tried in (side, -side)
    )
    # fits stop within a twentieth of the standard errors; priors draw by a few per cent
    np.testing.assert_allclose(right.values, 120.0, rtol=0.05)
    assert wrong.objective > right.objective + 2.0  # e² = 7 times less probable


def test_a_verdict_of_no_known_cause_is_more_probable_than_not() -> None:
    near: Any = SimpleNamespace(adequate=True)

    def verdict(name: str, probability: float, after: float | None = 0.04, **others: float) -> str:
        alternatives = tuple(Alternative(rival, p) for rival, p in others.items())
        finding: Any = SimpleNamespace(
            name=name,
            kind=BY_NAME[name].kind,
            probability=probability,
            alternatives=alternatives,
            evidence=Evidence(Change(0.10, 0.014), Change(0.18, after), Change(5.0, 1.0)),
        )
        return verdict_of([finding], near, 0.0)

    assert verdict("unexplained_force", 0.95) == "unexplained"
    assert verdict("unexplained_force", 0.4, unexplained_drag=0.2, snow_patch=0.4) == "unexplained"
    assert verdict("unexplained_force", 0.43, load_dependent_friction=0.38) == "ambiguous"
    assert verdict("snow_patch", 0.5, unexplained_force=0.5) == "ambiguous"
    assert verdict("snow_patch", 0.9) == "explained"
    assert verdict("snow_patch", 0.9, 0.19) == "ambiguous"  # turns that were not fitted reject it
    assert verdict("snow_patch", 0.9, None) == "explained"
    assert verdict_of([], near, 0.9) == "none"
    assert verdict_of([], near, 0.9, alike=False) == "not_adequate"  # nothing like it was simulated


@pytest.mark.long
def test_derivatives_by_instants_are_taken_nearby(base: Any) -> None:
    """Against central differences of twice the step: what they differ by is curvature."""
    recording, motion, model = base
    problem = diagnosis_problem(recording, replace(motion, stop=motion.start + 5.0), model)
    t0 = motion.start + 2.0
    part = Gust(w_f=-10.0, w_l=3.0, t0=t0, t1=t0 + 1.5)
    gusty = replace(problem.model, terms=(*problem.model.terms, part))
    predicted = problem.measurements.predict
    track = slice(0, problem.measurements.blocks["y"].stop)
    slope = sensitivities(gusty, problem.prepared, ["gust.t0"], predicted)[1][track, 0]
    ahead, behind = (
        predicted(moved, simulate_reduced(moved, problem.prepared))[track]
        for moved in (gusty.with_values({"gust.t0": t0 + d}) for d in (0.02, -0.02))
    )
    central = (ahead - behind) / 0.04
    assert np.max(np.abs(slope - central)) < 0.05 * np.max(np.abs(central))


@pytest.mark.long
def test_a_turned_capture_is_found_by_the_fit_s_own_derivatives(base: Any) -> None:
    """Freedom of the fit and hypothesis are one column, so that a turn that the fit has found may be either's."""
    recording, motion, model = base
    problem = diagnosis_problem(recording, replace(motion, stop=motion.start + 5.0), model)
    turned = problem.model.with_values({"start.heading_offset": 0.06})
    names = ["start.heading_offset", "start.clock_offset"]
    seen, slopes = sensitivities(turned, problem.prepared, names, problem.measurements.predict)
    run = simulate_reduced(turned, problem.prepared)
    fitted = FittedRun(turned, problem.prepared, run, problem.measurements, seen)
    white = noise_whitener(problem, state_of(problem), problem.measurements.usual, turned)
    for name, column in zip(("heading_misalignment", "gps_delay"), slopes.T, strict=True):
        response = responses_of(BY_NAME[name].probes(fitted), problem.prepared, problem.measurements)[:, 0]
        whitened = white(np.column_stack([response, column]))
        apart = np.linalg.norm(whitened[:, 0] - whitened[:, 1]) / np.linalg.norm(whitened[:, 1])
        assert apart < 1e-9, name  # rounding


@pytest.mark.long(seconds=30)
def test_the_model_that_is_written_meets_the_track_as_is_claimed(base: Any, tmp_path: Path) -> None:
    """The full model's run of ``model.toml``, read back, against the figure of the sentence."""
    recording, motion, model = base
    motion = replace(motion, stop=motion.start + 4.0)
    displaced = (recording.gps.time > motion.start + 1.5) & (recording.gps.time < motion.start + 2.5)
    enu = recording.gps.enu + np.where(displaced[:, None], [[0.6, -0.4, 0.0]], 0.0)
    displaced_recording = steady(replace(recording, gps=replace(recording.gps, enu=enu)))
    diagnosed = diagnose(displaced_recording, motion, model, hypotheses=FEW, thresholds=FEWER_WORLDS)
    assert [finding.name for finding in diagnosed.diagnosis.findings] == ["gps_jump"]
    claimed = diagnosed.diagnosis.findings[0].evidence.trajectory_error_m
    assert claimed.after < 0.04 < 0.1 < claimed.before
    shown = diagnosed.diagnosis.track_distance  # the curves of the figure, of the same two models
    assert (np.mean(shown.before_m), np.mean(shown.after_m)) == pytest.approx((claimed.before, claimed.after))
    (tmp_path / "model.toml").write_text(tomli_w.dumps(model_to_dict(diagnosed.model)), encoding="utf-8")
    for name, content in model_files(diagnosed.model).items():
        (tmp_path / name).write_bytes(content)
    read = read_model(tmp_path / "model.toml")
    run = simulate(read, motion)
    track = track_of(replace(recording.gps, enu=enu), read.fall_line_azimuth, motion.start, motion.stop)
    missed = track.place - predict_fixes(read, run.time, run.antenna, track.time)[:, :2]
    assert np.mean(np.linalg.norm(missed, axis=1)) < 1.2 * claimed.after


@pytest.mark.long(seconds=30)
def test_what_cannot_be_simulated_ends_the_search_and_not_the_diagnosis(
    base: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    recording, motion, model = base
    motion = replace(motion, stop=motion.start + 4.0)
    # the fixes jump by 1 m, 50 standard deviations
    jump = np.where(recording.gps.time[:, None] > motion.start + 2.0, [[1.0, 0.0, 0.0]], 0.0)
    jumped = steady(replace(recording, gps=replace(recording.gps, enu=recording.gps.enu + jump)))
    asked = []

    def once(problem: DiagnosisProblem, state: State, fit: Any) -> Any:
        asked.append(fit)
        if len(asked) > 1:
            raise SimulationDiverged(3.0, "the run")
        return compare_hypotheses(problem, state, fit)

    monkeypatch.setattr(diagnose_module, "compare_hypotheses", once)
    diagnosed = diagnose(jumped, motion, model, full=False, hypotheses=FEW, thresholds=FEWER_WORLDS)
    assert len(asked) == 2
    assert diagnosed.diagnosis.verdict == "not_adequate"  # the jump is still there
    assert diagnosed.fit is diagnosed.first
