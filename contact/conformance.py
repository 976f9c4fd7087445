"""The rules that every force term keeps, each a function of its class, and ``check_term`` for all of them."""

from __future__ import annotations

import inspect
import pickle
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
from scipy.spatial.transform import Rotation

from sssi_exudyn.contact.codegen.compiled import compile_edge
from sssi_exudyn.contact.codegen.tape import Tape, TapeMath
from sssi_exudyn.contact.conformance_states import (
    AIR,
    FACING,
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
from sssi_exudyn.contact.maths import ArrayMath, FloatMath
from sssi_exudyn.contact.registry import term_named
from sssi_exudyn.contact.term import KINDS, Term, formula, parameters
from sssi_exudyn.core.errors import SssiError
from sssi_exudyn.core.quantity import build_checked, quantities
from sssi_exudyn.core.text import one_line

_ROUNDING: Final = 1e-14


class BrokenRule(SssiError, AssertionError):
    """A rule that a term breaks, and the place."""


def check_term(cls: type[Term]) -> tuple[str, ...]:
    """Check a force term against every rule that the program's own terms keep, and return the names of these rules.

    Compiling the term takes some seconds the first time.

    Parameters
    ----------
    cls : the term's class

    Raises BrokenRule with the rule that it breaks, and where.

    Examples
    --------
    >>> sssi_exudyn.check_term(MyFriction)
    """
    if not (inspect.isclass(cls) and issubclass(cls, Term) and hasattr(cls, "kind")) or inspect.isabstract(cls):
        raise BrokenRule(f"{cls!r} is no force term: derive it from FootTerm, PointTerm, SegmentTerm, WindTerm …")
    kept = []
    for rule in RULES:
        if rule.kinds and cls.kind not in rule.kinds:
            continue
        try:
            rule.check(cls)
        except Exception as error:  # the term's code is someone else's: it may raise anything
            words = one_line(str(error).strip() or type(error).__name__, 400)
            raise BrokenRule(f"{cls.__name__}: {rule.name.replace('_', ' ')}: {words}") from error
        kept.append(rule.name)
    return tuple(kept)


def _hold(holds: bool | np.bool_, problem: object) -> None:
    if not holds:
        raise BrokenRule(problem)


def declares_what_it_is(cls: type[Any]) -> None:
    """Check that name, formula and sources are declared, and of every number default, bounds, unit, source, meaning."""
    _hold(cls.kind in [kind.kind for kind in KINDS], f"{cls.kind!r} is no kind")
    _hold(getattr(cls, "name", "").isidentifier(), "its name is no word")
    _hold(bool(formula(cls)), "no line of its docstring begins with Formula:")
    _hold(bool(cls.sources) and all(source.strip() for source in cls.sources), "it has no sources")
    for about in quantities(cls).values():
        _hold(about.low <= about.default <= about.high, f"{about.name} is outside its bounds")
        _hold(about.low < about.high, f"{about.name} has no room between its bounds")
        for part in ("unit", "source", "meaning"):
            _hold(bool(getattr(about, part).strip()), f"{about.name} has no {part}")


def survives_a_file(cls: type[Any]) -> None:
    """Check that its numbers, read from a file, make the same term again."""
    for term in instances(cls):
        _hold(build_checked(cls, parameters(term), "model.toml", "[[term]]") == term, parameters(term))


def pickles(cls: type[Any]) -> None:
    """Check that it goes to another process and back."""
    for term in instances(cls):
        _hold(pickle.loads(pickle.dumps(term)) == term, parameters(term))


def does_not_branch(cls: type[Any]) -> None:
    """Check that it evaluates on a tape, whose nodes raise when asked for a truth value, a size or a float."""
    tape = Tape()
    symbols = {name: tape.name(name) for name in quantities(cls)}
    ask(TapeMath(tape), cls(**symbols), {name: tape.name(name) for name in GRIDS[cls.kind]})


def arrays_equal_floats(cls: type[Any]) -> None:
    """Check that over arrays of states it gives the values of single states, without a warning."""
    states = grid(cls.kind)
    columns = {name: np.array([state[name] for state in states]) for name in GRIDS[cls.kind]}
    for term in instances(cls):
        with np.errstate(all="raise", under="ignore"):
            components = ask(ArrayMath(), term, columns)
        assert_close(np.stack([np.broadcast_to(x, len(states)) for x in components], axis=1), reference(term))


def compiled_equals_floats(cls: type[Any]) -> None:
    """Check that the compiled term gives the values of the plain formula."""
    for term in instances(cls):
        assert_close(compiled_on_grid(term), reference(term))


def compiled_derivatives_are_right(cls: type[Any]) -> None:
    """Check that they are finite everywhere, and equal those of the formula away from the switches."""
    for term in instances(cls):
        answers, values = compiled_on_grid(term, derivatives=True), reference(term)
        size = values.shape[1]
        _hold(np.all(np.isfinite(answers)), "a derivative is not finite")  # on the switching surfaces too
        assert_close(answers[:, :size], values)
        smooth = np.array([all(switches(term, state)) for state in grid(cls.kind)])
        _hold(np.count_nonzero(smooth) > 10, "it switches nearly everywhere")
        for column, name in enumerate(VARIABLES[cls.kind]):
            derivatives = answers[smooth, size + column :: len(VARIABLES[cls.kind])]
            smooth_states = [state for state, counts in zip(grid(cls.kind), smooth, strict=True) if counts]
            assert_close(derivatives, complex_step(term, smooth_states, name))


def linearisation_is_exact(cls: type[Any]) -> None:
    """Check derivatives by the state and by every declared number, also those inside windows, places and exponents."""
    for term in instances(cls):
        by_state, by_parameter = linearisation_on_grid(term, grid(cls.kind))
        _hold(np.all(np.isfinite(by_state)), "a derivative is not finite")  # on the switching surfaces too
        _hold(np.all(np.isfinite(by_parameter)), "a derivative by a number of its own is not finite")
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


def is_continuous(cls: type[Any]) -> None:
    """Check that no force jumps where a switch turns."""
    for term in instances(cls):
        # The two states differ in the last digit of one number, so a continuous law differs by its own rounding;
        # a jump of a millionth of the greatest force on the grid would be seen.
        allowed = 1e-6 * np.max(np.abs(reference(term)), axis=0) + 1e-12
        for crossing in crossings(term):
            jump = np.subtract(ask(FloatMath(), term, crossing.after), ask(FloatMath(), term, crossing.before))
            _hold(np.all(np.abs(jump) <= allowed), crossing)


def nothing_without_contact(cls: type[Any]) -> None:
    """Check that the snow exerts no force on a ski that is not in it."""
    contact = {"point": "depth", "foot": "load", "edge": "lower"}[cls.kind]
    for term in instances(cls):
        for state in grid(cls.kind):
            if state[contact] <= 0.0:
                _hold(all(x == 0.0 for x in ask(FloatMath(), term, state)), state)


def snow_never_pulls(cls: type[Any]) -> None:
    """Check that a point's normal force is ≥ 0."""
    for term in instances(cls):
        _hold(np.all(reference(term) >= 0.0), parameters(term))


def force_is_in_proportion_to_length(cls: type[Any]) -> None:
    """Check that a finer ski, with shorter lengths a point, converges."""
    for term in instances(cls):
        for state in grid(cls.kind):
            full, half = (np.array(ask(FloatMath(), term, state | {"length": x * state["length"]})) for x in (1.0, 0.5))
            _hold(_equal(half, 0.5 * full), state)


def takes_energy_only(cls: type[Any]) -> None:
    """Check that the force takes energy; a correction is tested together with the law it corrects, at its defaults."""
    names = {"foot": ("v_t", "v_n"), "segment": ("v_f", "v_l", "v_n")}[cls.kind]
    laws = [term_named(cls.corrects)()] if cls.corrects else []
    for term in instances(cls):
        for state in grid(cls.kind):
            still = state | {name: 0.0 for name in state if name.startswith("w_")}
            force = np.sum([ask(FloatMath(), law, still) for law in (term, *laws)], axis=0)
            velocity = [state[name] for name in names]
            most = _ROUNDING * np.linalg.norm(force) * np.linalg.norm(velocity)
            _hold(np.dot(force, velocity) <= most, f"{still} with {parameters(term)}")


def turned_world_turned_force(cls: type[Any]) -> None:
    """Check that the air has no direction of its own, but for up, where a term knows it."""
    turn = Rotation.from_euler("xyz", (0.0, 0.0, 2.3) if cls.knows_up else (0.4, -1.1, 2.3)).as_matrix()
    for term in instances(cls):
        for state in grid(cls.kind):
            turned = dict(state)
            for group in (("v_f", "v_l", "v_n"), AIR):
                turned |= dict(zip(group, turn @ [state[name] for name in group], strict=True))
            ff, fl, fn, ll, ln, nn = (state[name] for name in FACING)
            shown = turn @ np.array([[ff, fl, fn], [fl, ll, ln], [fn, ln, nn]]) @ turn.T
            turned |= dict(zip(FACING, shown[np.triu_indices(3)], strict=True))
            force = np.array(ask(FloatMath(), term, state))
            # three products and two sums of each component, of what the segment faces six of each, and as many again:
            # some units of rounding, of the greatest component
            np.testing.assert_allclose(
                ask(FloatMath(), term, turned),
                turn @ force,
                rtol=0.0,
                atol=2.0 * _ROUNDING * float(np.linalg.norm(force)) + 1e-18,
            )


def mirrored_ski_mirrored_force(cls: type[Any]) -> None:
    """Check that left and right are the same to the snow.

    A ski is not the same in all directions.  A law of one ski is compared with that of the other ski.
    """
    for term in instances(cls):
        other = replace(term, **{name: -getattr(term, name) for name in cls.mirrors})
        for state in grid(cls.kind):
            mirrored = state | {name: -state[name] for name in ("v_n", "edge", "side")}
            along, across = ask(FloatMath(), term, state)
            _hold(_equal(ask(FloatMath(), other, mirrored), (along, -across)), state)


def an_edge_is_pushed_out_and_takes_energy(cls: type[Any]) -> None:
    """Check that an edge is pushed out and loses energy.

    The wall is not bent before: a bent wall may give back what it took.
    """
    for term in instances(cls):
        for state in grid(cls.kind):
            normal, along, across, upper = ask(FloatMath(), term, state | {"offset": 0.0})
            _hold(0.0 <= upper <= normal, state)
            _hold(along * state["v_t"] <= 0.0, state)
            _hold(across * state["v_n"] <= 0.0, state)


def mirrored_edge_mirrored_force_and_memory(cls: type[Any]) -> None:
    """Check that left and right are the same to the snow."""
    for term in instances(cls):
        for state in grid(cls.kind):
            mirrored = state | {name: -state[name] for name in ("offset", "v_n", "edge")}
            normal, along, across, upper = ask(FloatMath(), term, state)
            groove, offset, *wall = ask_memory(FloatMath(), term, state)
            _hold(_equal(ask(FloatMath(), term, mirrored), (normal, along, -across, upper)), state)
            _hold(_equal(ask_memory(FloatMath(), term, mirrored), (groove, -offset, *wall)), state)


def memory_is_the_same_however_it_is_evaluated(cls: type[Any]) -> None:
    """Check that floats, arrays and compiled code give the same memory."""
    states = grid(cls.kind)
    columns = {name: np.array([state[name] for state in states]) for name in GRIDS[cls.kind]}
    tape = Tape()
    ask_memory(TapeMath(tape), cls(), {name: tape.name(name) for name in GRIDS[cls.kind]})  # raises where it branches
    for term in instances(cls):
        expected = np.array([ask_memory(FloatMath(), term, state) for state in states])
        assert_close(np.stack(ask_memory(ArrayMath(), term, columns), axis=1), expected)
        _, memory, capacity = compile_edge((term,))
        compiled_values = [
            (*memory.value(memory.parameters, *state.values()), *capacity.value(capacity.parameters, *state.values()))
            for state in states
        ]
        assert_close(np.array(compiled_values), expected)
        _hold(np.all(expected[:, 0] >= 0.0), "a groove above the snow")


def what_an_edge_leaves_is_what_the_next_point_finds(cls: type[Any]) -> None:
    """Check that a following point, without sideslip, presses no deeper and is pushed to the side as much."""
    for term in instances(cls):
        state = grid(cls.kind)[-1] | {"v_n": 0.0, "groove": 0.0, "offset": 1e-4, "rate": 0.0}
        groove, offset, *_ = ask_memory(FloatMath(), term, state)
        after = state | {"groove": groove, "offset": offset}
        _hold(groove == state["lower"], state)
        _hold(_equal(ask(FloatMath(), term, after), ask(FloatMath(), term, state)), state)


def slopes_are_those_of_the_height(cls: type[Any]) -> None:
    """Check that a surface's two slopes are the derivatives of its height."""
    for term in instances(cls):
        slopes = [complex_step(term, grid(cls.kind), name)[:, 0] for name in ("f", "l")]
        assert_close(reference(term)[:, 1:], np.stack(slopes, axis=1))


def _equal(one: Any, other: Any) -> bool:
    """Tell whether two values are equal to rounding."""
    return bool(np.allclose(one, other, rtol=_ROUNDING, atol=1e-12))


@dataclass(frozen=True)
class Rule:
    """A rule of force terms.

    check : raises for a class that breaks it
    kinds : those that it applies to; empty for all
    compiles : whether it compiles the term, which takes seconds
    """

    check: Callable[[type[Any]], None]
    kinds: tuple[str, ...] = ()
    compiles: bool = False

    @property
    def name(self) -> str:
        """Name of its function."""
        return self.check.__name__


RULES: Final = (
    Rule(declares_what_it_is),
    Rule(survives_a_file),
    Rule(pickles),
    Rule(does_not_branch),
    Rule(arrays_equal_floats),
    Rule(nothing_without_contact, ("point", "foot", "edge")),
    Rule(snow_never_pulls, ("point",)),
    Rule(force_is_in_proportion_to_length, ("point", "edge")),
    Rule(takes_energy_only, ("foot", "segment")),
    Rule(turned_world_turned_force, ("segment",)),
    Rule(mirrored_ski_mirrored_force, ("foot",)),
    Rule(an_edge_is_pushed_out_and_takes_energy, ("edge",)),
    Rule(mirrored_edge_mirrored_force_and_memory, ("edge",)),
    Rule(what_an_edge_leaves_is_what_the_next_point_finds, ("edge",)),
    Rule(slopes_are_those_of_the_height, ("terrain",)),
    Rule(is_continuous, compiles=True),
    Rule(compiled_equals_floats, compiles=True),
    Rule(compiled_derivatives_are_right, tuple(VARIABLES), compiles=True),
    Rule(linearisation_is_exact, tuple(LINEAR), compiles=True),
    Rule(memory_is_the_same_however_it_is_evaluated, ("edge",), compiles=True),
)
"""Every rule, the slowest last."""
