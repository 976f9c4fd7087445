"""What several runs of one day say together, as ``day.json`` holds it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from sssi_exudyn.results.summary import Provenance
from sssi_exudyn.validation.diagnosis.several_runs.friction_regression import FoundLaw
from sssi_exudyn.validation.diagnosis.several_runs.joint_fit import DayExplanation
from sssi_exudyn.validation.diagnosis.several_runs.second_pass import SamePlace


@dataclass(frozen=True)
class Day:
    """The comparison of a day's runs.

    recordings : their names
    explanations : what may act on all runs alike, and that nothing does, the most probable first
    same_place : findings of one run that others passed the place of, and what these measured there
    found_law : the most probable law of friction that is in no list, and whether it is offered; files older than it
        have none
    """

    format: Literal[1]
    recordings: tuple[str, ...]
    sentence: str
    explanations: tuple[DayExplanation, ...]
    provenance: Provenance
    same_place: tuple[SamePlace, ...] = ()
    found_law: FoundLaw | None = None
