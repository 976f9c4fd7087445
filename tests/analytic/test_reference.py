"""The flat model in one file against the assembled one: other beams, another integrator, no code in common."""

from pathlib import Path

import numpy as np
import pytest

from sssi_exudyn.bodies.ski_mesh import mesh
from sssi_exudyn.bodies.ski_modes import modal_ski
from sssi_exudyn.commands import model_of
from sssi_exudyn.motion import motion_from_recording
from sssi_exudyn.recording import read_recording
from sssi_exudyn.simulation import simulate
from sssi_exudyn.validation.reference import flat_ski, simulate_flat

EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.mark.parametrize(
    ("name", "begin", "friction"), [("beginner", 2.0, (0.06, 0.55)), ("intermediate", 4.0, (0.19, 0.9))]
)
def test_the_assembled_model_is_the_flat_one(name: str, begin: float, friction: tuple[float, float]) -> None:
    recording = read_recording(EXAMPLES / name)
    motion = motion_from_recording(recording)
    model = model_of(recording, motion)
    model = model.with_values(dict(zip(("friction.mu_t", "friction.mu_n"), friction, strict=True)))
    full = simulate(model, motion, stop=begin + 0.5)
    i = int(np.searchsorted(full.time, begin - 1e-9))
    time = full.time[i:]
    flat = simulate_flat(model, motion, float(time[0]), float(time[-1]), full.pelvis[i], full.pelvis_velocity[i])
    pelvis, loads = (
        np.stack([np.interp(time, flat["time"], column) for column in flat[key].T], axis=1)
        for key in ("pelvis", "foot_load")
    )
    # 2.5 mm in half a second of a turn (2.5 to 6 m of path): linear, unshearable, straight beams against exact ones
    # with camber and shovel, and skis that start at rest instead of swinging; seen 1.7 and 0.7 mm
    assert np.max(np.abs(pelvis - full.pelvis[i:])) < 2.5e-3
    # 1.5 % of the load once the first swing of the skis has died out
    later = time > begin + 0.1
    weight = full.foot_load[i:].sum(axis=1).mean()
    assert np.max(np.abs(loads - full.foot_load[i:])[later]) < 0.015 * weight


def test_the_flat_skis_vibrations_are_the_frames() -> None:
    recording = read_recording(EXAMPLES / "beginner")
    model = model_of(recording, motion_from_recording(recording))
    bending = np.sort(flat_ski(model).omega[flat_ski(model).carried_turn == 0.0]) / (2.0 * np.pi)
    frame = modal_ski(mesh(model.ski, 50), 12).frequency
    # the four slowest that bend up or down, found in both; 4 %: shear, camber and shovel, lumped masses
    for frequency in bending[:4]:
        assert np.min(np.abs(frame / frequency - 1.0)) < 0.04
