"""The model that a what-if asks about: that of the recorded run with other numbers, a further force or another ski."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np

from sssi_exudyn.bodies.ski.ski import ski_named
from sssi_exudyn.contact.registry import is_carved, known_terms, term_named
from sssi_exudyn.contact.term import EdgeTerm, Term
from sssi_exudyn.core.choices import Keep
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.number_ref import NumberRef
from sssi_exudyn.core.text import did_you_mean, one_line
from sssi_exudyn.model.model import Model
from sssi_exudyn.sweeps.parameters import Parameter, numbers_of, parameters_of, reshape
from sssi_exudyn.what_if.gates import Gates
from sssi_exudyn.what_if.recorded_run import RecordedRun

COMMAND: Final = "sssi whatif"
_START_SPEED: Final = Parameter("start.speed", "m/s", 0.5, 50.0, "speed along the slope at the start")
_GATES: Final = (
    Parameter("gates.distance", "1", 0.7, 1.4, "factor on the path down the fall line: on gates' distance"),
    Parameter("gates.offset", "1", 0.7, 1.4, "factor on the path across the fall line: on gates' offset"),
)
_PATH: Final[tuple[Keep, ...]] = ("path", "line")
_SHAPES: Final = ("skier.mass", "slope.inclination_deg")
_OF_CAPTURE: Final = ("heading_offset", "clock_offset", "f", "l")


def askable(terms: Sequence[Term]) -> dict[str, Parameter]:
    """Return the numbers that a what-if may change of a model with these force terms, by name.

    Laws that the model lacks are among them: without a number of theirs they do nothing.  A law that replaces another
    one is not, as the fit knows the other.
    """
    present = {term.name for term in terms}
    absent = [
        cls() for cls in known_terms() if cls.name not in present and not cls.replaces and not issubclass(cls, EdgeTerm)
    ]
    parts = {*present, *(term.name for term in absent), "ski", "start", *(() if is_carved(terms) else ("legs",))}
    declared = {**parameters_of((*terms, *absent)), _START_SPEED.name: _START_SPEED}
    model = {
        name: about
        for name, about in declared.items()
        if (name in _SHAPES or NumberRef(name).part in parts)
        and not (name.startswith("start.") and NumberRef(name).key.removesuffix("_deg") in _OF_CAPTURE)
    }
    return {**model, **{about.name: about for about in _GATES}}


def check_changes(model: Model, changes: Mapping[str, float]) -> None:
    """Raise InputError for an unknown number, and for a value outside its bounds."""
    known = askable(model.terms)
    for name, value in changes.items():
        if name not in known:
            raise InputError(COMMAND, "--set", f"no number is called {one_line(name)!r}", did_you_mean(name, known))
        about = known[name]
        if not about.low <= value <= about.high:
            problem = f"{name} = {value:g} is outside {about.low:g} to {about.high:g} {about.unit}"
            raise InputError(COMMAND, "--set", problem, "give a value within")


def check_gates(names: Iterable[str], keep: Keep, file: Path | str, place: str) -> None:
    """Raise InputError where gates move a path that is not kept."""
    if keep not in _PATH and any(NumberRef(name).part == "gates" for name in names):
        problem = f"gates that stand elsewhere are another path, and {keep} keeps none"
        raise InputError(file, place, problem, f"keep one of: {', '.join(_PATH)}")


def check_steering(recorded: RecordedRun, keep: Keep, file: Path | str, place: str) -> None:
    """Raise InputError where the snow decides the heading of a skier who keeps nothing to steer for."""
    if recorded.snow_turns and keep == "movement":
        problem = "the snow decides the heading, and a skier who plays the recorded movement steers nowhere"
        raise InputError(file, place, problem, "keep the path or the rhythm, or fit with --heading replay")


def gates_of(changes: Mapping[str, float]) -> Gates:
    """Return where the gates stand."""
    return Gates(changes.get("gates.distance", 1.0), changes.get("gates.offset", 1.0))


def change_model(model: Model, changes: Mapping[str, float], ski: str | None) -> Model:
    """Return the model that is asked about; ``changes`` are in the units of files.

    A steeper slope turns gravity alone: posture and path stay as they are relative to the snow.

    Raises InputError for unknown numbers and skis, and for values outside their bounds.
    """
    check_changes(model, changes)
    if ski is not None:
        model = replace(model, ski=ski_named(ski, Path(), COMMAND, "--ski"))
    of_ski: dict[str, float] = {}
    for name, value in numbers_of(changes).items():
        number = NumberRef(name)
        if number.part == "gates":
            continue  # of the path, not of the model
        if number.part == "ski":
            of_ski[number.key] = float(value)
        else:
            model = _changed(model, number, float(value))
    try:
        return replace(model, ski=reshape(model.ski, of_ski)) if of_ski else model
    except ValueError as error:
        raise InputError(COMMAND, "--set", str(error), "give numbers that fit together") from None


def _changed(model: Model, number: NumberRef, value: float) -> Model:
    if number == "skier.mass":
        return replace(model, skier=replace(model.skier, mass=value))
    if number == "slope.inclination":
        return replace(model, inclination=value)
    if number == _START_SPEED.name:
        start = model.start
        factor = value / float(np.hypot(start.velocity_f, start.velocity_l))
        return replace(
            model, start=replace(start, velocity_f=factor * start.velocity_f, velocity_l=factor * start.velocity_l)
        )
    if number.part not in {"start", "legs", *(term.name for term in model.terms)}:
        model = replace(model, terms=(*model.terms, term_named(number.part)()))
    return model.with_values({number: value})
