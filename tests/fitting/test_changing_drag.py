"""A drag area that comes and goes: what it does to a run, next to runs that have it."""

from __future__ import annotations

from dataclasses import replace

import gliding
import numpy as np
import pytest

from sssi_exudyn.contact.registry import PAPER_TERMS
from sssi_exudyn.contact.terms.air import AirDrag
from sssi_exudyn.contact.terms.body_forces import PassingDrag
from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.noise import ExponentialNoise, parts_in_cells
from sssi_exudyn.fitting.changing_drag import responses_to_changing_drag
from sssi_exudyn.model.model import Model
from sssi_exudyn.simulation.reduced.prepared import ReducedRun, prepare
from sssi_exudyn.simulation.reduced.run import simulate_reduced

SECONDS, SPEED, AREA = 4.0, 20.0, 0.02
CELL = 0.5


def speed_of(model: Model, run: ReducedRun) -> Array:
    return run.pelvis_velocity[:, 0]


def test_parts_have_the_covariance_of_the_process() -> None:
    edges = np.array([0.0, 0.5, 1.0, 1.8, 2.0])
    parts = parts_in_cells(edges, ExponentialNoise(AREA, 1.0), 0.8)
    middles = 0.5 * (edges[1:] + edges[:-1])
    expected = AREA**2 * np.exp(-np.abs(middles[:, None] - middles))
    np.testing.assert_allclose(parts @ parts.T, expected, rtol=1e-12)


def test_responses_are_those_of_runs_with_that_area() -> None:
    motion, model = gliding.standing(SECONDS), gliding.model(speed=SPEED)
    prepared = prepare(model, motion)
    columns = responses_to_changing_drag(model, prepared, speed_of, AREA, len(prepared.time))
    edges = np.linspace(prepared.time[0], prepared.time[-1], columns.shape[1] + 1)
    assert columns.shape[1] == round((prepared.time[-1] - prepared.time[0]) / CELL)
    areas = parts_in_cells(edges, ExponentialNoise(AREA, 1.0), CELL)
    ends = list(zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True))
    for k in (0, 3):
        speeds = []
        for sign in (1.0, -1.0):
            more = [PassingDrag(sign * area, *end) for area, end in zip(areas[:, k].tolist(), ends, strict=True)]
            speeds.append(speed_of(model, simulate_reduced(replace(model, terms=(*model.terms, *more)), prepared)))
        # both ways: what the square of an area does, some 10⁻⁴ of its effect, is left out
        np.testing.assert_allclose(
            columns[:, k], (speeds[0] - speeds[1]) / 2.0, atol=1e-3 * np.abs(columns[:, k]).max()
        )


def test_a_model_that_has_such_a_drag_may_have_more_of_it() -> None:
    motion, model = gliding.standing(1.0), gliding.model((*PAPER_TERMS, PassingDrag(0.1, 0.2, 0.6)), speed=SPEED)
    prepared = prepare(model, motion)
    columns = responses_to_changing_drag(model, prepared, speed_of, AREA, len(prepared.time))
    assert np.all(columns[-1] < 0.0)
    assert responses_to_changing_drag(model, prepared, speed_of, 0.0, len(prepared.time)).shape == (
        len(prepared.time),
        0,
    )


def test_it_slows_a_skier_down_by_the_formula() -> None:
    """½ρ·area·v² over the mass, for the time that it acts."""
    motion = gliding.standing(1.0)
    plain = gliding.model(speed=SPEED)
    dragged = replace(plain, terms=(*plain.terms, PassingDrag(0.2, 0.6, 0.9)))
    prepared = prepare(plain, motion)
    speeds = [speed_of(model, simulate_reduced(model, prepared)) for model in (plain, dragged)]
    mean = 0.5 * (speeds[0] + speeds[1])
    acting = (prepared.time > 0.6) & (prepared.time < 0.9)
    gear = 2.0 * (plain.equipment.ski_mass + plain.equipment.boot_mass)
    slower = 0.5 * AirDrag().rho * 0.2 * np.mean(mean[acting] ** 2) * 0.3 / (plain.skier.mass + gear)
    # the difference has lessened by drag for a quarter of a second: a rate of ρ C_D A v / m, 0.13 1/s
    assert speeds[0][-1] - speeds[1][-1] == pytest.approx(slower, rel=0.05)
