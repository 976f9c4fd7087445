"""A patch of other snow is friction with other coefficients, where it lies."""

import pytest

from sssi_exudyn.contact.maths import FloatMath
from sssi_exudyn.contact.term import FootState
from sssi_exudyn.contact.terms.friction import AnisotropicFriction
from sssi_exudyn.contact.terms.friction_corrections import SnowPatch

SNOW = AnisotropicFriction(mu_t=0.08, mu_n=0.7)
PATCH = SnowPatch(delta_mu_t=0.05, f0=10.0, f1=30.0, delta_mu_n=-0.2)
MATHS = FloatMath()


def on_snow_at(f: float) -> FootState:
    return FootState(load=700.0, v_t=9.0, v_n=-0.4, edge=0.3, groove=1e-3, t=0.0, f=f, l=0.5, side=1.0)


@pytest.mark.parametrize(("f", "mu_t", "mu_n"), [(0.0, 0.08, 0.7), (20.0, 0.13, 0.5), (40.0, 0.08, 0.7)])
def test_both_coefficients_change_within_it_alone(f: float, mu_t: float, mu_n: float) -> None:
    state = on_snow_at(f)
    along, across = (a + b for a, b in zip(SNOW.force(MATHS, state), PATCH.force(MATHS, state), strict=True))
    # ten lengths of its edge away a smooth window is 0 or 1 to rounding
    assert (along, across) == pytest.approx(AnisotropicFriction(mu_t, mu_n).force(MATHS, state), rel=1e-9)
