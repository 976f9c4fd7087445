"""The conformance tests find terms that break the contract, one rule each."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any, ClassVar

import numpy as np
import pytest

from sssi_exudyn.contact import conformance
from sssi_exudyn.contact.codegen.tape import Tape
from sssi_exudyn.contact.maths import Math, Number, Vector
from sssi_exudyn.contact.term import FootState, PointState, SegmentState, SegmentTerm, Term
from sssi_exudyn.contact.terms.air import AirDrag
from sssi_exudyn.contact.terms.friction import AnisotropicFriction
from sssi_exudyn.contact.terms.friction_corrections import SpeedDependentFriction
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


class Flat(SegmentTerm):
    name: ClassVar[str] = "flat"
    sources: ClassVar[tuple[str, ...]] = ("made up",)

    def force(self, math: Math, state: SegmentState) -> Vector:
        f, l, n = AirDrag().force(math, state)  # noqa: E741
        return f, l, 0.5 * n


class Slanted(AirDrag):
    def force(self, math: Math, state: SegmentState) -> Vector:
        f, l, n = super().force(math, state)  # noqa: E741
        return f, 0.5 * l, n


class Cornered(AirDrag):
    def force(self, math: Math, state: SegmentState) -> Vector:
        speed = math.sqrt(sum(x * x for x in state.velocity))  # infinitely steep at rest
        return tuple(-speed * x * state.area for x in state.velocity)  # type: ignore[return-value]


@pytest.mark.parametrize(
    ("test", "broken", "error"),
    [
        (conformance.does_not_branch, Branching, TypeError),
        (conformance.is_continuous, Jumping, AssertionError),
        (conformance.snow_never_pulls, Sticky, AssertionError),
        (conformance.nothing_without_contact, Floating, AssertionError),
        (conformance.force_is_in_proportion_to_length, PerPoint, AssertionError),
        (conformance.takes_energy_only, Driving, AssertionError),
        (conformance.mirrored_ski_mirrored_force, Lopsided, AssertionError),
        (conformance.turned_world_turned_force, Flat, AssertionError),
        (conformance.turned_world_turned_force, Slanted, AssertionError),
        pytest.param(conformance.compiled_derivatives_are_right, Cornered, AssertionError, marks=pytest.mark.long),
    ],
    ids=lambda value: getattr(value, "__name__", ""),
)
def test_a_broken_term_is_caught(test: Callable[[type[Any]], None], broken: type[Any], error: type[Exception]) -> None:
    with pytest.raises(error), np.errstate(all="ignore"):
        test(broken)


class Bare(SpeedDependentFriction):
    """A law without a formula in words."""


class Stepping(SpeedDependentFriction):
    """Branches by Python's own word.

    Formula: none without load
    """

    def force(self, math: Math, state: FootState) -> tuple[Number, Number]:
        return super().force(math, state) if state.load > 0.0 else (0.0, 0.0)


class Pushing(AnisotropicFriction):
    """Friction that drives.

    Formula: f_t = +mu_t·ΣF_N
    """

    def force(self, math: Math, state: FootState) -> tuple[Number, Number]:
        along, across = super().force(math, state)
        return -along, across


@pytest.mark.long
def test_check_term_says_which_rules_were_kept_or_broken() -> None:
    assert {"does_not_branch", "linearisation_is_exact"} <= set(conformance.check_term(SpeedDependentFriction))
    for broken, message in (
        (Bare, "Bare: declares what it is: no line of its docstring begins with Formula"),
        (Stepping, "Stepping: does not branch: a force term must not branch on a number"),
        (Pushing, "Pushing: takes energy only"),
        (Term, "is no force term"),
        (3, "is no force term"),
    ):
        with pytest.raises(conformance.BrokenRule, match=message):
            conformance.check_term(broken)  # type: ignore[arg-type]


def test_numbers_of_a_law_know_what_they_cannot() -> None:
    tape = Tape()
    x = tape.name("x")
    for use in (lambda: np.arcsinh(x), lambda: np.multiply(x, 2.0, where=True), lambda: np.round(x, 2)):
        with pytest.raises(TypeError, match="cannot use numpy"):
            use()
    with pytest.raises(TypeError, match="single numbers"):
        np.array([1.0, 2.0]) * x
    with pytest.raises(TypeError, match="must not branch"):
        bool(x > 0.0)
    with pytest.raises(TypeError, match=r"cannot use numpy\.where"):
        np.where(x, 1.0, 2.0)
