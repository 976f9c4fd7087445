"""What a sweep may change: every declared number, by its name, and how a changed number enters the model.

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
from sssi_exudyn.core.quantity import Quantity, quantities
from sssi_exudyn.model.faults import Sensor
from sssi_exudyn.model.from_recording import model_of
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
"""Parts that a recording declares; motion and start are computed anew from them."""
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
    """All numbers that a sweep may change in a model with these terms and sensors, by name; without ``SKIS``, which is
    no number.
    """
    parts: dict[str, Any] = {
        "skier": Skier,
        "equipment": Equipment,
        "slope": Slope,
        "ski": Ski,
        "start": Start,
        "solver": Solver,
    }
    found = [_parameter_of(part, about, cls) for part, cls in parts.items() for about in quantities(cls).values()]
    found += _scales()
    found += [
        Parameter(f"posture.{name}_deg", "deg", -30.0, 30.0, f"added to the recorded {name} all along", _DEGREE)
        for name in PRESCRIBED
    ]
    seen: dict[str, int] = {}
    for part_of in several:
        seen[part_of.name] = seen.get(part_of.name, 0) + 1
        label = part_of.name if seen[part_of.name] == 1 else f"{part_of.name}#{seen[part_of.name]}"
        found += [_parameter_of(label, about, type(part_of)) for about in quantities(part_of).values()]
    return {parameter.name: parameter for parameter in found}


def parameters_of_turn() -> dict[str, Parameter]:
    """All numbers that a sweep may change of a ski in a turn, by name."""
    parts: dict[str, Any] = {"ski": Ski, "turn": TurnCase, Carving.name: Carving}
    found = [_parameter_of(part, about, cls) for part, cls in parts.items() for about in quantities(cls).values()]
    return {parameter.name: parameter for parameter in (*found, *_scales())}


def _scales() -> list[Parameter]:
    return [Parameter(f"ski.{name}", "1", 0.5, 2.0, meaning) for name, meaning in _SCALES.items()]


def _parameter_of(part: str, about: Quantity, cls: type) -> Parameter:
    whole = cls.__annotations__[about.name] == "int"
    if about.unit != "rad":
        return Parameter(f"{part}.{about.name}", about.unit, about.low, about.high, about.meaning, whole=whole)
    low, high = about.low / _DEGREE, about.high / _DEGREE
    return Parameter(f"{part}.{about.name}_deg", "deg", low, high, about.meaning, _DEGREE)


def numbers_of(values: Values) -> dict[str, float | str]:
    """Values of a file under the model's names: angles in rad, without ``_deg``."""
    return {
        name.removesuffix("_deg"): value * _DEGREE if name.endswith("_deg") and not isinstance(value, str) else value
        for name, value in values.items()
    }


def is_shape(name: str) -> bool:
    """True for numbers of the bodies or their motion, False for those of forces, start and instruments."""
    return name.partition(".")[0] in _SHAPE


def change(
    recording: Recording, motion: Motion, base: Model | None, terms: tuple[Term, ...], shape: Values
) -> tuple[Recording, Motion, Model]:
    """Recording, motion and model with other bodies.

    Parameters
    ----------
    motion : of the unchanged recording
    base : the model to change; None for the recorded skier's own, whose start then follows a changed slope
    terms : force terms besides the model's
    shape : numbers for which ``is_shape``, as ``numbers_of`` gives them

    Raises InputError for an unknown ski, ValueError for numbers that contradict each other.
    """
    given: dict[str, dict[str, Any]] = {part: {} for part in _SHAPE}
    for name, value in shape.items():
        part, _, key = name.partition(".")
        given[part][key] = value
    if any(given[part] for part in _AS_RECORDED):
        recording = replace(
            recording,
            skier=replace(recording.skier, **given["skier"]),
            equipment=replace(recording.equipment, **given["equipment"]),
            slope=replace(recording.slope, **given["slope"]),
        )
        motion = motion_from_recording(recording)
    model = model_of(recording, motion) if base is None else _equip(base, recording, given)
    solver = {key: int(value) if key in _WHOLE else value for key, value in given["solver"].items()}
    model = replace(
        model,
        ski=reshape(model.ski, given["ski"]),
        terms=combine_terms(model.terms, terms),
        solver=replace(model.solver, **solver),
    )
    return recording, offset(motion, given["posture"]), model


def offset(motion: Motion, angles: Mapping[str, float]) -> Motion:
    """The motion with constants (rad) added to prescribed coordinates.  B-splines add up to one, so a constant added
    to all coefficients is added to the curve.
    """
    if not angles:
        return motion
    coefficients = motion.coefficients.copy()
    for name, angle in angles.items():
        coefficients[:, PRESCRIBED.index(name)] += angle
    return replace(motion, coefficients=coefficients)


def _equip(base: Model, recording: Recording, given: Mapping[str, Mapping[str, Any]]) -> Model:
    """``base`` with the changes of skier, equipment and slope."""
    slope = given["slope"]
    model = replace(
        base,
        skier=replace(base.skier, **given["skier"]),
        equipment=replace(base.equipment, **given["equipment"]),
        inclination=slope.get("inclination", base.inclination),
        fall_line_azimuth=slope.get("fall_line_azimuth", base.fall_line_azimuth),
    )
    skis = given["equipment"].get("skis")
    if skis is None:
        return model
    return replace(model, ski=read_equipped_ski(model.equipment, recording.folder, recording.folder / FILE))


def change_turn(ski: Ski, values: Values) -> tuple[Ski, TurnCase]:
    """The ski and its turn with the numbers of a point, as ``numbers_of`` gives them.

    Raises ValueError for numbers that contradict each other.
    """
    given: dict[str, dict[str, Any]] = {"ski": {}, "turn": {}, Carving.name: {}}
    for name, value in values.items():
        part, _, key = name.partition(".")
        given[part][key] = value
    return reshape(ski, given["ski"]), TurnCase(law=Carving(**given[Carving.name]), **given["turn"])


def reshape(ski: Ski, numbers: Mapping[str, float]) -> Ski:
    """The ski with other numbers and scaled profiles.  Raises ValueError where the boot is off the ski."""
    shape: dict[str, Any] = {}
    for name, value in numbers.items():
        profile = name.removesuffix("_scale")
        if name == "sidecut_scale":
            shape["width"] = _deepen(shape.get("width", ski.width), value)
        else:
            shape[profile] = _scale(shape.get(profile, getattr(ski, profile)), value) if name in _PROFILES else value
    found = replace(ski, **shape)
    if not 0.0 < found.boot_centre < found.length:
        raise ValueError(f"the boot centre at {found.boot_centre:g} m lies off a ski of {found.length:g} m")
    return found


def _deepen(width: Profile, factor: float) -> Profile:
    """The widths with that times the sidecut's depth: what they are wider than the waist."""
    waist = min(width.value[1:-1] or width.value)  # the ends are rounded off
    return replace(width, value=tuple(waist + factor * (value - waist) for value in width.value))


def _scale(profile: Profile, factor: float) -> Profile:
    return replace(profile, value=tuple(factor * value for value in profile.value))
