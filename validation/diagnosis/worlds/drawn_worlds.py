"""Draws of measurements in worlds with known causes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from sssi_exudyn.core.frames import Array
from sssi_exudyn.fitting.evidence import Uncertain, uncertain, whiten_columns
from sssi_exudyn.validation.diagnosis.search.drawn_noise import draw_instrument_noise
from sssi_exudyn.validation.diagnosis.worlds.catalogue import NOT_IN_THE_LIST, Answer
from sssi_exudyn.validation.diagnosis.worlds.features import Features
from sssi_exudyn.validation.diagnosis.worlds.geometry import Geometry

_MOST_TRIED: Final = 10
"""Worlds of an answer that are drawn at most for one that is wanted."""
_PARTS: Final = 4
"""Share of an answer's worlds, one in so many, that are drawn together at least."""


@dataclass(frozen=True)
class Worlds:
    """D worlds of a run.

    labels : (D,) index of the answer that each is an example of
    moved : (N, D) what is hidden does to their measurements, in units of noise
    rest : (N, D) their measurements, in units of noise, without what is uncertain
    strength : (D,) standard errors of what is hidden, by all that the measurements say of it
    tried : (k,) worlds of each answer that were drawn for these
    """

    labels: NDArray[np.int_]
    moved: Array
    rest: Array
    strength: Array
    tried: NDArray[np.int_]


@dataclass(frozen=True)
class Wanted:
    """Which of the worlds that are drawn count.

    laws, same : a cause that no law describes differs from all laws by more than this share of its standard errors
    strengths : standard errors at least and at most of what is hidden
    """

    laws: Features
    same: float
    strengths: tuple[float, float] = (0.0, np.inf)

    def chosen(self, left: Array, strength: Array, *, listed: bool) -> NDArray[np.int_]:
        """Return which of worlds count whose hidden causes leave ``left`` (N, D) and have ``strength`` (D,)."""
        low, high = self.strengths
        kept = np.flatnonzero((strength >= low) & (strength <= high))
        if listed:
            return kept
        # what no law describes, but does what a law does, is a right example of that law's name
        apart = strength[kept] ** 2 - self.laws.explained(left[:, kept])
        return np.asarray(kept[apart > (self.same * strength[kept]) ** 2])


def draw_worlds(
    geometry: Geometry,
    known: Uncertain,
    answers: Sequence[Answer],
    count: int,
    rng: np.random.Generator,
    wanted: Wanted,
) -> Worlds:
    """Draw about ``count`` worlds that are ``wanted``, of each answer its share; the uncertain is ``known`` at the
    geometry's levels.  Of an answer of which few are wanted there are fewer.
    """
    ends = np.round(np.cumsum([0.0, *(answer.share for answer in answers)]) * count).astype(int)
    drawn = [
        _draw_wanted(geometry, known, answer, share, rng, wanted)
        for answer, share in zip(answers, np.diff(ends).tolist(), strict=True)
    ]
    labels = np.repeat(np.arange(len(answers)), [moved.shape[1] for moved, _ in drawn])
    worlds = observe(geometry, known, labels, np.hstack([moved for moved, _ in drawn]), rng)
    return replace(worlds, tried=np.array([tried for _, tried in drawn]))


def _draw_wanted(
    geometry: Geometry, known: Uncertain, answer: Answer, count: int, rng: np.random.Generator, wanted: Wanted
) -> tuple[Array, int]:
    """Return what worlds of an answer do (N, about ``count``), and how many were tried for these."""
    families, listed = answer.families, answer.name != NOT_IN_THE_LIST
    kept, have, tried = [np.zeros((len(geometry.linear.residual), 0))], 0, 0
    while have < count and tried < _MOST_TRIED * count:
        more = min(max(count - have, count // _PARTS), _MOST_TRIED * count - tried)
        turns = range(tried, tried + more)
        moved = np.stack([families[k % len(families)].draw(rng, geometry) for k in turns], axis=1)
        left, strength = _left_of(geometry, known, moved)[1:]
        kept.append(moved[:, wanted.chosen(left, strength, listed=listed)])
        have, tried = have + kept[-1].shape[1], tried + more
    return np.hstack(kept), tried


def observe(
    geometry: Geometry, known: Uncertain, labels: NDArray[np.int_], moved: Array, rng: np.random.Generator
) -> Worlds:
    """Return worlds in which measurements are ``moved`` (N, D), with noise and all that is uncertain drawn."""
    linear, levels = geometry.linear, geometry.levels
    white, _, strength = _left_of(geometry, known, moved)
    seen = white + known.columns @ rng.standard_normal((known.columns.shape[1], len(labels)))
    seen += draw_instrument_noise(linear, levels, len(labels), rng)
    return Worlds(labels, white, known.remove_from(seen), strength, np.bincount(labels))


def _left_of(geometry: Geometry, known: Uncertain, moved: Array) -> tuple[Array, Array, Array]:
    """Return what is ``moved`` (N, D) in units of noise, what is left of it next to all that is uncertain, both (N, D),
    and its standard errors (D,).
    """
    white = whiten_columns(geometry.linear, geometry.levels, moved)
    left = known.remove_from(white)
    return white, left, np.asarray(np.sqrt(np.maximum(np.sum(white * left, axis=0), 0.0)))


def known_of(geometry: Geometry) -> Uncertain:
    """Return all that is uncertain of a run, at the levels of its worlds."""
    return uncertain(geometry.linear, geometry.levels)
