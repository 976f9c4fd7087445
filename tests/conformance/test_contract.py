"""The conformance tests catch what they are there for: terms that break the contract, one rule each."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import test_conformance

from sssi_exudyn.contact.maths import Math, Number, Vector
from sssi_exudyn.contact.term import FootState, PointState, SegmentState
from sssi_exudyn.contact.terms.air import AirDrag
from sssi_exudyn.contact.terms.friction import AnisotropicFriction
from sssi_exudyn.contact.terms.penetration import HuntCrossley

pytestmark = pytest.mark.usefixtures("own_cache")


class Branching(HuntCrossley):
    def force(self, math: Math, state: PointState) -> Number:
        return super().force(math, state) if state.depth > 0.0 else 0.0


class Jumping(HuntCrossley):
    def force(self, math: Math, state: PointState) -> Number:
        return super().force(math, state) + math.where(state.depth, 1.0, 0.0)


class Sticky(HuntCrossley):
    def force(self, math: Math, state: PointState) -> Number:
        return super().force(math, state) - self.k * math.maximum(state.depth, 0.0) * state.length


class Floating(HuntCrossley):
    def force(self, math: Math, state: PointState) -> Number:
        return super().force(math, state) + 1.0


class PerPoint(HuntCrossley):
    def force(self, math: Math, state: PointState) -> Number:
        return super().force(math, dataclasses.replace(state, length=0.033))


class Driving(AnisotropicFriction):
    def force(self, math: Math, state: FootState) -> tuple[Number, Number]:
        along, across = super().force(math, state)
        return -along, across


class Lopsided(AnisotropicFriction):
    def force(self, math: Math, state: FootState) -> tuple[Number, Number]:
        along, across = super().force(math, state)
        return along * (2.0 + math.sin(state.edge)), across


class Flat(AirDrag):
    def force(self, math: Math, state: SegmentState) -> Vector:
        f, l, n = super().force(math, state)  # noqa: E741
        return f, l, 0.5 * n


class Cornered(AirDrag):
    def force(self, math: Math, state: SegmentState) -> Vector:
        speed = math.sqrt(sum(x * x for x in state.velocity))  # infinitely steep at rest
        return tuple(-speed * x * state.area for x in state.velocity)  # type: ignore[return-value]


@pytest.mark.parametrize(
    ("test", "broken", "error"),
    [
        (test_conformance.test_does_not_branch, Branching, TypeError),
        (test_conformance.test_is_continuous, Jumping, AssertionError),
        (test_conformance.test_snow_never_pulls, Sticky, AssertionError),
        (test_conformance.test_nothing_without_contact, Floating, AssertionError),
        (test_conformance.test_force_is_in_proportion_to_length, PerPoint, AssertionError),
        (test_conformance.test_takes_energy_only, Driving, AssertionError),
        (test_conformance.test_mirrored_ski_mirrored_force, Lopsided, AssertionError),
        (test_conformance.test_turned_world_turned_force, Flat, AssertionError),
        (test_conformance.test_compiled_derivatives_are_right, Cornered, AssertionError),
    ],
    ids=lambda value: getattr(value, "__name__", ""),
)
def test_a_broken_term_is_caught(test: Callable[[type[Any]], None], broken: type[Any], error: type[Exception]) -> None:
    with pytest.raises(error), np.errstate(all="ignore"):
        test(broken)
