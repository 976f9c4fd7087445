"""The first screen and the page's order: the answer, a light, then one sentence a section with its details folded."""

from __future__ import annotations

import re
from dataclasses import replace
from html import unescape

import pytest
from a_diagnosis import diagnosis_of, finding_of, whole_version
from a_run import a_run
from a_whole_run import a_run_of_few_sensors, a_whole_run

from sssi_exudyn.analysis.biomechanics import ResidualMoment
from sssi_exudyn.analysis.turn_style import StyleFigures
from sssi_exudyn.io.typed import convert
from sssi_exudyn.reports.answer import PLUS_MINUS
from sssi_exudyn.reports.diagnosis_tiles import lines_of_diagnosis, tiles_of_diagnosis
from sssi_exudyn.reports.report import ASSUMED, SECTIONS, render
from sssi_exudyn.reports.section import Items, Section, Text
from sssi_exudyn.results.stored import StoredRun
from sssi_exudyn.validation.diagnosis.diagnosis_data import Diagnosis, Next, Number


@pytest.fixture(scope="module")
def run() -> StoredRun:
    return a_run(14.0)


def before_contents(page: str) -> str:
    """Return the text of a page up to its contents."""
    markup = page[page.index("<body>") : page.index('class="contents"')]
    return re.sub(r"\s+", " ", unescape(re.sub(r"<script.*?</script>|<[^>]+>", " ", markup, flags=re.DOTALL)))


@pytest.mark.usefixtures("words_only")
def test_the_first_screen_has_the_answer_a_light_and_the_replay(run: StoredRun) -> None:
    moment = ResidualMoment(82.0, 20.0, 75.0, 50.0, "bad")
    shown = replace(run, summary=replace(run.summary, residual_moment=moment))
    page = render([shown])
    text = before_contents(page)
    for part in (
        "With care. The peak of the residual moment decides. The peak (82 N\u00a0m) exceeds OpenSim's limit of 75 N",
        "μ_t, along the ski 0.061 ± 0.001",
        "μ_n, largest lateral load ratio 0.550",
        "turns 7 in 14 s",
        "technique almost carved",
        "track 0.500 m from the GPS on average",
        "load share 0\u00a0% rms from the insoles",
    ):
        assert part.replace("\u00a0", " ") in text.replace("\u00a0", " "), part
    assert page.index('class="light care"') < page.index('class="tiles"') < page.index('class="replay"')
    assert page.index('class="replay"') < page.index('class="contents"')


@pytest.mark.usefixtures("words_only")
def test_plus_minus_is_defined_once(run: StoredRun) -> None:
    page = render([run])
    assert page.count(PLUS_MINUS) == 1
    assert page.index("± ") < page.index('class="contents"')


@pytest.mark.usefixtures("words_only")
def test_contents_are_folded(run: StoredRun) -> None:
    page = render([run])
    contents = page[page.index('<details class="contents">') :]
    assert contents.index("<a href=") < contents.index("</details>")
    assert "<a href=" not in page[: page.index('<details class="contents">')]


def test_every_section_says_one_thing_first(run: StoredRun) -> None:
    diagnosed = replace(a_run_of_few_sensors(run), diagnosis=convert(whole_version(), Diagnosis))
    for runs in ([run], [diagnosed], [run, replace(run, summary=replace(run.summary, recording="other"))]):
        for make in SECTIONS:
            section = make(runs)
            if section.blocks and section.title != "The runs":
                assert section.sentence.endswith("."), section.title
                assert ". " not in section.sentence.replace("N. ", ""), section.sentence
                assert len(section.sentence.split()) <= 30 * len(runs), section.sentence


def headings(page: str) -> list[str]:
    return re.findall(r"<h2 [^>]*>([^<(:]*)", page)


@pytest.mark.usefixtures("words_only")
def test_sections_of_an_assumed_posture_are_marked_and_say_so(run: StoredRun) -> None:
    page, measured = render([a_run_of_few_sensors(run)]), render([run])
    assert ASSUMED not in measured
    assert 'class="assumed"' not in measured
    marked = re.findall(r'<section class="assumed">\s*<h2 [^>]*>([^<(:]*)', page)
    assert page.count(ASSUMED) == len(marked)
    for title in ("The run from above", "Turn by turn"):
        assert any(name.startswith(title) for name in marked), title
    for title in ("Joint angles", "Joint moments", "Load on each ski"):  # curves of an assumed posture
        assert any(name.startswith(title) for name in headings(measured)), title
        assert not any(name.startswith(title) for name in headings(page)), title
    assert not any(name.startswith(("Simulated and measured", "Snow surface")) for name in marked)
    text = before_contents(page)
    assert "load share (assumed)" in text
    assert text.index("effective friction 0.200 ± 0.010, skidding included") < text.index("μ_t, along the ski")


def test_a_diagnosis_has_tiles_of_its_own() -> None:
    diagnosis = replace(
        diagnosis_of(finding_of("gust", 0.8, ("snow_patch", 0.15))),
        next=(Next("an anemometer", ("gust", "snow_patch"), 0.9),),
    )
    (row,) = tiles_of_diagnosis(diagnosis)
    assert [tile.name for tile in row] == ["where", "what", "how sure", "how much better", "friction", "what next"]
    where, what, sure, better, friction, following = row
    assert (where.value, where.note) == ("2.0 to 4.0 s", "10 to 20 m of the path")
    assert (what.value, what.note) == ("gust", "w_f -5 m/s")
    assert (sure.value, sure.note) == ("80%", "else snow patch 15%")
    assert better.value == "0.050 m, was 0.300 m"
    assert (friction.value, friction.note) == ("μ_t 0.100", "0.100 with nothing added")
    assert (following.value, following.note) == ("an anemometer", "90% probable to leave one of gust or snow patch")
    none = lines_of_diagnosis(diagnosis_of())
    assert none[0].startswith("where: nowhere")
    assert none[1] == "what: nothing is missing"
    assert "what next: nothing needs to be measured again for this" in lines_of_diagnosis(diagnosis_of())
    known = Number(-7.3, -8.8, -5.8, "m/s", "gust down the fall line")
    turned = Number(0.1, 0.05, 0.15, "rad", "turn")
    (row,) = tiles_of_diagnosis(diagnosis_of(replace(finding_of("gust", 0.999), parameters={"w": known, "a": turned})))
    assert row[1].note == "gust down the fall line -7.3 m/s, turn 5.73 °"
    assert row[2].value == "more than 99%"


@pytest.mark.usefixtures("words_only")
def test_the_page_of_a_diagnosis_begins_with_its_tiles(run: StoredRun) -> None:
    text = before_contents(render([replace(run, diagnosis=convert(whole_version(), Diagnosis))]))
    assert text.index("Diagnosis where 5.6 to 8.3 s") < text.index("μ_t, along the ski")
    assert "what snow patch delta_mu_t 0.062 how sure" in text


@pytest.mark.usefixtures("words_only")
def test_a_number_without_a_unit_prints_none(run: StoredRun) -> None:
    diagnosed = replace(run, diagnosis=convert(whole_version(), Diagnosis))
    cells = re.findall(r"<t[dh][^>]*>([^<]*)</t[dh]>", render([diagnosed]))
    assert "0.062" in cells
    assert not [cell for cell in cells if re.search(r"\d 1$", cell)]


def sentences_of(section: Section) -> list[str]:
    """Return all sentences of a section's paragraphs and lists; numbers hold points, but none before a space."""
    texts = [block.text for block in section.blocks if isinstance(block, Text)]
    texts += [line for block in section.blocks if isinstance(block, Items) for line in block.lines]
    return [sentence for text in (section.sentence, *texts) for sentence in re.split(r"(?<=[.!?]) ", text)]


def test_sentences_are_short() -> None:
    whole = a_whole_run()
    for run in (whole, a_run_of_few_sensors(whole)):
        long = [said for make in SECTIONS for said in sentences_of(make([run])) if len(said.split()) > 30]
        assert long == []


STOPS_A_READER = (
    *("no claim", "but for what", "the way of", "anew", "beside", "whoever", "nobody"),
    *("is what each", "too small to be", "which is bad"),
)
"""Words that made readers stop, each with a plain one in its place."""


@pytest.mark.usefixtures("words_only")
def test_words_that_made_readers_stop_are_gone() -> None:
    whole = a_whole_run()
    page = render([whole, a_run_of_few_sensors(whole)])
    text = re.sub(r"<style.*?</style>|<script.*?</script>|<[^>]+>", " ", page, flags=re.DOTALL).lower()
    assert [words for words in STOPS_A_READER if re.search(rf"\b{words}\b", text)] == []


@pytest.mark.usefixtures("words_only")
def test_technique_of_few_sensors_is_a_probability_that_rests_on_no_posture(run: StoredRun) -> None:
    few = a_run_of_few_sensors(run)
    summary = replace(few.summary, technique=StyleFigures(0.1, 0.75, 0.15, "skidding"))
    page = render([replace(few, summary=summary)])
    text = before_contents(page)
    assert "skidding" in text
    assert "75 % probable" in text
    assert "technique (assumed)" not in text
    assert "carving 0.10, skidding 0.75, wedge 0.15" in page
