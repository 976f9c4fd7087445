"""The parameters of a sweep: looked up among the declared ones, their values checked against the bounds."""

from __future__ import annotations

import difflib
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

import numpy as np

from sssi_exudyn.bodies.ski.ski import catalogue
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.number_ref import FRICTION, HEADING_OFFSET, NumberRef
from sssi_exudyn.fitting.first_fit import NUISANCES
from sssi_exudyn.io.settings import Settings, check_keys, text_of
from sssi_exudyn.sweeps.design import LISTED, Axis, size_of
from sssi_exudyn.sweeps.file import LARGEST, SweepFile, count_of, list_of, words_of
from sssi_exudyn.sweeps.parameters import SKIS, Parameter

_FULL_ONLY: Final = ("step", "spectral_radius", "relative_tolerance", "absolute_tolerance")
"""Numbers of ``solver`` that the reduced model does not use: it has its own integrator."""


def axes_of(file: SweepFile, declared: Mapping[str, Parameter]) -> tuple[Axis, ...]:
    """Read the file's parameters with their values, each checked against its declared bounds.

    Parameters
    ----------
    declared : parameters of the recordings' models, by name

    Raises InputError for an unknown name, a value outside its bounds, one without effect, and for too many points.
    """
    tables = _tables(file.settings, file.path)
    axes: list[Axis] = []
    for count, table in enumerate(tables, 1):
        place = f"[[parameter]] {count}"
        name = text_of(table, "name", file.path, place)
        if name in (axis.name for axis in axes):
            raise InputError(file.path, f"{place} name", f"{name} is swept twice", "keep one of them")
        if name == SKIS and file.task != "turn":
            axes.append(_skis(table, file, place))
            continue
        if name not in declared:
            near = difflib.get_close_matches(name, declared, 1)
            raise InputError(
                file.path, f"{place} name", f"no parameter is called {name!r}", _fix_for(name, near, declared)
            )
        _check_effect(file, name, place)
        axes.append(_axis(declared[name], table, file, place))
    if file.design.kind == "list" and len({len(axis.levels) for axis in axes}) > 1:
        lengths = ", ".join(f"{axis.name} {len(axis.levels)}" for axis in axes)
        raise InputError(file.path, "[[parameter]] values", f"lists of several lengths: {lengths}", "make them one")
    if file.design.kind not in LISTED and not axes:
        raise InputError(
            file.path, "[[parameter]]", "a drawn design needs a parameter", "add a parameter, or leave out [design]"
        )
    if size_of(file.design, axes) > LARGEST:
        raise InputError(
            file.path, "[[parameter]]", f"more than {LARGEST} points", "give fewer values or a smaller size"
        )
    return tuple(axes)


def _fix_for(name: str, near: Sequence[str], declared: Mapping[str, Parameter]) -> str:
    if near:
        return f"did you mean {near[0]!r}?"
    part = NumberRef(name).part
    of_part = [other for other in declared if other.startswith(f"{part}.")]
    if of_part:
        return f"use one of: {', '.join(of_part)}"
    return f"begin it with one of: {', '.join(dict.fromkeys(NumberRef(other).part for other in declared))}"


def _check_effect(file: SweepFile, name: str, place: str) -> None:
    number = NumberRef(name)
    if number.part == "solver" and number.key in _FULL_ONLY and file.tier == "reduced" and file.task == "simulate":
        raise InputError(
            file.path, f"{place} name", f"the reduced model does not use {number.key}", 'write tier = "full"'
        )
    fitted = [*FRICTION, *NUISANCES]
    if file.method == "paper":  # which keeps the heading of the capture
        fitted.remove(HEADING_OFFSET)
    if file.task == "fit" and name.removesuffix("_deg") in fitted:
        raise InputError(file.path, f"{place} name", f"the fit finds {name} itself", "sweep another parameter")


def _axis(parameter: Parameter, table: Settings, file: SweepFile, place: str) -> Axis:
    kind = file.design.kind
    if kind not in LISTED:
        check_keys(table, ("name", "low", "high"), file.path, place)
        low, high = (_number(table.get(key), parameter, file.path, f"{place} {key}") for key in ("low", "high"))
        if not low < high:
            raise InputError(file.path, place, f"low {low:g} is not below high {high:g}", "swap them")
        if parameter.whole:
            raise InputError(file.path, f"{place} name", f"{parameter.name} counts something", "use a grid or a list")
        return Axis(parameter, (low, high))
    keys = ("name", "values", "low", "high", "count") if kind == "grid" else ("name", "values")
    check_keys(table, keys, file.path, place)
    if "values" in table or kind == "list":
        if len(table) > 2:
            raise InputError(file.path, place, "values and bounds together", "give values, or low, high and count")
        values = list_of(table.get("values"), file.path, f"{place} values")
        return Axis(parameter, tuple(_number(value, parameter, file.path, f"{place} values") for value in values))
    low, high = (_number(table.get(key), parameter, file.path, f"{place} {key}") for key in ("low", "high"))
    count = count_of(table.get("count"), file.path, f"{place} count", least=2)
    spaced = [float(value) for value in np.linspace(low, high, count)]
    return Axis(parameter, tuple(_number(value, parameter, file.path, place) for value in spaced))


def _skis(table: Settings, file: SweepFile, place: str) -> Axis:
    check_keys(table, ("name", "values"), file.path, place)
    if file.design.kind not in LISTED:
        raise InputError(file.path, f"{place} name", "skis cannot be drawn between two bounds", "use a grid or a list")
    names = words_of(list_of(table.get("values"), file.path, f"{place} values"), file.path, f"{place} values")
    for name in names:
        if name not in catalogue():
            known = ", ".join(catalogue())
            raise InputError(file.path, f"{place} values", f"no ski is called {name!r}", f"use one of: {known}")
    return Axis(Parameter(SKIS, "", -math.inf, math.inf, "a ski of the catalogue"), names)


def _number(value: object, parameter: Parameter, path: Path, place: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        what = "is missing" if value is None else f"{value!r} is not a number"
        raise InputError(path, place, f"{parameter.name}: {what}", f"give it in {parameter.unit}")
    slack = 1e-9 * max(abs(parameter.low), abs(parameter.high))  # bounds went through degrees and back
    if not parameter.low - slack <= value <= parameter.high + slack:
        within = f"{parameter.low:g} to {parameter.high:g} {parameter.unit}"
        problem = f"{parameter.name}: {value:g} is outside {within}"
        raise InputError(path, place, problem, "correct the value or its unit")
    if parameter.whole and float(value) != round(value):
        raise InputError(path, place, f"{parameter.name}: {value:g} is not whole", "give a whole number")
    return float(value)


def _tables(settings: Settings, path: Path) -> list[Settings]:
    tables = settings.get("parameter", [])
    if not isinstance(tables, list) or not all(isinstance(table, Mapping) for table in tables):
        raise InputError(path, "[[parameter]]", "these must be tables", "write [[parameter]] with its keys below")
    return tables
