"""Plug-ins for one test: what they add goes away after it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from sssi_exudyn.contact import registry
from sssi_exudyn.importing import motion_formats
from sssi_exudyn.recording.instruments import gps
from sssi_exudyn.runtime import plugins
from sssi_exudyn.validation.diagnosis.hypotheses import catalogue

_TABLES: tuple[Any, ...] = (
    registry._ADDED,
    plugins._by_module,
    motion_formats.MOTION_READERS,
    gps.READERS,
    catalogue.BY_NAME,
)
_LISTS: tuple[Any, ...] = (catalogue.HYPOTHESES, catalogue.STEADY_LAWS)


@contextmanager
def as_it_was() -> Iterator[None]:
    """Afterwards the program knows no more terms, hypotheses and readers than before."""
    tables, lists = [dict(table) for table in _TABLES], [list(each) for each in _LISTS]
    try:
        yield
    finally:
        for table, old in zip(_TABLES, tables, strict=True):
            table.clear()
            table.update(old)
        for each, before in zip(_LISTS, lists, strict=True):
            each[:] = before
