"""The angles of a limb from captured poses, by weighted least squares for all frames at once.

For the joints of a limb with angles θ the residual stacks the rotation vectors log(R_modelᵀ R_captured) of the segments
and the difference of places of the last joint.  Each is divided by its standard deviation.  Gauss-Newton solves
(JᵀJ) Δθ = −Jᵀr frame by frame in one batch; J is analytic.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from sssi_exudyn.bodies.skier.chain import Axis, Joint, joint_rotation, rotate_about_own
from sssi_exudyn.core.frames import Array

_ITERATIONS: Final = 50
_STEP: Final = 0.5
"""Longest step of an angle, rad, so that a wild frame does not jump to another branch."""
_CONVERGED: Final = 1e-12
"""Step below which the iteration has converged, rad."""
_DAMPING: Final = 1e-12
"""Damping added to JᵀJ, relative to its mean diagonal: in gimbal lock one direction is undetermined."""


@dataclass(frozen=True)
class LimbPose:
    """Rotations (n, k, 3, 3) and origins (n, k, 3) of a limb's segments in its base frame, and its axes (n, c, 3)."""

    rotation: Array
    origin: Array
    axes: Array


@dataclass(frozen=True)
class Limb:
    """A chain of k joints with c angles in all, and its captured poses in n frames, in its base segment's frame.

    offset : (k, 3) m, each joint in its parent's frame
    rotation : (n, k, 3, 3) captured, segment → base
    rotation_sigma : (k, 3) rad, about the segment's own x, y, z; infinite: not compared
    attitude : (k, 3, 3) constant rotation of each joint's frame in its parent's
    place : (n, 3) m of the last joint, or None: not compared
    place_sigma : m
    """

    joints: tuple[Joint, ...]
    offset: Array
    attitude: Array
    rotation: Array
    rotation_sigma: Array
    place: Array | None = None
    place_sigma: float = 1.0

    def in_frames(self, frames: NDArray[np.int64]) -> Limb:
        """Return the limb as captured in some of the frames, by their indices."""
        return replace(self, rotation=self.rotation[frames], place=None if self.place is None else self.place[frames])

    def by_segment(self, angles: Array) -> dict[str, Array]:
        """Return the angles (…, c) by segment, (…, c_segment)."""
        ends = np.cumsum([len(joint.rotations) for joint in self.joints])[:-1]
        parts = np.split(angles, ends, axis=-1)
        return {joint.segment: part for joint, part in zip(self.joints, parts, strict=True)}

    def pose(self, angles: Array) -> LimbPose:
        """Return the limb's pose for angles (n, c)."""
        current, place = np.broadcast_to(np.eye(3), (len(angles), 3, 3)), np.zeros((len(angles), 3))
        rotation, origin, axes = [], [], []
        parts = self.by_segment(angles).values()
        for joint, offset, attitude, part in zip(self.joints, self.offset, self.attitude, parts, strict=True):
            place = place + current @ offset
            current = current @ attitude
            for column, (_, axis) in enumerate(joint.rotations):
                axes.append(current @ np.array(axis))
                current = rotate_about_own(current, axis, part[:, column])
            rotation.append(current)
            origin.append(place)
        return LimbPose(np.stack(rotation, axis=1), np.stack(origin, axis=1), np.stack(axes, axis=1))


def tait_bryan(rotation: Array, axes: tuple[int, int, int]) -> Array:
    """Return the angles (…, 3) with R = R_i(a) R_j(b) R_k(c), for three different axes; the middle one in [−π/2, π/2].

    The last angles come from the rotation that remains after the first, so the triple gives R also in gimbal lock.
    """
    i, j, k = axes
    parity = 1.0 if (j - i) % 3 == 1 else -1.0
    a = np.arctan2(-parity * rotation[..., j, k], rotation[..., k, k])
    cosine, sine = np.cos(a)[..., None], np.sin(a)[..., None]
    row_j = cosine * rotation[..., j, :] + parity * sine * rotation[..., k, :]
    row_k = cosine * rotation[..., k, :] - parity * sine * rotation[..., j, :]
    b = np.arctan2(parity * rotation[..., i, k], row_k[..., k])
    c = np.arctan2(parity * row_j[..., i], row_j[..., j])
    return np.stack([a, b, c], axis=-1)


def unwrap_angles(angles: Array) -> Array:
    """Remove jumps from Tait-Bryan angles (n, 3): each frame takes the equivalent triple nearest to the frame before.

    (a, b, c) and (a + π, π − b, c + π) are the same rotation, as are angles that differ by whole turns.
    """
    other = np.stack([angles[:, 0] + np.pi, np.pi - angles[:, 1], angles[:, 2] + np.pi], axis=-1)

    def distance(step: Array) -> Array:
        """Return squares of the least differences that are ``step`` (n, 3) but for whole turns."""
        return np.asarray(np.sum((step - _whole_turns(step)) ** 2, axis=-1))

    # from either triple of the frame before, the way to the like triple is as far, and that to the other one
    changes = distance(other[1:] - angles[:-1]) < distance(angles[1:] - angles[:-1])
    is_other = np.concatenate([[False], np.cumsum(changes) % 2 == 1])
    out = np.where(is_other[:, None], other, angles)
    out[1:] -= np.cumsum(_whole_turns(np.diff(out, axis=0)), axis=0)
    return out


def _whole_turns(angles: Array) -> Array:
    """Return the whole turns (rad) that are nearest to angles."""
    return np.asarray(2.0 * np.pi * np.round(angles / (2.0 * np.pi)))


def ball_joint_angles(joint: Joint, rotation: Array) -> Array:
    """Return the three angles (n, 3) of a joint with three rotations from its rotation (n, 3, 3).

    They are continuous over time.
    """
    directions = np.array([axis for _, axis in joint.rotations])
    first, second, third = (int(index) for index in np.argmax(np.abs(directions), axis=1))
    return unwrap_angles(tait_bryan(rotation, (first, second, third)) * directions.sum(axis=1))


def turn_about(axis: Axis, rotation: Array) -> Array:
    """Return the part (n,) rad about ``axis`` of rotations (n, 3, 3), continuous over time.

    It is the angle of a hinge with that axis.
    """
    quaternion = Rotation.from_matrix(rotation).as_quat()
    return np.asarray(np.unwrap(2.0 * np.arctan2(quaternion[:, :3] @ np.array(axis), quaternion[:, 3])))


def _first_guess(limb: Limb) -> Array:
    """Guess the angles joint by joint: all of a ball joint's rotation, of a hinge's the part about its axis."""
    current = np.broadcast_to(np.eye(3), limb.rotation[:, 0].shape)
    parts = []
    for joint, attitude, captured in zip(limb.joints, limb.attitude, np.moveaxis(limb.rotation, 1, 0), strict=True):
        current = current @ attitude
        relative = np.swapaxes(current, -1, -2) @ captured
        if len(joint.rotations) == 3:
            part = ball_joint_angles(joint, relative)
        else:
            part = np.empty((len(relative), len(joint.rotations)))
            for column, (_, axis) in enumerate(joint.rotations):
                part[:, column] = turn_about(axis, relative)
        parts.append(part)
        current = current @ joint_rotation(joint, part)
    return np.concatenate(parts, axis=-1)


def _log(rotation: Array) -> Array:
    """Return the rotation vectors (…, 3) of rotations (…, 3, 3)."""
    flat = Rotation.from_matrix(rotation.reshape(-1, 3, 3)).as_rotvec()
    return np.asarray(flat.reshape(*rotation.shape[:-2], 3))


def _log_jacobian(vector: Array) -> Array:
    """Return the derivative (…, 3, 3) of log(exp(ε) R) by ε, for vector = log R.

    It is 1 − r×/2 + r×²/12; the next term is r⁴/720.
    """
    x, y, z = np.moveaxis(vector, -1, 0)
    zero = np.zeros_like(x)
    cross = np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=-1).reshape(*vector.shape, 3)
    return np.asarray(np.eye(3) - 0.5 * cross + cross @ cross / 12.0)


def _residual(limb: Limb, angles: Array) -> tuple[Array, Array]:
    """Return the residual (n, m) and its Jacobian (n, m, c)."""
    pose = limb.pose(angles)
    transposed = np.swapaxes(pose.rotation, -1, -2)
    weight = 1.0 / limb.rotation_sigma
    difference = _log(transposed @ limb.rotation)
    residual = [(difference * weight).reshape(len(angles), -1)]
    counts = np.cumsum([len(joint.rotations) for joint in limb.joints])
    carried = np.arange(counts[-1]) < counts[:, None]  # (k, c): the angle turns the segment
    turned = transposed @ np.swapaxes(pose.axes, -1, -2)[:, None] * carried[:, None, :]
    rows = -weight[..., None] * (_log_jacobian(difference) @ turned)
    jacobian = [rows.reshape(len(angles), -1, counts[-1])]
    if limb.place is not None:
        residual.append((pose.origin[:, -1] - limb.place) / limb.place_sigma)
        through = np.repeat(np.arange(len(limb.joints)), [len(joint.rotations) for joint in limb.joints])
        swing = np.cross(pose.axes, pose.origin[:, -1:] - pose.origin[:, through])
        jacobian.append(np.swapaxes(swing, -1, -2) / limb.place_sigma)
    return np.concatenate(residual, axis=1), np.concatenate(jacobian, axis=1)


def fit_angles(limb: Limb) -> Array:
    """Return the angles (n, c) rad that bring the limb closest to its capture, measured in standard deviations."""
    angles = _first_guess(limb)
    moving = np.arange(len(angles))  # a few wild frames may never settle
    for _ in range(_ITERATIONS):
        residual, jacobian = _residual(limb.in_frames(moving), angles[moving])
        transposed = np.swapaxes(jacobian, -1, -2)
        normal = transposed @ jacobian
        scale = np.trace(normal, axis1=-2, axis2=-1)[:, None, None] / normal.shape[-1]
        damped = normal + _DAMPING * scale * np.eye(normal.shape[-1])
        step = np.clip(-np.linalg.solve(damped, transposed @ residual[..., None])[..., 0], -_STEP, _STEP)
        angles[moving] += step
        moving = moving[np.max(np.abs(step), axis=1) >= _CONVERGED]
        if len(moving) == 0:
            break
    return angles
