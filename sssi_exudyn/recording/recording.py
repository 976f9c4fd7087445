"""A recording: the folder of one run, read, checked and brought onto one clock.

``recording.toml`` states who skied, on what, where, and how each instrument sat.  Any fault in the folder gives one
InputError that names the file, the place and the fix; whatever could be corrected gives a notice.
"""

from __future__ import annotations

import math
import os
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

import numpy as np

from sssi_exudyn.core.checked import checked
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.quantity import quantity
from sssi_exudyn.core.text import one_line
from sssi_exudyn.recording.few_sensors.complete import Completed
from sssi_exudyn.recording.instruments.bvh import Bvh
from sssi_exudyn.recording.instruments.gps import Gps
from sssi_exudyn.recording.instruments.insoles import Insoles
from sssi_exudyn.recording.instruments.poles import Poles
from sssi_exudyn.recording.snow import SnowConditions
from sssi_exudyn.recording.uncertainty import Uncertainty

FILE: Final = "recording.toml"
NEARBY: Final = 100.0
"""Greatest distance from a run's path, m; the heights of a run farther off say nothing of the snow under it."""
_AZIMUTH: Final = 2.0 * np.pi
_DEGREE: Final = math.radians(1.0)
_STEEPEST: Final = float(np.deg2rad(60.0))


@dataclass(frozen=True)
class Skier:
    """The person who skied, without boots and skis."""

    mass: float = quantity(
        75.0, "kg", low=20.0, high=200.0, source="children to heavy adults", meaning="mass without boots and skis"
    )
    height: float = quantity(1.75, "m", low=1.0, high=2.3, source="children to tall adults", meaning="body height")
    sex: str = "male"
    name: str = ""


@dataclass(frozen=True)
class Equipment:
    """The equipment that was skied on; masses are those of each ski, boot and pole.

    cuff_flexion, cuff_lean : N m/rad, rad of the boots' cuffs as ``Cuff`` has them; None where they are not stated
    """

    skis: str = "slalom_165"
    ski_mass: float = quantity(
        2.4, "kg", low=0.5, high=10.0, source="touring to downhill skis", meaning="mass of one ski with its binding"
    )
    boot_mass: float = quantity(
        1.9, "kg", low=0.5, high=5.0, source="touring to racing boots", meaning="mass of one boot"
    )
    ankle_to_ski_base: float = quantity(
        0.13, "m", low=0.03, high=0.3, source="ankle 0.07 m, sole, plate and ski above the snow",
        meaning="from the ankle joint down to the running surface, along the foot's up axis",
    )  # fmt: skip
    boot_sole_length: float = quantity(
        0.32, "m", low=0.2, high=0.4, source="typical boot, not measured", meaning="length of the boot's sole"
    )
    boot_centre: float = quantity(
        0.0, "m", low=-0.1, high=0.2, source="under the ankle, as in the paper; a real boot's is some 0.07 m ahead",
        meaning="from the ankle joint forward to the middle of the boot's sole, which stands on the ski's mark",
    )  # fmt: skip
    ramp_angle: float = quantity(
        0.0, "rad", low=-10.0 * _DEGREE, high=10.0 * _DEGREE, source="sole and foot captured level",
        meaning="angle by which the captured foot points down against the ski: binding and boot board",
    )  # fmt: skip
    cuff_edging: float = quantity(
        600.0, "N m/rad", low=200.0, high=3e3, source="estimate, as of boot and ankle in roll where edges cut",
        meaning="stiffness of the boot's cuff about the foot's long axis",
    )  # fmt: skip
    pole_mass: float = quantity(0.0, "kg", low=0.0, high=1.0, source="none stated", meaning="mass of one pole")
    pole_length: float = quantity(
        1.15, "m", low=0.5, high=1.6, source="typical pole", meaning="length of a pole from grip to tip"
    )
    cuff_flexion: float | None = None
    cuff_lean: float | None = None


OPTIONAL: Final = ("boot_sole_length", "boot_centre", "ramp_angle", "cuff_edging", "pole_mass", "pole_length")
"""Quantities of boots and poles that a recording need not state."""


@dataclass(frozen=True)
class Slope:
    """The plane that was skied, rad; azimuth clockwise from north.  The sigmas are 0 where the slope was given."""

    inclination: float = quantity(
        0.27, "rad", low=0.0, high=_STEEPEST, source="steepest couloirs", meaning="angle to the horizontal"
    )
    fall_line_azimuth: float = quantity(
        0.0, "rad", low=-_AZIMUTH, high=_AZIMUTH, source="full circle", meaning="downhill, clockwise from north"
    )
    estimated: bool = False
    sigma_inclination: float = 0.0
    sigma_fall_line_azimuth: float = 0.0


@dataclass(frozen=True)
class Elevations:
    """An elevation model of the slope.

    path : path of the GeoTIFF, ESRI ASCII grid or SRTM tile
    same_datum : whether its heights, with the geoid's added, have the receiver's zero
    crs : coordinate system that is stated besides, such as EPSG:31254; "" for the file's own
    """

    path: Path
    same_datum: bool
    crs: str = ""
    sigma: float = quantity(
        1.0, "m", low=0.01, high=10.0, source="snow of 0 to 3 m", meaning="smooth deviation of the snow from it"
    )
    geoid_height: float = quantity(
        0.0, "m", low=-120.0, high=100.0, source="EGM2008: -107 to 86 m", meaning="geoid over the ellipsoid"
    )


@dataclass(frozen=True)
class Heading:
    """The azimuth of the BVH +z axis (rad, clockwise from north) and its standard deviation before any fit (rad)."""

    value: float
    estimated: bool
    sigma: float


@dataclass(frozen=True, repr=False)
class Recording:
    """A recording is one run of one skier, checked and on one clock (s from the start of the recording).

    Attributes
    ----------
    start, stop : s, the stretch that all instruments cover
    elevations : elevation model of the slope, if there is one
    uncertainty : standard deviations of stated and measured quantities
    runs : other runs on the same slope, whose heights show the snow too; they have fixes and name no runs themselves
    poles : load cells in the poles, if there are any
    began : UTC of the clock's zero, s since 1970; None where it is not stated
    snow : what is stated of the snow, if anything is
    completed : how ``bvh`` was made from few sensors; None where it was captured
    hashes : ``"sha256:…"`` of every file read, by its name in the folder
    notices : corrections of the data and oddities in it, in words

    Examples
    --------
    >>> recording = sssi_exudyn.read_recording("examples/beginner")
    >>> first_seconds = dataclasses.replace(recording, stop=recording.start + 4.0)
    """

    name: str
    note: str
    folder: Path
    skier: Skier
    equipment: Equipment
    slope: Slope
    bvh: Bvh
    heading: Heading
    gps: Gps | None
    insoles: Insoles | None
    start: float
    stop: float
    hashes: dict[str, str]
    notices: tuple[str, ...]
    completed: Completed | None = None
    elevations: Elevations | None = None
    uncertainty: Uncertainty = field(default_factory=Uncertainty)
    runs: tuple[Recording, ...] = ()
    poles: Poles | None = None
    began: float | None = None
    snow: SnowConditions | None = None

    @checked
    def to_bids(self, folder: str | os.PathLike[str], subject: str = "01") -> Path:
        """Write the motion capture into a dataset of BIDS (Motion), and return the file of its time series.

        Parameters
        ----------
        folder : the dataset; it is begun where there is none
        subject : label of the subject, of letters and digits

        Raises InputError for another label, for a posture that was not captured, and where the dataset has the subject.

        Examples
        --------
        >>> sssi_exudyn.read_recording("examples/beginner").to_bids("skiers", "01")
        """
        from sssi_exudyn.recording.bids import write_bids

        if self.completed is not None:
            problem = "its posture was estimated from few sensors, not captured"
            raise InputError("to_bids", self.name, problem, "export a recording with a motion capture")
        return write_bids(self.bvh, self.name, Path(folder), subject)

    def __repr__(self) -> str:
        fixes = "no GPS" if self.gps is None else f"{len(self.gps.time)} fixes"
        insoles = "no insoles" if self.insoles is None else "insoles"
        capture = "few sensors" if self.completed is not None else "motion capture"
        about = f"{self.stop - self.start:.1f} s, {capture}, {fixes}, {insoles}, {len(self.notices)} notices"
        return f"<Recording {one_line(self.name)}: {about}>"
