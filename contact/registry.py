"""The list of the force terms, written out.  A term here that a model does not use is a hypothesis to be raised."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

from sssi_exudyn.contact.term import Term, formula
from sssi_exudyn.contact.terms.air import AirDrag
from sssi_exudyn.contact.terms.body_forces import PolePlant, UnexplainedForce
from sssi_exudyn.contact.terms.friction import AnisotropicFriction
from sssi_exudyn.contact.terms.friction_corrections import (
    EdgeDependentFriction,
    LoadDependentFriction,
    SnowCompaction,
    SnowPatch,
    SpeedDependentFriction,
)
from sssi_exudyn.contact.terms.penetration import HuntCrossley
from sssi_exudyn.contact.terms.terrain import SlopeChange, TerrainBump
from sssi_exudyn.contact.terms.wind import DragArea, Gust, Wind
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.quantity import build_checked, quantities

TERMS: Final[tuple[type[Term], ...]] = (
    HuntCrossley,
    AnisotropicFriction,
    AirDrag,
    Wind,
    Gust,
    DragArea,
    SnowPatch,
    SpeedDependentFriction,
    EdgeDependentFriction,
    LoadDependentFriction,
    SnowCompaction,
    SlopeChange,
    TerrainBump,
    PolePlant,
    UnexplainedForce,
)

PAPER_TERMS: Final[tuple[Term, ...]] = (HuntCrossley(), AnisotropicFriction(), AirDrag())
"""The terms of the published model, with their default parameters."""
_ABSENT: Final[Mapping[type[Term], Term]] = {
    HuntCrossley: HuntCrossley(k=0.0, c=0.0),
    AnisotropicFriction: AnisotropicFriction(mu_t=0.0, mu_n=0.0),
    AirDrag: AirDrag(c_d=0.0),
}
"""The published terms without strength; those of the others are their defaults."""


def pad_terms(terms: Sequence[Term]) -> tuple[Term, ...]:
    """The same laws, with those that are missing added without strength: of the registry, or of the published terms
    where there are no others.  So two compiled kernels serve all models.
    """
    published = all(type(term) in _ABSENT for term in terms)
    found: list[Term] = []
    for cls in TERMS:
        own = [term for term in terms if type(term) is cls]
        if not own and (cls in _ABSENT or not published):
            own = [_ABSENT[cls] if cls in _ABSENT else cls()]
        found += own
    return (*found, *(term for term in terms if type(term) not in TERMS))


def term_named(name: str) -> type[Term]:
    """The term of that name.  Raises KeyError with the names there are."""
    for cls in TERMS:
        if cls.name == name:
            return cls
    raise KeyError(f"no force term is named {name!r}; there are: {', '.join(cls.name for cls in TERMS)}")


def read_term(name: str, values: Mapping[str, object], file: str | Path, place: str) -> Term:
    """The term ``name`` with parameters as read from ``file`` at ``place``; those not given keep their default.

    Raises InputError for an unknown name, an unknown parameter, or a value that is no number within its bounds.
    """
    if name not in [cls.name for cls in TERMS]:
        known = ", ".join(cls.name for cls in TERMS)
        raise InputError(file, place, f"no force term is named {name!r}", f"use one of: {known}")
    return build_checked(term_named(name), values, file, place)


def terms_table() -> list[dict[str, str | float]]:
    """One row a parameter: name, kind, parameter, unit, default, low, high, source, meaning, formula."""
    return [
        {
            "name": cls.name,
            "kind": cls.kind,
            "parameter": about.name,
            "unit": about.unit,
            "default": about.default,
            "low": about.low,
            "high": about.high,
            "source": about.source,
            "meaning": about.meaning,
            "formula": formula(cls),
        }
        for cls in TERMS
        for about in quantities(cls).values()
    ]
