"""The list of all hypotheses, and what distinguishes one from another."""

from __future__ import annotations

from typing import Final

from sssi_exudyn.validation.diagnosis.hypotheses.boot_cuff import LoadOnCuffs
from sssi_exudyn.validation.diagnosis.hypotheses.drag_area import OtherDragArea
from sssi_exudyn.validation.diagnosis.hypotheses.edge_dependent_friction import FrictionByEdge
from sssi_exudyn.validation.diagnosis.hypotheses.gps_delay import GpsDelay
from sssi_exudyn.validation.diagnosis.hypotheses.gps_jump import DisplacedFixes
from sssi_exudyn.validation.diagnosis.hypotheses.gust import PassingGust
from sssi_exudyn.validation.diagnosis.hypotheses.heading_drift import DriftingHeading
from sssi_exudyn.validation.diagnosis.hypotheses.heading_misalignment import HeadingMisalignment
from sssi_exudyn.validation.diagnosis.hypotheses.insole_gain import WrongInsoleGain
from sssi_exudyn.validation.diagnosis.hypotheses.lever_arm import OtherLeverArm
from sssi_exudyn.validation.diagnosis.hypotheses.load_dependent_friction import FrictionByLoad
from sssi_exudyn.validation.diagnosis.hypotheses.pole_plant import PolePlants
from sssi_exudyn.validation.diagnosis.hypotheses.slope_change import OtherInclination
from sssi_exudyn.validation.diagnosis.hypotheses.snow_compaction import CompactedSnow
from sssi_exudyn.validation.diagnosis.hypotheses.snow_patch import PatchOfSnow
from sssi_exudyn.validation.diagnosis.hypotheses.speed_dependent_friction import FrictionBySpeed
from sssi_exudyn.validation.diagnosis.hypotheses.terrain_bump import RollOrDip
from sssi_exudyn.validation.diagnosis.hypotheses.unexplained_force import LatentForce
from sssi_exudyn.validation.diagnosis.hypotheses.wind import SteadyWind
from sssi_exudyn.validation.diagnosis.hypothesis import Hypothesis, SteadyLaw

LATENT_FORCE: Final = LatentForce()
"""The one whose responses also locate the missing force."""
HYPOTHESES: Final[tuple[Hypothesis, ...]] = (
    SteadyWind(),
    PassingGust(),
    OtherDragArea(),
    PatchOfSnow(),
    FrictionBySpeed(),
    FrictionByEdge(),
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
    LATENT_FORCE,
)
"""The list of them, written out."""
STEADY_LAWS: Final = tuple(each for each in HYPOTHESES if isinstance(each, SteadyLaw))
"""What acts on all runs of a day alike."""
BY_NAME: Final[dict[str, Hypothesis]] = {hypothesis.name: hypothesis for hypothesis in HYPOTHESES}


def distinguishing_measurement(one: str, other: str) -> str | None:
    """The measurement that would distinguish two hypotheses, by their names; None where none is known."""
    for name, compared in ((one, other), (other, one)):
        for distinction in BY_NAME[name].distinctions if name in BY_NAME else ():
            if compared in distinction.others:
                return distinction.measurement
    return None
