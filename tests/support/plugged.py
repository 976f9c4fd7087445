"""Plug-ins for one test: their additions are removed after it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from sssi_exudyn.contact import registry
from sssi_exudyn.importing.motion_capture import motion_formats
from sssi_exudyn.recording.instruments import gps
from sssi_exudyn.runtime import plugins
from sssi_exudyn.validation.diagnosis.hypotheses import catalogue

_TABLES: tuple[Any, ...] = (
    registry.ADDED_TERMS,
    plugins.LOADED,
    motion_formats.MOTION_READERS,
    gps.READERS,
    catalogue.BY_NAME,
)
_LISTS: tuple[Any, ...] = (catalogue.HYPOTHESES, catalogue.STEADY_LAWS)


@contextmanager
def as_it_was() -> Iterator[None]:
    """Restore the program's terms, hypotheses and readers at the end."""
    tables, lists = [dict(table) for table in _TABLES], [list(entries) for entries in _LISTS]
    try:
        yield
    finally:
        for table, old in zip(_TABLES, tables, strict=True):
            table.clear()
            table.update(old)
        for entries, before in zip(_LISTS, lists, strict=True):
            entries[:] = before
