"""Facts of a run that files do not hold."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Answers:
    """Facts that files do not hold, in the units of ``recording.toml``; None where unknown.

    The command line has an option of the same name for each, such as ``--mass-kg``.  Usual values are assumed for
    skier, equipment, the receiver's place and its accuracy, and reported as assumed (``importing.defaults``).

    Attributes
    ----------
    slope_deg, fall_line_deg : inclination, and azimuth of the fall line clockwise from north; estimated if left out
    heading_deg : azimuth of the capture's forward axis, clockwise from north; estimated if left out
    antenna_joint, antenna_offset_m : the joint the receiver moves with, and its place in that joint's axes (x left,
        y up, z forward)
    gps_sigma_m : standard deviation of a horizontal fix
    gps_offset_s : time of the first fix after the capture's first frame

    Examples
    --------
    >>> answers = sssi_exudyn.Answers(antenna_joint="Spine2", gps_sigma_m=0.02)
    >>> sssi_exudyn.import_files(["run.mvnx", "run.gpx"], "monday", **dataclasses.asdict(answers))
    """

    name: str | None = None
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
