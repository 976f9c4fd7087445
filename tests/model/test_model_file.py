"""A model's file holds whatever a fit may write, and a bounded number of parts."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
import tomli_w
from bundled import bundled

from sssi_exudyn.commands.recordings import LONGEST_RUN
from sssi_exudyn.contact.terms.friction_corrections import Braking
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.fitting.few_sensors.led_run import SPACING
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.model.toml import model_to_dict, read_model


def test_the_longest_run_by_few_sensors_is_read_again(tmp_path: Path) -> None:
    model = model_of(*bundled("beginner"))
    count = round(LONGEST_RUN / SPACING) + 1
    model = replace(model, terms=(*model.terms, *(Braking(0.01, SPACING * i, SPACING) for i in range(count))))
    path = tmp_path / "model.toml"
    path.write_text(tomli_w.dumps(model_to_dict(model)), encoding="utf-8")
    assert read_model(path).terms == model.terms


def test_a_file_with_more_parts_than_any_model_has_is_refused(tmp_path: Path) -> None:
    written = model_to_dict(model_of(*bundled("beginner")))
    path = tmp_path / "model.toml"
    path.write_text(tomli_w.dumps({**written, "term": 1001 * [{"name": "braking"}]}), encoding="utf-8")
    with pytest.raises(InputError, match="1001 of them, more than any model has"):
        read_model(path)
