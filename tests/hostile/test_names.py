"""Names of files that are no text, too long, or formulas: no work is lost, and nothing runs in a spreadsheet."""

from __future__ import annotations

import csv
import os
from pathlib import Path

import pytest
from a_run import a_run
from tiny import Tiny

from sssi_exudyn import cli
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.text import csv_cell
from sssi_exudyn.importing.answers import Answers
from sssi_exudyn.importing.many import import_many
from sssi_exudyn.recording.inspection_plot import plot_inspection
from sssi_exudyn.recording.read import read_recording
from sssi_exudyn.reports.report import write_run
from sssi_exudyn.sweeps.file import sweep_from

NO_TEXT = os.fsdecode(b"run \xff")


def status_of(arguments: list[str]) -> object:
    with pytest.raises(SystemExit) as end:
        cli.main(arguments)
    return end.value.code


@pytest.mark.long
@pytest.mark.usefixtures("words_only")
def test_results_in_folders_that_are_no_text_are_written_and_shown(tmp_path: Path) -> None:
    folders = [tmp_path / NO_TEXT, tmp_path / "plain"]
    for folder in folders:
        write_run(folder, a_run(3.0, 20.0))
    for name in ("page.html", f"{NO_TEXT}.html", f"{NO_TEXT}.pdf"):
        assert status_of(["report", *map(str, folders), "--out", str(tmp_path / name)]) == 0
        assert (tmp_path / name).stat().st_size > 1000
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert r"run \udcff" in page


@pytest.mark.long
def test_a_picture_of_a_recording_in_such_a_folder(tmp_path: Path) -> None:
    recording = read_recording(Tiny().write(tmp_path / NO_TEXT))
    plot_inspection(recording, tmp_path / f"{NO_TEXT}.svg")
    assert (tmp_path / f"{NO_TEXT}.svg").read_text(encoding="utf-8").rstrip().endswith("</svg>")


def test_a_sweep_of_such_a_folder_is_refused_before_its_first_run(tmp_path: Path) -> None:
    Tiny().write(tmp_path / NO_TEXT)
    with pytest.raises(InputError, match="is no text in UTF-8; rename the folder"):
        sweep_from({"format": 1, "recordings": ["run*"]}, tmp_path / "sweep.toml")


@pytest.mark.parametrize("name", ["x" * 252 + ".html", "x" * 300 + ".pdf", "missing/page.html", "a file/page.html"])
def test_a_page_that_cannot_be_is_refused_before_it_is_made(
    tmp_path: Path, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "a file").write_bytes(b"")
    monkeypatch.setattr("sssi_exudyn.commands.pages.read_run", lambda _: pytest.fail("the name comes first"))
    assert status_of(["report", str(tmp_path), "--out", str(tmp_path / name)]) == 2


@pytest.mark.parametrize("suffix", [".png", ".svg", ".pdf"])
def test_a_picture_with_a_long_name_is_refused(tmp_path: Path, suffix: str) -> None:
    recording = read_recording(Tiny().write(tmp_path / "run"))
    with pytest.raises(InputError, match="name too long"):
        plot_inspection(recording, tmp_path / ("x" * 300 + suffix))


FORMULAS = (
    '=HYPERLINK("http:\\\\example.org","open")',
    "+1+cmd|' C'!A0",
    "-2+3",
    "@SUM(1)",
    "＝1+1",
    "\t=1",
)


def rows_of(text: str) -> list[dict[str, str]]:
    return list(csv.DictReader(text.splitlines()))


@pytest.mark.parametrize("name", FORMULAS)
def test_names_of_runs_are_no_formulas_in_the_table(tmp_path: Path, name: str) -> None:
    folder = tmp_path / "season" / name
    made = Tiny().write(folder)
    for other in ("motion.bvh", "insoles.csv", "recording.toml"):
        (made / other).unlink()  # so that nothing is read: there is no motion
    import_many(tmp_path / "season", tmp_path / "out", Answers())
    (row,) = rows_of((tmp_path / "out" / "recordings.csv").read_text(encoding="utf-8"))
    assert row["recording"] == f"'{name}"
    assert row["status"] == "failed"


def test_runs_whose_names_are_no_text_are_in_the_table(tmp_path: Path) -> None:
    for name in (NO_TEXT, "plain"):
        made = Tiny().write(tmp_path / "season" / name)
        (made / "recording.toml").unlink()
    rows = import_many(tmp_path / "season", tmp_path / "out", Answers(mass_kg=70.0, height_m=1.65))
    assert [row.status for row in rows] == ["imported", "imported"]
    shown = rows_of((tmp_path / "out" / "recordings.csv").read_text(encoding="utf-8"))
    assert {row["recording"] for row in shown} == {"run \\udcff", "plain"}
    assert read_recording(tmp_path / "out" / NO_TEXT).name == "run \\udcff"


@pytest.mark.parametrize(("value", "cell"), [(-3.5, -3.5), (None, None), ("a=b", "a=b"), ("", ""), ("-", "'-")])
def test_numbers_and_words_stay_as_they_are(value: object, cell: object) -> None:
    assert csv_cell(value) == cell
