"""Faults of instruments: declared like terms, kept in a model's file, and undone where a result is judged."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import tomli_w
from bundled import bundled

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.quantity import quantities
from sssi_exudyn.fitting.observations import correct_fixes, insole_loads, predict_fixes
from sssi_exudyn.model.faults import (
    SENSORS,
    BootCuff,
    GpsJump,
    HeadingDrift,
    InsoleDelay,
    InsoleGain,
    InsoleOffset,
    LeverArm,
    gps_offset,
    insole_readings,
)
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.model.toml import model_to_dict, read_model

FAULTS = (
    GpsJump(x=0.5, y=-0.2, t0=3.0, t1=4.0),
    HeadingDrift(rate=0.01, t_ref=2.0),
    LeverArm(up=0.1),
    InsoleGain(left=0.2),
    BootCuff(share=0.1),
    InsoleOffset(right=30.0),
    InsoleDelay(late=0.05),
)


@pytest.mark.parametrize("cls", SENSORS, ids=lambda cls: cls.name)
def test_declares_its_numbers(cls: type) -> None:
    assert "Formula:" in (cls.__doc__ or "")
    assert quantities(cls)
    assert all(about.meaning and about.source for about in quantities(cls).values())


def test_a_models_file_keeps_its_faults(tmp_path: Path) -> None:
    model = replace(model_of(*bundled("beginner")), sensors=FAULTS)
    path = tmp_path / "model.toml"
    path.write_text(tomli_w.dumps(model_to_dict(model)), encoding="utf-8")
    assert read_model(path).sensors == FAULTS
    assert model.with_values({"gps_jump.x": 0.7}).value("gps_jump.x") == 0.7
    path.write_text(tomli_w.dumps({**model_to_dict(model), "sensor": [{"name": "glue"}]}), encoding="utf-8")
    with pytest.raises(InputError, match="no sensor model is named 'glue'"):
        read_model(path)


def test_corrected_fixes_are_where_the_antenna_was() -> None:
    recording, motion = bundled("beginner")
    model = replace(model_of(recording, motion), sensors=FAULTS)
    model = model.with_values({"start.clock_offset": 0.2})
    gps = recording.gps
    assert gps is not None
    corrected = correct_fixes(gps, model)
    assert np.allclose(gps.time - corrected.time, 0.2)
    jumped = (gps.time >= 3.0) & (gps.time < 4.0)
    moved = np.linalg.norm(gps.enu - corrected.enu, axis=1)
    np.testing.assert_allclose(moved[jumped], np.hypot(0.5, 0.2), rtol=1e-12)  # rounding
    assert not np.any(moved[~jumped])


@pytest.mark.parametrize(
    ("rise", "shares"),
    [
        (0.0, [0.0, 1.0, 1.0, 1.0, 1.0, 1.0, 0.0]),
        (0.5, [0.0, 0.0, 0.5, 1.0, 0.5, 0.0, 0.0]),
        (1.0, [0.0, 0.0, 0.5 * (1.0 - np.sqrt(0.5)), 1.0, 0.5 * (1.0 - np.sqrt(0.5)), 0.0, 0.0]),
    ],
)
def test_displaced_fixes_come_and_go_within_their_share(rise: float, shares: list[float]) -> None:
    time = np.array([1.9, 2.0, 2.5, 4.0, 5.5, 6.0 - 1e-12, 6.0])
    offset = GpsJump(x=0.4, y=-0.2, t0=2.0, t1=6.0, rise=rise).offset(time)
    np.testing.assert_allclose(offset, np.outer(shares, [0.4, -0.2, 0.0]), atol=1e-12)


def test_a_late_clock_sees_the_past() -> None:
    model = model_of(*bundled("beginner"))
    time = np.linspace(0.0, 4.0, 41)
    straight = np.stack([5.0 * time, 0.0 * time, 0.0 * time], axis=1)
    late = model.with_values({"start.clock_offset": 0.3})
    at = np.array([1.0, 2.0])
    before, after = predict_fixes(model, time, straight, at), predict_fixes(late, time, straight, at)
    np.testing.assert_allclose(before[:, 0] - after[:, 0], 0.3 * 5.0 * np.cos(model.inclination), rtol=1e-12)


def test_insoles_feel_what_their_faults_leave() -> None:
    felt = insole_readings(FAULTS, np.array([[100.0, 200.0]]))
    np.testing.assert_allclose(felt, [[100.0 * 1.2 * 0.9, 200.0 * 0.9 + 30.0]], rtol=1e-12)  # rounding
    assert not np.any(gps_offset((), np.arange(3.0)))


def test_late_insoles_say_what_was() -> None:
    """A load that grows evenly was as much less as the clock is late; without a fault it is the average."""
    model = model_of(*bundled("beginner"))
    time = np.linspace(0.0, 4.0, 401)
    sole = np.stack([400.0 + 100.0 * time, 300.0 - 50.0 * time], axis=1)
    at = np.array([1.0, 2.0])
    now = insole_loads(model, time, sole, at)
    np.testing.assert_allclose(now, np.stack([400.0 + 100.0 * at, 300.0 - 50.0 * at], axis=1), rtol=1e-9)  # rounding
    late = insole_loads(replace(model, sensors=(InsoleDelay(late=0.08),)), time, sole, at)
    np.testing.assert_allclose(late - now, [[-8.0, 4.0]] * 2, rtol=1e-7)  # rounding
