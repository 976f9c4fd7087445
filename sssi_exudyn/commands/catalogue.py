"""The work of ``sssi terms``, ``hypotheses``, ``columns`` and ``ski identify``, which need no run."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

import tomli_w

from sssi_exudyn.contact.registry import terms_table
from sssi_exudyn.io.writing import write_atomically
from sssi_exudyn.runtime.plugins import origin_of

if TYPE_CHECKING:
    from sssi_exudyn.bodies.ski.identification import IdentifiedSki


def terms() -> list[dict[str, str | float]]:
    """List every force term with its parameters."""
    return terms_table()


def hypotheses() -> list[dict[str, str | float]]:
    """List every hypothesis of the diagnosis with its share of the prior probability."""
    from sssi_exudyn.validation.diagnosis.hypotheses.catalogue import HYPOTHESES

    total = sum(hypothesis.weight for hypothesis in HYPOTHESES)
    rows: list[dict[str, str | float]] = []
    for hypothesis in HYPOTHESES:
        origin = origin_of(type(hypothesis))
        rows.append(
            {
                "name": hypothesis.name,
                "adds": hypothesis.caption,
                "prior": round(hypothesis.weight / total, 4),
                "origin": "built in" if origin is None else origin.name,
                "proposes": (type(hypothesis).__doc__ or "").strip().split("\n")[0],
            }
        )
    return rows


def data_dictionary() -> list[dict[str, str]]:
    """List every column of a result's tables."""
    from sssi_exudyn.results.data_dictionary import data_dictionary as columns

    return [asdict(column) for column in columns()]


def identify(folder: Path, out: Path | None = None, page: Path | None = None) -> IdentifiedSki:
    """Identify a ski's stiffness, density and damping from bench tests.

    Writes the ski to the file ``out`` and the tests with their fits to ``page`` if given.
    """
    from sssi_exudyn.bodies.ski.bench_tests import read_measurements
    from sssi_exudyn.bodies.ski.identification import identify_ski
    from sssi_exudyn.bodies.ski.ski import ski_to_table

    measured = read_measurements(folder)
    identified = identify_ski(measured)
    if out is not None:
        write_atomically(out, tomli_w.dumps({identified.ski.name: ski_to_table(identified.ski)}))
    if page is not None:
        from sssi_exudyn.reports.bench_page import bench_page

        write_atomically(page, bench_page(measured, identified))
    return identified


def identified_rows(identified: IdentifiedSki) -> list[dict[str, str | float]]:
    """Return a row a number of an identified ski, with its 95 % interval."""
    return [
        {
            "name": name,
            "unit": unit,
            "value": estimate.value,
            "se": estimate.se,
            "low": estimate.low,
            "high": estimate.high,
        }
        for name, estimate, unit in identified.estimates
    ]
