"""Usual values that an import assumes for unstated facts, and the file in which a user may state them."""

from __future__ import annotations

from dataclasses import fields, replace
from pathlib import Path
from typing import Any, Final

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.quantity import quantities
from sssi_exudyn.importing.answers import Answers
from sssi_exudyn.io.settings import check_keys, read_toml
from sssi_exudyn.recording.recording import OPTIONAL, Equipment, Skier

_BODY: Final = {
    f"{about.name}_kg" if about.unit == "kg" else f"{about.name}_m": about.default
    for cls in (Skier, Equipment)
    for about in quantities(cls).values()
    if about.name not in OPTIONAL
}
USUAL: Final[dict[str, Any]] = {
    **_BODY,
    "skis": Equipment().skis,
    "boot_centre_m": 0.07,
    "antenna_joint": "Spine2",
    "antenna_offset_m": (0.0, 0.1, -0.16),
    "gps_sigma_m": 3.0,
}
"""Usual answers: an adult of medium size on slalom skis, in boots whose soles are 0.32 m long and begin 0.09 m behind
the ankle; a receiver of one frequency, with its accuracy, in a vest between the shoulders.
"""
OF_TELEPHONES: Final[dict[str, dict[str, Any]]] = {
    "pocket": {"antenna_joint": "Hips", "antenna_offset_m": (0.0, 0.0, 0.12)},
    "pelvis": {"antenna_joint": "Hips", "antenna_offset_m": (0.0, 0.0, -0.12)},
    "helmet": {"antenna_joint": "Head", "antenna_offset_m": (0.0, 0.2, 0.1)},
    "chest": {"antenna_joint": "Spine2", "antenna_offset_m": (0.0, 0.1, 0.14)},
}
"""Place of a telephone's or a camera's receiver: on the front of hip or chest, in a belt behind, or on the helmet."""
PLACES: Final = {
    "mass_kg": ("skier", "mass_kg"),
    "height_m": ("skier", "height_m"),
    "skis": ("equipment", "skis"),
    "ski_mass_kg": ("equipment", "ski_mass_kg"),
    "boot_mass_kg": ("equipment", "boot_mass_kg"),
    "ankle_to_ski_base_m": ("equipment", "ankle_to_ski_base_m"),
    "boot_centre_m": ("equipment", "boot_centre_m"),
    "antenna_joint": ("gps", "segment"),
    "antenna_offset_m": ("gps", "offset_m"),
    "gps_sigma_m": ("gps", "sigma_m"),
}
"""Table and key of each answer in ``recording.toml``."""
UNCERTAIN: Final = {"mass_kg": {"mass_kg": 12.0}, "antenna_offset_m": {"antenna_m": 0.15}}
"""Standard deviations of assumed answers (``[uncertainty]``): adults' masses, and receivers in vests, belts, rucksacks.
"""


def read_defaults(path: Path) -> Answers:
    """Read the answers of a TOML file, by the names of ``Answers``; a relative path counts from the file's folder.

    Raises InputError for unknown names and for values of another kind.
    """
    table = read_toml(path)
    kinds = {entry.name: str(entry.type) for entry in fields(Answers)}
    check_keys(table, kinds, path, "")
    answers: dict[str, Any] = {}
    for name, value in table.items():
        number = isinstance(value, int | float) and not isinstance(value, bool)
        if kinds[name].startswith("str"):
            if not isinstance(value, str):
                raise InputError(path, name, f"{value!r} is not a text", f'write {name} = "…"')
            answers[name] = path.parent / value if name == "dem" else value
        elif kinds[name].startswith("float"):
            if not number:
                raise InputError(path, name, f"{value!r} is not a number", "give it without quotes")
            answers[name] = float(value)
        else:
            if not isinstance(value, list) or len(value) != 3 or not all(isinstance(x, int | float) for x in value):
                raise InputError(path, name, f"{value!r} is not three numbers", "write [left, up, forward] in m")
            answers[name] = tuple(float(x) for x in value)
    return Answers(**answers)


def fill(answers: Answers, others: Answers) -> Answers:
    """Return the answers, completed by those of ``others``."""
    missing = [entry.name for entry in fields(Answers) if getattr(answers, entry.name) is None]
    return replace(answers, **{name: getattr(others, name) for name in missing})
