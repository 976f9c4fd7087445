"""A steady wind."""

from sssi_exudyn.contact.terms.wind import Wind
from sssi_exudyn.model.model import Model
from sssi_exudyn.validation.diagnosis.hypothesis import Distinction, FittedRun, Numbers, SteadyLaw, by_sign


class SteadyWind(SteadyLaw):
    """A wind that blows all the time; the formula is that of ``Wind``."""

    name = Wind.name
    caption = "a steady wind"
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


def wind_in_words(numbers: Numbers) -> str:
    """Strength and direction of a wind."""
    down, left = numbers["w_f"].value, numbers["w_l"].value
    parts = [f"{abs(down):.1f} m/s {by_sign(down, 'down', 'up')} the slope"]
    if abs(left) > 0.5:
        parts.append(f"{abs(left):.1f} m/s to the {by_sign(left, 'left', 'right')}")
    return " and ".join(parts)
