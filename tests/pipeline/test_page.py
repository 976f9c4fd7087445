"""The page of a result: whole without a network, readable by machines that read it aloud, safe with any name."""

import re
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from sssi_exudyn.gps import Gps
from sssi_exudyn.insoles import Insoles
from sssi_exudyn.validation.page import render_page, write_page

TIME = np.linspace(0.0, 10.0, 401)
SUMMARY: dict[str, Any] = {
    "recording": "little <hill> & more",
    "friction": {"mu_t": {"value": 0.06, "se": 0.001}},
    "trajectory": {"mean_error_m": 0.5, "percent_of_length": 1.0, "length_m": 50.0},
    "pressure_ratio": {"correlation": 0.98, "rmsd": 0.05},
    "solver": {"steps": 400},
    "provenance": {"inputs": {"motion.bvh": "sha256:abc"}, "versions": {}, "settings": {"method": "joint"}, "seed": 0},
}


def a_series() -> pd.DataFrame:
    load = 400.0 + 300.0 * np.sin(TIME)
    return pd.DataFrame(
        {
            "time_s": TIME,
            "antenna_east_m": 5.0 * TIME,
            "antenna_north_m": np.sin(TIME),
            "antenna_up_m": -TIME,
            "left_load_N": load,
            "right_load_N": 800.0 - load,
            "left_sole_N": load,
            "right_sole_N": 800.0 - load,
            "energy_gravity_J": 100.0 * TIME,
            "energy_closure_J": 0.0 * TIME,
        }
    )


def some_gps() -> Gps:
    times = np.arange(0.0, 10.0, 0.1)
    # Half a metre north of the simulated track.
    fixes = np.stack([5.0 * times, np.sin(times) + 0.5, -times], axis=1)
    return Gps(
        time=times,
        enu=fixes,
        sigma=np.full(len(times), 0.02),
        origin=(47.0, 11.0, 1500.0),
        segment="Spine2",
        offset=np.zeros(3),
        speed=None,
        course=None,
        notes=(),
    )


def some_insoles() -> Insoles:
    times = np.arange(0.0, 10.0, 0.01)
    left = 350.0 + 250.0 * np.sin(times)
    right = 700.0 - left
    return Insoles(
        time=times, left=left, right=right, left_cells=left[:, None], right_cells=right[:, None], dead_cells=()
    )


class Outline(HTMLParser):
    """Every opening tag with its attributes; raises on a closing tag that closes nothing."""

    VOID = ("meta", "br")

    def __init__(self, page: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.open: list[str] = []
        self.feed(page)
        assert self.open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


@pytest.fixture(scope="module")
def page() -> str:
    return render_page(SUMMARY, a_series(), some_gps(), some_insoles())


def test_every_plot_is_there_and_described(page: str) -> None:
    plots = [attributes for tag, attributes in Outline(page).tags if tag == "svg"]
    assert len(plots) == 4
    assert all(plot["role"] == "img" and plot["aria-label"] for plot in plots)
    assert "at most 0.500 m" in page


def test_page_asks_nothing_of_a_network(page: str) -> None:
    for tag, attributes in Outline(page).tags:
        assert tag not in {"script", "link", "iframe", "img"}
        for name in ("src", "href", "xlink:href"):
            assert (attributes.get(name) or "#").startswith("#")
    assert "@import" not in page
    assert "url(http" not in page


def test_identifiers_are_unique_and_every_reference_has_its_target(page: str) -> None:
    identifiers = [attributes["id"] for _, attributes in Outline(page).tags if "id" in attributes]
    assert len(identifiers) == len(set(identifiers))
    references = re.findall(r'(?:href="|url\()#([^")]+)', page)
    assert references
    assert set(references) <= set(identifiers)


def test_plots_take_the_pages_colour(page: str) -> None:
    assert "currentColor" in page
    assert "prefers-color-scheme: dark" in page


def test_names_from_a_recording_are_text_not_markup(page: str) -> None:
    assert "little &lt;hill&gt; &amp; more" in page
    assert "<hill>" not in page


def test_same_result_same_bytes(page: str) -> None:
    assert render_page(SUMMARY, a_series(), some_gps(), some_insoles()) == page


def test_without_gps_and_insoles_figures_are_dashes() -> None:
    series = a_series()
    series[["antenna_east_m", "antenna_north_m", "antenna_up_m"]] = np.nan
    page = render_page({"recording": "bare"}, series, None, None)
    assert "no GPS track" in page
    assert "None" not in page
    assert page.count('<td class="number">–</td>') >= 10
    assert len([tag for tag, _ in Outline(page).tags if tag == "svg"]) == 2


def test_page_is_written(tmp_path: Path, page: str) -> None:
    write_page(SUMMARY, a_series(), some_gps(), some_insoles(), tmp_path / "report.html")
    assert (tmp_path / "report.html").read_text(encoding="utf-8") == page


def test_the_capture_is_shown_joint_by_joint_where_it_is_known() -> None:
    row = {
        "segment": "tibia_l",
        "joint": "LeftLeg",
        "filtered_rms_deg": 0.35,
        "filtered_max_deg": 0.8,
        "place_rms_mm": 1.5,
        "place_max_mm": 3.0,
    }
    page = render_page({"capture": {"round_trip": [row]}}, a_series(), None, None)
    assert "tibia, left" in page
    assert "0.35° (0.80°)" in page
    assert "Skeleton against capture" not in render_page({}, a_series(), None, None)
