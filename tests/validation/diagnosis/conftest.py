"""Five seconds of a fitted run, and what a latent force does to it."""

from __future__ import annotations

import pytest
from a_missing_force import five_seconds
from coarse_skis import in_less_detail

from sssi_exudyn.core.frames import Array
from sssi_exudyn.validation.diagnosis.hypotheses.catalogue import LATENT_FORCE
from sssi_exudyn.validation.diagnosis.hypotheses.hypothesis import FittedRun, responses_of


@pytest.fixture(scope="session")
def fitted() -> FittedRun:
    with in_less_detail():
        return five_seconds()


@pytest.fixture(scope="session")
def responses(fitted: FittedRun) -> Array:
    """(N, 3·c) to a newton in each direction and cell."""
    return responses_of(LATENT_FORCE.probes(fitted), fitted.prepared, fitted.measurements)
