"""The surface's spline against functions with known derivatives, its borders, and the patch under a ski."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sssi_exudyn.core.frames import Array
from sssi_exudyn.terrain.surface import PATCH, Surface, surface_over

WAVE = 2.0 * np.pi / np.array([30.0, 17.0])
"""Wave numbers, 1/m, of a wave of 30 m down the slope and 17 m across."""


def hill(places: Array) -> Array:
    """Return the patches (n, PATCH) of h = cos(k·x)."""
    phase = places @ WAVE
    c, s = np.cos(phase), np.sin(phase)
    k, q = WAVE
    return np.stack([c, -k * s, -q * s, -k * k * c, -k * q * c, -q * q * c], axis=1)


def sampled(spacing: float) -> Surface:
    empty = surface_over(np.array([[0.0, -10.0], [60.0, 10.0]]), spacing, 10.0)
    heights = hill(empty.nodes())[:, 0].reshape(empty.mean.shape)
    return replace(empty, mean=heights)


def inside(count: int = 200) -> Array:
    rng = np.random.default_rng(3)
    return np.stack([rng.uniform(0.0, 60.0, count), rng.uniform(-10.0, 10.0, count)], axis=1)


def test_nodes_are_met() -> None:
    surface = sampled(2.0)
    heights = surface.at(surface.nodes())[:, 0]
    np.testing.assert_allclose(heights, surface.heights.ravel(), atol=1e-12)  # rounding of the spline's filter


@pytest.mark.parametrize(("column", "order"), [(0, 4), (1, 3), (2, 3), (3, 2), (4, 2), (5, 2)])
def test_values_and_derivatives_converge_at_the_splines_order(column: int, order: int) -> None:
    # A cubic spline's height converges with the fourth power of the spacing, each derivative with one less (the first
    # a little faster between nodes).
    errors = [np.max(np.abs(sampled(d).at(inside())[:, column] - hill(inside())[:, column])) for d in (2.0, 1.0)]
    assert errors[0] / errors[1] > 0.8 * 2.0**order


def test_derivatives_are_those_of_the_height() -> None:
    surface, places, step = sampled(2.0), inside(), 1e-4
    patches = surface.at(places)
    for axis in range(2):
        move = step * np.eye(2)[axis]
        ahead, behind = surface.at(places + move), surface.at(places - move)
        # rounding of a difference: 1e-16/1e-4; its own error: third derivatives of 0.05 times 1e-8
        np.testing.assert_allclose((ahead - behind)[:, 0] / (2 * step), patches[:, 1 + axis], atol=2e-9)
        # the second derivative has kinks at the nodes, which a step may straddle
        by_slopes = (ahead - behind)[:, 1:3] / (2 * step)
        np.testing.assert_allclose(by_slopes, patches[:, [3 + axis, 4 + axis]], atol=5e-6)


def test_beyond_the_border_it_goes_on_level() -> None:
    surface = sampled(2.0)
    low = np.array(surface.origin)
    at, beyond = surface.at(np.array([[low[0], 0.0]])), surface.at(np.array([[low[0] - 7.0, 0.0]]))
    assert beyond[0, 0] == pytest.approx(at[0, 0], abs=1e-12)
    assert beyond[0, [1, 3, 4]] == pytest.approx(0.0)
    # no step of the slope where the border is crossed
    just = surface.at(np.array([[low[0] + 1e-6, 0.0]]))
    assert abs(just[0, 1]) < 1e-6


def test_a_patch_is_the_surface_under_a_ski() -> None:
    # The steepest waves of a groomed slope: 5 m long, 20 mm high (slope 2.5 %); a ski of 1.65 m in any direction.
    k = 2.0 * np.pi / 5.0
    rng = np.random.default_rng(1)
    surface = surface_over(np.array([[0.0, 0.0], [20.0, 20.0]]), 0.5, 5.0)
    surface = replace(surface, mean=0.02 * np.cos(k * surface.nodes()[:, 0]).reshape(surface.mean.shape))
    middle = rng.uniform(3.0, 17.0, (100, 2))
    angle = rng.uniform(0.0, 2.0 * np.pi, 100)
    arm = np.linspace(-0.825, 0.825, 21)[:, None, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    h, f, l, ff, fl, ll = surface.at(middle).T  # noqa: E741
    x, y = arm[..., 0], arm[..., 1]
    by_patch = h + f * x + l * y + 0.5 * (ff * x * x + 2.0 * fl * x * y + ll * y * y)
    exact = surface.at((middle + arm).reshape(-1, 2))[:, 0].reshape(by_patch.shape)
    # third order: 0.02·k³·0.825³/6 = 3.7 mm at the very tips, 0.5 mm over the half that carries
    tips = np.max(np.abs(by_patch - exact))
    carrying = np.max(np.abs(by_patch - exact)[5:16])
    assert tips < 4e-3
    assert carrying < 6e-4
    assert surface.at(middle).shape == (100, PATCH)
