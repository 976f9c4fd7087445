"""Facts of a run that files do not hold."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Annotated, TypedDict

from sssi_exudyn.core.choices import Sex
from sssi_exudyn.core.command_line import Option


@dataclass(frozen=True)
class Answers:
    """Answers give the facts that files do not hold, in the units of ``recording.toml``; None where unknown.

    The command line has an option of the same name for each, such as ``--mass-kg`` (``AnswerOptions``).  Usual values
    are assumed for skier, equipment, the receiver's place and its accuracy, and reported as assumed
    (``importing.defaults``).

    Attributes
    ----------
    name : the recording's; default: the capture's file, of sensors the folder
    skier : the skier's name, by which runs are compared
    mass_kg : the skier, without boots and skis
    height_m : the skier
    sex : chooses the anthropometric table
    skis : a ski of the catalogue
    ski_mass_kg : one ski with its binding
    boot_mass_kg : one boot
    ankle_to_ski_base_m : from the ankle joint down to the running surface
    boot_centre_m : from the ankle joint forward to the middle of the boot's sole
    slope_deg : inclination; estimated from the fixes if left out
    fall_line_deg : azimuth of the fall line, clockwise from north; likewise
    heading_deg : azimuth of the capture's forward axis, clockwise from north; likewise
    antenna_joint : the joint the receiver moves with, such as Spine2
    antenna_offset_m : the receiver from there.  The axes are that joint's: left, up, forward.
    gps_sigma_m : standard deviation of a horizontal fix, where the file does not have it
    gps_offset_s : from the capture's first frame to the first fix, where the files' clocks do not give it
    dem : elevation model of the slope (.tif, .asc or .hgt)
    dem_crs : coordinate system of an elevation model that states none, such as EPSG:31254

    Examples
    --------
    >>> answers = sssi_exudyn.Answers(antenna_joint="Spine2", gps_sigma_m=0.02)
    >>> sssi_exudyn.import_files(["run.mvnx", "run.gpx"], "monday", **dataclasses.asdict(answers))
    """

    name: str | None = None
    skier: str | None = None
    mass_kg: float | None = None
    height_m: float | None = None
    sex: str | None = None
    skis: str | None = None
    ski_mass_kg: float | None = None
    boot_mass_kg: float | None = None
    ankle_to_ski_base_m: float | None = None
    boot_centre_m: float | None = None
    slope_deg: float | None = None
    fall_line_deg: float | None = None
    heading_deg: float | None = None
    antenna_joint: str | None = None
    antenna_offset_m: tuple[float, float, float] | None = None
    gps_sigma_m: float | None = None
    gps_offset_s: float | None = None
    dem: str | os.PathLike[str] | None = None
    dem_crs: str | None = None


class AnswerOptions(TypedDict, total=False):
    """``Answers`` as keyword arguments, which checkers and editors know by name, and as options."""

    name: str | None
    skier: Annotated[str, Option(metavar="NAME")] | None
    mass_kg: float | None
    height_m: float | None
    sex: Sex | None
    skis: str | None
    ski_mass_kg: float | None
    boot_mass_kg: float | None
    ankle_to_ski_base_m: float | None
    boot_centre_m: float | None
    slope_deg: float | None
    fall_line_deg: float | None
    heading_deg: float | None
    antenna_joint: Annotated[str, Option(metavar="JOINT")] | None
    antenna_offset_m: Annotated[tuple[float, float, float], Option(metavar=("LEFT", "UP", "FORWARD"))] | None
    gps_sigma_m: float | None
    gps_offset_s: float | None
    dem: Annotated[str | os.PathLike[str], Option(metavar="FILE")] | None
    dem_crs: Annotated[str, Option(metavar="EPSG:N")] | None


AnswerOptions.__doc__ = Answers.__doc__  # each option's help is that of its answer
