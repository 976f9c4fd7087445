"""Boot and binding: where the ski is against the foot, and what the boot's cuff does to the shank.

A boot stands with the middle of its sole on the ski's mark; the ankle joint is behind that.  The cuff is a spring
between shank and foot, in flexion about the ankle's axis and in edging about the foot's long axis:

    M = −k (θ − θ₀)

θ the ankle's dorsiflexion, θ₀ the cuff's lean, at which it presses neither way.  In edging the foot cannot be seen to
turn in the boot: cuff and ankle share the moment by their stiffnesses.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from sssi_exudyn.core.frames import Array


def ski_on_foot(ramp_angle: float) -> Array:
    """(3, 3) the ski's frame in the foot's, whose toes point down against the ski by ``ramp_angle`` (rad)."""
    return np.asarray(Rotation.from_rotvec([0.0, -ramp_angle, 0.0]).as_matrix())
