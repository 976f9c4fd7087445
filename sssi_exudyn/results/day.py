"""What several runs of one day say together, as ``day.json`` holds it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from sssi_exudyn.results.summary import Provenance
from sssi_exudyn.validation.diagnosis.day import DayExplanation


@dataclass(frozen=True)
class Day:
    """The comparison of a day's runs.

    recordings : their names
    explanations : what may act on all runs alike, and that nothing does, the most probable first
    """

    format: Literal[1]
    recordings: tuple[str, ...]
    sentence: str
    explanations: tuple[DayExplanation, ...]
    provenance: Provenance
