"""The surface's posterior against its definition, and against known surfaces."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.noise import ExponentialNoise
from sssi_exudyn.terrain import from_heights
from sssi_exudyn.terrain.from_heights import WAVES, Estimate, Heights, Noticed, estimate_surface, level_surface
from sssi_exudyn.terrain.surface import MOST_MODES, Surface

SIGMA = 0.03
"""Standard deviation of a fix's height by RTK, m."""


def track(seconds: float = 16.0, rate: float = 10.0) -> tuple[Array, Array]:
    """Return times (n,) s and places (n, 2) m of linked turns at 10 m/s, 5 m to either side."""
    time = np.arange(0.0, seconds, 1.0 / rate)
    return time, np.stack([10.0 * time, 5.0 * np.sin(1.5 * time)], axis=1)


def matern(places: Array, amplitude: float, length: float) -> Array:
    """Return the covariance (n, n) m² of waves of one length."""
    gap = np.linalg.norm(places[:, None] - places[None], axis=2) * np.sqrt(5.0) / length
    return np.asarray(amplitude**2 * (1.0 + gap + gap**2 / 3.0) * np.exp(-gap))


def prior(places: Array) -> Array:
    """Return the covariance (n, n) m² of waves of three lengths and of the plane's tilt.

    The usual amplitude is 0.3 m.
    """
    waves = matern(places, 0.099, 6.0) + matern(places, 0.201, 15.0) + matern(places, 0.399, 40.0)
    return np.asarray(waves + np.radians(1.0) ** 2 * places @ places.T)


def hill(rng: np.random.Generator, places: Array, amplitude: float, length: float) -> Array:
    """Draw heights (n,) m of waves of one length."""
    covariance = matern(places, amplitude, length)
    return np.asarray(np.linalg.cholesky(covariance + 1e-10 * np.eye(len(places))) @ rng.normal(size=len(places)))


def measured(rng: np.random.Generator, height: Array, time: Array, places: Array) -> Heights:
    """Return heights with the receiver's slow error over 3 s and an independent error."""
    noise = ExponentialNoise(SIGMA, 3.0)
    slow = np.zeros(len(time))
    decay = np.exp(-np.diff(time) / noise.correlation_time)
    slow[0] = rng.normal(0.0, SIGMA)
    for k, keep in enumerate(decay):
        slow[k + 1] = keep * slow[k] + SIGMA * np.sqrt(1.0 - keep**2) * rng.normal()
    return Heights(
        time, places, height + slow + rng.normal(0.0, 0.5 * SIGMA, len(time)), np.full(len(time), SIGMA), noise
    )


def spline(estimate: Estimate) -> Surface:
    return estimate.surface(level_surface(estimate.heights))


def test_the_posterior_is_a_normal_density_conditioned() -> None:
    rng = np.random.default_rng(4)
    time, places = track(3.0, 5.0)
    heights = measured(rng, hill(rng, places, 0.3, 15.0), time, places)
    estimate = Estimate(heights, 0.3, np.ones(len(time)))
    at = places[::4] + 0.7
    # the same from the joint covariance of heights and surface, written out
    every = np.concatenate([places, at])
    joint = prior(every)
    n = len(time)
    joint[:n, :n] += 100.0 + SIGMA**2 * np.exp(-np.abs(time[:, None] - time) / 3.0) + 0.25 * SIGMA**2 * np.eye(n)
    gain = np.linalg.solve(joint[:n, :n], joint[:n, n:]).T
    # 100 m² of the origin's variance against millimetres: 1e-16·100/1e-4
    np.testing.assert_allclose(estimate.mean(at), gain @ heights.height, atol=1e-8)
    covariance = joint[n:, n:] - gain @ joint[:n, n:]
    level = np.eye(len(at)) - 1.0 / len(at)
    np.testing.assert_allclose(estimate.covariance(at), level @ covariance @ level, atol=1e-9)


def test_other_runs_have_origins_and_receivers_of_their_own() -> None:
    rng = np.random.default_rng(3)
    time, places = track(3.0, 5.0)
    true = hill(rng, np.concatenate([places, places + [0.0, 4.0]]), 0.3, 15.0)
    first, second = (
        measured(rng, height, time, place)
        for height, place in zip(np.split(true, 2), (places, places + [0.0, 4.0]), strict=True)
    )
    heights = replace(first, others=(replace(second, height=second.height + 8.0),))
    n = len(time)
    estimate = Estimate(heights, 0.3, np.ones(2 * n))
    at = places[::4] + [0.0, 2.0]
    every = np.concatenate([heights.all_places, at])
    joint = prior(every)
    own = 100.0 + SIGMA**2 * np.exp(-np.abs(time[:, None] - time) / 3.0) + 0.25 * SIGMA**2 * np.eye(n)
    joint[:n, :n] += own
    joint[n : 2 * n, n : 2 * n] += own
    gain = np.linalg.solve(joint[: 2 * n, : 2 * n], joint[: 2 * n, 2 * n :]).T
    np.testing.assert_allclose(estimate.mean(at), gain @ heights.all_heights, atol=1e-8)
    alone = Estimate(first, 0.3, np.ones(n))
    assert np.all(np.diag(estimate.covariance(at)) < np.diag(alone.covariance(at)))


def test_heights_of_many_runs_are_bounded() -> None:
    rng = np.random.default_rng(6)
    time, places = track(60.0, 20.0)
    run = measured(rng, np.zeros(len(time)), time, places)
    heights = estimate_surface(replace(run, others=(run, run, run))).heights
    assert len(heights.all_heights) <= 500
    assert [len(other.time) for other in heights.others] == [83, 83, 83]


@pytest.mark.long
def test_bands_hold_the_truth_as_often_as_they_say() -> None:
    time, places = track()
    inside, total = 0, 0
    for seed in range(25):
        rng = np.random.default_rng(seed)
        true = hill(rng, places, rng.uniform(0.1, 0.6), rng.uniform(8.0, 30.0))
        estimate = estimate_surface(measured(rng, true, time, places))
        some = places[::16]
        error = estimate.mean(some) - true[::16]
        error -= error.mean()
        inside += int(np.sum(np.abs(error) < 1.645 * np.sqrt(np.diag(estimate.covariance(some)))))
        total += len(some)
    # 250 errors, of which some 100 are independent: 90 ± 3 % (one standard deviation); amplitude and length are not
    # integrated over, which costs a few per cent
    assert 0.82 <= inside / total <= 0.97


def test_a_wrong_stated_inclination_is_corrected() -> None:
    rng = np.random.default_rng(2)
    time, places = track()
    tilt = np.tan(np.radians(0.6))
    surface = spline(estimate_surface(measured(rng, tilt * places[:, 0], time, places)))
    end = surface.at(places)[-1, 0]
    # over 160 m the receiver's slow error is a tilt of 0.03/160, a fiftieth of what is sought
    assert end == pytest.approx(tilt * (places[-1, 0] - places[0, 0]), rel=0.06)


def test_single_fixes_that_are_far_off_move_it_little() -> None:
    rng = np.random.default_rng(7)
    time, places = track()
    clean = measured(rng, hill(rng, places, 0.3, 20.0), time, places)
    spoilt = clean.height.copy()
    off = rng.choice(len(time), 6, replace=False)
    spoilt[off] += rng.choice([-1.0, 1.0], 6) * 0.4
    reference = spline(estimate_surface(clean)).at(places)[:, 0]
    estimate = estimate_surface(Heights(time, places, spoilt, clean.sigma, clean.noise))
    moved = spline(estimate).at(places)[:, 0] - reference
    # the band of a surface from whole fixes is 0.03 m; unweighed, one such fix moves its place by 0.1 m
    assert np.max(np.abs(moved - moved.mean())) < SIGMA
    assert set(off) == set(np.flatnonzero(estimate.weight < 0.3))


def test_a_plane_stays_one() -> None:
    rng = np.random.default_rng(5)
    time, places = track()
    heights = spline(estimate_surface(measured(rng, np.zeros(len(time)), time, places))).at(places)[:, 0]
    assert np.std(heights) < SIGMA


@pytest.mark.long
def test_long_tracks_are_averaged() -> None:
    rng = np.random.default_rng(6)
    time, places = track(60.0, 20.0)
    true = hill(rng, places, 0.3, 20.0)
    estimate = estimate_surface(measured(rng, true, time, places))
    assert len(estimate.heights.time) == 500
    error = spline(estimate).at(places)[:, 0] - true
    assert np.std(error) < 1.5 * SIGMA


def test_too_few_heights_are_refused() -> None:
    time, places = track(0.3)
    with pytest.raises(ValueError, match="fewer than 4"):
        estimate_surface(Heights(time, places, np.zeros(3), np.full(3, SIGMA), ExponentialNoise(SIGMA, 1.0)))


def test_modes_are_what_the_heights_leave_open_of_the_track() -> None:
    # across the path nothing is measured: surfaces drawn from the process, less the mean of their heights' posterior,
    # move a skier by what the modes hold
    rng = np.random.default_rng(8)
    time, places = track()
    estimate = Estimate(measured(rng, np.zeros(len(time)), time, places), 0.3, np.ones(len(time)))
    noise = 0.02
    surface = estimate.surface(level_surface(estimate.heights), Noticed(noise))
    assert 3 <= len(surface.amounts) <= 40
    step = np.array([0.5, 0.0]), np.array([0.0, 0.5])
    around = np.concatenate([places + s for pair in step for s in (pair, -pair)])
    covariance = estimate.covariance(around)
    by_modes = np.stack([replace(surface, mean=mode).at(around)[:, 0] for mode in surface.modes], axis=1)
    by_modes -= by_modes.mean(axis=0)
    slopes = np.kron(np.eye(2), np.hstack([np.eye(len(time)), -np.eye(len(time))]))
    whole = slopes @ covariance @ slopes.T
    rest = whole - slopes @ by_modes @ by_modes.T @ slopes.T
    twice = np.kron(np.eye(2), np.tril(np.ones((len(time), len(time)))) * 0.1)
    line = np.kron(np.eye(2), np.stack([np.ones(len(time)), time], axis=1))
    level = np.eye(2 * len(time)) - line @ np.linalg.pinv(line)
    moves = 9.81 * level @ twice @ twice
    before, after = (np.trace(moves @ part @ moves.T) / len(time) for part in (whole, rest))
    # what is left over: the modes left out together are below the noise; the spline's nodes of 2 m and rectangles for
    # trapezoids take a part of the others
    assert after < 0.02 * before


def a_receiver(seed: int, sigma: float = 1.0, amplitude: float = 0.3) -> tuple[Array, Array, Estimate]:
    """Return times (n,) s, places (n, 2) m, and the surface from heights that are off by ``sigma`` (m)."""
    time, places = track()
    count = len(time)
    height = np.random.default_rng(seed).normal(0.0, sigma, count)
    heights = Heights(time, places, height, np.full(count, sigma), ExponentialNoise(sigma, 3.0))
    return time, places, Estimate(heights, amplitude, np.ones(count))


def velocity_at(time: Array) -> Array:
    """Return the velocity (n, 2) m/s along the track."""
    return np.stack([np.full(len(time), 10.0), 7.5 * np.cos(1.5 * time)], axis=1)


def lifts(time: Array, places: Array) -> tuple[Array, Array]:
    """Return places (3·n, 2) m and the table (n, 3·n) of how the heights there throw the skier up, m/s²."""
    count, velocity = len(time), velocity_at(time)
    speed = np.linalg.norm(velocity, axis=1)
    ahead = velocity / speed[:, None]
    second = np.hstack([np.eye(count), np.eye(count), -2.0 * np.eye(count)]) * (speed**2)[:, None]
    return np.concatenate([places + ahead, places - ahead, places]), second


def left_over(estimate: Estimate, noticed: Noticed, around: Array, table: Array) -> float:
    """Return the share of the variance of effects ``table`` (n, p) of heights at ``around`` (p, 2) that is not held by
    the modes.
    """
    surface = estimate.surface(level_surface(estimate.heights), noticed)
    by_modes = np.stack([replace(surface, mean=mode).at(around)[:, 0] for mode in surface.modes], axis=1)
    whole, held = table @ estimate.covariance(around) @ table.T, table @ by_modes
    return float(np.trace(whole - held @ held.T) / np.trace(whole))


@pytest.mark.long
def test_many_modes_that_are_hardly_noticed_are_kept_together() -> None:
    """On even snow hardly a mode throws the skier up by what soles notice, and all of them do by four times that."""
    time, places, estimate = a_receiver(9, sigma=0.02, amplitude=0.026)
    around, table = lifts(time, places)
    # the 2 m between nodes lose 23 % of the variance, and the modes left out have 1 %; 76 % where each was judged alone
    assert left_over(estimate, Noticed(0.003, lift=0.035), around, table) < 0.3


@pytest.mark.long
def test_modes_hold_what_throws_the_skier_up() -> None:
    # waves drawn from the process throw the skier up as the modes can
    time, places, estimate = a_receiver(9)
    around, table = lifts(time, places)
    # beyond the 100 modes of poor heights is 18 % of the variance; the 2 m between nodes lose 7 %
    assert left_over(estimate, Noticed(0.5, lift=0.1), around, table) < 0.3
    # the track alone shows the long ones
    assert left_over(estimate, Noticed(0.5), around, table) > 0.5


@pytest.mark.long
def test_modes_hold_how_much_higher_one_ski_is() -> None:
    # slopes across the path, as of surfaces drawn from the process
    time, places, estimate = a_receiver(9)
    velocity = velocity_at(time)
    across = np.stack([-velocity[:, 1], velocity[:, 0]], axis=1) / np.linalg.norm(velocity, axis=1)[:, None]
    around = np.concatenate([places + 0.5 * across, places - 0.5 * across])
    tilt = np.hstack([np.eye(len(time)), -np.eye(len(time))])

    whole = float(np.sqrt(np.trace(tilt @ estimate.covariance(around) @ tilt.T) / len(time)))

    def left_out(noticed: Noticed) -> float:
        """Return the root mean square, rad, of the tilt that the modes do not hold."""
        return whole * float(np.sqrt(left_over(estimate, noticed, around, tilt)))

    # 1.4 degrees in all; modes of 1 mrad together are left out, and 2 m between nodes lose some of the shortest
    assert left_out(Noticed(0.5, tilt=0.001)) < np.radians(0.5)
    # the track alone leaves the short ones
    assert left_out(Noticed(0.5)) > np.radians(1.0)


@pytest.mark.parametrize("seed", range(3))
def test_a_surface_of_the_process_is_one_of_usual_amounts(seed: int) -> None:
    # the effect of omitted modes along the path, and the heights' origin, must not be taken for waves
    time, places = track()
    rng = np.random.default_rng(seed)
    amplitude = 0.4
    height = np.sum([hill(rng, places, share * amplitude, length) for share, length in WAVES], axis=0)
    heights = Heights(time, places, height + 0.7, np.full(len(time), 0.002), ExponentialNoise(0.002, 3.0))
    surface, around, follow, _ = Estimate(heights, amplitude, np.ones(len(time))).process(
        level_surface(heights), Noticed(0.002, lift=0.02, tilt=0.001)
    )
    amounts = np.array(surface.amounts)
    assert len(amounts) == MOST_MODES  # the plane's tilt included: a file of more is refused
    # each has variance one a priori: a mean square of 50 is 1.0 within 0.6, three sigma; what is unknown lessens it
    assert 0.4 < np.mean(amounts[:50] ** 2) < 1.6
    assert np.max(np.abs(amounts)) < 4.0
    # the surface's own heights give the amounts back, but of waves that are short for nodes 2 m apart
    np.testing.assert_allclose((follow @ surface.at(around)[:, 0])[:50], amounts[:50], atol=0.2)


@pytest.mark.long
def test_modes_hold_what_changes_the_speed() -> None:
    estimate = a_receiver(10)[-1]
    by_track, by_speed = (
        len(estimate.surface(level_surface(estimate.heights), noticed).amounts)
        for noticed in (Noticed(0.5), Noticed(0.5, speed=0.05))
    )
    assert by_speed > by_track


@pytest.mark.parametrize("process", [False, True])
def test_a_surface_is_the_same_in_blocks_of_nodes(monkeypatch: pytest.MonkeyPatch, process: bool) -> None:
    time, places = track()
    heights = measured(np.random.default_rng(5), hill(np.random.default_rng(6), places, 0.3, 15.0), time, places)
    estimate, empty = Estimate(heights, 0.3, np.ones(len(time))), level_surface(heights)
    noticed = Noticed(place=0.02, speed=0.05)

    def made() -> Surface:
        return estimate.process(empty, noticed)[0] if process else estimate.surface(empty, noticed)

    whole = made()
    monkeypatch.setattr(from_heights, "_BLOCK", 4000)
    in_blocks = made()
    assert len(whole.modes) > 2
    for name in ("mean", "deviation", "modes"):
        np.testing.assert_allclose(getattr(in_blocks, name), getattr(whole, name), rtol=1e-7, atol=1e-9)  # rounding


def test_a_wide_slope_has_a_bounded_number_of_nodes() -> None:
    time = np.arange(0.0, 600.0)
    places = np.stack([9.0 * time, 5.0 * time], axis=1)
    surface = level_surface(Heights(time, places, 0.0 * time, np.ones(600), ExponentialNoise(1.0, 3.0)))
    assert surface.mean.size < 310_000  # 16 km²; a row and a column more than the area has
    assert surface.nodes().max(axis=0) == pytest.approx(places.max(axis=0) + 15.0, abs=surface.spacing)
