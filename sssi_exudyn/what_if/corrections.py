"""How a skier departs from the captured posture: few ways, each slow, each with a scale and a limit.

A correction is a direction in the space of the 28 angles times cubic B-splines over the recorded clock.  The scale is
what a skier does without being noticed as another skier: it weighs corrections against each other.  Beyond the limit
the answer says that the run is not skiable like this.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Final

import numpy as np
from scipy.interpolate import BSpline, make_interp_spline

from sssi_exudyn.bodies.skier.chain import PRESCRIBED
from sssi_exudyn.core.frames import Array
from sssi_exudyn.fitting.posture_errors import PostureMap, angles_of, level_axes, spline_knots
from sssi_exudyn.simulation.heading import HEADING as _HEADING
from sssi_exudyn.simulation.posture_table import PostureTable

SPACING: Final = 0.25
"""s between the supports of corrections, which therefore follow changes of up to 2 Hz: people move as they intend up to
2 Hz where they have to follow something, up to 5 Hz where they know the movement (Brooks, IEEE Conf. Systems, Man and
Cybernetics (1990) 113)."""
MOST: Final = 120
"""Supports at most, however long the run: half a minute."""


@dataclass(frozen=True)
class Correction:
    """One way of departing from the captured posture.

    unit : of its size, ``rad`` or ``m``
    scale : of a size that is usual among runs of one skier
    limit : largest size that counts as skiable; None where the snow decides how large it is
    meaning : with the direction of positive sizes
    source : of scale and limit
    departs : what a skier does whose correction is large, as a clause with its size
    angles : of a posture, the angles (n, 28) that a unit of the correction adds to it
    starts : whether the run may start with it, as with a lean.  Feet start as recorded, since the speed at the start is
        the recorded one: turned against it, they would brake at once.
    """

    name: str
    unit: str
    scale: float
    limit: float | None
    meaning: str
    source: str
    departs: str
    angles: Callable[[PostureTable], Array]
    starts: bool = False

    @property
    def in_files(self) -> tuple[str, float]:
        """Return the unit in files, and the factor from SI to it."""
        return ("deg", float(np.degrees(1.0))) if self.unit == "rad" else (self.unit, 1.0)


def _feet(kind: str, left: float, right: float, posture: PostureTable) -> Array:
    """Return the angles (n, 28) that make a unit of a kind of the feet's errors, with a sign each."""
    return np.asarray(left * angles_of(kind, 0, posture) + right * angles_of(kind, 1, posture))


def _turn(posture: PostureTable) -> Array:
    """Return the angles (n, 28) of a unit turn of the whole body about gravity."""
    angles = np.zeros((len(posture.time), len(PRESCRIBED)))
    angles[:, _HEADING] = 1.0
    return angles


def _lean(posture: PostureTable) -> Array:
    """Return the angles (n, 28) of a unit roll of the whole body about its skis' mean heading within the slope.

    It turns no ski to either side.  One leg stretches and the other bends so that both feet stay on the snow: a body
    that is stiff would shift its load from one ski to the other instead.
    """
    way = level_axes(posture.foot_rotation.mean(axis=1))[:, :, 0]
    columns = [PRESCRIBED.index(f"pelvis_{name}") for name in ("rotation", "list", "tilt")]
    angles = np.zeros((len(posture.time), len(PRESCRIBED)))
    turning = posture.foot_turning[:, 0][:, :, columns]
    angles[:, columns] = np.linalg.solve(turning, way[..., None])[..., 0]
    rise = np.einsum("nsk,nk->ns", posture.foot_jacobian[:, :, 2], angles)
    stretch = rise.mean(axis=1, keepdims=True) - rise
    for side in range(2):
        angles += stretch[:, side, None] * angles_of("height", side, posture)
    return angles


_DEGREE: Final = float(np.radians(1.0))
LEAN: Final = Correction(
    "lean", "rad", 5.0 * _DEGREE, 20.0 * _DEGREE,
    "lean of the whole body about the direction of the skis, positive to the right",
    "chosen: scale, as simulate --balanced; limit, a third of the 60 degrees that racers lean",
    "he leans {} to the side of where he was",
    _lean,
    starts=True,
)  # fmt: skip
FORE_AFT: Final = Correction(
    "fore_aft", "m", 0.04, 0.16,
    "place of the body over the feet, positive forward",
    "limit: the pressure's centre stays within half of a boot sole of 0.32 m; scale: chosen, a quarter of it",
    "his body is {} before or behind where it was over the feet",
    partial(_feet, "forward", -1.0, -1.0),
    starts=True,
)  # fmt: skip
STEERING: Final = Correction(
    "steering", "rad", 4.0 * _DEGREE, 20.0 * _DEGREE,
    "turn of both feet by the legs, positive to the left",
    "chosen: limit, less than half of the hip's rotation of some 45 degrees; scale, a fifth of it",
    "he turns his feet {} from where they pointed",
    partial(_feet, "yaw", 1.0, 1.0),
)  # fmt: skip
PLOUGH: Final = Correction(
    "plough", "rad", 4.0 * _DEGREE, 20.0 * _DEGREE,
    "turn of the feet against each other by the legs, positive with the tips together",
    "as steering",
    "his wedge is {} wider or narrower",
    partial(_feet, "yaw", -1.0, 1.0),
)  # fmt: skip
EDGING: Final = Correction(
    "edging", "rad", 3.0 * _DEGREE, 15.0 * _DEGREE,
    "roll of both feet under the body by knees and hips, positive to the right edge",
    "chosen: limit, half of the hip's adduction of some 30 degrees; scale, a fifth of it",
    "he rolls his skis {} from where they were under him",
    partial(_feet, "roll", 1.0, 1.0),
)  # fmt: skip
HEADING: Final = Correction(
    "heading", "rad", 20.0 * _DEGREE, None,
    "turn of the whole skier about gravity as the snow's moment demands, positive to the left",
    "chosen: scale, so large that it hardly weighs against the moment about gravity, which decides it",
    "he heads {} to the side of where he did",
    _turn,
)  # fmt: skip


class Supports:
    """Cubic B-splines over the recorded clock from ``start`` to ``stop`` (s), which follow whatever changes over
    ``SPACING`` and are zero before ``begin`` (s).  Where that leaves none, the last one stays.

    count : number of splines;  begins : (count,) s, from when on they are other than zero
    """

    def __init__(self, start: float, stop: float, begin: float) -> None:
        self.knots = spline_knots(start, stop, SPACING, MOST)
        every = len(self.knots) - 4
        first = 0 if begin <= start else min(int(np.searchsorted(self.knots, begin)), every - 1)
        self._coefficients = np.eye(every)[:, first:]
        self.count = every - first
        self.begins = self.knots[first:every]
        self._of_start = 3 if first == 0 else 0

    def at(self, recorded: Array) -> Array:
        """Return the splines (n, k) at instants (n,) of the recorded clock (s), as at the ends beyond them."""
        inside = np.clip(recorded, self.knots[3], self.knots[-4])
        return np.asarray(BSpline(self.knots, self._coefficients, 3)(inside))

    def of(self, correction: Correction) -> Array:
        """Return factors (k,) on a correction's splines: its scale, or 0 for those that move a start without it."""
        factors = np.full(self.count, correction.scale)
        if not correction.starts:
            factors[: self._of_start] = 0.0
        return factors


class Directions:
    """The directions of corrections along a recorded posture."""

    def __init__(self, corrections: tuple[Correction, ...], recorded: PostureMap) -> None:
        self._splines = [
            make_interp_spline(recorded.grid, correction.angles(recorded.posture), k=3) for correction in corrections
        ]

    def at(self, recorded: Array) -> Array:
        """Return the angles (c, n, 28) of a unit of each correction at instants (n,) of the recorded clock (s)."""
        if not self._splines:
            return np.zeros((0, len(recorded), len(PRESCRIBED)))
        return np.stack([np.asarray(spline(recorded)) for spline in self._splines])
