"""A gust of wind."""

from typing import Final

import numpy as np

from sssi_exudyn.contact.terms.wind import Gust
from sssi_exudyn.core.frames import Array
from sssi_exudyn.model.model import Model
from sssi_exudyn.validation.diagnosis.hypotheses.air.wind import plain_wind, wind_in_words
from sssi_exudyn.validation.diagnosis.hypotheses.hypothesis import Distinction, InTime, Numbers


class PassingGust(InTime):
    """A wind that comes and goes; the formula is that of ``Gust``.

    Meteorologists count means over 3 s as gusts; what comes and goes within a second is none.
    """

    name = Gust.name
    kind = "physics"
    comes_again = False
    through_air = True
    caption = "a gust of wind"
    smallest = "a gust of {value:.1f} m/s"
    plain_smallest = "a gust of {kmh:.0f} km/h"
    keys = ("w_f", "w_l")
    scale, longest, least = 5.0, 0.5, 4
    rises = (1.0, 0.4)
    distinctions = (Distinction(("unexplained_force", "snow_patch"), "a second run over the same place"),)
    _STRONGEST: Final = 20.0  # m/s, Beaufort 8 to 9: lifts stand still
    _SHORTEST: Final = 1.0  # s

    def possible(self, model: Model) -> bool:
        gusts = [term for term in model.terms if isinstance(term, Gust)]
        peak = max(np.hypot(term.w_f, term.w_l) for term in gusts)
        return bool(peak <= self._STRONGEST and min(term.t1 - term.t0 for term in gusts) >= self._SHORTEST)

    def part(self, t0: float, t1: float, rise: float) -> Gust:
        return Gust(t0=t0, t1=t1, rise=rise)

    def cell(self, t0: float, t1: float) -> Gust:
        half = 0.5 * (t1 - t0)  # swells of twice a cell's length, one a cell, add up to one
        return Gust(t0=t0 - half, t1=t1 + half)

    def profile(self, share: Array, rise: float) -> Array:
        inwards = np.minimum(share, 1.0 - share)
        return np.asarray(0.5 * (1.0 - np.cos(np.pi * np.minimum(2.0 * inwards / rise, 1.0))))

    def sentence(self, numbers: Numbers, model: Model) -> str:
        return f"a gust blows, {wind_in_words(numbers)} at its peak"

    def plain_words(self, numbers: Numbers, model: Model) -> str:
        return f"a gust blows, at its strongest {plain_wind(numbers)}"
