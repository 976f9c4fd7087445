"""The capture's bones against the skier's height."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from sssi_exudyn.recording.cross_checks.check import Evidence, Finding

_LEG_SHARE: Final = 0.495
"""Length of thigh and shank over body height, (0.4222 + 0.4403) m of 1.741 m: de Leva (1996), men."""
_UNITS: Final = {"metres": 0.01, "millimetres": 10.0, "inches": 1.0 / 2.54, "feet": 1.0 / 30.48}
"""Factors by which lengths are wrong when they are written in another unit than centimetres."""


class CaptureSize:
    """Legs, or any other bone, that cannot belong to a skier of the stated height."""

    compares = "lengths of the capture's bones with the skier's height"

    def judge(self, evidence: Evidence) -> Sequence[Finding]:
        """Return a sure finding for bones of another unit or of someone else."""
        bvh, height = evidence.bvh, evidence.skier.height
        if bvh is None:
            return ()
        shafts = [bvh.index(side + part) for side in ("Left", "Right") for part in ("Leg", "Foot")]
        leg = 0.5 * float(np.sum(np.linalg.norm(bvh.offsets[shafts], axis=1)))
        ratio = leg / (_LEG_SHARE * height)
        path = evidence.files["motion"]
        # people's legs differ by 15 % of their share (three sigma); twice that leaves room for a rough skeleton
        if 0.7 < ratio < 1.3:
            bones = np.linalg.norm(bvh.offsets[1:], axis=1)
            if np.max(bones) <= height:
                return ()
            name = bvh.names[1 + int(np.argmax(bones))]
            problem = f"{np.max(bones):.3g} m do not fit a skier of {height:g} m"
            return (Finding(path, f"OFFSET of {name}", problem, "export the capture again", sure=True),)
        looks = [f": lengths look like {unit}" for unit, factor in _UNITS.items() if 0.7 < ratio / factor < 1.3]
        problem = f"legs of {leg:.3g} m do not fit a skier of {height:g} m{looks[0] if looks else ''}"
        fix = "export the capture in centimetres, or correct height_m"
        return (Finding(path, "OFFSET of the legs", problem, fix, sure=True),)
