"""A round of the search: where a hypothesis is fitted."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from bundled import steady
from displaced_fixes import displaced_by

from sssi_exudyn.contact.term import Term
from sssi_exudyn.contact.terms.friction_corrections import SnowPatch
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.simulation.result import SimulationResult
from sssi_exudyn.validation.diagnosis.context import diagnosis_problem
from sssi_exudyn.validation.diagnosis.hypotheses.catalogue import BY_NAME
from sssi_exudyn.validation.diagnosis.search.compare_hypotheses import compare_hypotheses
from sssi_exudyn.validation.diagnosis.search.explanation import Refitted
from sssi_exudyn.validation.diagnosis.state import first_fit


@pytest.mark.long(seconds=40)
@pytest.mark.usefixtures("coarse_skis")
def test_a_patch_amid_a_run_is_not_taken_for_a_slippery_beginning() -> None:
    """By linear responses other snow before the patch gains more; a fit that begins there stays there."""
    delta, ends = 0.1, (2.65, 5.4)
    lines: list[float] = []

    def patch(run: SimulationResult) -> Sequence[Term]:
        lines.extend(np.interp(ends, run.time, run.foot_position[..., 0].mean(axis=1)))
        return [SnowPatch(delta, *lines)]

    recording, motion = displaced_by("beginner", 1.0, 6.5, patch)
    recording = steady(recording)
    model, hypotheses = model_of(recording, motion), [BY_NAME["snow_patch"]]
    problem, state, base = first_fit(diagnosis_problem(recording, motion, model, hypotheses=hypotheses))
    best = compare_hypotheses(problem, state, base).best
    assert isinstance(best, Refitted)
    value = best.fit.model.value
    # posture and start have given way by a fifth of it
    assert value("snow_patch.delta_mu_t") == pytest.approx(delta, rel=0.2)
    ends_of_best = [value("snow_patch.f0"), value("snow_patch.f1")]
    np.testing.assert_allclose(ends_of_best, lines, atol=1.0)  # fixes of 2 cm, a metre in a fifth of a second
    # the other place was tried too, and let go
    assert len(best.elsewhere) == 1
