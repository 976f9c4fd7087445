"""Intervals of friction, judged as they are shown to the user."""

import json

import pytest
from a_diagnosis import whole_version

from sssi_exudyn.io.typed import decode
from sssi_exudyn.validation.benchmark.cases import Case
from sssi_exudyn.validation.benchmark.scores import CaseResult, score
from sssi_exudyn.validation.diagnosis.diagnosis_data import Diagnosis


@pytest.mark.parametrize(("mu_t", "mu_n", "hits"), [(0.1, 0.71, 2), (0.1, 0.75, 1), (0.2, 0.5, 0)])
def test_the_interval_over_all_explanations_counts(mu_t: float, mu_n: float, hits: int) -> None:
    diagnosis = decode(json.dumps(whole_version()).encode(), Diagnosis)  # 0.084 to 0.118, and 0.70 to 0.74
    case = Case(0, "beginner", "none", "none", 0, None, {}, mu_t=mu_t, mu_n=mu_n)
    scores = score([case], [CaseResult(0, diagnosis=diagnosis)], "seal")
    assert (scores.friction_inside_90.hits, scores.friction_inside_90.of) == (hits, 2)
