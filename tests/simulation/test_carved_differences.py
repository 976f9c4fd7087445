"""Derivatives of runs on snow that edges cut, which are differences of runs."""

from __future__ import annotations

import numpy as np
import pytest
from gliding import model, standing

from sssi_exudyn.contact.terms.carving import Carving
from sssi_exudyn.core.frames import GRAVITY, Array
from sssi_exudyn.model.model import Model
from sssi_exudyn.simulation.prepared import ReducedRun, prepare
from sssi_exudyn.simulation.sensitivities import sensitivities
from sssi_exudyn.simulation.tangents import skier_mass_change

pytestmark = pytest.mark.long
INCLINATION = 15.0


def _way(_: Model, run: ReducedRun) -> Array:
    return run.com[-1, :1] - run.com[0, :1]


def test_derivatives_of_a_gliding_skier_are_those_of_its_formula() -> None:
    gliding = model((Carving(mu=0.05),), speed=8.0)
    prepared = prepare(gliding, standing(1.0), step=0.0025)

    heavier = skier_mass_change(gliding, standing(1.0), prepared)
    way, slopes = sensitivities(
        gliding, prepared, ["carving.mu", "start.velocity_f", "start.clock_offset"], _way, [heavier]
    )
    normal = GRAVITY * np.cos(np.radians(INCLINATION))
    assert way[0] == pytest.approx(8.0 + 0.5 * (GRAVITY * np.sin(np.radians(INCLINATION)) - 0.05 * normal), rel=5e-3)
    assert slopes[0, 0] == pytest.approx(-0.5 * normal, rel=0.02)  # the start's settling is in the rest
    assert slopes[0, 1] == pytest.approx(1.0, rel=0.01)
    assert slopes[0, 2] == 0.0  # a clock moves no skier
    assert abs(slopes[0, 3]) < 1e-3  # m/kg: without air a heavier skier glides as far
