"""What to measure next: how probably another pass would distinguish two explanations between which a run cannot.

Were the first of two explanations right, another pass would raise its log evidence above the other's by D²/2 ± D.  D²
is what the two predict differently, in units of all that is uncertain.  Snow, slope and mountings of instruments are
there again on another pass, a gust or a push is not.  So where one explanation comes again and the other does not,
their predictions differ by the whole effect.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import norm

from sssi_exudyn.core.errors import SimulationDiverged
from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.noise import ExponentialNoise
from sssi_exudyn.core.number_ref import VELOCITY_F, VELOCITY_L
from sssi_exudyn.fitting.evidence import uncertain, whiten_columns
from sssi_exudyn.fitting.noise import NoiseLevels
from sssi_exudyn.model.model import Model
from sssi_exudyn.simulation.reduced.run import simulate_reduced
from sssi_exudyn.validation.diagnosis.diagnosis_data import Next
from sssi_exudyn.validation.diagnosis.search.explanation import Nothing, Refitted, Round
from sssi_exudyn.validation.diagnosis.thresholds import THRESHOLDS, Thresholds


@dataclass(frozen=True)
class _Pass:
    """Another pass: in words, how much faster it begins, and the noise of its instruments."""

    words: str
    speed: float
    levels: NoiseLevels


def next_measurements(searched: Round, chosen: Nothing | Refitted, levels: NoiseLevels) -> tuple[Next, ...]:
    """Return further passes that would distinguish ``chosen`` from the most probable other explanation of its round.

    The most promising comes first; none where no other was refitted, or where it is certain already.
    """
    thresholds = searched.fitted.thresholds
    others = [
        explanation
        for explanation in searched.explanations
        if isinstance(explanation, Nothing | Refitted) and explanation is not chosen
    ]
    if not others or chosen.probability >= thresholds.sure:
        return ()
    other = others[0]
    proposals = []
    for passing in _passes(searched, levels):
        try:
            square = _difference(searched, chosen, other, passing)
        except SimulationDiverged:
            continue
        likely = settled(chosen.probability, other.probability, square, thresholds)
        proposals.append(Next(passing.words, (chosen.name, other.name), likely))
    return tuple(sorted(proposals, key=lambda proposal: -proposal.probability)[: thresholds.listed_measurements])


def settled(first: float, second: float, square: float, thresholds: Thresholds = THRESHOLDS) -> float:
    """Return how probably one of two explanations would stand alone after a measurement.

    first, second : their probabilities;  square : D², what they predict differently
    """
    temper, sure = thresholds.temper, float(np.log(thresholds.sure / (1.0 - thresholds.sure)))
    share, odds, spread = first / (first + second), float(np.log(first / second)), temper * np.sqrt(max(square, 1e-12))
    middle = 0.5 * temper * square
    right = norm.cdf((middle + odds - sure) / spread), norm.cdf((middle - odds - sure) / spread)
    return float(share * right[0] + (1.0 - share) * right[1])


def _passes(searched: Round, levels: NoiseLevels) -> Sequence[_Pass]:
    passes = [
        _Pass("the same slope once more, skied alike", 1.0, levels),
        _Pass("the same slope once more, begun a fifth faster", 1.2, levels),
        _Pass("the same slope once more, begun a fifth slower", 0.8, levels),
    ]
    thresholds = searched.fitted.thresholds
    good = thresholds.good_receiver
    if levels.gps.sigma > thresholds.worse_receiver * good:
        better = ExponentialNoise(good, searched.linear.measurements.usual.gps.correlation_time)
        words = f"the same slope once more, with a receiver good to {good * 100.0:.0f} cm"
        passes.append(_Pass(words, 1.0, replace(levels, gps=better)))
    return passes


def _difference(searched: Round, first: Nothing | Refitted, second: Nothing | Refitted, passing: _Pass) -> float:
    """Return D² of another pass, once all that is uncertain has taken its part."""
    change = _predicted(searched, first, passing) - _predicted(searched, second, passing)
    white = whiten_columns(searched.linear, passing.levels, change[:, None])
    rest = uncertain(searched.linear, passing.levels).remove_from(white)
    return max(0.0, float(white[:, 0] @ rest[:, 0]))


def _predicted(searched: Round, explanation: Nothing | Refitted, passing: _Pass) -> Array:
    """Return what the instruments would measure of another pass, (N,)."""
    model = on_another_pass(explanation)
    start = (VELOCITY_F, VELOCITY_L)
    model = model.with_values({name: passing.speed * model.value(name) for name in start})
    fitted = searched.fitted
    return fitted.measurements.predict(model, simulate_reduced(model, fitted.prepared))


def on_another_pass(explanation: Nothing | Refitted) -> Model:
    """Return the model of another pass: an effect that does not come again is not there."""
    model = explanation.fit.model
    if isinstance(explanation, Nothing) or explanation.hypothesis.comes_again:
        return model
    return model.without({name.owner for name in explanation.candidate.strengths})
