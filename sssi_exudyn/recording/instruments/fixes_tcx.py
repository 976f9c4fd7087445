"""Fixes in TCX files (Garmin Training Center XML), as watches and their sites export them."""

from __future__ import annotations

from pathlib import Path
from typing import Final
from xml.etree.ElementTree import Element

from sssi_exudyn.io.markup import text_below
from sssi_exudyn.recording.instruments.fixes import Fixes, fixes_of_points, number_of

_ELEMENTS: Final = ("Time", "AltitudeMeters", "Speed")
"""Elements of a track point, in the order of our columns; the speed is Garmin's extension TPX, m/s."""


def fixes_tcx(path: Path) -> Fixes:
    """Read the track points of all laps; points without a place are left out.  See ``fixes_of_points``."""
    return fixes_of_points(path, "Trackpoint", _place, _ELEMENTS)


def _place(point: Element) -> list[float]:
    return [number_of(text_below(point, name)) for name in ("LatitudeDegrees", "LongitudeDegrees")]
