"""A boot's cuff as a spring, and the estimate of a stiffness that is not stated."""

import numpy as np
import pytest

from sssi_exudyn.bodies.skier.boot import (
    SOFTEST,
    USUAL_SPREAD,
    Cuff,
    FoundCuffs,
    edging_share,
    find_cuffs,
    ski_on_foot,
)

TIME = np.linspace(0.0, 40.0, 4001)
ANGLE = np.column_stack([0.1 + 0.15 * np.sin(TIME), 0.2 + 0.15 * np.cos(TIME)])
MASS = 70.0


def test_a_static_boot_by_hand() -> None:
    """Press a boot of 5 N m/° 6° beyond its lean: it pushes with 30 N m, upwards behind it and downwards ahead."""
    cuff = FoundCuffs(5.0 * 180.0 / np.pi, 0.0, np.radians([14.0, 14.0]))
    assert cuff.moment(np.radians([[20.0, 8.0]])) == pytest.approx(np.array([[-30.0, 30.0]]), rel=1e-12)


def test_a_cuff_gives_its_work_back() -> None:
    cuff = FoundCuffs(250.0, 0.0, np.array([0.1, 0.1]))
    moment = cuff.moment(ANGLE)
    work = np.trapezoid(moment[:, 0], ANGLE[:, 0])
    stored = 0.5 * 250.0 * (ANGLE[[0, -1], 0] - 0.1) ** 2
    # the trapezoid rule is exact for a moment that is linear in the angle
    assert work == pytest.approx(stored[0] - stored[1], abs=1e-9)


def test_what_is_stated_stands() -> None:
    cuffs = find_cuffs(TIME, ANGLE, np.zeros_like(ANGLE), MASS, 300.0, 0.2)
    assert (cuffs.stiffness, cuffs.se) == (300.0, 0.0)
    assert cuffs.lean.tolist() == [0.2, 0.2]


def test_a_stated_stiffness_leaves_the_lean_that_bears_the_mean_moment() -> None:
    moment = np.column_stack([np.full(len(TIME), 30.0), np.full(len(TIME), -15.0)])
    cuffs = find_cuffs(TIME, ANGLE, moment, MASS, 300.0, None)
    assert cuffs.lean - ANGLE.mean(axis=0) == pytest.approx([0.1, -0.05], rel=1e-12)
    assert cuffs.moment(ANGLE).mean(axis=0) == pytest.approx([30.0, -15.0], rel=1e-9)


def test_an_ankle_that_is_a_spring_shows_its_stiffness() -> None:
    """Give all moment to the cuff: the estimate is the mean of its stiffness and the usual one, by their weights."""
    true = FoundCuffs(120.0, 0.0, np.array([0.25, 0.05]))
    cuffs = find_cuffs(TIME, ANGLE, true.moment(ANGLE), MASS, None, None)
    known = 40.0 / (0.5 * MASS) ** 2 * ANGLE.var(axis=0).sum()
    usual = USUAL_SPREAD**-2
    assert cuffs.stiffness == pytest.approx((known * 120.0 + usual * Cuff().cuff_flexion) / (known + usual), rel=1e-9)
    assert cuffs.se == pytest.approx((known + usual) ** -0.5, rel=1e-9)
    assert abs(cuffs.stiffness - 120.0) < 2.0 * cuffs.se


def test_a_moment_that_grows_with_the_angle_is_no_cuffs() -> None:
    cuffs = find_cuffs(TIME, ANGLE, 600.0 * (ANGLE - ANGLE.mean(axis=0)), MASS, None, None)
    assert cuffs.stiffness == SOFTEST


def test_edging_is_shared_by_stiffness() -> None:
    assert edging_share(120.0) == pytest.approx(0.75)
    assert edging_share(3000.0) > 0.98


def test_toes_point_down_on_a_ramp() -> None:
    ski = ski_on_foot(np.radians(3.0))
    assert ski[:, 0] == pytest.approx([np.cos(np.radians(3.0)), 0.0, np.sin(np.radians(3.0))])
    np.testing.assert_allclose(ski @ ski.T, np.eye(3), atol=1e-15)
