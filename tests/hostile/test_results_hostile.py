"""Result folders from other people: every fault in them gives one clear line, in bounded memory.

The readers are the report, the muscles and the validation.
"""

from __future__ import annotations

import json
import os
import re
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from a_diagnosis import whole_version
from a_run import a_run
from limited import run_limited
from no_plots import without_plots
from tiny import Tiny

import sssi_exudyn
from sssi_exudyn.bodies.skier.chain import average_geometry, geometry_to_dict
from sssi_exudyn.commands.pages import report, validate
from sssi_exudyn.io import parquet
from sssi_exudyn.model.toml import model_to_dict
from sssi_exudyn.reports.plots import svg
from sssi_exudyn.results.folder import DRAW_ANGLES, DRAW_MASS, ResultContent, amend_result, read_diagnosis, write_result
from sssi_exudyn.results.stored import read_run

Spoil = Callable[[Path], object]


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Write a result with all its files, and import every module."""
    folder = tmp_path_factory.mktemp("whole") / "result"
    run = a_run(6.0, 25.0)
    half = pd.DataFrame({"time_s": [0.0, 1.0], "measured_mps": [9.0, 9.5], "predicted_mps": [9.1, 9.4]})
    draws = pd.DataFrame({"draw": 0, "time_s": [0.0, 1.0], **dict.fromkeys(DRAW_ANGLES, 0.0), DRAW_MASS: 75.0})
    content = ResultContent(
        run.summary,
        run.series,
        model_to_dict(run.model),
        measured=run.measured,
        skeleton=geometry_to_dict(average_geometry(1.75)),
        diagnosis=whole_version(),
        turns=run.turn_table,
        second_half=half,
        draws=draws,
    )
    write_result(folder, content)
    svg("first", lambda _: None, 1.0, 1.0)  # Matplotlib is loaded here, not in a process whose memory is limited
    with without_plots():
        report([folder], folder.parent / "report.html")
    return folder


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return Tiny().write(tmp_path_factory.mktemp("recording") / "tiny")


@pytest.fixture
def result(whole: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(whole, tmp_path / "result"))


def in_table(name: str, change: Callable[[pd.DataFrame], pd.DataFrame]) -> Spoil:
    def spoil(folder: Path) -> None:
        change(pd.read_parquet(folder / name)).to_parquet(folder / name, index=False)

    return spoil


def in_series(change: Callable[[pd.DataFrame], pd.DataFrame]) -> Spoil:
    return in_table("series.parquet", change)


def in_json(name: str, change: Callable[[dict[str, Any]], object]) -> Spoil:
    def spoil(folder: Path) -> None:
        table = json.loads((folder / name).read_text(encoding="utf-8"))
        change(table)
        (folder / name).write_text(json.dumps(table), encoding="utf-8")

    return spoil


def text(name: str, content: str | bytes) -> Spoil:
    return lambda folder: (folder / name).write_bytes(content if isinstance(content, bytes) else content.encode())


def cut(name: str, keep: float) -> Spoil:
    def spoil(folder: Path) -> None:
        data = (folder / name).read_bytes()
        (folder / name).write_bytes(data[: int(keep * len(data))])

    return spoil


def column(name: str, values: object) -> Callable[[pd.DataFrame], pd.DataFrame]:
    return lambda table: table.assign(**{name: values})


def many_rows(folder: Path) -> None:
    table = pa.table({"time_s": np.zeros(3_000_000)})
    pq.write_table(table, folder / "series.parquet")


def many_columns(folder: Path) -> None:
    pq.write_table(pa.table({f"c{k}": [0.0] for k in range(5000)}), folder / "series.parquet")


def page_bomb(folder: Path) -> None:
    """Write a column of one text of 300 MB, which is 30 kB on disk."""
    table = pq.read_table(folder / "series.parquet").slice(0, 1)
    text = pa.array([b"\0" * 300_000_000]).cast(pa.string())
    table = table.set_column(table.schema.get_field_index("turn_side"), "turn_side", text)
    path = folder / "series.parquet"  # statistics would take seconds
    pq.write_table(table, path, compression="zstd", use_dictionary=False, write_statistics=False)


def beyond_the_texts(folder: Path) -> None:
    """Write a row that points to the sixth text where there is one."""
    table = pq.read_table(folder / "series.parquet").slice(0, 1)
    side = pa.DictionaryArray.from_arrays(pa.array([5], pa.int32()), pa.array(["left"]), safe=False)
    pq.write_table(
        table.set_column(table.schema.get_field_index("turn_side"), "turn_side", side), folder / "series.parquet"
    )


def two_names(folder: Path) -> None:
    """Damage a letter of a column's name in one of its places."""
    path = folder / "measured.parquet"
    before, name, between, again, after = re.split(b"(gps_east_m)", path.read_bytes(), maxsplit=2)
    path.write_bytes(before + name + between + again.replace(b"east", b"eXst") + after)


def fifo(name: str) -> Spoil:
    def spoil(folder: Path) -> None:
        (folder / name).unlink()
        os.mkfifo(folder / name)

    return spoil


def link(name: str) -> Spoil:
    def spoil(folder: Path) -> None:
        (folder / name).rename(folder.parent / "elsewhere")
        (folder / name).symlink_to(folder.parent / "elsewhere")

    return spoil


def twice(folder: Path) -> None:
    table = pq.read_table(folder / "series.parquet")
    pq.write_table(table.append_column("time_s", table["time_s"]), folder / "series.parquet")


FILES = ("summary.json", "series.parquet", "measured.parquet", "skeleton.json", "diagnosis.json", "second_half.parquet")
CASES: dict[str, tuple[Spoil, str]] = {
    "summary: a list for a group": (in_json("summary.json", lambda t: t.update(fit=[1])), "summary.json: $.fit"),
    "summary: a text for a number": (
        in_json("summary.json", lambda t: t["solver"].update(wall_s="x\x1b[31m")),
        "summary.json: $.solver.wall_s",
    ),
    "summary: a name that is a list": (in_json("summary.json", lambda t: t.update(recording=[])), "$.recording"),
    "summary: NaN": (text("summary.json", '{"format": 1, "fit": {"wall_s": NaN}}'), "summary.json: not JSON"),
    "summary: 1e999": (text("summary.json", '{"format": 1, "fit": {"wall_s": 1e999}}'), "larger than any"),
    "summary: 5000 digits": (text("summary.json", '{"format": 1, "seed": ' + "9" * 5000 + "}"), "larger than any"),
    "summary: nested": (text("summary.json", '{"format": 1, "x": ' + "[" * 900 + "]" * 900 + "}"), "tables within"),
    "summary: nested deeply": (text("summary.json", "[" * 100_000), "not JSON"),
    "summary: large": (text("summary.json", b'{"format": 1, "x": "' + b"a" * 6_000_000 + b'"}'), "more than 5 MB"),
    "summary: no text": (text("summary.json", b"\xff\xfe{"), "not JSON"),
    "series: no time": (in_series(lambda t: t.drop(columns="time_s")), "series.parquet: column time_s: "),
    "series: a column missing": (in_series(lambda t: t.drop(columns="knee_angle_r_deg")), "column knee_angle_r_deg"),
    "series: time reversed": (in_series(lambda t: t[::-1]), "time does not rise"),
    "series: time NaN": (in_series(column("time_s", np.nan)), "time does not rise"),
    "series: time stands": (in_series(column("time_s", 1.0)), "time does not rise"),
    "series: gigantic time": (in_series(lambda t: t.assign(time_s=t["time_s"] * 1e9)), "column time_s: more than"),
    "series: NaN": (in_series(column("com_east_m", np.nan)), "column com_east_m: not a number"),
    "series: infinite": (in_series(column("energy_gravity_J", np.inf)), "larger than any quantity"),
    "series: texts for numbers": (in_series(column("left_load_N", "much")), "in place of numbers"),
    "series: lists for numbers": (in_series(lambda t: t.assign(left_load_N=[[1.0]] * len(t))), "in place of numbers"),
    "series: dates for numbers": (in_series(column("time_s", pd.Timestamp(0))), "in place of numbers"),
    "series: long texts": (in_series(column("turn_side", "x" * 10_000)), "texts that are no names"),
    "series: no row": (in_series(lambda t: t[:0]), "there is no sample"),
    "series: a name with escapes": (in_series(column("energy_\x1b[31m_J", 0.0)), "no name of a column"),
    "series: a column twice": (twice, "comes twice"),
    "series: many rows": (many_rows, "rows of 1 columns are more than any result has"),
    "series: many columns": (many_columns, "5000 columns"),
    "series: a page that swells": (page_bomb, "more bytes than any result has"),
    "series: beyond the texts": (beyond_the_texts, "not a Parquet file"),
    "series: torn": (cut("series.parquet", 0.7), "not a Parquet file"),
    "series: empty": (cut("series.parquet", 0.0), "not a Parquet file"),
    "measured: no sigma": (in_table("measured.parquet", lambda t: t.drop(columns="gps_sigma_m")), "gps_sigma_m"),
    "measured: another column": (in_table("measured.parquet", column("gps_east_mm", 1.0)), "column gps_east_mm"),
    "measured: a column of two names": (two_names, "the file is damaged"),
    "measured: reversed": (in_table("measured.parquet", lambda t: t[::-1]), "time does not rise"),
    "measured: torn": (cut("measured.parquet", 0.5), "measured.parquet: not a Parquet file"),
    "second half: texts": (in_table("second_half.parquet", column("measured_mps", "fast")), "in place of numbers"),
    "draws: no mass": (in_table("draws.parquet", lambda t: t.drop(columns="skier_mass_kg")), "skier_mass_kg"),
    "draws: NaN": (in_table("draws.parquet", column("knee_angle_r_rad", np.nan)), "not a number"),
    "turns: no phase": (in_table("turns.parquet", lambda t: t.drop(columns="phase")), "side and phase"),
    "turns: no speed": (in_table("turns.parquet", lambda t: t.drop(columns="mean_speed_mps")), "mean_speed_mps"),
    "skeleton: wrong shape": (in_json("skeleton.json", lambda t: t.update(segment_end_m=[[1.0]])), "segment_end_m"),
    "skeleton: a table": (in_json("skeleton.json", lambda t: t.update(segment_end_m={"a": 1})), "skeleton.json"),
    "skeleton: gigantic": (in_json("skeleton.json", lambda t: t.update(ankle_to_ski_base_m=1e40)), "of a skier"),
    "diagnosis: lengths": (
        in_json("diagnosis.json", lambda t: t["latent_force"]["before"]["force_N"].pop()),
        "diagnosis.json: $.latent_force.before: the lists have other lengths",
    ),
    "diagnosis: distances": (in_json("diagnosis.json", lambda t: t["track_distance"]["time_s"].pop()), "lengths"),
    "diagnosis: a word for a number": (in_json("diagnosis.json", lambda t: t.update(noise="loud")), "$.noise"),
    "diagnosis: no verdict": (in_json("diagnosis.json", lambda t: t.pop("verdict")), "verdict"),
    **{f"{name}: a pipe": (fifo(name), f"{name}: this is not a file") for name in FILES},
    **{f"{name}: a link": (link(name), f"{name}: this is a link") for name in FILES},
}


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[pytest.mark.long] if "swells" in name else []) for name in CASES]
)
def test_a_hostile_result_is_refused_in_one_clear_line(result: Path, name: str) -> None:
    spoil, expected = CASES[name]
    spoil(result)
    out = result.parent / "page.html"
    outcome = run_limited(lambda: report([result], out))
    assert outcome.verdict == "refused", outcome
    assert expected in outcome.text
    assert outcome.text.startswith(str(result))
    assert not out.exists()


MUSCLES: dict[str, tuple[Spoil, str]] = {
    "no skeleton": (lambda folder: (folder / "skeleton.json").unlink(), "did not keep the skier's lengths"),
    "gigantic skeleton": CASES["skeleton: gigantic"],
    "few samples": (in_series(lambda t: t[:5]), "fewer than 6 samples"),
    "no moment": (in_series(lambda t: t.drop(columns="knee_angle_r_moment_Nm")), "knee_angle_r_moment_Nm"),
    "infinite moment": (in_series(column("knee_angle_r_moment_Nm", np.inf)), "larger than any quantity"),
    "texts": (in_series(column("pelvis_east_m", "much")), "in place of numbers"),
    "another model": (text("model.toml", "mass = 1"), "model.toml"),
    "a pipe": (fifo("skeleton.json"), "this is not a file"),
}


@pytest.mark.parametrize("name", MUSCLES)
def test_the_muscles_of_a_hostile_result_are_one_clear_line(result: Path, name: str) -> None:
    spoil, expected = MUSCLES[name]
    spoil(result)
    out = result.parent / "out"
    outcome = run_limited(lambda: sssi_exudyn.muscles(result, out))
    assert outcome.verdict == "refused", outcome
    assert expected in outcome.text
    assert not (out / "summary.json").exists()


VALIDATED: dict[str, tuple[Spoil, str]] = {
    "series reversed": CASES["series: time reversed"],
    "series infinite": (in_series(column("left_sole_N", np.inf)), "larger than any quantity"),
    "series of texts": CASES["series: texts for numbers"],
    "series a pipe": (fifo("series.parquet"), "this is not a file"),
    "no model": (lambda folder: (folder / "model.toml").unlink(), "model.toml: the file does not exist"),
    "summary of lists": CASES["summary: a list for a group"],
    "model a pipe": (fifo("model.toml"), "this is not a file"),
}


@pytest.mark.parametrize("name", VALIDATED)
def test_the_validation_of_a_hostile_result_is_one_clear_line(result: Path, recording: Path, name: str) -> None:
    spoil, expected = VALIDATED[name]
    spoil(result)
    out = result.parent / "out"
    outcome = run_limited(lambda: validate(recording, result, out))
    assert outcome.verdict == "refused", outcome
    assert expected in outcome.text
    assert outcome.text.startswith(str(result))
    assert not (out / "summary.json").exists()


ODD: tuple[Spoil, ...] = (
    in_series(lambda t: t.assign(energy_gravity_J=np.nan, energy_friction_J=1e40)),
    in_json(
        "summary.json",
        lambda t: t.update(
            muscles={
                **dict.fromkeys(("count", "power", "samples", "wall_s", "strong_enough_share"), 1),
                "reserve": {},
                "lacking": [],
                "contact_peak_bodyweights": {},
            }
        ),
    ),
    in_json("summary.json", lambda t: t["fit"].update(correlation=[[1.0], []])),
    in_json("summary.json", lambda t: t.update(recording="\ud800 \x1b[31m" + "x" * 100_000)),
)
"""Oddities: energies unknown and large, muscles without columns, correlations of other parameters, and half a letter.
Each is in a section of its own, so that one result has them all."""


@pytest.mark.parametrize("ending", ["html", "pdf"])
@pytest.mark.long
def test_an_odd_result_has_a_report(result: Path, ending: str) -> None:
    for spoil in ODD:
        spoil(result)
    out = result.parent / f"report.{ending}"
    outcome = run_limited(lambda: report([result], out))
    assert outcome.verdict == "taken", outcome
    assert b"\x1b" not in out.read_bytes() or ending == "pdf"


HOSTILE_NAME = r"$ \frac{$ </script><b>"


@pytest.mark.long
def test_formulas_in_names_are_shown_as_they_are(result: Path) -> None:
    in_json("summary.json", lambda t: t.update(recording=HOSTILE_NAME, notices=[HOSTILE_NAME]))(result)
    in_json("diagnosis.json", lambda t: t["findings"][0].update(caption=HOSTILE_NAME, name=HOSTILE_NAME))(result)
    in_series(column(r"energy_$\frac{$_J", 1.0))(result)
    for ending in ("pdf", "html"):
        assert report([result, result], result.parent / f"report.{ending}").stat().st_size > 10_000
    page = (result.parent / "report.html").read_text(encoding="utf-8")
    assert r"$ \frac{$ &lt;/script&gt;&lt;b&gt;" in page
    assert HOSTILE_NAME not in page


def test_links_are_not_copied_into_another_folder(result: Path) -> None:
    secret = result.parent / "secret"
    secret.write_text("secret", encoding="utf-8")
    (result / "notes.txt").symlink_to(secret)
    (result / "own.txt").write_text("own", encoding="utf-8")
    amend_result(result, result.parent / "out", {}, render=lambda _: "")
    assert (result.parent / "out" / "own.txt").exists()
    assert not (result.parent / "out" / "notes.txt").exists()


def test_the_bound_of_pages_counts_the_sizes_that_they_state(whole: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    about = pq.read_metadata(whole / "series.parquet")
    columns = [about.row_group(0).column(k).total_uncompressed_size for k in range(about.num_columns)]
    monkeypatch.setattr(parquet, "MAX_DECODED", sum(columns))  # with the pages' heads, so a little more than the pages
    assert read_run(whole).series.shape[1] == about.num_columns
    monkeypatch.setattr(parquet, "MAX_DECODED", sum(columns) // 2)
    outcome = run_limited(lambda: read_run(whole))
    assert "more bytes than any result has" in outcome.text


def test_a_whole_diagnosis_comes_back(whole: Path) -> None:
    diagnosis = read_diagnosis(whole)
    assert diagnosis is not None
    assert diagnosis.sentence == whole_version()["sentence"]
