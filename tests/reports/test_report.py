"""The report: whole without a network, accessible to screen readers, safe with any name, and true."""

import json
import re
import shutil
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from a_diagnosis import whole_version
from a_run import GPS_BIAS, NAME, a_run
from a_whole_run import a_run_of_few_sensors, a_whole_run
from matplotlib.backends.backend_pdf import PdfPages
from matplotlib.figure import Figure
from tiny import Tiny

import sssi_exudyn
from sssi_exudyn import commands
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.quantity import quantities
from sssi_exudyn.io.typed import convert
from sssi_exudyn.reports.pdf import A4
from sssi_exudyn.reports.report import render, render_pdf, write_run
from sssi_exudyn.reports.section import Grid
from sssi_exudyn.reports.sections.terms import terms
from sssi_exudyn.results.folder import MEASURED, read_skeleton, read_summary, read_table
from sssi_exudyn.results.stored import read_run
from sssi_exudyn.validation.diagnosis.diagnosis_data import Diagnosis


class Outline(HTMLParser):
    """A page's opening tags with their attributes, and all its text; raises on a closing tag that closes nothing."""

    VOID = ("meta", "br", "input")

    def __init__(self, page: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.open: list[str] = []
        self.text = ""
        self.scripts: list[str] = []
        self.feed(page)
        assert self.open == []

    def named(self, tag: str) -> list[dict[str, str | None]]:
        return [attributes for name, attributes in self.tags if name == tag]

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if self.open[-1:] == ["script"]:
            self.scripts.append(data)
        elif self.open[-1:] != ["style"]:
            self.text += data


@pytest.fixture(scope="module")
def page() -> str:
    return render([a_run()])


@pytest.fixture(scope="module")
def outline(page: str) -> Outline:
    return Outline(page)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Write a result folder as a run leaves it."""
    folder = tmp_path_factory.mktemp("result") / "made"
    write_run(folder, a_run())
    return folder


def test_page_asks_nothing_of_a_network(page: str, outline: Outline) -> None:
    for tag, attributes in outline.tags:
        assert tag not in {"link", "iframe", "object", "embed"}
        for name in ("src", "href", "xlink:href", "srcset", "action", "data"):
            assert (attributes.get(name) or "#").startswith("#")
    assert "@import" not in page
    assert "url(http" not in page
    for call in ("fetch(", "XMLHttpRequest", "WebSocket", "import("):
        assert call not in page


def test_every_picture_says_what_it_shows(outline: Outline) -> None:
    pictures = [*outline.named("svg"), *outline.named("canvas")]
    assert pictures
    assert all(picture["role"] == "img" and picture["aria-label"] for picture in pictures)
    for control in outline.named("input"):
        assert control.get("aria-label") or control["type"] == "checkbox"


def test_identifiers_are_unique_and_every_reference_has_its_target(page: str, outline: Outline) -> None:
    identifiers = [attributes["id"] for _, attributes in outline.tags if "id" in attributes]
    assert len(identifiers) == len(set(identifiers))
    references = re.findall(r'(?:href="|url\()#([^")]+)', page)
    assert references
    assert set(references) <= set(identifiers)


def test_names_from_a_recording_are_text_not_markup(page: str, outline: Outline) -> None:
    assert "<b>hill" not in page
    assert NAME in outline.text
    assert json.loads(outline.scripts[0])["name"] == NAME


def test_only_the_pages_own_script_may_run(outline: Outline) -> None:
    (policy,) = [meta["content"] for meta in outline.named("meta") if "http-equiv" in meta]
    assert policy is not None
    assert policy.startswith("default-src 'none'")
    assert "unsafe-inline'; script-src 'sha256-" in policy
    kinds = [script.get("type") for script in outline.named("script")]
    assert kinds == ["application/json", None]


def test_figures_of_the_page_are_those_of_the_summary(outline: Outline) -> None:
    run = a_run()
    error = run.summary.trajectory.mean_error_m
    # the GPS is that far north of the antenna all along
    assert error == pytest.approx(GPS_BIAS, abs=1e-6)
    assert f"by {error:.3f} m" in outline.text
    assert f"{run.summary.trajectory.percent_of_length:.2g} %" in outline.text
    assert "0.061 ± 0.001" in outline.text
    assert "15.0" in outline.text
    assert "compiled" in outline.text


def test_every_figure_of_the_paper_is_there(outline: Outline) -> None:
    labels = [str(picture["aria-label"]) for picture in outline.named("svg")]
    for part, count in (
        ("trajectory: 141 GPS fixes", 1),
        ("foot pressure ratio: simulated against insoles, correlation 1.000", 1),
        ("(°): ", 11),
        ("path of the centre of mass seen from above", 1),
        ("(BW): right", 1),
        ("(N m/kg): ", 5),
    ):
        assert sum(part in label for label in labels) == count, part
    assert "mean and standard deviation over 2 pairs, right turn first" in outline.text


def test_turns_in_words_and_in_the_table_are_those_of_the_summary(outline: Outline) -> None:
    turns = a_run().summary.turns
    assert turns.each is not None
    assert f"{turns.count} turns in 14 s, at {turns.each['mean_speed_mps'].mean:.1f} m/s" in outline.text
    assert f"{turns.count} ({turns.complete})" in outline.text
    # skis that point where they go
    assert "Skis parallel to 0°, turns almost carved" in outline.text


@pytest.mark.long
def test_a_minute_stays_within_the_budget() -> None:
    # 3 MB open on a phone in well under 2 s; 150 samples a second are the full model's
    page = render([a_run(60.0, 150.0)])
    assert len(page.encode()) < 3e6


@pytest.mark.usefixtures("words_only")
def test_what_went_wrong_and_what_was_missing_is_said_first() -> None:
    figures = {
        "diverged": "no step at 3.2 s",
        "diagnosis": {"verdict": "explained", "sentence": "A gust blows."},
        "notices": ["Slope estimated."],
    }
    shown = Outline(render([a_run(3.0, **figures)])).text
    lead = shown[: shown.index("Limits and assumptions")]
    assert "stopped before the end (no step at 3.2 s)" in lead
    assert "A gust blows." in lead
    assert shown.index("Slope estimated.") > shown.index("Remarks on the recording")


@pytest.mark.long
def test_a_run_without_linked_turns_is_shown_whole(outline: Outline) -> None:
    shown = Outline(render([a_run(3.0)]))
    assert "the whole run, for want of two linked turns" in shown.text
    assert len(shown.named("svg")) == len(outline.named("svg"))


@pytest.mark.long
def test_a_run_that_stopped_at_once_still_has_a_page() -> None:
    shown = Outline(render([a_run(0.04, measured=False)]))
    assert "nan" not in shown.text
    assert "the whole run" in shown.text


@pytest.mark.long
def test_several_runs_stand_side_by_side(page: str) -> None:
    other = a_run(recording="big hill", friction={"mu_t": {"value": 0.19, "se": None}})
    both = Outline(render([a_run(), other]))
    assert len(both.named("canvas")) == 2
    assert len(both.scripts) == 3
    assert "0.190" in both.text
    assert "0.061 ± 0.001" in both.text


@pytest.mark.long
def test_same_result_same_bytes(page: str) -> None:
    assert render([a_run()]) == page


@pytest.mark.usefixtures("words_only")
def test_what_is_not_known_is_a_dash() -> None:
    bare = a_run(measured=False, friction=None, solver=None)
    shown = Outline(render([bare])).text
    assert "no GPS track" in shown
    assert "None" not in shown
    assert "nan" not in shown
    assert shown.count("–") >= 8


@pytest.mark.long
def test_a_result_folder_gives_the_page_again(folder: Path, tmp_path: Path, page: str) -> None:
    assert (folder / "report.html").read_text(encoding="utf-8") == page
    written = commands.report([folder], tmp_path / "again.html")
    assert written.read_text(encoding="utf-8") == page


@pytest.mark.long(seconds=17)
def test_every_command_leaves_the_report_that_is_made_from_its_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder, again = tmp_path / "result", tmp_path / "again.html"
    write_run(folder, replace(a_run_of_few_sensors(a_run(6.0, 25.0)), diagnosis=convert(whole_version(), Diagnosis)))
    report = (folder / "report.html").read_bytes()
    assert commands.report([folder], again).read_bytes() == report
    sssi_exudyn.muscles(folder, folder)
    report = (folder / "report.html").read_bytes()
    assert commands.report([folder], again).read_bytes() == report
    shown, written = Outline(report.decode()).text, words_on_paper(folder, monkeypatch)
    for part in (
        *("Muscles", "quadriceps femoris", "Contact forces of knees and L5/S1."),
        *("Few sensors", "knee flexion <90°", "Nothing was fitted beyond the line"),
        *("Diagnosis", "snow patch (97%)", "Force that the model lacks"),
    ):
        assert part in shown
        assert part in written


def words_on_paper(folder: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """Collect all text of the document to print, without that in its plots."""
    lines: list[str] = []
    text = Figure.text

    def spy(self: Figure, x: float, y: float, words: str, **look: Any) -> Any:
        lines.append(words)
        return text(self, x, y, words, **look)

    with monkeypatch.context() as patched:
        patched.setattr(Figure, "text", spy)
        render_pdf([read_run(folder)])
    return " ".join(lines)


def test_every_force_term_is_there_with_its_numbers_and_their_sources(outline: Outline) -> None:
    model = a_run().model
    for term in model.terms:
        for name, about in quantities(term).items():
            assert re.search(rf"\n{name}.*{re.escape(about.source)}", outline.text), (term.name, name)
    assert "0.061 ± 0.001" in outline.text


def test_fitted_numbers_of_terms_carry_their_error() -> None:
    fitted = {"parameters": {"friction.mu_t": {"value": 0.1, "se": 0.02}}}
    section = terms([a_run(fit=fitted)])
    rows = {row[0]: row for block in section.blocks if isinstance(block, Grid) for row in block.rows}
    assert rows["mu_t"][1:6] == ["0.10 ± 0.02", "", "0.01", "0.99", "fitted"]
    assert rows["mu_n"][5] == "fixed"


@pytest.mark.long
def test_the_document_to_print_is_whole_and_the_same_each_time(folder: Path, tmp_path: Path) -> None:
    documents = [commands.report([folder], tmp_path / name).read_bytes() for name in ("one.pdf", "two.pdf")]
    assert documents[0].startswith(b"%PDF")
    assert documents[0].rstrip().endswith(b"%%EOF")
    # the sentence with Table 1, five figures, and tables
    assert documents[0].count(b"/Type /Page ") >= 7
    assert documents[0] == documents[1]


@pytest.mark.long
def test_nothing_leaves_the_paper(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every page's box, of words, axes and legends, is within A4."""
    boxes: list[Any] = []
    monkeypatch.setattr(PdfPages, "savefig", lambda _, page: boxes.append(page.get_tightbbox()))
    render_pdf([a_whole_run()])
    assert len(boxes) >= 7
    for box in boxes:  # inches
        assert box.x0 >= 0.0
        assert box.y0 >= 0.0
        assert box.x1 <= A4[0]
        assert box.y1 <= A4[1]


@pytest.mark.long
@pytest.mark.usefixtures("words_only")
def test_two_results_of_one_recording_are_told_apart(folder: Path, tmp_path: Path) -> None:
    other = tmp_path / "with wind"
    shutil.copytree(folder, other)
    written = commands.report([folder, other], tmp_path / "both.html")
    text = Outline(written.read_text(encoding="utf-8")).text
    assert f"{NAME} (made)" in text
    assert f"{NAME} (with wind)" in text


@pytest.mark.long
@pytest.mark.usefixtures("words_only")
def test_validate_keeps_what_the_run_left(folder: Path, tmp_path: Path) -> None:
    result, out = tmp_path / "result", tmp_path / "judged"
    write_run(result, a_run(measured=False), opensim={"markers.trc": "PathFileType"})
    recording = Tiny().write(tmp_path / "recording")
    assert read_summary(result).trajectory.mean_error_m is None
    summary = commands.validate(recording, result, out)
    assert summary.trajectory.mean_error_m > 0.0
    assert (out / "markers.trc").read_text(encoding="utf-8") == "PathFileType"
    for name in ("skeleton.json", "turns.csv", "turns.parquet", "model.toml"):
        assert (out / name).read_bytes() == (result / name).read_bytes(), name
    measured = read_table(out, MEASURED)
    assert measured is not None
    assert measured["gps_east_m"].notna().sum() > 50


def test_turn_by_turn_every_turn_is_there(outline: Outline) -> None:
    table = a_run().turn_table
    assert table is not None
    for number, turn in table.groupby("turn"):
        label = f"{number}, {turn['side'].iloc[0]}"
        assert (label if turn["complete"].iloc[0] else f"({label})") in outline.text


def test_a_report_is_html_or_pdf(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"end its name in \.html or \.pdf"):
        commands.report([tmp_path], tmp_path / "report.docx")


def test_a_report_of_no_result_says_so(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"summary\.json: the file does not exist"):
        commands.report([tmp_path], tmp_path / "report.html")


@pytest.mark.long
def test_a_folder_without_skeleton_and_measurements_has_a_page_without_replay(folder: Path, tmp_path: Path) -> None:
    bare = tmp_path / "bare"
    shutil.copytree(folder, bare)
    for name in ("skeleton.json", "measured.parquet"):
        (bare / name).unlink()
    assert read_skeleton(bare) is None
    assert read_table(bare, MEASURED) is None
    shown = Outline(render([read_run(bare)]))
    assert shown.named("canvas") == []
    assert "replay" not in shown.scripts[0]


def test_what_was_measured_comes_back_from_the_folder(folder: Path) -> None:
    run, again = a_run(), read_run(folder)
    assert run.measured is not None
    assert again.measured is not None
    assert again.measured.equals(run.measured)
    assert again.geometry is not None
    assert run.geometry is not None
    np.testing.assert_array_equal(again.geometry.joint_in_parent, run.geometry.joint_in_parent)
