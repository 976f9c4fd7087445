"""The families of worlds, and the answers that they are examples of."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from sssi_exudyn.validation.diagnosis.diagnosis_data import NOTHING_MISSING
from sssi_exudyn.validation.diagnosis.hypotheses.hypothesis import Hypothesis
from sssi_exudyn.validation.diagnosis.thresholds import Thresholds
from sssi_exudyn.validation.diagnosis.worlds.family import Unlisted, WorldFamily
from sssi_exudyn.validation.diagnosis.worlds.geometry import Geometry
from sssi_exudyn.validation.diagnosis.worlds.laws import LawWorlds, NothingHidden, TwoAtOnce
from sssi_exudyn.validation.diagnosis.worlds.unlisted.body_process import WanderingForce
from sssi_exudyn.validation.diagnosis.worlds.unlisted.body_pulse import Pulse
from sssi_exudyn.validation.diagnosis.worlds.unlisted.foot_force import OneSki
from sssi_exudyn.validation.diagnosis.worlds.unlisted.friction_course import CourseOfFriction
from sssi_exudyn.validation.diagnosis.worlds.unlisted.side_force import AlternatingForce
from sssi_exudyn.validation.diagnosis.worlds.unlisted.speed_force import PowerOfSpeed

UNLISTED: Final[tuple[Unlisted, ...]] = (
    WanderingForce(),
    Pulse(),
    OneSki(),
    CourseOfFriction(),
    PowerOfSpeed(),
    AlternatingForce(),
)
"""Causes that no hypothesis describes."""
NOT_IN_THE_LIST: Final = "not_in_the_list"
TWO_AT_ONCE: Final = "two_at_once"
"""Names of answers that are no hypothesis'."""


@dataclass(frozen=True)
class Answer:
    """An answer with the families of its worlds, its prior probability, and the share of all worlds that are its."""

    name: str
    families: tuple[WorldFamily, ...]
    prior: float
    share: float


def answers_of(
    geometry: Geometry,
    hypotheses: Sequence[Hypothesis],
    thresholds: Thresholds,
    unlisted: Sequence[Unlisted] = UNLISTED,
) -> list[Answer]:
    """Return what may be hidden in a run: nothing, each law or fault that an instrument would show, two of them, and
    what is not in the list.
    """
    seen = [hypothesis for hypothesis in hypotheses if hypothesis.name in geometry.candidates]
    laws = [LawWorlds(hypothesis) for hypothesis in seen if hypothesis.kind != "unexplained"]
    of_unknown = [LawWorlds(hypothesis) for hypothesis in seen if hypothesis.kind == "unexplained"]
    weights = [family.hypothesis.weight for family in laws]
    unknown, pair = thresholds.world_unlisted, thresholds.world_pair if len(laws) > 1 else 0.0
    known = (1.0 - thresholds.nothing) / (sum(weights) + unknown + pair)
    shapes = [hypothesis for hypothesis in seen if hypothesis.shapes_snow]
    nothing = NothingHidden(shapes, thresholds.natural)
    answers = [Answer(NOTHING_MISSING, (nothing,), thresholds.nothing, 0.15)]
    if laws:
        answers += [
            Answer(family.name, (family,), weight * known, 0.5 / len(laws))
            for family, weight in zip(laws, weights, strict=True)
        ]
    answers.append(Answer(NOT_IN_THE_LIST, (*unlisted, *of_unknown), unknown * known, 0.25))
    if pair:
        answers.append(Answer(TWO_AT_ONCE, (TwoAtOnce(laws, TWO_AT_ONCE),), pair * known, 0.1))
    return answers
