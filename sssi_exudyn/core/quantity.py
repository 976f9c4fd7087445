"""Declared numbers with default, unit, bounds and source.

Every parameter of the program is declared once, on the class that uses it::

    @dataclass(frozen=True)
    class CoulombFriction(FrictionTerm):
        mu_t: float = quantity(0.1, "1", low=0.01, high=0.99, source="paper 2.4", meaning="friction along the ski")

From that declaration come the fit's bounds, the validation of configuration files and the tables in reports.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from types import MappingProxyType
from typing import Any, TypeVar

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.text import did_you_mean

T = TypeVar("T")
_KEY = "sssi_quantity"


@dataclass(frozen=True)
class Quantity:
    """The declaration of a number: everything that is known of it except its value."""

    name: str
    default: float
    unit: str
    low: float
    high: float
    source: str
    meaning: str


def quantity(
    default: float, unit: str, *, low: float, high: float, source: str, meaning: str
) -> Any:  # Any: a dataclass field stands where a float is annotated
    """Declare a dataclass field that is a number with unit, bounds and source.

    Raises ValueError when the default lies outside its own bounds.

    Examples
    --------
    >>> c = quantity(0.0, "s/m", low=0.0, high=0.05, source="chosen", meaning="rise of friction with speed")
    """
    if not low <= default <= high:
        raise ValueError(f"default {default} outside [{low}, {high}]")
    about = {"unit": unit, "low": low, "high": high, "source": source, "meaning": meaning}
    return field(default=default, metadata={_KEY: about})


def quantities(owner: object) -> Mapping[str, Quantity]:
    """Return the declared numbers of a dataclass (class or instance), by name, in order of declaration."""
    return _declared_by(owner if isinstance(owner, type) else type(owner))


@cache
def _declared_by(cls: type) -> Mapping[str, Quantity]:
    """Return the numbers that a dataclass declares; models are asked for them with every number that a search moves."""
    declared = {}
    for entry in dataclasses.fields(cls):
        if _KEY in entry.metadata:
            declared[entry.name] = Quantity(name=entry.name, default=_number(entry.default), **entry.metadata[_KEY])
    return MappingProxyType(declared)


def _number(default: Any) -> float:
    return float(default)


def build_checked(cls: type[T], values: Mapping[str, object], file: str | Path, place: str) -> T:
    """Build the dataclass ``cls`` from a mapping read from ``file`` and check each number against its bounds.

    Raises InputError for an unknown key, a value that is not a number, or one outside its bounds.
    Fields that are not declared quantities pass through unchecked.
    """
    declared = quantities(cls)
    names = {entry.name for entry in dataclasses.fields(cls)}  # type: ignore[arg-type]
    for key, value in values.items():
        if key not in names:
            raise InputError(file, f"{place} {key}", "unknown key", did_you_mean(key, names))
        if key in declared:
            about = declared[key]
            if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
                problem = "the number is missing" if value is None else f"{value!r} is not a number"
                raise InputError(file, f"{place} {key}", problem, f"give it in {about.unit}")
            check_bounds(about, value, file, f"{place} {key}")
    return cls(**values)


def check_bounds(about: Quantity, value: float, file: str | Path, place: str) -> None:
    """Raise InputError for a value outside the bounds of its declaration."""
    if not about.low <= value <= about.high:
        problem = f"{value:g} is outside {about.low:g} to {about.high:g} {about.unit}"
        raise InputError(file, place, problem, "correct the value or its unit")
