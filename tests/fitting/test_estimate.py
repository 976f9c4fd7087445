"""The estimate of all that is uncertain against an independent world, whose friction is known."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from bundled import bundled, steady

from sssi_exudyn.contact.registry import combine_terms
from sssi_exudyn.contact.terms.carving import Carving
from sssi_exudyn.core.errors import SimulationDiverged
from sssi_exudyn.fitting import estimate as estimation
from sssi_exudyn.fitting.estimate import estimate, estimate_from
from sssi_exudyn.fitting.first_fit import problem_of
from sssi_exudyn.fitting.objective import Prior
from sssi_exudyn.fitting.snow_surface import on_snow_surface
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.results.uncertainty import uncertainty_figures
from sssi_exudyn.simulation.reduced.prepared import prepare
from sssi_exudyn.simulation.reduced.run import simulate_reduced

SECONDS = 5.0


@pytest.mark.parametrize(("name", "true"), [("beginner", (0.06, 0.55)), ("intermediate", (0.19, 0.90))])
@pytest.mark.long(seconds=15)
def test_friction_of_another_world_is_found_within_its_standard_error(name: str, true: tuple[float, float]) -> None:
    recording, motion = bundled(name)
    model = on_snow_surface(model_of(recording, motion), recording, motion)
    motion = replace(motion, stop=motion.start + SECONDS)
    estimated = estimate(problem_of(recording, motion, model, "joint"), recording, motion, full=False)
    assert estimated.fitted.names[:2] == ("friction.mu_t", "friction.mu_n")
    spread = np.sqrt(np.diag(estimated.posterior.covariance)[:2])
    # beyond 2.6 standard deviations lies one of four numbers in one of 25 worlds
    assert np.all(np.abs(estimated.posterior.values[:2] - true) < 2.6 * spread)
    # 0.01 of μ_t is what half a degree of slope does: less than that is asked of a standard error.  How friction builds
    # up is as unknown as μ_n in so few seconds, and doubles its standard error.
    assert np.all(spread < [0.01, 0.02])
    # noise of 2 cm in both directions leaves 2 √(π/2) = 2.5 cm, the mean of 50 fixes up to 1 cm more
    assert np.mean(np.linalg.norm(estimated.fitted.residual, axis=1)) < 0.035
    moments = estimated.posterior.setting.seen.moments
    assert (
        np.sqrt(np.mean(np.square(estimated.posterior.residual[moments]))) < 20.0
    )  # N m: what is stated of the balance
    assert uncertainty_figures(estimated.posterior).doubts == ()


@pytest.mark.long(seconds=15)
@pytest.mark.usefixtures("coarse_skis")
def test_a_late_clock_is_found_as_late_as_it_is() -> None:
    late = 0.15
    recording, motion = bundled("beginner")
    assert recording.gps is not None
    recording = steady(replace(recording, gps=replace(recording.gps, time=recording.gps.time + late)))
    model = on_snow_surface(model_of(recording, motion), recording, motion)
    motion = replace(motion, start=motion.start + 0.5, stop=motion.start + 0.5 + SECONDS)
    problem = problem_of(recording, motion, model, "joint")
    free = {("start.clock_offset",): Prior(0.0, 0.25)}
    posterior = estimate_from(problem.model, problem, recording, motion, more=free, full=False)
    _, low, high = posterior.interval("start.clock_offset", 2.6)  # as above
    assert low < late < high
    assert high - low < 0.2 * late  # a start held by its first fixes gave 3/4 of it, to 0.005 s
    _, low, high = posterior.interval("friction.mu_t", 2.6)
    assert low < 0.06 < high


@pytest.mark.long(seconds=15)
@pytest.mark.usefixtures("coarse_skis")
def test_a_small_zero_and_a_small_lateness_of_insoles_are_estimated_along() -> None:
    """Both are of a size that insoles in working order show."""
    zero, late = 25.0, 0.02
    recording, motion = bundled("beginner")
    assert recording.insoles is not None
    motion = replace(motion, stop=motion.start + SECONDS)
    insoles = recording.insoles
    off = replace(insoles, left=insoles.left + zero, time=insoles.time + late)
    estimates = []
    for read in (insoles, off):
        measured = replace(recording, insoles=read)
        model = on_snow_surface(model_of(measured, motion), measured, motion)
        estimates.append(estimate(problem_of(measured, motion, model, "joint"), measured, motion, full=False).posterior)
    right, wrong = estimates
    for name, true in (("insole_offset.left", zero), ("insole_offset.right", 0.0), ("insole_delay.late", late)):
        _, low, high = wrong.interval(name, 2.6)  # as above
        assert low < true < high
        # what it shows of the change, next to the same noise: the rest is the prior's and the gain's
        i = wrong.setting.names.index(name)
        assert abs(wrong.values[i] - right.values[i] - true) < 1.0 * (high - low) / 5.2
    # held at zero they move friction by a whole standard error, and log evidence falls by 60
    spread = np.sqrt(np.diag(right.covariance)[:2])
    np.testing.assert_array_less(np.abs(wrong.values[:2] - right.values[:2]), 0.5 * spread)


@pytest.mark.long(seconds=25)
def test_a_fit_finds_the_heading_where_edges_cut() -> None:
    recording, motion = bundled("intermediate")
    model = model_of(recording, motion)
    model = replace(model, terms=combine_terms(model.terms, (Carving(mu=0.13, hardness=0.54e8, strength=0.9e5),)))
    motion = replace(motion, stop=motion.start + 1.5)
    recording = steady(recording)
    problem = problem_of(recording, motion, model.with_heading("free"), "joint")
    posterior = estimate(problem, recording, motion, full=False).posterior
    assert posterior.model.heading.mode == "track"  # nothing else would hold it while all is sought
    assert posterior.optimum.converged
    # 2 cm of noise in both directions; with the snow that it begins with 0.26 m
    assert posterior.track_error < 0.035
    run = simulate_reduced(posterior.model, prepare(posterior.model, motion, step=0.0025))
    assert np.degrees(np.abs(run.heading[:, 0]).max()) > 0.2
    np.testing.assert_allclose(
        posterior.setting.seen.predict_instruments(posterior.model, run.time, run.antenna, run.sole_force)[
            posterior.setting.seen.blocks["x"]
        ],
        posterior.predicted[posterior.setting.seen.blocks["x"]],
        atol=1e-6,
    )


def test_coarse_fixes_without_speeds_are_begun_at_several_velocities(monkeypatch: pytest.MonkeyPatch) -> None:
    """The one whose estimate is the most probable is gone on from; one that cannot be simulated is none."""
    recording, motion = bundled("intermediate")
    gps = recording.gps
    assert gps is not None
    coarse = replace(gps, sigma=np.full(len(gps.time), 2.0), speed=None, course=None)
    evidence = iter([-800.0, -820.0, -740.0, -790.0])
    begun: list[float] = []
    went_on: list[Any] = []

    def fitted(problem: Any, *_args: Any, **_more: Any) -> Any:
        begun.append(problem.model.start.velocity_l)
        if len(begun) == 4:
            raise SimulationDiverged(0.0, "no run")
        return SimpleNamespace(model=problem.model, residual=np.zeros((len(problem.track.time), 2)))

    def estimated(model: Any, *_args: Any, known: Any = None, **_more: Any) -> Any:
        if known is not None:
            went_on.append(known)
            raise StopIteration
        return SimpleNamespace(model=model, log_evidence=next(evidence))

    monkeypatch.setattr(estimation, "fit", fitted)
    monkeypatch.setattr(estimation, "estimate_from", estimated)
    rough = replace(recording, gps=coarse)
    problem = problem_of(rough, motion, model_of(rough, motion), "joint")
    with pytest.raises(StopIteration):
        estimate(problem, rough, motion, full=False)
    sigma = problem.priors["start.velocity_l"].sigma
    assert sigma > 1.0
    np.testing.assert_allclose(np.sort(np.unique(begun)), begun[0] + 1.3 * sigma * np.array([-1.0, 0.0, 1.0]))
    assert [known.log_evidence for known in went_on] == [-740.0]


def test_fixes_that_are_fine_or_have_speeds_are_begun_once() -> None:
    recording, motion = bundled("intermediate")
    gps = recording.gps
    assert gps is not None
    many = len(gps.time)
    with_speeds = replace(gps, sigma=np.full(many, 2.0), speed=np.full(many, 9.0), course=np.full(many, 3.0))
    for recorded in (recording, replace(recording, gps=with_speeds)):
        problem = problem_of(recorded, motion, model_of(recorded, motion), "joint")
        assert estimation.other_starts(problem, recorded) == []
