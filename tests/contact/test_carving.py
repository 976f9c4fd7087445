"""The law of edges that cut: its closed forms, and what its memory keeps."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sssi_exudyn.contact.maths import FloatMath
from sssi_exudyn.contact.registry import PAPER_TERMS, TERMS, check_together, combine_terms
from sssi_exudyn.contact.term import EdgeState
from sssi_exudyn.contact.terms.carving import Carving
from sssi_exudyn.core.errors import InputError

MATH = FloatMath()
LAW = Carving()
WIDTH, LENGTH = 0.07, 0.02


def section(depth: float, edge_deg: float, **others: float) -> EdgeState:
    """A section whose deeper edge is at ``depth`` (m), edged by so much, the right edge deeper where that is > 0."""
    edge = np.radians(edge_deg).item()
    upper = depth - WIDTH * abs(np.sin(edge)).item()
    state = EdgeState(depth, upper, 0.0, WIDTH, 0.0, 0.0, 1e-3, 10.0, 0.0, 0.0, edge, LENGTH)
    return replace(state, **others)


@pytest.mark.parametrize("edge_deg", [10.0, 30.0, -60.0])
def test_an_edge_displaces_a_wedge_of_snow(edge_deg: float) -> None:
    normal, _, _, upper = LAW.force(MATH, section(4e-3, edge_deg))
    wedge = 0.5 * LAW.hardness * 4e-3**2 / np.tan(np.radians(abs(edge_deg)))
    assert normal == pytest.approx(wedge * LENGTH, rel=1e-12)  # rounding
    # the wedge's centre is a third of its width from the edge
    assert upper * WIDTH == pytest.approx(normal * 4e-3 / np.sin(np.radians(abs(edge_deg))) / 3.0, rel=1e-12)


def test_a_flat_base_displaces_a_block() -> None:
    normal, _, _, upper = LAW.force(MATH, section(1e-3, 0.0))
    assert normal == pytest.approx(LAW.hardness * WIDTH * 1e-3 * LENGTH, rel=1e-6)  # d is held at 10⁻⁹ m
    assert upper == pytest.approx(0.5 * normal, rel=1e-6)


def test_friction_is_on_the_resultant() -> None:
    state = section(4e-3, 60.0, offset=1e-4)
    normal, along, across, _ = LAW.force(MATH, state)
    # ε of 0.1 m/s takes 5·10⁻⁵ off at 10 m/s, the smoothing of the resultant less
    assert along == pytest.approx(-LAW.mu * np.hypot(normal, across), rel=1e-4)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_sideslip_shears_the_wall_and_throws_snow_aside(side: float) -> None:
    # an edge that slips towards its base for long: the wall has yielded
    state = section(3e-3, 30.0 * side, offset=0.1 * side, v_n=2.0 * side, v_t=0.0)
    across = LAW.force(MATH, state)[2]
    assert across == pytest.approx(-side * (LAW.strength * 3e-3 + LAW.density * 3e-3 * 4.0) * LENGTH, rel=1e-12)
    away = LAW.force(MATH, replace(state, offset=-0.1 * side, v_n=0.0))[2]
    assert away == pytest.approx(side * LAW.inside * LAW.strength * 3e-3 * LENGTH, rel=1e-12)


def test_an_edge_that_rises_in_its_groove_presses_less_and_then_not_at_all() -> None:
    groove = 5e-3
    loads = [
        LAW.force(MATH, section(groove - risen, 45.0, groove=groove))[0]
        for risen in (0.0, 0.5 * LAW.recovery, LAW.recovery, 2e-3)
    ]
    assert loads[1] == pytest.approx(0.5 * loads[0], rel=1e-12)
    assert loads[2:] == pytest.approx([0.0, 0.0], abs=1e-9)  # N; 0.5 mm is no exact difference of 5 and 4.5


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("edge_deg", [30.0, 60.0])
def test_an_edge_that_rises_leaves_the_walls_of_its_groove(edge_deg: float, side: float) -> None:
    # a groove of the ski's own shape: one wall as steep as the base, the other square to it
    groove, risen, tangent = 5e-3, 1.5e-3, np.tan(np.radians(edge_deg)).item()
    state = section(groove - risen, edge_deg * side, groove=groove)
    base, other = (risen - LAW.recovery) / tangent, risen * tangent
    for apart in (0.99 * base, -0.99 * other):
        assert LAW.force(MATH, replace(state, offset=side * apart))[2] == 0.0
        assert LAW.remember(MATH, replace(state, offset=side * apart))[1] == side * apart  # it moves freely there
    for apart in (base + 1e-4, -other - 1e-4):
        across = LAW.force(MATH, replace(state, offset=side * apart))[2]
        stiffness = LAW.strength * 2e-3 / LAW.yield_offset
        assert across == pytest.approx(-side * np.sign(apart) * 1e-4 * stiffness * LENGTH, rel=1e-9)
    pressed = replace(state, lower=groove - 0.5 * LAW.recovery, offset=side * 1e-4)
    assert side * LAW.force(MATH, pressed)[2] < 0.0  # for as long as it presses, the base touches its wall


def test_a_wall_that_an_edge_in_play_reaches_yields_from_there() -> None:
    state = section(3e-3, 45.0, groove=4e-3, offset=5e-3)
    yields = 3e-3 * LAW.yield_offset / 2e-3  # k_s·(U − play) = S_f·a
    assert LAW.remember(MATH, state)[1] == pytest.approx(1e-3 - LAW.recovery + yields, rel=1e-12)


def test_the_wall_moves_with_an_edge_that_skids() -> None:
    held = LAW.remember(MATH, section(3e-3, 30.0, offset=2e-4, v_n=0.0))[1]
    skidding = LAW.remember(MATH, section(3e-3, 30.0, offset=2e-4, v_n=5.0))[1]
    assert held == pytest.approx(2e-4, rel=1e-12)
    assert skidding == pytest.approx(3e-3 * LAW.yield_offset / 2e-3, rel=1e-12)  # k_s·U = S_f·a


def test_a_wall_bears_no_more_than_it_can_though_thrown_snow_resists_too() -> None:
    held, skidding = section(3e-3, 30.0, offset=2e-4), section(3e-3, 30.0, offset=2e-4, v_n=5.0)
    most, borne = LAW.capacity(MATH, held)
    assert borne == pytest.approx(abs(LAW.force(MATH, held)[2]), rel=1e-12)  # at rest nothing is thrown
    assert 0.0 < borne < most
    most, borne = LAW.capacity(MATH, skidding)
    assert borne == pytest.approx(most, rel=1e-12)
    thrown = LAW.density * 3e-3 * 5.0**2 * skidding.length
    assert -LAW.force(MATH, skidding)[2] == pytest.approx(most + thrown, rel=1e-12)


def test_sideslip_leaves_the_groove() -> None:
    deep = section(2e-3, 45.0, groove=6e-3, step=1e-3)
    staying = LAW.remember(MATH, deep)[0]
    leaving = LAW.remember(MATH, replace(deep, v_n=1.0))[0]
    gone = LAW.remember(MATH, replace(deep, v_n=1e3))[0]
    assert staying == pytest.approx(6e-3, rel=1e-12)
    assert leaving == pytest.approx(2e-3 + 4e-3 * np.exp(-1e-3 / (2e-3 + 5e-3)), rel=1e-12)  # 2 mm wide at 45°
    assert gone == pytest.approx(2e-3, rel=1e-12)


def test_an_edge_that_climbs_compacts_snow() -> None:
    level, climbing, sinking = (LAW.force(MATH, section(3e-3, 30.0, rise=rise)) for rise in (0.0, 0.02, -0.02))
    assert level[1] - climbing[1] == pytest.approx(0.02 * level[0], rel=1e-3)  # ε, twice
    assert sinking[1] == level[1]


def test_it_stands_in_the_place_of_the_papers_laws() -> None:
    assert [term.name for term in combine_terms(PAPER_TERMS, (LAW,))] == ["air", "carving"]
    with pytest.raises(
        InputError, match=r"model.toml: \[\[term\]\] 1: penetration: carving stands in the place of all"
    ):
        check_together((*PAPER_TERMS, LAW), "model.toml")


def test_no_term_is_listed_twice() -> None:
    assert len({cls.name for cls in TERMS}) == len(TERMS)
