"""Measurements on a ski: outline scan, weight, three-point bending, torsion and free vibration (paper 2.2.2).

A folder holds ``bench.toml`` and the tests' tables::

    name = "my_ski"
    mass_kg = 1.75                # the ski alone
    mass_sigma_kg = 0.005         # standard deviation of the balance
    boot_centre_m = 0.76          # from the tail

    [scan]                        # CSV: from_tail_mm, width_mm, thickness_mm, height_mm
    file = "scan.csv"
    thickness_sigma_mm = 0.05     # of the caliper, the same error at every place

    [bending]                     # CSV: force_N, deflection_mm, under the force
    file = "bending.csv"
    left_m = 0.2                  # supports and force, from the tail
    load_m = 0.8
    right_m = 1.4

    [torsion]                     # may be left out.  CSV: moment_Nm, twist_deg, between the clamp and the moment
    file = "torsion.csv"
    clamp_m = 0.8                 # where the ski is held and where it is twisted, from the tail
    load_m = 1.4

    [vibration]                   # CSV: time_s, signal (any unit) of the tip, the ski held at half its length
    file = "vibration.csv"
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

import numpy as np

from sssi_exudyn.bodies.ski.ski import PROFILES
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.quantity import build_checked, quantity
from sssi_exudyn.io.files import inside
from sssi_exudyn.io.settings import name_of, read_toml
from sssi_exudyn.io.table import read_table

FILE: Final = "bench.toml"


@dataclass(frozen=True)
class Measurements:
    """The measured data.  Places are metres from the tail; arrays are one-dimensional.

    scan_place, width, thickness, height (k,) m; force (n,) N; deflection (n,) m; time (m,) s; signal (m,) any unit
    moment, twist : (j,) N m, rad; empty without a torsion test
    """

    name: str
    scan_place: Array
    width: Array
    thickness: Array
    height: Array
    force: Array
    deflection: Array
    time: Array
    signal: Array
    moment: Array = field(default_factory=lambda: np.zeros(0))
    twist: Array = field(default_factory=lambda: np.zeros(0))
    mass: float = quantity(1.75, "kg", low=0.2, high=10.0, source="balance", meaning="the ski alone")
    mass_sigma: float = quantity(0.005, "kg", low=0.0, high=0.5, source="balance", meaning="its standard deviation")
    boot_centre: float = quantity(0.76, "m", low=0.1, high=2.0, source="ruler", meaning="from the tail")
    thickness_sigma: float = quantity(
        5e-5, "m", low=0.0, high=2e-3, source="caliper", meaning="error common to all thicknesses"
    )
    left: float = quantity(0.2, "m", low=0.0, high=3.0, source="ruler", meaning="rear support")
    load: float = quantity(0.8, "m", low=0.0, high=3.0, source="ruler", meaning="place of the force")
    right: float = quantity(1.4, "m", low=0.0, high=3.0, source="ruler", meaning="front support")
    twist_clamp: float = quantity(0.8, "m", low=0.0, high=3.0, source="ruler", meaning="where torsion is held")
    twist_load: float = quantity(1.4, "m", low=0.0, high=3.0, source="ruler", meaning="where the moment acts")


def read_measurements(folder: str | Path) -> Measurements:
    """Read ``bench.toml`` and its tables.  Raises InputError."""
    folder = Path(folder)
    file = inside(folder, FILE, folder / FILE, "")
    settings = dict(read_toml(file))
    sections = {name: _section(settings, name, file) for name in ("scan", "bending", "vibration")}
    scan = _columns(folder, sections["scan"], file, "scan", ("from_tail_mm", "width_mm", "thickness_mm", "height_mm"))
    bending = _columns(folder, sections["bending"], file, "bending", ("force_N", "deflection_mm"))
    vibration = _columns(folder, sections["vibration"], file, "vibration", ("time_s", "signal"))
    values: dict[str, object] = {
        "name": name_of(settings, "name", file, "", default=folder.resolve().name),
        "scan_place": 1e-3 * scan[0],
        "width": 1e-3 * scan[1],
        "thickness": 1e-3 * scan[2],
        "height": 1e-3 * scan[3],
        "force": bending[0],
        "deflection": 1e-3 * bending[1],
        "time": vibration[0],
        "signal": vibration[1],
        "thickness_sigma": _number(sections["scan"], "thickness_sigma_mm", 1e-3, file, "[scan]"),
    }
    values |= {key: _number(settings, f"{key}_kg", 1.0, file, "") for key in ("mass", "mass_sigma")}
    values["boot_centre"] = _number(settings, "boot_centre_m", 1.0, file, "")
    values |= {
        key: _number(sections["bending"], f"{key}_m", 1.0, file, "[bending]") for key in ("left", "load", "right")
    }
    if "torsion" in settings:
        section = _section(settings, "torsion", file)
        values["moment"], degrees = _columns(folder, section, file, "torsion", ("moment_Nm", "twist_deg"))
        values["twist"] = np.radians(degrees)
        for key in ("clamp", "load"):
            values[f"twist_{key}"] = _number(section, f"{key}_m", 1.0, file, "[torsion]")
    measured = build_checked(Measurements, values, file, "")
    _check(measured, file)
    return measured


def _check(measured: Measurements, file: Path) -> None:
    if not np.all(np.diff(measured.scan_place) > 0.0):
        raise InputError(file, "[scan]", "places do not rise from tail to tip", "sort the table by from_tail_mm")
    for name, (low, high) in PROFILES.items():
        values = 1e3 * getattr(measured, name)
        if values.min() < low or values.max() > high:
            raise InputError(file, "[scan]", f"{name} is outside {low:g} to {high:g} mm", "give millimetres")
    length = measured.scan_place[-1] - measured.scan_place[0]
    if not 0.0 <= measured.left < measured.load < measured.right <= length:
        raise InputError(file, "[bending]", "left, load and right are not in order on the ski", "measure from the tail")
    places = sorted((measured.twist_clamp, measured.twist_load))
    if len(measured.moment) and not 0.0 <= places[0] < places[1] <= length:
        raise InputError(file, "[torsion]", "clamp and load are not two places on the ski", "measure from the tail")
    if not np.all(np.diff(measured.time) > 0.0):
        raise InputError(file, "[vibration]", "time does not rise", "sort the table by time_s")


def _section(settings: dict[str, object], name: str, file: Path) -> dict[str, object]:
    section = settings.get(name)
    if not isinstance(section, dict):
        raise InputError(file, f"[{name}]", "the table is missing", "add it")
    return section


def _number(section: dict[str, object], key: str, scale: float, file: Path, place: str) -> object:
    """Return the value in SI where it is a number; ``build_checked`` refuses anything else."""
    if key not in section:
        raise InputError(file, f"{place} {key}".strip(), "is missing", "add it")
    value = section[key]
    return scale * value if isinstance(value, int | float) and not isinstance(value, bool) else value


def _columns(folder: Path, section: dict[str, object], file: Path, name: str, wanted: tuple[str, ...]) -> list[Array]:
    path = inside(folder, str(section.get("file", "")), file, f"[{name}] file")
    table = read_table(path)
    missing = [column for column in wanted if column not in table.columns]
    if missing:
        raise InputError(path, "line 1", f"column {missing[0]} is missing", f"name the columns {', '.join(wanted)}")
    return [table.columns[column] for column in wanted]
