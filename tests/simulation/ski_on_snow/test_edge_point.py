"""The point of an edge that cuts: its derivatives against differences, and what turning the whole scene changes."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from inspect import signature
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sssi_exudyn.contact.codegen.compiled import compile_kernel
from sssi_exudyn.contact.codegen.formula import Formula
from sssi_exudyn.contact.maths import FloatMath
from sssi_exudyn.core.frames import Array
from sssi_exudyn.simulation.ski_on_snow import edge_point
from sssi_exudyn.simulation.ski_on_snow.edge_point import edge_axes, edge_state, flat_edge, turned_edge

WIDTH = 0.07


@cache
def kernel() -> Any:
    return compile_kernel(edge_point)


def floats(vector: Array) -> tuple[float, ...]:
    return tuple(float(x) for x in vector)


def some_edge(seed: int) -> dict[str, Any]:
    """A ski's edge at random, as ``turned_edge`` takes it: 5 mm in the snow, the other edge in it or over it."""
    rng = np.random.default_rng(seed)
    tangent = np.array([1.0, 0.1, 0.05]) + 0.1 * rng.normal(size=3)
    return {
        "height": 0.01,
        "velocity": floats(np.array([10.0, 0.5, -0.2]) * rng.normal(1.0, 0.3, 3)),
        "spin": floats(rng.normal(size=3)),
        "arm": floats(np.array([0.4, 0.03, -0.015]) + 1e-3 * rng.normal(size=3)),
        "other": floats(np.array([0.4, -0.03, rng.uniform(-0.014, 0.03)])),
        "tangent": floats(tangent),
        "bending": floats(0.1 * rng.normal(size=3)),
        "width": WIDTH,
        "side": float(rng.choice([-1.0, 1.0])),
        "turn": (0.0, 0.0, 0.0),
    }


def snow_coming(seed: int) -> dict[str, Any]:
    """What ``arriving_memory`` takes, the snow between two stations."""
    rng = np.random.default_rng(seed)
    groove, offset = (tuple(rng.normal(scale=1e-3, size=2).tolist()) for _ in range(2))
    drift = tuple(rng.normal(scale=0.5, size=3).tolist())
    given = {"along": (0.5, 0.52, 0.03), "step": 2.5e-3, "speed": rng.uniform(9.0, 18.0)}
    return given | {"groove": groove, "offset": offset, "drift": drift}


def in_order(formula: Formula, given: dict[str, Any]) -> list[Any]:
    """The arguments as the formula lists them."""
    return [given[name] for name in list(signature(formula.function).parameters)[1:]]


def values(formula: Formula, given: dict[str, Any]) -> Array:
    return np.array(formula(FloatMath(), *in_order(formula, given)))


def differences(formula: Formula, given: dict[str, Any], step: float) -> Array:
    """(outputs, variables) by central differences of the formula over floats; each variable moves by a share ``step``
    of itself, or of 1e-2 where it is less.
    """
    columns = []
    for name in formula.by:
        value = np.atleast_1d(np.array(given[name], dtype=float))
        for i in range(len(value)):
            shift = np.zeros(len(value))
            shift[i] = step * max(abs(value[i]), 1e-2)
            ends = []
            for sign in (1.0, -1.0):
                moved = value + sign * shift
                ends.append(values(formula, given | {name: floats(moved) if len(moved) > 1 else float(moved[0])}))
            columns.append((ends[0] - ends[1]) / (2.0 * shift[i]))
    return np.array(columns).T


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize(
    ("name", "make"), [("turned_edge", some_edge), ("arriving_memory", snow_coming)], ids=["edge", "memory"]
)
def test_generated_derivatives_are_those_of_differences(
    name: str, make: Callable[[int], dict[str, Any]], seed: int
) -> None:
    formula, given = getattr(edge_point, name), make(seed)
    exact = np.full(differences(formula, given, 1e-3).shape, np.nan)
    arguments = in_order(formula, given)
    # the turn is the last one of ``turned_edge``, and none of the compiled function's
    getattr(kernel(), f"{name}_linearisation")(*(arguments[:-1] if "turn" in given else arguments), exact)
    scale = np.abs(exact).max(axis=1, keepdims=True)
    coarse, fine = (np.abs(differences(formula, given, step) - exact) / scale for step in (2e-2, 1e-2))
    # central differences are of second order: halving the step leaves a quarter of what they are off, until rounding
    curved = fine.max(axis=1) > 1e-9
    assert np.all(coarse[fine <= 1e-9] < 1e-6)
    np.testing.assert_allclose(coarse.max(axis=1)[curved] / fine.max(axis=1)[curved], 4.0, rtol=0.1)


def test_a_turned_scene_has_the_same_depths_velocities_and_angles() -> None:
    """The plane z = 0 and a plane that is tilted with all that stands on it."""
    for seed in range(6):
        given = some_edge(seed)
        tangent = np.array(given["tangent"]) / np.linalg.norm(given["tangent"])
        low, high = -0.005, 0.01 * seed - 0.004
        expected = flat_edge(
            FloatMath(), low, high, floats(tangent), given["velocity"], given["width"], given["side"]
        )  # fmt: skip
        tilt = Rotation.random(random_state=seed).as_matrix()
        normal = floats(tilt[:, 2])
        place, other = (floats(tilt @ [0.3, 0.2, z]) for z in (low, high))
        turned = edge_state(
            FloatMath(), place, other, floats(tilt @ tangent), floats(tilt @ given["velocity"]), normal, normal,
            given["width"], given["side"],
        )  # fmt: skip
        np.testing.assert_allclose(turned, expected, rtol=1e-12, atol=1e-14)  # rounding


def test_a_mirrored_edge_slips_and_leans_to_the_other_side() -> None:
    for seed in range(6):
        given = some_edge(seed)
        mirrored = given | {
            name: floats(np.array(given[name]) * [1.0, -1.0, 1.0])
            for name in ("velocity", "arm", "other", "tangent", "bending")
        }
        mirrored |= {"spin": floats(np.array(given["spin"]) * [-1.0, 1.0, -1.0]), "side": -given["side"]}
        signs = [1.0, 1.0, 1.0, 1.0, -1.0, 1.0, -1.0, -1.0]  # v_n, edge angle and direction change their signs
        np.testing.assert_allclose(
            values(turned_edge, mirrored), signs * values(turned_edge, given), rtol=1e-12, atol=1e-14
        )


def test_axes_along_and_across_an_edge() -> None:
    t, n = edge_axes(FloatMath(), (2.0, 0.0, 0.5), (0.0, 0.0, 1.0))
    np.testing.assert_allclose([t, n], [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], atol=1e-15)


@pytest.mark.parametrize("angle_deg", [0.0, 10.0, 60.0, 90.0])
def test_a_section_stands_at_the_angle_of_its_depths(angle_deg: float) -> None:
    apart = WIDTH * np.sin(np.radians(angle_deg))
    for side in (-1.0, 1.0):
        state = flat_edge(FloatMath(), -0.02, apart - 0.02, (1.0, 0.0, 0.0), (9.0, 0.0, 0.0), WIDTH, side)
        assert state[-1] == pytest.approx(side * np.radians(angle_deg), abs=1e-7)  # the sine is flat at 90 degrees
