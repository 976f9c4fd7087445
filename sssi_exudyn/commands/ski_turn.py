"""The work of ``sssi ski turn``: skis side by side in steady turns."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

import numpy as np

from sssi_exudyn.bodies.ski.ski import ski_named
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.quantity import build_checked
from sssi_exudyn.io.writing import write_atomically
from sssi_exudyn.reports.turn_page import turn_page
from sssi_exudyn.runtime.progress import Progress
from sssi_exudyn.simulation.turns.steady_turn import TurnCase
from sssi_exudyn.simulation.turns.turn_rig import RigPoint, rig_points

_COMMAND: Final = "sssi ski turn"
_LEAST, _MOST, _STEP = 5.0, 75.0, 10.0
"""Degrees: the edge angles that the rig takes, and the step of a range without one."""
_MOST_ANGLES, _MOST_SKIS = 50, 10


def compare_skis(
    skis: Sequence[str], angles: Sequence[float], numbers: Mapping[str, float], page: Path | None, progress: Progress
) -> list[dict[str, str | float | None]]:
    """Turn every ski at every edge angle; a row a ski and angle.

    Parameters
    ----------
    skis : names of the catalogue, or paths of files with one ski each
    angles : edge angles in degrees, rising
    numbers : ``speed`` (m/s) and ``load`` (N along the snow's normal) of every turn
    page : file for a page that sets the skis side by side

    Raises InputError for a name that no ski has, too many skis, and numbers outside their bounds.
    """
    if len(skis) > _MOST_SKIS:
        raise InputError(_COMMAND, "SKI", f"{len(skis)} skis are too many for a page", f"give {_MOST_SKIS} at most")
    compared = [ski_named(name, Path(), _COMMAND, "SKI") for name in skis]
    case = build_checked(TurnCase, numbers, _COMMAND, "")
    with progress.stage("turns") as stage:
        points = rig_points(compared, [float(np.radians(angle)) for angle in angles], case, stage.advance)
    if page is not None:
        write_atomically(page, turn_page(compared, points, case))
    return [_row(point) for point in points]


def _row(point: RigPoint) -> dict[str, str | float | None]:
    """Return figures to the digits that mean something; ``null`` for a radius where the ski does not turn."""

    def rounded(value: float | None, digits: int) -> float | None:
        return None if value is None else round(value, digits)

    return {
        "ski": point.ski,
        "edge_deg": round(float(np.degrees(point.edge)), 6),
        "radius_m": rounded(point.radius, 3),
        "radius_low_m": rounded(point.radius_low, 3),
        "radius_high_m": rounded(point.radius_high, 3),
        "side_reserve": rounded(point.side_reserve, 4),
    }


def edge_angles(given: str | float | Sequence[float]) -> list[float]:
    """Return the edge angles (degrees, rising) of a text such as ``60``, ``30,45,60``, ``30:70`` or ``30:70:5``.

    A number and a sequence of numbers are taken too.

    Raises InputError for anything else, and for angles that the rig does not take.
    """
    text = given if isinstance(given, str) else _angles_text(given)
    if not re.fullmatch(r"[0-9.]+(,[0-9.]+)*|[0-9.]+(:[0-9.]+){1,2}", text):
        raise _no_angle(text, "is no edge angle")
    try:
        numbers = [float(part) for part in re.split("[,:]", text)]
    except ValueError:
        raise _no_angle(text, "is no edge angle") from None
    if ":" in text:
        first, last, step = (*numbers, _STEP)[:3]
        if not (last >= first and step > 0.0):
            raise _no_angle(text, "is no range that rises")
        count = int(np.floor((last - first) / step + 1e-9)) + 1
        if count > _MOST_ANGLES:
            raise _no_angle(text, f"has {count} angles, more than {_MOST_ANGLES}")
        numbers = [first + k * step for k in range(count)]
    if not all(_LEAST <= number <= _MOST for number in numbers):
        raise _no_angle(text, f"goes beyond {_LEAST:g} to {_MOST:g} degrees")
    return sorted(set(numbers))


def _angles_text(given: object) -> str:
    """Return numbers of a script as the command line takes them; anything else as it reads."""
    many = list(given) if isinstance(given, Sequence) else [given]
    numbers = all(isinstance(one, int | float) and not isinstance(one, bool) for one in many[: _MOST_ANGLES + 1])
    return ",".join(f"{one:.9g}" for one in many) if numbers and len(many) <= _MOST_ANGLES else str(given)


def _no_angle(text: str, problem: str) -> InputError:
    fix = "give degrees as 60, as 30,45,60, or as a range 30:70 or 30:70:5"
    return InputError(_COMMAND, "--edge", f"{text[:60]!r} {problem}", fix)
