"""The low-pass filter against what a Butterworth filter is by definition."""

import numpy as np
import pytest

from sssi_exudyn.lowpass import lowpass

RATE = 100.0
TIME = np.arange(0.0, 40.0, 1.0 / RATE)
MIDDLE = slice(1000, 3000)  # far from the ends: many periods of every frequency used here


def gain(frequency: float) -> float:
    filtered = lowpass(np.sin(2.0 * np.pi * frequency * TIME), RATE)
    return float(np.sqrt(2.0) * np.std(filtered[MIDDLE]))


def test_half_the_power_passes_at_the_cutoff() -> None:
    # The definition, exact for sines up to the leakage of the finite record (1e-3).
    assert gain(6.0) == pytest.approx(2.0**-0.5, rel=1e-3)


def test_fourth_order_fall() -> None:
    # Two passes have the gain |H|² = 1/(1 + (Ω/Ωc)⁴) of a second-order one, in the bilinear Ω = tan(π f/rate).
    warped = np.tan(np.pi * 12.0 / RATE) / np.tan(np.pi * 6.0 / RATE)
    expected = 1.0 / (1.0 + (2.0**0.5 - 1.0) * warped**4)
    assert gain(12.0) == pytest.approx(expected, rel=1e-2)  # the sine's leakage against a gain of 0.1


def test_slow_motion_passes_without_lag() -> None:
    # Gain at 1 Hz: 1/(1 + 0.414/6⁴) = 0.99968, so the largest difference of a unit sine is 3.2e-4.
    slow = np.sin(2.0 * np.pi * TIME)
    assert np.max(np.abs(lowpass(slow, RATE) - slow)[MIDDLE]) < 4e-4


def test_straight_line_stays_to_its_ends() -> None:
    # Point reflection continues a line by itself; the start's memory is e⁻²² of the slope after four periods.
    line = np.stack([TIME, 3.0 - 2.0 * TIME], axis=1)
    np.testing.assert_allclose(lowpass(line, RATE), line, atol=1e-9)


def test_nothing_to_remove_below_twice_the_cutoff() -> None:
    values = np.array([1.0, -2.0, 5.0])
    np.testing.assert_array_equal(lowpass(values, rate=10.0), values)
