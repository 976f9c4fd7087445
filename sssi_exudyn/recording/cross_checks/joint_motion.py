"""The capture against what joints can do: speeds, bends, and moving at all."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from sssi_exudyn.core.frames import Array
from sssi_exudyn.recording.cross_checks.check import Evidence, Finding
from sssi_exudyn.recording.instruments.bvh import LEGS, Bvh

_FASTEST: Final = float(np.deg2rad(1500.0))
"""Angular speed, rad/s, beyond every joint of the legs; knees of sprinters reach 900 °/s."""
_FROZEN: Final = 1.0
"""Time, s, for which a whole capture that does not change has stopped."""
_MOST_BENT: Final = float(np.deg2rad(165.0))
"""Largest bend of a skier's knees, rad."""


class JointMotion:
    """Joints that jump, knees that bend too far, and a capture that stopped."""

    compares = "speeds and bends of the legs' joints with those of people"

    def judge(self, evidence: Evidence) -> Sequence[Finding]:
        """Return doubts only: captures hold all kinds of errors for some frames, and are usable otherwise."""
        bvh = evidence.bvh
        if bvh is None or len(bvh.time) < 3:
            return ()
        path = evidence.files["motion"]
        speed = np.max([_speed(bvh, bvh.index(name)) for name in LEGS], axis=0)
        doubts = []
        if np.any(speed > _FASTEST):
            first, count = int(np.argmax(speed > _FASTEST)), int(np.count_nonzero(speed > _FASTEST))
            problem = f"joints of the legs turn faster than 1500 °/s {count} time(s), first at {bvh.time[first]:.2f} s"
            doubts.append(Finding(path, "", problem, "check the capture there"))
        bent = max(float(np.max(_angle(bvh.rotations[:, bvh.index(side + "Leg")]))) for side in ("Left", "Right"))
        if bent > _MOST_BENT:
            problem = f"the knees bend by up to {np.degrees(bent):.0f}°"
            doubts.append(Finding(path, "", problem, "check that angles are in degrees"))
        start, stop = _longest_rest(bvh)
        if stop - start > _FROZEN:
            problem = f"nothing moves from {start:.2f} to {stop:.2f} s: the capture stopped"
            doubts.append(Finding(path, "", problem, "cut it, or export it again"))
        return doubts


def _angle(rotations: Array) -> Array:
    return np.asarray(np.arccos(np.clip(0.5 * (np.trace(rotations, axis1=-2, axis2=-1) - 1.0), -1.0, 1.0)))


def _speed(bvh: Bvh, joint: int) -> Array:
    """Return a joint's angular speed (n - 1,) rad/s from frame to frame."""
    local = bvh.rotations[:, joint]
    return _angle(np.swapaxes(local[:-1], -1, -2) @ local[1:]) / np.diff(bvh.time)


def _longest_rest(bvh: Bvh) -> tuple[float, float]:
    """Return first and last time (s) of the longest stretch in which no joint turns."""
    moved = np.zeros(len(bvh.time) - 1, bool)
    for joint in range(len(bvh.names)):
        local = bvh.rotations[:, joint]
        moved |= np.any(local[1:] != local[:-1], axis=(1, 2))
    edges = np.r_[0, np.flatnonzero(moved) + 1, len(bvh.time)]
    longest = int(np.argmax(np.diff(edges)))
    return float(bvh.time[edges[longest]]), float(bvh.time[edges[longest + 1] - 1])
