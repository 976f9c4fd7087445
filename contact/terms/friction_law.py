"""Friction along the ski as a polynomial of the local state, for measured runs that no law of the list describes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, Final

from sssi_exudyn.contact.maths import Math, Number
from sssi_exudyn.contact.term import FootState, FootTerm
from sssi_exudyn.contact.terms.friction import AnisotropicFriction
from sssi_exudyn.contact.terms.friction_corrections import SMALL, more_friction
from sssi_exudyn.core.quantity import quantity

VARIABLES: Final = ("speed", "edge", "load", "slip", "place")
"""Variables of the law, by the names that its numbers begin with."""
POWERS: Final[dict[str, dict[str, int]]] = {
    **{f"{name}{power if power > 1 else ''}": {name: power} for name in VARIABLES for power in (1, 2)},
    "speed_edge": {"speed": 1, "edge": 1},
    "speed_load": {"speed": 1, "load": 1},
    "edge_load": {"edge": 1, "load": 1},
}
"""Every product of the sum, by the name that follows ``c_`` in its coefficient: powers of its variables."""
KNOWN: Final = 3.0
"""Scales from its reference beyond which a variable is held: a polynomial must not be continued to where nothing was
measured.
"""
_LARGEST_RISE: Final = 0.6
"""Largest increase of mu_t by the law, as for a patch of snow."""


def _coefficient(of: str) -> Any:  # Any: as for ``quantity``
    """Declare the coefficient of a product."""
    return quantity(
        0.0,
        "1",
        low=-0.3,
        high=0.3,
        source="regression on runs: docs/theory/diagnosis.md",
        meaning=f"change of mu_t by {of}",
    )


def _reference(default: float, unit: str, high: float, of: str, low: float = 0.0) -> Any:
    """Declare the reference that a variable is counted from."""
    return quantity(default, unit, low=low, high=high, source="mean over the runs", meaning=f"{of} it is counted from")


def _scale(default: float, unit: str, low: float, high: float, of: str) -> Any:
    """Declare the unit that a variable is counted in."""
    about = "standard deviation over the runs"
    return quantity(default, unit, low=low, high=high, source=about, meaning=f"difference of {of} that counts as one")


@dataclass(frozen=True)
class FrictionLaw(FootTerm):
    """Friction that changes with speed, edge angle, load, slip and place, with a coefficient for each product.

    Formula: f_t = −Δμ·ΣF_N·sign(v_t),   Δμ = Σ c·(products of one or two x),   x = (z − z_ref)/z_scale within ±3

    z is the speed |v|, the edge angle's size, the load ΣF_N, the slip |v_n|/|v| or the place f down the fall line.
    """

    name: ClassVar[str] = "friction_law"
    corrects: ClassVar[str] = AnisotropicFriction.name
    sources: ClassVar[tuple[str, ...]] = (
        "regression on several runs of a day (docs/theory/diagnosis.md); laws as sparse sums of a library's functions:"
        " S. L. Brunton et al., PNAS 113 (2016) 3932",
    )

    c_speed: float = _coefficient("speed")
    c_speed2: float = _coefficient("speed squared")
    c_edge: float = _coefficient("edge angle")
    c_edge2: float = _coefficient("edge angle squared")
    c_load: float = _coefficient("load")
    c_load2: float = _coefficient("load squared")
    c_slip: float = _coefficient("slip")
    c_slip2: float = _coefficient("slip squared")
    c_place: float = _coefficient("place")
    c_place2: float = _coefficient("place squared")
    c_speed_edge: float = _coefficient("speed times edge angle")
    c_speed_load: float = _coefficient("speed times load")
    c_edge_load: float = _coefficient("edge angle times load")
    speed_ref: float = _reference(8.0, "m/s", 50.0, "speed")
    speed_scale: float = _scale(2.0, "m/s", 0.05, 50.0, "speed")
    edge_ref: float = _reference(0.35, "rad", 1.4, "edge angle")
    edge_scale: float = _scale(0.2, "rad", 0.005, 1.4, "edge angle")
    load_ref: float = _reference(400.0, "N", 5e3, "load")
    load_scale: float = _scale(200.0, "N", 5.0, 5e3, "load")
    slip_ref: float = _reference(0.1, "1", 1.0, "slip")
    slip_scale: float = _scale(0.1, "1", 0.001, 1.0, "slip")
    place_ref: float = _reference(0.0, "m", 1e4, "place down the fall line", low=-1e4)
    place_scale: float = _scale(30.0, "m", 0.5, 1e4, "place")

    def variables(self, math: Math, state: FootState) -> dict[str, Number]:
        """Return the law's variables, by the names in ``VARIABLES``, in their units."""
        speed = math.sqrt(state.v_t * state.v_t + state.v_n * state.v_n + SMALL * SMALL)
        return {
            "speed": speed,
            "edge": math.absolute(state.edge),
            "load": state.load,
            "slip": math.absolute(state.v_n) / speed,
            "place": state.f,
        }

    def change(self, math: Math, state: FootState) -> Number:
        """Return Δμ (1)."""
        x = {}
        for name, value in self.variables(math, state).items():
            apart = (value - getattr(self, f"{name}_ref")) / getattr(self, f"{name}_scale")
            x[name] = math.maximum(math.minimum(apart, KNOWN), -KNOWN)
        total: Number = 0.0
        for name, powers in POWERS.items():
            product: Number = getattr(self, f"c_{name}")
            for variable, power in powers.items():
                for _ in range(power):
                    product = product * x[variable]
            total = total + product
        return math.minimum(total, _LARGEST_RISE)

    def force(self, math: Math, state: FootState) -> tuple[Number, Number]:
        return more_friction(math, state, self.change(math, state))
