"""The figures of one result for the season's table; a figure that the result does not have stays empty."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.noise import NORMAL_90
from sssi_exudyn.io.parquet import read_parquet
from sssi_exudyn.io.typed import read_table
from sssi_exudyn.results.folder import SUMMARY, TURNS

TECHNIQUES: Final = ("carving", "skidding", "wedge")


def result_figures(folder: Path) -> dict[str, float | str | None]:
    """Return the figures of the result in a folder.  Raises InputError where its summary cannot be read."""
    summary = read_table(folder / SUMMARY)
    friction = _at(summary, "friction", "mu_t", "value")
    se = _at(summary, "friction", "mu_t", "se")
    interval = (
        _at(summary, "uncertainty", "interval_90", "mu_t", "low"),
        _at(summary, "uncertainty", "interval_90", "mu_t", "high"),
    )
    low, high = _interval(friction, se) if None in interval else interval
    effective = _at(summary, "posture", "effective_friction", "value")  # along the path, with its error
    if effective is None:
        effective = _at(summary, "losses", "effective_friction")
    spread = _at(summary, "posture", "effective_friction", "se")
    stated = [_at(summary, "posture", "effective_friction_90", end) for end in ("low", "high")]
    effective_low, effective_high = _interval(effective, spread) if None in stated else stated
    technique = summary.get("technique")
    known = technique if isinstance(technique, Mapping) else {}
    likely = known.get("most_likely")
    return {
        "turns": _at(summary, "turns", "complete"),
        "mu_t": friction,
        "mu_t_low": low,
        "mu_t_high": high,
        "effective_friction": effective,
        "effective_friction_low": effective_low,
        "effective_friction_high": effective_high,
        "energy_lost_J_per_kg_m": _at(summary, "losses", "energy_lost_J_per_kg_m", "turn"),
        "energy_lost_a_turn_J_per_kg": _energy_of_a_turn(folder),
        "air_share": _at(summary, "losses", "air_share"),
        **{f"technique_{name}": _at(summary, "technique", name) for name in TECHNIQUES},
        "technique": likely if isinstance(likely, str) else "",
        "track_error_m": _at(summary, "trajectory", "mean_error_m"),
    }


def _energy_of_a_turn(folder: Path) -> float | None:
    """Return the median energy (J/kg) that the complete turns lost; None where no turn is known."""
    path = folder / TURNS[1]
    if not path.is_file() or path.is_symlink():
        return None
    try:
        table = read_parquet(path, ("complete",), ("side", "phase"))
    except InputError:
        return None
    if not {"phase", "energy_lost_J_per_kg"} <= set(table.columns):
        return None
    whole = table[(table["phase"] == "turn") & (table["complete"] == 1)]["energy_lost_J_per_kg"].to_numpy(dtype=float)
    return float(np.nanmedian(whole)) if np.any(np.isfinite(whole)) else None


def _interval(value: float | None, se: float | None) -> tuple[float | None, float | None]:
    """Return the 90 % interval of a figure that cannot be negative; None without a standard error."""
    if value is None or se is None:
        return None, None
    return max(0.0, value - NORMAL_90 * se), value + NORMAL_90 * se


def _at(table: Mapping[str, Any], *keys: str) -> float | None:
    """Return the number under nested keys; None where there is none."""
    value: Any = table
    for key in keys:
        value = value.get(key) if isinstance(value, Mapping) else None
    return float(value) if isinstance(value, int | float) and not isinstance(value, bool) else None
