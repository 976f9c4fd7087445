"""What the skier keeps: which figures of the run stay as recorded, and by which corrections he keeps them.

At samples j of the recorded clock the run has the figures of ``FIGURES``, and each intent weighs how they differ from
the recorded run's.  Where nothing is changed all differences are zero, and so are the corrections.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from sssi_exudyn.analysis.biomechanics import WEDGE_DEG
from sssi_exudyn.core.choices import Keep
from sssi_exudyn.core.frames import Array
from sssi_exudyn.what_if.corrections import EDGING, FORE_AFT, HEADING, LEAN, PLOUGH, STEERING, Correction

PLACE, MOMENT, EDGE, SPEED = slice(0, 2), slice(2, 5), slice(5, 7), slice(7, 8)
FIGURES: Final = 8
"""Place of the centre of mass along f and l (m), residual moment (3, N m, averaged over ``BALANCE_TIME``), edge angles
(2, rad), speed (m/s)."""
SAMPLING: Final = 0.1
"""s between samples."""
BALANCE_TIME: Final = 0.33
"""s over which residual moments are averaged: what is over sooner hardly moves a body.  One that nothing holds falls
away from its feet as exp(t/τ), τ = √(l/g), l = 1.2 times a leg of 0.9 m (Hof, Gazendam, Sinke, J. Biomech. 38 (2005)
1)."""
ALONG_SIGMA: Final = 0.01
"""m along the path by which place and pace may disagree: they are one and the same."""
PATH_SIGMA: Final = 0.25
"""m across the path: chosen, half of the distance between a skier's feet.  How closely skiers repeat a path has no
source here, so the answer says what a stricter one takes."""
STRICT_PATH_SIGMA: Final = 0.1
"""m across the path of a stricter skier: chosen, the width of a ski."""
MOMENT_SIGMA: Final = 10.0
"""N m by which the averaged residual moment may differ from the recorded run's: chosen, the weight of a skier of 78 kg
13 mm from where the snow bears it."""
TURNING_SIGMA: Final = 2.0
"""N m of the same about the slope's normal where the snow decides the heading: 0.06 degrees of the two springs of 1000
N m/rad in which skis yaw below the feet, so that the heading is what the snow makes it."""
EDGE_SIGMA: Final = float(np.radians(1.0))
"""rad; captures see edge angles no better."""
SPEED_SIGMA: Final = 0.1
"""m/s; noise of a receiver's speed."""
LOOK_AHEAD: Final = 1.5
"""s before a change is met at which the skier may begin to react to it: riders in a slalom look at the next gate once
the nearest is 1.5 s away (Wilkie, Wann, Allison, J. Exp. Psychol. Hum. Percept. Perform. 34 (2008) 1150)."""
NOTICED: Final = 0.1
"""Standard deviations of what is kept by which a run differs where the change is met."""
SETTLING: Final = 0.3
"""s at both ends in which moments are not weighed: the skier settles, and splines end."""
_BODY: Final = (LEAN, FORE_AFT)


@dataclass(frozen=True)
class Intent:
    """What is kept.

    corrections : by which the skier keeps it;  paced : whether he comes along later or earlier
    meaning : for the result and the guide
    """

    corrections: tuple[Correction, ...]
    paced: bool
    meaning: str


INTENTS: Final[Mapping[Keep, Intent]] = {
    "movement": Intent((), False, "the recorded movement, whatever comes of it"),
    "path": Intent((*_BODY, STEERING), True, "the recorded path; the speed along it is free"),
    "line": Intent((*_BODY, STEERING), True, "the recorded path, as fast as the limits let him"),
    "rhythm": Intent((*_BODY, STEERING, EDGING), False, "turn times and edge angles; the path is free"),
    "speed": Intent((*_BODY, STEERING, EDGING), False, "the recorded speed at each instant; the path is free"),
}


def intent_of(keep: Keep, between_skis: float, *, snow_turns: bool = False) -> Intent:
    """Return what is kept by a skier whose skis make an angle of ``between_skis`` (rad, mean over the run).

    A skier in a wedge keeps his speed by its width; skis that are parallel are skidded more or less.

    snow_turns : whether the snow decides the heading: the skier then steers by the edge angle
    """
    intent = INTENTS[keep]
    if snow_turns:
        return replace(intent, corrections=(*_BODY, STEERING, EDGING, HEADING))
    if keep == "speed" and np.degrees(between_skis) >= WEDGE_DEG:
        return replace(intent, corrections=(*_BODY, STEERING, PLOUGH))
    return intent


def weights_of(
    keep: Keep, samples: Array, way: Array, path_sigma: float = PATH_SIGMA, *, snow_turns: bool = False
) -> Array:
    """Return the weights (n, r, ``FIGURES``) of differences at ``samples`` (n,) s of the recorded clock.

    way : (n, 2) directions of the recorded path;  path_sigma : m across it
    snow_turns : whether the snow decides the heading
    """
    inner = (samples >= samples[0] + SETTLING) & (samples <= samples[-1] - SETTLING)
    moments = np.zeros((len(samples), 3, FIGURES))
    moments[:, range(3), range(MOMENT.start, MOMENT.stop)] = inner[:, None] / MOMENT_SIGMA
    if snow_turns:
        moments[samples >= samples[0] + SETTLING, 2, MOMENT.stop - 1] = 1.0 / TURNING_SIGMA
    kept = np.zeros((len(samples), 2, FIGURES))
    if keep in ("path", "line"):
        kept[:, 0, PLACE] = way / ALONG_SIGMA
        kept[:, 1, PLACE] = np.column_stack([-way[:, 1], way[:, 0]]) / path_sigma
    elif keep == "rhythm":
        kept[:, range(2), range(EDGE.start, EDGE.stop)] = 1.0 / EDGE_SIGMA
    elif keep == "speed":
        kept[:, 0, SPEED] = 1.0 / SPEED_SIGMA
    return np.concatenate([kept, moments], axis=1)
