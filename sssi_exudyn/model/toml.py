"""The model as ``model.toml`` holds it: written, and read back with every key checked."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

import numpy as np

from sssi_exudyn.bodies.ski.ski import Ski, catalogue, read_ski, ski_from_table, ski_to_table
from sssi_exudyn.bodies.skier.boot import Cuff
from sssi_exudyn.contact.registry import check_together, read_term
from sssi_exudyn.contact.term import parameters
from sssi_exudyn.core.choices import HEADING_MODES, SEXES
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.quantity import build_checked, quantities
from sssi_exudyn.io.settings import Settings, check_keys, key_of, name_of, numbers_of, read_toml, table_from, table_of
from sssi_exudyn.model.faults import read_sensor, values_of
from sssi_exudyn.model.heading import REPLAY, Heading, check_heading
from sssi_exudyn.model.legs import RIGID, Legs, check_legs
from sssi_exudyn.model.model import PRESETS, Model, Solver, Start
from sssi_exudyn.motion.correction_file import FILE as POSTURE
from sssi_exudyn.motion.correction_file import correction_bytes, correction_to_dict, read_correction
from sssi_exudyn.recording.equipment import check_mass, read_equipped_ski
from sssi_exudyn.recording.recording import OPTIONAL, Equipment, Skier, Slope
from sssi_exudyn.runtime.plugins import origins_of, require, tables_of
from sssi_exudyn.terrain.file import FILE as SURFACE
from sssi_exudyn.terrain.file import read_surface, surface_bytes, surface_to_dict

_TABLES: Final = (
    *("format", "name", "skier", "equipment", "slope", "term", "sensor", "start", "solver"),
    *("ski", "surface", "posture", "heading", "legs", "plugin"),
)
_KEYS: Final = {
    "skier": ("mass_kg", "height_m", "sex"),
    "equipment": (*(key_of(about) for cls in (Equipment, Cuff) for about in quantities(cls).values()), "skis"),
    "slope": ("inclination_deg", "fall_line_azimuth_deg"),
    "start": (*(name for name in quantities(Start) if name != "heading_offset"), "heading_offset_deg"),
    "solver": ("preset", *quantities(Solver)),
}
"""Keys of the tables that are always there; the readers of other tables check their own."""
_MOST_PARTS: Final = 1000
"""Maximum number of terms, or of sensors, in a model: by few sensors it has a term of braking every 2.5 s."""


def model_to_dict(model: Model) -> dict[str, Any]:
    """Return the model as nested plain data, as ``model.toml`` holds it; angles in degrees, units in the keys."""
    start = asdict(model.start)
    start["heading_offset_deg"] = float(np.degrees(start.pop("heading_offset")))
    surface = {} if model.surface is None else {"surface": surface_to_dict(model.surface)}
    posture = {} if model.posture is None else {"posture": correction_to_dict(model.posture)}
    heading = {} if model.heading == REPLAY else {"heading": asdict(model.heading)}
    legs = {} if model.legs == RIGID else {"legs": asdict(model.legs)}
    plugins = [plugin.as_table() for plugin in origins_of(type(term) for term in model.terms)]
    return {
        "format": 1,
        "name": model.name,
        "skier": {"mass_kg": model.skier.mass, "height_m": model.skier.height, "sex": model.skier.sex},
        "equipment": {
            "skis": model.equipment.skis,
            **table_from(model.equipment, Equipment, Cuff),
        },
        "slope": {
            "inclination_deg": float(np.degrees(model.inclination)),
            "fall_line_azimuth_deg": float(np.degrees(model.fall_line_azimuth)),
        },
        "term": [{"name": term.name, **parameters(term)} for term in model.terms],
        "sensor": [{"name": sensor.name, **values_of(sensor)} for sensor in model.sensors],
        "start": start,
        "solver": asdict(model.solver),
        **_own_ski(model),
        **surface,
        **posture,
        **heading,
        **legs,
        **({"plugin": plugins} if plugins else {}),
    }


def _own_ski(model: Model) -> dict[str, Any]:
    """Return the table ``[ski]``, which holds the model's ski where it is not the catalogue's of that name."""
    name = model.equipment.skis
    if name in catalogue() and model.ski == read_ski(name, ""):
        return {}
    return {"ski": {model.ski.name: ski_to_table(model.ski)}}


def model_files(model: Model) -> dict[str, bytes]:
    """Return the files next to ``model.toml`` that it names, by name.

    They hold the snow surface's heights and the posture's correction.
    """
    files = {} if model.surface is None else {SURFACE: surface_bytes(model.surface)}
    return files if model.posture is None else {**files, POSTURE: correction_bytes(model.posture)}


def read_model(path: Path) -> Model:
    """Read a model from ``model.toml``; files of a surface or of a ski that is not in it are looked for in its folder.

    Raises InputError for whatever is missing, unknown or outside its bounds.
    """
    data = read_toml(path)
    check_keys(data, _TABLES, path, "")
    if data.get("format", 1) != 1 or isinstance(data.get("format"), bool):
        raise InputError(path, "format", f"{data['format']!r} is not known", "write format = 1")
    require(tables_of(data, path), path)
    for name, keys in _KEYS.items():
        check_keys(table_of(data, name, path), keys, path, f"[{name}]")

    def table(name: str) -> Settings:
        return table_of(data, name, path)

    def number(name: str, key: str) -> object:
        return table(name).get(key)

    def radians(name: str, key: str) -> float:
        value = number(name, key)
        if not isinstance(value, int | float) or isinstance(value, bool):
            problem = "the key is missing" if value is None else f"{value!r} is not a number"
            raise InputError(path, f"[{name}] {key}", problem, "give it in degrees")
        return float(np.radians(value))

    skier, gear, start = table("skier"), table("equipment"), dict(table("start"))
    start["heading_offset"] = radians("start", "heading_offset_deg")
    del start["heading_offset_deg"]
    tables = _tables(data, "term", path)
    if not tables:
        raise InputError(
            path, "[[term]]", "there is no term", "give at least penetration, friction and air, or carving and air"
        )
    terms = tuple(
        read_term(str(entry.get("name")), {k: v for k, v in entry.items() if k != "name"}, path, f"[[term]] {i + 1}")
        for i, entry in enumerate(tables)
    )
    check_together(terms, path)
    heading = dict(table("heading")) if "heading" in data else {}
    if heading.get("mode", HEADING_MODES[0]) not in HEADING_MODES:
        problem = f"{str(heading['mode'])[:40]!r} is not known"
        raise InputError(path, "[heading] mode", problem, f"use one of: {', '.join(HEADING_MODES)}")
    held = build_checked(Heading, heading, path, "[heading]")
    check_heading(held, terms, path, "[heading] mode")
    legs = build_checked(Legs, dict(table("legs")) if "legs" in data else {}, path, "[legs]")
    check_legs(legs, terms, path, "[legs] compliance")
    sex = name_of(skier, "sex", path, "[skier]", default="male")
    if sex not in SEXES:
        raise InputError(path, "[skier] sex", f"{sex!r} has no anthropometric table", f"use of: {', '.join(SEXES)}")
    slope = build_checked(
        Slope,
        {
            "inclination": radians("slope", "inclination_deg"),
            "fall_line_azimuth": radians("slope", "fall_line_azimuth_deg"),
        },
        path,
        "[slope]",
    )
    worn = numbers_of(Equipment, gear, path, "[equipment]", optional=OPTIONAL)
    worn |= numbers_of(Cuff, gear, path, "[equipment]", optional=tuple(quantities(Cuff)))
    equipment = Equipment(skis=name_of(gear, "skis", path, "[equipment]"), **worn)
    return Model(
        name=name_of(data, "name", path, "", default=path.stem),
        skier=build_checked(
            Skier,
            {
                "mass": number("skier", "mass_kg"),
                "height": number("skier", "height_m"),
                "sex": sex,
            },
            path,
            "[skier]",
        ),
        equipment=equipment,
        ski=_read_ski(data, equipment, path),
        inclination=slope.inclination,
        fall_line_azimuth=slope.fall_line_azimuth,
        terms=terms,
        start=build_checked(Start, start, path, "[start]"),
        solver=_read_solver(table("solver"), path),
        sensors=tuple(
            read_sensor(
                str(entry.get("name")), {k: v for k, v in entry.items() if k != "name"}, path, f"[[sensor]] {i + 1}"
            )
            for i, entry in enumerate(_tables(data, "sensor", path))
        ),
        surface=read_surface(table("surface"), path) if "surface" in data else None,
        posture=read_correction(table("posture"), path) if "posture" in data else None,
        heading=held,
        legs=legs,
    )


def _read_solver(table: Settings, path: Path) -> Solver:
    """Return the preset's settings with those of the table in their place; without a preset, the paper's."""
    preset = name_of(table, "preset", path, "[solver]", default="paper")
    if preset not in PRESETS:
        raise InputError(path, "[solver] preset", f"{preset[:40]!r} is not known", f"use one of: {', '.join(PRESETS)}")
    own = {key: value for key, value in table.items() if key != "preset"}
    return build_checked(Solver, asdict(PRESETS[preset]) | own, path, "[solver]")


def _read_ski(data: Settings, equipment: Equipment, path: Path) -> Ski:
    """Return the ski in the table ``[ski]``; without it, the catalogue's or the file's that the equipment names."""
    if "ski" not in data:
        return read_equipped_ski(equipment, path.parent, path)
    tables = table_of(data, "ski", path)
    if len(tables) != 1:
        raise InputError(path, "[ski]", f"{len(tables)} skis", "keep exactly one table, named after the ski")
    ((name, table),) = tables.items()
    return check_mass(ski_from_table(name, table, path), equipment, path)


def _tables(data: Settings, name: str, path: Path) -> list[Settings]:
    """Return the tables ``[[name]]``; raises InputError for anything else, and for more than any model has."""
    tables = data.get(name, [])
    if not isinstance(tables, list) or not all(isinstance(entry, dict) for entry in tables):
        raise InputError(path, f"[[{name}]]", "these must be tables", f"write [[{name}]] with name and numbers below")
    if len(tables) > _MOST_PARTS:
        raise InputError(path, f"[[{name}]]", f"{len(tables)} of them, more than any model has", "leave some out")
    return tables
