"""``--quick``: a first answer, which says that it is one and claims no standard errors."""

from __future__ import annotations

import pytest
from bundled import EXAMPLES, bundled

import sssi_exudyn
from sssi_exudyn.core.errors import InputError


@pytest.mark.long
def test_a_quick_fit_is_near_the_truth_and_claims_no_standard_errors() -> None:
    result = sssi_exudyn.fit(EXAMPLES / "beginner", quick=True, seconds=":6")
    friction = result.friction
    # errors of the posture, which are not estimated, moved it by 0.003 and 0.002 over the whole run
    assert friction.mu_t.value == pytest.approx(0.06, abs=0.01)
    assert friction.mu_n.value == pytest.approx(0.55, abs=0.01)
    assert friction.mu_t.se is None
    assert friction.mu_n.se is None
    assert result.summary.notices[0].startswith("quick: ")
    assert result.summary.provenance.settings["quick"] is True
    assert result.model.solver.elements == 14  # those of the fast preset


def test_a_quick_fit_on_snow_that_edges_cut_is_refused() -> None:
    with pytest.raises(InputError, match="--quick: where edges cut"):
        sssi_exudyn.fit(bundled("intermediate")[0], quick=True, snow="carving")
