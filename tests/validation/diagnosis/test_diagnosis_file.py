"""``diagnosis.json``: its JSON Schema, files of the first version, and the section of a report that is made from it."""

from __future__ import annotations

import copy
import json
from pathlib import Path
from typing import Any

import pytest
from schema_check import check_against_schema

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.io.typed import json_schema, read_json
from sssi_exudyn.io.writing import to_json, to_plain
from sssi_exudyn.reports.html import section_html
from sssi_exudyn.reports.section import Section
from sssi_exudyn.reports.sections.diagnosis import diagnosis_blocks
from sssi_exudyn.validation.diagnosis.result import Diagnosis, ForceOverTime, LatentForce, TrackDistance

SCHEMA = Path(__file__).parents[3] / "validation" / "diagnosis" / "diagnosis.schema.json"
FIRST_VERSION: dict[str, Any] = {
    "format": 1,
    "recording": "train_patch",
    "verdict": "explained",
    "sentence": "Between 5.6 s and 8.3 s the skis glide on slower snow: μ_t is 0.15 there against 0.09 elsewhere.",
    "findings": [
        {
            "kind": "physics",
            "name": "snow_patch",
            "probability": 0.97,
            "alternatives": [{"name": "pole_plant", "probability": 0.02}],
            "where": {
                "t0_s": 5.6,
                "t1_s": 8.3,
                "distance_m": [52.1, 75.4],
                "side": "both",
                "phase": ["control", "completion"],
            },
            "parameters": {"delta_mu_t": {"value": 0.062, "low": 0.055, "high": 0.069, "unit": "1"}},
            "impulse_Ns": [-98.0, 4.1, 0.3],
            "evidence": {
                "trajectory_error_m": {"before": 0.61, "after": 0.03},
                "held_out_error_m": {"before": 0.58, "after": 0.04},
                "chi2_per_dof": {"before": 41.0, "after": 1.02},
            },
        }
    ],
    "friction": {"before": {"mu_t": 0.112, "mu_n": 0.71}, "after": {"mu_t": 0.0901, "mu_n": 0.72}},
    "noise": {"gps_sigma_m": 0.021, "gps_correlation_s": 3.6},
}
"""What the format's first description shows."""


def shown(diagnosis: Diagnosis) -> str:
    return section_html(Section("", diagnosis_blocks(diagnosis)), "part")


def read(folder: Path, content: dict[str, Any]) -> Diagnosis:
    path = folder / "diagnosis.json"
    path.write_text(json.dumps(content))
    return read_json(path, Diagnosis)


def assert_holds(whole: Any, part: Any) -> None:
    """Every key and value of ``part`` is in ``whole``, which may have more keys."""
    if isinstance(part, dict):
        for key, value in part.items():
            assert_holds(whole[key], value)
    elif isinstance(part, list):
        for each, value in zip(whole, part, strict=True):
            assert_holds(each, value)
    else:
        assert whole == part


def test_the_shipped_schema_is_that_of_the_dataclass() -> None:
    assert json.loads(SCHEMA.read_text(encoding="utf-8")) == to_plain(json_schema(Diagnosis))


def test_a_file_of_the_first_version_is_read_and_shown(tmp_path: Path) -> None:
    check_against_schema(FIRST_VERSION, json.loads(SCHEMA.read_text(encoding="utf-8")))
    diagnosis = read(tmp_path, FIRST_VERSION)
    section = shown(diagnosis)
    assert "snow patch (97%)" in section
    assert "0.030" in section
    assert "<svg" not in section  # it has no data for a figure
    written = json.loads(to_json(diagnosis))
    assert_holds(written, FIRST_VERSION)


def test_the_section_shows_what_the_file_holds(tmp_path: Path) -> None:
    zero = (0.0, 0.0, 0.0)
    force = ForceOverTime(
        (0.0, 1.0, 2.0), (zero, (50.0, -3.0, 1.0)), (zero, zero), ((False,) * 3, (True, False, False))
    )
    content = {
        **FIRST_VERSION,
        "latent_force": to_plain(LatentForce(force, force)),
        "track_distance": to_plain(TrackDistance((0.0, 0.1), (0.5, 0.6), (0.1, 0.1))),
        "weighed": [
            [
                {"name": "snow_patch", "probability": 0.97, "log_evidence": 12.0, "refitted": True},
                {"name": "gust", "probability": 0.0, "log_evidence": None},
                {"name": "nothing", "probability": 0.02, "log_evidence": 2.0},
            ]
        ],
    }
    section = shown(read(tmp_path, content))
    assert section.count("<svg") == 3
    assert "log evidence +10.0 against nothing; refitted" in section
    assert "not possible" in section
    assert "after with snow patch in the model; shaded while it acts" in section


@pytest.mark.parametrize(
    ("place", "wrong", "message"),
    [
        (("findings", 0, "probability"), "high", r"\$\.findings\[0\]\.probability"),
        (("verdict",), "perhaps", r"\$\.verdict"),
        (("format",), 2, r"\$\.format"),
        (("findings", 0, "impulse_Ns"), [1.0, 2.0], r"\$\.findings\[0\]\.impulse_Ns"),
    ],
)
def test_what_does_not_fit_is_refused_with_its_place(
    tmp_path: Path, place: tuple[str | int, ...], wrong: object, message: str
) -> None:
    content = copy.deepcopy(FIRST_VERSION)
    inner: Any = content
    for key in place[:-1]:
        inner = inner[key]
    inner[place[-1]] = wrong
    with pytest.raises(InputError, match=message):
        read(tmp_path, content)
    with pytest.raises(AssertionError):
        check_against_schema(content, json.loads(SCHEMA.read_text(encoding="utf-8")))
