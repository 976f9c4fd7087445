"""From log evidence to probabilities: priors of the hypotheses, and what evidence is worth when no model is exact."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.optimize import brentq
from scipy.stats import norm

from sssi_exudyn.core.frames import Array
from sssi_exudyn.validation.diagnosis.hypotheses.catalogue import BY_NAME

SIZES: Final = (0.5, 1.0, 2.0)
"""An effect may be weaker or stronger than usual; each counts a third."""
NOTHING: Final = 0.5
"""Prior probability that nothing is missing."""
NATURAL: Final = 0.2
"""Share of natural slopes that have a roll, or steepen, as their waves do not foresee: these stand in groups, and are
no Gaussian process.  Of 20 blind runs with no roll hidden, four had one of log evidence 2.8 to 11.3.
"""
STANDS_OUT: Final = 0.2
"""Probability of nothing missing above which there is no finding."""
SHAPELESS: Final = 150.0
"""Log evidence that an effect brings from which its exact form, which nobody knows, matters more than the noise: there
the difference between two names counts for half.
"""
TEMPER: Final = 0.6
"""Log evidence counts for this share: the world is none of our models, and errors that none of them knows make
differences look more certain than they are.  Calibrated by the blind benchmark.
"""
SPREAD: Final = TEMPER**-0.5
"""What a standard deviation counts for: what errors that no model knows take from the evidence widens intervals."""
INTERVAL_90: Final = 1.6449 * SPREAD
"""Standard deviations to either side that hold the true number in nine of ten cases."""


_FARTHEST: Final = 8.0
"""Standard deviations beyond which nothing of a normal distribution is looked for."""


@dataclass(frozen=True)
class Mixture:
    """A number that is known otherwise under each of k explanations: probabilities (k,), means and standard deviations
    (k,).
    """

    weights: Array
    means: Array
    sigmas: Array

    def quantile(self, share: float) -> float:
        """Below which the number is with that probability."""

        def beyond(value: float) -> float:
            return float(self.weights @ norm.cdf((value - self.means) / self.sigmas)) - share

        low, high = (self.means + side * _FARTHEST * self.sigmas for side in (-1.0, 1.0))
        return float(brentq(beyond, np.min(low), np.max(high), xtol=1e-9 * float(np.max(high) - np.min(low))))

    @property
    def mean(self) -> float:
        """Averaged over the explanations."""
        return float(self.weights @ self.means)


def probabilities(
    names: Sequence[str],
    log_evidence: Array,
    explained: float = 0.0,
    log_natural: Array | None = None,
    unlisted: Mapping[str, float] | None = None,
) -> Array:
    """Posterior probabilities (…,) of hypotheses by their names, "" for nothing.

    Differences of log evidence count less than they are (``TEMPER``), and less still the more there is to explain
    (``SHAPELESS``).  What was ``explained`` (log evidence) by earlier findings makes nothing more probable: the
    residual of a strong effect is partly its own form, which nobody knows.

    With ``log_natural``, the density of each one's size were it the slope's own over that were it not, what shapes the
    snow may be the slope's own: then nothing is missing, as the surface has it.  ``unlisted`` are weights of names that
    are no hypothesis'.
    """
    weights = {name: BY_NAME[name].weight for name in names if name in BY_NAME} | dict(unlisted or {})
    whole = sum(weights[name] for name in names if name)
    shares = [(1.0 - NOTHING) * weights[name] / whole if name else NOTHING for name in names]
    nothing = list(names).index("")
    behind = TEMPER * (np.max(log_evidence) - log_evidence)
    gain = float(np.max(log_evidence) - log_evidence[nothing])
    shapeless = np.full(len(behind), 1.0 + gain / SHAPELESS)
    shapeless[nothing] += explained / SHAPELESS
    logs = np.log(shares) - behind / shapeless
    if log_natural is not None:
        own = np.log(NATURAL * NOTHING) - behind / shapeless + log_natural
        logs[nothing] = np.logaddexp.reduce([logs[nothing], *own])
    odds = np.exp(logs - logs.max())
    return np.asarray(odds / odds.sum())
