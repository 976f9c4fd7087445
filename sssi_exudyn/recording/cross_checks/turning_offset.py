"""The turns of the skis against those of the track: a clock that is off."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from sssi_exudyn.recording.cross_checks.check import Evidence, Finding
from sssi_exudyn.recording.cross_checks.clock_pairs import skis_along_course

_LATEST: Final = 4.0
_STEP: Final = 0.1
"""Largest offset of the clocks, s, that is tried, and the steps."""
EXPLAINED: Final = 0.3
"""Share of the skis' turning that may be left unexplained where the clocks agree."""
_AS_GOOD: Final = 2.0
"""Ratio to the least that is left within which two offsets are as good."""
_TURN: Final = 0.5
"""Distance of two offsets, s, between which no turn lies."""
_BETTER: Final = 3.0
"""Ratio of what is left with the clocks as they are to what the best clocks leave, from which on these are believed."""
LEAST_OFFSET: Final = 0.6
"""Smallest offset, s, that is reported: skis turn up to 0.25 s before the course."""


@dataclass(frozen=True)
class Offset:
    """How the turns of skis and track fit: the share of the skis' turning that the track leaves unexplained.

    as_is : with the clocks as they are
    value, left : s, the offset that leaves least, and what it leaves
    """

    as_is: float
    value: float
    left: float


class TurningOffset:
    """Motion and fixes that turn at different times."""

    compares = "turns of the skis in the capture with those of the track: offset of the clocks"

    def judge(self, evidence: Evidence) -> Sequence[Finding]:
        """Return a doubt with the best offset, where it fits far better than the clocks as they are."""
        offset = offset_of_turns(evidence)
        if offset is None or abs(offset.value) < LEAST_OFFSET or offset.left * _BETTER > offset.as_is:
            return ()
        if offset.left > EXPLAINED:
            return ()
        words = "later" if offset.value > 0.0 else "earlier"
        problem = f"the skis turn like the track {abs(offset.value):.1f} s {words} than by the clocks"
        fix = f"check time_offset_s: add {offset.value:+.1f} s to that of [motion]"
        return (Finding(evidence.files["motion"], "", problem, fix),)


def offset_of_turns(evidence: Evidence) -> Offset | None:
    """Compare the turns of skis and track; None where there are none to compare."""
    comparison = skis_along_course(evidence)
    if comparison is None:
        return None
    offsets = np.arange(-_LATEST, _LATEST + 0.5 * _STEP, _STEP)
    left = comparison.left(1.0, offsets)
    # even turns fit again a turn later: the smallest offset of about the best ones is meant
    near = np.flatnonzero(left <= _AS_GOOD * np.min(left))
    around = np.abs(offsets - offsets[near[np.argmin(np.abs(offsets[near]))]]) <= _TURN
    best = int(np.argmin(np.where(around, left, np.inf)))
    return Offset(float(left[int(np.argmin(np.abs(offsets)))]), float(offsets[best]), float(left[best]))
