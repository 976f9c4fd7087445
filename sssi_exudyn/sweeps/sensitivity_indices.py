"""The effect of each parameter on each figure: Sobol's and Morris's indices with SALib, a share of variance without.

Sobol's indices (Saltelli et al., Comput. Phys. Commun. 181, 2010) and Morris's (Technometrics 33, 1991) need a design
of their own.  On a grid the analysis of variance is exact: runs have no error, so a parameter's share is the variance
of the means over its levels (Box, Hunter & Hunter, Statistics for Experimenters, 2005, ch. 5).  Where runs of a grid
are missing, it is how much less a sum of effects of single parameters explains without that parameter; on a whole grid
both are the same.  Any other design gives the share between groups of equal or near values of one parameter, corrected
for the number of groups (Kelley's ε², PNAS 21, 1935): an estimate of Sobol's first order, which scatters below 0 too.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from typing import Any, Final

import numpy as np
import pandas as pd

from sssi_exudyn.core.frames import Array
from sssi_exudyn.sweeps.design import INDEXED, MORRIS_LEVELS, Axis, block_of, problem_of, salib
from sssi_exudyn.sweeps.plan import Plan
from sssi_exudyn.sweeps.records import DONE

COLUMNS: Final = ["recording", "output", "index", "parameter", "other", "value", "confidence_95", "runs"]
MEANINGS: Final = {
    "S1": "share of the variance due to the parameter alone",
    "ST": "share of the variance due to the parameter, alone and with others",
    "S2": "share of the variance due to two parameters together, beyond each alone",
    "mu_star": "mean size of the figure's change over the parameter's range",
    "sigma": "standard deviation of that change: how far it depends on the other parameters, or is not linear",
    "share": "share of the variance due to the parameter alone: exact on a whole grid, else an estimate, whose scatter "
    "may be below 0",
}
TOTAL: Final = ("ST", "mu_star", "share")
"""Index that ranks parameters, for each kind of design."""
_SEED: Final = 1
"""Seed of the intervals' bootstrap; SALib takes 0 for none."""
_MOST_GROUPS: Final = 10
_LEAST_IN_GROUP: Final = 5
"""Least number of runs in a group, for its mean."""


def indices_of(plan: Plan, table: pd.DataFrame) -> pd.DataFrame:
    """Compute the indices of every output by every parameter, one row each; columns as ``COLUMNS``.

    Blocks of a design with a run that is not done are left out; where no block remains, or a figure does not vary,
    there is no row.  Raises SssiError where SALib is needed and missing.
    """
    rows: list[tuple[object, ...]] = []
    for folder in plan.file.folders:
        of_recording = table[table["recording"] == folder.name]
        for output in plan.outputs:
            index_rows = (
                _design_indices(plan, of_recording, output)
                if plan.file.design.kind in INDEXED
                else _grid_shares(plan.axes, of_recording, output)
                if plan.file.design.kind == "grid"
                else _shares(plan.axes, of_recording, output)
            )
            rows += [(folder.name, output, *row) for row in index_rows]
    return pd.DataFrame(rows, columns=COLUMNS)


def rank_parameters(indices: pd.DataFrame, recording: str, output: str, axes: Sequence[Axis]) -> list[Axis]:
    """Return the parameters in the order of their effect on the output, the strongest first."""
    about = indices[(indices["recording"] == recording) & (indices["output"] == output)]
    strength = about[about["index"].isin(TOTAL)].set_index("parameter")["value"].to_dict()
    return sorted(axes, key=lambda axis: -strength.get(axis.name, 0.0))


def groups_of(values: pd.Series[Any]) -> pd.Series[Any]:
    """Return a group's number for each value: the same for equal ones where those are few, else for near ones."""
    distinct = values.nunique()
    count = min(_MOST_GROUPS, len(values) // _LEAST_IN_GROUP)
    if distinct <= max(_MOST_GROUPS, count) or not pd.api.types.is_numeric_dtype(values):
        return values.rank(method="dense").astype(int)
    return (values.rank(method="first") * max(count, 2) / (len(values) + 1)).astype(int)


def _shares(axes: Sequence[Axis], table: pd.DataFrame, output: str) -> list[tuple[object, ...]]:
    known = table[(table["status"] == DONE) & table[output].notna()]
    y = known[output].to_numpy(dtype=float)
    rows: list[tuple[object, ...]] = []
    for axis in axes:
        groups = groups_of(known[axis.name]) if len(known) else pd.Series(dtype=int)
        count = groups.nunique()
        if count < 2 or len(y) <= count or not np.ptp(y) > 0.0:
            continue
        within = float(np.sum((y - known.groupby(groups)[output].transform("mean").to_numpy()) ** 2))
        left = within / (len(y) - count) / float(np.var(y, ddof=1))
        rows.append(("share", axis.name, None, 1.0 - left, None, len(y)))
    return rows


def _grid_shares(axes: Sequence[Axis], table: pd.DataFrame, output: str) -> list[tuple[object, ...]]:
    """Return rows of each parameter's share on a grid, and of each pair's where no run is missing."""
    known = table[(table["status"] == DONE) & table[output].notna()]
    y = known[output].to_numpy(dtype=float)
    varied = [axis.name for axis in axes if len(set(known[axis.name])) > 1]
    if not varied or not np.ptp(y) > 0.0:
        return []
    if len(known) < len(table):
        return [("share", name, None, share, None, len(y)) for name, share in _additive_shares(known[varied], y)]

    def between(names: Sequence[str]) -> float:
        return float(np.var(known.groupby(list(names))[output].transform("mean")) / np.var(y))

    alone = {name: between([name]) for name in varied}
    rows: list[tuple[object, ...]] = [("share", name, None, share, None, len(y)) for name, share in alone.items()]
    for first, second in combinations(varied, 2):
        together = between([first, second]) - alone[first] - alone[second]
        rows.append(("S2", first, second, together, None, len(y)))
    return rows


def _additive_shares(levels: pd.DataFrame, y: Array) -> list[tuple[str, float]]:
    """Return how much less of ``y`` (n,) the sum of single parameters' effects explains without each of them.

    The list is empty where there are too few runs to tell.
    """
    columns = {str(name): pd.get_dummies(levels[name], drop_first=True).to_numpy(dtype=float) for name in levels}
    if len(y) <= 1 + sum(column.shape[1] for column in columns.values()):
        return []
    whole, total = _unexplained(list(columns.values()), y), len(y) * float(np.var(y))
    without = {name: _unexplained([columns[other] for other in columns if other != name], y) for name in columns}
    return [(name, (more - whole) / total) for name, more in without.items()]


def _unexplained(columns: Sequence[Array], y: Array) -> float:
    """Sum of squares of ``y`` (n,) that a constant and columns (n, …) leave."""
    matrix = np.column_stack([np.ones(len(y)), *columns])
    return float(np.sum((y - matrix @ np.linalg.lstsq(matrix, y, rcond=None)[0]) ** 2))


def _design_indices(plan: Plan, table: pd.DataFrame, output: str) -> list[tuple[object, ...]]:
    size = block_of(plan.file.design, len(plan.axes))
    names = [axis.name for axis in plan.axes]
    valid = ((table["status"] == DONE) & table[output].notna()).to_numpy()
    complete = np.repeat(valid.reshape(-1, size).all(axis=1), size) if len(valid) == len(plan.points) else valid & False
    y, x = table[output].to_numpy(dtype=float)[complete], table[names].to_numpy(dtype=float)[complete]
    if len(y) < 2 * size or not np.ptp(y) > 0.0:
        return []
    problem = problem_of(plan.axes)
    if plan.file.design.kind == "morris":
        return _morris(problem, x, y)
    return _sobol(problem, y)


def _morris(problem: dict[str, Any], x: Array, y: Array) -> list[tuple[object, ...]]:
    result = salib("analyze.morris").analyze(problem, x, y, num_levels=MORRIS_LEVELS, seed=_SEED)
    rows: list[tuple[object, ...]] = []
    for i, name in enumerate(problem["names"]):
        rows.append(("mu_star", name, None, float(result["mu_star"][i]), float(result["mu_star_conf"][i]), len(y)))
        rows.append(("sigma", name, None, float(result["sigma"][i]), None, len(y)))
    return rows


def _sobol(problem: dict[str, Any], y: Array) -> list[tuple[object, ...]]:
    result = salib("analyze.sobol").analyze(problem, y, seed=_SEED)
    names = problem["names"]
    rows: list[tuple[object, ...]] = []
    for kind in ("S1", "ST"):
        for i, name in enumerate(names):
            rows.append((kind, name, None, float(result[kind][i]), float(result[f"{kind}_conf"][i]), len(y)))
    for i, first in enumerate(names):
        for j, second in enumerate(names[i + 1 :], i + 1):
            rows.append(("S2", first, second, float(result["S2"][i, j]), float(result["S2_conf"][i, j]), len(y)))
    return rows
