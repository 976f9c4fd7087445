"""What a run looks like: some hundred numbers, mostly log evidence of causes, which a classifier reads.

Evidence is by likelihood alone, without temper, with places and sizes integrated.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from sssi_exudyn.core.frames import Array
from sssi_exudyn.fitting.evidence import Information, Uncertain, products_by_candidate, usual_columns, whiten_columns
from sssi_exudyn.validation.diagnosis.search.form_error import share_modes
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
_FAINT: Final = 1e-13
"""Share of the largest of a basis' variances below which it is rounding."""
_FOOT_MEMORIES: Final = (0.3, 2.0)
"""s; memories of a force on a foot."""


@dataclass(frozen=True)
class _Family(ABC):
    """One feature that is evidence: of c candidates with w amplitudes each, or of a force of any form as one candidate.

    information : what the measurements know of the amplitudes
    sizes : by how many times amplitudes are usually larger
    limits : (c, w, 2) of the amplitudes, in usual sizes
    """

    name: str
    information: Information
    sizes: tuple[float, ...]
    limits: Array

    @abstractmethod
    def along(self, rest: Array, pushed: Array) -> Array:
        """Return (c, w, D) how much runs pull amplitudes along the axes of what is known of them.

        rest : (N, D) their measurements, as worlds have them
        pushed : (9·cells, D) how much these pull newtons at the centre of mass, on the left and on the right foot
        """


@dataclass(frozen=True)
class _LawFamily(_Family):
    """The evidence of a law or fault, whose c·w amplitudes move the measurements by ``basis`` (N, r) times ``mix``
    (r, c·w), in units of noise.
    """

    basis: Array
    mix: Array

    def along(self, rest: Array, pushed: Array) -> Array:
        pull = self.mix.T @ (self.basis.T @ rest)
        return self.information.along(pull.reshape(*self.information.known.shape, -1))


@dataclass(frozen=True)
class _BentFamily(_Family):
    """The evidence of a law whose form is wrong by some share: each of its a amplitudes brings m modes of that error.

    columns : (N, c·a) of the exact law;  modes : (3·cells, c·a·m) N at the centre of mass
    """

    columns: Array
    modes: Array

    def along(self, rest: Array, pushed: Array) -> Array:
        """Return the same, where each amplitude comes before its modes."""
        exact = (self.columns.T @ rest).reshape(self.columns.shape[1], 1, -1)
        by_mode = (self.modes.T @ pushed[: len(self.modes)]).reshape(len(exact), -1, rest.shape[1])
        pull = np.concatenate([exact, by_mode], axis=1)
        return self.information.along(pull.reshape(*self.information.known.shape, -1))


@dataclass(frozen=True)
class _FormFamily(_Family):
    """The evidence of a force of any form.

    rows : which newtons it has;  modes : (rows, w) N of them, a usual size each
    """

    rows: NDArray[np.int_]
    modes: Array

    def along(self, rest: Array, pushed: Array) -> Array:
        return self.information.along((self.modes.T @ pushed[self.rows])[None])


class Features:
    """The features of runs with one geometry."""

    def __init__(self, geometry: Geometry, known: Uncertain, thresholds: Thresholds) -> None:
        self._blocks = geometry.linear.measurements.blocks
        newtons = np.hstack([geometry.by_body, *geometry.by_foot])
        self._by_force = whiten_columns(geometry.linear, geometry.levels, newtons)
        laws = _laws(geometry, known, self._by_force[:, : geometry.by_body.shape[1]], thresholds.sizes)
        listed = [law for law in laws if geometry.kinds.get(law.name, "unexplained") != "unexplained"]
        self._listed = len(listed)
        rest = [law for law in laws if law not in listed]
        self._families = [*listed, *rest, *_forms(geometry, known, self._by_force, thresholds)]

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

    def explained(self, left: Array, without: str = "") -> Array:
        """Return (D,) strength² that the best candidate of a listed law or fault explains of what leaves ``left``
        (N, D) in the measurements next to all that is uncertain, with whatever amplitudes; all laws but ``without``.
        """
        best = np.zeros(left.shape[1])
        for family in self._families[: self._listed]:
            if family.name == without:
                continue
            known = family.information.known
            seen = 1.0 / np.maximum(known, _UNSEEN * known[:, -1:])
            gain = seen[:, None] @ family.along(left, self._pushed(left)) ** 2
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
        parts = [np.zeros((len(self._families), 0))]
        for first in range(0, rest.shape[1], _AT_ONCE):
            some = rest[:, first : first + _AT_ONCE]
            pushed = self._pushed(some)
            parts.append(np.stack([self._of(family, some, pushed) for family in self._families]))
        return np.concatenate(parts, axis=1)

    def _pushed(self, rest: Array) -> Array:
        return np.asarray(self._by_force.T @ rest)

    def _of(self, family: _Family, rest: Array, pushed: Array) -> Array:
        along = family.along(rest, pushed)
        factors = family.information.log_factors(along, family.sizes)
        if np.any(np.isfinite(family.limits)):
            factors -= _beyond_limits(family, along)
        # in place of SciPy's logsumexp, which also asks for signs, infinities and weights: half of all that this takes
        largest = factors.max(axis=(0, 1))
        factors -= largest
        return np.asarray(largest + np.log(np.mean(np.exp(factors, out=factors), axis=(0, 1))))


def _beyond_limits(family: _Family, along: Array) -> Array:
    """Return (sizes, c, D) by how much less probable measurements with a pull ``along`` (c, w, D) are where the most
    probable amplitudes are beyond what is possible: half the squares of their standard deviations beyond it.
    """
    limited = np.flatnonzero(np.any(np.isfinite(family.limits), axis=(0, 2)))
    rows = family.information.axes[:, limited]
    low, high = np.moveaxis(family.limits[:, limited], 2, 0)[..., None]
    cost = np.zeros((len(family.sizes), len(along), along.shape[2]))
    for i, size in enumerate(family.sizes):
        variances = size**2 / (1.0 + size**2 * family.information.known)
        means = (rows * variances[:, None]) @ along
        beyond = np.maximum(np.maximum(low - means, means - high), 0.0)
        cost[i] = 0.5 * np.sum(beyond**2 / (rows**2 @ variances[..., None]), axis=1)
    return cost


def _laws(geometry: Geometry, known: Uncertain, by_body: Array, sizes: tuple[float, ...]) -> list[_Family]:
    """Return the evidence of each hypothesis, over all its candidates, and of laws that have nearly its form.

    by_body : (N, 3·cells) what a newton at the centre of mass does, in units of noise
    """
    families: list[_Family] = []
    for name, candidates in geometry.candidates.items():
        usual = usual_columns([candidate.free for candidate in candidates])
        shape, columns = usual.shape, usual.reshape(len(usual), -1)
        white = whiten_columns(geometry.linear, geometry.levels, columns)
        left = known.remove_from(white)
        gram = products_by_candidate(white.reshape(shape), left.reshape(shape))
        law = _LawFamily(name, Information(gram), sizes, geometry.limits[name], *_factors(white))
        families.append(law)
        if geometry.kinds[name] == "physics":
            step = -(-len(candidates) // _MOST_BENT)
            places, column = np.arange(0, len(candidates), step), np.arange(columns.shape[1]).reshape(shape[1:])
            at = column[places].ravel()
            some = replace(law, limits=law.limits[places])
            families += _bent(geometry, known, by_body, some, columns[:, at], white[:, at])
    return families


def _factors(columns: Array) -> tuple[Array, Array]:
    """Return a basis (N, r) and the mix (r, c) that make ``columns`` (N, c).

    Places of a law are put together from few cells, so that thousands of columns have a basis of some hundred.
    """
    size, count = columns.shape
    if count <= size:
        return columns, np.eye(count)
    squares, axes = np.linalg.eigh(columns @ columns.T)
    basis = axes[:, squares > _FAINT * squares[-1]]
    return basis, basis.T @ columns


def _bent(
    geometry: Geometry, known: Uncertain, by_body: Array, law: _LawFamily, moved: Array, columns: Array
) -> list[_Family]:
    """Return the evidence of a law at some of its places, whose amplitudes do what is ``moved`` (N, c·a), in units of
    noise ``columns``, with errors of its form.
    """
    count, exact = len(law.limits), moved.shape[1]
    modes = share_modes(geometry.middles, _FORM_MEMORY)[:, :_FORM_MODES]
    force = (geometry.following @ moved).reshape(*geometry.shape, -1)
    changes = np.einsum("dca,cm->dcam", force, modes).reshape(by_body.shape[1], exact, -1)
    limits = np.full((exact, 1 + modes.shape[1], 2), [-np.inf, np.inf])
    limits[:, 0] = law.limits.reshape(exact, 2)
    families: list[_Family] = []
    for share in _FORMS:
        by_mode = (by_body @ (share * changes).reshape(by_body.shape[1], -1)).reshape(len(by_body), exact, -1)
        white = np.concatenate([columns[:, :, None], by_mode], axis=2).reshape(len(by_body), count, -1)
        left = known.remove_from(white.reshape(len(white), -1)).reshape(white.shape)
        information = Information(products_by_candidate(white, left))
        families.append(
            _BentFamily(
                f"{law.name} bent {share:g}",
                information,
                law.sizes,
                limits.reshape(count, -1, 2),
                columns,
                share * changes.reshape(by_body.shape[1], -1),
            )
        )
    return families


def _forms(geometry: Geometry, known: Uncertain, by_force: Array, thresholds: Thresholds) -> list[_Family]:
    """Return the evidence of a force of any form: on the body by direction and memory, on each foot by memory.

    by_force : (N, 9·cells) what newtons on the body and on each foot do, in units of noise
    """
    sizes, edges = thresholds.force_sizes, geometry.edges
    newtons = geometry.by_body.shape[1]
    ways = {"any": np.ones(3), **dict(zip(DIRECTIONS, np.eye(3), strict=True))}
    families: list[_Family] = []

    def add(name: str, first: int, ways: Array, memory: float) -> None:
        kept = np.flatnonzero(np.repeat(ways, len(edges) - 1))
        covariance = latent_covariance(edges, 1.0, memory, thresholds.cell)[np.ix_(kept, kept)]
        lower = np.asarray(np.linalg.cholesky(covariance), dtype=np.float64)
        white = by_force[:, first + kept] @ lower
        gram = white.T @ known.remove_from(white)
        unlimited = np.full((1, len(gram), 2), [-np.inf, np.inf])
        families.append(_FormFamily(name, Information(gram[None]), sizes, unlimited, first + kept, lower))

    for memory in thresholds.force_memories:
        for name, way in ways.items():
            add(f"{name} {memory:g} s", 0, way, memory)
    if len(geometry.linear.measurements.windows):
        for foot, side in enumerate(("left", "right")):
            for memory in _FOOT_MEMORIES:
                add(f"{side} foot {memory:g} s", (1 + foot) * newtons, np.array([1.0, 1.0, 0.0]), memory)
    return families
