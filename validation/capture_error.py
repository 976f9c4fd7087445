"""Errors of the feet in the tables of a simulation: turns about a foot's three axes, and its height."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.rotations import rotations_about
from sssi_exudyn.simulation.reduced.prepared import Prepared


@dataclass(frozen=True)
class CaptureError:
    """One error that the capture may have.

    kind : "roll", "pitch", "yaw" of a foot, or its "height"
    side : 0 left, 1 right;  support : centre and half-width of a hat in time (s); None for a constant
    """

    kind: str
    side: int
    support: tuple[float, float] | None

    def profile(self, time: Array) -> Array:
        """Return the error (n,) at ``time`` (n,), one where it is greatest."""
        if self.support is None:
            return np.ones(len(time))
        centre, width = self.support
        return np.maximum(0.0, 1.0 - np.abs(time - centre) / width)


def with_error(prepared: Prepared, error: CaptureError, size: complex) -> Prepared:
    """Return the tables of a capture that is wrong by ``size`` (rad or m) times the error's profile.

    A complex size carries a derivative.
    """
    offset = np.asarray(size * error.profile(prepared.time))
    rate = np.gradient(offset, prepared.time)
    if error.kind == "height":
        place, velocity = prepared.foot_place.astype(offset.dtype), prepared.foot_velocity.astype(offset.dtype)
        acceleration = prepared.foot_acceleration.astype(offset.dtype)
        place[:, error.side, 2] += offset
        velocity[:, error.side, 2] += rate
        acceleration[:, error.side, 2] += np.gradient(rate, prepared.time)
        return replace(prepared, foot_place=place, foot_velocity=velocity, foot_acceleration=acceleration)
    axis = prepared.foot_rotation[:, error.side, :, ("roll", "pitch", "yaw").index(error.kind)]
    rotation, spin = prepared.foot_rotation.astype(offset.dtype), prepared.foot_spin.astype(offset.dtype)
    rotation[:, error.side] = rotations_about(axis, offset) @ rotation[:, error.side]
    spin[:, error.side] += rate[:, None] * axis
    return replace(prepared, foot_rotation=np.ascontiguousarray(rotation), foot_spin=spin)
