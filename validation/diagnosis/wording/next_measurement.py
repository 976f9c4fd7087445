"""What to measure next: how probably another pass would distinguish two explanations between which a run cannot.

Were the first of two explanations right, another pass would raise its log evidence above the other's by D²/2 ± D, where
D² is what the two predict differently, in units of all that is uncertain.  Snow, slope and mountings of instruments are
there again on another pass, a gust or a push is not: so what the two predict of it differs by the whole of an effect
where one of them comes again and the other does not.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from scipy.stats import norm

from sssi_exudyn.core.errors import SimulationDiverged
from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.noise import ExponentialNoise
from sssi_exudyn.fitting.evidence import uncertain, whiten_columns
from sssi_exudyn.fitting.noise import NoiseLevels
from sssi_exudyn.model.model import Model
from sssi_exudyn.simulation.reduced.run import simulate_reduced
from sssi_exudyn.validation.diagnosis.diagnosis_data import NOTHING_MISSING, Next
from sssi_exudyn.validation.diagnosis.hypotheses.catalogue import BY_NAME
from sssi_exudyn.validation.diagnosis.search.compare_hypotheses import Explanation, Round
from sssi_exudyn.validation.diagnosis.search.probabilities import TEMPER
from sssi_exudyn.validation.diagnosis.search.search_result import SURE

_SETTLED: Final = float(np.log(SURE / (1.0 - SURE)))
"""Log odds from which a name stands alone."""
_GOOD_RECEIVER: Final = 0.02
"""m, of a receiver with a fixed solution."""
_WORSE: Final = 1.5
"""Times that noise from which a good receiver is a measurement of its own."""
_LISTED: Final = 3


@dataclass(frozen=True)
class _Pass:
    """Another pass: in words, how much faster it begins, and the noise of its instruments."""

    words: str
    speed: float
    levels: NoiseLevels


def next_measurements(searched: Round, chosen: Explanation, levels: NoiseLevels) -> tuple[Next, ...]:
    """Further passes that would distinguish ``chosen`` from the most probable other explanation of its round, the most
    promising first; none where there is no other that was refitted, or where it is certain already.
    """
    others = [each for each in searched.explanations if each is not chosen and each.fit is not None]
    if not others or chosen.fit is None or chosen.probability >= SURE:
        return ()
    other = others[0]
    names = chosen.name or NOTHING_MISSING, other.name or NOTHING_MISSING
    found = []
    for each in _passes(searched, levels):
        try:
            square = _difference(searched, chosen, other, each)
        except SimulationDiverged:
            continue
        likely = settled(chosen.probability, other.probability, square)
        found.append(Next(each.words, names, likely))
    return tuple(sorted(found, key=lambda each: -each.probability)[:_LISTED])


def settled(first: float, second: float, square: float) -> float:
    """How probably one of two explanations, of these probabilities, would stand alone after a measurement that they
    predict differently by ``square`` (D²).
    """
    share, odds, spread = first / (first + second), float(np.log(first / second)), TEMPER * np.sqrt(max(square, 1e-12))
    middle = 0.5 * TEMPER * square
    right = norm.cdf((middle + odds - _SETTLED) / spread), norm.cdf((middle - odds - _SETTLED) / spread)
    return float(share * right[0] + (1.0 - share) * right[1])


def _passes(searched: Round, levels: NoiseLevels) -> Sequence[_Pass]:
    passes = [
        _Pass("the same slope once more, skied alike", 1.0, levels),
        _Pass("the same slope once more, begun a fifth faster", 1.2, levels),
        _Pass("the same slope once more, begun a fifth slower", 0.8, levels),
    ]
    if levels.gps.sigma > _WORSE * _GOOD_RECEIVER:
        better = ExponentialNoise(_GOOD_RECEIVER, searched.linear.measurements.usual.gps.correlation_time)
        words = f"the same slope once more, with a receiver good to {_GOOD_RECEIVER * 100.0:.0f} cm"
        passes.append(_Pass(words, 1.0, replace(levels, gps=better)))
    return passes


def _difference(searched: Round, first: Explanation, second: Explanation, each: _Pass) -> float:
    """D² of another pass, once all that is uncertain has taken its part."""
    change = _predicted(searched, first, each) - _predicted(searched, second, each)
    white = whiten_columns(searched.linear, each.levels, change[:, None])
    rest = uncertain(searched.linear, each.levels).remove_from(white)
    return max(0.0, float(white[:, 0] @ rest[:, 0]))


def _predicted(searched: Round, explanation: Explanation, each: _Pass) -> Array:
    """(N,) what the instruments would measure of another pass."""
    assert explanation.fit is not None
    model = _again(explanation.fit.model, explanation)
    start = ("start.velocity_f", "start.velocity_l")
    model = model.with_values({name: each.speed * model.value(name) for name in start})
    fitted = searched.fitted
    return fitted.measurements.predict(model, simulate_reduced(model, fitted.prepared))


def _again(model: Model, explanation: Explanation) -> Model:
    """The model of another pass."""
    candidate = explanation.candidate
    if candidate is None or BY_NAME[explanation.name].comes_again:
        return model
    return model.without({name.partition(".")[0] for name in candidate.strengths})
