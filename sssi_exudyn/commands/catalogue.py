"""``sssi terms`` and ``sssi ski identify``: what needs no run."""

from __future__ import annotations

from pathlib import Path

import tomli_w

from sssi_exudyn.contact.registry import terms_table
from sssi_exudyn.io.writing import write_atomically


def terms() -> list[dict[str, str | float]]:
    """Every force term and its parameters."""
    return terms_table()


def identify(folder: Path, out: Path | None = None) -> list[dict[str, str | float]]:
    """A ski's stiffness, density and damping from bench tests, a row a number with its 95 % interval; the ski itself is
    written to the file ``out`` if given.
    """
    # Here, since ``terms`` needs none of SciPy.
    from sssi_exudyn.bodies.ski.bench_tests import read_measurements
    from sssi_exudyn.bodies.ski.identification import identify_ski
    from sssi_exudyn.bodies.ski.ski import ski_to_table

    found = identify_ski(read_measurements(folder))
    if out is not None:
        write_atomically(out, tomli_w.dumps({out.stem: ski_to_table(found.ski)}))
    estimates = {
        "density": (found.density, "kg/m^3"),
        "young_modulus": (found.young_modulus, "Pa"),
        "damping_ratio": (found.damping_ratio, "1"),
        "frequency": (found.frequency, "Hz"),
    }
    return [
        {"name": name, "unit": unit, "value": each.value, "se": each.se, "low": each.low, "high": each.high}
        for name, (each, unit) in estimates.items()
    ]
