"""A contact point and a foot's axes: what the formulas say, in every arithmetic, and their generated derivatives."""

from __future__ import annotations

from inspect import Parameter, signature
from typing import Any

import numpy as np
import pytest

from sssi_exudyn.contact.codegen.compiled import compile_kernel
from sssi_exudyn.contact.codegen.formula import Formula, formulas_of
from sssi_exudyn.contact.conformance_states import ComplexMath
from sssi_exudyn.contact.maths import ArrayMath, FloatMath, cross
from sssi_exudyn.core.frames import Array
from sssi_exudyn.simulation.ski_on_snow import point

FORMULAS = formulas_of(point)
DIFFERENTIATED = [formula for formula in FORMULAS if formula.by]
FLOATS = FloatMath()


def arguments_of(formula: Formula) -> dict[str, Parameter]:
    return dict(list(signature(formula.function).parameters.items())[1:])


def random_arguments(formula: Formula, seed: int) -> dict[str, Any]:
    """Numbers of the size they have in a run, each but the small ones, which are zero."""
    generator = np.random.default_rng(seed)
    given: dict[str, Any] = {}
    for name, argument in arguments_of(formula).items():
        if argument.default is not Parameter.empty:
            continue
        if argument.annotation == "Rotation":
            q, r = np.linalg.qr(np.eye(3) + 0.2 * generator.standard_normal((3, 3)))
            given[name] = q * np.sign(np.diag(r))
        elif argument.annotation == "Vector":
            given[name] = tuple(0.5 * generator.standard_normal(3))
        else:
            given[name] = float(0.5 * generator.standard_normal())
    return given


def flat(result: Any) -> list[Any]:
    """All numbers of nested tuples."""
    return [number for part in result for number in flat(part)] if isinstance(result, tuple) else [result]


def moved(formula: Formula, given: dict[str, Any], name: str, place: int, change: complex) -> dict[str, Any]:
    """The arguments with one number more, by ``change``."""
    value = given.get(name, arguments_of(formula)[name].default)
    numbers = np.array(value, dtype=np.result_type(type(change), float)).reshape(-1)
    numbers[place] += change
    return {**given, name: tuple(numbers) if np.ndim(value) else numbers[0]}


def columns(formula: Formula) -> list[tuple[str, int]]:
    """All numbers that a formula is differentiated by."""
    widths = {"Number": 1, "Vector": 3}
    return [(name, i) for name in formula.by for i in range(widths[arguments_of(formula)[name].annotation])]


def linearised(formula: Formula, given: dict[str, Any]) -> Array:
    kernel: Any = compile_kernel(point)
    table = np.full((len(flat(formula(FLOATS, *given.values()))), len(columns(formula))), np.nan)
    getattr(kernel, f"{formula.name}_linearisation")(*given.values(), table)
    return table


@pytest.mark.parametrize("formula", FORMULAS, ids=lambda formula: formula.name)
def test_floats_arrays_and_compiled_functions_agree(formula: Formula) -> None:
    kernel: Any = compile_kernel(point)
    states = [random_arguments(formula, seed) for seed in range(3)]
    expected = np.array([flat(formula(FLOATS, *given.values())) for given in states])
    compiled = np.array([flat(getattr(kernel, formula.name)(*given.values())) for given in states])
    np.testing.assert_allclose(compiled, expected, rtol=1e-14, atol=1e-15)  # rounding of numbers near 1
    together = [np.moveaxis(np.array([given[name] for given in states]), 0, -1) for name in states[0]]
    arrays = np.array(flat(formula(ArrayMath(), *together))).T
    np.testing.assert_allclose(arrays, expected, rtol=1e-14, atol=1e-15)


@pytest.mark.parametrize("formula", DIFFERENTIATED, ids=lambda formula: formula.name)
def test_generated_derivatives_are_those_of_a_complex_step(formula: Formula) -> None:
    given = random_arguments(formula, 5)
    table = linearised(formula, given)
    for column, (name, place) in enumerate(columns(formula)):
        stepped = formula.function(ComplexMath(), **moved(formula, given, name, place, 1e-30j))
        expected = np.imag(flat(stepped)) / 1e-30
        np.testing.assert_allclose(table[:, column], expected, rtol=1e-13, atol=1e-14)  # rounding


@pytest.mark.parametrize("formula", DIFFERENTIATED, ids=lambda formula: formula.name)
def test_differences_converge_to_them_with_the_second_order(formula: Formula) -> None:
    given = random_arguments(formula, 7)
    table = linearised(formula, given)

    def error(step: float) -> float:
        worst = 0.0
        for column, (name, place) in enumerate(columns(formula)):
            up, down = (
                flat(formula.function(FLOATS, **moved(formula, given, name, place, s * step))) for s in (1.0, -1.0)
            )
            worst = max(worst, float(np.abs(np.subtract(up, down) / (2.0 * step) - table[:, column]).max()))
        return worst

    wide, narrow = error(1e-2), error(5e-3)
    # half the step leaves a quarter of the error; of a linear formula only rounding is left, 1e-16 over the step
    assert narrow < 1e-13 or wide / narrow == pytest.approx(4.0, rel=0.02)


def test_a_point_in_the_snow() -> None:
    normal = point.snow_normal(FLOATS, 0.3, -0.4)
    np.testing.assert_allclose(np.dot(normal, normal), 1.0, rtol=1e-15)  # rounding
    # both tangents of the surface, (1, 0, h_f) and (0, 1, h_l), lie square to it
    assert np.dot(normal, (1.0, 0.0, 0.3)) == pytest.approx(0.0, abs=1e-16)
    assert np.dot(normal, (0.0, 1.0, -0.4)) == pytest.approx(0.0, abs=1e-16)
    # under a plane the depth square to it is its distance
    assert point.penetration(FLOATS, 0.5, normal) == pytest.approx(0.5 / np.sqrt(1.25), rel=1e-15)
    # a foot that spins about an axis through the point leaves the point where it is
    arm = (0.4, 0.1, -0.2)
    assert point.point_velocity(FLOATS, (0.0, 0.0, 0.0), arm, arm, (0.0, 0.0, 0.0)) == (0.0, 0.0, 0.0)
    assert point.sinking_rate(FLOATS, tuple(-2.0 * x for x in normal), normal) == pytest.approx(2.0, rel=1e-15)
    force, moment = point.point_wrench(FLOATS, 700.0, normal, arm)
    np.testing.assert_allclose(force, 700.0 * np.array(normal), rtol=1e-15)
    np.testing.assert_allclose(moment, cross(arm, force), rtol=1e-15)


def test_depth_changes_at_the_rate_of_sinking() -> None:
    """On curved snow the depth of a moving point changes at its rate where the point lies on the snow."""
    given = random_arguments(point.point_in_snow, 3)
    given["snow"] = (0.0, *given["snow"][1:])
    _, sinking = point.point_in_snow(FLOATS, *given.values())
    table = linearised(point.point_in_snow, given)
    by = {place: table[0, column] for column, place in enumerate(columns(point.point_in_snow))}
    depth = sum(by[("shift", i)] * given["velocity"][i] for i in range(3))
    depth += sum(by[("turn", i)] * given["spin"][i] for i in range(3))
    depth += sum(by[("reach", i)] * given["bending"][i] for i in range(3))
    assert depth == pytest.approx(sinking, rel=1e-13)  # rounding


def test_axes_of_a_foot() -> None:
    normal = point.snow_normal(FLOATS, 0.1, 0.2)
    edge = 0.6
    level, forward = np.array(normal), np.cross([0.0, 1.0, 0.0], normal)
    forward /= np.linalg.norm(forward)
    left = np.cross(level, forward)
    # a ski rolled about its own long axis, its left side up
    rolled = np.cos(edge) * left + np.sin(edge) * level
    frame = np.stack([forward, rolled, np.cross(forward, rolled)], axis=1)
    along, across, angle = point.ski_axes(FLOATS, normal, frame)
    np.testing.assert_allclose(along, forward, atol=1e-15)  # rounding
    np.testing.assert_allclose(across, left, atol=1e-15)
    assert angle == pytest.approx(edge, rel=1e-14)
    # the load's share square to the sole is its cosine, the friction's across the ski its sine
    friction, sole = point.foot_forces(FLOATS, 700.0, 0.0, -50.0, normal, along, across, frame)
    np.testing.assert_allclose(friction, -50.0 * left, atol=1e-13)
    assert sole == pytest.approx(700.0 * np.cos(edge) + 50.0 * np.sin(edge), rel=1e-14)
