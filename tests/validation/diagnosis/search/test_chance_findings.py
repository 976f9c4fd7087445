"""How often a search finds as much where nothing is hidden."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from a_linear_model import LEVELS, covariance, linear_model
from explanations import NOWHERE
from scipy.stats import kstest

from sssi_exudyn.core.frames import Array
from sssi_exudyn.fitting.evidence import Freedom, LinearModel
from sssi_exudyn.validation.diagnosis.diagnosis_data import Chance
from sssi_exudyn.validation.diagnosis.search.chance_findings import RUNS, search_by_chance


class _Places:
    """A hypothesis whose candidates are the columns of its responses."""

    weight = 1.0

    def __init__(self, name: str) -> None:
        self.name = name

    def candidates(self, _fitted: Any, responses: Array) -> list[Any]:
        return [type("At", (), {"free": Freedom(column[:, None], np.ones(1))}) for column in responses.T]


@pytest.fixture
def responses() -> dict[str, Array]:
    given, rng = linear_model(), np.random.default_rng(8)
    scale = 0.1 * given.measurements.scale.total[:, None]
    widths = {"gust": 12, "wind": 1, "insole_gain": 0}  # the last as of an instrument that is not there
    return {name: scale * rng.normal(size=(len(given.residual), width)) for name, width in widths.items()}


def searched(given: LinearModel, responses: dict[str, Array]) -> Chance:
    hypotheses: Any = [_Places(name) for name in responses]
    return search_by_chance(given, LEVELS, NOWHERE, hypotheses, responses)


def test_where_nothing_is_hidden_every_chance_is_as_frequent_as_it_says(responses: dict[str, Array]) -> None:
    given, rng = linear_model(), np.random.default_rng(9)
    root = np.linalg.cholesky(covariance(given))
    larger = np.exp(rng.uniform(0.0, np.log(1.3), 60))  # levels that fit a recording come out too small
    runs = [replace(given, residual=more * (root @ rng.normal(size=len(root)))) for more in larger]
    shares = [searched(linear, responses).as_strong for linear in runs]
    # a right test rejects in one of a thousand; a search that was counted as one name would be far below
    assert kstest(shares, "uniform").pvalue > 1e-3


def test_what_is_hidden_is_rarely_there_by_chance(responses: dict[str, Array]) -> None:
    given = linear_model()
    shown = replace(given, residual=given.residual + 8.0 * responses["gust"][:, 3])
    chance = searched(shown, responses)
    assert chance.runs == RUNS
    assert chance.as_strong == pytest.approx(1.0 / (RUNS + 1))
    assert chance.nothing_probability < 0.01 < chance.nothing_probability_5_percent
