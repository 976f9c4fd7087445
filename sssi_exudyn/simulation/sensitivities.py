"""Derivatives of the reduced model's predictions by the numbers of a model, as differences of runs."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Final

import numpy as np

from sssi_exudyn.contact.backends import reduced_kernel
from sssi_exudyn.contact.backends.compiled import compile_kernel
from sssi_exudyn.contact.registry import pad_terms
from sssi_exudyn.core.frames import Array
from sssi_exudyn.model.model import Model
from sssi_exudyn.simulation.reduced import Prepared, ReducedRun, simulate_reduced

STEPS: Final = {
    "heading_offset": 1e-4,
    "clock_offset": 1e-3,
    "f": 1e-2,
    "l": 1e-2,
    "velocity_f": 1e-3,
    "velocity_l": 1e-3,
}
"""Differences for the derivatives by the start's numbers, in their units."""
_NEAR: Final = {"s": 0.01, "m": 0.05}
"""Differences at most by unit: bounds of a place or an instant are those of a whole day, an effect's edge is sharp."""


def sensitivities(
    model: Model, prepared: Prepared, names: Sequence[str], observed: Callable[[Model, ReducedRun], Array]
) -> tuple[Array, Array]:
    """What is ``observed`` of a run, any shape (…), and its derivative (…, k) by the numbers of those names.

    Forward differences: a term's or sensor's number is changed by 10⁻⁴ of the width of its bounds, inwards, a place or
    an instant by no more than is near; what that leaves of curvature is less than the reduced model's own difference
    from the full one.
    """
    changed, widths = [model], []
    for name in names:
        about, value = model.about(name), model.value(name)
        owner, _, key = name.partition(".")
        width = STEPS[key] if owner == "start" else min(1e-4 * (about.high - about.low), _NEAR.get(about.unit, np.inf))
        widths.append(width if value + width <= about.high else -width)
        changed.append(model.with_values({name: value + widths[-1]}))
    first, *others = simulate_each(changed, prepared, observed)
    columns = [(other - first) / width for other, width in zip(others, widths, strict=True)]
    return first, np.stack(columns, axis=-1) if columns else np.zeros((*first.shape, 0))


def simulate_each(
    models: Sequence[Model], prepared: Prepared, observed: Callable[[Model, ReducedRun], Array]
) -> list[Array]:
    """What is ``observed`` of a run of each model, in threads: the compiled loop lets go of the interpreter's lock."""
    every = [pad_terms(model.terms) for model in models]
    for terms in {tuple(type(term) for term in terms): terms for terms in every}.values():
        compile_kernel(terms, reduced_kernel)  # once, before threads ask for it
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        return list(pool.map(lambda each: observed(each, simulate_reduced(each, prepared)), models))
