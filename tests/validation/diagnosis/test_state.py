"""From what the numbers of an explanation count where it is estimated again."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from bundled import bundled

from sssi_exudyn.contact.terms.wind import Gust
from sssi_exudyn.core.number_ref import CLOCK_OFFSET, NumberRef
from sssi_exudyn.fitting.linear_fit import Refit
from sssi_exudyn.fitting.objective import Prior
from sssi_exudyn.fitting.parameters import Parameter
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.model.model import add_part
from sssi_exudyn.validation.diagnosis import state as module
from sssi_exudyn.validation.diagnosis.state import estimate_again


def test_a_late_clock_counts_from_what_is_stated(monkeypatch: pytest.MonkeyPatch) -> None:
    """An estimate before had moved the clock by 53 ms, and the law's prior about it began there."""
    stated = model_of(*bundled("beginner"))
    gust, free = NumberRef("gust.w_f"), NumberRef("friction.mu_t")
    known = Parameter((free,), Prior(0.1, 0.1))
    of_causes = Parameter((CLOCK_OFFSET,), Prior(0.053, 0.125)), Parameter((gust,), Prior(0.0, 5.0))
    parameters = (known, *of_causes)
    model = add_part(stated, Gust()).with_values({CLOCK_OFFSET: 0.076})
    none = np.zeros((0, 3))
    fit = Refit(model, parameters, np.array([0.08, 0.076, 3.0]), np.zeros(0), none, 0.0, np.eye(3))
    problem: Any = SimpleNamespace(parameters=(known,), model=stated)
    state: Any = SimpleNamespace(estimate="an estimate")
    asked: list[tuple[Parameter, ...]] = []

    def estimate_with(_problem: Any, fit: Refit, _known: Any, **_: Any) -> str:
        asked.append(fit.parameters)
        return "posterior"

    monkeypatch.setattr(module, "_estimate_with", estimate_with)
    monkeypatch.setattr(module, "linearise_about", lambda _problem, _posterior, parameters: asked.append(parameters))
    estimate_again(problem, state, fit, full=False)
    assert len(asked) == 2
    for clock_from_stated in asked:
        assert clock_from_stated == (known, Parameter((CLOCK_OFFSET,), Prior(0.0, 0.125)), of_causes[1])
