"""What a run looks like: some hundred numbers, mostly log evidence of causes, which a classifier reads.

Evidence is by likelihood alone, without temper, with places and sizes integrated.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from sssi_exudyn.core.frames import Array
from sssi_exudyn.fitting.evidence import Uncertain, log_factors, whiten_columns
from sssi_exudyn.validation.diagnosis.hypotheses.hypothesis import Candidate
from sssi_exudyn.validation.diagnosis.search.missing_force import DIRECTIONS, latent_covariance
from sssi_exudyn.validation.diagnosis.thresholds import Thresholds
from sssi_exudyn.validation.diagnosis.worlds.geometry import Geometry

_AT_ONCE: Final = 250
"""Worlds of which features are computed together: some hundred megabytes."""
_FORMS: Final = (0.25, 0.5)
"""Shares of its force by which a law's form may be wrong, each a feature next to that of the exact form."""
_FORM_MEMORY: Final = 1.0
_FORM_MODES: Final = 6
"""s for which that error stays the same, and modes of it that count."""
_MOST_BENT: Final = 60
"""Places of a law at most that have a wrong form, evenly of all."""
_UNSEEN: Final = 1e-9
"""Share of what the measurements know of a candidate's best-known amplitude below which an amplitude is not seen."""
_FOOT_MEMORIES: Final = (0.3, 2.0)
"""s; memories of a force on a foot."""


@dataclass(frozen=True)
class _Family:
    """One feature that is evidence: of c candidates with w amplitudes each, or of a force of any form as one candidate.

    columns : (N, c·w) in units of noise;  gram : (c, w, w) what the measurements know of the amplitudes
    sizes : by how many times amplitudes are usually larger
    limited : (l,) which amplitudes have limits;  limits : (c, l, 2) these, in usual sizes
    """

    name: str
    columns: Array
    gram: Array
    sizes: tuple[float, ...]
    limited: NDArray[np.int_] = field(default_factory=lambda: np.zeros(0, dtype=int))
    limits: Array = field(default_factory=lambda: np.zeros((1, 0, 2)))


class Features:
    """The features of runs with one geometry."""

    def __init__(self, geometry: Geometry, known: Uncertain, thresholds: Thresholds) -> None:
        self._blocks = geometry.linear.measurements.blocks
        laws = _laws(geometry, known, thresholds.sizes)
        listed = [law for law in laws if geometry.kinds.get(law.name, "unexplained") != "unexplained"]
        self._listed = len(listed)
        rest = [law for law in laws if law not in listed]
        self._families = [*listed, *rest, *_forms(geometry, known, thresholds)]

    @property
    def names(self) -> list[str]:
        """Names of the features, as ``__call__`` gives them."""
        evidence = [family.name for family in self._families]
        return [*evidence, *(f"behind {name}" for name in evidence), "most", "second", *(f"χ² {b}" for b in self._seen)]

    @property
    def _seen(self) -> list[str]:
        return [name for name, place in self._blocks.items() if place.stop > place.start]

    def evidence(self, rest: Array) -> dict[str, Array]:
        """Return log evidence (D,) over nothing of each cause and form, by name, from ``rest`` (N, D) as worlds have
        it.
        """
        return dict(zip((f.name for f in self._families), self._all(rest), strict=True))

    def explained(self, left: Array) -> Array:
        """Return (D,) strength² that the best candidate of a listed law or fault explains of what leaves ``left``
        (N, D) in the measurements next to all that is uncertain, with whatever amplitudes.
        """
        best = np.zeros(left.shape[1])
        for family in self._families[: self._listed]:
            known, axes = np.linalg.eigh(family.gram)
            pull = (family.columns.T @ left).reshape(*family.gram.shape[:2], -1)
            seen = 1.0 / np.maximum(known, _UNSEEN * known[:, -1:])
            gain = seen[:, None] @ (np.swapaxes(axes, 1, 2) @ pull) ** 2
            best = np.maximum(best, gain[:, 0].max(axis=0))
        return best

    def __call__(self, rest: Array) -> Array:
        """Return (D, features) of runs whose measurements are ``rest`` (N, D), as worlds have them."""
        evidence = self._all(rest)
        best = np.maximum(np.sort(evidence, axis=0)[-2:], 0.0)
        behind = evidence - best[-1]
        squares = [np.mean(rest[self._blocks[name]] ** 2, axis=0) for name in self._seen]
        table = [
            np.clip(evidence / 10.0, -1.0, 6.0),
            np.clip(behind / 12.0, -2.0, 0.0),
            np.log1p(best[::-1]),
            np.log(np.maximum(squares, 1e-9)),
        ]
        return np.vstack(table).T

    def _all(self, rest: Array) -> Array:
        parts = [
            np.stack([self._of(family, rest[:, first : first + _AT_ONCE]) for family in self._families])
            for first in range(0, rest.shape[1], _AT_ONCE)
        ]
        return np.concatenate([np.zeros((len(self._families), 0)), *parts], axis=1)

    def _of(self, family: _Family, rest: Array) -> Array:
        pull = (family.columns.T @ rest).reshape(*family.gram.shape[:2], -1)
        factors = log_factors(family.gram, pull, family.sizes)
        if len(family.limited):
            factors -= _beyond_limits(family, pull)
        # in place of SciPy's logsumexp, which also asks for signs, infinities and weights: half of all that this takes
        largest = factors.max(axis=(0, 1))
        factors -= largest
        return np.asarray(largest + np.log(np.mean(np.exp(factors, out=factors), axis=(0, 1))))


def _beyond_limits(family: _Family, pull: Array) -> Array:
    """Return (sizes, c, D) by how much less probable measurements with ``pull`` (c, w, D) are where the most probable
    amplitudes are beyond what is possible: half the squares of their standard deviations beyond it.
    """
    known, axes = np.linalg.eigh(0.5 * (family.gram + np.swapaxes(family.gram, 1, 2)))
    rotated, rows = np.swapaxes(axes, 1, 2) @ pull, axes[:, family.limited]
    low, high = np.moveaxis(family.limits, 2, 0)[..., None]
    cost = np.zeros((len(family.sizes), len(pull), pull.shape[2]))
    for i, size in enumerate(family.sizes):
        variances = size**2 / (1.0 + size**2 * np.maximum(known, 0.0))
        means = (rows * variances[:, None]) @ rotated
        beyond = np.maximum(np.maximum(low - means, means - high), 0.0)
        cost[i] = 0.5 * np.sum(beyond**2 / (rows**2 @ variances[..., None]), axis=1)
    return cost


def _laws(geometry: Geometry, known: Uncertain, sizes: tuple[float, ...]) -> list[_Family]:
    """Return the evidence of each hypothesis, over all its candidates."""
    families = []
    for name, candidates in geometry.candidates.items():
        columns = np.hstack([candidate.free.columns * candidate.free.scales for candidate in candidates])
        white = whiten_columns(geometry.linear, geometry.levels, columns)
        shape = len(white), len(candidates), -1
        left = known.remove_from(white)
        gram = np.einsum("nci,ncj->cij", white.reshape(shape), left.reshape(shape))
        limits = geometry.limits[name]
        limited = np.flatnonzero(np.any(np.isfinite(limits), axis=(0, 2)))
        families.append(_Family(name, white, gram, sizes, limited, limits[:, limited]))
        if geometry.kinds[name] == "physics":
            families += _bent(geometry, known, (name, candidates), sizes)
    return families


def _bent(
    geometry: Geometry, known: Uncertain, law: tuple[str, Sequence[Candidate]], sizes: tuple[float, ...]
) -> list[_Family]:
    """Return the evidence of a hypothesis whose law has nearly its form: each amplitude brings modes of the error."""
    name, candidates = law
    step = -(-len(candidates) // _MOST_BENT)
    some, limits = candidates[::step], geometry.limits[name][::step]
    limited = np.flatnonzero(np.any(np.isfinite(limits), axis=(0, 2)))
    exact = np.hstack([candidate.free.columns * candidate.free.scales for candidate in some])
    apart = np.abs(geometry.middles[:, None] - geometry.middles)
    variances, axes = np.linalg.eigh(np.exp(-apart / _FORM_MEMORY))
    modes = (axes * np.sqrt(variances))[:, : -_FORM_MODES - 1 : -1]
    force = (geometry.following @ exact).reshape(*geometry.shape, -1)
    changes = np.einsum("dca,cm->dcam", force, modes).reshape(force.shape[0] * force.shape[1], -1)
    by_mode = (geometry.by_body @ changes).reshape(*exact.shape, -1)
    families = []
    for share in _FORMS:
        columns = np.concatenate([exact[:, :, None], share * by_mode], axis=2).reshape(len(exact), -1)
        white = whiten_columns(geometry.linear, geometry.levels, columns)
        shape = len(white), len(some), -1
        gram = np.einsum("nci,ncj->cij", white.reshape(shape), known.remove_from(white).reshape(shape))
        first = (1 + _FORM_MODES) * limited  # each amplitude comes before the modes of its error
        families.append(_Family(f"{name} bent {share:g}", white, gram, sizes, first, limits[:, limited]))
    return families


def _forms(geometry: Geometry, known: Uncertain, thresholds: Thresholds) -> list[_Family]:
    """Return the evidence of a force of any form: on the body by direction and memory, on each foot by memory."""
    sizes, middles = thresholds.force_sizes, geometry.middles
    ways = {"any": np.ones(3), **dict(zip(DIRECTIONS, np.eye(3), strict=True))}
    families = []

    def add(name: str, columns: Array, ways: Array, memory: float) -> None:
        kept = np.repeat(ways, len(middles)) > 0.0
        lower = np.linalg.cholesky(latent_covariance(middles, 1.0, memory)[np.ix_(kept, kept)])
        white = whiten_columns(geometry.linear, geometry.levels, columns[:, kept] @ lower)
        gram = white.T @ known.remove_from(white)
        families.append(_Family(name, white, gram[None], sizes))

    for memory in thresholds.force_memories:
        for name, way in ways.items():
            add(f"{name} {memory:g} s", geometry.by_body, way, memory)
    if len(geometry.linear.measurements.windows):
        for foot, side in enumerate(("left", "right")):
            for memory in _FOOT_MEMORIES:
                add(f"{side} foot {memory:g} s", geometry.by_foot[foot], np.array([1.0, 1.0, 0.0]), memory)
    return families
