"""The model of a recorded skier before anything is fitted."""

from __future__ import annotations

from dataclasses import replace

from sssi_exudyn.bodies.ski import read_ski
from sssi_exudyn.contact.registry import PAPER_TERMS
from sssi_exudyn.fitting.observe import first_guess
from sssi_exudyn.model import Model
from sssi_exudyn.motion import Motion
from sssi_exudyn.recording import Recording


def model_of(recording: Recording, motion: Motion) -> Model:
    """The paper's model of a recorded skier, with default friction, started as the GPS says."""
    model = Model(
        name=recording.name,
        skier=recording.skier,
        equipment=recording.equipment,
        ski=read_ski(recording.equipment.skis, recording.folder),
        inclination=recording.slope.inclination,
        fall_line_azimuth=recording.slope.fall_line_azimuth,
        terms=PAPER_TERMS,
    )
    if recording.gps is None:
        return model
    return replace(model, start=first_guess(recording.gps, motion, model.inclination, model.fall_line_azimuth))
