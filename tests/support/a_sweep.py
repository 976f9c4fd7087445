"""A sweep whose runs are not computed: its figure is a function of the parameters."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from sssi_exudyn.sweeps.file import sweep_from
from sssi_exudyn.sweeps.plan import Plan, plan_sweep
from sssi_exudyn.sweeps.run import crash_record
from sssi_exudyn.sweeps.table import table_of

EXAMPLES = Path(__file__).parents[2] / "examples"
FIRST, SECOND, THIRD = "friction.mu_t", "friction.mu_n", "skier.mass"
RANGES = {FIRST: (0.05, 0.15), SECOND: (0.2, 0.8), THIRD: (60.0, 80.0)}


def swept(
    kind: str, size: int, function: Callable[[float, float, float], float], lost: tuple[int, ...] = ()
) -> tuple[Plan, pd.DataFrame]:
    """Return a sweep whose mean speed is a function of the parameters, each brought to 0 … 1; some rows diverged."""
    bounds = [{"name": name, "low": low, "high": high} for name, (low, high) in RANGES.items()]
    settings: dict[str, Any] = {"format": 1, "recordings": ["beginner"], "outputs": ["mean_speed_mps"]}
    settings |= {"design": {"kind": kind, "size": size, "seed": 1}, "parameter": bounds}
    plan = plan_sweep(sweep_from(settings, EXAMPLES / "swept.toml"))
    records = {}
    for run in plan.runs():
        unit = [(value - RANGES[name][0]) / np.ptp(RANGES[name]) for name, value in dict(run.values).items()]
        record = replace(crash_record(run), status="diverged", error="the simulation diverged")
        if run.row not in lost:
            figures = {"mean_speed_mps": float(function(*unit))}
            record = replace(record, status="done", error="", figures=figures)
        records[run.key] = record
    return plan, table_of(plan, records)
