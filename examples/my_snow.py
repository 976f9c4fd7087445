"""A friction law of one's own, and the hypothesis that it acts: a plug-in.

sssi --plugin examples/my_snow.py terms
sssi --plugin examples/my_snow.py fit examples/beginner --term wet_snow --parameter wet_snow.c --out results/wet
sssi --plugin examples/my_snow.py diagnose examples/beginner --out results/wet_diagnosis
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

import sssi_exudyn
from sssi_exudyn import quantity


@dataclass(frozen=True)
class WetSnow(sssi_exudyn.FootTerm):
    """Suction of a water film: friction along the ski that rises with the square of the speed.

    Formula: f_t = −c·v_t²·ΣF_N·sign(v_t)
    """

    name: ClassVar[str] = "wet_snow"
    corrects: ClassVar[str] = "friction"
    sources: ClassVar[tuple[str, ...]] = ("an example, not a published law",)

    c: float = quantity(0.0, "s^2/m^2", low=0.0, high=0.01, source="chosen", meaning="rise with the speed's square")

    def force(self, math, state):
        return -self.c * np.square(state.v_t) * state.load * math.saturate(state.v_t, 0.1), 0.0


class FrictionOfWetSnow(sssi_exudyn.SteadyLaw):
    """That the snow is so wet."""

    name = "wet_snow"
    caption = "suction of a water film"
    amplitudes = (("c", 0.0005),)

    def part(self, fitted):
        return WetSnow()

    def sentence(self, numbers, model):
        return f"the snow is wet: μ_t rises by {numbers['c'].value:.5f} times the speed's square"
