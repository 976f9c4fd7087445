"""Force of a muscle's fibres by length and speed, with a rigid tendon: the curves of De Groote et al. (2016).

F. De Groote, A. L. Kinney, A. V. Rao & B. J. Fregly, "Evaluation of direct collocation optimal control problem
formulations for solving the muscle redundancy problem", Ann. Biomed. Eng. 44 (2016) 2922-2936.  Numbers are those of
its supplement in the form that OpenSim's DeGrooteFregly2016Muscle gives them: the active curve has its maximum of 1 at
the optimal length, and fibres as fast as they can give no force.

Passive forces are left out, as in OpenSim's static optimisation.  With a rigid tendon the fibres would take the whole
of a stretch, of which a real tendon takes a good part, and passive force grows with it exponentially.

A fibre of length l and pennation α keeps its width l sin α.  With a rigid tendon the muscle's length L leaves
l cos α = L − tendon slack length to the fibre.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from sssi_exudyn.core.frames import Array

_ACTIVE: Final = (
    (0.8150671134243542, 1.055033428970575, 0.162384573599574, 0.063303448465465),
    (0.433004984392647, 0.716775413397760, -0.029947116970696, 0.200356847296188),
    (0.1, 1.0, 0.353553390593274, 0.0),
)
_D1, _D2, _D3, _D4 = -0.3211346127989808, -8.149, -0.374, 0.8825327733249912
SHORTEST: Final = 0.2
"""Least length of a fibre, in optimal ones, for which the curves are meant; a muscle's path may leave it shorter."""
FASTEST: Final = 10.0
"""Optimal fibre lengths a second: the greatest speed of shortening (De Groote et al. 2016; Zajac 1989)."""


@dataclass(frozen=True)
class Fibres:
    """Force and state of muscle fibres, arrays (…).

    force : N along the tendon at full activation; in proportion to it at less
    length : in optimal fibre lengths
    speed : in greatest speeds, positive when lengthening
    """

    force: Array
    length: Array
    speed: Array


def force_length(length: Array) -> Array:
    """Return the active force by normalised fibre length: Σ b1 exp(−½ (l − b2)² / (b3 + b4 l)²)."""
    return np.asarray(
        sum(b1 * np.exp(-0.5 * (length - b2) ** 2 / (b3 + b4 * length) ** 2) for b1, b2, b3, b4 in _ACTIVE)
    )


def force_velocity(speed: Array) -> Array:
    """Return the factor by normalised speed, within fibres' range: d1 ln(d2 v + d3 + sqrt((d2 v + d3)² + 1)) + d4."""
    return np.asarray(_D1 * np.arcsinh(_D2 * np.clip(speed, -1.0, 1.0) + _D3) + _D4)


def fibres(
    length: Array, speed: Array, greatest: Array, optimal: Array, tendon_slack: Array, pennation: Array
) -> Fibres:
    """Compute the fibres of muscles whose whole length is ``length`` (…, m) m and lengthens by ``speed`` (…, m) m/s.

    greatest, optimal, tendon_slack, pennation : (m,) N, m, m, rad (at the optimal length)
    """
    width = optimal * np.sin(pennation)
    along = np.maximum(length - tendon_slack, SHORTEST * optimal * np.cos(pennation))
    fibre = np.hypot(along, width)
    cosine = along / fibre
    normal, quick = fibre / optimal, speed * cosine / (FASTEST * optimal)
    return Fibres(
        force=greatest * force_length(normal) * force_velocity(quick) * cosine,
        length=normal,
        speed=quick,
    )
