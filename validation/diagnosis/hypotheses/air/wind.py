"""A steady wind."""

from sssi_exudyn.contact.terms.wind import Wind
from sssi_exudyn.model.model import Model
from sssi_exudyn.validation.diagnosis.hypotheses.hypothesis import Distinction, FittedRun, Numbers, SteadyLaw, by_sign


class SteadyWind(SteadyLaw):
    """A wind that blows all the time; the formula is that of ``Wind``."""

    name = Wind.name
    caption = "a steady wind"
    through_air = True
    amplitudes = (("w_f", 4.0), ("w_l", 4.0))
    distinctions = (
        Distinction(
            ("drag_area", "speed_dependent_friction"),
            "an anemometer on the slope, or the same skier at another speed or posture on the same snow",
        ),
    )

    def part(self, fitted: FittedRun) -> Wind:
        return Wind()

    def sentence(self, numbers: Numbers, model: Model) -> str:
        return f"a steady wind blows, {wind_in_words(numbers)}"

    def plain_words(self, numbers: Numbers, model: Model) -> str:
        return f"a steady wind blows, {plain_wind(numbers)}"


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
