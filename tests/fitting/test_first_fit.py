"""Fits recover what made the data: friction, start and heading of a run that the full model itself simulated."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bundled import bundled
from coarse_skis import in_less_detail

from sssi_exudyn.core.choices import Method
from sssi_exudyn.core.errors import SimulationDiverged
from sssi_exudyn.fitting import first_fit as fitting
from sssi_exudyn.fitting import optimise
from sssi_exudyn.fitting.first_fit import fit, problem_of
from sssi_exudyn.fitting.objective import Problem, counts_of
from sssi_exudyn.fitting.observations import Track, predict_fixes
from sssi_exudyn.fitting.optimise import minimise, minimise_squares, step_back
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.motion.motion import Motion
from sssi_exudyn.runtime.cache import Cache
from sssi_exudyn.simulation.full.run import antenna_path, simulate
from sssi_exudyn.simulation.reduced.prepared import COARSE_STEP, prepare
from sssi_exudyn.simulation.reduced.run import simulate_reduced
from sssi_exudyn.simulation.reduced.sensitivities import sensitivities

pytestmark = pytest.mark.usefixtures("coarse_skis")
TRUTH = {
    "friction.mu_t": 0.07,
    "friction.mu_n": 0.6,
    "start.velocity_f": 5.2,
    "start.velocity_l": 0.8,
    "start.heading_offset": 0.01,
}
SECONDS = 4.0


@pytest.fixture(scope="module")
def made() -> tuple[Motion, Problem]:
    """4 s of the beginner's movement, and as GPS the full model's antenna with known friction, without noise."""
    recording, motion = bundled("beginner")
    motion = replace(motion, stop=motion.start + SECONDS)
    model = model_of(recording, motion)
    # the data are the model's own, however many elements it has
    model = replace(model, solver=replace(model.solver, elements=20))
    problem = problem_of(recording, motion, model, "joint")
    truth = problem.model.with_values(TRUTH)
    with in_less_detail():
        run = simulate(truth, motion)
    assert run.antenna is not None
    fixes = np.arange(motion.start, motion.stop, 0.1)
    track = Track(fixes, predict_fixes(truth, run.time, run.antenna, fixes)[:, :2], np.full(len(fixes), 0.02))
    return motion, replace(problem, track=track, counts=counts_of(track))


@pytest.mark.long
def test_joint_fit_recovers_friction_start_and_heading(made: tuple[Motion, Problem], tmp_path: Path) -> None:
    motion, problem = made
    fitted = fit(problem, motion, "joint", cache=Cache(tmp_path))
    assert fitted.optimum.converged
    assert fitted.optimum.evaluations <= 15
    errors = {name: fitted.value(name) - truth for name, truth in TRUTH.items()}
    # Without noise the only pull away from the truth is the priors' (heading 0 ± 1°, velocity first guess ± 0.5 m/s),
    # weighed against 4 s of track: a tenth of what 2 cm of GPS noise would leave.
    assert abs(errors["friction.mu_t"]) < 0.002
    assert abs(errors["friction.mu_n"]) < 0.02
    assert abs(errors["start.velocity_f"]) < 0.05
    assert abs(errors["start.velocity_l"]) < 0.05
    # a centimetre: the objective's tolerance
    assert float(np.mean(np.linalg.norm(fitted.residual, axis=1))) < 0.01


@pytest.mark.long
def test_an_interrupted_fit_goes_on(
    made: tuple[Motion, Problem], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    motion, problem = made
    calls = 0

    def counted(*arguments: object, **named: object) -> object:
        nonlocal calls
        calls += 1
        if calls == 2 and interrupt:
            raise KeyboardInterrupt
        return antenna_path(*arguments, **named)  # type: ignore[arg-type]

    monkeypatch.setattr(fitting, "antenna_path", counted)
    interrupt = True
    with pytest.raises(KeyboardInterrupt):
        fit(problem, motion, "joint", cache=Cache(tmp_path))
    interrupt = False
    resumed = fit(problem, motion, "joint", cache=Cache(tmp_path))
    resumed_calls, calls = calls - 2, 0
    whole = fit(problem, motion, "joint", cache=Cache(tmp_path / "other"))
    assert np.array_equal(resumed.values, whole.values)
    assert resumed_calls == calls - 1  # the first evaluation was kept


@pytest.mark.long
def test_gradient_against_differences(made: tuple[Motion, Problem]) -> None:
    """On the reduced model alone the gradient is exact but for the forward differences it is made with."""
    motion, problem = made
    prepared = prepare(problem.model, motion)
    values = problem.start

    def value(at: np.ndarray) -> float:
        model = problem.model_at(at)
        run = simulate_reduced(model, prepared)
        return problem.value(problem.residual(model, run.time, run.antenna), at)

    residual, derivative = sensitivities(
        problem.model_at(values),
        prepared,
        problem.names,
        lambda model, run: problem.residual(model, run.time, run.antenna),
    )
    slope = problem.gradient(residual, -derivative, values)
    for i, step in enumerate((1e-4, 1e-3, 1e-3, 1e-3, 1e-3, 1e-3, 1e-5)):
        shift = np.zeros(len(values))
        shift[i] = step
        central = (value(values + shift) - value(values - shift)) / (2.0 * step)
        # 2 %: the forward differences' own curvature, at a point a metre away from the optimum
        assert slope[i] == pytest.approx(central, rel=0.02, abs=0.02 * abs(slope).max() * step)


@pytest.mark.long
@pytest.mark.parametrize("method", ["joint", "paper"])
def test_a_step_to_where_the_run_diverges_is_taken_back(
    made: tuple[Motion, Problem], method: Method, monkeypatch: pytest.MonkeyPatch
) -> None:
    motion, problem = made
    if method == "paper":
        problem = replace(problem, priors={})
    prepared = prepare(problem.model, motion, step=COARSE_STEP)
    undisturbed = fitting.fit_reduced(problem, prepared)
    first_step = 2 if method == "joint" else 3  # the paper's search asks for the start twice
    calls, failing = 0, {first_step}

    def diverging(*arguments: Any) -> tuple[np.ndarray, np.ndarray]:
        nonlocal calls
        calls += 1
        if calls in failing:
            raise SimulationDiverged(3.0, "made to")
        return sensitivities(*arguments)

    monkeypatch.setattr(fitting, "sensitivities", diverging)
    fitted = fitting.fit_reduced(problem, prepared)
    assert fitted.converged
    assert calls > first_step
    np.testing.assert_allclose(fitted.values[:2], undisturbed.values[:2], atol=0.01)  # the search's tolerance
    calls, failing = 0, {1}
    with pytest.raises(SimulationDiverged):
        fitting.fit_reduced(problem, prepared)


@pytest.mark.parametrize("method", ["joint", "paper"])
def test_what_is_fitted(method: Method) -> None:
    recording, motion = bundled("beginner")
    problem = problem_of(recording, motion, model_of(recording, motion), method)
    assert problem.names[:2] == ("friction.mu_t", "friction.mu_n")
    assert list(problem.start[:2]) == [0.1, 0.5]
    assert problem.bounds[:2].tolist() == [[0.01, 0.99], [0.01, 0.99]]
    assert (len(problem.names) == 2) == (method == "paper")
    assert bool(problem.priors) == (method == "joint")


def quadratics() -> Iterator[tuple[np.ndarray, np.ndarray]]:
    generator = np.random.default_rng(1)
    for size in (2, 5):
        root = generator.normal(size=(size, size))
        yield root @ root.T + 0.1 * np.eye(size), generator.uniform(-0.5, 0.5, size)


@pytest.mark.parametrize(("curvature", "best"), list(quadratics()))
def test_a_quadratic_takes_a_few_steps(curvature: np.ndarray, best: np.ndarray) -> None:
    def function(x: np.ndarray) -> tuple[float, np.ndarray]:
        return float(0.5 * (x - best) @ curvature @ (x - best)), curvature @ (x - best)

    bounds = np.tile([-1.0, 1.0], (len(best), 1))
    optimum = minimise(function, np.zeros(len(best)), bounds, curvature, objective_tolerance=1e-10, step_tolerance=1e-9)
    assert optimum.converged
    assert optimum.evaluations <= 5  # with the curvature known, the first step is the last but for the check
    np.testing.assert_allclose(optimum.values, best, atol=1e-6)


def test_bounds_hold() -> None:
    def function(x: np.ndarray) -> tuple[float, np.ndarray]:
        return float(np.sum((x - 2.0) ** 2)), 2.0 * (x - 2.0)

    optimum = minimise(function, np.zeros(2), np.tile([-1.0, 1.0], (2, 1)), np.eye(2), objective_tolerance=1e-12)
    np.testing.assert_allclose(optimum.values, 1.0, atol=1e-6)


@pytest.mark.long
def test_an_interrupt_within_the_solver_is_an_interrupt(made: tuple[Motion, Problem]) -> None:
    """Exudyn turns what callbacks raise into errors of its own; Ctrl-C must not look like a divergence."""
    motion, problem = made

    def stop(fraction: float, _: str) -> None:
        if fraction > 0.05:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        simulate(problem.model, motion, progress=stop)


def along_a_valley(x: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
    """Rosenbrock's function, as half of a sum of squares: a narrow valley that bends towards its optimum at (1, 1)."""
    residual = np.array([30.0 * (x[1] - x[0] ** 2), 1.0 - x[0]])
    slopes = np.array([[-60.0 * x[0], 30.0], [-1.0, 0.0]])
    return float(0.5 * residual @ residual), slopes.T @ residual, slopes.T @ slopes


def test_a_bent_valley_takes_few_evaluations_with_the_curvature_of_every_point() -> None:
    bounds = np.tile([-3.0, 3.0], (2, 1))
    start = np.array([-1.9, 2.0])
    optimum = minimise_squares(along_a_valley, start, bounds, objective_tolerance=1e-8)
    assert optimum.converged
    np.testing.assert_allclose(optimum.values, [1.0, 1.0], atol=1e-3)  # of a tolerance of 1e-8 in ½ (1 − x)²
    first = along_a_valley(start)[2]
    once = minimise(lambda x: along_a_valley(x)[:2], start, bounds, first, objective_tolerance=1e-8)
    assert optimum.evaluations < once.evaluations


def with_much_left_over(x: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
    """A sum of squares of which one stays large, so that its curvature at the optimum, 0, is 1 to 3.5 times as much as
    that of Gauss and Newton.
    """
    bent = np.array([0.5, 0.25, 0.0])
    residual = np.array([*x, 5.0 + 0.5 * bent @ x**2])
    slopes = np.vstack([np.eye(3), bent * x])
    return float(0.5 * residual @ residual), slopes.T @ residual, slopes.T @ slopes


def test_where_much_is_left_over_a_search_learns_the_curvature(monkeypatch: pytest.MonkeyPatch) -> None:
    bounds, start = np.tile([-9.0, 9.0], (3, 1)), np.array([0.6, -0.9, 0.7])
    learned = minimise_squares(with_much_left_over, start, bounds, objective_tolerance=1e-6)
    assert learned.converged
    np.testing.assert_allclose(learned.values, 0.0, atol=2e-3)  # of a tolerance of 1e-6 in ½ x²
    monkeypatch.setattr(optimise, "_BEYOND", 0.0)
    not_learned = minimise_squares(with_much_left_over, start, bounds, objective_tolerance=1e-6)
    assert learned.evaluations < not_learned.evaluations


def test_a_search_by_squares_ends_at_a_bound() -> None:
    bounds = np.array([[-3.0, 0.5], [-3.0, 3.0]])
    optimum = minimise_squares(along_a_valley, np.array([-1.9, 2.0]), bounds, objective_tolerance=1e-8)
    assert optimum.converged
    np.testing.assert_allclose(optimum.values, [0.5, 0.25], atol=1e-3)


def test_a_search_by_squares_stops_after_so_many_evaluations() -> None:
    bounds = np.tile([-3.0, 3.0], (2, 1))
    optimum = minimise_squares(along_a_valley, np.array([-1.9, 2.0]), bounds, objective_tolerance=1e-8, most=3)
    assert not optimum.converged
    assert optimum.evaluations == 3


def test_a_search_by_squares_gives_up_where_it_promises_too_little() -> None:
    def above_hundred(x: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
        value, slope, curvature = along_a_valley(x)
        return 100.0 + value, slope, curvature

    bounds, start = np.tile([-3.0, 3.0], (2, 1)), np.array([-1.9, 2.0])
    # a step of the linear form always promises 100: both residuals vanish there
    hopeless = minimise_squares(above_hundred, start, bounds, objective_tolerance=1e-8, worth=99.0)
    assert not hopeless.converged
    assert hopeless.evaluations < 10
    hopeful = minimise_squares(above_hundred, start, bounds, objective_tolerance=1e-8, worth=101.0)
    assert hopeful.converged
    np.testing.assert_allclose(hopeful.values, [1.0, 1.0], atol=1e-3)


def test_a_search_steps_back_from_runs_that_diverge() -> None:
    diverged = []

    def in_a_disc(x: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
        if np.hypot(*x) > 3.0:
            diverged.append(x)
            raise SimulationDiverged(1.0, "made to")
        return along_a_valley(x)

    bounds, start = np.tile([-9.0, 9.0], (2, 1)), np.array([-1.9, 2.0])  # whose first step leaves the disc
    optimum = minimise_squares(step_back(in_a_disc), start, bounds, objective_tolerance=1e-8)
    assert diverged
    assert optimum.converged
    np.testing.assert_allclose(optimum.values, [1.0, 1.0], atol=1e-3)  # of a tolerance of 1e-8 in ½ (1 − x)²
    with pytest.raises(SimulationDiverged):
        minimise_squares(step_back(in_a_disc), np.array([8.0, 8.0]), bounds, objective_tolerance=1e-8)


def test_fixes_that_are_off_count_less() -> None:
    time = np.arange(0.0, 12.0, 0.1)
    rng = np.random.default_rng(3)
    slow = 0.1 * np.stack([np.sin(0.5 * time), np.cos(0.4 * time)], axis=1)  # of the model: no fix is to blame
    residual = slow + 0.02 * rng.normal(size=(len(time), 2))
    sigma = np.full(len(time), 0.02)
    sigma[50:70] = 0.2
    far = [0, 7, 30, 31, 100, 119]  # the first and the last have neighbours on one side alone
    residual[far] += 0.4
    counts = counts_of(Track(time, residual, sigma), residual)
    assert np.all(counts[far] < 0.1)
    np.testing.assert_allclose(counts[50:70], 0.01)  # (0.02/0.2)²
    others = np.delete(counts, [*far, *range(50, 70)])
    # of 94 fixes the farthest is four standard deviations off, in either direction: 6/(4 + 16)
    assert np.mean(others) > 0.85
    assert np.min(others) > 0.2


def test_where_many_fixes_are_off_the_model_is_and_they_count_in_full() -> None:
    time = np.arange(0.0, 12.0, 0.1)
    rng = np.random.default_rng(3)
    sigma = np.full(len(time), 0.02)
    sigma[50:70] = 0.2
    residual = 0.02 * rng.normal(size=(len(time), 2))
    residual[rng.permutation(len(time))[: len(time) * 2 // 5]] += 0.4
    track = Track(time, residual, sigma)
    np.testing.assert_array_equal(counts_of(track, residual), counts_of(track))
