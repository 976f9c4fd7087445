"""Compiled terms: several at once, derivatives on the surface, kernels, and the cache on disk."""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import ModuleType
from typing import ClassVar

import numpy as np
import pytest
from kernel_template import kernel_template
from term_examples import Ridge, UniformWind

from sssi_exudyn.contact import term as places
from sssi_exudyn.contact.codegen.compiled import (
    compile_body,
    compile_foot,
    compile_kernel,
    compile_point,
    compile_segment,
    compile_terrain,
    compile_wind,
    in_order,
    law_classes,
    law_parameters,
    other_laws_source,
    parameter_index,
    place_parameters,
)
from sssi_exudyn.contact.conformance_states import FACING, ComplexMath, assert_close
from sssi_exudyn.contact.maths import FloatMath, Math, Number, Vector
from sssi_exudyn.contact.registry import PAPER_TERMS, TERMS
from sssi_exudyn.contact.term import FootState, PlaceState, PointState, SegmentState, Term, WindTerm
from sssi_exudyn.contact.terms.air import AirDrag
from sssi_exudyn.contact.terms.friction import AnisotropicFriction
from sssi_exudyn.contact.terms.friction_corrections import SnowPatch
from sssi_exudyn.contact.terms.penetration import HuntCrossley
from sssi_exudyn.contact.terms.wind import DragArea, Gust
from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.quantity import quantities, quantity

pytestmark = pytest.mark.usefixtures("own_cache")


@pytest.mark.long
def test_terms_of_one_place_add_up_each_with_its_own_parameters() -> None:
    first, second = HuntCrossley(k=4e3, c=1e3), HuntCrossley(k=9e3, m1=2.0)
    slow, fast = AnisotropicFriction(mu_t=0.05), AnisotropicFriction(mu_t=0.2, mu_n=0.7, eps=0.5)
    terms = (first, slow, second, fast)  # places mixed: the parameters of each must still be its own
    point, foot = compile_point(terms), compile_foot(terms)
    at, on = PointState(0.01, -0.2, 0.02), FootState(700.0, 4.0, -0.3, 0.2, 1e-3, 0.0, 0.0, 0.0, 1.0)
    math = FloatMath()
    np.testing.assert_allclose(
        point.value(point.parameters, 0.01, -0.2, 0.02), first.force(math, at) + second.force(math, at), rtol=1e-14
    )  # rounding
    np.testing.assert_allclose(
        foot.value(foot.parameters, 700.0, 4.0, -0.3, 0.2, 1e-3, 0.0, 0.0, 0.0, 1.0),
        np.add(slow.force(math, on), fast.force(math, on)),
        rtol=1e-14,
    )  # rounding


@pytest.mark.long
def test_winds_add_up_and_blow_on_segments() -> None:
    terms = (UniformWind(w_f=-3.0), AirDrag(), UniformWind(w_f=1.0, w_l=2.0))
    segment, wind = compile_segment(terms), compile_wind(terms)
    assert wind.value(wind.parameters, 0.0, 0.0, 0.0) == (-2.0, 2.0, 0.0)
    expected = AirDrag().force(FloatMath(), SegmentState((10.0, 0.0, 1.0), (-2.0, 2.0, 0.0), 0.06))
    force = segment.value(segment.parameters, 0.0, 0.0, 0.0, 10.0, 0.0, 1.0, 0.06, *[0.0] * 6)
    np.testing.assert_allclose(force, expected, rtol=1e-14)  # rounding


@pytest.mark.long
def test_linearisation_of_several_terms_is_the_sum_of_each() -> None:
    terms = (SnowPatch(0.2, 1.0, 3.0), AnisotropicFriction(mu_t=0.05), SnowPatch(0.1, 2.5, 4.0, delta_mu_n=-0.2))
    state = (700.0, 4.0, -0.3, 0.2, 1e-3, 0.0, 2.0, 0.5, 1.0)

    def of(some: tuple[Term, ...]) -> tuple[Array, Array]:
        foot = compile_foot(some)
        by_state, by_parameter = np.full((2, 7), np.nan), np.zeros((2, len(foot.parameters.values)))
        foot.linearisation(foot.parameters, *state, by_state, by_parameter)
        return by_state, by_parameter

    together, alone = of(terms), [of((term,)) for term in in_order(terms)]
    np.testing.assert_allclose(together[0], sum(by_state for by_state, _ in alone), rtol=1e-14, atol=1e-11)  # rounding
    np.testing.assert_array_equal(together[1], np.hstack([by_parameter for _, by_parameter in alone]))


def test_a_parameter_is_found_where_the_kernels_have_it() -> None:
    wind, patch, last = UniformWind(w_l=2.0), SnowPatch(0.2, 1.0, 3.0), SnowPatch(0.1, 2.5, 4.0)
    terms = (wind, patch, AirDrag(), HuntCrossley(), last)
    values = law_parameters(terms).values
    assert values[parameter_index(terms, wind, "w_l")] == 2.0
    assert [values[parameter_index(terms, term, "f1")] for term in (patch, last)] == [3.0, 4.0]
    assert [values[i] for i in place_parameters(terms, "foot")] == [0.2, 1.0, 3.0, 0.5, 0.0, 0.1, 2.5, 4.0, 0.5, 0.0]
    # the air's first, then the wind's, which is no class of the registry
    assert [values[i] for i in place_parameters(terms, "segment")] == [0.9, 1.05, 0.0, 0.0, 2.0, 0.0]


@dataclass(frozen=True)
class Shear(WindTerm):
    """A wind that differs from place to place."""

    name: ClassVar[str] = "shear"
    sources: ClassVar[tuple[str, ...]] = ("made up for the tests",)

    a: float = quantity(0.3, "1/s", low=0.0, high=1.0, source="made up", meaning="rise down the slope")
    b: float = quantity(0.2, "m/s", low=0.0, high=1.0, source="made up", meaning="greatest wind across")

    def velocity(self, math: Math, state: PlaceState) -> Vector:
        return self.a * state.f, self.b * math.sin(state.l), self.a * self.b * state.t


@pytest.mark.long
def test_linearised_drag_follows_a_wind_of_several_terms_that_changes_from_place_to_place() -> None:
    terms = (Shear(), AirDrag(), Gust(3.0, 1.0, 0.0, 2.0), Shear(0.5, 0.1), DragArea(0.2))
    names = ("t", "f", "l", "v_f", "v_l", "v_n", "area", *FACING)
    numbers = (0.7, 4.0, 0.4, 9.0, 0.5, -0.3, 0.06, 0.0036, 2e-4, -4e-4, 0.0025, 1e-4, 9e-4)
    state = dict(zip(names, numbers, strict=True))
    segment = compile_segment(terms)
    by_state, by_parameter = np.full((3, 5), np.nan), np.zeros((3, len(segment.parameters.values)))
    for _ in range(2):  # what the first has left in the arrays must not count
        segment.linearisation(segment.parameters, *state.values(), by_state, by_parameter)

    def force(some: Sequence[Term], s: Mapping[str, Number]) -> Array:
        math = ComplexMath()
        wind = places.air_velocity(math, some, PlaceState(s["t"], s["f"], s["l"]))
        velocity = s["v_f"], s["v_l"], s["v_n"]
        return np.array(
            places.segment_force(math, some, SegmentState(velocity, wind, s["area"], tuple(s[m] for m in FACING)))
        )

    for column, name in enumerate(("f", "l", "v_f", "v_l", "v_n")):
        expected = force(terms, {**state, name: state[name] + 1e-30j}).imag / 1e-30
        assert_close(by_state[:, column], expected)
    for i, term in enumerate(terms):
        for name in quantities(type(term)):
            moved = replace(term, **{name: getattr(term, name) + 1e-30j})
            expected = force((*terms[:i], moved, *terms[i + 1 :]), state).imag / 1e-30
            assert_close(by_parameter[:, parameter_index(terms, term, name)], expected)


@pytest.mark.long
def test_no_term_is_no_force() -> None:
    nothing = law_parameters(())
    assert compile_point(()).value(nothing, 0.01, 0.1, 0.033) == 0.0
    assert compile_body(()).value(nothing, *[1.0] * 6) == (0.0, 0.0, 0.0)
    assert compile_terrain(()).value(nothing, 1.0, 2.0) == (0.0, 0.0, 0.0)


def test_damping_counts_at_rest() -> None:
    # at rate 0 the law is smooth: ∂F/∂rate = c·δ^m3, although sign and absolute value each have a corner there
    law = compile_point((HuntCrossley(),))
    assert law.derivatives is not None
    _, stiffness, damping = law.derivatives(law.parameters, 0.01, 0.0, 0.033)
    assert damping == pytest.approx(5e3 * 0.01**1.5, rel=1e-14)  # rounding
    assert stiffness == pytest.approx(1.5 * 5e3 * 0.01**0.5, rel=1e-14)


@pytest.mark.long
def test_laws_outside_the_registry_are_compiled_once_however_many_terms_have_them() -> None:
    first, second = (
        law_parameters(terms).addresses
        for terms in (
            (UniformWind(), Ridge()),
            (Ridge(at=1.0), *PAPER_TERMS, Ridge(), UniformWind(w_l=7.0), SnowPatch(0.1)),
        )
    )
    assert np.count_nonzero(first[:-2]) == 4  # velocity and height, and their linearisations
    np.testing.assert_array_equal(first[:-2], second[:-2])  # but for the places of the wind's parameters
    assert law_parameters(PAPER_TERMS).others == 0


@pytest.mark.long
def test_a_kernel_calls_the_laws(tmp_path: Path) -> None:
    kernel, parameters = compile_kernel(kernel_template(tmp_path)), law_parameters(PAPER_TERMS)
    depth, rate = np.array([-0.01, 0.002, 0.02]), np.array([0.1, -0.2, 0.3])
    expected = sum(HuntCrossley().force(FloatMath(), PointState(d, r, 0.033)) for d, r in zip(depth, rate, strict=True))
    assert kernel.load(parameters, depth, rate, 0.033) == pytest.approx(expected, rel=1e-14)  # rounding


def test_a_template_that_was_moved_is_compiled_again(tmp_path: Path) -> None:
    # what Numba kept on disk names the modules of the classes that kernels are given
    moved = ModuleType("another_place")
    template = kernel_template(tmp_path)
    moved.__file__ = template.__file__
    assert compile_kernel(moved).__name__ != compile_kernel(template).__name__


def test_templates_that_mean_different_things_by_a_name_are_refused(tmp_path: Path) -> None:
    # in one module the second would replace the first, and nothing would tell
    template, other = kernel_template(tmp_path), ModuleType("other_template")
    other.__file__ = template.__file__
    vars(other)["load"] = 25
    with pytest.raises(ValueError, match="load_template and other_template both define load"):
        compile_kernel(template, other)


SCRIPT = """
import sys
from pathlib import Path

import numpy as np
from kernel_template import kernel_template

from sssi_exudyn.contact.codegen.compiled import compile_kernel, law_parameters
from sssi_exudyn.contact.registry import PAPER_TERMS

kernel = compile_kernel(kernel_template(Path(sys.argv[1])))
kernel.load(law_parameters(PAPER_TERMS), np.ones(2), np.ones(2), 0.033)
print(sum(kernel.load.stats.cache_hits.values()))
"""


@pytest.mark.long
def test_another_process_finds_the_kernel_compiled(tmp_path: Path) -> None:
    def hits() -> int:
        done = subprocess.run(
            [sys.executable, "-c", SCRIPT, str(tmp_path)],
            env=os.environ | {"SSSI_CACHE_DIR": str(tmp_path / "cache"), "PYTHONPATH": os.pathsep.join(sys.path)},
            check=True,
            capture_output=True,
            text=True,
        )
        return int(done.stdout)

    assert hits() == 0
    assert hits() == 1


@pytest.mark.long
def test_a_broken_file_in_the_cache_is_written_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SSSI_CACHE_DIR", str(tmp_path))
    terms = (Ridge(), Shear())  # which no other test has together
    source = other_laws_source(law_classes(terms)[len(TERMS) :])
    generated = tmp_path / f"sssi_exudyn_generated_{hashlib.sha256(source.encode()).hexdigest()}.py"
    generated.write_text(source[: len(source) // 2], encoding="utf-8")  # as a full disk would leave it
    assert compile_point(terms).value(law_parameters(terms), -1.0, 0.0, 0.033) == 0.0
    assert generated.read_text(encoding="utf-8") == source
