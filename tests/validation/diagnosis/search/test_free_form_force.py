"""A force of any form about its own estimate: the same in the place of whichever law."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from displaced_fixes import displaced_by

from sssi_exudyn.contact.terms.body_forces import UnexplainedForce
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.validation.diagnosis.context import DiagnosisProblem, diagnosis_problem
from sssi_exudyn.validation.diagnosis.hypotheses.catalogue import BY_NAME
from sssi_exudyn.validation.diagnosis.search import compare_hypotheses as search_module
from sssi_exudyn.validation.diagnosis.search.compare_hypotheses import (
    Explanation,
    Round,
    compare_hypotheses,
    without_law,
)
from sssi_exudyn.validation.diagnosis.search.free_form_force import weigh_any_form
from sssi_exudyn.validation.diagnosis.search.unlisted_force import unlisted_force
from sssi_exudyn.validation.diagnosis.state import State, first_fit

LAWS = ("snow_patch", "gust")


@dataclass(frozen=True)
class Compared:
    problem: DiagnosisProblem
    state: State
    latest: Round

    def law(self, name: str) -> Explanation:
        return next(each for each in self.latest.explanations if each.name == name)

    def linearly(self, law: Explanation) -> float:
        """Log evidence of a force of any form, taken from the estimate with the law."""
        assert law.candidate is not None
        assert law.fit is not None
        linear, _ = without_law(self.problem, self.state, self.latest.base, law.candidate, law.fit)
        responses = self.latest.responses["unexplained_force"]
        return unlisted_force(linear, law.levels, self.latest.fitted, responses).log_evidence


@pytest.fixture(scope="module")
def compared() -> Compared:
    """A run on which a brake grows from nothing to 60 N, as no law of the list does."""
    start, stop = 0.0, 5.0
    steps = np.linspace(start, stop, 11)
    brake = [
        UnexplainedForce(-60.0 * share, 0.0, 0.0, float(a), float(b))
        for share, a, b in zip(np.linspace(0.0, 1.0, 10), steps[:-1], steps[1:], strict=True)
    ]
    recording, motion = displaced_by("beginner", start, stop, lambda _run: brake)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(search_module, "HYPOTHESES", tuple(BY_NAME[name] for name in (*LAWS, "unexplained_force")))
        problem, state, base = first_fit(diagnosis_problem(recording, motion, model_of(recording, motion)))
        return Compared(problem, state, compare_hypotheses(problem, state, base))


@pytest.mark.long(seconds=40)
def test_its_evidence_is_the_same_in_the_place_of_whichever_law(compared: Compared) -> None:
    found, linearly = [], []
    for name in LAWS:
        law = compared.law(name)
        assert law.fit is not None
        evidence, form = weigh_any_form(compared.problem, compared.state, compared.latest, law, law.fit, full=False)
        found.append(evidence)
        linearly.append(compared.linearly(law))
        assert set(form.values) >= {"friction.mu_t", "friction.mu_n"}
        assert np.all(form.free.scales > 0.0)
    # each is under the noise that suits its law, and estimates end within some tenths
    assert abs(found[0] - found[1]) < 1.0
    assert min(found) > max(linearly)
