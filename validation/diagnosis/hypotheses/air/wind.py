"""A wind that blows all the time."""

from __future__ import annotations

from typing import Final

from sssi_exudyn.contact.terms.wind import SWELLS, Wind
from sssi_exudyn.model.model import Model
from sssi_exudyn.validation.diagnosis.hypotheses.hypothesis import Distinction, FittedRun, Numbers, SteadyLaw, by_sign

_TURBULENCE: Final = 1.0
"""m/s; standard deviation along a wind of the usual 4 m/s, by I·(0.75·V + 5.6 m/s) with I = 0.12 (IEC 61400-1)."""
_EVERY: Final = 2.5
"""s at least between the times at which a wind may be stronger or weaker: what is shorter is a gust."""


class SteadyWind(SteadyLaw):
    """A wind that blows all the time, and swells and falls as winds do; the formula is that of ``Wind``.

    Over several runs its mean is the same.
    """

    name = Wind.name
    caption = "a wind"
    through_air = True
    amplitudes = (("w_f", 4.0), ("w_l", 4.0))
    distinctions = (
        Distinction(
            ("drag_area", "speed_dependent_friction"),
            "an anemometer on the slope, or the same skier at another speed or posture on the same snow",
        ),
    )

    def part(self, fitted: FittedRun) -> Wind:
        begin, end = fitted.time_edges[[0, -1]].tolist()
        return Wind(begin=begin, every=(end - begin) / (_swells_between(begin, end) - 1))

    def own_amplitudes(self, fitted: FittedRun) -> tuple[tuple[str, float], ...]:
        count = _swells_between(*fitted.time_edges[[0, -1]].tolist())
        return tuple((key, _TURBULENCE) for key in SWELLS[:count])

    def sentence(self, numbers: Numbers, model: Model) -> str:
        return f"a wind blows, {wind_in_words(numbers)}{_changes(numbers, 1.0, 'm/s', 1)}"

    def plain_words(self, numbers: Numbers, model: Model) -> str:
        return f"a wind blows, {plain_wind(numbers)}{_changes(numbers, 3.6, 'km/h', 0)}"


def _swells_between(begin: float, end: float) -> int:
    """Return how many times there are, in a run from ``begin`` to ``end`` (s), at which a wind may be stronger."""
    return min(len(SWELLS), max(2, 1 + int((end - begin) / _EVERY)))


def wind_in_words(numbers: Numbers) -> str:
    """Return strength (m/s) and direction of a wind."""
    return _in_words(numbers, 1.0, "m/s", 1)


def plain_wind(numbers: Numbers) -> str:
    """Return the same in km/h."""
    return _in_words(numbers, 3.6, "km/h", 0)


def _in_words(numbers: Numbers, factor: float, unit: str, digits: int) -> str:
    down, left = numbers["w_f"].value, numbers["w_l"].value
    parts = [f"{abs(factor * down):.{digits}f} {unit} {by_sign(down, 'down', 'up')} the slope"]
    if abs(left) > 0.5:
        parts.append(f"{abs(factor * left):.{digits}f} {unit} to the {by_sign(left, 'left', 'right')}")
    return " and ".join(parts)


def _changes(numbers: Numbers, factor: float, unit: str, digits: int) -> str:
    """Return words for how much a wind swells and falls; none where that is little."""
    swells = [numbers[key].value for key in SWELLS if key in numbers]
    less, more = min(swells, default=0.0), max(swells, default=0.0)
    if more - less < _TURBULENCE:
        return ""
    return f", which swells and falls by {factor * 0.5 * (more - less):.{digits}f} {unit}"
