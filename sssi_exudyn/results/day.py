"""The common result of several runs of one day, as ``day.json`` holds it."""

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
    explanations : effects that may act on all runs alike, and no effect, the most probable first
    same_place : findings of one run whose place other runs passed, and what these measured there
    found_law : the most probable law of friction that is in no list, and whether it is offered; older files have none
    """

    format: Literal[1]
    recordings: tuple[str, ...]
    sentence: str
    explanations: tuple[DayExplanation, ...]
    provenance: Provenance
    same_place: tuple[SamePlace, ...] = ()
    found_law: FoundLaw | None = None
