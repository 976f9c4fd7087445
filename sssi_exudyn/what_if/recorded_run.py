"""The recorded run as a what-if takes it: the movement as it was, with every correction of the capture in it.

A fit corrects posture, heading and antenna.  Here these corrections are part of the movement and the model starts with
its pelvis, so that the movement can be played at another pace and no fault of an instrument goes along with it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np
from scipy.interpolate import make_interp_spline

from sssi_exudyn.bodies.skier.chain import PRESCRIBED
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.frames import Array
from sssi_exudyn.model.heading import REPLAY
from sssi_exudyn.model.model import Model
from sssi_exudyn.motion.motion import Motion, spline_motion
from sssi_exudyn.results.folder import SKELETON
from sssi_exudyn.results.stored import StoredRun

NODES: Final = 0.01
"""s between the instants through which a movement's splines go: captures are filtered at 6 Hz."""
_SHORTEST: Final = 2.0
"""s; the shortest run of which a what-if is asked: one turn."""


@dataclass(frozen=True)
class RecordedRun:
    """A recorded run without faults of its instruments.

    model : as fitted; it starts with the pelvis' place and velocity, and has no posture correction and no sensors
    motion : the corrected movement
    snow_turns : whether the snow decides the heading of a run that differs from this one
    """

    model: Model
    motion: Motion
    snow_turns: bool = False

    def until(self, stop: float) -> RecordedRun:
        """Return the run up to ``stop`` (s), or all of it where it is shorter."""
        return replace(self, motion=replace(self.motion, stop=min(stop, self.motion.stop)))


def recorded_run(stored: StoredRun, folder: Path) -> RecordedRun:
    """Return the run of the result in ``folder``.  A heading that was found is part of its movement.

    Raises InputError for a result without a skeleton, and one that is too short.
    """
    if stored.geometry is None:
        raise InputError(folder / SKELETON, "", "the result has no skeleton", "fit the recording again")
    time = stored.time
    if time[-1] - time[0] < _SHORTEST:
        raise InputError(folder, "", f"the run lasts less than {_SHORTEST:g} s", "use a longer run")
    start = replace(
        stored.model.start,
        **_place_and_velocity(stored),
        heading_offset=0.0,
        clock_offset=0.0,
    )
    angles = np.radians(stored.series[[f"{name}_deg" for name in PRESCRIBED]].to_numpy(dtype=float))
    nodes = nodes_of(float(time[0]), float(time[-1]))
    smooth = np.asarray(make_interp_spline(time, angles, k=5)(nodes))
    motion = spline_motion(stored.geometry, stored.model.inclination, nodes, smooth)
    model = replace(stored.model, posture=None, sensors=(), start=start, heading=REPLAY)
    return RecordedRun(model, motion, stored.model.heading.is_found)


def nodes_of(start: float, stop: float) -> Array:
    """Return the instants (n,) s through which the splines of a movement from ``start`` to ``stop`` (s) go."""
    return np.linspace(start, stop, max(6, round((stop - start) / NODES) + 1))


def _place_and_velocity(stored: StoredRun) -> dict[str, float]:
    """Return place (m) and velocity (m/s) of the pelvis at the start, by the names that ``Start`` has for them."""
    place, velocity = stored.slope("pelvis", "m")[0], stored.slope("pelvis_velocity", "mps")[0]
    names = ("f", "l", "velocity_f", "velocity_l")
    return dict(zip(names, (*place[:2].tolist(), *velocity[:2].tolist()), strict=True))
