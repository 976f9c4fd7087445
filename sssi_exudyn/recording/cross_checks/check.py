"""What a check gets, what it finds, and what becomes of that.

A finding that is sure and has a remedy is corrected, with a note.  A sure one without a remedy is an InputError.  An
unsure one is a notice.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.recording.instruments.bvh import Bvh
from sssi_exudyn.recording.instruments.gps import Gps
from sssi_exudyn.recording.instruments.imu import Imu
from sssi_exudyn.recording.instruments.insoles import Insoles
from sssi_exudyn.recording.recording import Elevations, Equipment, Skier, Slope
from sssi_exudyn.recording.slope_and_heading import SlopeAndHeading


@dataclass(frozen=True)
class Evidence:
    """The instruments and statements of one recording; what is absent is None or empty.

    Attributes
    ----------
    toml : path of ``recording.toml``;  files : path of each instrument's file, by its table: ``"gps"``, ``"insoles"`` …
    bvh : the capture;  imus : single sensors instead of it
    start, stop : s, the stretch that all instruments cover
    slope, heading : as stated (rad)
    setting : slope and heading as estimated from capture and fixes
    clock_sigma : s, how far a corrected clock may still be off at the ends of the run; 0 where none was corrected
    """

    toml: Path
    skier: Skier
    equipment: Equipment
    files: Mapping[str, Path] = field(default_factory=dict)
    bvh: Bvh | None = None
    imus: tuple[Imu, ...] = ()
    gps: Gps | None = None
    insoles: Insoles | None = None
    elevations: Elevations | None = None
    start: float = 0.0
    stop: float = 0.0
    slope: Slope | None = None
    heading: float | None = None
    setting: SlopeAndHeading = field(default_factory=lambda: SlopeAndHeading(None, None))
    clock_sigma: float = 0.0


@dataclass(frozen=True)
class Finding:
    """A contradiction between two instruments.

    Attributes
    ----------
    file, place : the file that is probably wrong, and where in it
    sentence : what contradicts what, with the number
    fix : what the user can do;  for a correction, what was done
    sure : whether nothing else explains it
    corrected : the evidence without the fault, where the remedy is certain
    """

    file: Path
    place: str
    sentence: str
    fix: str
    sure: bool = False
    corrected: Evidence | None = None


class Check(Protocol):
    """A comparison of one instrument with another.

    compares : the two that are compared, in words, for tables of all checks
    """

    compares: str

    def judge(self, evidence: Evidence) -> Sequence[Finding]:
        """Return what contradicts; nothing where an instrument is absent or the run does not show it."""
        ...


def hold_against_each_other(evidence: Evidence, checks: Sequence[Check]) -> tuple[Evidence, tuple[str, ...]]:
    """Apply checks in their order; return the corrected evidence, and corrections and doubts in words.

    Raises InputError for the first finding that is sure and has no remedy.
    """
    notices: list[str] = []
    for check in checks:
        for finding in check.judge(evidence):
            if finding.corrected is not None:
                evidence = finding.corrected
            elif finding.sure:
                raise InputError(finding.file, finding.place, finding.sentence, finding.fix)
            place = f"{finding.place}: " if finding.place else ""
            notices.append(f"{finding.file.name}: {place}{finding.sentence}; {finding.fix}")
    return evidence, tuple(notices)
