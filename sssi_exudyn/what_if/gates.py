"""Gates that stand elsewhere: another path in place of the recorded one.

The path is scaled from its start, by ``distance`` down the fall line and by ``offset`` across it.  At each place the
whole posture turns with the path about the snow's normal.  The movement takes as much more time as the path is longer,
so that without a reaction the skier has the recorded speed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import make_lsq_spline
from scipy.spatial.transform import Rotation

from sssi_exudyn.bodies.skier.chain import PRESCRIBED
from sssi_exudyn.core.frames import Array, slope_to_level
from sssi_exudyn.core.rotations import rotations_about
from sssi_exudyn.fitting.posture_errors import spline_knots
from sssi_exudyn.model.model import Start
from sssi_exudyn.simulation.reduced.prepared import ReducedRun
from sssi_exudyn.what_if.corrections import MOST, SPACING
from sssi_exudyn.what_if.intent import MOMENT, PLACE

_PELVIS = [PRESCRIBED.index(f"pelvis_{name}") for name in ("rotation", "list", "tilt")]


@dataclass(frozen=True)
class Gates:
    """Where gates stand: factors on the recorded path, seen from its start.

    distance : from gate to gate down the fall line;  offset : across it
    """

    distance: float = 1.0
    offset: float = 1.0

    @property
    def moved(self) -> bool:
        """Tell whether the path is another one."""
        return (self.distance, self.offset) != (1.0, 1.0)


@dataclass(frozen=True)
class MovedPath:
    """The path that a skier intends, at instants of the recorded clock.

    start : (2,) m, of the recorded path and of this one;  scale : (2,) factors along f and l
    time : (n,) s;  turned : (n,) rad to the left of the recorded path;  slower : (n,) logarithm of its length a metre
        of the recorded one

    ``turned`` and ``slower`` follow the path as fast as people move.
    """

    start: Array
    scale: Array
    time: Array
    turned: Array
    slower: Array

    def figures(self, recorded: Array, samples: Array) -> Array:
        """Return the figures (n, ``FIGURES``, …) of the recorded run at ``samples`` (n,) s, or derivatives of them, as
        they are on this path.
        """
        moved = recorded.copy()
        tail = (1,) * (recorded.ndim - 2)
        place, moment = recorded[:, PLACE], recorded[:, MOMENT]
        origin = self.start.reshape(2, *tail) if recorded.ndim == 2 else 0.0
        moved[:, PLACE] = origin + self.scale.reshape(2, *tail) * (place - origin)
        angle = np.interp(samples, self.time, self.turned).reshape(-1, *tail)
        s, c = np.sin(angle), np.cos(angle)
        moved[:, MOMENT.start] = c * moment[:, 0] - s * moment[:, 1]
        moved[:, MOMENT.start + 1] = s * moment[:, 0] + c * moment[:, 1]
        return moved

    def way(self, recorded: Array) -> Array:
        """Return the directions (n, 2) of this path where the recorded one has ``recorded`` (n, 2)."""
        scaled = self.scale * recorded
        return np.asarray(scaled / np.linalg.norm(scaled, axis=1, keepdims=True))

    def posture(self, angles: Array, inclination: float) -> Array:
        """Return recorded angles (n, 28) rad at ``time``, turned with this path."""
        level = slope_to_level(inclination)
        recorded = Rotation.from_euler("ZXY", angles[:, _PELVIS] * (1.0, 1.0, -1.0)).as_matrix()
        turns = level @ rotations_about(np.array([0.0, 0.0, 1.0]), self.turned) @ level.T
        pelvis = Rotation.from_matrix(turns @ recorded).as_euler("ZXY") * (1.0, 1.0, -1.0)
        change = pelvis - angles[:, _PELVIS]
        posture = angles.copy()
        posture[:, _PELVIS] += (change + np.pi) % (2.0 * np.pi) - np.pi
        return posture

    def begin(self, start: Start) -> Start:
        """Return the start in the direction of this path, as fast as recorded."""
        s, c = np.sin(self.turned[0]), np.cos(self.turned[0])
        f, l = start.velocity_f, start.velocity_l  # noqa: E741  the slope frame's name of the axis
        return replace(start, velocity_f=float(c * f - s * l), velocity_l=float(s * f + c * l))

    def by_recorded_start(self, asked: Array, names: Sequence[str]) -> Array:
        """Return derivatives (…, k) by the recorded run's numbers from those by the numbers of ``begin``."""
        if not {"start.velocity_f", "start.velocity_l"} <= set(names):
            return asked
        f, l = names.index("start.velocity_f"), names.index("start.velocity_l")  # noqa: E741  as above
        s, c = np.sin(self.turned[0]), np.cos(self.turned[0])
        turned = asked.copy()
        turned[..., f] = c * asked[..., f] + s * asked[..., l]
        turned[..., l] = c * asked[..., l] - s * asked[..., f]
        return turned


def moved_path(gates: Gates, recorded: ReducedRun, time: Array) -> MovedPath:
    """Return the path between gates that are moved, at instants ``time`` (n,) s of a recorded run."""
    scale = np.array([gates.distance, gates.offset])
    velocity = recorded.com_velocity[:, :2]
    scaled = scale * velocity
    across = velocity[:, 0] * scaled[:, 1] - velocity[:, 1] * scaled[:, 0]
    turned = np.arctan2(across, np.sum(velocity * scaled, axis=1))
    slower = np.log(np.linalg.norm(scaled, axis=1) / np.linalg.norm(velocity, axis=1))
    first, last = recorded.time[[0, -1]]
    inside = spline_knots(first, last, SPACING, MOST)[4:-4]
    knots = np.concatenate([np.full(4, first), inside, np.full(4, last)])
    smooth = make_lsq_spline(recorded.time, np.column_stack([turned, slower]), knots, k=3)(time)
    return MovedPath(recorded.com[0, :2].copy(), scale, time, smooth[:, 0], smooth[:, 1])
