"""The list of the force terms.  A term here that a model does not use may be a hypothesis of a diagnosis."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Final

from sssi_exudyn.contact.term import EdgeTerm, FootTerm, PointTerm, Term, formula
from sssi_exudyn.contact.terms.air import AirDrag, PostureAir
from sssi_exudyn.contact.terms.body_forces import PassingDrag, PlantedPole, PolePlant, UnexplainedForce
from sssi_exudyn.contact.terms.carving import Carving
from sssi_exudyn.contact.terms.friction import AnisotropicFriction
from sssi_exudyn.contact.terms.friction_corrections import (
    Braking,
    EdgeDependentFriction,
    EdgeFriction,
    LoadDependentFriction,
    SnowCompaction,
    SnowPatch,
    SpeedDependentFriction,
    UnexplainedDrag,
    UnexplainedFriction,
)
from sssi_exudyn.contact.terms.friction_law import FrictionLaw
from sssi_exudyn.contact.terms.penetration import HuntCrossley
from sssi_exudyn.contact.terms.terrain import SlopeChange, TerrainBump
from sssi_exudyn.contact.terms.wind import DragArea, Gust, Wind
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.quantity import build_checked, quantities
from sssi_exudyn.core.text import did_you_mean
from sssi_exudyn.runtime.plugins import origin_of, same_part

TERMS: Final[tuple[type[Term], ...]] = (
    HuntCrossley,
    AnisotropicFriction,
    AirDrag,
    PostureAir,
    Wind,
    Gust,
    DragArea,
    SnowPatch,
    SpeedDependentFriction,
    Braking,
    EdgeDependentFriction,
    EdgeFriction,
    LoadDependentFriction,
    SnowCompaction,
    FrictionLaw,
    SlopeChange,
    TerrainBump,
    PolePlant,
    PlantedPole,
    UnexplainedForce,
    PassingDrag,
    UnexplainedFriction,
    UnexplainedDrag,
    Carving,
)

PAPER_TERMS: Final[tuple[Term, ...]] = (HuntCrossley(), AnisotropicFriction(), AirDrag())
"""The terms of the published model, with their default parameters."""


ADDED_TERMS: Final[dict[str, type[Term]]] = {}
"""Terms of plug-ins, by their names."""


def add_term(cls: type[Term]) -> None:
    """Register a term of a plug-in by its name; a class that is defined again replaces the old one.

    Raises ValueError where the name is another term's.
    """
    registered = ADDED_TERMS.get(cls.name) or next((term for term in TERMS if term.name == cls.name), None)
    if registered is not None and not same_part(registered, cls):
        raise ValueError(f"there is a force term named {cls.name!r} already")
    ADDED_TERMS[cls.name] = cls


def known_terms() -> tuple[type[Term], ...]:
    """Return the terms of the list above, and those of plug-ins."""
    return (*TERMS, *ADDED_TERMS.values())


def term_named(name: str) -> type[Term]:
    """Return the term of that name.  Raises KeyError with the known names."""
    for cls in known_terms():
        if cls.name == name:
            return cls
    raise KeyError(f"no force term is named {name!r}; there are: {', '.join(cls.name for cls in known_terms())}")


def read_term(name: str, values: Mapping[str, object], file: str | Path, place: str) -> Term:
    """Read the term ``name`` with parameters from ``file`` at ``place``; those not given keep their default.

    Raises InputError for an unknown name, an unknown parameter, or a value that is no number within its bounds.
    """
    names = [cls.name for cls in known_terms()]
    if name not in names:
        raise InputError(file, place, f"no force term is named {name!r}", did_you_mean(name, names))
    return build_checked(term_named(name), values, file, place)


def is_carved(terms: Iterable[Term]) -> bool:
    """Tell whether edges cut the snow."""
    return any(isinstance(term, EdgeTerm) for term in terms)


def check_together(terms: Sequence[Term], file: str | Path, place: str = "[[term]]") -> None:
    """Raise InputError where terms do not act together: snow that edges cut has no other law under the skis."""
    cutting = [term.name for term in terms if isinstance(term, EdgeTerm)]
    for count, term in enumerate(terms, 1):
        if cutting and (isinstance(term, PointTerm | FootTerm) or cutting != [cutting[0]]):
            problem = f"{cutting[0]} stands in the place of all other laws of the snow under the skis"
            raise InputError(file, f"{place} {count}", f"{term.name}: {problem}", "leave one of them out")


def combine_terms(terms: Iterable[Term], added: Sequence[Term]) -> tuple[Term, ...]:
    """Add terms to others, which lose those that the added terms replace."""
    replaced = {name for term in added for name in term.replaces}
    return (*(term for term in terms if term.name not in replaced), *added)


def terms_table() -> list[dict[str, str | float]]:
    """Return one row a parameter of every term.

    Columns: name, kind, origin ("built in", or the plug-in's name), parameter, unit, default, low, high, source,
    meaning, formula.
    """
    return [
        {
            "name": cls.name,
            "kind": cls.kind,
            "origin": "built in" if (plugin := origin_of(cls)) is None else plugin.name,
            "parameter": about.name,
            "unit": about.unit,
            "default": about.default,
            "low": about.low,
            "high": about.high,
            "source": about.source,
            "meaning": about.meaning,
            "formula": formula(cls),
        }
        for cls in known_terms()
        for about in quantities(cls).values()
    ]
