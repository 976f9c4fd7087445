"""The paper's filter: 4th-order Butterworth low-pass at 6 Hz, without lag."""

from __future__ import annotations

from typing import Final

import numpy as np
from scipy import signal

from sssi_exudyn.frames import Array

CUTOFF_HZ: Final = 6.0
"""Paper 2.4, for joint angles and for insoles."""
_TWO_PASSES: Final = (2.0**0.5 - 1.0) ** 0.25
"""What running a second-order Butterworth both ways does to its −3 dB frequency (Winter 2009, section 2.2.4.4)."""


def lowpass(values: Array, rate: float, cutoff_hz: float = CUTOFF_HZ) -> Array:
    """Evenly sampled ``values`` (n, …) without what is faster than ``cutoff_hz``, along the first axis.

    A second-order Butterworth forwards and backwards: fourth order and no lag, its own cut-off raised so that both
    passes together are −3 dB at ``cutoff_hz``, as biomechanics counts it.  The ends are continued by point reflection,
    which keeps value and slope there, four periods of the cut-off long: until the filter has forgotten its start.

    Parameters
    ----------
    values : (n, …), finite
    rate : samples a second; from twice the cut-off downwards there is nothing to remove and the values come back as
        they are
    """
    if rate <= 2.0 * cutoff_hz or len(values) < 2:
        return np.array(values, dtype=float)
    # In the bilinear transform frequencies are tan(π f/rate): corrected there, the cut-off is exact at any rate.
    corrected = np.arctan(np.tan(np.pi * cutoff_hz / rate) / _TWO_PASSES) * 2.0 / np.pi
    sections = signal.butter(2, corrected, output="sos")
    padding = min(len(values) - 1, int(np.ceil(4.0 * rate / cutoff_hz)))
    return np.asarray(signal.sosfiltfilt(sections, values, axis=0, padtype="odd", padlen=padding))
