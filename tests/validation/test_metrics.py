"""Figures of agreement against cases whose answer is known by hand."""

import numpy as np
import pytest

from sssi_exudyn.validation.metrics import at_times, path_length, pressure_ratio, ratio_agreement, trajectory_error


def test_constant_offset_is_the_mean_distance() -> None:
    # 3-4-5 in the horizontal plane, over a straight path of 50 m: 5 m are 10 %.
    measured = np.linspace([0.0, 0.0, 0.0], [50.0, 0.0, 0.0], 101)
    error = trajectory_error(measured + [3.0, 4.0, 0.0], measured)
    assert error.mean_error == pytest.approx(5.0)
    assert error.rms_error == pytest.approx(5.0)
    assert error.length == pytest.approx(50.0)
    assert error.percent_of_length == pytest.approx(10.0)


def test_growing_error_tells_mean_rms_max_and_end_apart() -> None:
    measured = np.zeros((3, 2))
    measured[:, 0] = [0.0, 10.0, 20.0]
    simulated = measured + np.array([[0.0, 0.0], [0.0, 4.0], [0.0, -2.0]])
    error = trajectory_error(simulated, measured)
    assert error.mean_error == pytest.approx(2.0)
    assert error.rms_error == pytest.approx(np.sqrt(20.0 / 3.0))
    assert (error.max_error, error.end_error) == (4.0, 2.0)


def test_noise_does_not_flatter_the_percentage() -> None:
    smooth = np.linspace([0.0, 0.0], [100.0, 0.0], 201)
    noisy = smooth + np.random.default_rng(1).normal(0.0, 1.0, smooth.shape)
    assert path_length(noisy) > 200.0  # a metre of white noise at every step has more than doubled the path
    assert trajectory_error(smooth, noisy).length == pytest.approx(100.0)


def test_turned_and_moved_together_the_error_stays() -> None:
    rng = np.random.default_rng(2)
    simulated, measured = rng.normal(size=(2, 40, 3)).cumsum(axis=1)
    c, s = np.cos(0.7), np.sin(0.7)
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    before = trajectory_error(simulated, measured)
    after = trajectory_error(simulated @ turn.T + 5.0, measured @ turn.T + 5.0)
    assert after.percent_of_length == pytest.approx(before.percent_of_length)


@pytest.mark.parametrize(
    ("simulated", "measured"),
    [
        (np.zeros((4, 3)), np.zeros((5, 3))),
        (np.zeros((1, 3)), np.zeros((1, 3))),
        (np.full((4, 3), np.nan), np.zeros((4, 3))),
    ],
    ids=["shapes differ", "one sample", "not finite"],
)
def test_trajectories_that_cannot_be_compared_are_refused(simulated: np.ndarray, measured: np.ndarray) -> None:
    with pytest.raises(ValueError, match="trajector"):
        trajectory_error(simulated, measured)


def test_pressure_ratio_by_hand() -> None:
    left, right = np.array([300.0, 0.0, 500.0]), np.array([100.0, 800.0, 500.0])
    np.testing.assert_allclose(pressure_ratio(left, right), [0.75, 0.0, 0.5])


def test_pressure_ratio_says_nothing_in_the_air() -> None:
    # 1 N against a mean of 500 N: not a ratio but the insoles' zero error.
    left, right = np.array([400.0, 400.0, 1.0, 400.0]), np.array([400.0, 0.0, -3.0, 400.0])
    ratio = pressure_ratio(left, right)
    np.testing.assert_allclose(ratio, [0.5, 1.0, np.nan, 0.5])
    agreement = ratio_agreement(np.array([0.5, 1.0, 0.9, 0.5]), ratio)
    assert (agreement.correlation, agreement.rmsd, agreement.samples) == (pytest.approx(1.0), 0.0, 3)


def test_ratio_agreement_tells_phase_from_amplitude() -> None:
    phase = np.linspace(0.0, 4.0 * np.pi, 2000, endpoint=False)
    full, half = 0.5 + 0.4 * np.sin(phase), 0.5 + 0.2 * np.sin(phase)
    agreement = ratio_agreement(half, full)
    assert agreement.correlation == pytest.approx(1.0)
    assert agreement.rmsd == pytest.approx(0.2 / np.sqrt(2.0))
    shifted = ratio_agreement(0.5 + 0.4 * np.sin(phase + np.pi / 3.0), full)
    assert shifted.correlation == pytest.approx(0.5)  # cos 60°


def test_ratio_without_variation_has_no_correlation() -> None:
    agreement = ratio_agreement(np.full(5, 0.5), np.linspace(0.4, 0.6, 5))
    assert np.isnan(agreement.correlation)
    with pytest.raises(ValueError, match="fewer than two"):
        ratio_agreement(np.full(5, np.nan), np.full(5, 0.5))


def test_at_times_keeps_columns_and_marks_what_lies_outside() -> None:
    time = np.array([0.0, 1.0, 2.0])
    values = np.stack([time, 10.0 * time], axis=1)
    np.testing.assert_allclose(at_times(time, values, np.array([0.5, 1.75])), [[0.5, 5.0], [1.75, 17.5]])
    np.testing.assert_array_equal(np.isnan(at_times(time, time, np.array([-0.1, 0.0, 2.1]))), [True, False, True])
