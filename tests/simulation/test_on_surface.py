"""Runs on a snow surface: against the plane turned, against a law of the same shape, full and reduced model."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np
import pytest
from gliding import CROUCH, INCLINATION, model, standing
from random_states import forces_of, random_state

from sssi_exudyn.bodies.skier.chain import PRESCRIBED, average_geometry
from sssi_exudyn.contact.registry import PAPER_TERMS
from sssi_exudyn.contact.terms.friction import AnisotropicFriction
from sssi_exudyn.contact.terms.penetration import HuntCrossley
from sssi_exudyn.contact.terms.terrain import TerrainBump
from sssi_exudyn.core.choices import Backend
from sssi_exudyn.core.frames import Array, slope_to_level
from sssi_exudyn.motion.motion import Motion, spline_motion
from sssi_exudyn.simulation.assembly import Parts
from sssi_exudyn.simulation.full.run import simulate
from sssi_exudyn.simulation.reduced.derivatives import run_tangents
from sssi_exudyn.simulation.reduced.prepared import prepare
from sssi_exudyn.simulation.reduced.run import simulate_reduced
from sssi_exudyn.terrain.surface import Surface, surface_over

SNOW: Final = (HuntCrossley(), AnisotropicFriction(mu_t=0.08, mu_n=0.6))
STEEPER: Final = 0.04
"""rad"""


def shaped(height: Array, empty: Surface) -> Surface:
    return replace(empty, mean=height.reshape(empty.mean.shape))


def around(spacing: float, margin: float = 10.0) -> Surface:
    return surface_over(np.array([[-2.0, -3.0], [25.0, 3.0]]), spacing, margin)


def hill(spacing: float = 1.0) -> Surface:
    """Waves of 9 and 25 m, 3 and 20 cm high, with two modes."""
    empty = around(spacing)
    f, l = empty.nodes().T  # noqa: E741
    height = 0.03 * np.sin(0.6 * f + 0.3 * l) + 0.2 * np.sin(0.25 * f - 0.1 * l + 1.0)
    modes = np.stack([0.05 * np.cos(0.3 * f + 0.2 * l), 0.02 * f * 0.1 + 0.03 * np.sin(0.5 * l)])
    surface = shaped(height, empty)
    return replace(surface, modes=modes.reshape(2, *surface.mean.shape), amounts=(0.0, 0.7))


def leaning(seconds: float, inclination: float) -> Motion:
    """``gliding.standing`` with the soles on snow that is steeper, on a plane of the inclination (rad)."""
    angles = dict.fromkeys(PRESCRIBED, 0.0)
    for name, value in CROUCH.items():
        angles[f"{name}_l"] = angles[f"{name}_r"] = float(np.radians(value))
    angles["pelvis_tilt"] = -(INCLINATION + STEEPER)
    time = np.linspace(0.0, seconds, 60)
    return spline_motion(
        average_geometry(1.75), inclination, time, np.tile([angles[name] for name in PRESCRIBED], (60, 1))
    )


def test_a_tilted_surface_is_a_steeper_plane() -> None:
    empty = around(2.0, margin=60.0)
    tilted = shaped(-np.tan(STEEPER) * empty.nodes()[:, 0], empty)
    steep = replace(model(PAPER_TERMS), inclination=float(INCLINATION) + STEEPER)
    on_surface = model(PAPER_TERMS, speed=5.0 * np.cos(STEEPER))
    on_surface = replace(on_surface, surface=tilted)
    ways = []
    for sloped, inclination in ((steep, INCLINATION + STEEPER), (on_surface, INCLINATION)):
        run = simulate_reduced(sloped, prepare(sloped, leaning(1.0, float(inclination))))
        ways.append((run.com - run.com[0]) @ slope_to_level(float(inclination)).T)
    # The world is the same, turned.  What differs is the depth in which the skier stands at the start, where the weight
    # counts along the plane's normal: 1 % of 1 cm.  The tilt itself moves him by 0.2 m.
    np.testing.assert_allclose(ways[1], ways[0], atol=3e-4)


def test_a_surface_is_the_law_of_the_same_shape() -> None:
    bump = TerrainBump(rise=0.3, f0=4.0, width=6.0)
    empty = around(0.5)
    height = bump.rise * np.exp(-0.5 * ((empty.nodes()[:, 0] - bump.f0) / bump.width) ** 2)
    by_law = model((*SNOW, bump))
    by_surface = replace(model(SNOW), surface=shaped(height, empty))
    runs = [simulate_reduced(bumped, prepare(bumped, standing(1.5, heading=0.3))) for bumped in (by_law, by_surface)]
    # what a second-order patch leaves of the bell under a ski's ends: rise·1.4·(0.8/width)³/6 = 0.2 mm
    np.testing.assert_allclose(runs[1].com, runs[0].com, atol=5e-4)
    np.testing.assert_allclose(runs[1].foot_load, runs[0].foot_load, atol=0.03 * 800.0)  # 3 % of the weight


@pytest.mark.parametrize("backend", ["compiled", "numpy", "symbolic"])
def test_every_back_end_is_the_reference_on_a_surface(backend: Backend) -> None:
    on_hill = replace(model(SNOW), surface=hill())
    parts = Parts(on_hill, standing(0.5, heading=0.4, pelvis_list=0.2, hip_adduction_l=0.2))
    reference, other = (forces_of(parts, SNOW, kind) for kind in ("python", backend))
    q, v, at = random_state(parts, 3)
    assert on_hill.surface is not None
    q[2] += float(on_hill.surface.at(q[None, :2])[0, 0]) - 0.05
    expected = reference.evaluate(q, v, at)
    # as on the plane: the same operations in another order
    np.testing.assert_allclose(other.evaluate(q, v, at), expected, atol=1e-12 * np.abs(expected).max())
    assert (reference.seen[:, 0] > 0.0).all()
    place, frame = q[:3] + at.foot_place[0], at.foot_rotation[0]
    flat = forces_of(replace(parts, model=model(SNOW)), SNOW).foot_axes(place, frame)
    for given, same, level in zip(other.foot_axes(place, frame), reference.foot_axes(place, frame), flat, strict=True):
        np.testing.assert_allclose(given, same, atol=1e-14)  # rounding of numbers below 3
        assert not np.allclose(same, level, atol=1e-4)


@pytest.mark.long
def test_the_reduced_model_takes_the_full_models_way_over_a_hill() -> None:
    on_hill = replace(model(SNOW), surface=hill())
    motion = standing(1.5, heading=0.2)
    full = simulate(on_hill, motion)
    reduced = simulate_reduced(on_hill, prepare(on_hill, motion))
    at = np.stack([np.interp(full.time, reduced.time, column) for column in reduced.pelvis.T], axis=1)
    apart = np.linalg.norm(at - full.pelvis, axis=1)
    flat = simulate_reduced(replace(on_hill, surface=None), prepare(on_hill, motion))
    # as on the plane, where the skis' bending is the difference: millimetres; the hill itself moves him by far more
    assert apart.max() < 0.01
    assert np.linalg.norm(flat.pelvis[-1] - reduced.pelvis[-1]) > 0.05


def test_derivatives_on_a_surface_are_those_of_runs() -> None:
    on_hill = replace(model(PAPER_TERMS), surface=hill())
    prepared = prepare(on_hill, standing(1.0, heading=0.2))
    names = ["surface.mode_1", "surface.mode_2", "friction.mu_t", "start.f", "start.velocity_l", "start.heading_offset"]
    slopes = run_tangents(on_hill, prepared, names)[1]
    for i, name in enumerate(names):

        def way(x: float, name: str = name) -> Array:
            changed = on_hill.with_values({name: on_hill.value(name) + x})
            return simulate_reduced(changed, prepared).pelvis

        wide, narrow = ((way(step) - way(-step)) / (2.0 * step) for step in (2e-4, 1e-4))
        expected = (4.0 * narrow - wide) / 3.0
        # Newton's method leaves 1e-10 m of a difference of 1e-5 m or more
        np.testing.assert_allclose(slopes.pelvis[..., i], expected, atol=1e-4 * np.abs(expected).max(), err_msg=name)
