"""What is known of friction along the skis beforehand, from the conditions that a recording states.

Glides were measured over a wide range of snow; of temperature and water only the direction is known well, not the
size.  So conditions move the mean within that range, and the spread stays half of it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal

from sssi_exudyn.recording.snow import SnowConditions

_LOW, _HIGH = 0.023, 0.139
"""Least and largest coefficient of more than 200 straight glides on skis (Wolfsperger et al. 2021)."""
_RANGE: Final = "Wolfsperger et al., Front. Mech. Eng. 7 (2021) 728722: 0.023 ± 0.006 to 0.139 ± 0.018"
_MELTING: Final = 273.15
_COLD, _WARM = _MELTING - 5.0, _MELTING - 1.0
"""K, between which friction is low: it is least near -3 °C, and rises below -5 °C and close to 0 °C (Buhl et al. 2001,
The kinetic friction of polyethylen on snow, a tribometer and glides)."""

Condition = Literal["any", "least", "cold", "melting"]


@dataclass(frozen=True)
class GlidePrior:
    """Friction along the skis beforehand.

    mean, sigma : of the coefficient, a normal distribution
    words : the conditions;  source : where the figures come from
    """

    mean: float
    sigma: float
    words: str
    source: str

    @property
    def sentence(self) -> str:
        """Return what a result says of it."""
        return f"friction beforehand: {self.mean:.3f} ± {self.sigma:.3f} for {self.words} ({self.source})"


_SPREAD: Final = 0.5 * (_HIGH - _LOW)
GLIDES: Final[dict[Condition, GlidePrior]] = {
    "any": GlidePrior(0.5 * (_LOW + _HIGH), _SPREAD, "snow of any kind", _RANGE),
    "least": GlidePrior(
        0.75 * _LOW + 0.25 * _HIGH,
        _SPREAD,
        "snow of -5 to -1 °C",
        f"the lower half of {_RANGE}; least near -3 °C: Buhl et al. 2001",
    ),
    "cold": GlidePrior(
        0.25 * _LOW + 0.75 * _HIGH,
        _SPREAD,
        "snow below -5 °C",
        f"the upper half of {_RANGE}; rises below -5 °C: Buhl et al. 2001",
    ),
    "melting": GlidePrior(
        0.25 * _LOW + 0.75 * _HIGH,
        _SPREAD,
        "snow close to melting",
        f"the upper half of {_RANGE}; rises close to 0 °C: Buhl et al. 2001, and with much water: Colbeck 1994",
    ),
}
"""Friction by condition.  Fresh, groomed and icy snow without a temperature are "any": no figures are known of them."""


def glide_prior(snow: SnowConditions | None) -> GlidePrior | None:
    """Return what is known of friction beforehand; None where nothing is stated of the snow.

    The temperature of the air counts where that of the snow is not stated, and only above freezing: snow melts then.
    """
    if snow is None:
        return None
    return GLIDES[_condition(snow)]


def _condition(snow: SnowConditions) -> Condition:
    if snow.kind == "wet":
        return "melting"
    if snow.snow_temperature is None:
        return "melting" if snow.air_temperature is not None and snow.air_temperature > _MELTING else "any"
    if snow.snow_temperature < _COLD:
        return "cold"
    return "least" if snow.snow_temperature <= _WARM else "melting"
