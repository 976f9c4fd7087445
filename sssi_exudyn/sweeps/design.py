"""The points of a sweep: grid, list, Latin hypercube, Sobol, and the designs for sensitivity indices."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final, Literal

import numpy as np

from sssi_exudyn.core.frames import Array
from sssi_exudyn.runtime.optional import import_for
from sssi_exudyn.sweeps.parameters import Parameter

Kind = Literal["grid", "list", "latin_hypercube", "sobol", "sobol_indices", "morris"]
LISTED: Final[tuple[Kind, ...]] = ("grid", "list")
"""Designs whose values are listed; the others draw values between two bounds."""
INDEXED: Final[tuple[Kind, ...]] = ("sobol_indices", "morris")
"""Designs that give sensitivity indices."""
KINDS: Final[tuple[Kind, ...]] = (*LISTED, "latin_hypercube", "sobol", *INDEXED)
MORRIS_LEVELS: Final = 4
"""Levels of Morris's grid, the usual choice (Saltelli et al., Global Sensitivity Analysis, 2008, ch. 3)."""


@dataclass(frozen=True)
class Axis:
    """One parameter of a sweep: its values, or for drawn designs its lowest and highest."""

    parameter: Parameter
    levels: tuple[float | str, ...]

    @property
    def name(self) -> str:
        return self.parameter.name


@dataclass(frozen=True)
class Design:
    """Kind and size of a sweep's layout of points.

    size : points of a drawn design; for indices Saltelli's base sample N, or Morris's trajectories
    """

    kind: Kind
    size: int
    seed: int


def points_of(design: Design, axes: Sequence[Axis]) -> list[tuple[float | str, ...]]:
    """Return the points in order, each a value for every axis; one empty point where there is no axis.

    Sobol's indices take N (2 d + 2) points, Morris's N (d + 1).  Raises SssiError where SALib is needed and missing.
    """
    if design.kind == "grid" or not axes:
        return list(itertools.product(*(axis.levels for axis in axes)))
    if design.kind == "list":
        return list(zip(*(axis.levels for axis in axes), strict=True))
    return [tuple(map(float, row)) for row in _draw(design, axes)]


def size_of(design: Design, axes: Sequence[Axis]) -> int:
    """Return the number of points."""
    match design.kind:
        case "grid":
            return math.prod(len(axis.levels) for axis in axes)
        case "list":
            return max((len(axis.levels) for axis in axes), default=1)
        case "latin_hypercube" | "sobol":
            return design.size
        case _:
            return design.size * block_of(design, len(axes))


def problem_of(axes: Sequence[Axis]) -> dict[str, Any]:
    """Return the axes in SALib's form."""
    bounds = [[float(axis.levels[0]), float(axis.levels[-1])] for axis in axes]
    return {"num_vars": len(axes), "names": [axis.name for axis in axes], "bounds": bounds}


def salib(what: str) -> Any:
    """Import SALib's module of that name, such as ``analyze.morris``.  Raises SssiError where it is not installed."""
    return import_for("sensitivity analysis", f"SALib.{what}", "sweep")


def block_of(design: Design, count: int) -> int:
    """Return the points of a block of a design for indices with ``count`` axes; an incomplete block is of no use."""
    return 2 * count + 2 if design.kind == "sobol_indices" else count + 1


def _draw(design: Design, axes: Sequence[Axis]) -> Array:
    """Draw the points (n, d) of a design."""
    problem = problem_of(axes)
    if design.kind == "sobol_indices":
        return np.asarray(salib("sample.sobol").sample(problem, design.size, seed=design.seed))
    if design.kind == "morris":
        sample = salib("sample.morris").sample
        return np.asarray(sample(problem, design.size, num_levels=MORRIS_LEVELS, seed=design.seed))
    from scipy.stats import qmc  # here: it takes most of a second to load, in every worker

    sampler: Any = qmc.LatinHypercube if design.kind == "latin_hypercube" else qmc.Sobol
    unit = sampler(len(axes), rng=np.random.default_rng(design.seed)).random(design.size)
    low, high = np.array(problem["bounds"]).T
    return np.asarray(low + (high - low) * unit)
