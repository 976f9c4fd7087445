"""A recording among simulated runs of it: what runs that look like it had hidden."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from sssi_exudyn.fitting.evidence import LinearModel
from sssi_exudyn.validation.diagnosis.hypotheses.hypothesis import FittedRun, Hypothesis
from sssi_exudyn.validation.diagnosis.search.explanation import Round
from sssi_exudyn.validation.diagnosis.worlds.catalogue import UNLISTED, answers_of
from sssi_exudyn.validation.diagnosis.worlds.classifier import Classifier, learn
from sssi_exudyn.validation.diagnosis.worlds.drawn_worlds import draw_worlds, known_of
from sssi_exudyn.validation.diagnosis.worlds.family import Unlisted
from sssi_exudyn.validation.diagnosis.worlds.features import Features
from sssi_exudyn.validation.diagnosis.worlds.geometry import Geometry, geometry_of

WORLD_SEED: Final = 4
"""Of the drawn worlds, and of what the classifier begins with."""


_AT_ONCE: Final = 2000
"""Worlds whose measurements are held together: those of a minute are a hundred megabytes."""


@dataclass(frozen=True)
class Judgement:
    """What runs that look like a recording had hidden.

    runs : simulated
    probabilities : of each answer by its name, the most probable first
    outside : share of simulated runs that are farther from the middle of their kind than the recording
    """

    runs: int
    probabilities: dict[str, float]
    outside: float


@dataclass(frozen=True)
class TrainedWorlds:
    """A geometry whose worlds were drawn and learned: answers' names, features, classifier, and how many there were."""

    names: tuple[str, ...]
    features: Features
    classifier: Classifier
    runs: int


def train(
    geometry: Geometry,
    fitted: FittedRun,
    hypotheses: Sequence[Hypothesis],
    unlisted: Sequence[Unlisted] = UNLISTED,
    seed: int = WORLD_SEED,
) -> TrainedWorlds:
    """Draw worlds of a run and learn what they look like."""
    thresholds, known = fitted.thresholds, known_of(geometry)
    answers = answers_of(geometry, hypotheses, thresholds, unlisted)
    features, rng = Features(geometry, known, thresholds), np.random.default_rng(seed)
    tables, labels = [], []
    for first in range(0, thresholds.worlds, _AT_ONCE):
        count = min(_AT_ONCE, thresholds.worlds - first)
        worlds = draw_worlds(geometry, known, answers, count, rng)
        tables.append(features(worlds.rest))
        labels.append(worlds.labels)
    priors, every = np.array([answer.prior for answer in answers]), np.concatenate(labels)
    classifier = learn(np.concatenate(tables), every, priors, seed)
    return TrainedWorlds(tuple(answer.name for answer in answers), features, classifier, len(every))


def judge(trained: TrainedWorlds, geometry: Geometry) -> Judgement:
    """Return what the recording of a geometry looks like among its worlds."""
    known = known_of(geometry)
    features = trained.features(known.remove_from(known.residual[:, None]))
    probabilities = trained.classifier.probabilities(features)[0].tolist()
    ranked = sorted(zip(trained.names, probabilities, strict=True), key=lambda pair: -pair[1])
    return Judgement(trained.runs, dict(ranked), float(trained.classifier.outside(features)[0]))


def among_worlds(latest: Round, hypotheses: Sequence[Hypothesis], waves: float) -> Judgement:
    """Return what the recording of a round looks like among worlds about the round's estimate, under the noise of its
    most probable explanation.

    waves : m, usual height of the slope's own waves; 0 on a plane
    """
    linear: LinearModel = latest.linear
    levels = latest.explanations[0].levels
    geometry = geometry_of(linear, levels, latest.fitted, hypotheses, latest.responses, waves * levels.surface)
    return judge(train(geometry, latest.fitted, hypotheses), geometry)
