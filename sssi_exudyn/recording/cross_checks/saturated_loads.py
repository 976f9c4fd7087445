"""Loads that stand at the largest value which an insole can show, while the track's turns ask for more."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from sssi_exudyn.core.frames import Array
from sssi_exudyn.recording.cross_checks.check import Evidence, Finding

_SHARE: Final = 0.03
"""Share of the samples at one foot's largest value from which on it is the insole's, not the skier's.
Loads in steps of 5 N, as loadsol writes them, are at their largest for less than 1 % of a run.
"""
_FEWEST: Final = 10
"""Least number of such samples."""


class SaturatedLoads:
    """Insoles, or cells of them, at the end of their range."""

    compares = "largest load of each foot with how often it occurs"

    def judge(self, evidence: Evidence) -> Sequence[Finding]:
        """Return a doubt for each foot whose load, or a cell's, often stands at its largest value."""
        insoles = evidence.insoles
        if insoles is None:
            return ()
        doubts = []
        for foot, total, cells in (
            ("left", insoles.left, insoles.left_cells),
            ("right", insoles.right, insoles.right_cells),
        ):
            shares = [_share_at_most(total), *(_share_at_most(cell) for cell in cells.T)]
            if max(shares) < _SHARE:
                continue
            what = "load" if shares[0] >= _SHARE else f"load of {np.count_nonzero(np.array(shares) >= _SHARE)} cell(s)"
            problem = f"the {foot} foot's {what} stands at its largest value for {100.0 * max(shares):.0f} % of the run"
            doubts.append(Finding(evidence.files["insoles"], "", problem, "the insole was saturated: leave it out"))
        return doubts


def _share_at_most(load: Array) -> float:
    """Return the share of samples at the largest load; 0 for a cell that is never loaded."""
    most = float(np.max(load))
    count = int(np.count_nonzero(load >= most * (1.0 - 1e-9)))
    return count / len(load) if most > 0.0 and count >= _FEWEST else 0.0
