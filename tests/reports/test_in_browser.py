"""Pages in a real browser, on a desk and on a phone, light and dark: no text is cut, every picture can be read."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from a_season import ORIGIN, a_season, compared_descents
from a_sweep import swept
from a_whole_run import a_run_of_few_sensors, a_whole_run
from browser import browser, shown
from bundled import EXAMPLES
from matplotlib.axes import Axes

from sssi_exudyn.bodies.ski.bench_tests import read_measurements
from sssi_exudyn.bodies.ski.identification import identify_ski
from sssi_exudyn.bodies.ski.ski import SkiUncertainty, read_ski
from sssi_exudyn.reports import plots
from sssi_exudyn.reports.bench_page import bench_page
from sssi_exudyn.reports.day_page import day_page
from sssi_exudyn.reports.html import document, figure
from sssi_exudyn.reports.report import render
from sssi_exudyn.reports.section import Markup, Section
from sssi_exudyn.reports.turn_page import turn_page
from sssi_exudyn.results.day import Day
from sssi_exudyn.results.summary import Provenance
from sssi_exudyn.season.page import render_season
from sssi_exudyn.simulation.turns.steady_turn import TurnCase, edges_of, start_rolling, steady_turn
from sssi_exudyn.simulation.turns.turn_rig import UNCERTAIN, RigPoint
from sssi_exudyn.sweeps.page import render_sweep
from sssi_exudyn.sweeps.sensitivity_indices import indices_of
from sssi_exudyn.validation.diagnosis.diagnosis_data import Number
from sssi_exudyn.validation.diagnosis.several_runs.joint_fit import DayExplanation

PAGES = ("report", "few sensors", "two runs", "sweep", "day", "skis", "bench", "season", "awkward plots")
WIDTHS = (1280, 390)
LOOKS = ("light", "dark")
LEAVES_ITS_FIGURE = """() => [...document.querySelectorAll("svg")].flatMap((svg) => {
  const box = svg.getBoundingClientRect();
  return [...svg.querySelectorAll("text")].filter((text) => text.textContent.trim()).filter((text) => {
    const own = text.getBoundingClientRect();
    return own.left < box.left - 1 || own.right > box.right + 1 || own.top < box.top - 1 || own.bottom > box.bottom + 1;
  }).map((text) => [svg.getAttribute("aria-label"), text.textContent]);
})"""
"""Words of pictures beyond the picture's box, to a pixel: a browser rounds places to that."""
EMPTY_LEGENDS = """() => [...document.querySelectorAll(".key, .key span")]
  .filter((key) => !key.textContent.trim()).map((key) => key.outerHTML)"""
WIDER_THAN_THE_SCREEN = "() => document.documentElement.scrollWidth - document.documentElement.clientWidth"
CUT = """() => [...document.querySelectorAll("dt, dd, th, td, p, summary, h1, h2, h3, figcaption, button")]
  .filter((part) => part.scrollWidth > part.clientWidth + 1 && getComputedStyle(part).display !== "inline")
  .map((part) => part.textContent.slice(0, 80))"""
SCROLLED_FIGURES = """() => [...document.querySelectorAll("figure")]
  .filter((figure) => figure.scrollWidth > figure.clientWidth + 1).map((figure) => figure.textContent.slice(-80))"""
SMALLEST_WORDS = """() => Math.min(...[...document.querySelectorAll("svg")]
  .filter((svg) => svg.getBoundingClientRect().width > 0).flatMap((svg) => {
    const scale = svg.getBoundingClientRect().width / svg.viewBox.baseVal.width;
    return [...svg.querySelectorAll("text")].map((text) => parseFloat(getComputedStyle(text).fontSize) * scale);
  }))"""
"""Pixels of the smallest letters of all pictures that are shown; no picture gives infinity."""
CONTRASTS = """() => {
  const parts = (colour) => colour.match(/[\\d.]+/g).slice(0, 3).map((value) => {
    const c = Number(value) / 255;
    return c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4;
  });
  const luminance = (colour) => parts(colour).reduce((sum, c, k) => sum + c * [0.2126, 0.7152, 0.0722][k], 0);
  const paper = luminance(getComputedStyle(document.body).backgroundColor);
  return [...document.querySelectorAll("svg text")].map((text) => {
    const ink = luminance(getComputedStyle(text).fill);
    return (Math.max(ink, paper) + 0.05) / (Math.min(ink, paper) + 0.05);
  });
}"""
"""Ratios of pictures' words to the page below them, as WCAG 2.1 defines them."""


def a_page_of_awkward_plots() -> str:
    """Return a page of what runs over its margins: long names, many keys, a second axis, a colour bar, large ticks."""

    def keys(axes: Axes) -> None:
        for index in range(7):
            axes.plot([0.0, 1.0], [0.0, index], label=f"a long name of line {index}")
        axes.set(xlabel="time (s)", ylabel="a label that is nearly as long as the axis")

    def second_axis(axes: Axes) -> None:
        axes.plot([0.0, 1.0], [-123456.0, 0.001])
        axes.ticklabel_format(style="plain")
        axes.set(ylabel="height (m)")
        axes.twinx().set(ylabel="inclination (deg)", ylim=(0.0, 12345.0))

    def bar(axes: Axes) -> None:
        drawn = axes.pcolormesh(np.arange(4.0).reshape(2, 2) * 1e4)
        axes.set_yticks([0.5, 1.5], ["friction.mu_t_of_new_snow", "ski.width_at_the_shovel"])
        axes.set(ylabel="percentage trajectory error of all runs (%)")
        parent = axes.get_figure()
        assert parent is not None
        colours = parent.colorbar(drawn, ax=axes)
        colours.set_label("mean speed (m/s)", color=plots.INK)
        assert colours.solids is not None
        colours.solids.set(rasterized=False)

    drawn = "".join(
        figure(plots.whole_width(f"plot-{index}", draw, height), "A plot")
        for index, (draw, height) in enumerate(((keys, 2.9), (second_axis, 2.3), (bar, 3.6)))
    )
    return document("Awkward plots", "", [Section("Plots", (Markup(drawn),))])


def a_page_of_a_sweep() -> str:
    plan, table = swept("sobol_indices", 8, lambda a, b, c: 1e4 * (a + b * c), lost=(3,))
    return render_sweep(plan, table, indices_of(plan, table), dict(plan.job.versions))


def a_page_of_a_day() -> str:
    friction = {"friction.mu_t": Number(0.1, 0.09, 0.11, "1"), "friction.mu_n": Number(0.8, 0.7, 0.9, "1")}
    nothing = DayExplanation("nothing", 1.0, 4.0, friction)
    return day_page(Day(1, ("a run of the morning", "noon"), "Nothing is missing.", (nothing,), Provenance()))


def a_page_of_skis() -> str:
    """Return the page of two skis, one of them with errors of its own, that turn alike at one edge angle."""
    skis = [read_ski("slalom_165", "."), read_ski("volkl_kendo_184", ".")]
    skis[1] = replace(skis[1], uncertainty=SkiUncertainty(0.01, 0.02, 0.015))
    case = TurnCase(edge=np.radians(60.0))
    turn, _ = steady_turn(case, start_rolling(edges_of(skis[0])))
    assert turn.radius is not None
    bar = (0.9 / turn.radius, 1.1 / turn.radius)
    count = len(UNCERTAIN)
    points = [
        RigPoint(ski.name, case.edge, turn, curvatures=(bar,) * count, reserves=((0.1, 0.3),) * count, own=(bar,) * 3)
        for ski in skis
    ]
    return turn_page(skis, points, case)


def a_page_of_a_bench() -> str:
    measured = read_measurements(EXAMPLES / "bench")
    return bench_page(measured, identify_ski(measured))


def pages() -> dict[str, str]:
    whole = a_whole_run()
    other = replace(whole, summary=replace(whole.summary, recording="another run"), diagnosis=None)
    return {
        "report": render([whole]),
        "few sensors": render([a_run_of_few_sensors(whole)]),
        "two runs": render([whole, other]),
        "sweep": a_page_of_a_sweep(),
        "day": a_page_of_a_day(),
        "season": render_season(*a_season(), compared_descents(), ORIGIN),
        "skis": a_page_of_skis(),
        "bench": a_page_of_a_bench(),
        "awkward plots": a_page_of_awkward_plots(),
    }


@pytest.fixture(scope="module")
def chromium() -> Iterator[Any]:
    with browser() as started:
        yield started


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory, chromium: Any) -> dict[str, Path]:
    """Write all pages, once there is a browser to show them."""
    folder = tmp_path_factory.mktemp("pages")
    written = {}
    for name, page in pages().items():
        written[name] = folder / f"{name}.html"
        written[name].write_text(page, encoding="utf-8")
    return written


@pytest.mark.long(seconds=20)
@pytest.mark.parametrize("name", PAGES)
def test_no_text_is_cut_and_no_legend_is_empty(name: str, files: dict[str, Path], chromium: Any) -> None:
    for width in WIDTHS:
        for look in LOOKS:
            page = shown(chromium, files[name], width, look)
            assert page.evaluate(LEAVES_ITS_FIGURE) == [], (width, look)
            assert page.evaluate(EMPTY_LEGENDS) == [], (width, look)
            assert page.evaluate(CUT) == [], (width, look)
            assert page.evaluate(WIDER_THAN_THE_SCREEN) <= 0, (width, look)
            # WCAG 2.1, AA, of text in its usual size; the page of a day without a law has no picture
            assert min(page.evaluate(CONTRASTS), default=21.0) >= 4.5, (width, look)
            assert page.evaluate(SCROLLED_FIGURES) == [], (width, look)
            # browsers and platforms advise against smaller letters on a phone; a page of prose has 16 pixels
            assert page.evaluate(SMALLEST_WORDS) >= 9.0, (width, look)
            page.context.close()


@pytest.mark.long
@pytest.mark.parametrize("width", WIDTHS)
def test_the_answer_is_on_the_first_screen(width: int, files: dict[str, Path], chromium: Any) -> None:
    page = shown(chromium, files["report"], width, "light")
    page.evaluate("for (const details of document.querySelectorAll('details')) details.open = false")
    bottom = page.evaluate("() => [...document.querySelectorAll('.tiles')].pop().getBoundingClientRect().bottom")
    tall = page.evaluate("() => document.documentElement.scrollHeight")
    assert bottom < 844.0 * (1.0 if width > 600 else 1.2)  # a diagnosis has five tiles more, which come first
    assert tall < 12.0 * 844.0
    page.context.close()


FILLED = """() => {
  const canvas = document.querySelector(".replay canvas"), style = getComputedStyle(canvas);
  const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
  const named = ["c1", "c2", "trunk", "head"].map((name) => style.getPropertyValue(`--${name}`).trim());
  const inks = named.map((hex) => [1, 3, 5].map((at) => parseInt(hex.slice(at, at + 2), 16)));
  let [first, last, left, right] = [Infinity, -Infinity, Infinity, -Infinity];
  for (let i = 0; i < data.length; i += 4) {
    if (!inks.some((ink) => ink.every((value, k) => Math.abs(value - data[i + k]) < 3))) continue;
    const row = Math.floor(i / 4 / canvas.width), column = (i / 4) % canvas.width;
    [first, last] = [Math.min(first, row), Math.max(last, row)];
    [left, right] = [Math.min(left, column), Math.max(right, column)];
  }
  const free = Math.min(first, left, canvas.height - 1 - last, canvas.width - 1 - right);
  return [(last - first) / canvas.height, free];
}"""
"""The height of skier and skis over that of the picture, at the first instant, and pixels free around."""


@pytest.mark.long
@pytest.mark.parametrize("width", WIDTHS)
def test_the_skier_fills_the_replay(width: int, files: dict[str, Path], chromium: Any) -> None:
    page = shown(chromium, files["few sensors"], width, "light")
    page.wait_for_function("() => document.querySelector('.replay canvas').width > 0")
    filled, free = page.evaluate(FILLED)
    assert 0.55 < filled < 1.0
    assert free > 0  # neither head nor skis are cut
    faults: list[str] = []
    page.on("pageerror", lambda error: faults.append(str(error)))
    for view in ("front", "side", "behind", "above"):
        page.locator(".replay [name=view]").select_option(view)
    page.locator(".replay [name=forces]").uncheck()
    page.locator(".replay [name=play]").click()
    page.wait_for_timeout(300)
    assert faults == []
    page.context.close()


@pytest.mark.long
def test_all_details_open_and_close_at_once(files: dict[str, Path], chromium: Any) -> None:
    page = shown(chromium, files["report"], WIDTHS[0], "light")
    count = "() => document.querySelectorAll('section > details:not([open])').length"
    assert page.evaluate(count) == 0
    page.locator("p.all button").click()
    assert page.evaluate(count) == page.evaluate("() => document.querySelectorAll('section > details').length") > 5
    page.locator("p.all button").click()
    assert page.evaluate(count) == 0
    page.context.close()
