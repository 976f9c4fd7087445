"""For each place that a term may act in: a grid of states, the evaluation of a term there, and its switches."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Final

import numpy as np

from sssi_exudyn.contact.codegen import compiled
from sssi_exudyn.contact.codegen.compiled import law_parameters, parameter_index
from sssi_exudyn.contact.codegen.law_parameters import LawParameters
from sssi_exudyn.contact.maths import ArrayMath, FloatMath, Math, Number, Vector
from sssi_exudyn.contact.term import BodyState, EdgeState, FootState, PlaceState, PointState, SegmentState, WindTerm
from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.quantity import quantities, quantity

State = Mapping[str, Number]
_MADE_UP: Final = "made up, to test terms"


@dataclass(frozen=True)
class UniformWind(WindTerm):
    """The same wind everywhere, which blows on segments in the tests.

    Formula: w = (w_f, w_l, w_n)
    """

    name: ClassVar[str] = "uniform_wind"
    sources: ClassVar[tuple[str, ...]] = (_MADE_UP,)

    w_f: float = quantity(0.0, "m/s", low=-20.0, high=20.0, source=_MADE_UP, meaning="wind down the fall line")
    w_l: float = quantity(0.0, "m/s", low=-20.0, high=20.0, source=_MADE_UP, meaning="wind to the left")
    w_n: float = quantity(0.0, "m/s", low=-20.0, high=20.0, source=_MADE_UP, meaning="wind away from the snow")

    def velocity(self, math: Math, state: PlaceState) -> Vector:
        return self.w_f, self.w_l, self.w_n


AIR = ("w_f", "w_l", "w_n")
FACING = ("m_ff", "m_fl", "m_fn", "m_ll", "m_ln", "m_nn")
_ABOUT_ZERO = (-3.0, -0.1, -1e-9, 0.0, 1e-9, 0.1, 3.0)
GRIDS: dict[str, dict[str, Sequence[float]]] = {
    "point": {"depth": (-0.02, -1e-9, 0.0, 1e-9, 1e-4, 0.01, 0.05), "rate": _ABOUT_ZERO, "length": (0.033, 0.01)},
    "foot": {
        "load": (0.0, 1.0, 800.0),
        "v_t": (-5.0, -1e-9, 0.0, 0.1, 12.0),
        "v_n": (-2.0, -0.05, 0.0, 1e-9, 3.0),
        "edge": (-0.6, 0.0, 0.6),
        "groove": (0.0, 0.003),
        "t": (1.5,),
        "f": (20.0,),
        "l": (-3.0, 2.0),
        "side": (-1.0, 1.0),
    },
    "segment": {
        "v_f": (-3.0, 0.0, 12.0),
        "v_l": (-2.0, 0.0),
        "v_n": (0.0, 1.0),
        "w_f": (0.0, -4.0),
        "w_l": (0.0, 3.0),
        "w_n": (0.0,),
        "area": (0.0, 0.05),
        "m_ff": (0.0004, 0.0025),
        "m_fl": (0.0,),
        "m_fn": (0.0,),
        "m_ll": (0.001,),
        "m_ln": (-0.0005,),
        "m_nn": (0.002,),
    },
    "wind": {"t": (0.0, 3.0), "f": (-10.0, 0.0, 40.0), "l": (-10.0, 0.0, 10.0)},
    "terrain": {"f": (-10.0, 0.0, 4.0, 5.0, 6.5, 40.0), "l": (-10.0, 0.0, 10.0)},
    "body": {
        "t": (3.0,),
        "f": (40.0,),
        "l": (-10.0,),
        "v_f": (-3.0, -1e-9, 0.0, 0.1, 3.0),
        "v_l": (-1.0, 0.0, 1e-9, 0.5),
        "v_n": (-0.7, 0.0, 1e-9, 0.5),
    },
    "edge": {
        "lower": (-0.02, 0.0, 3e-4, 0.01),
        "upper": (-0.05, 2e-4),
        "rate": (-3.0, 0.1),
        "width": (0.07,),
        "groove": (0.0, 0.0103),
        "offset": (-2e-3, 1e-4),
        "step": (0.002,),
        "v_t": (-1e-3, 12.0),
        "v_n": (-0.4, 0.0, 0.1),
        "rise": (-0.02, 0.01),
        "edge": (-1.1, 1e-3),
        "length": (0.033,),
    },
}
VARIABLES = (
    {"point": ("depth", "rate"), "foot": ("load", "v_t", "v_n")}
    | dict.fromkeys(("segment", "body"), ("v_f", "v_l", "v_n"))
    | {"edge": ("lower", "upper", "rate", "v_t", "v_n", "edge")}
)
"""Variables that the compiled derivatives are taken by."""
LINEAR = {
    "point": ("depth", "rate"),
    "foot": ("load", "v_t", "v_n", "edge", "groove", "f", "l"),
    "segment": ("", "", "v_f", "v_l", "v_n"),
    "wind": ("f", "l"),
    "terrain": ("f", "l"),
    "body": ("f", "l", "v_f", "v_l", "v_n"),
}
"""Variables that the compiled linearisation is taken by, in column order.  A segment's grid has no place; edges have
none.
"""


def grid(kind: str) -> list[dict[str, float]]:
    """Return all combinations of the values above."""
    axes = GRIDS[kind]
    return [dict(zip(axes, values, strict=True)) for values in itertools.product(*axes.values())]


def instances(cls: type[Any]) -> list[Any]:
    """Return the term by default, with all parameters at their lower and their upper bounds, and half-way between."""
    about = quantities(cls).values()
    shares = [{q.name: q.low + share * (q.high - q.low) for q in about} for share in (0.0, 0.5, 1.0)]
    return [cls(), *(cls(**values) for values in shares)]


def ask(math: Math, term: Any, state: State) -> tuple[Number, ...]:
    """Return the term's components in that state, always as a tuple."""
    s = dict(state)
    velocity = tuple(s.pop(f"v_{axis}") for axis in "fln") if term.kind in ("segment", "body") else ()
    match term.kind:
        case "point":
            return (term.force(math, PointState(**s)),)
        case "foot":
            return tuple(term.force(math, FootState(**s)))
        case "segment":
            wind, facing = (tuple(s[name] for name in names) for names in (AIR, FACING))
            return tuple(term.force(math, SegmentState(velocity, wind, s["area"], facing)))
        case "wind":
            return tuple(term.velocity(math, PlaceState(**s)))
        case "terrain":
            return tuple(term.height(math, s["f"], s["l"]))
        case "edge":
            return tuple(term.force(math, EdgeState(**s)))
        case _:
            return tuple(term.force(math, BodyState(velocity=velocity, **s)))


def ask_memory(math: Math, term: Any, state: State) -> tuple[Number, ...]:
    """Return what an edge leaves in the snow, the greatest force of the groove's wall, and its force."""
    return *term.remember(math, EdgeState(**state)), *term.capacity(math, EdgeState(**state))


def reference(term: Any) -> Array:
    """Return the values (states, components) on the grid, in plain floats."""
    return np.array([ask(FloatMath(), term, state) for state in grid(term.kind)])


def compiled_on_grid(term: Any, derivatives: bool = False) -> Array:
    """Return the compiled value or derivatives (states, …) of a term; another term blows a segment's wind."""
    terms = (UniformWind(), term) if term.kind == "segment" else (term,)
    compiled_laws = getattr(compiled, f"compile_{term.kind}")(terms)
    law = compiled_laws[0] if term.kind == "edge" else compiled_laws
    function, rows = law.derivatives if derivatives else law.value, []
    for state in grid(term.kind):
        given, arguments = law.parameters, dict[str, Any](state)
        if term.kind == "segment":
            given, arguments = _in_wind(term, arguments)
        rows.append(np.atleast_1d(function(given, *arguments.values())))
    return np.array(rows)


def linearisation_on_grid(term: Any, states: Sequence[State]) -> tuple[Array, Array]:
    """Return (states, outputs, variables) and (states, outputs, parameters of the term) of the linearisation."""
    first = (UniformWind(), term) if term.kind == "segment" else (term,)
    law = getattr(compiled, f"compile_{term.kind}")(first)
    own = [parameter_index(first, term, name) for name in quantities(type(term))]
    by_states, by_parameters = [], []
    for state in states:
        given, arguments = law.parameters, dict[str, Any](state)
        if term.kind == "segment":
            given, arguments = _in_wind(term, arguments)
        outputs = len(ask(FloatMath(), term, state))
        by_state = np.full((outputs, len(LINEAR[term.kind])), np.nan)
        by_parameter = np.zeros((outputs, len(law.parameters.values)))
        law.linearisation(given, *arguments.values(), by_state, by_parameter)
        by_states.append(by_state)
        by_parameters.append(by_parameter[:, own])
    return np.array(by_states), np.array(by_parameters)


def _in_wind(term: Any, state: dict[str, Any]) -> tuple[LawParameters, dict[str, Any]]:
    """Return the parameters and the arguments of a segment's law in the wind of that state."""
    wind = UniformWind(*(state.pop(f"w_{axis}") for axis in "fln"))
    return law_parameters((wind, term)), {"t": 0.0, "f": 0.0, "l": 0.0} | state


class Switches:
    """A record of every number whose sign decides something, before another ``Math`` computes with it."""

    def __init__(self) -> None:
        self.switches: list[Any] = []

    def absolute(self, x: Number) -> Number:
        self.switches.append(x)
        return super().absolute(x)  # type: ignore[misc]

    def sign(self, x: Number) -> Number:
        self.switches.append(x)
        return super().sign(x)  # type: ignore[misc]

    def signed_power(self, x: Number, p: Number) -> Number:
        self.switches.append(x)
        return super().signed_power(x, p)  # type: ignore[misc]

    def where(self, x: Number, a: Number, b: Number) -> Number:
        self.switches.append(x)
        return super().where(x, a, b)  # type: ignore[misc]

    def maximum(self, a: Number, b: Number) -> Number:
        self.switches.append(a - b)
        return super().maximum(a, b)  # type: ignore[misc]

    def minimum(self, a: Number, b: Number) -> Number:
        self.switches.append(b - a)
        return super().minimum(a, b)  # type: ignore[misc]


class SwitchMath(Switches, FloatMath):
    """Plain floats that record their switches."""


class ArraySwitches(Switches, ArrayMath):  # type: ignore[misc]  # functions of NumPy where methods stand
    """Arrays that record their switches."""


def switches(term: Any, state: State) -> list[float]:
    """Return the numbers whose signs decide which branch the term takes in that state."""
    math = SwitchMath()
    ask(math, term, state)
    return math.switches


@dataclass(frozen=True)
class Crossing:
    """Two neighbouring floating-point states between which a switch of the term turns."""

    before: State
    after: State


def crossings(term: Any) -> Iterator[Crossing]:
    """Yield every place where a switch turns between neighbours of the grid."""
    states = grid(term.kind)
    signs = {tuple(state.values()): np.array(switches(term, state)) > 0.0 for state in states}
    for name, values in GRIDS[term.kind].items():
        after = dict(itertools.pairwise(values))
        turns = []
        for state in states:
            if state[name] in after:
                first = signs[tuple(state.values())]
                last = signs[tuple({**state, name: after[state[name]]}.values())]
                turns += [(state, int(i), bool(first[i])) for i in np.flatnonzero(first != last)]
        for (state, i, sign), a, b in zip(turns, *_brackets(term, name, after, turns), strict=True):
            while a < (middle := 0.5 * (a + b)) < b:
                if (switches(term, {**state, name: middle})[i] > 0.0) == sign:
                    a = middle
                else:
                    b = middle
            yield Crossing({**state, name: a}, {**state, name: b})


def _brackets(
    term: Any, name: str, after: Mapping[float, float], turns: list[tuple[dict[str, float], int, bool]]
) -> tuple[list[float], list[float]]:
    """Bracket every turn between two values of the number ``name``, a few roundings apart.

    All turns are bisected at once with arrays.  The bisection halves the count of floats in between, since halves of
    numbers would take a thousand steps towards zero.  Arrays may round otherwise than floats, so the signs at both ends
    are computed in floats, and where they are equal the full step is returned.
    """
    if not turns:
        return [], []
    columns = {key: np.array([state[key] for state, _, _ in turns]) for key in turns[0][0]}
    which, sign = np.array([i for _, i, _ in turns]), np.array([sign for _, _, sign in turns])
    low, high = columns[name], np.array([after[value] for value in columns[name]])
    a, b = _ranks(low), _ranks(high)
    every = np.arange(len(turns))
    while np.any((a < b) & (b - a != 1)):  # the difference may be too great a number, and is then negative
        middle = (a >> 1) + (b >> 1) + (a & b & 1)
        math = ArraySwitches()
        with np.errstate(all="ignore"):
            ask(math, term, {**columns, name: _of_ranks(middle)})
        turned = np.stack([np.broadcast_to(x, len(turns)) for x in math.switches])[which, every] > 0.0
        a, b = np.where(turned == sign, middle, a), np.where(turned != sign, middle, b)
    a, b = (_of_ranks(x) for x in (np.maximum(a - 8, _ranks(low)), np.minimum(b + 8, _ranks(high))))
    brackets: tuple[list[float], list[float]] = ([], [])
    for j, (state, i, before) in enumerate(turns):
        ends = [switches(term, {**state, name: float(x[j])})[i] > 0.0 for x in (a, b)]
        same_sign = ends != [before, not before]
        brackets[0].append(float(low[j] if same_sign else a[j]))
        brackets[1].append(float(high[j] if same_sign else b[j]))
    return brackets


def _ranks(values: Array) -> Any:
    """Return integers in the order of the floats, one apart where floats are neighbours."""
    bits = values.view(np.int64)
    return np.where(bits < 0, np.iinfo(np.int64).min - bits, bits)


def _of_ranks(ranks: Any) -> Any:
    """Return the floats of such ranks."""
    return np.where(ranks < 0, np.iinfo(np.int64).min - ranks, ranks).view(np.float64)


class ComplexMath:
    """Complex numbers, or arrays of them, that branch by their real part.

    A step of 10⁻³⁰ i gives a derivative without cancellation.
    """

    sqrt, sin, cos = staticmethod(np.sqrt), staticmethod(np.sin), staticmethod(np.cos)
    atan, exp, tanh, log = staticmethod(np.arctan), staticmethod(np.exp), staticmethod(np.tanh), staticmethod(np.log)

    def atan2(self, y: Number, x: Number) -> Number:
        return 2.0 * np.arctan(y / (np.sqrt(x * x + y * y) + x))

    def sign(self, x: Number) -> Number:
        return np.sign(np.real(x))

    def absolute(self, x: Number) -> Number:
        return self.sign(x) * x

    def power(self, x: Number, p: Number) -> Number:
        return np.power(np.asarray(x, dtype=complex), p)

    def signed_power(self, x: Number, p: Number) -> Number:
        return self.sign(x) * self.power(self.absolute(x), p)

    def where(self, x: Number, a: Number, b: Number) -> Number:
        return np.where(np.real(x) > 0.0, a, b)

    def maximum(self, a: Number, b: Number) -> Number:
        return self.where(a - b, a, b)

    def minimum(self, a: Number, b: Number) -> Number:
        return self.where(b - a, a, b)

    def saturate(self, v: Number, eps: Number) -> Number:
        return v / np.sqrt(v * v + eps * eps)


class _ByRealPart(np.ndarray[Any, Any]):
    """Complex numbers on which NumPy's functions branch by the real part, as ``ComplexMath`` does."""

    def __array_ufunc__(self, ufunc: np.ufunc, method: str, *inputs: Any, **options: Any) -> Any:
        plain = [np.asarray(x) for x in inputs]
        if method == "__call__" and ufunc.__name__ in _COMPARED:
            return _COMPARED[ufunc.__name__](*plain).view(_ByRealPart)
        result = getattr(ufunc, method)(*plain, **options)
        return result.view(_ByRealPart) if isinstance(result, np.ndarray) else result

    def __array_function__(self, func: Any, types: Any, args: Any, kwargs: Any) -> Any:
        result = super().__array_function__(func, types, args, kwargs)
        return result.view(_ByRealPart) if type(result) is np.ndarray else result


_COMPARED: Final[Mapping[str, Any]] = {
    "absolute": lambda x: np.sign(np.real(x)) * x,
    "fabs": lambda x: np.sign(np.real(x)) * x,
    "sign": lambda x: np.asarray(np.sign(np.real(x))),
    "hypot": lambda x, y: np.sqrt(x * x + y * y),
    "clip": lambda x, low, high: np.where(
        np.real(x) < np.real(low), low, np.where(np.real(x) > np.real(high), high, x)
    ),
    "maximum": lambda a, b: np.where(np.real(a) > np.real(b), a, b),
    "minimum": lambda a, b: np.where(np.real(a) < np.real(b), a, b),
    "greater": lambda a, b: np.real(a) > np.real(b),
    "greater_equal": lambda a, b: np.real(a) >= np.real(b),
    "less": lambda a, b: np.real(a) < np.real(b),
    "less_equal": lambda a, b: np.real(a) <= np.real(b),
}


def complex_step(term: Any, states: Sequence[State], variable: str) -> Array:
    """Return derivatives (states, components) of the term's values by one of the state's numbers."""
    return _imaginary(term, states, {variable: 1e-30j})


def complex_parameter_step(term: Any, states: Sequence[State], parameter: str) -> Array:
    """Return derivatives (states, components) of the term's values by one of its own numbers."""
    return _imaginary(replace(term, **{parameter: complex(getattr(term, parameter), 1e-30)}), states, {})


def _imaginary(term: Any, states: Sequence[State], steps: Mapping[str, complex]) -> Array:
    columns = {
        name: (np.array([state[name] for state in states]) + steps.get(name, 0.0)).astype(complex).view(_ByRealPart)
        for name in states[0]
    }
    components = ask(ComplexMath(), term, columns)
    return np.stack([np.broadcast_to(np.asarray(np.imag(x)), len(states)) for x in components], axis=1) / 1e-30


def assert_close(actual: Array, expected: Array) -> None:
    """Compare to 10⁻¹² of each number, or 10⁻¹³ of the greatest: where parts nearly cancel, only the sum is exact."""
    scale = float(np.max(np.abs(expected), initial=0.0))
    np.testing.assert_allclose(actual, expected, rtol=1e-12, atol=1e-13 * scale)
