"""Force terms, hypotheses and readers of plug-ins, registered when the user names them.

A plug-in is a file of Python that defines them (classes derived from the terms' places, classes derived from those of
hypotheses, ``MotionReader`` and ``FixReader``), or an installed package whose entry points ``sssi_exudyn.terms``,
``sssi_exudyn.hypotheses`` and ``sssi_exudyn.readers`` are such objects.
"""

from __future__ import annotations

import inspect
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from sssi_exudyn.contact.registry import add_term
from sssi_exudyn.contact.term import Term
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.runtime.plugins import load, note


def use_plugin(what: str | Path | object) -> dict[str, Any]:
    """Run a plug-in, register what it offers, and return that by name.

    Parameters
    ----------
    what : a file that ends in .py, the name of an installed package, or a class or reader of a notebook

    Raises InputError where its code fails, where it offers nothing, or where a name is taken.
    """
    if isinstance(what, str | Path):
        used = {_name_of(part): part for part in load(what) if _add(part, str(what))}
        if not used:
            problem = "it offers no force term, hypothesis or reader"
            raise InputError(what, "", problem, "derive a class from FootTerm or SteadyLaw, or make a MotionReader")
        return used
    if not _add(what, repr(what)):
        problem = "neither a force term nor a hypothesis nor a reader"
        raise InputError(repr(what), "", problem, "derive it from FootTerm or SteadyLaw, or make a MotionReader")
    note(what if inspect.isclass(what) else type(what))
    return {_name_of(what): what}


def use_plugins(several: Iterable[str | Path]) -> None:
    """Call ``use_plugin`` for each."""
    for what in several:
        use_plugin(what)


def _name_of(part: object) -> str:
    """Return a class's name, or the ending of the files that a reader reads."""
    return str(getattr(part, "__name__", None) or getattr(part, "suffix", "")) or repr(part)


def _add(offered: object, source: str) -> bool:
    """Register one object; return False where it is no term, hypothesis or reader."""
    try:
        if inspect.isclass(offered):
            return _add_class(offered)
        return _add_reader(offered)
    except ValueError as error:
        raise InputError(source, getattr(offered, "__name__", ""), str(error), "choose another name") from None


def _add_class(cls: type) -> bool:
    if inspect.isabstract(cls):
        return False
    if issubclass(cls, Term) and hasattr(cls, "kind") and hasattr(cls, "name"):
        add_term(cls)
        return True
    # a class derived from a hypothesis has loaded this module; other plug-ins need not wait for it
    module = sys.modules.get("sssi_exudyn.validation.diagnosis.hypotheses.hypothesis")
    if module is not None and issubclass(cls, module.Hypothesis) and hasattr(cls, "name"):
        from sssi_exudyn.validation.diagnosis.hypotheses.catalogue import add_hypothesis

        add_hypothesis(cls())
        return True
    return False


def _add_reader(offered: object) -> bool:
    from sssi_exudyn.importing.motion_capture.motion_formats import MotionReader, add_motion_reader
    from sssi_exudyn.recording.instruments.gps import FixReader, add_fix_reader

    if isinstance(offered, MotionReader):
        add_motion_reader(offered)
        return True
    if isinstance(offered, FixReader):
        add_fix_reader(offered)
        return True
    return False
