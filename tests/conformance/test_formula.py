"""Formulas over ``Math`` as compiled functions: their values, their derivatives, and arguments that are zero."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from sssi_exudyn.contact.codegen.compiled import compile_kernel
from sssi_exudyn.contact.codegen.formula import formula
from sssi_exudyn.contact.conformance_states import ComplexMath
from sssi_exudyn.contact.maths import FloatMath, Math, Number, Vector

pytestmark = pytest.mark.usefixtures("own_cache")

MODULE = """
from __future__ import annotations

from sssi_exudyn.contact.codegen.formula import formula
from sssi_exudyn.contact.maths import Math, Number, Rotation, Vector, cross, plus


@formula(by=("angle", "arm", "frame", "turn"))
def turned(math: Math, angle: Number, arm: Vector, frame: Rotation, turn: Vector = (0.0, 0.0, 0.0)):
    out = tuple(sum(frame[i, j] * arm[j] for j in range(3)) for i in range(3))
    out = plus(out, cross(turn, out))
    return math.atan2(out[1], out[0]) + angle, (math.cos(angle) * out[2], math.maximum(out[0], 0.0) ** 2, angle)


@formula()
def twice(_math: Math, angle: Number):
    return 2.0 * angle
"""
ANGLE, ARM, FRAME = 0.4, (0.3, -0.2, 0.7), np.array([[0.8, -0.6, 0.1], [0.6, 0.8, 0.0], [0.0, 0.2, 1.0]])


def _module(folder: Path) -> ModuleType:
    path = folder / "some_formulas.py"
    path.write_text(MODULE, encoding="utf-8")
    spec = importlib.util.spec_from_file_location("some_formulas", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.long
def test_values_and_derivatives_of_a_formula(tmp_path: Path) -> None:
    module = _module(tmp_path)
    kernel = compile_kernel(module)
    expected = module.turned(FloatMath(), ANGLE, ARM, FRAME)
    value, by = kernel.turned_derivatives(ANGLE, ARM, FRAME)
    for given in (kernel.turned(ANGLE, ARM, FRAME), value):
        assert given[0] == pytest.approx(expected[0], rel=1e-14)  # rounding
        assert given[1] == pytest.approx(expected[1], rel=1e-14)
    numbers = np.concatenate([[ANGLE], ARM, FRAME.ravel(), np.zeros(3)])
    table = np.full((4, 16), np.nan)
    kernel.turned_linearisation(ANGLE, ARM, FRAME, table)
    for j in range(16):
        moved = numbers.astype(complex)
        moved[j] += 1e-30j
        angle, vector = module.turned(ComplexMath(), moved[0], moved[1:4], moved[4:13].reshape(3, 3), moved[13:])
        np.testing.assert_allclose(table[:, j], np.imag([angle, *vector]) / 1e-30, rtol=1e-13, atol=1e-15)  # rounding
    # the structure of the result, and of each argument where it has numbers
    by_angle, by_arm, by_frame, by_turn = by
    assert [by_angle[0], *by_angle[1]] == list(table[:, 0])
    for first, nested in ((1, by_arm), (4, by_frame), (13, by_turn)):
        rows = np.array([nested[0], *nested[1]])
        np.testing.assert_array_equal(rows, table[:, first : first + rows.shape[1]])


def test_a_formula_without_variables_has_its_value_alone(tmp_path: Path) -> None:
    kernel = compile_kernel(_module(tmp_path))
    assert kernel.twice(0.3) == 0.6
    assert not hasattr(kernel, "twice_derivatives")


def test_what_a_formula_cannot_be() -> None:
    def nothing(_math: Math, x: Number) -> Number:
        return x

    def unknown(_math: Math, x: float) -> Vector:
        return x, x, x

    with pytest.raises(ValueError, match="nothing has no argument y"):
        formula(by=("y",))(nothing)
    with pytest.raises(TypeError, match="unknown: x must be annotated"):
        formula()(unknown)
