"""All checks, in the order in which they are applied: corrections before what relies on them."""

from __future__ import annotations

from typing import Final

from sssi_exudyn.recording.cross_checks.capture_size import CaptureSize
from sssi_exudyn.recording.cross_checks.check import Check
from sssi_exudyn.recording.cross_checks.clock_rates import ClockRates
from sssi_exudyn.recording.cross_checks.elevation_unit import ElevationUnit
from sssi_exudyn.recording.cross_checks.joint_motion import JointMotion
from sssi_exudyn.recording.cross_checks.load_and_weight import LoadAndWeight
from sssi_exudyn.recording.cross_checks.loaded_foot import LoadedFoot
from sssi_exudyn.recording.cross_checks.saturated_loads import SaturatedLoads
from sssi_exudyn.recording.cross_checks.sensor_turning import SensorTurning
from sssi_exudyn.recording.cross_checks.stated_heading import StatedHeading
from sssi_exudyn.recording.cross_checks.stated_slope import StatedSlope
from sssi_exudyn.recording.cross_checks.swapped_coordinates import SwappedCoordinates
from sssi_exudyn.recording.cross_checks.travel import Travel
from sssi_exudyn.recording.cross_checks.turning_offset import TurningOffset

CHECKS: Final[tuple[Check, ...]] = (
    CaptureSize(),
    JointMotion(),
    SensorTurning(),
    SwappedCoordinates(),
    Travel(),
    StatedHeading(),
    StatedSlope(),
    ClockRates(),
    TurningOffset(),
    LoadAndWeight(),
    LoadedFoot(),
    SaturatedLoads(),
    ElevationUnit(),
)
