"""Every term keeps the contract: the registry's, and the examples that stand for places still without a term."""

from __future__ import annotations

import json
import os
import pickle
import subprocess
import sys
import tomllib
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from term_places import (
    CLASSES,
    GRIDS,
    LINEAR,
    VARIABLES,
    ask,
    ask_memory,
    assert_close,
    compiled_on_grid,
    complex_parameter_step,
    complex_step,
    crossings,
    grid,
    instances,
    linearisation_on_grid,
    reference,
    switches,
)

from sssi_exudyn.contact.backends.compiled import compile_edge
from sssi_exudyn.contact.backends.tape import Tape, TapeMath
from sssi_exudyn.contact.maths import ArrayMath, FloatMath
from sssi_exudyn.contact.registry import PAPER_TERMS, TERMS, read_term, term_named, terms_table
from sssi_exudyn.contact.term import KINDS, formula, parameters
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.quantity import quantities

every_term = pytest.mark.parametrize("cls", CLASSES, ids=lambda cls: cls.name)


def _of(*kinds: str) -> pytest.MarkDecorator:
    return pytest.mark.parametrize("cls", [c for c in CLASSES if c.kind in kinds], ids=lambda cls: cls.name)


@every_term
def test_declares_what_it_is(cls: type[Any]) -> None:
    assert cls.kind in [kind.kind for kind in KINDS]
    assert cls.name.isidentifier()
    assert formula(cls)
    assert cls.sources
    assert all(source.strip() for source in cls.sources)
    for about in quantities(cls).values():
        assert about.low <= about.default <= about.high
        assert about.low < about.high
        assert about.unit.strip()
        assert about.source.strip()
        assert about.meaning.strip()


def test_names_are_unique() -> None:
    assert len({cls.name for cls in TERMS}) == len(TERMS)
    assert [term_named(cls.name) for cls in TERMS] == list(TERMS)
    assert {row["name"] for row in terms_table()} == {cls.name for cls in TERMS}


@pytest.mark.parametrize("cls", TERMS, ids=lambda cls: cls.name)
def test_parameters_survive_a_file(cls: type[Any]) -> None:
    for term in instances(cls):
        text = "\n".join(f"{name} = {value!r}" for name, value in parameters(term).items())
        assert read_term(cls.name, tomllib.loads(text), "model.toml", "[term]") == term


@pytest.mark.parametrize("cls", TERMS, ids=lambda cls: cls.name)
def test_parameters_out_of_bounds_are_refused(cls: type[Any]) -> None:
    for about in quantities(cls).values():
        with pytest.raises(InputError, match=rf"model.toml: \[term\] {about.name}"):
            read_term(cls.name, {about.name: about.high + 1.0}, "model.toml", "[term]")


def test_an_unknown_term_is_refused() -> None:
    with pytest.raises(InputError, match="no force term is named 'glue'"):
        read_term("glue", {}, "model.toml", "[term]")


@pytest.mark.parametrize(
    "cls", [c for c in TERMS if c not in map(type, PAPER_TERMS) and not c.replaces], ids=lambda cls: cls.name
)
def test_a_term_beyond_the_paper_is_nothing_by_default(cls: type[Any]) -> None:
    # so that adding it changes no result; one that stands in the place of the paper's is not added to them
    assert not np.any(reference(cls()))


@every_term
def test_pickles(cls: type[Any]) -> None:
    for term in instances(cls):
        assert pickle.loads(pickle.dumps(term)) == term


@every_term
def test_does_not_branch(cls: type[Any]) -> None:
    # a node of the tape raises when asked for its truth value, its size or a float
    tape = Tape()
    symbols = {name: tape.name(name) for name in quantities(cls)}
    ask(TapeMath(tape), cls(**symbols), {name: tape.name(name) for name in GRIDS[cls.kind]})


@every_term
def test_arrays_equal_floats(cls: type[Any]) -> None:
    states = grid(cls.kind)
    columns = {name: np.array([state[name] for state in states]) for name in GRIDS[cls.kind]}
    for term in instances(cls):
        with np.errstate(all="raise", under="ignore"):
            given = ask(ArrayMath(), term, columns)
        assert_close(np.stack([np.broadcast_to(x, len(states)) for x in given], axis=1), reference(term))


@pytest.fixture(scope="module")
def symbolic_values() -> dict[str, list[list[list[float]]]]:
    # Exudyn's symbols may take the process with them, and their settings are global to it
    done = subprocess.run(
        [sys.executable, "-c", "import term_places; print(term_places.printed_by_exudyn())"],
        env=os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)},
        check=True,
        capture_output=True,
        text=True,
    )
    values: dict[str, list[list[list[float]]]] = json.loads(done.stdout.splitlines()[-1])
    return values


@every_term
def test_symbols_equal_floats(cls: type[Any], symbolic_values: dict[str, list[list[list[float]]]]) -> None:
    for term, values in zip(instances(cls), symbolic_values[cls.name], strict=True):
        assert_close(np.array(values), reference(term))


@every_term
@pytest.mark.long
def test_compiled_equals_floats(cls: type[Any]) -> None:
    for term in instances(cls):
        assert_close(compiled_on_grid(term), reference(term))


@_of(*VARIABLES)
@pytest.mark.long
def test_compiled_derivatives_are_right(cls: type[Any]) -> None:
    for term in instances(cls):
        answers, values = compiled_on_grid(term, derivatives=True), reference(term)
        size = values.shape[1]
        assert np.all(np.isfinite(answers))  # on the switching surfaces too
        assert_close(answers[:, :size], values)
        smooth = np.array([all(switches(term, state)) for state in grid(cls.kind)])
        assert np.count_nonzero(smooth) > 10
        for column, name in enumerate(VARIABLES[cls.kind]):
            given = answers[smooth, size + column :: len(VARIABLES[cls.kind])]
            off = [state for state, counts in zip(grid(cls.kind), smooth, strict=True) if counts]
            assert_close(given, complex_step(term, off, name))


@_of(*LINEAR)
@pytest.mark.long
def test_linearisation_is_exact(cls: type[Any]) -> None:
    # by the state and by every declared number, also those inside windows, places and exponents
    for term in instances(cls):
        by_state, by_parameter = linearisation_on_grid(term, grid(cls.kind))
        assert np.all(np.isfinite(by_state))  # on the switching surfaces too
        assert np.all(np.isfinite(by_parameter))
        smooth = np.array([all(switches(term, state)) for state in grid(cls.kind)])
        by_state, by_parameter = by_state[smooth], by_parameter[smooth]
        states = [state for state, counts in zip(grid(cls.kind), smooth, strict=True) if counts]
        if not states:  # a number at its bound is where the term switches
            continue
        for column, name in enumerate(LINEAR[cls.kind]):
            if name:
                assert_close(by_state[..., column], complex_step(term, states, name))
        for column, name in enumerate(quantities(cls)):
            expected = complex_parameter_step(term, states, name)
            assert_close(by_parameter[..., column], expected)


@every_term
@pytest.mark.long
def test_is_continuous(cls: type[Any]) -> None:
    for term in instances(cls):
        # The two states differ in the last digit of one number, so a continuous law differs by its own rounding;
        # a jump of a millionth of the greatest force on the grid would be seen.
        allowed = 1e-6 * np.max(np.abs(reference(term)), axis=0) + 1e-12
        for crossing in crossings(term):
            jump = np.subtract(ask(FloatMath(), term, crossing.after), ask(FloatMath(), term, crossing.before))
            assert np.all(np.abs(jump) <= allowed), crossing


@_of("point", "foot", "edge")
def test_nothing_without_contact(cls: type[Any]) -> None:
    contact = {"point": "depth", "foot": "load", "edge": "lower"}[cls.kind]
    for term in instances(cls):
        for state in grid(cls.kind):
            if state[contact] <= 0.0:
                assert all(x == 0.0 for x in ask(FloatMath(), term, state)), state


@_of("point")
def test_snow_never_pulls(cls: type[Any]) -> None:
    for term in instances(cls):
        assert np.all(reference(term) >= 0.0)


@_of("point", "edge")
def test_force_is_in_proportion_to_length(cls: type[Any]) -> None:
    # so that a finer ski, with shorter lengths a point, converges
    for term in instances(cls):
        for state in grid(cls.kind):
            whole, half = (
                np.array(ask(FloatMath(), term, state | {"length": x * state["length"]})) for x in (1.0, 0.5)
            )
            assert half == pytest.approx(0.5 * whole, rel=1e-14)  # rounding


@_of("foot", "segment")
def test_takes_energy_only(cls: type[Any]) -> None:
    # a correction together with the law it corrects, as that is by default
    names = {"foot": ("v_t", "v_n"), "segment": ("v_f", "v_l", "v_n")}[cls.kind]
    laws = [term_named(cls.corrects)()] if cls.corrects else []
    for term in instances(cls):
        for state in grid(cls.kind):
            still = state | {name: 0.0 for name in state if name.startswith("w_")}
            force = np.sum([ask(FloatMath(), law, still) for law in (term, *laws)], axis=0)
            velocity = [state[name] for name in names]
            assert np.dot(force, velocity) <= 1e-14 * np.linalg.norm(force) * np.linalg.norm(velocity)  # rounding


@_of("segment")
def test_turned_world_turned_force(cls: type[Any]) -> None:
    turn = Rotation.from_euler("xyz", (0.4, -1.1, 2.3)).as_matrix()
    for term in instances(cls):
        for state in grid(cls.kind):
            turned = dict(state)
            for group in (("v_f", "v_l", "v_n"), ("w_f", "w_l", "w_n")):
                turned |= dict(zip(group, turn @ [state[name] for name in group], strict=True))
            force = np.array(ask(FloatMath(), term, state))
            # three products and two sums of each component, twice: some units of rounding, of the greatest component
            np.testing.assert_allclose(
                ask(FloatMath(), term, turned), turn @ force, rtol=0.0, atol=1e-14 * np.linalg.norm(force) + 1e-18
            )


@_of("foot")
def test_mirrored_ski_mirrored_force(cls: type[Any]) -> None:
    # a ski is not the same in all directions, but left and right are the same to the snow
    for term in instances(cls):
        for state in grid(cls.kind):
            mirrored = state | {name: -state[name] for name in ("v_n", "edge", "side")}
            along, across = ask(FloatMath(), term, state)
            assert ask(FloatMath(), term, mirrored) == pytest.approx((along, -across), rel=1e-14)  # rounding


@_of("edge")
def test_an_edge_is_pushed_out_and_takes_energy(cls: type[Any]) -> None:
    # without a wall that is bent already, which may give back what it took
    for term in instances(cls):
        for state in grid(cls.kind):
            normal, along, across, upper = ask(FloatMath(), term, state | {"offset": 0.0})
            assert 0.0 <= upper <= normal
            assert along * state["v_t"] <= 0.0
            assert across * state["v_n"] <= 0.0


@_of("edge")
def test_mirrored_edge_mirrored_force_and_memory(cls: type[Any]) -> None:
    for term in instances(cls):
        for state in grid(cls.kind):
            mirrored = state | {name: -state[name] for name in ("offset", "v_n", "edge")}
            normal, along, across, upper = ask(FloatMath(), term, state)
            groove, offset, most = ask_memory(FloatMath(), term, state)
            assert ask(FloatMath(), term, mirrored) == pytest.approx((normal, along, -across, upper), rel=1e-14)
            assert ask_memory(FloatMath(), term, mirrored) == pytest.approx((groove, -offset, most), rel=1e-14)


@_of("edge")
@pytest.mark.long
def test_memory_is_the_same_however_it_is_evaluated(cls: type[Any]) -> None:
    states = grid(cls.kind)
    columns = {name: np.array([state[name] for state in states]) for name in GRIDS[cls.kind]}
    tape = Tape()
    ask_memory(TapeMath(tape), cls(), {name: tape.name(name) for name in GRIDS[cls.kind]})  # raises where it branches
    for term in instances(cls):
        expected = np.array([ask_memory(FloatMath(), term, state) for state in states])
        assert_close(np.stack(ask_memory(ArrayMath(), term, columns), axis=1), expected)
        _, memory, capacity = compile_edge((term,))
        given = [
            (*memory.value(memory.parameters, *state.values()), capacity.value(capacity.parameters, *state.values()))
            for state in states
        ]
        assert_close(np.array(given), expected)
        assert np.all(expected[:, 0] >= 0.0)


@_of("edge")
def test_what_an_edge_leaves_is_what_the_next_point_finds(cls: type[Any]) -> None:
    # a point that follows in the same place, without sideslip, presses no deeper and is pushed to the side as much
    for term in instances(cls):
        state = grid(cls.kind)[-1] | {"v_n": 0.0, "groove": 0.0, "offset": 1e-4, "rate": 0.0}
        groove, offset, _ = ask_memory(FloatMath(), term, state)
        after = state | {"groove": groove, "offset": offset}
        assert groove == state["lower"]
        assert ask(FloatMath(), term, after) == pytest.approx(ask(FloatMath(), term, state), rel=1e-14)  # rounding


@_of("terrain")
def test_slopes_are_those_of_the_height(cls: type[Any]) -> None:
    for term in instances(cls):
        slopes = [complex_step(term, grid(cls.kind), name)[:, 0] for name in ("f", "l")]
        assert_close(reference(term)[:, 1:], np.stack(slopes, axis=1))
