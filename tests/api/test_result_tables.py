"""Tables, figures and files of a result for scripts."""

from __future__ import annotations

import csv
import warnings
from dataclasses import replace
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pandas as pd
import pytest
from a_run import PERIOD, a_run
from bundled import bundled
from matplotlib.figure import Figure

import sssi_exudyn
from sssi_exudyn.api.result import Result
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.results.data_dictionary import SERIES, TURNS, describe

mpl.use("agg")
PLOTS = sorted(name for name in dir(Result) if name.startswith("plot_") and name != "plot_snow")


@pytest.fixture(scope="module")
def result() -> Result:
    return Result(a_run(14.0), {})


@pytest.mark.parametrize("name", PLOTS)
def test_every_plot_is_a_figure_with_something_in_it(result: Result, name: str) -> None:
    figure = getattr(result, name)()
    assert isinstance(figure, Figure)
    figure.canvas.draw()  # type: ignore[no-untyped-call]
    assert any(axes.lines for axes in figure.axes)
    assert all(axes.get_xlabel() for axes in figure.axes if axes.lines)


def test_a_script_may_draw_many_figures_without_closing_them(result: Result) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        figures = [result.plot_speed() for _ in range(mpl.rcParams["figure.max_open_warning"] + 1)]
    assert len(figures) > 20
    assert mpl.pyplot.get_fignums() == []


def test_a_notebook_is_given_figures_that_it_shows(result: Result, monkeypatch: pytest.MonkeyPatch) -> None:
    # a back end of a notebook shows what pyplot knows at a cell's end; of its names only the files' ones matter here
    monkeypatch.setattr("matplotlib.pyplot.get_backend", lambda: "inline")
    figure = result.plot_speed()
    assert [mpl.pyplot.figure(number) for number in mpl.pyplot.get_fignums()] == [figure]
    mpl.pyplot.close(figure)


@pytest.mark.parametrize("name", ["plot_agreement", "plot_angles", "plot_energy", "plot_from_above", "plot_loads"])
def test_a_legend_is_below_the_axes_and_within_its_figure(result: Result, name: str) -> None:
    figure = getattr(result, name)()
    figure.canvas.draw()
    (legend,) = figure.legends
    extent = legend.get_window_extent()
    assert extent.x0 >= 0.0
    assert extent.x1 <= figure.bbox.width
    assert extent.y1 <= min(axes.get_window_extent().y0 for axes in figure.axes)


def test_track_and_loads_show_what_was_simulated_and_what_was_measured(result: Result) -> None:
    track = result.plot_track()
    assert [line.get_label() for line in track.axes[0].lines] == ["GPS", "antenna, simulated"]
    loads = result.plot_loads().axes[0].lines
    assert len(loads) == 4
    assert all(line.get_xdata()[0] >= loads[0].get_xdata()[0] for line in loads)
    assert all(line.get_xdata()[-1] <= loads[0].get_xdata()[-1] for line in loads)
    bare = replace(result, stored=replace(result.stored, measured=None))
    assert bare.plot_track(track) is track
    assert len(track.axes[0].lines) == 3
    assert len(track.legends) == 1


def test_any_column_is_drawn_and_an_unknown_one_is_named(result: Result) -> None:
    (axes,) = result.plot("left_tip_deflection_m").axes
    assert axes.lines[0].get_label() == "left_tip_deflection_m"
    with pytest.raises(InputError, match="did you mean 'left_tip_deflection_m'"):
        result.plot("left_tip_deflection")
    with pytest.raises(InputError, match="a snow surface"):
        result.plot_snow()


def test_angles_moments_and_forces_are_columns_of_the_series(result: Result) -> None:
    assert list(result.angles)[:2] == ["time_s", "pelvis_rotation_deg"]
    assert len(result.angles.columns) == len(result.moments.columns) == 29
    assert result.moments.attrs["units"]["knee_angle_l_moment_Nm"] == "N m"
    assert {"left_load_N", "right_snow_force_up_N", "drag_east_N"} <= set(result.forces)
    assert set(result.forces.attrs["units"].values()) == {"s", "N"}


def test_turns_in_percent_are_the_series_at_those_times(result: Result) -> None:
    table = result.over_turns(["left_load_N"], points=51)
    complete = [turn for turn in result.stored.turns.turns if turn.complete]
    assert len(table) == 51 * len(complete)
    number, turn = 2, result.stored.turns.turns[1]
    assert turn.duration == pytest.approx(PERIOD / 2.0, abs=0.05)  # the path is filtered before turns are sought
    middle = np.interp(turn.start + 0.5 * turn.duration, result.stored.time, result.series["left_load_N"])
    assert table.loc[(number, 50.0), "left_load_N"] == pytest.approx(middle)
    assert table.loc[(number, 50.0), "side"] == turn.side
    with pytest.raises(InputError, match="did you mean 'left_load_N'"):
        result.over_turns("left_load")
    with pytest.raises(InputError, match="no complete turn"):
        Result(a_run(1.0), {}).over_turns()


def test_tables_as_csv_are_the_tables(result: Result, tmp_path: Path) -> None:
    names = {path.name for path in result.to_csv(tmp_path)}
    assert names == {"series.csv", "turns.csv", "measured.csv", "columns.csv"}
    again = pd.read_csv(tmp_path / "series.csv", keep_default_na=False)
    np.testing.assert_allclose(again["com_up_m"], result.series["com_up_m"], rtol=1e-8)  # nine digits are written
    rows = {(row["file"], row["name"]): row for row in csv.DictReader((tmp_path / "columns.csv").open())}
    assert set(rows) >= {(SERIES, name) for name in result.series}
    assert all(row["meaning"] for row in rows.values())
    assert rows[SERIES, "pelvis_f_m"]["frame"].startswith("slope: f down the fall line")


def test_a_clock_that_counts_from_1970_keeps_its_fractions_of_a_second(tmp_path: Path) -> None:
    run = a_run(1.0)
    first = 1_764_400_000.0
    later = Result(replace(run, series=run.series.assign(time_s=run.series["time_s"] + first)), {})
    later.to_csv(tmp_path)
    written = pd.read_csv(tmp_path / "series.csv")["time_s"]
    # 15 digits are microseconds
    np.testing.assert_allclose(written - first, run.series["time_s"], rtol=0.0, atol=2e-6)


@pytest.mark.long
def test_a_workbook_has_a_sheet_a_table(result: Result, tmp_path: Path) -> None:
    book = pd.read_excel(result.to_excel(tmp_path / "run.xlsx"), sheet_name=None)
    assert list(book) == ["figures", "series", "turns", "measured", "columns"]
    figures = book["figures"].set_index("figure")["value"]
    assert float(figures["friction.mu_t.value"]) == 0.0612
    assert len(book["series"]) == len(result.series)
    with pytest.raises(InputError, match=r"end its name in '\.xlsx'"):
        result.to_excel(tmp_path / "run.xls")


def test_the_dictionary_knows_every_column_of_a_run() -> None:
    run = a_run(14.0)
    assert run.turn_table is not None
    for file, table in ((SERIES, run.series), (TURNS, run.turn_table)):
        columns = describe(file, map(str, table.columns))
        assert [column.name for column in columns if not column.meaning] == []
        texts = {"turn", "turn_side", "turn_phase", "side", "phase", "complete"}
        assert {column.name for column in columns if not column.unit} <= texts
    names = [(row["file"], row["name"]) for row in sssi_exudyn.data_dictionary()]
    assert len(names) == len(set(names))
    assert len([name for file, name in names if file == TURNS]) >= 217


def test_columns_of_muscles_are_described() -> None:
    force, reserve, other = describe(
        SERIES, ["muscle_soleus_l_force_N", "muscles_knee_angle_r_reserve_Nm", "what_is_this_m"]
    )
    assert (force.unit, force.meaning) == ("N", "force of the muscle soleus l on its tendon")
    assert reserve.unit == "N m"
    assert (other.unit, other.meaning) == ("m", "")


def test_arguments_of_another_type_are_one_clear_line() -> None:
    with pytest.raises(InputError, match="a value of type int is no recording"):
        sssi_exudyn.simulate(3)  # type: ignore[arg-type]
    with pytest.raises(InputError, match=r"did you mean 'friction\.mu_t'"):
        sssi_exudyn.model_of(bundled("beginner")[0]).with_values({"friction.mut": 0.1})
    with pytest.raises(InputError, match="is no number"):
        sssi_exudyn.model_of(bundled("beginner")[0]).with_values({"friction.mu_t": "slow"})  # type: ignore[dict-item]


@pytest.mark.long(seconds=6)
@pytest.mark.usefixtures("words_only", "coarse_skis")
def test_csv_is_written_next_to_parquet_where_it_is_asked_for(tmp_path: Path) -> None:
    recording = bundled("beginner")[0]
    short = replace(recording, stop=recording.start + 0.4)
    with pytest.raises(InputError, match="no folder to write into"):
        sssi_exudyn.simulate(short, csv=True)
    run = sssi_exudyn.simulate(short, tmp_path / "run", csv=True)
    assert len(pd.read_csv(tmp_path / "run" / "series.csv")) == len(run.series)
    described = pd.read_csv(tmp_path / "run" / "columns.csv")
    assert {"series.parquet", "measured.parquet", "coordinates.mot", "snow_forces.mot"} <= set(described["file"])
    assert described["meaning"].notna().all()
    sssi_exudyn.simulate(short, tmp_path / "run")  # an old series.csv would be another run's
    assert not (tmp_path / "run" / "series.csv").exists()
