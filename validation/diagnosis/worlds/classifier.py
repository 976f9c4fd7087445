"""A classifier that has learned from worlds what their measurements look like.

Source: Bishop 2006, 4.3.4 (multinomial logistic regression); Saerens et al., Neural Computation 14 (2002) 21 (other
class frequencies).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.special import log_softmax
from sklearn.covariance import LedoitWolf
from sklearn.linear_model import LogisticRegression
from sklearn.preprocessing import StandardScaler
from threadpoolctl import threadpool_limits

from sssi_exudyn.core.frames import Array

_STRENGTH: Final = 0.1
"""Inverse of the penalty on the weights' squares."""
_ROUNDS: Final = 2000
"""Of the optimiser at most; with this penalty 160 to 600 were needed."""
_KEPT: Final = 5
"""One world in so many has no part in its kind's middle: by these it is known how far from it worlds are."""


@dataclass(frozen=True)
class Classifier:
    """Probabilities of answers from features.

    correction : (k,) log of the answers' priors over their shares among the worlds
    centres : (k, m) means of each answer's worlds, whitened by ``whitening`` (m, m)
    distances : (h,) of kept worlds from the nearest centre, sorted
    """

    scaler: StandardScaler
    regression: LogisticRegression
    correction: Array
    centres: Array
    whitening: Array
    distances: Array

    def log_probabilities(self, features: Array) -> Array:
        """Return (D, k) log probabilities of the answers, from features (D, m)."""
        with threadpool_limits(1):
            logits = self.regression.predict_log_proba(self.scaler.transform(features))
        return np.asarray(log_softmax(logits + self.correction, axis=1))

    def probabilities(self, features: Array) -> Array:
        """Return (D, k) probabilities of the answers, from features (D, m)."""
        return np.asarray(np.exp(self.log_probabilities(features)))

    def outside(self, features: Array) -> Array:
        """Return (D,) the share of worlds that are farther from the middle of their answer's worlds."""
        far = _distances(self.scaler.transform(features) @ self.whitening, self.centres)
        beyond = len(self.distances) - np.searchsorted(self.distances, far, side="left")
        return np.asarray((1.0 + beyond) / (1.0 + len(self.distances)))

    def apart(self, one: Array, features: Array) -> Array:
        """Return (D,) distances of ``features`` (D, m) from ``one`` (m,), in the spread that worlds of a kind have."""
        both = self.scaler.transform(np.vstack([one, features])) @ self.whitening
        return np.asarray(np.linalg.norm(both[1:] - both[0], axis=1))


def learn(features: Array, labels: NDArray[np.int_], priors: Array, seed: int) -> Classifier:
    """Learn from worlds: features (D, m) and labels (D,) below k; ``priors`` (k,) of the answers."""
    scaler, answers = StandardScaler().fit(features), np.arange(len(priors))
    table = scaler.transform(features)
    with threadpool_limits(1):  # the same rounding on every machine of a kind, and no wait for other threads
        regression = LogisticRegression(C=_STRENGTH, max_iter=_ROUNDS).fit(table, labels)
    kept = _kept(labels, np.random.default_rng(seed))
    rest, of_rest = table[~kept], labels[~kept]
    centres = np.stack([rest[of_rest == answer].mean(axis=0) for answer in answers])
    sizes, axes = np.linalg.eigh(LedoitWolf(assume_centered=True).fit(rest - centres[of_rest]).covariance_)
    whitening = axes / np.sqrt(sizes)
    distances = np.sort(_distances(table[kept] @ whitening, centres @ whitening))
    shares = np.bincount(labels, minlength=len(priors)) / len(labels)
    correction = np.log(priors / priors.sum()) - np.log(shares)
    return Classifier(scaler, regression, correction, centres @ whitening, whitening, distances)


def _kept(labels: NDArray[np.int_], rng: np.random.Generator) -> NDArray[np.bool_]:
    """Return which worlds have no part in the middles: one in ``_KEPT`` of each answer."""
    held = np.zeros(len(labels), dtype=bool)
    for label in np.unique(labels):
        mine = rng.permutation(np.flatnonzero(labels == label))
        held[mine[_KEPT - 1 :: _KEPT]] = True
    return held


def _distances(points: Array, centres: Array) -> Array:
    """Return (D,) distances of points (D, m) from the nearest of centres (k, m)."""
    squares = np.sum(points**2, axis=1)[:, None] - 2.0 * points @ centres.T + np.sum(centres**2, axis=1)
    return np.asarray(np.sqrt(np.maximum(np.min(squares, axis=1), 0.0)))
