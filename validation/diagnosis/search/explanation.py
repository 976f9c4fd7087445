"""What a recording may be explained by: that nothing is missing, or a hypothesis at one place; and a round of these.

A hypothesis is ``Screened`` by its linear response first, and ``Refitted`` with its real term or fault where that is
worth a fit.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import ClassVar

import numpy as np

from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.number_ref import NumberRef
from sssi_exudyn.fitting.evidence import Freedom, LinearModel
from sssi_exudyn.fitting.linear_fit import Refit
from sssi_exudyn.fitting.noise import NoiseLevels
from sssi_exudyn.validation.diagnosis.diagnosis_data import NOTHING_MISSING, Smallest
from sssi_exudyn.validation.diagnosis.hypotheses.hypothesis import Candidate, FittedRun, FreeFormForce, Hypothesis
from sssi_exudyn.validation.diagnosis.judgement import Judgement
from sssi_exudyn.validation.diagnosis.search.probabilities import probabilities

Values = Mapping[NumberRef, tuple[float, float]]
"""Numbers by their names, each with its standard deviation."""


@dataclass(frozen=True)
class Nothing:
    """That nothing more is missing.

    log_evidence : with the noise's own prior;  levels : of the noise;  fit : of the model without anything added
    probability : among all explanations of the round;  by_fits : as in ``Screened``
    """

    log_evidence: float
    levels: NoiseLevels
    fit: Refit
    probability: float = 0.0
    by_fits: float | None = None

    name: ClassVar[str] = NOTHING_MISSING
    share_of_other_form: ClassVar[float] = 0.0


@dataclass(frozen=True)
class OtherForm:
    """Another form of an explanation: a force of any form in the place of a law, or a law whose form is wrong.

    share : of the explanation's probability that this form holds
    values : of the fit's numbers with it
    free : how the force may vary, before the data speak
    """

    share: float
    values: Values
    free: Freedom


@dataclass(frozen=True)
class Screened:
    """A hypothesis at one place, compared by its linear response.

    candidate : where and what, its usual amplitudes times the size that suits best
    log_evidence : with the noise's own prior, place and size integrated
    levels : of the noise under it
    probability : among all explanations of the round
    by_fits : the same by the fits alone, where simulated runs have a say too
    size : one of ``Thresholds.sizes``
    log_place : what searching all places adds to the log evidence of the best one, below 0
    log_natural : of what shapes the snow: density of its size were it the slope's own, over that were it not
    elsewhere : candidates of the same amplitudes at other times, where a fit may end better
    other_form : of a hypothesis without a law, once its force of any form was weighed in the place of a law; of a law,
        once it was weighed with what its form may be wrong by
    """

    hypothesis: Hypothesis
    candidate: Candidate
    log_evidence: float
    levels: NoiseLevels
    probability: float = 0.0
    by_fits: float | None = None
    size: float = 1.0
    log_place: float = 0.0
    log_natural: float = -np.inf
    elsewhere: tuple[Candidate, ...] = ()
    other_form: OtherForm | None = None

    @property
    def name(self) -> str:
        """The hypothesis' name."""
        return self.hypothesis.name

    @property
    def has_law(self) -> bool:
        """Return whether this is a law or a fault, and not a force of free form."""
        return not isinstance(self.hypothesis, FreeFormForce)

    @property
    def share_of_other_form(self) -> float:
        """Share of the probability that the other form holds; the rest is the candidate's."""
        return 0.0 if self.other_form is None else self.other_form.share

    def with_fit(self, fit: Refit) -> Refitted:
        """Return the same with a fit of its real term or fault."""
        return Refitted(**{**vars(self), "fit": fit})


@dataclass(frozen=True)
class Refitted(Screened):
    """A hypothesis whose real term or fault was fitted."""

    fit: Refit = field(kw_only=True)


Explanation = Nothing | Screened


@dataclass(frozen=True)
class Round:
    """All explanations, the most probable first, and what they were compared on.

    linear : the run linearised about ``base``, the fit without anything more;  fitted : its run
    responses : (N, probes) by the names of the hypotheses, a unit of amplitude
    noticed : by their names, from which size on each would have been noticed
    judgement : what simulated runs had hidden that look like the recording, where these were asked
    """

    explanations: tuple[Explanation, ...]
    linear: LinearModel
    base: Refit
    fitted: FittedRun
    responses: dict[str, Array]
    noticed: dict[str, Smallest]
    judgement: Judgement | None = None

    @property
    def nothing(self) -> Nothing:
        """Return the explanation that nothing more is missing."""
        return next(explanation for explanation in self.explanations if isinstance(explanation, Nothing))

    @property
    def hypotheses(self) -> tuple[Screened, ...]:
        """Return all explanations that add something."""
        return tuple(explanation for explanation in self.explanations if isinstance(explanation, Screened))

    @property
    def refitted(self) -> tuple[Refitted, ...]:
        """Return the explanations that were fitted."""
        return tuple(explanation for explanation in self.explanations if isinstance(explanation, Refitted))

    @property
    def best(self) -> Screened:
        """The most probable one that adds something."""
        return self.hypotheses[0]

    def ranked(self, explanations: Sequence[Explanation]) -> Round:
        """Return the same round with other evidence of its explanations, and their probabilities by that."""
        return replace(self, explanations=rank_by_probability(explanations, self.fitted))


def rank_by_probability(explanations: Sequence[Explanation], fitted: FittedRun) -> tuple[Explanation, ...]:
    """Return all explanations of a round with their probabilities, the most probable first."""
    (nothing,) = (explanation for explanation in explanations if isinstance(explanation, Nothing))
    hypotheses = [explanation for explanation in explanations if isinstance(explanation, Screened)]
    weights, evidence, natural = np.array(
        [(screened.hypothesis.weight, screened.log_evidence, screened.log_natural) for screened in hypotheses]
    ).reshape(-1, 3).T  # fmt: skip
    of_nothing, *of_hypotheses = probabilities(
        nothing.log_evidence, evidence, weights, fitted.thresholds, log_natural=natural
    ).tolist()
    by_hypothesis = iter(of_hypotheses)
    weighed: list[Explanation] = [
        replace(explanation, probability=of_nothing if isinstance(explanation, Nothing) else next(by_hypothesis))
        for explanation in explanations
    ]
    return tuple(sorted(weighed, key=lambda explanation: -explanation.probability))
