"""The model before a fit: the guess of the start of a run."""

from dataclasses import replace

import numpy as np
import pytest
from bundled import bundled

from sssi_exudyn.fitting.first_fit import fit, problem_of
from sssi_exudyn.model.from_recording import first_guess, guess_with_error, model_of
from sssi_exudyn.recording.instruments.gps import Gps


def coarse(gps: Gps, seed: int, sigma: float) -> Gps:
    """Return every second fix, off by ``sigma`` (m), from a receiver that gives no speed."""
    enu = gps.enu[::2] + np.random.default_rng(seed).normal(0.0, sigma, gps.enu[::2].shape)
    return replace(gps, time=gps.time[::2], enu=enu, sigma=np.full(len(enu), sigma), speed=None, course=None)


@pytest.mark.parametrize("far", [(), (0,), (1,), (0, 1), (4, 9)])
def test_fixes_that_are_far_off_do_not_bend_the_first_guess(far: tuple[int, ...]) -> None:
    recording, motion = bundled("beginner")
    gps, slope = recording.gps, recording.slope
    assert gps is not None
    first = int(np.searchsorted(gps.time, motion.start))
    enu = gps.enu.copy()
    enu[[first + i for i in far]] += [0.3, -0.4, 0.0]
    usual = first_guess(gps, motion, slope.inclination, slope.fall_line_azimuth)
    guess = first_guess(replace(gps, enu=enu), motion, slope.inclination, slope.fall_line_azimuth)
    # a cubic through the rest, seen beyond its end: fixes of 2 cm leave 10 cm and 0.5 m/s without the first two of them
    assert np.hypot(guess.f - usual.f, guess.l - usual.l) < 0.12
    assert np.hypot(guess.velocity_f - usual.velocity_f, guess.velocity_l - usual.velocity_l) < 0.6


def test_coarse_fixes_are_smoothed_as_well_as_stated() -> None:
    """A cubic through 1.2 s of fixes that are 2 m off is wrong by 20 m/s."""
    recording, motion = bundled("intermediate")
    gps, slope = recording.gps, recording.slope
    assert gps is not None
    usual = first_guess(gps, motion, slope.inclination, slope.fall_line_azimuth)
    apart = []
    for seed in range(40):
        guess, error = guess_with_error(coarse(gps, seed, 2.0), motion, slope.inclination, slope.fall_line_azimuth)
        apart += [(guess.velocity_f - usual.velocity_f) / error, (guess.velocity_l - usual.velocity_l) / error]
    # 80 normal errors have a spread of 1 ± 0.08; this one start is in a turn harder than most, or less hard
    assert 0.6 < np.sqrt(np.mean(np.square(apart))) < 1.5


def test_a_straight_path_is_guessed_exactly() -> None:
    recording, motion = bundled("intermediate")
    gps, slope = recording.gps, recording.slope
    assert gps is not None
    east, north = np.sin(slope.fall_line_azimuth), np.cos(slope.fall_line_azimuth)
    down = np.array([east * np.cos(slope.inclination), north * np.cos(slope.inclination), -np.sin(slope.inclination)])
    enu = 9.0 * (gps.time - motion.start)[:, None] * down
    straight = replace(gps, enu=enu, sigma=np.full(len(enu), 0.2), speed=None, course=None)
    guess, error = guess_with_error(straight, motion, slope.inclination, slope.fall_line_azimuth)
    # the prior of 15 m/s draws by (error / 15)², less than a hundredth
    assert guess.velocity_f == pytest.approx(9.0, rel=0.01)
    assert guess.velocity_l == pytest.approx(0.0, abs=1e-6)
    assert 0.5 < error < 1.5


@pytest.mark.long(seconds=10)
def test_a_fit_to_coarse_fixes_without_speeds_is_not_lost() -> None:
    """A start with 24 m/s across the slope would end 11 m off, with friction at its bounds."""
    recording, motion = bundled("intermediate")
    assert recording.gps is not None
    rough = replace(recording, gps=coarse(recording.gps, 3, 2.0))
    fitted = fit(problem_of(rough, motion, model_of(rough, motion), "joint"), motion, full=False, coarse=True)
    # noise of 2 m along two axes is 2.5 m on average
    assert np.mean(np.linalg.norm(fitted.residual, axis=1)) < 3.0
    usual = problem_of(recording, motion, model_of(recording, motion), "joint")
    assert fitted.model.friction.mu_n == pytest.approx(
        fit(usual, motion, full=False, coarse=True).model.friction.mu_n, abs=0.1
    )


def test_fixes_that_are_hours_apart_are_smoothed_in_longer_cells() -> None:
    """In cells of 0.1 s the process of their acceleration would be a matrix of 370 GB."""
    recording, motion = bundled("intermediate")
    gps, slope = recording.gps, recording.slope
    assert gps is not None
    few = np.arange(4)
    apart = replace(
        gps,
        time=motion.start + 3600.0 * few,
        enu=1000.0 * few[:, None] * [0.6, 0.8, 0.0],
        sigma=np.full(4, 3.0),
        speed=None,
        course=None,
    )
    guess, error = guess_with_error(apart, motion, slope.inclination, slope.fall_line_azimuth)
    assert np.isfinite([guess.f, guess.l, guess.velocity_f, guess.velocity_l]).all()
    assert 3.0 < error <= 15.0  # of fixes an hour apart next to nothing is known of the start
