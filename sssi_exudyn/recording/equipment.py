"""The ski that a recording's or a model's equipment names, checked against the masses stated there."""

from __future__ import annotations

from pathlib import Path

from sssi_exudyn.bodies.ski.ski import Ski, read_ski
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.recording.recording import Equipment


def read_equipped_ski(equipment: Equipment, folder: Path, file: Path) -> Ski:
    """Read the ski from the catalogue, or from a file in ``folder``.

    Raises InputError for an unknown ski, a faulty file, and a ski that is heavier than ``ski_mass_kg`` in ``file``,
    which counts the binding too.
    """
    return check_mass(read_ski(equipment.skis, folder, file), equipment, file)


def check_mass(ski: Ski, equipment: Equipment, file: Path) -> Ski:
    """Return the ski.  Raises InputError where it is heavier than ``ski_mass_kg`` in ``file``."""
    if ski.mass > equipment.ski_mass:
        raise InputError(
            file,
            "[equipment] ski_mass_kg",
            f"{equipment.ski_mass:g} kg with the binding is less than {ski.mass:g} kg of {equipment.skis!r} alone",
            "weigh one ski with its binding",
        )
    return ski
