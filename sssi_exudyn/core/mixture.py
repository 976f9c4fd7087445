"""A number that is known otherwise under each of several explanations."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.optimize import brentq
from scipy.special import ndtr

from sssi_exudyn.core.frames import Array

_FARTHEST: Final = 8.0
"""Standard deviations beyond which nothing of a normal distribution is looked for."""


@dataclass(frozen=True)
class Mixture:
    """Normal distributions of a number under k explanations: probabilities (k,), means and standard deviations (k,)."""

    weights: Array
    means: Array
    sigmas: Array

    def below(self, value: float) -> float:
        """Return the probability that the number is less than ``value``."""
        return float(self.weights @ ndtr((value - self.means) / self.sigmas))

    def quantile(self, share: float) -> float:
        """Return the value below which the number is with that probability."""
        low, high = (self.means + side * _FARTHEST * self.sigmas for side in (-1.0, 1.0))
        first, last = float(np.min(low)), float(np.max(high))
        return float(brentq(lambda value: self.below(value) - share, first, last, xtol=1e-9 * (last - first)))

    @property
    def mean(self) -> float:
        """Averaged over the explanations."""
        return float(self.weights @ self.means)
