"""Properties of the published model's terms, for whatever state and parameters within their bounds."""

from __future__ import annotations

import math as library
from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sssi_exudyn.contact.maths import FloatMath
from sssi_exudyn.contact.term import FootState, PointState, SegmentState
from sssi_exudyn.contact.terms.air import AirDrag, FrontalAreas
from sssi_exudyn.contact.terms.friction import AnisotropicFriction
from sssi_exudyn.contact.terms.penetration import HuntCrossley
from sssi_exudyn.core.quantity import quantities

MATH = FloatMath()
DEPTHS = st.floats(-0.2, 0.2)
RATES = st.floats(-5.0, 5.0)
SPEEDS = st.floats(-40.0, 40.0)
VELOCITIES = st.tuples(SPEEDS, SPEEDS, SPEEDS)


def _any(cls: type[Any]) -> st.SearchStrategy[Any]:
    return st.builds(cls, **{name: st.floats(q.low, q.high) for name, q in quantities(cls).items()})


def _foot(load: float, v_t: float, v_n: float) -> FootState:
    return FootState(load, v_t, v_n, edge=0.0, groove=0.0, t=0.0, f=0.0, l=0.0, side=1.0)


@pytest.mark.long
@given(_any(HuntCrossley), DEPTHS, RATES)
def test_snow_pushes_only_where_it_is_pressed(law: HuntCrossley, depth: float, rate: float) -> None:
    force = law.force(MATH, PointState(depth, rate, 0.033))
    assert force >= 0.0
    assert depth > 0.0 or force == 0.0


@given(_any(HuntCrossley), st.floats(0.0, 0.2), st.floats(0.0, 0.2), st.floats(0.0, 5.0))
def test_deeper_is_harder_while_sinking(law: HuntCrossley, one: float, other: float, rate: float) -> None:
    less, more = sorted((one, other))
    forces = [law.force(MATH, PointState(depth, rate, 0.033)) for depth in (less, more)]
    assert forces[0] <= forces[1] * (1.0 + 1e-14)  # rounding of the powers


@given(_any(HuntCrossley), st.floats(0.0, 0.2), RATES, RATES)
def test_the_damper_resists(law: HuntCrossley, depth: float, one: float, other: float) -> None:
    slower, faster = sorted((one, other))
    assert law.force(MATH, PointState(depth, slower, 0.033)) <= law.force(MATH, PointState(depth, faster, 0.033)) * (
        1.0 + 1e-14  # rounding of the powers
    )


@given(_any(AnisotropicFriction), st.floats(0.0, 5e3), SPEEDS, SPEEDS)
def test_friction_is_bounded_by_its_coefficients(law: AnisotropicFriction, load: float, v_t: float, v_n: float) -> None:
    along, across = law.force(MATH, _foot(load, v_t, v_n))
    assert abs(along) <= law.mu_t * load * (1.0 + 1e-15)  # rounding
    assert abs(across) <= law.mu_n * load * (1.0 + 1e-15)
    assert along * v_t + across * v_n <= 0.0


@given(st.floats(1.0, 40.0))
def test_friction_of_a_gliding_ski_is_coulombs(v_t: float) -> None:
    # 1 − v/√(v² + ε²) < ε²/(2 v²)
    along, across = AnisotropicFriction().force(MATH, _foot(800.0, v_t, 0.0))
    assert along == pytest.approx(-0.1 * 800.0, rel=0.1**2 / (2.0 * v_t**2))
    assert across == 0.0


@given(SPEEDS, SPEEDS)
def test_friction_of_the_paper_is_smoothed_by_the_slip_speed(v_t: float, v_n: float) -> None:
    law = AnisotropicFriction()
    _, across = law.force(MATH, _foot(800.0, v_t, v_n))
    # rounding of the powers
    assert across == pytest.approx(-law.mu_n * 800.0 * v_n / library.hypot(v_n, law.eps), rel=1e-12, abs=1e-9)


@given(st.floats(2.0, 30.0), st.floats(-0.3, 0.3), st.floats(1.0, 3.0))
def test_friction_smoothed_by_the_slip_angle_depends_on_it_alone(v_t: float, angle: float, faster: float) -> None:
    law = AnisotropicFriction(eps=0.001, slip=0.02)
    one, other = (law.force(MATH, _foot(800.0, v, v * library.tan(angle)))[1] for v in (v_t, faster * v_t))
    # ε changes the force by ε²/(2 (τ v)²) of it at most: (0.001/0.04)²/2
    assert one == pytest.approx(other, rel=3.2e-4)


def test_sharper_friction_reaches_its_coefficient_earlier() -> None:
    forces = [
        AnisotropicFriction(sharpness=sharpness).force(MATH, _foot(1.0, 10.0, 0.3))[1] for sharpness in (1.0, 2.0, 8.0)
    ]
    # by hand for a slip of three times ε: u/(1 + u^p)^(1/p)
    assert forces == pytest.approx([-0.5 * 0.75, -0.5 * 3.0 / 10.0**0.5, -0.5 * 3.0 / 6562.0**0.125], rel=1e-12)


@given(_any(AirDrag), VELOCITIES, VELOCITIES)
def test_drag_depends_on_the_relative_wind_only(
    law: AirDrag, velocity: tuple[float, ...], wind: tuple[float, ...]
) -> None:
    relative = tuple(w - v for w, v in zip(wind, velocity, strict=True))
    moving = law.force(MATH, SegmentState(velocity, wind, 0.05))
    assert moving == law.force(MATH, SegmentState((0.0, 0.0, 0.0), relative, 0.05))


@given(_any(AirDrag), st.floats(0.1, 40.0), st.floats(0.0, library.tau), st.floats(0.01, 0.3))
def test_drag_is_the_formula(law: AirDrag, speed: float, heading: float, area: float) -> None:
    velocity = (speed * library.cos(heading), speed * library.sin(heading), 0.0)
    along_f, along_l, up = law.force(MATH, SegmentState(velocity, (0.0, 0.0, 0.0), area))
    # the smoothing of 10⁻⁶ m/s counts 10⁻¹⁰/2 at the slowest speed here
    assert library.hypot(along_f, along_l) == pytest.approx(0.5 * law.c_d * law.rho * area * speed**2, rel=1e-10)
    assert up == pytest.approx(0.5 * law.c_l * law.rho * area * speed**2, rel=1e-10)


@given(_any(AirDrag), VELOCITIES, st.floats(0.01, 0.3))
def test_lift_does_no_work_in_still_air(law: AirDrag, velocity: tuple[float, ...], area: float) -> None:
    state = SegmentState(velocity, (0.0, 0.0, 0.0), area)
    lifted, plain = law.force(MATH, state), replace(law, c_l=0.0).force(MATH, state)
    lift = [one - other for one, other in zip(lifted, plain, strict=True)]
    power = sum(one * other for one, other in zip(lift, velocity, strict=True))
    speed = library.hypot(*velocity)
    # below 0.5 N·(speed in m/s)² of drag is taken away again, to 16 digits
    assert abs(power) <= 1e-12 * (1.0 + speed**3)
    across = library.hypot(velocity[0], velocity[1])
    assert library.hypot(*lift) == pytest.approx(
        0.5 * abs(law.c_l) * law.rho * area * speed * across, rel=1e-9, abs=1e-12 * (1.0 + speed**2)
    )


def test_air_acts_on_fourteen_segments_in_proportion_to_height_squared() -> None:
    small, tall = (FrontalAreas().of_height(height) for height in (1.75, 2.0 * 1.75))
    assert len(small) == 14
    assert sum(small.values()) == pytest.approx(0.060 + 0.170 + 2.0 * (0.055 + 0.045 + 0.012 + 0.030 + 0.020 + 0.008))
    assert tall == {segment: pytest.approx(4.0 * area) for segment, area in small.items()}
