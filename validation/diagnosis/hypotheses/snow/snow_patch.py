"""A stretch of other snow."""

import itertools
from typing import Final

import numpy as np

from sssi_exudyn.contact.terms.friction_corrections import SnowPatch
from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.number_ref import FRICTION, NumberRef
from sssi_exudyn.fitting.evidence import Freedom
from sssi_exudyn.model.model import Model, add_part, name_in_model
from sssi_exudyn.validation.diagnosis.hypotheses.hypothesis import (
    Candidate,
    Distinction,
    FittedRun,
    Hypothesis,
    Numbers,
    Probe,
    Shifts,
    as_slope,
    by_sign,
    intervals,
    probes_by,
    sums_by_half_cells,
)

_GLIDING: Final = {"delta_mu_t": 0.06}
_BOTH: Final = {**_GLIDING, "delta_mu_n": 0.05}
"""Usual changes of the resistance to gliding alone, and of that across the skis, too."""


class PatchOfSnow(Hypothesis):
    """Snow that glides and holds differently over a stretch, put together from cells along the fall line; the formula
    is that of ``SnowPatch``.
    """

    name = SnowPatch.name
    kind = "physics"
    caption = "a stretch of other snow"
    smallest = "a stretch of snow whose μ_t differs by {value:.3f}"
    plain_smallest = "a stretch of slower or faster snow, as if the slope changed by {degrees:.1f}°"
    lines = ("f0", "f1")
    distinctions = (Distinction(("unexplained_force",), "a second run over the same place"),)
    _SLICKEST: Final = 0.01  # half of the least gliding friction that Wolfsperger et al. (2021) measured

    def possible(self, model: Model) -> bool:
        fallen = min(term.delta_mu_t for term in model.terms if isinstance(term, SnowPatch))
        return model.friction.mu_t + fallen >= self._SLICKEST

    def probes(self, fitted: FittedRun) -> list[Probe]:
        cells = [SnowPatch(0.0, float(a), float(b), 0.5) for a, b in itertools.pairwise(fitted.place_edges)]
        return [probe for key in _BOTH for part in cells for probe in probes_by(fitted.model, part, [key])]

    def candidates(self, fitted: FittedRun, responses: Array) -> list[Candidate]:
        """Return patches that change the resistance to gliding alone, and as many that change both."""
        cells = len(fitted.place_edges) - 1
        shaped = responses.reshape(len(responses), len(_BOTH), cells)
        edges, summed = sums_by_half_cells(fitted.place_edges, shaped)
        spread = float(edges[-1] - edges[0]) / cells
        stretches = list(intervals(cells, 2, max(2, round(0.6 * cells))))
        candidates = []
        for usual, (i, j) in itertools.product((_GLIDING, _BOTH), stretches):
            part = SnowPatch(0.0, float(edges[i]), float(edges[j]), 0.5)
            owner = name_in_model(fitted.model, part)
            moved = summed[:, : len(usual), j] - summed[:, : len(usual), i]
            candidates.append(
                Candidate(
                    add_part(fitted.model, part),
                    Freedom(moved, np.array(list(usual.values()))),
                    tuple((NumberRef.of(owner, key),) for key in usual),
                    {NumberRef.of(owner, "f0"): spread, NumberRef.of(owner, "f1"): spread},
                    (fitted.time_at(edges[i]), fitted.time_at(edges[j])),
                )
            )
        return candidates

    def window(self, fitted: FittedRun, candidate: Candidate, numbers: Numbers) -> tuple[float, float]:
        return fitted.time_at(numbers["f0"].value), fitted.time_at(numbers["f1"].value)

    def shifts_if_usual(self, fitted: FittedRun, candidate: Candidate, model: Model) -> Shifts:
        """Return the shifts of a patch that begins or ends with the run: slower snow from there on is faster snow until
        there.
        """
        owner = candidate.amplitudes[0][0].owner
        begin, end = (fitted.time_at(model.value(NumberRef.of(owner, key))) for key in self.lines)
        edges = fitted.time_edges
        if begin > edges[1] and end < edges[-2]:
            return ()
        return ({number: model.value(NumberRef.of(owner, f"delta_{number.key}")) for number in FRICTION},)

    def sentence(self, numbers: Numbers, model: Model) -> str:
        glide, hold = _glide(numbers, model), _hold(numbers, model)
        if not _differs(numbers, "delta_mu_n"):
            return f"the skis {glide}"
        return f"the skis {glide}, and {hold}" if _differs(numbers, "delta_mu_t") else f"the skis {hold}"

    def plain_words(self, numbers: Numbers, model: Model) -> str:
        delta = numbers["delta_mu_t"].value
        if _differs(numbers, "delta_mu_n") and not _differs(numbers, "delta_mu_t"):
            more = by_sign(numbers["delta_mu_n"].value, "more", "less")
            return f"the snow holds {more} across the skis there, and glides as elsewhere"
        return f"the snow is {by_sign(delta, 'slower', 'faster')} there: {as_slope(delta)}"


def _differs(numbers: Numbers, key: str) -> bool:
    """Return whether the interval of a number leaves out that the snow is as elsewhere."""
    number = numbers.get(key)
    return number is not None and number.low * number.high > 0.0


def _glide(numbers: Numbers, model: Model) -> str:
    delta, elsewhere = numbers["delta_mu_t"].value, model.friction.mu_t
    return (
        f"glide on {by_sign(delta, 'slower', 'faster')} snow: μ_t is {elsewhere + delta:.3f} there "
        f"against {elsewhere:.3f} elsewhere"
    )


def _hold(numbers: Numbers, model: Model) -> str:
    """Return the words for the resistance across the skis; none where it was not estimated."""
    across = numbers.get("delta_mu_n")
    if across is None:
        return ""
    there, elsewhere = model.friction.mu_n + across.value, model.friction.mu_n
    return f"hold {by_sign(across.value, 'more', 'less')} across: μ_n is {there:.2f} there against {elsewhere:.2f}"
