"""All that is uncertain, estimated together: exact responses, a budget that adds up, concealed errors found again."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from bundled import bundled
from scipy.linalg import cho_solve

from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.number_ref import MU_T, NumberRef
from sssi_exudyn.fitting import posterior as module
from sssi_exudyn.fitting import posterior as posterior_module
from sssi_exudyn.fitting.estimate import setting_of
from sssi_exudyn.fitting.evidence import Freedom, LinearProblem, best_levels, precision
from sssi_exudyn.fitting.first_fit import problem_of
from sssi_exudyn.fitting.linearised_run import Point, Responses, Setting, linearise_at, moved_point
from sssi_exudyn.fitting.objective import Prior
from sssi_exudyn.fitting.observations import Observation
from sssi_exudyn.fitting.optimise import Optimum
from sssi_exudyn.fitting.parameters import Parameter
from sssi_exudyn.fitting.posterior import draw_numbers, find_posterior
from sssi_exudyn.fitting.posture_errors import PostureErrors
from sssi_exudyn.fitting.snow_surface import surface_process
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.model.legs import USUAL_COMPLIANCE
from sssi_exudyn.model.model import Model
from sssi_exudyn.validation.drawn_run import draw_run

pytestmark = pytest.mark.usefixtures("coarse_skis")
SECONDS = 5.0
FRICTION = {"friction.mu_t": 0.06, "friction.mu_n": 0.55}


@cache
def example() -> tuple[Model, Setting]:
    """The beginner's first seconds, on legs that give as usual: no step from there meets their bound."""
    recording, motion = bundled("beginner")
    motion = replace(motion, stop=motion.start + SECONDS)
    problem = problem_of(recording, motion, model_of(recording, motion), "joint")
    start = problem.model.with_values({**FRICTION, "legs.compliance": USUAL_COMPLIANCE})
    return setting_of(start, problem, recording, motion)


@cache
def linearised() -> tuple[Point, Responses]:
    return linearise_at(*example())


def moved(values: Array, sizes: Array) -> Array:
    """(N,) what would be measured with those numbers and errors."""
    _, setting = example()
    return moved_point(setting, *linearised(), values, sizes).predicted


def blockwise(seen: Observation, given: Array, expected: Array) -> dict[str, float]:
    """Error of a response by block, root mean square, in standard deviations of that block's usual noise."""
    apart = {
        name: np.sqrt(np.mean((given - expected)[at] ** 2)) for name, at in seen.blocks.items() if at.stop > at.start
    }
    return {name: float(value / seen.usual.of(name).sigma) for name, value in apart.items()}


@pytest.mark.long
def test_responses_to_errors_are_those_of_runs() -> None:
    _, setting = example()
    point, responses = linearised()
    before = setting.values(point.model)
    wanted = [
        ("roll", 0, -1),
        ("pitch", 1, 2),
        ("yaw", 0, 1),
        ("forward", 1, -1),
        ("height", 0, 2),
        ("trunk_forward", -1, -1),
    ]
    keys = [(error.kind, error.side, error.support) for error in setting.errors]
    for i in [*(keys.index(key) for key in wanted), len(keys)]:
        size = np.zeros(len(keys) + 1)
        size[i] = 0.2
        expected = (moved(before, size) - moved(before, -size)) / 0.4
        # A tenth of the noise: half a standard deviation of an error is then taken to a twentieth of the noise.
        assert max(blockwise(setting.seen, responses.by_error[:, i], expected).values()) < 0.1, [*keys, "mass"][i]


@pytest.mark.long
def test_responses_to_numbers_are_those_of_runs() -> None:
    _, setting = example()
    point, responses = linearised()
    before, nothing = setting.values(point.model), np.zeros(len(setting.errors) + 1)
    for i, name in enumerate(setting.names):
        most = {"friction": 0.004, "start": 0.01}.get(name.partition(".")[0], np.inf)  # with more curvature shows
        step = min(0.1 * setting.sigmas[i], most)
        change = step * (np.arange(len(before)) == i)
        expected = (moved(before + change, nothing) - moved(before - change, nothing)) / 2.0
        assert max(blockwise(setting.seen, step * responses.by_number[:, i], expected).values()) < 0.05, name


@pytest.mark.long
def test_the_budget_adds_up() -> None:
    _, setting = example()
    point, responses = linearised()
    solution = module.solve(setting, point, responses, setting.seen.usual)
    total = sum(share**2 for share in solution.shares.values())
    np.testing.assert_allclose(total, np.diag(solution.covariance), rtol=1e-6)
    assert np.all(np.linalg.eigvalsh(solution.covariance) > 0.0)


def test_covariance_is_that_of_all_numbers_and_errors_together() -> None:
    """Eliminating the errors first gives the same as inverting the whole, and the same estimate."""
    _, setting = example()
    point, responses = linearised()
    levels = setting.seen.usual
    near = point.predicted + 0.3 * (setting.seen.measured - point.predicted)  # legs need not get stiffer than they may
    setting = replace(setting, seen=replace(setting.seen, measured=near))
    solution = module.solve(setting, point, responses, levels)
    k = len(setting.unknowns)
    parts = [responses.by_number, responses.by_error, responses.by_drag]
    table = setting.seen.whiten(levels, np.column_stack([setting.seen.measured - point.predicted, *parts]))
    columns = table[:, 1:]
    prior = np.concatenate([setting.sigmas**-2.0, np.ones(columns.shape[1] - k)])
    precision = columns.T @ columns + np.diag(prior)
    pulls = np.concatenate([(setting.values(point.model) - setting.means) * prior[:k], np.zeros(columns.shape[1] - k)])
    whole = np.linalg.solve(precision, columns.T @ table[:, 0] - pulls)
    scale = np.sqrt(np.diag(solution.covariance))
    np.testing.assert_allclose(
        np.linalg.inv(precision)[:k, :k] / np.outer(scale, scale),
        solution.covariance / np.outer(scale, scale),
        atol=1e-6,
    )
    free = np.abs(solution.step - whole[:k]) / scale  # where no bound is met
    assert free.max() < 0.05
    np.testing.assert_allclose(solution.sizes, whole[k : k + len(solution.sizes)], atol=0.05)


def test_a_damped_step_is_that_of_a_problem_held_where_it_is() -> None:
    _, setting = example()
    point, responses = linearised()
    point = replace(point, sizes=np.linspace(-1.0, 1.0, len(point.sizes)))
    levels, damping = setting.seen.usual, 10.0
    solution = module.solve(setting, point, responses, levels, damping)
    k = len(setting.unknowns)
    residual = setting.seen.measured - point.predicted + responses.by_error @ point.sizes
    parts = [responses.by_number, responses.by_error, responses.by_drag]
    table = setting.seen.whiten(levels, np.column_stack([residual, *parts]))
    columns, drag = table[:, 1:], np.zeros(responses.by_drag.shape[1])  # it is held by nothing but its own prior
    prior = np.concatenate([setting.sigmas**-2.0, np.ones(columns.shape[1] - k)])
    held = damping * np.concatenate([prior[: len(prior) - len(drag)], drag])
    pulls = np.concatenate([(setting.means - setting.values(point.model)) * prior[:k], damping * point.sizes, drag])
    whole = np.linalg.solve(columns.T @ columns + np.diag(prior + held), columns.T @ table[:, 0] + pulls)
    # where no bound is met; the search over θ ends within a hundredth of what is known beforehand
    np.testing.assert_allclose(solution.step / setting.sigmas, whole[:k] / setting.sigmas, atol=0.01)
    np.testing.assert_allclose(solution.sizes, whole[k : k + len(solution.sizes)], atol=0.01)
    free = module.solve(setting, point, responses, levels)
    assert np.linalg.norm(solution.sizes - point.sizes) < np.linalg.norm(free.sizes - point.sizes)


@pytest.mark.parametrize(("sized", "other"), [("surface", "force"), ("force", "surface")])
def test_waves_and_unknown_forces_are_as_large_as_the_measurements_show(sized: str, other: str) -> None:
    rng = np.random.default_rng(3)
    _, setting = example()
    seen = setting.seen
    none = np.zeros((len(seen.measured), 0))
    noise = np.concatenate([np.full(at.stop - at.start, seen.usual.of(name).sigma) for name, at in seen.blocks.items()])
    columns = noise[:, None] * rng.normal(size=(len(noise), 60))
    measured = columns @ (2.0 * rng.normal(size=60)) + noise * rng.normal(size=len(noise))
    linear = LinearProblem(seen, measured, Freedom(none, np.zeros(0)), {sized: columns})
    levels, _ = best_levels(linear, seen.usual)
    # 60 amounts of 2 show their size to 0.18; a level known to 0.35 beforehand gives way to that by 0.12
    assert levels.numbers[sized] == pytest.approx(1.8, abs=0.36)
    assert levels.numbers[other] == levels.posture == 1.0  # of which these measurements say nothing


def test_waves_of_a_level_leave_the_tilt_as_it_is_known() -> None:
    _, setting = example()
    modes = tuple(Parameter((NumberRef(f"surface.m{i}"),), Prior(0.0, 1.0)) for i in range(60))
    setting = replace(setting, unknowns=(*modes, Parameter((MU_T,), Prior(0.1, 0.3))))
    assert list(setting.with_waves(1.8).sigmas) == [1.8] * 60 + [0.3]
    heights = {**setting.seen.times, "height": setting.seen.times["x"]}
    process = replace(setting, seen=replace(setting.seen, times=heights))
    # the plane's tilt is known beforehand, whatever the waves are
    assert list(process.with_waves(1.8).sigmas) == [1.0, 1.0] + [1.8] * 58 + [0.3]


@pytest.mark.long
def test_concealed_errors_are_found_within_their_uncertainty() -> None:
    model, setting = example()
    drawn = draw_run(model, setting, np.random.default_rng(1))
    posterior, values, sizes = find_posterior(model, drawn.setting), drawn.values, drawn.sizes
    assert posterior.moved < 1.0
    z = (posterior.values - values) / np.sqrt(np.diag(posterior.covariance))
    # One draw: 26 numbers of which 5 % are beyond 2 and none in a thousand beyond 3.5.
    assert np.abs(z).max() < 3.5
    every, errors = draw_numbers(posterior, 4000, np.random.default_rng(2))
    every = np.log(every, out=every, where=posterior.setting.logarithmic)
    spread = np.sqrt(np.diag(posterior.covariance))
    low, high = posterior.setting.bounds(posterior.model).T
    free = (posterior.values - 4.0 * spread > low) & (posterior.values + 4.0 * spread < high)
    # 4000 draws give a mean to 1.6 % of a standard deviation and that to 1.1 %
    assert np.allclose((every.mean(axis=0) - posterior.values)[free] / spread[free], 0.0, atol=0.08)
    assert np.allclose((every.std(axis=0) / spread)[free], 1.0, atol=0.06)
    assert np.all((every >= low) & (every <= high))
    assert np.all(errors.std(axis=0) < 1.06)  # measurements take no knowledge away
    # An error is off by one squared on average before anything is measured, and by less where measurements tell of it.
    measured = errors.std(axis=0) < 0.9
    assert np.sum(measured) > 3
    assert np.mean((posterior.sizes - sizes)[measured] ** 2) < 0.9**2
    # of 80 errors none in a hundred draws is beyond 3.8 of what is left of it
    assert np.max(np.abs(posterior.sizes - sizes) / errors.std(axis=0)) < 3.8
    # Where friction is known the start is where the draws with that friction have it on average.
    names = [str(name) for name in posterior.setting.names]
    mu_t, speed = names.index("friction.mu_t"), names.index("start.velocity_f")
    more = float(spread[mu_t])
    known = posterior.model_where({"friction.mu_t": posterior.model.friction.mu_t + more})
    assert known.friction.mu_t == pytest.approx(posterior.model.friction.mu_t + more)
    slope = np.cov(every[:, mu_t], every[:, speed])
    expected = slope[0, 1] / slope[0, 0] * more
    # 4000 draws give a slope to 1.6 % of what all of the speed's spread would be
    assert known.start.velocity_f - posterior.model.start.velocity_f == pytest.approx(
        expected, abs=0.08 * spread[speed]
    )
    # The moments are closed and the track is met to the noise that was added.
    x = posterior.residual[posterior.setting.seen.blocks["x"]]
    assert np.sqrt(np.mean(x**2)) < 2.0 * posterior.setting.seen.usual.of("x").sigma


@pytest.mark.long
def test_posture_and_snow_surface_are_found_together() -> None:
    """Of a surface that no heights have shown beforehand: the fixes' heights are measured, above an unknown origin."""
    recording, motion = bundled("beginner")
    motion = replace(motion, stop=motion.start + SECONDS)
    model = model_of(recording, motion)
    process = surface_process(model, recording, motion)
    assert process is not None
    level = replace(process.surface, amounts=(0.0,) * len(process.surface.amounts))
    problem = problem_of(recording, motion, replace(model, surface=level), "joint")
    model, setting = setting_of(
        problem.model.with_values(FRICTION), problem, recording, motion, balanced=False, heights=True
    )
    drawn = draw_run(model, setting, np.random.default_rng(4))
    place = drawn.setting.seen.blocks["height"]
    drawn.setting.seen.measured[place] += 3.0
    posterior = find_posterior(model, drawn.setting, comparing=True)
    z = (posterior.values - drawn.values) / np.sqrt(np.diag(posterior.covariance))
    # one draw of 40 numbers, of which none in a hundred draws is beyond 3.7
    assert np.abs(z).max() < 3.7
    modes = posterior.setting.of_process
    assert np.sum(modes) > 5
    # waves of even snow are millimetres high, and heights are off by 3 cm: still it is nearer to the truth than nothing
    assert np.sum((posterior.values - drawn.values)[modes] ** 2) < np.sum(drawn.values[modes] ** 2)
    height = posterior.residual[place]
    assert np.std(height) < 1.5 * posterior.setting.seen.usual.of("height").sigma
    assert np.mean(height) == pytest.approx(3.0, abs=0.2)  # the origin is no part of the estimate


@pytest.mark.long
def test_an_estimate_goes_on_by_short_steps_where_much_is_left(monkeypatch: pytest.MonkeyPatch) -> None:
    """Steps that are all damped move hardly anything, and take misfit away: that is no end."""
    monkeypatch.setattr(posterior_module, "_DAMPINGS", (1e3,))
    model, setting = example()
    drawn = draw_run(model, setting, np.random.default_rng(1))
    estimated = find_posterior(model, drawn.setting, comparing=True)
    assert estimated.moved < 0.1  # two thirds of what ends a search
    assert estimated.rounds == posterior_module.ROUNDS


def test_an_estimate_of_fewer_errors_says_nothing_of_the_others() -> None:
    _, setting = example()
    sizes = np.arange(1.0, len(setting.errors) + 2.0)
    np.testing.assert_array_equal(setting.sizes_of(setting.errors, sizes), sizes)
    some = setting.errors[10:3:-1]
    expected = np.zeros(len(sizes))
    expected[4:11] = np.arange(7.0, 0.0, -1.0)
    expected[-1] = 8.0
    np.testing.assert_array_equal(setting.sizes_of(some, np.arange(1.0, 9.0)), expected)


def test_a_constant_error_has_no_middle_and_a_wandering_one_has() -> None:
    _, setting = example()
    errors = setting.errors
    starts = [error.middle(setting.motion.start, setting.motion.stop) for error in errors if error.support >= 0]
    assert min(starts) < setting.motion.start + 1.6
    assert max(starts) > setting.motion.stop - 1.6
    assert isinstance(linearised()[1].posture, PostureErrors)


def test_single_samples_that_are_far_off_count_less_but_fixes_keep_their_counts() -> None:
    _, setting = example()
    seen = setting.seen
    residual = np.zeros(len(seen.measured))
    place = seen.blocks["moment_l"]
    residual[place.start] = 10.0 * seen.usual.of("moment_l").sigma
    residual[seen.blocks["x"].start] = 10.0 * seen.usual.of("x").sigma
    share = seen.weighed(residual, seen.usual).scale.total / seen.scale.total
    # 2.5 standard deviations count fully; beyond, the weight falls with the square
    assert share[place.start] == pytest.approx(10.0 / 2.5, rel=1e-3)
    assert share[place.start + 1] == 1.0
    assert np.all(share[: seen.blocks["y"].stop] == 1.0)


def test_a_search_that_takes_no_step_it_promises_has_not_converged() -> None:
    optimum = Optimum(np.zeros(1), 60.0, 3, True, "converged: the objective no longer changes")
    assert module.ending_of(optimum, 62.0, 0.1).converged  # rounding and bends leave some per cent
    stopped = module.ending_of(optimum, 100.0, 0.0)
    assert not stopped.converged
    assert stopped.objective == 100.0
    assert stopped.reason == "stopped: no step lessens the misfit, though its linear form promises 40%"
    assert not module.ending_of(optimum, 60.0, 1.2).converged


def test_amplitudes_whose_columns_are_alike_and_large_are_known_as_well_as_they_are() -> None:
    """By singular values: five columns do two things, which are known to 1/size, all else as well as beforehand."""
    rng = np.random.default_rng(4)
    data = rng.standard_normal(30)
    columns = 1e9 * rng.standard_normal((30, 2)) @ rng.standard_normal((2, 5))
    with pytest.raises(np.linalg.LinAlgError):
        np.linalg.cholesky(columns.T @ columns + np.eye(5))
    factor = precision(columns)
    u, sizes, vt = np.linalg.svd(columns, full_matrices=False)
    expected = vt.T @ (sizes / (sizes**2 + 1.0) * (u.T @ data))
    # sums of products of 1e9 are rounded by 1e-6, as an amplitude is that nothing measures, of variance one
    np.testing.assert_allclose(cho_solve(factor, columns.T @ data), expected, atol=1e-5)
    assert 2.0 * np.sum(np.log(np.diag(factor[0]))) == pytest.approx(np.sum(np.log(sizes**2 + 1.0)), rel=1e-6)
