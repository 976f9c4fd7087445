"""What the best possible method could say: Bayes' rule on the worlds' own shapes.

A world has the measurements y = c d + e, with d what its cause does, c near one, and e noise with all that is
uncertain.  A method that knows the shapes d of all answers, and how often they are drawn, has the probability

    p(answer | y) ∝ Σ_d p(d) ∫ p(y | c d) p(c) dc

A world's own shape is left out of the sum: no method knows it.  Of finitely many shapes none is exactly another's, so
the figure is too low rather than too high.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp

from sssi_exudyn.core.frames import Array
from sssi_exudyn.fitting.evidence import Uncertain
from sssi_exudyn.validation.diagnosis.worlds.drawn_worlds import Worlds

SPREAD: Final = 0.3
"""Standard deviation of c: a shape stands for those of nearly its size."""
_RUNS: Final = 40
"""Runs of an answer at most over which its probability is averaged: the mean is known to some 0.06."""


class BestPossible:
    """Runs of some worlds, weighed by the shapes of these and of others."""

    def __init__(self, known: Uncertain, answers: int, seed: int) -> None:
        """Begin without worlds; ``known`` is all that is uncertain."""
        self._known, self._rng = known, np.random.default_rng(seed)
        self._counts, self._tried = np.zeros(answers), np.zeros(answers)
        self._seen: Array | None = None
        self._labels = np.zeros(0, dtype=int)
        self._logs = np.zeros((answers, 0))

    def add(self, worlds: Worlds) -> None:
        """Count the shapes of worlds; runs of the first ones are what is weighed."""
        own = np.zeros(0, dtype=int)
        if self._seen is None:
            own = self._choose(worlds)
            self._seen = self._observe(worlds.moved[:, own])
            self._labels, self._logs = worlds.labels[own], np.full((len(self._counts), len(own)), -np.inf)
        left = self._known.remove_from(worlds.moved)
        logs = log_shape_factors(left.T @ self._seen, np.sum(worlds.moved * left, axis=0)[:, None])
        logs[own, np.arange(len(own))] = -np.inf
        for k in np.unique(worlds.labels):
            self._logs[k] = np.logaddexp(self._logs[k], logsumexp(logs[worlds.labels == k], axis=0))
        self._counts += np.bincount(worlds.labels, minlength=len(self._counts))
        self._tried += worlds.tried

    def expected(self, priors: Array) -> Array:
        """Return (k,) the probability of each answer on average over its own runs, were ``priors`` (k,) theirs
        beforehand; NaN of an answer with fewer than two shapes.
        """
        own = self._counts[self._labels]
        with np.errstate(divide="ignore"):
            logs = self._logs + np.log(priors / np.maximum(self._tried, 1.0))[:, None]
            logs[self._labels, np.arange(len(own))] += np.log(own / np.maximum(own - 1.0, 1.0))
        total = logsumexp(logs, axis=0)
        right = np.exp(logs[self._labels, np.arange(len(own))] - total)
        return np.array(
            [
                np.mean(right[self._labels == k]) if count > 1.0 and np.any(self._labels == k) else np.nan
                for k, count in enumerate(self._counts)
            ]
        )

    def _choose(self, worlds: Worlds) -> NDArray[np.int_]:
        """Return which worlds are observed: some of each answer."""
        answers = range(len(self._counts))
        return np.concatenate([self._rng.permutation(np.flatnonzero(worlds.labels == k))[:_RUNS] for k in answers])

    def _observe(self, moved: Array) -> Array:
        """Return what would be measured (N, runs), in units of noise, where a cause does ``moved``."""
        noise = self._rng.standard_normal(moved.shape)
        amounts = self._rng.standard_normal((self._known.columns.shape[1], moved.shape[1]))
        return np.asarray(moved + noise + self._known.columns @ amounts)


def log_shape_factors(pull: Array, known: Array) -> Array:
    """Return log Bayes factors of shapes against none by their ``pull``, their size c integrated."""
    precision = 1.0 + SPREAD**2 * known
    return np.asarray(pull - 0.5 * known + 0.5 * SPREAD**2 * (pull - known) ** 2 / precision - 0.5 * np.log(precision))
