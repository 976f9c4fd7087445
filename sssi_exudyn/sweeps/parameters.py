"""Parameters of a sweep: every declared number, by its name, and its entry into the model.

Names are ``part.number``: ``skier``, ``equipment`` and ``slope`` as in a ``recording.toml``, ``ski``, ``start``,
``solver``, ``posture``, and the model's force terms and sensors by their own names.  Angles are in degrees and end in
``_deg``; everything else is in SI.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from sssi_exudyn.bodies.ski.ski import Profile, Ski
from sssi_exudyn.bodies.skier.chain import PRESCRIBED
from sssi_exudyn.contact.registry import combine_terms
from sssi_exudyn.contact.term import Term
from sssi_exudyn.contact.terms.carving import Carving
from sssi_exudyn.core.number_ref import NumberRef
from sssi_exudyn.core.quantity import Quantity, quantities
from sssi_exudyn.model.faults import Sensor
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.model.legs import Legs
from sssi_exudyn.model.model import Model, Solver, Start
from sssi_exudyn.motion.from_recording import motion_from_recording
from sssi_exudyn.motion.motion import Motion
from sssi_exudyn.recording.equipment import read_equipped_ski
from sssi_exudyn.recording.recording import FILE, Equipment, Recording, Skier, Slope
from sssi_exudyn.simulation.turns.steady_turn import TurnCase

SKIS: Final = "equipment.skis"
"""The one parameter that is a name: a ski of the catalogue."""
_DEGREE: Final = float(np.pi / 180.0)
_PROFILES: Final = {
    "width_scale": "factor on the ski's width all along",
    "thickness_scale": "factor on the ski's thickness all along",
    "height_scale": "factor on the height of camber and rocker all along",
}
_SCALES: Final = {**_PROFILES, "sidecut_scale": "factor on the depth of the ski's sidecut"}
_AS_RECORDED: Final = ("skier", "equipment", "slope")
"""Parts that a recording declares; motion and start are computed again from them."""
_SHAPE: Final = (*_AS_RECORDED, "ski", "solver", "posture")
_WHOLE: Final = [name for name, kind in Solver.__annotations__.items() if kind == "int"]

Values = Mapping[str, float | str]


@dataclass(frozen=True)
class Parameter:
    """One declared number: its name in files, unit there, bounds there, and the factor from there to SI.

    whole : True where it counts something
    """

    name: str
    unit: str
    low: float
    high: float
    meaning: str
    factor: float = 1.0
    whole: bool = False


def parameters_of(several: Iterable[Term | Sensor]) -> dict[str, Parameter]:
    """Return all numbers that a sweep may change in a model with these terms and sensors, by name.

    ``SKIS``, which is not a number, is not among them.
    """
    parts: dict[str, Any] = {
        "skier": Skier,
        "equipment": Equipment,
        "slope": Slope,
        "ski": Ski,
        "start": Start,
        "legs": Legs,
        "solver": Solver,
    }
    parameters = [_parameter_of(part, about, cls) for part, cls in parts.items() for about in quantities(cls).values()]
    parameters += _scales()
    parameters += [
        Parameter(f"posture.{name}_deg", "deg", -30.0, 30.0, f"added to the recorded {name} all along", _DEGREE)
        for name in PRESCRIBED
    ]
    counts: dict[str, int] = {}
    for component in several:
        counts[component.name] = counts.get(component.name, 0) + 1
        label = component.name if counts[component.name] == 1 else f"{component.name}#{counts[component.name]}"
        parameters += [_parameter_of(label, about, type(component)) for about in quantities(component).values()]
    return {parameter.name: parameter for parameter in parameters}


def parameters_of_turn() -> dict[str, Parameter]:
    """Return all numbers that a sweep may change of a ski in a turn, by name."""
    parts: dict[str, Any] = {"ski": Ski, "turn": TurnCase, Carving.name: Carving}
    parameters = [_parameter_of(part, about, cls) for part, cls in parts.items() for about in quantities(cls).values()]
    return {parameter.name: parameter for parameter in (*parameters, *_scales())}


def _scales() -> list[Parameter]:
    return [Parameter(f"ski.{name}", "1", 0.5, 2.0, meaning) for name, meaning in _SCALES.items()]


def _parameter_of(part: str, about: Quantity, cls: type) -> Parameter:
    whole = cls.__annotations__[about.name] == "int"
    if about.unit != "rad":
        return Parameter(f"{part}.{about.name}", about.unit, about.low, about.high, about.meaning, whole=whole)
    low, high = about.low / _DEGREE, about.high / _DEGREE
    return Parameter(f"{part}.{about.name}_deg", "deg", low, high, about.meaning, _DEGREE)


def numbers_of(values: Values) -> dict[str, float | str]:
    """Return a file's values under the model's names: angles in rad, without ``_deg``."""
    return {
        name.removesuffix("_deg"): value * _DEGREE if name.endswith("_deg") and not isinstance(value, str) else value
        for name, value in values.items()
    }


def is_shape(name: str) -> bool:
    """Tell whether a number is of the bodies or their motion, not of forces, start or instruments."""
    return NumberRef(name).part in _SHAPE


def change(
    recording: Recording, motion: Motion, base: Model | None, terms: tuple[Term, ...], shape: Values
) -> tuple[Recording, Motion, Model]:
    """Return recording, motion and model with other bodies.

    Parameters
    ----------
    motion : motion of the unchanged recording
    base : the model to change; None for the recorded skier's own, whose start then follows a changed slope
    terms : additional force terms
    shape : numbers for which ``is_shape``, as ``numbers_of`` gives them

    Raises InputError for an unknown ski, ValueError for numbers that contradict each other.
    """
    by_part: dict[str, dict[str, Any]] = {part: {} for part in _SHAPE}
    for name, value in shape.items():
        number = NumberRef(name)
        by_part[number.part][number.key] = value
    if any(by_part[part] for part in _AS_RECORDED):
        recording = replace(
            recording,
            skier=replace(recording.skier, **by_part["skier"]),
            equipment=replace(recording.equipment, **by_part["equipment"]),
            slope=replace(recording.slope, **by_part["slope"]),
        )
        motion = motion_from_recording(recording)
    model = model_of(recording, motion) if base is None else _equip(base, recording, by_part)
    solver = {key: int(value) if key in _WHOLE else value for key, value in by_part["solver"].items()}
    model = replace(
        model,
        ski=reshape(model.ski, by_part["ski"]),
        solver=replace(model.solver, **solver),
    )
    model = model.with_terms(combine_terms(model.terms, terms))
    return recording, offset(motion, by_part["posture"]), model


def offset(motion: Motion, angles: Mapping[str, float]) -> Motion:
    """Add constants (rad) to prescribed coordinates of a motion.

    B-splines add up to one, so a constant added to all coefficients is added to the curve.
    """
    if not angles:
        return motion
    coefficients = motion.coefficients.copy()
    for name, angle in angles.items():
        coefficients[:, PRESCRIBED.index(name)] += angle
    return replace(motion, coefficients=coefficients)


def _equip(base: Model, recording: Recording, by_part: Mapping[str, Mapping[str, Any]]) -> Model:
    """Return ``base`` with the changes of skier, equipment and slope."""
    slope = by_part["slope"]
    model = replace(
        base,
        skier=replace(base.skier, **by_part["skier"]),
        equipment=replace(base.equipment, **by_part["equipment"]),
        inclination=slope.get("inclination", base.inclination),
        fall_line_azimuth=slope.get("fall_line_azimuth", base.fall_line_azimuth),
    )
    skis = by_part["equipment"].get("skis")
    if skis is None:
        return model
    return replace(model, ski=read_equipped_ski(model.equipment, recording.folder, recording.folder / FILE))


def change_turn(ski: Ski, values: Values) -> tuple[Ski, TurnCase]:
    """Return the ski and its turn with the numbers of a point, as ``numbers_of`` gives them.

    Raises ValueError for numbers that contradict each other.
    """
    by_part: dict[str, dict[str, Any]] = {"ski": {}, "turn": {}, Carving.name: {}}
    for name, value in values.items():
        number = NumberRef(name)
        by_part[number.part][number.key] = value
    return reshape(ski, by_part["ski"]), TurnCase(law=Carving(**by_part[Carving.name]), **by_part["turn"])


def reshape(ski: Ski, numbers: Mapping[str, float]) -> Ski:
    """Return the ski with other numbers and scaled profiles.  Raises ValueError where the boot is off the ski."""
    shape: dict[str, Any] = {}
    for name, value in numbers.items():
        profile = name.removesuffix("_scale")
        if name == "sidecut_scale":
            shape["width"] = _deepen(shape.get("width", ski.width), value)
        else:
            shape[profile] = _scale(shape.get(profile, getattr(ski, profile)), value) if name in _PROFILES else value
    reshaped = replace(ski, **shape)
    if not 0.0 < reshaped.boot_centre < reshaped.length:
        raise ValueError(f"the boot centre at {reshaped.boot_centre:g} m lies off a ski of {reshaped.length:g} m")
    return reshaped


def _deepen(width: Profile, factor: float) -> Profile:
    """Multiply the sidecut's depth, the widths beyond the waist's, by ``factor``."""
    waist = min(width.value[1:-1] or width.value)  # the ends are rounded off
    return replace(width, value=tuple(waist + factor * (value - waist) for value in width.value))


def _scale(profile: Profile, factor: float) -> Profile:
    return replace(profile, value=tuple(factor * value for value in profile.value))
