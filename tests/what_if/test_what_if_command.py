"""What ``sssi whatif`` refuses, in one line each, and what its changes do to the model."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from bundled import bundled

import sssi_exudyn
from sssi_exudyn.commands.what_if import read_changes
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.sweeps.asked_model import change_model, check_steering
from sssi_exudyn.what_if.recorded_run import RecordedRun


@pytest.mark.parametrize("text", ["friction.mu_t", "friction.mu_t=", "friction.mu_t=much", "friction.mu_t=nan"])
def test_a_change_is_a_name_and_a_number(text: str) -> None:
    with pytest.raises(InputError, match="is given no number"):
        read_changes([text])


@pytest.mark.parametrize(
    ("name", "value", "problem"),
    [
        ("friction.mu", 0.1, "no number is called"),
        ("friction.mu_t", 7.0, "is outside"),
        ("start.heading_offset_deg", 1.0, "no number is called"),
    ],
)
def test_a_number_is_known_and_within_its_bounds(name: str, value: float, problem: str) -> None:
    model = model_of(*bundled("beginner"))
    with pytest.raises(InputError, match=problem):
        change_model(model, {name: value}, None)


def test_changes_are_made() -> None:
    model = model_of(*bundled("beginner"))
    changes = {"friction.mu_t": 0.12, "skier.mass": 90.0, "slope.inclination_deg": 20.0, "start.speed": 7.0}
    changed = change_model(model, changes, "giant_slalom_183")
    assert changed.value("friction.mu_t") == 0.12
    assert changed.skier.mass == 90.0
    assert np.degrees(changed.inclination) == pytest.approx(20.0, rel=1e-12)
    assert np.hypot(changed.start.velocity_f, changed.start.velocity_l) == pytest.approx(7.0, rel=1e-12)
    assert changed.ski.name == "giant_slalom_183"


def test_a_law_that_was_not_there_can_be_asked_for() -> None:
    model = model_of(*bundled("beginner"))
    changed = change_model(
        model, {"snow_patch.delta_mu_t": 0.05, "snow_patch.f1": 20.0, "ski.sidecut_scale": 0.8}, None
    )
    assert [term.name for term in changed.terms] == [*(term.name for term in model.terms), "snow_patch"]
    assert changed.value("snow_patch.f1") == 20.0
    assert max(changed.ski.width.value) < max(model.ski.width.value)


def test_a_law_that_replaces_another_cannot() -> None:
    with pytest.raises(InputError, match="no number is called"):
        change_model(model_of(*bundled("beginner")), {"carving.hardness": 1e6}, None)


def test_gates_need_a_path_that_is_kept(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="speed keeps none"):
        sssi_exudyn.whatif(tmp_path, changes=["gates.distance=0.9"], keep="speed")


def test_who_plays_the_recorded_movement_steers_nowhere() -> None:
    recording, motion = bundled("beginner")
    run = RecordedRun(model_of(recording, motion), motion, snow_turns=True)
    with pytest.raises(InputError, match="steers nowhere"):
        check_steering(run, "movement", "sweep.toml", "keep")
    check_steering(run, "path", "sweep.toml", "keep")


def test_an_unknown_ski_is_refused() -> None:
    with pytest.raises(InputError, match="no ski is called"):
        change_model(model_of(*bundled("beginner")), {}, "plank")


def test_a_folder_without_run_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="neither a result nor a recording"):
        sssi_exudyn.whatif(tmp_path)
