"""The bundled recordings, read once per process: reading one with its motion takes a second."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

from sssi_exudyn.model.model import Model
from sssi_exudyn.motion.from_recording import motion_from_recording
from sssi_exudyn.motion.motion import Motion
from sssi_exudyn.recording.read import read_recording
from sssi_exudyn.recording.recording import Recording

EXAMPLES = Path(__file__).parents[2] / "examples"


@cache
def bundled(name: str) -> tuple[Recording, Motion]:
    """Return the recording ``examples/name`` and its motion."""
    recording = read_recording(EXAMPLES / name)
    return recording, motion_from_recording(recording)


def steady(recording: Recording) -> Recording:
    """Return the recording as by a suit whose errors do not wander, of a skier without lift and with a drag area that
    does not change: a dozen errors of the posture to be estimated instead of ten dozen, for tests that are not about
    posture and air.
    """
    wander = (
        "foot_wander", "foot_yaw_fast", "foot_place_wander", "foot_height_wander", "trunk_wander",
        "lift_area", "drag_area_wander",
    )  # fmt: skip
    return replace(recording, uncertainty=replace(recording.uncertainty, **dict.fromkeys(wander, 0.0)))


def coarse(model: Model) -> Model:
    """Return the model with skis of 20 elements: the full model takes half the time, and its track differs by 3 mm."""
    return replace(model, solver=replace(model.solver, elements=20))
