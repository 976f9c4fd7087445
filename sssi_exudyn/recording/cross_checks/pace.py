"""The rate of one clock on another, from two instruments that see the same turns."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Protocol

import numpy as np

from sssi_exudyn.core.frames import Array

_RATES: Final = np.log(1.0 / 0.7)
_RATE_STEP: Final = 0.02
"""Largest logarithm of a factor between two clocks that is tried, and its steps: 25 frames a second for 30, 60 for 50.
"""
_OFFSETS: Final = (0.5, 0.06)
_MOST_OFFSET: Final = 3.0
_OFFSET_STEP: Final = 0.1
"""Largest offset of the clocks in the middle of the run that is tried along with a rate, s and s for each second of the
run, at most; and its steps.  A clock that was right at the start and is a tenth fast is late by 0.05 of the run there.
"""
_INDEPENDENT: Final = 0.5
"""Time, s, after which the errors of two smoothed measurements are independent."""
_FINE: Final = 31
"""Number of rates and of offsets that are tried once more about the best ones."""
_FINE_OFFSET: Final = 0.2
"""Largest distance of an offset from the best one, s, that is tried once more."""


class Comparison(Protocol):
    """Two instruments, of which one predicts the other but for the rate of their clocks.

    Attributes
    ----------
    middle, span : s, middle and length of the stretch that is compared
    floor : standard deviation of the rate that comes from the prediction itself, however exact the instruments are
    """

    @property
    def middle(self) -> float: ...
    @property
    def span(self) -> float: ...
    @property
    def floor(self) -> float: ...

    def left(self, rate: float, offsets: Array) -> Array:
        """Return the share of the measurement that stays unexplained, for each of the offsets (m,) s.

        The times of the second instrument are multiplied by ``rate`` about ``middle``, and then moved.
        """
        ...


@dataclass(frozen=True)
class Pace:
    """The factor by which the times of the second instrument have to be multiplied to fit those of the first.

    Attributes
    ----------
    rate, sigma : the factor's logarithm and its standard deviation
    offset : s, to be added to its times in the middle of the stretch that was compared
    left, as_is : share of the measurement that stays unexplained at the best factor, and with the clocks as they are
    """

    rate: float
    sigma: float
    offset: float
    left: float
    as_is: float


def find_pace(comparison: Comparison) -> Pace:
    """Return the most probable rate between two clocks, and how well it is known.

    Errors of the prediction are taken to be normal, of the size that is left, and independent after half a second.
    """
    reach = min(_OFFSETS[0] + _OFFSETS[1] * comparison.span, _MOST_OFFSET)
    rates = np.arange(-_RATES, _RATES + 0.5 * _RATE_STEP, _RATE_STEP)
    rates -= rates[np.argmin(np.abs(rates))]  # none is among them
    offsets = np.arange(-reach, reach + 0.5 * _OFFSET_STEP, _OFFSET_STEP)
    left = _left(comparison, rates, offsets)
    row, column = np.unravel_index(int(np.argmin(left)), left.shape)
    as_is = float(np.min(left[np.argmin(np.abs(rates))]))
    _, spread, _ = _mean(comparison, rates, offsets, left)
    near_rates = rates[row] + np.linspace(-1.0, 1.0, _FINE) * max(_RATE_STEP, min(3.0 * spread, 0.1))
    near_offsets = offsets[column] + np.linspace(-1.0, 1.0, _FINE) * _FINE_OFFSET
    fine = _left(comparison, near_rates, near_offsets)
    rate, sigma, offset = _mean(comparison, near_rates, near_offsets, fine)
    # a second minimum far away is seen by the coarse grid alone
    return Pace(rate, float(np.hypot(max(sigma, spread if spread > _RATE_STEP else 0.0), comparison.floor)), offset,
                float(np.min(fine)), as_is)  # fmt: skip


def _left(comparison: Comparison, rates: Array, offsets: Array) -> Array:
    """Return what is left (k, m) at each rate, given by its logarithm, and each offset."""
    return np.stack([comparison.left(float(np.exp(rate)), offsets) for rate in rates])


def _mean(comparison: Comparison, rates: Array, offsets: Array, left: Array) -> tuple[float, float, float]:
    """Return mean and standard deviation of the rate, and the mean offset."""
    independent = comparison.span / _INDEPENDENT
    log_probability = -0.5 * independent * np.log(np.maximum(left, 1e-9))
    probability = np.exp(log_probability - np.max(log_probability))
    probability /= np.sum(probability)
    of_rates = np.sum(probability, axis=1)
    mean = float(of_rates @ rates)
    spread = float(np.sqrt(of_rates @ (rates - mean) ** 2))
    return mean, spread, float(np.sum(probability, axis=0) @ offsets)
