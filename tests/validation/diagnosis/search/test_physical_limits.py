"""Evidence within what is possible, against normal distributions cut off."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from a_linear_model import LEVELS, linear_model
from scipy.stats import norm

from sssi_exudyn.fitting.evidence import LinearModel
from sssi_exudyn.fitting.linear_fit import linear_values
from sssi_exudyn.fitting.objective import Prior
from sssi_exudyn.fitting.parameters import Parameter
from sssi_exudyn.validation.diagnosis.search.physical_limits import DRAWS, log_possible

SCALES = (0.1, 0.02, 0.5)
"""Of what is free in ``linear_model``: two numbers of the fit, then the law's amplitude."""


@dataclass(frozen=True)
class Numbers:
    """Stands for a model."""

    low: float = -np.inf
    values: dict[str, float] = field(default_factory=dict)

    def bounds(self, name: str) -> tuple[float, float]:
        return (self.low if name == "law" else -np.inf, np.inf)

    def with_values(self, values: dict[str, float]) -> Numbers:
        return replace(self, values=dict(values))


def log_share(linear: LinearModel, *, low: float = -np.inf, most: float = np.inf) -> float:
    """Of a law whose amplitude is no less than ``low`` by its bounds, and impossible above ``most``."""
    parameters = [Parameter((name,), Prior(0.0, s)) for name, s in zip(("mu", "start", "law"), SCALES, strict=True)]
    fit: Any = SimpleNamespace(parameters=parameters, scales=np.array(SCALES), model=Numbers(low))
    law: Any = SimpleNamespace(possible=lambda model: model.values["law"] <= most)
    candidate: Any = SimpleNamespace(strengths={"law"})
    return log_possible(law, candidate, fit, linear, LEVELS)


def of_amplitude(linear: LinearModel) -> tuple[float, float]:
    """Its value and standard deviation with all else integrated out."""
    return linear_values(linear, LEVELS, [Parameter(("law",), Prior(0.0, SCALES[2]))], 2)["law"]


def test_where_everything_is_possible_evidence_is_as_it_was() -> None:
    assert log_share(linear_model()) == 0.0


@pytest.mark.parametrize("seed", range(4))
def test_it_counts_by_what_is_within_the_bounds(seed: int) -> None:
    linear = linear_model(seed)
    value, sigma = of_amplitude(linear)
    for apart in (-1.0, 0.0, 1.5):
        low = value - apart * sigma
        after, before = norm.cdf(apart), norm.sf(low / SCALES[2])
        # both shares are known to their binomial errors: four of them
        allowed = 4.0 * np.sqrt((1.0 / after - 1.0 + 1.0 / before - 1.0) / DRAWS)
        assert log_share(linear, low=low) == pytest.approx(np.log(after / before), abs=allowed)


def test_a_little_beyond_is_less_probable_and_far_beyond_impossible() -> None:
    linear = linear_model()
    value, sigma = of_amplitude(linear)
    beyond = [log_share(linear, most=value + apart * sigma) for apart in (3.0, 0.0, -1.0, -6.0)]
    assert beyond == sorted(beyond, reverse=True)
    assert np.isfinite(beyond[2])
    assert beyond[3] == -np.inf
