"""Rotations of captured motion: low-pass filtering, the nearest rotation, angles between two.

The filter is the usual one of biomechanics, "4th-order Butterworth, zero lag": a second-order Butterworth run forwards
and backwards, so the attenuations multiply and the phases cancel.  Two runs would lower the −3 dB point, so each run's
cut-off is raised by (√2 − 1)^(−1/4) = 1.246 in the pre-warped frequency (Winter 2009, 2.2.4.4): the *whole* filter has
−3 dB at the requested cut-off.
"""

from __future__ import annotations

import numpy as np

from sssi_exudyn.core.frames import Array


def lowpass(values: Array, rate: float, cutoff: float) -> Array:
    """Remove everything faster than ``cutoff`` (Hz, −3 dB) from ``values`` (n, …), evenly sampled at ``rate`` (Hz).

    The ends are continued by a point reflection about the first and last sample, so a signal that passes its end with
    constant speed is continued exactly.  Cut out of longer skiing captures, runs filtered so were 0.03° wrong at the
    very end and 0.006° three frames inside; mirrored, constant, polynomial and Gustafsson's continuations were worse.
    Raises ValueError when the cut-off is not below half the rate.
    """
    if not 0.0 < cutoff < rate / 2.0:
        raise ValueError(f"a cut-off of {cutoff:g} Hz needs sampling faster than {2 * cutoff:g} Hz, not {rate:g} Hz")
    from scipy import signal  # here: it takes most of a second to load

    passes = 2
    warped = np.tan(np.pi * cutoff / rate) / (2.0 ** (1.0 / passes) - 1.0) ** 0.25
    sections = signal.butter(2, np.arctan(warped) / np.pi * rate, fs=rate, output="sos")
    # The filter forgets by e^(−5) in each period of the cut-off; after six nothing is left.
    pad = min(len(values) - 1, int(np.ceil(6.0 * rate / cutoff)))
    return np.asarray(signal.sosfiltfilt(sections, values, axis=0, padtype="odd", padlen=pad), dtype=np.float64)


def nearest_rotation(matrix: Array) -> Array:
    """Return the rotations (…, 3, 3) nearest to matrices (…, 3, 3) in the sum of squares of the entries."""
    u, _, vt = np.linalg.svd(matrix)
    u[..., :, 2] *= np.sign(np.linalg.det(u @ vt))[..., None]
    return np.asarray(u @ vt)


def smooth_rotations(rotation: Array, rate: float, cutoff: float) -> Array:
    """Filter rotations (n, …, 3, 3) without angles, hence without trouble near gimbal lock.

    The entries are filtered and the result is brought back to the nearest rotation: the weighted chordal mean of the
    rotations under the filter's window.
    """
    return nearest_rotation(lowpass(rotation, rate, cutoff))


def angles_between(a: Array, b: Array) -> Array:
    """Return the angles (…) rad between rotations a and b (…, 3, 3).

    |A − B| = 2√2 sin(θ/2) (Frobenius norm) is accurate also for tiny angles.
    """
    half_sine = np.linalg.norm(a - b, axis=(-2, -1)) / np.sqrt(8.0)
    return np.asarray(2.0 * np.arcsin(np.minimum(half_sine, 1.0)))


def rotations_about(axis: Array, angle: Array) -> Array:
    """Return rotations (n, 3, 3) by ``angle`` (n,) rad about unit vectors ``axis`` (3,) or (n, 3).

    The formula is written out so that a complex angle carries a derivative through it.
    """
    x, y, z = np.moveaxis(np.broadcast_to(axis, (len(angle), 3)), -1, 0)
    none = np.zeros_like(x)
    cross = np.stack([none, -z, y, z, none, -x, -y, x, none], axis=-1).reshape(-1, 3, 3)
    angle = angle[:, None, None]
    return np.asarray(np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * (cross @ cross))
