"""What a drag area that comes and goes does to a run: a skier who rises and crouches in his turns shows the air another
area than the law of the air has.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import Final

import numpy as np

from sssi_exudyn.contact.registry import is_carved
from sssi_exudyn.contact.terms.body_forces import PassingDrag
from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.noise import ExponentialNoise, parts_in_cells
from sssi_exudyn.core.number_ref import NumberRef
from sssi_exudyn.model.model import Model, add_part, name_in_model
from sssi_exudyn.simulation.reduced.prepared import Prepared, ReducedRun
from sssi_exudyn.simulation.reduced.sensitivities import responses_to_additions

_MEMORY: Final = 1.0
"""s within which the area changes."""
_CELL: Final = 0.5
"""s in which it is one."""
_MOST: Final = 60
"""Of these at most; in a longer run they are longer."""


def responses_to_changing_drag(
    model: Model, prepared: Prepared, observed: Callable[[Model, ReducedRun], Array], sigma: float, size: int
) -> Array:
    """Return (N, c) what a changing drag area does to what is ``observed`` of a run, (N,), N being the ``size``.

    Its parts are independent, each as large as usual: the area's standard deviation is ``sigma`` (m²), and it remembers
    itself for a second.  There are none where that is zero, nor on snow that edges cut, whose runs have no derivatives.

    Raises SimulationDiverged when the run does.
    """
    if sigma == 0.0 or is_carved(model.terms):
        return np.zeros((size, 0))
    edges = _cells(float(prepared.time[0]), float(prepared.time[-1]))
    number = NumberRef.of(name_in_model(model, PassingDrag()), "area")
    additions = [(add_part(model, PassingDrag(t0=begin, t1=end)), number) for begin, end in pairwise(edges.tolist())]
    by_area = responses_to_additions(additions, prepared, observed)
    return np.asarray(by_area @ parts_in_cells(edges, ExponentialNoise(sigma, _MEMORY), _CELL))


def _cells(begin: float, end: float) -> Array:
    return np.linspace(begin, end, 1 + min(_MOST, max(1, round((end - begin) / _CELL))))
