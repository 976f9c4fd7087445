"""A sweep's table evaluated: indices of functions whose indices are known, and a page that holds them."""

import re
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from a_sweep import EXAMPLES, FIRST, RANGES, SECOND, THIRD, swept
from matplotlib.axes import Axes

from sssi_exudyn.reports.plots import svg
from sssi_exudyn.sweeps.file import sweep_from
from sssi_exudyn.sweeps.page import render_sweep
from sssi_exudyn.sweeps.plan import plan_sweep
from sssi_exudyn.sweeps.plots import axis_label
from sssi_exudyn.sweeps.run import crash_record
from sssi_exudyn.sweeps.sensitivity_indices import groups_of, indices_of, rank_parameters
from sssi_exudyn.sweeps.table import table_of


def values(indices: pd.DataFrame, kind: str) -> dict[str, float]:
    return indices[indices["index"] == kind].set_index("parameter")["value"].to_dict()


def test_sobol_indices_of_a_sum_and_a_product() -> None:
    # y = 2 a + b: variances 4/12 and 1/12, shares 0.8 and 0.2, nothing shared, nothing from c
    plan, table = swept("sobol_indices", 256, lambda a, b, _c: 2.0 * a + b)
    indices = indices_of(plan, table)
    # Sobol's sequence of 256 base points integrates so smooth a function to about a percent
    assert values(indices, "S1") == pytest.approx({FIRST: 0.8, SECOND: 0.2, THIRD: 0.0}, abs=0.02)
    assert values(indices, "ST") == pytest.approx({FIRST: 0.8, SECOND: 0.2, THIRD: 0.0}, abs=0.02)
    assert np.allclose(indices.loc[indices["index"] == "S2", "value"], 0.0, atol=0.03)
    ranked = rank_parameters(indices, "beginner", "mean_speed_mps", plan.axes)
    assert [axis.name for axis in ranked][:2] == [FIRST, SECOND]
    # y = (a − ½)(b − ½): all of it is shared
    indices = indices_of(*swept("sobol_indices", 256, lambda a, b, _c: (a - 0.5) * (b - 0.5)))
    assert values(indices, "S1") == pytest.approx(dict.fromkeys(RANGES, 0.0), abs=0.05)
    shared = indices[indices["index"] == "S2"].set_index(["parameter", "other"])["value"]
    assert shared[FIRST, SECOND] == pytest.approx(1.0, abs=0.1)


def test_morris_effects_of_a_line_are_its_slopes() -> None:
    plan, table = swept("morris", 10, lambda a, b, _c: 3.0 * a - b)
    indices = indices_of(plan, table)
    # SALib gives effects over the unit range; of a line all are equal to rounding
    assert values(indices, "mu_star") == pytest.approx({FIRST: 3.0, SECOND: 1.0, THIRD: 0.0}, abs=1e-9)
    assert values(indices, "sigma") == pytest.approx(dict.fromkeys(RANGES, 0.0), abs=1e-9)


@pytest.mark.parametrize("kind", ["morris", "sobol_indices"])
def test_lost_runs_take_their_blocks_along(kind: str) -> None:
    complete = swept(kind, 16, lambda a, b, c: a + b * c)
    size = len(complete[0].points) // 16
    indices = indices_of(*swept(kind, 16, lambda a, b, c: a + b * c, lost=(size + 1,)))
    assert len(indices)
    assert set(indices["runs"]) == {15 * size}
    everything = tuple(range(16 * size))
    assert indices_of(*swept(kind, 16, lambda a, b, c: a + b * c, lost=everything)).empty


def test_share_of_variance_in_any_design() -> None:
    plan, table = swept("latin_hypercube", 200, lambda a, b, _c: 2.0 * a + b)
    shares = values(indices_of(plan, table), "share")
    # ten groups leave a hundredth of each variance within them; 200 points spread by less than a tenth
    assert shares[FIRST] == pytest.approx(0.8, abs=0.08)
    assert shares[SECOND] == pytest.approx(0.2, abs=0.1)
    assert shares[THIRD] < 0.1
    constant = indices_of(*swept("latin_hypercube", 20, lambda _a, _b, _c: 1.0))
    assert constant.empty


def on_a_grid(function: Callable[[float, float], float], lost: tuple[int, ...] = ()) -> pd.DataFrame:
    """Indices of a mean speed that is a function of two of a grid's parameters; seven and three levels, 0 … 1."""
    levels = {FIRST: np.linspace(0.05, 0.15, 7), SECOND: np.linspace(0.2, 0.8, 3)}
    settings: dict[str, Any] = {"format": 1, "recordings": ["beginner"], "outputs": ["mean_speed_mps"]}
    settings |= {
        "design": {"kind": "grid"},
        "parameter": [{"name": name, "values": values.tolist()} for name, values in levels.items()],
    }
    plan = plan_sweep(sweep_from(settings, EXAMPLES / "swept.toml"))
    records = {}
    for run in plan.runs():
        unit = [(value - levels[name][0]) / np.ptp(levels[name]) for name, value in dict(run.values).items()]
        record = crash_record(run)
        if run.row not in lost:
            record = replace(record, status="done", error="", figures={"mean_speed_mps": float(function(*unit))})
        records[run.key] = record
    return indices_of(plan, table_of(plan, records))


def test_on_a_grid_the_shares_are_exact() -> None:
    """y = a + s b: variances of evenly spaced levels, (n + 1)/(12 (n − 1)) each; nothing is shared."""
    slope = 0.3
    first, second = 8.0 / 72.0, slope**2 * 4.0 / 24.0
    indices = on_a_grid(lambda a, b: a + slope * b)
    expected = {FIRST: first / (first + second), SECOND: second / (first + second)}
    assert expected[SECOND] == pytest.approx(0.119, abs=1e-3)  # what the estimate between groups calls 0.02
    assert values(indices, "share") == pytest.approx(expected, abs=1e-9)  # rounding
    assert indices.loc[indices["index"] == "S2", "value"].tolist() == pytest.approx([0.0], abs=1e-9)


def test_on_a_grid_all_shares_together_are_one() -> None:
    indices = on_a_grid(lambda a, b: (a - 0.4) * (b + 0.2) ** 2)
    assert len(indices) == 3
    assert indices["value"].sum() == pytest.approx(1.0, abs=1e-9)
    assert indices["value"].min() > 0.01


def test_shares_on_a_grid_hold_without_some_runs() -> None:
    """What a sum of effects explains less without one of them, with the runs that are there; nothing is unexplained."""
    shares = values(on_a_grid(lambda a, b: a + 0.3 * b, lost=(0, 4, 20)), "share")
    levels = [(a, b) for a in np.linspace(0.0, 1.0, 7) for b in np.linspace(0.0, 1.0, 3)]
    a, b = np.array([pair for row, pair in enumerate(levels) if row not in (0, 4, 20)]).T
    # of two effects the part of each that the other's levels do not explain: their group means are taken off by turns
    total = np.sum((a + 0.3 * b - np.mean(a + 0.3 * b)) ** 2)
    for name, effect, other in ((FIRST, a, b), (SECOND, 0.3 * b, a)):
        groups = pd.Series(effect).groupby(other).transform("mean").to_numpy()
        assert shares[name] == pytest.approx(np.sum((effect - groups) ** 2) / total, abs=1e-9)


def test_an_estimated_share_is_not_clipped() -> None:
    shares = values(indices_of(*swept("latin_hypercube", 60, lambda a, _b, _c: a)), "share")
    assert min(shares[SECOND], shares[THIRD]) < 0.0  # of nothing the estimate scatters to both sides


def test_groups_are_equal_values_where_few_and_near_ones_where_many() -> None:
    assert groups_of(pd.Series(["b", "a", "b"])).tolist() == [2, 1, 2]
    assert groups_of(pd.Series([0.1, 0.3, 0.1])).tolist() == [1, 2, 1]
    many = groups_of(pd.Series(np.linspace(0.0, 1.0, 100)))
    assert many.is_monotonic_increasing
    assert set(many.value_counts()) <= {9, 10, 11}


@pytest.mark.long
def test_page_shows_every_output_and_asks_nothing_of_a_network() -> None:
    plan, table = swept("sobol_indices", 8, lambda a, b, c: a + b * c, lost=(3,))
    page = render_sweep(plan, table, indices_of(plan, table), dict(plan.job.versions))
    assert page.count("<figcaption>") == 1 + 3 + 1  # bars, a curve for each parameter, a heat map
    assert "the simulation diverged" in page
    assert re.search(r'<p class="say">It goes from [\d.]+ to [\d.]+; friction.mu_t matters most.</p>', page)
    assert page.index("mean_speed_mps</h2>") < page.index("Runs</h2>")
    assert "<image" not in page  # the page's own rules would not show it
    assert not re.findall(r'(?:src|href)="(?!#)', page.replace('xlink:href="#', ""))
    assert page == render_sweep(plan, table, indices_of(plan, table), dict(plan.job.versions))


def test_page_of_a_sweep_of_which_nothing_is_done() -> None:
    plan, table = swept("latin_hypercube", 4, lambda a, _b, _c: a, lost=(0, 1, 2, 3))
    page = render_sweep(plan, table, indices_of(plan, table), dict(plan.job.versions))
    assert "0 of them complete" in page
    assert "<svg" not in page


@pytest.mark.parametrize(
    ("name", "unit", "label"),
    [
        ("mean_speed_mps", "m/s", "mean speed (m/s)"),
        ("edge_angle_max_deg", "deg", "edge angle max (°)"),
        ("friction.mu_t", "1", "friction.mu_t (1)"),
        ("posture.pelvis_list_deg", "deg", "posture.pelvis_list (°)"),
        ("skier.mass", "kg", "skier.mass (kg)"),
        ("equipment.skis", "", "equipment.skis"),
    ],
)
def test_axes_have_names_with_units(name: str, unit: str, label: str) -> None:
    assert axis_label(name, unit) == label


def test_long_names_have_their_room() -> None:
    def bars(axes: Axes) -> None:
        axes.barh([0, 1], [1.0, 2.0])
        axes.set_yticks([0, 1], ["friction.mu_t", "posture.pelvis_rotation_deg"])

    drawn = svg("x", bars, 2.9, 7.2)
    # the frame's left edge, in points of which an inch has 72: 27 letters of some 5.5 points
    left_edge = min(float(x) for x in re.findall(r'd="M ([\d.]+)', drawn) if float(x) > 0.0)
    assert left_edge > 27 * 5.5
