"""A wind that blows all the time."""

from __future__ import annotations

from typing import Final

import numpy as np

from sssi_exudyn.contact.terms.wind import Wind
from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.number_ref import NumberRef
from sssi_exudyn.fitting.evidence import Freedom
from sssi_exudyn.model.model import Model, add_part, name_in_model
from sssi_exudyn.validation.diagnosis.hypotheses.hypothesis import (
    Candidate,
    Distinction,
    FittedRun,
    Numbers,
    Probe,
    SteadyLaw,
    by_sign,
    probes_by,
)

_SWELLS: Final = ("f_1", "f_2", "f_3", "f_4", "f_5", "f_6")
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
        return Wind(begin=begin, every=(end - begin) / (len(self._swells(fitted)) - 1))

    def _swells(self, fitted: FittedRun) -> tuple[str, ...]:
        """Return names of the numbers by which the wind changes in a run."""
        begin, end = fitted.time_edges[[0, -1]].tolist()
        return _SWELLS[: max(2, 1 + int((end - begin) / _EVERY))]

    def probes(self, fitted: FittedRun) -> list[Probe]:
        keys = [key for key, _ in self.amplitudes]
        return probes_by(fitted.model, self.part(fitted), [*keys, *self._swells(fitted)])

    def candidates(self, fitted: FittedRun, responses: Array) -> list[Candidate]:
        part, swells = self.part(fitted), self._swells(fitted)
        owner = name_in_model(fitted.model, part)
        names = tuple((NumberRef.of(owner, key),) for key in (*(key for key, _ in self.amplitudes), *swells))
        free = Freedom(responses, np.concatenate([self.scales, np.full(len(swells), _TURBULENCE)]))
        return [Candidate(add_part(fitted.model, part), free, names)]

    def sentence(self, numbers: Numbers, model: Model) -> str:
        return f"a wind blows, {wind_in_words(numbers)}{_changes(numbers, 1.0, 'm/s', 1)}"

    def plain_words(self, numbers: Numbers, model: Model) -> str:
        return f"a wind blows, {plain_wind(numbers)}{_changes(numbers, 3.6, 'km/h', 0)}"


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
    swells = [numbers[key].value for key in _SWELLS if key in numbers]
    less, more = min(swells, default=0.0), max(swells, default=0.0)
    if more - less < _TURBULENCE:
        return ""
    return f", which swells and falls by {factor * 0.5 * (more - less):.{digits}f} {unit}"
