"""One run's findings asked of other runs over the same place: where that is, and what these make of them."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pymap3d
import pytest
from a_linear_model import LEVELS
from bundled import bundled, coarse, steady
from explanations import explained, ranked, refitted

from sssi_exudyn.contact.terms.friction_corrections import SnowPatch
from sssi_exudyn.contact.terms.wind import Gust
from sssi_exudyn.core.frames import Array, slope_to_enu
from sssi_exudyn.core.number_ref import NumberRef
from sssi_exudyn.fitting.evidence import Freedom, LinearModel, whiten_columns
from sssi_exudyn.fitting.linear_fit import Refit, with_parameters
from sssi_exudyn.fitting.objective import Prior
from sssi_exudyn.fitting.observations import Measurements
from sssi_exudyn.fitting.parameters import Parameter
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.model.model import Model, add_part
from sssi_exudyn.validation.benchmark import second_pass as benchmark_second_pass
from sssi_exudyn.validation.benchmark.cases import Recorded
from sssi_exudyn.validation.benchmark.second_pass import first_finding, two_passes
from sssi_exudyn.validation.benchmark.world import draw_instruments
from sssi_exudyn.validation.diagnosis.context import no_nuisances
from sssi_exudyn.validation.diagnosis.hypotheses.catalogue import BY_NAME, HYPOTHESES
from sssi_exudyn.validation.diagnosis.hypotheses.hypothesis import Candidate, FittedRun
from sssi_exudyn.validation.diagnosis.search.search_result import Accepted, SearchEnd
from sssi_exudyn.validation.diagnosis.several_runs import second_pass
from sssi_exudyn.validation.diagnosis.several_runs.second_pass import Pass, SamePlace, Way, ask_other_runs, update
from sssi_exudyn.validation.diagnosis.state import State
from sssi_exudyn.validation.diagnosis.thresholds import THRESHOLDS

ORIGIN = (46.8, 10.3, 2600.0)
TIME = np.linspace(0.0, 6.0, 301)
BEGIN, STOP = 2.0, 3.5
"""s, when the first of the synthetic runs is on its patch."""
SPEED = 8.0


def way(places: Array, inclination: float = 0.3, azimuth: float = 1.2, origin: Any = ORIGIN) -> Way:
    return Way(np.arange(len(places), dtype=float), places, inclination, azimuth, origin)


def in_frame(enu: Array, inclination: float, azimuth: float, origin: tuple[float, float, float]) -> Array:
    """(n, 3) m in the slope frame at ``origin``, of places (n, 3) m from ``ORIGIN``, by way of the earth's centre."""
    ecef = pymap3d.enu2ecef(*enu.T, *ORIGIN)
    return np.stack(pymap3d.ecef2enu(*ecef, *origin), axis=1) @ slope_to_enu(inclination, azimuth)


def crossing_ways() -> tuple[Way, Way, Array]:
    """Two ways on one plane slope that cross at their 50th point, there in the first one's frame (3,) m; the second
    run's recording begins elsewhere, and states another fall line and another inclination.
    """
    steps = np.arange(101.0)
    first = np.stack([steps, 4.0 * np.sin(steps / 9.0), np.zeros(101)], axis=1)
    crossing = first + np.stack([np.zeros(101), 0.12 * (steps - 50.0), np.zeros(101)], axis=1)
    to_enu = slope_to_enu(0.3, 1.2)
    latitude, longitude, height = (float(x) for x in pymap3d.enu2geodetic(*(to_enu @ [-25.0, 6.0, 0.0]), *ORIGIN))
    other = 0.31, 1.25, (latitude, longitude, height + 4.0)  # its receiver is 4 m higher
    lifted = crossing @ to_enu.T + np.array([0.0, 0.0, 4.0])
    return way(first), way(in_frame(lifted, *other), *other), first[50]


def test_a_place_is_the_same_in_the_frame_of_another_run() -> None:
    first, second, crossing = crossing_ways()
    there = first.line_in(float(crossing[0]), second)
    # both pass it at their 50th point; the earth's curve over 30 m, and the frames' tilt, leave a millimetre
    assert there == pytest.approx(second.places[50, 0], abs=2e-3)
    assert second.line_in(there, first) == pytest.approx(crossing[0], abs=2e-3)
    assert abs(there - crossing[0]) > 20.0
    # a metre further down is a metre further down, within the fall lines' difference of 3° on a way across it
    assert first.line_in(float(crossing[0]) + 1.0, second) - there == pytest.approx(1.0, abs=0.1)
    # where a way has ended it goes on down the fall line
    beyond = first.line_in(130.0, second) - first.line_in(120.0, second)
    assert beyond == pytest.approx(10.0, rel=0.02)


def test_a_run_passes_where_another_was() -> None:
    first, second, _ = crossing_ways()
    inside = second.passes(first, (40.0, 60.0))
    assert np.all(inside[42:59])
    assert not np.any(inside[:38])
    assert not np.any(inside[63:])
    steps = np.linalg.norm(np.diff(second.places[40:61], axis=0), axis=1)
    assert second.metres(inside) == pytest.approx(steps.sum(), rel=0.1)  # by half a step at both ends
    far = replace(second, places=second.places + np.array([0.0, THRESHOLDS.near_path + 8.0, 0.0]))
    assert not np.any(far.passes(first, (40.0, 60.0)))
    elsewhere = replace(second, origin=(47.8, 10.3, 2600.0))
    assert not np.any(elsewhere.passes(first, (40.0, 60.0)))
    assert not np.any(second.passes(first, (200.0, 210.0)))


def instruments(measured: Array) -> Measurements:
    """Sixty fixes, at ``measured`` (n, 3) m."""
    ones = np.ones(len(measured))
    nothing = np.zeros(0)
    return Measurements(0.1 * np.arange(len(measured)), measured, 0.02, nothing, np.zeros((0, 2)), ones, ones)


def braked(begin: float, stop: float) -> Array:
    """(180,) m by which a friction that is greater by one between two times (s) holds a run back."""
    fixes = 0.1 * np.arange(60)
    inside = np.clip(fixes, begin, stop) - begin
    behind = 9.4 * (0.5 * inside**2 + inside * np.maximum(fixes - stop, 0.0))
    return np.concatenate([-behind, np.zeros(120)])


class Day:
    """Runs that are linear by definition: a fit has a start's speed, friction, and of a patch how much it brakes."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        recording, motion = bundled("beginner")
        self.recording, self.model = recording, model_of(recording, motion)
        self.rng = np.random.default_rng(4)
        self.asked: list[str] = []
        for name, stand_in in (("fit_model", self.fit), ("estimate_again", self.again), ("fitted_run", self.fitted)):
            monkeypatch.setattr(second_pass, name, stand_in)
        monkeypatch.setattr(second_pass, "remove", self.remove)

    def run(self, patch: float, *, faster: float = 1.0, aside: float = 0.0) -> SearchEnd:
        """With a patch of so much more friction where the first run is from ``BEGIN`` to ``STOP``."""
        at = SPEED * faster
        slower = braked(SPEED * BEGIN / at, SPEED * STOP / at)
        columns = {
            "start.velocity_f": np.concatenate([0.1 * np.arange(60), np.zeros(120)]),
            "friction.mu_t": braked(0.0, 10.0),
            "delta_mu_t": slower,
            "w_f": -0.012 * slower,  # a wind of 5 m/s pushes as much as 0.06 of friction brakes
        }
        noise = whitened_back(self.rng.normal(size=180))
        measured = patch * columns["delta_mu_t"] + noise
        seen = instruments(measured.reshape(3, 60).T)
        problem: Any = SimpleNamespace(
            measurements=seen,
            stamped_by=lambda _model: seen,
            gps=self.recording.gps,
            columns=columns,
            speed=at,
            aside=aside,
            hypotheses=HYPOTHESES,
            ground=None,
            thresholds=THRESHOLDS,
        )
        state = State(LEVELS, no_nuisances(180), np.zeros(180))
        free = (Parameter(("start.velocity_f",), Prior(0.0, 1.0)), Parameter(("friction.mu_t",), Prior(0.0, 0.1)))
        return SearchEnd(problem, state, self.fit(problem, state, self.model, free, LEVELS), (), False)

    def fit(self, problem: Any, state: State, model: Model, parameters: Any, levels: Any) -> Refit:
        """What is most probable."""
        keys = [p.names[0] for p in parameters]
        nothing = np.zeros(180)
        x = np.stack([problem.columns.get(k, problem.columns.get(k.partition(".")[2], nothing)) for k in keys], axis=1)
        measured = problem.measurements.measured
        empty = LinearModel(problem.measurements, measured, Freedom(np.zeros((180, 0)), np.zeros(0)))
        table = whiten_columns(empty, levels, np.column_stack([measured, x]))
        means, sigmas = np.array([p.prior.mean for p in parameters]), np.array([p.prior.sigma for p in parameters])
        slopes = table[:, 1:]
        covariance = np.linalg.inv(slopes.T @ slopes + np.diag(sigmas**-2.0))
        values = covariance @ (slopes.T @ table[:, 0] + means / sigmas**2)
        return Refit(
            with_parameters(model, tuple(parameters), values), tuple(parameters), values, x @ values, x, 0.0, covariance
        )

    def again(self, problem: Any, state: State, fit: Refit, *, full: bool) -> tuple[Any, State, Refit]:
        self.asked += [term.name for term in fit.model.terms if term.name == "snow_patch"]
        return problem, state, fit

    def fitted(self, problem: Any, state: State, fit: Refit) -> FittedRun:
        along = problem.speed * TIME
        feet = np.stack([along, np.full_like(along, problem.aside), np.zeros_like(along)], axis=1)
        run: Any = SimpleNamespace(time=TIME, foot_position=np.stack([feet, feet], axis=1))
        return FittedRun(fit.model, cast(Any, None), run, problem.measurements, np.zeros(180))

    def remove(self, problem: Any, state: State, fit: Refit, candidate: Candidate) -> tuple[State, Refit]:
        owners = {name.partition(".")[0] for name in (*candidate.strengths, *candidate.places)}
        kept = tuple(p for p in fit.parameters if p.names[0].partition(".")[0] not in owners)
        return state, self.fit(problem, state, fit.model.without(owners), kept, LEVELS)

    def found(self, end: SearchEnd, best: str = "gust", **log_evidence: float) -> SearchEnd:
        """The run with a finding: a patch from ``BEGIN`` to ``STOP`` of the first run, or a gust, or nothing."""
        patch = SnowPatch(0.0, SPEED * BEGIN, SPEED * STOP, 0.5)
        window = SPEED * BEGIN / end.problem.speed, SPEED * STOP / end.problem.speed  # type: ignore[attr-defined]
        parts = {
            "snow_patch": (patch, ("delta_mu_t",), ("f0", "f1")),
            "gust": (Gust(t0=window[0], t1=window[1]), ("w_f",), ("t0", "t1")),
        }
        scales = {"snow_patch": 0.06, "gust": 5.0}
        explanations = [explained("nothing", log_evidence.pop("nothing"), fit=end.fit, levels=LEVELS)]
        for name, evidence in log_evidence.items():
            part, keys, places = parts[name]
            model = add_part(end.fit.model, part)
            amplitudes = tuple(Parameter((NumberRef.of(name, key),), Prior(0.0, scales[name])) for key in keys)
            spots = {NumberRef.of(name, key): 0.3 for key in places}
            more = tuple(Parameter((key,), Prior(model.value(key), spread)) for key, spread in spots.items())
            fit = self.fit(end.problem, end.state, model, (*end.fit.parameters, *amplitudes, *more), LEVELS)
            columns = fit.sensitivity[:, len(end.fit.parameters) :][:, : len(keys)]
            free = Freedom(columns, np.full(len(keys), scales[name]))
            candidate = Candidate(model, free, tuple(p.names for p in amplitudes), spots, window)
            explanations.append(refitted(name, evidence, candidate=candidate, fit=fit, levels=LEVELS))
        searched = ranked(*explanations, base=end.fit)
        explanation = next(explanation for explanation in searched.refitted if explanation.name == best)
        return replace(
            end, fit=explanation.fit, accepted=(Accepted(searched, explanation, explanation.fit, cast(Any, None)),)
        )


def whitened_back(independent: Array) -> Array:
    """(180,) m of noise as the instruments have it."""
    blocks = []
    for block, noise in zip(np.split(independent, 3), (LEVELS.gps, LEVELS.gps, LEVELS.height), strict=True):
        apart = np.abs(np.subtract.outer(np.arange(60), np.arange(60))) * 0.1
        blocks.append(np.linalg.cholesky(noise.sigma**2 * np.exp(-apart / noise.correlation_time)) @ block)
    return np.concatenate(blocks)


@pytest.fixture
def day(monkeypatch: pytest.MonkeyPatch) -> Day:
    return Day(monkeypatch)


def asked_of(day: Day, first: SearchEnd, **others: SearchEnd) -> SamePlace:
    """What the others say of the finding of the first."""
    answers = [answer for answer in ask_other_runs({"morning": first, **others}) if answer.run == "morning"]
    assert len(answers) == 1
    return answers[0]


AMBIGUOUS = {"nothing": 0.0, "snow_patch": 19.0, "gust": 20.0}


def test_what_another_run_meets_again_keeps_to_its_place(day: Day) -> None:
    first = day.found(day.run(0.08), **AMBIGUOUS)
    answer = asked_of(day, first, noon=day.run(0.08, faster=1.1))
    assert answer.before["gust"] > 0.6  # by e^0.6 more probable
    assert answer.after["snow_patch"] > 0.95
    assert answer.settled
    assert answer.finding == "gust"
    [passed] = answer.passes
    assert passed.run == "noon"
    assert passed.metres == pytest.approx(SPEED * (STOP - BEGIN), abs=0.5)  # a step of its way at both ends
    assert answer.sentence.startswith(
        "noon passed where morning was between 2.0 s and 3.5 s, and met it again: a stretch"
    )


def test_what_another_run_does_not_meet_keeps_to_its_time(day: Day) -> None:
    first = day.found(day.run(0.08), "snow_patch", nothing=0.0, snow_patch=20.0, gust=19.0)
    answer = asked_of(day, first, noon=day.run(0.0, faster=0.9))
    assert answer.before["snow_patch"] > 0.6
    assert answer.after["gust"] > 0.95
    assert answer.settled
    assert "met nothing of it: a gust of wind" in answer.sentence


def test_it_has_to_be_as_strong_as_it_was(day: Day) -> None:
    first = day.found(day.run(0.08), **AMBIGUOUS)
    weaker = asked_of(day, first, noon=day.run(0.03, faster=1.1))
    alike = asked_of(day, first, noon=day.run(0.08, faster=1.1))
    assert weaker.passes[0].log_evidence["snow_patch"] is not None
    assert alike.passes[0].log_evidence["snow_patch"] is not None
    assert weaker.passes[0].log_evidence["snow_patch"] < alike.passes[0].log_evidence["snow_patch"] - 5.0


def test_a_run_that_does_not_pass_the_place_says_nothing(day: Day) -> None:
    first = day.found(day.run(0.08), **AMBIGUOUS)
    assert ask_other_runs({"morning": first, "noon": day.run(0.0, aside=THRESHOLDS.near_path + 5.0)}) == ()
    noon = day.run(0.08)
    both = asked_of(day, first, noon=noon, far=day.run(0.0, aside=THRESHOLDS.near_path + 5.0))
    assert [passed.run for passed in both.passes] == ["noon"]
    assert both.after == asked_of(day, first, noon=noon).after


def test_two_passes_say_more_than_one(day: Day) -> None:
    first = day.found(day.run(0.03), **AMBIGUOUS)
    noon, evening = day.run(0.03), day.run(0.03, faster=1.1)
    one, both = asked_of(day, first, noon=noon), asked_of(day, first, noon=noon, evening=evening)
    assert one.before["snow_patch"] < one.after["snow_patch"] < both.after["snow_patch"]
    assert both.sentence.startswith("noon and evening passed")


def test_what_another_run_found_there_itself_may_be_the_same_or_its_own(day: Day) -> None:
    """Its search made a gust of it: nothing else is there, so a patch has to do without the gust, which is rare."""
    first = day.found(day.run(0.08), **AMBIGUOUS)
    alone = day.run(0.08, faster=1.1)
    searched = day.found(alone, **AMBIGUOUS)
    gain, plain = (asked_of(day, first, noon=noon).passes[0].log_evidence["snow_patch"] for noon in (searched, alone))
    assert gain is not None
    assert plain is not None
    # one of its own explains it too, if it is of the usual ones: how often that happens is what parts them
    assert 1.0 < gain < 10.0 < plain


def test_what_another_run_found_there_that_keeps_to_its_place_was_there_before(day: Day) -> None:
    """A patch of the other run's own would have been in the first run too: it is no reason to doubt that it is one."""
    first = day.found(day.run(0.08), **AMBIGUOUS)
    alone = day.run(0.08, faster=1.1)
    itself = day.found(alone, "snow_patch", nothing=0.0, snow_patch=90.0, gust=20.0)
    gain, plain = (asked_of(day, first, noon=noon).passes[0].log_evidence["snow_patch"] for noon in (itself, alone))
    assert gain is not None
    assert plain is not None
    assert 40.0 < gain < plain + 1.0


def test_a_run_with_two_findings_of_a_name_there_says_nothing(day: Day) -> None:
    first = day.found(day.run(0.08), **AMBIGUOUS)
    noon = day.found(day.run(0.08, faster=1.1), **AMBIGUOUS)
    twice = replace(noon, accepted=(*noon.accepted, *noon.accepted))
    assert [answer.run for answer in ask_other_runs({"morning": first, "noon": twice}) if answer.run == "morning"] == []


def test_a_finding_that_keeps_to_no_place_is_not_asked(day: Day) -> None:
    first = day.found(day.run(0.08), nothing=0.0, gust=20.0)
    assert ask_other_runs({"morning": first, "noon": day.run(0.08)}) == ()
    sure = day.found(day.run(0.08), "snow_patch", nothing=0.0, snow_patch=40.0)
    assert ask_other_runs({"morning": sure, "noon": day.run(0.08)}) == ()


def test_what_simulated_runs_say_of_the_first_run_stays() -> None:
    """What another pass measures multiplies odds by as much as it does by the fits alone."""
    evidence = {"nothing": 0.0, "snow_patch": 20.0, "gust": 20.5}
    plain = ranked(*(explained(name, value, fit=cast(Any, "a fit")) for name, value in evidence.items()))
    factors = {"nothing": 1.0, "snow_patch": 3.0, "gust": 0.5}
    weighed = replace(
        plain,
        explanations=tuple(
            replace(one, probability=one.probability * factors[one.name], by_fits=one.probability)
            for one in plain.explanations
        ),
    )
    passed = [Pass("noon", 5.0, {"snow_patch": 2.0})]
    by_fits, by_both = (
        {one.name: one.probability for one in update(searched, passed)} for searched in (plain, weighed)
    )
    assert sum(by_both.values()) == pytest.approx(1.0)
    odds = by_both["snow_patch"] / by_both["gust"]
    assert odds == pytest.approx(6.0 * by_fits["snow_patch"] / by_fits["gust"])
    assert update(weighed, passed)[0].name == "snow_patch"


@pytest.fixture(scope="module")
def base() -> Recorded:
    recording, motion = bundled("intermediate")
    # friction of a fit of the whole recording; each world draws its own snow about it and starts where the fixes say
    fitted = coarse(model_of(recording, motion)).with_values({"friction.mu_t": 0.19, "friction.mu_n": 0.9})
    return steady(recording), motion, fitted


@pytest.mark.long(seconds=85)
@pytest.mark.usefixtures("coarse_skis")
@pytest.mark.parametrize(("hidden", "size"), [("snow_patch", 2.0), ("gust", 1.4)])
def test_a_second_pass_distinguishes_a_patch_from_a_gust(
    base: Recorded, hidden: str, size: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A patch is hidden in both passes, a gust in the first alone, by which neither is certain.  The suit's errors are
    constant, in the world as in what is stated of it.
    """
    monkeypatch.setattr(
        benchmark_second_pass,
        "draw_instruments",
        lambda rng, motion: replace(draw_instruments(rng, motion), wander=0.0),
    )
    hypotheses = [BY_NAME[name] for name in ("snow_patch", "gust")]
    passes = two_passes(hidden, size, base, 1, long=4.5)
    ends = {"morning": first_finding(passes.first, hypotheses), "noon": first_finding(passes.second, hypotheses)}
    [answer] = [answer for answer in ask_other_runs(ends) if answer.run == "morning"]
    assert answer.before[hidden] < 0.9
    assert answer.after[hidden] > 0.95
    assert answer.passes[0].metres > 7.0  # what is hidden lasts 1.5 s at least, at 5 m/s
