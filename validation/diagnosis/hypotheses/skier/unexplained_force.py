"""A force that no known law explains."""

import numpy as np

from sssi_exudyn.contact.terms.body_forces import UnexplainedForce
from sssi_exudyn.core.frames import Array
from sssi_exudyn.model.model import Model
from sssi_exudyn.validation.diagnosis.hypotheses.hypothesis import FreeFormForce, Numbers, as_weight, by_sign


class LatentForce(FreeFormForce):
    """A force in any direction for a while, which stands for all that the list does not know; the formula is that of
    ``UnexplainedForce``.
    """

    name = UnexplainedForce.name
    kind = "unexplained"
    comes_again = False
    caption = "a force that no known law explains"
    keys = ("force_f", "force_l", "force_n")
    scale, longest, least = 80.0, 0.4, 1

    def part(self, t0: float, t1: float, rise: float) -> UnexplainedForce:
        return UnexplainedForce(t0=t0, t1=t1)

    def cell(self, t0: float, t1: float) -> UnexplainedForce:
        return self.part(t0, t1, 1.0)

    def profile(self, share: Array, rise: float) -> Array:
        return np.ones(len(share))

    def sentence(self, numbers: Numbers, model: Model) -> str:
        return (
            f"a force acts that no known law explains: {numbers['force_f'].value:+.0f} N down the slope, "
            f"{numbers['force_l'].value:+.0f} N to the left, {numbers['force_n'].value:+.0f} N away from the snow"
        )

    def plain_words(self, numbers: Numbers, model: Model) -> str:
        force = np.array([numbers[key].value for key in self.keys])
        largest = int(np.argmax(np.abs(force)))
        ways = ("down the slope", "up the slope"), ("to the left", "to the right"), ("off the snow", "into the snow")
        return (
            "something pushes the skier that none of the known causes explains, "
            f"{as_weight(np.linalg.norm(force).item())}, most of it {by_sign(force[largest], *ways[largest])}"
        )
