"""The work of ``sssi terms`` and ``sssi ski identify``, which need no run."""

from __future__ import annotations

from pathlib import Path

import tomli_w

from sssi_exudyn.contact.registry import terms_table
from sssi_exudyn.io.writing import write_atomically


def terms() -> list[dict[str, str | float]]:
    """List every force term with its parameters."""
    return terms_table()


def identify(folder: Path, out: Path | None = None) -> list[dict[str, str | float]]:
    """Identify a ski's stiffness, density and damping from bench tests, and write the ski to the file ``out`` if given.

    Returns a row a number, with its 95 % interval.
    """
    # Here, since ``terms`` needs none of SciPy.
    from sssi_exudyn.bodies.ski.bench_tests import read_measurements
    from sssi_exudyn.bodies.ski.identification import identify_ski
    from sssi_exudyn.bodies.ski.ski import ski_to_table

    identified = identify_ski(read_measurements(folder))
    if out is not None:
        write_atomically(out, tomli_w.dumps({out.stem: ski_to_table(identified.ski)}))
    estimates = {
        "density": (identified.density, "kg/m^3"),
        "young_modulus": (identified.young_modulus, "Pa"),
        "damping_ratio": (identified.damping_ratio, "1"),
        "frequency": (identified.frequency, "Hz"),
    }
    return [
        {
            "name": name,
            "unit": unit,
            "value": estimate.value,
            "se": estimate.se,
            "low": estimate.low,
            "high": estimate.high,
        }
        for name, (estimate, unit) in estimates.items()
    ]
