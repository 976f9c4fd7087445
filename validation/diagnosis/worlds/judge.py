"""A recording among simulated runs of it: what runs that look like it had hidden.

All is linear about the estimate with the finding in the model, where responses hold; the finding is then taken out.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from sssi_exudyn.core.frames import Array
from sssi_exudyn.fitting.evidence import Uncertain, whiten_columns
from sssi_exudyn.runtime.threads import one_ahead
from sssi_exudyn.validation.diagnosis.hypotheses.hypothesis import Hypothesis
from sssi_exudyn.validation.diagnosis.judgement import Judgement, SimilarWorld
from sssi_exudyn.validation.diagnosis.search.missing_force import gain_of, latent_covariance
from sssi_exudyn.validation.diagnosis.thresholds import Thresholds
from sssi_exudyn.validation.diagnosis.worlds.best_possible import BestPossible
from sssi_exudyn.validation.diagnosis.worlds.catalogue import UNLISTED, answers_of
from sssi_exudyn.validation.diagnosis.worlds.classifier import Classifier, learn
from sssi_exudyn.validation.diagnosis.worlds.drawn_worlds import Wanted, draw_worlds, known_of
from sssi_exudyn.validation.diagnosis.worlds.family import Unlisted
from sssi_exudyn.validation.diagnosis.worlds.features import Features
from sssi_exudyn.validation.diagnosis.worlds.geometry import Geometry

WORLD_SEED: Final = 4
"""Of the drawn worlds, and of what the classifier begins with."""
_AT_ONCE: Final = 2000
"""Worlds whose measurements are held together: those of a minute are a hundred megabytes."""
_WITHIN: Final = 1.5
_ERROR: Final = 3.0
"""Times, and standard errors more, by which worlds are weaker or stronger than what the recording has hidden at most;
the noise moves a strength by one."""
_FEWEST: Final = 20
"""Worlds of an answer from which it can be learned what they look like; of fewer it is not probable."""
_ANSWERS: Final = 2
"""Answers at least of which there are as many."""


@dataclass(frozen=True)
class Drawn:
    """D worlds of k answers, by what is kept of them.

    labels, table, forces : (D,) answers, (D, m) features and (D, 3·c) forces that do what the model lacks
    tried : (k,) worlds that were drawn for these;  best : what could be said of them
    """

    labels: NDArray[np.int_]
    table: Array
    forces: Array
    tried: Array
    best: BestPossible

    @property
    def enough(self) -> NDArray[np.int_]:
        """Return the answers of which there are enough to learn what they look like."""
        return np.flatnonzero(np.bincount(self.labels, minlength=len(self.tried)) >= _FEWEST)


@dataclass(frozen=True)
class TrainedWorlds:
    """A geometry whose worlds were drawn and learned.

    names : of the k answers;  learned : those of which there are enough worlds, as the classifier has them
    smooth : (3·c, N) makes a force of measurements
    best_possible : (k,) as in ``Judgement``
    """

    names: tuple[str, ...]
    learned: NDArray[np.int_]
    features: Features
    classifier: Classifier
    smooth: Array
    drawn: Drawn
    best_possible: Array


def train(
    geometry: Geometry,
    thresholds: Thresholds,
    hypotheses: Sequence[Hypothesis],
    unlisted: Sequence[Unlisted] = UNLISTED,
    seed: int = WORLD_SEED,
) -> TrainedWorlds:
    """Draw worlds of a run, as strong as what its recording has hidden, and learn what they look like.

    Where hardly any world is as strong, they are of any strength, and the recording is like none of them.
    """
    known, answers = known_of(geometry), answers_of(geometry, hypotheses, thresholds, unlisted)
    features, smooth = Features(geometry, known, thresholds), _smoother(geometry, known, thresholds)

    def draw(wanted: Wanted) -> Drawn:
        rng, best, tried = np.random.default_rng(seed), BestPossible(known, len(answers), seed), np.zeros(len(answers))
        labels, tables, forces = [], [], []
        counts = [min(_AT_ONCE, thresholds.worlds - first) for first in range(0, thresholds.worlds, _AT_ONCE)]
        for worlds in one_ahead(lambda count: draw_worlds(geometry, known, answers, count, rng, wanted), counts):
            best.add(worlds)
            labels.append(worlds.labels)
            tables.append(features(worlds.rest))
            forces.append((smooth @ worlds.rest).T)
            tried += worlds.tried
        return Drawn(np.concatenate(labels), np.concatenate(tables), np.concatenate(forces), tried, best)

    shown = shown_strengths(features, known.remove_from(known.residual[:, None]))
    drawn = draw(Wanted(features, thresholds.world_same, strengths_about(shown)))
    if len(drawn.enough) < _ANSWERS:
        drawn = draw(Wanted(features, thresholds.world_same))
    priors = np.array([answer.prior for answer in answers])
    learned, classifier = learn_answers(drawn.table, drawn.labels, drawn.tried, priors, seed)
    names = tuple(answer.name for answer in answers)
    return TrainedWorlds(names, learned, features, classifier, smooth, drawn, drawn.best.expected(priors))


def learn_answers(
    table: Array, labels: NDArray[np.int_], tried: Array, priors: Array, seed: int
) -> tuple[NDArray[np.int_], Classifier]:
    """Learn from features ``table`` (D, m) of worlds with ``labels`` (D,) those answers of which there are enough.

    tried : (k,) worlds that were drawn for these;  priors : (k,) of the answers

    Return the answers learned, and the classifier of these.
    """
    counts = np.bincount(labels, minlength=len(priors))
    learned = np.flatnonzero(counts >= _FEWEST)
    mine = np.isin(labels, learned)
    as_strong = priors * counts / np.maximum(tried, 1.0)
    return learned, learn(table[mine], np.searchsorted(learned, labels[mine]), as_strong[learned], seed)


def judge(trained: TrainedWorlds, geometry: Geometry, about: str) -> Judgement:
    """Return what the recording of a geometry looks like among its worlds, without the finding ``about``."""
    known, drawn = known_of(geometry), trained.drawn
    rest = known.remove_from(known.residual[:, None])
    features = trained.features(rest)
    probabilities = np.zeros(len(trained.names))
    probabilities[trained.learned] = trained.classifier.probabilities(features)[0]
    ranked = sorted(zip(trained.names, probabilities.tolist(), strict=True), key=lambda pair: -pair[1])
    nearest = int(np.argmin(trained.classifier.apart(features[0], drawn.table)))
    forces = trained.smooth @ rest[:, 0], drawn.forces[nearest]
    recorded, simulated = (force.reshape(geometry.shape).T for force in forces)
    possible = zip(trained.names, trained.best_possible.tolist(), strict=True)
    return Judgement(
        runs=int(np.sum(drawn.tried)),
        probabilities=dict(ranked),
        outside=float(trained.classifier.outside(features)[0]),
        best_possible={name: p for name, p in possible if np.isfinite(p)},
        similar=SimilarWorld(trained.names[drawn.labels[nearest]], recorded, simulated),
        about=about,
        edges=geometry.edges,
    )


def shown_strengths(features: Features, rest: Array) -> Array:
    """Return (D,) standard errors of what runs with the measurements ``rest`` (N, D) show to be hidden.

    A cause of strength s gains s²/2 of log evidence, but for what its search costs.
    """
    evidence = np.stack(list(features.evidence(rest).values()))
    return np.asarray(np.sqrt(2.0 * np.maximum(evidence.max(axis=0), 0.0)))


def strengths_about(shown: Array) -> tuple[float, float]:
    """Return standard errors at least and at most that what runs have hidden may have, which show ``shown`` (D,)."""
    return max(0.0, float(shown.min()) / _WITHIN - _ERROR), float(shown.max()) * _WITHIN + _ERROR


def _smoother(geometry: Geometry, known: Uncertain, thresholds: Thresholds) -> Array:
    """Return what makes a force (3·c, N) of measurements without what is uncertain; it has the prior of placebos."""
    white = whiten_columns(geometry.linear, geometry.levels, geometry.by_body)
    prior = latent_covariance(geometry.edges, *thresholds.usual_force, held=thresholds.cell)
    gain, _ = gain_of(prior, white.T @ known.remove_from(white), np.zeros(len(prior)))
    return np.asarray(gain @ white.T)
