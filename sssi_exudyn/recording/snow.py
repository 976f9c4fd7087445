"""What a recording states of the snow: ``[snow]`` of ``recording.toml``."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Final

from sssi_exudyn.core.choices import SNOW_KINDS, SnowKind
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.quantity import quantities, quantity
from sssi_exudyn.io.settings import Settings, check_keys, key_of, name_of, numbers_of, table_of

_PLACE: Final = "[snow]"


@dataclass(frozen=True)
class _Temperatures:
    air_temperature: float = quantity(
        270.15, "K", low=223.15, high=313.15, source="polar winter to a day in summer", meaning="air above the slope"
    )
    snow_temperature: float = quantity(
        270.15,
        "K",
        low=223.15,
        high=273.15,
        source="snow melts where it is warmer",
        meaning="snow surface",
    )


@dataclass(frozen=True)
class SnowConditions:
    """The stated conditions; None where one is not stated.

    air_temperature, snow_temperature : K
    kind : fresh, wet, groomed or icy
    wax : in the user's words; "" where it is not stated
    """

    air_temperature: float | None = None
    snow_temperature: float | None = None
    kind: SnowKind | None = None
    wax: str = ""


def read_snow(settings: Settings, toml: Path) -> SnowConditions | None:
    """Read ``[snow]``; None where the recording has no such table.

    Raises InputError for an unknown key or kind, and for a temperature outside its bounds.
    """
    if "snow" not in settings:
        return None
    table = table_of(settings, "snow", toml)
    about = quantities(_Temperatures)
    check_keys(table, (*(key_of(one) for one in about.values()), "kind", "wax"), toml, _PLACE)
    kind = next((known for known in SNOW_KINDS if known == table.get("kind")), None)
    if "kind" in table and kind is None:
        problem = f"{str(table['kind'])[:40]!r} is no kind of snow"
        raise InputError(toml, f"{_PLACE} kind", problem, f"write one of: {', '.join(SNOW_KINDS)}")
    wax = name_of(table, "wax", toml, _PLACE) if "wax" in table else ""
    return SnowConditions(kind=kind, wax=wax, **numbers_of(_Temperatures, table, toml, _PLACE, optional=tuple(about)))
