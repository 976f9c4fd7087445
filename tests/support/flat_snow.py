"""What level snow does to both skis, for results that are made by hand."""

from __future__ import annotations

import numpy as np

from sssi_exudyn.core.frames import Array
from sssi_exudyn.simulation.result import SnowWrench


def flat_snow(load: Array, friction: Array) -> SnowWrench:
    """The wrench of loads (n, 2) N along the slope's normal and friction (n, 2, 3) N, both at the feet's places."""
    normal = np.broadcast_to([0.0, 0.0, 1.0], friction.shape)
    return SnowWrench(friction + load[..., None] * normal, np.zeros_like(friction), normal)
