"""A skier who stands still on two skis: the simplest run, with known answers."""

import numpy as np

from sssi_exudyn.bodies.ski.ski import read_ski
from sssi_exudyn.bodies.skier.chain import PRESCRIBED, average_geometry
from sssi_exudyn.contact.registry import PAPER_TERMS
from sssi_exudyn.contact.term import Term
from sssi_exudyn.model.model import Model, Start
from sssi_exudyn.motion.motion import Motion, spline_motion
from sssi_exudyn.recording.recording import Equipment, Skier

INCLINATION = np.radians(15.0)
CROUCH = {"hip_flexion": 50.0, "knee_angle": 60.0, "ankle_angle": 10.0}
"""Angles of a crouch, degrees; hip, knee and ankle together leave the foot level when the pelvis is."""


def standing(seconds: float, heading: float = 0.0, **extra: float) -> Motion:
    """Return a constant posture: crouched, skis flat on the snow, turned by ``heading`` (rad) to the left.

    ``extra`` sets further coordinates (rad) by name.
    """
    angles = dict.fromkeys(PRESCRIBED, 0.0)
    for name, value in CROUCH.items():
        angles[f"{name}_l"] = angles[f"{name}_r"] = float(np.radians(value))
    angles["pelvis_tilt"] = -INCLINATION  # leaning forward so that the soles lie on the slope
    angles["pelvis_rotation"] = heading
    angles.update(extra)
    time = np.linspace(0.0, seconds, max(12, round(60 * seconds)))
    values = np.tile([angles[name] for name in PRESCRIBED], (len(time), 1))
    return spline_motion(average_geometry(1.75), INCLINATION, time, values)


def model(terms: tuple[Term, ...] = PAPER_TERMS, speed: float = 5.0, across: float = 0.0) -> Model:
    """Return an average skier on the catalogue's slalom ski who starts at ``speed`` down the slope (m/s)."""
    return Model(
        name="standing",
        skier=Skier(mass=75.0, height=1.75, sex="male"),
        equipment=Equipment(skis="slalom_165", ski_mass=2.4, boot_mass=1.9, ankle_to_ski_base=0.13),
        ski=read_ski("slalom_165", "."),
        inclination=float(INCLINATION),
        fall_line_azimuth=0.0,
        terms=terms,
        start=Start(velocity_f=speed, velocity_l=across),
    )
