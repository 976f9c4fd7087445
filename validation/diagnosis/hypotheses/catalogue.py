"""The list of all hypotheses, and what distinguishes one from another."""

from __future__ import annotations

from typing import Final

from sssi_exudyn.runtime.plugins import same_part
from sssi_exudyn.validation.diagnosis.hypotheses.air.drag_area import OtherDragArea
from sssi_exudyn.validation.diagnosis.hypotheses.air.gust import PassingGust
from sssi_exudyn.validation.diagnosis.hypotheses.air.lift import OtherLift
from sssi_exudyn.validation.diagnosis.hypotheses.air.wind import SteadyWind
from sssi_exudyn.validation.diagnosis.hypotheses.hypothesis import Hypothesis, SteadyLaw
from sssi_exudyn.validation.diagnosis.hypotheses.instruments.boot_cuff import LoadOnCuffs
from sssi_exudyn.validation.diagnosis.hypotheses.instruments.gps_delay import GpsDelay
from sssi_exudyn.validation.diagnosis.hypotheses.instruments.gps_jump import DisplacedFixes
from sssi_exudyn.validation.diagnosis.hypotheses.instruments.heading_drift import DriftingHeading
from sssi_exudyn.validation.diagnosis.hypotheses.instruments.heading_misalignment import HeadingMisalignment
from sssi_exudyn.validation.diagnosis.hypotheses.instruments.insole_delay import LateInsoles
from sssi_exudyn.validation.diagnosis.hypotheses.instruments.insole_gain import WrongInsoleGain
from sssi_exudyn.validation.diagnosis.hypotheses.instruments.insole_offset import DriftedInsoleZero
from sssi_exudyn.validation.diagnosis.hypotheses.instruments.lever_arm import OtherLeverArm
from sssi_exudyn.validation.diagnosis.hypotheses.skier.pole_plant import PolePlants
from sssi_exudyn.validation.diagnosis.hypotheses.skier.unexplained_force import LatentForce
from sssi_exudyn.validation.diagnosis.hypotheses.snow.edge_dependent_friction import FrictionByEdge
from sssi_exudyn.validation.diagnosis.hypotheses.snow.edge_friction import EdgesCut
from sssi_exudyn.validation.diagnosis.hypotheses.snow.load_dependent_friction import FrictionByLoad
from sssi_exudyn.validation.diagnosis.hypotheses.snow.slope_change import OtherInclination
from sssi_exudyn.validation.diagnosis.hypotheses.snow.snow_compaction import CompactedSnow
from sssi_exudyn.validation.diagnosis.hypotheses.snow.snow_patch import PatchOfSnow
from sssi_exudyn.validation.diagnosis.hypotheses.snow.speed_dependent_friction import FrictionBySpeed
from sssi_exudyn.validation.diagnosis.hypotheses.snow.terrain_bump import RollOrDip
from sssi_exudyn.validation.diagnosis.hypotheses.snow.unexplained_drag import DragOfOneSki
from sssi_exudyn.validation.diagnosis.hypotheses.snow.unexplained_friction import FrictionOfOneSki

LATENT_FORCE: Final = LatentForce()
"""The one whose responses also locate the missing force."""
HYPOTHESES: Final[list[Hypothesis]] = [
    SteadyWind(),
    PassingGust(),
    OtherDragArea(),
    OtherLift(),
    PatchOfSnow(),
    FrictionBySpeed(),
    FrictionByEdge(),
    EdgesCut(),
    FrictionByLoad(),
    CompactedSnow(),
    OtherInclination(),
    RollOrDip(),
    PolePlants(),
    GpsDelay(),
    DisplacedFixes(),
    HeadingMisalignment(),
    DriftingHeading(),
    OtherLeverArm(),
    WrongInsoleGain(),
    LoadOnCuffs(),
    DriftedInsoleZero(),
    LateInsoles(),
    FrictionOfOneSki(),
    DragOfOneSki(),
    LATENT_FORCE,
]
"""The list of them, written out; those of plug-ins are added."""
STEADY_LAWS: Final = [hypothesis for hypothesis in HYPOTHESES if isinstance(hypothesis, SteadyLaw)]
"""What acts on all runs of a day alike."""
BY_NAME: Final[dict[str, Hypothesis]] = {hypothesis.name: hypothesis for hypothesis in HYPOTHESES}


def add_hypothesis(hypothesis: Hypothesis) -> None:
    """Let the diagnosis weigh a hypothesis of a plug-in too; one that is defined again takes the place of the old one.

    Raises ValueError where the name is another one's.
    """
    old = BY_NAME.get(hypothesis.name)
    if old is not None:
        if not same_part(type(old), type(hypothesis)):
            raise ValueError(f"there is a hypothesis named {hypothesis.name!r} already")
        HYPOTHESES.remove(old)
        if isinstance(old, SteadyLaw):
            STEADY_LAWS.remove(old)
    HYPOTHESES.insert(-1, hypothesis)  # what nothing explains stays the last
    BY_NAME[hypothesis.name] = hypothesis
    if isinstance(hypothesis, SteadyLaw):
        STEADY_LAWS.append(hypothesis)


def distinguishing_measurement(one: str, other: str) -> str | None:
    """Return the measurement that would distinguish two hypotheses, by their names; None where none is known."""
    for name, compared in ((one, other), (other, one)):
        for distinction in BY_NAME[name].distinctions if name in BY_NAME else ():
            if compared in distinction.others:
                return distinction.measurement
    return None
