"""The model as ``model.toml`` holds it: written, and read back with every key checked."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from sssi_exudyn.bodies.ski.ski import read_ski
from sssi_exudyn.contact.registry import read_term
from sssi_exudyn.contact.term import parameters
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.quantity import build_checked
from sssi_exudyn.model.faults import read_sensor, values_of
from sssi_exudyn.model.model import Model, Solver, Start
from sssi_exudyn.recording.recording import Equipment, Skier


def model_to_dict(model: Model) -> dict[str, Any]:
    """The model as nested plain data, as ``model.toml`` holds it; angles in degrees, units in the keys' names."""
    start = asdict(model.start)
    start["heading_offset_deg"] = float(np.degrees(start.pop("heading_offset")))
    return {
        "format": 1,
        "name": model.name,
        "skier": {"mass_kg": model.skier.mass, "height_m": model.skier.height, "sex": model.skier.sex},
        "equipment": {
            "skis": model.equipment.skis,
            "ski_mass_kg": model.equipment.ski_mass,
            "boot_mass_kg": model.equipment.boot_mass,
            "ankle_to_ski_base_m": model.equipment.ankle_to_ski_base,
        },
        "slope": {
            "inclination_deg": float(np.degrees(model.inclination)),
            "fall_line_azimuth_deg": float(np.degrees(model.fall_line_azimuth)),
        },
        "term": [{"name": term.name, **parameters(term)} for term in model.terms],
        "sensor": [{"name": sensor.name, **values_of(sensor)} for sensor in model.sensors],
        "start": start,
        "solver": asdict(model.solver),
    }


def read_model(path: Path) -> Model:
    """A model from ``model.toml``; a ski given by a file is sought beside it.

    Raises InputError for whatever is missing, unknown or outside its bounds.
    """
    try:
        data = tomllib.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise InputError(path, "", "there is no such file", "name the model.toml of a result") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InputError(path, "", f"not a TOML file: {error}", "correct the file") from None

    def table(name: str) -> Mapping[str, Any]:
        found = data.get(name)
        if not isinstance(found, dict):
            raise InputError(path, f"[{name}]", "the table is missing", "add it as in a model.toml of this program")
        return found

    def number(name: str, key: str) -> float:
        value = table(name).get(key)
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise InputError(path, f"[{name}] {key}", f"{value!r} is not a number", "give a number")
        return float(value)

    skier, gear, start = table("skier"), table("equipment"), dict(table("start"))
    start["heading_offset"] = np.radians(number("start", "heading_offset_deg")).item()
    del start["heading_offset_deg"]
    terms = data.get("term")
    if not isinstance(terms, list) or not terms:
        raise InputError(path, "[[term]]", "there is no term", "give at least penetration, friction and air")
    equipment = build_checked(
        Equipment,
        {
            "skis": gear.get("skis"),
            "ski_mass": number("equipment", "ski_mass_kg"),
            "boot_mass": number("equipment", "boot_mass_kg"),
            "ankle_to_ski_base": number("equipment", "ankle_to_ski_base_m"),
        },
        path,
        "[equipment]",
    )
    return Model(
        name=str(data.get("name", path.stem)),
        skier=build_checked(
            Skier,
            {
                "mass": number("skier", "mass_kg"),
                "height": number("skier", "height_m"),
                "sex": skier.get("sex", "male"),
            },
            path,
            "[skier]",
        ),
        equipment=equipment,
        ski=read_ski(equipment.skis, path.parent),
        inclination=float(np.radians(number("slope", "inclination_deg"))),
        fall_line_azimuth=float(np.radians(number("slope", "fall_line_azimuth_deg"))),
        terms=tuple(
            read_term(
                str(entry.get("name")), {k: v for k, v in entry.items() if k != "name"}, path, f"[[term]] {i + 1}"
            )
            for i, entry in enumerate(terms)
        ),
        start=build_checked(Start, start, path, "[start]"),
        solver=build_checked(Solver, table("solver"), path, "[solver]"),
        sensors=tuple(
            read_sensor(
                str(entry.get("name")), {k: v for k, v in entry.items() if k != "name"}, path, f"[[sensor]] {i + 1}"
            )
            for i, entry in enumerate(data.get("sensor", []))
        ),
    )
