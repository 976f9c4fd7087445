"""Refining the ski converges, at the order that its elements have."""

import dataclasses

import numpy as np
import pytest
from ski_bench import FLAT, Bench, slalom

from sssi_exudyn.bodies.ski.mesh import mesh
from sssi_exudyn.bodies.ski.modes import modal_ski
from sssi_exudyn.bodies.ski.ski import Ski, uniform_ski

ELEMENTS = (10, 20, 50, 100)
BAR = uniform_ski("bar", length=1.65, width=0.07, thickness=0.01, young_modulus=1e10, mass=1.5)
FLAT_SLALOM = dataclasses.replace(slalom(), height=FLAT)


def order(errors: list[float]) -> float:
    """Slope of log error over log element length, by least squares."""
    return float(-np.polyfit(np.log(ELEMENTS), np.log(np.abs(errors)), 1)[0])


def tip_deflection(ski: Ski, elements: int) -> float:
    cut = mesh(ski, elements)
    bench = Bench(cut)
    bench.hold(cut.clamped)
    bench.push(elements, [0.0, 0.0, 0.05])
    return float(bench.settle()[-1, 2])


def held_frequency(ski: Ski, elements: int) -> float:
    cut = mesh(ski, elements)
    bench = Bench(cut)
    bench.hold(cut.clamped)
    return float(bench.frequencies()[0])


# Two-node elements with one integration point are of second order. Over 10 to 100 elements the slope of a slightly
# curved line differs from 2 by some 0.05 on a uniform bar; on the slalom ski the break points of its thickness fall
# differently in every mesh, and the node at the boot centre divides 10 elements otherwise than 100, which moves single
# errors by some ten per cent and the slope by 0.2.
@pytest.mark.parametrize(("ski", "slack"), [(BAR, 0.05), (FLAT_SLALOM, 0.25)], ids=["bar", "slalom"])
def test_deflection_converges_at_second_order(ski: Ski, slack: float) -> None:
    fine = tip_deflection(ski, 200)
    finer = fine + (fine - tip_deflection(ski, 100)) / 3.0  # Richardson's extrapolation for order two
    errors = [tip_deflection(ski, n) - finer for n in ELEMENTS]
    assert order(errors) == pytest.approx(2.0, abs=slack)
    assert abs(errors[2] / finer) < 2e-3  # at the 50 elements that are used


@pytest.mark.parametrize(("ski", "slack"), [(BAR, 0.05), (slalom(), 0.15)], ids=["bar", "slalom"])
@pytest.mark.long
def test_held_frequency_converges_at_second_order(ski: Ski, slack: float) -> None:
    fine = modal_ski(mesh(ski, 400), 1).frequency[0]  # cubic elements: four times finer and of higher order
    errors = [held_frequency(ski, n) - fine for n in ELEMENTS]
    assert order(errors) == pytest.approx(2.0, abs=slack)
    assert abs(errors[2] / fine) < 2e-3


@pytest.mark.long
def test_modal_frequencies_converge() -> None:
    fine = modal_ski(mesh(slalom(), 400), 10).frequency
    errors = [np.abs(modal_ski(mesh(slalom(), n), 10).frequency / fine - 1.0).max() for n in ELEMENTS]
    assert errors[0] > errors[1] > errors[2] > errors[3]
    assert order(errors) > 1.5  # second order for even sections, less while the shovel is a single element
    assert errors[2] < 0.01
