"""Boot and binding: where the ski is against the foot, and what the boot's cuff does to the shank.

A boot stands with the middle of its sole on the ski's mark; the ankle joint is behind that.  The cuff is a spring
between shank and foot, next to the muscles.  It takes part of the moment M of a joint that inverse dynamics finds:

    flexion:  M = −k (θ − θ₀) + muscles      θ dorsiflexion, θ₀ the cuff's lean, at which it presses neither way
    edging:   cuff's part = M k / (k + k_a)  about the foot's long axis, along which no turn of the ankle in the boot is
                                             captured: cuff and ankle (k_a) share the moment by their stiffnesses

Cuffs that are not stated are estimated as those under which the muscles have least to do, with a prior from usual
cuffs.  With muscle moments of standard deviation σ that are independent after a time τ, the estimate minimises

    Σ (M + k (θ − θ₀))² τ/(σ² Δt)  +  ((k − k_u)/s)²

over both ankles.  Each ankle has a lean of its own, as each foot's sensor has its own zero.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.spatial.transform import Rotation

from sssi_exudyn.bodies.skier.chain import Geometry
from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.quantity import quantity

_PER_DEGREE: Final = float(np.degrees(1.0))
_ESTIMATE: Final = "estimate; no standard says what a flex index is in N m"
USUAL_SPREAD: Final = 2.0 * _PER_DEGREE
"""N m/rad; standard deviation of cuffs' stiffness in flexion about the usual one: soft to race boots."""
SOFTEST: Final = 0.5 * _PER_DEGREE
"""N m/rad; no buckled boot is softer."""
ANKLE_EDGING: Final = 40.0
"""N m/rad; stiffness of an ankle in inversion and eversion, muscles a little active: estimate; relaxed it is below 20
(Lee et al., J. Biomech. 44 (2011) 1901).
"""
_MUSCLES: Final = 0.5
"""N m/kg; standard deviation of the moment that the muscles of an ankle in a boot make."""
_MEMORY: Final = 1.0
"""s after which the muscles' moment is independent of its past."""


@dataclass(frozen=True)
class Cuff:
    """Properties of a boot's cuff that are estimated where they are not stated."""

    cuff_flexion: float = quantity(
        4.0 * _PER_DEGREE, "N m/rad", low=0.0, high=40.0 * _PER_DEGREE, source=_ESTIMATE,
        meaning="stiffness of the boot's cuff in flexion",
    )  # fmt: skip
    cuff_lean: float = quantity(
        0.0, "rad", low=-0.7, high=0.7, source="estimated from the run",
        meaning="captured dorsiflexion at which the cuff presses neither way",
    )  # fmt: skip


@dataclass(frozen=True)
class FoundCuffs:
    """The cuffs of both boots.

    stiffness : N m/rad in flexion;  se : its standard error, 0 where it was stated
    lean : (2,) rad of the left and the right one
    """

    stiffness: float
    se: float
    lean: Array

    def moment(self, angle: Array) -> Array:
        """Return the moment (n, 2) N m that the cuffs exert on the ankles' dorsiflexion at ``angle`` (n, 2) rad."""
        return np.asarray(-self.stiffness * (angle - self.lean))


def ski_on_foot(ramp_angle: float) -> Array:
    """Return the rotation (3, 3) of the ski's frame in the foot's.

    The toes point down against the ski by ``ramp_angle`` (rad).
    """
    return np.asarray(Rotation.from_rotvec([0.0, -ramp_angle, 0.0]).as_matrix())


def seat_of_ski(geometry: Geometry, calcaneus: int, boot_centre: float, ramp_angle: float) -> tuple[Array, Array]:
    """Return place (3,) m and attitude (3, 3) in a calcaneus of the ski's frame, under the boot's centre on the base.

    Parameters
    ----------
    calcaneus : index of the segment, one of ``FEET``
    boot_centre : m from the ankle forward along the ski to the middle of the boot's sole
    ramp_angle : rad by which the foot's toes point down against the ski
    """
    ramp = ski_on_foot(ramp_angle)
    sole = ramp @ np.array([boot_centre, 0.0, -geometry.ankle_to_ski_base])
    # the ankle, from which the sole is measured along the foot's axes, is the talus' origin
    heel = geometry.attitude_in_parent[calcaneus].T @ geometry.joint_in_parent[calcaneus]
    return sole - heel, ramp


def find_cuffs(
    time: Array, angle: Array, moment: Array, skier_mass: float, stiffness: float | None, lean: float | None
) -> FoundCuffs:
    """Find the cuffs of a run: stated properties are kept, the others are estimated as the module describes.

    Parameters
    ----------
    time : (n,) s
    angle, moment : (n, 2) rad, N m of dorsiflexion, left and right
    skier_mass : kg
    stiffness, lean : N m/rad, rad as stated, or None
    """
    middle = angle.mean(axis=0) if lean is None else np.full(2, lean)
    steady = moment.mean(axis=0) if lean is None else np.zeros(2)
    se = 0.0
    if stiffness is None:
        usual = Cuff().cuff_flexion
        count_weight = max(float(time[-1] - time[0]), _MEMORY) / _MEMORY / (_MUSCLES * skier_mass) ** 2
        bend, moment_change = angle - middle, moment - steady
        information = count_weight * float(np.mean(bend**2, axis=0).sum())
        precision = information + USUAL_SPREAD**-2
        pull = -count_weight * float(np.mean(bend * moment_change, axis=0).sum())
        stiffness = max((pull + usual * USUAL_SPREAD**-2) / precision, SOFTEST)
        se = precision**-0.5
    if lean is None and stiffness > 0.0:
        middle = middle + steady / stiffness
    return FoundCuffs(stiffness, se, middle)


def edging_share(cuff_edging: float) -> float:
    """Return the share of an ankle's moment that a cuff of stiffness ``cuff_edging`` (N m/rad) takes.

    Both moments are about the foot's long axis.
    """
    return cuff_edging / (cuff_edging + ANKLE_EDGING)
