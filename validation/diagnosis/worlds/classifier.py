"""A classifier that has learned from worlds what their measurements look like.

Source: Bishop 2006, 4.3 and 5.1 (networks as posterior probabilities); Guo et al., ICML 2017 (temperature); Saerens et
al., Neural Computation 14 (2002) 21 (other class frequencies).
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar
from scipy.special import log_softmax
from sklearn.covariance import LedoitWolf
from sklearn.exceptions import ConvergenceWarning
from sklearn.neural_network import MLPClassifier
from sklearn.preprocessing import StandardScaler
from threadpoolctl import threadpool_limits

from sssi_exudyn.core.frames import Array

_LAYERS: Final = (96, 64)
_NETWORKS: Final = 2
_ROUNDS: Final = 30
_BATCH: Final = 128
_PENALTY: Final = 3e-3
"""Of the networks' weights."""
_KEPT: Final = 5
"""One world in so many is kept from the training, for temperature and the cloud's edge."""


@dataclass(frozen=True)
class Classifier:
    """Probabilities of answers from features.

    correction : (k,) log of the answers' priors over their shares among the worlds
    temperature : by which logits are divided
    centres : (k, m) means of each answer's worlds, whitened by ``whitening`` (m, m)
    distances : (h,) of kept worlds from the nearest centre, sorted
    """

    scaler: StandardScaler
    networks: tuple[MLPClassifier, ...]
    correction: Array
    temperature: float
    centres: Array
    whitening: Array
    distances: Array

    def log_probabilities(self, features: Array) -> Array:
        """Return (D, k) log probabilities of the answers, from features (D, m)."""
        return np.asarray(log_softmax(self._logits(features) / self.temperature + self.correction, axis=1))

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

    def _logits(self, features: Array) -> Array:
        scaled = self.scaler.transform(features)
        with threadpool_limits(1):
            return np.asarray(np.mean([network.predict_log_proba(scaled) for network in self.networks], axis=0))


def learn(features: Array, labels: NDArray[np.int_], priors: Array, seed: int) -> Classifier:
    """Learn from worlds: features (D, m) and labels (D,) below k; ``priors`` (k,) of the answers."""
    held = _kept(labels, np.random.default_rng(seed))
    scaler = StandardScaler().fit(features[~held])
    table, known = scaler.transform(features), np.arange(len(priors))
    with threadpool_limits(1):  # the same rounding on every machine of a kind, and no wait for other threads
        networks = tuple(_train(table[~held], labels[~held], seed + k) for k in range(_NETWORKS))
        logits = np.mean([network.predict_log_proba(table[held]) for network in networks], axis=0)
    at, mine = np.arange(len(logits)), labels[held]

    def loss(log_temperature: float) -> float:
        return -float(np.mean(log_softmax(logits / np.exp(log_temperature), axis=1)[at, mine]))

    temperature = float(np.exp(minimize_scalar(loss, bounds=(-1.0, 1.5), method="bounded").x))
    shares = np.array([np.mean(labels == k) for k in known])
    centres = np.stack([table[~held][labels[~held] == k].mean(axis=0) for k in known])
    within = LedoitWolf(assume_centered=True).fit(table[~held] - centres[labels[~held]])
    sizes, axes = np.linalg.eigh(within.covariance_)
    whitening = axes / np.sqrt(sizes)
    distances = np.sort(_distances(table[held] @ whitening, centres @ whitening))
    correction = np.log(priors / priors.sum()) - np.log(shares)
    return Classifier(scaler, networks, correction, temperature, centres @ whitening, whitening, distances)


def _kept(labels: NDArray[np.int_], rng: np.random.Generator) -> NDArray[np.bool_]:
    """Return which worlds are kept from the training: one in ``_KEPT`` of each answer."""
    held = np.zeros(len(labels), dtype=bool)
    for label in np.unique(labels):
        mine = rng.permutation(np.flatnonzero(labels == label))
        held[mine[_KEPT - 1 :: _KEPT]] = True
    return held


def _train(table: Array, labels: NDArray[np.int_], seed: int) -> MLPClassifier:
    network = MLPClassifier(
        _LAYERS, alpha=_PENALTY, batch_size=_BATCH, learning_rate_init=2e-3, max_iter=_ROUNDS, random_state=seed,
        tol=0.0, n_iter_no_change=_ROUNDS,
    )  # fmt: skip
    with warnings.catch_warnings():  # the last round ends it, which is no fault
        warnings.simplefilter("ignore", ConvergenceWarning)
        return network.fit(table, labels)


def _distances(points: Array, centres: Array) -> Array:
    """Return (D,) distances of points (D, m) from the nearest of centres (k, m)."""
    squares = np.sum(points**2, axis=1)[:, None] - 2.0 * points @ centres.T + np.sum(centres**2, axis=1)
    return np.asarray(np.sqrt(np.maximum(np.min(squares, axis=1), 0.0)))
