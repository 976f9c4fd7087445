"""A law found from data is what it is made of, and is not continued to where nothing was measured."""

from dataclasses import replace

import pytest

from sssi_exudyn.contact.maths import FloatMath
from sssi_exudyn.contact.term import FootState
from sssi_exudyn.contact.terms.friction_corrections import (
    EdgeDependentFriction,
    LoadDependentFriction,
    SpeedDependentFriction,
)
from sssi_exudyn.contact.terms.friction_law import KNOWN, FrictionLaw

MATHS = FloatMath()
STATE = FootState(load=700.0, v_t=9.0, v_n=-0.4, edge=-0.5, groove=1e-3, t=0.0, f=40.0, l=0.5, side=1.0)


def test_by_default_it_does_nothing() -> None:
    assert FrictionLaw().force(MATHS, STATE) == (0.0, 0.0)


def test_one_product_of_the_first_power_is_a_law_of_the_list() -> None:
    laws = {
        FrictionLaw(c_speed=0.03, speed_ref=8.0, speed_scale=2.0): SpeedDependentFriction(b=0.015, v_ref=8.0),
        FrictionLaw(c_edge=-0.02, edge_ref=0.3, edge_scale=0.2): EdgeDependentFriction(b=-0.1, edge_ref=0.3),
        FrictionLaw(c_load=0.01, load_ref=400.0, load_scale=200.0): LoadDependentFriction(b=0.02, load_ref=400.0),
    }
    for general, named in laws.items():
        assert general.force(MATHS, STATE) == pytest.approx(named.force(MATHS, STATE), rel=1e-12)


def test_products_of_two_variables_and_the_others() -> None:
    law = FrictionLaw(
        c_slip=0.02, c_place2=-0.01, c_speed_edge=0.03,
        speed_ref=8.0, speed_scale=1.0, edge_ref=0.3, edge_scale=0.1,
        slip_ref=0.02, slip_scale=0.04, place_ref=30.0, place_scale=20.0,
    )  # fmt: skip
    speed = (9.0**2 + 0.4**2) ** 0.5
    expected = 0.02 * (0.4 / speed - 0.02) / 0.04 - 0.01 * 0.5**2 + 0.03 * (speed - 8.0) * 2.0
    assert law.change(MATHS, STATE) == pytest.approx(expected, rel=1e-6)  # its speed is smoothed by a mm/s


@pytest.mark.parametrize("name", ["speed2", "place"])
def test_it_stays_as_it_is_beyond_what_was_measured(name: str) -> None:
    law = FrictionLaw(**{f"c_{name}": 0.02})
    border = {"speed2": {"v_t": 8.0 + KNOWN * 2.0, "v_n": 0.0}, "place": {"f": KNOWN * 30.0}}[name]
    far = {key: 5.0 * value for key, value in border.items()}
    at_border, beyond = (law.change(MATHS, replace(STATE, **some)) for some in (border, far))
    assert beyond == pytest.approx(at_border, rel=1e-6)  # its speed is smoothed by a mm/s
    assert at_border == pytest.approx(0.02 * KNOWN ** (2 if name == "speed2" else 1), rel=1e-6)
