"""Captures with missing frames on an even clock: rotations are turned evenly across short gaps."""

from __future__ import annotations

from pathlib import Path
from typing import Final

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from sssi_exudyn.core.frames import Array
from sssi_exudyn.io.table import bridge_gaps

_EVEN: Final = 1e-9
"""Distance from the even clock within which frames stay as they are, s: nothing turns by a file's last digit in it."""


def even_frames(path: Path, time: Array, rotations: Array, root: Array) -> tuple[Array, Array, Array, tuple[str, ...]]:
    """Resample frames at even steps, with short gaps bridged.

    Of a run that long gaps split, the longest part is kept (see ``bridge_gaps``).

    Parameters
    ----------
    time : (n,) s, rising
    rotations : (n, J, 3, 3)
    root : (n, 3) m

    Returns time, rotations and root at even steps, and the changes in words.  Raises InputError where no stretch is
    long enough.
    """
    clock = bridge_gaps(path, time, 3 * rotations.shape[1])
    kept = time[clock.keep]
    count = len(clock.time)
    even = np.linspace(clock.time[0], clock.time[-1], count)
    if len(kept) == count and np.max(np.abs(even - kept)) < _EVEN:
        return even, rotations[clock.keep], root[clock.keep], clock.notes
    turned = np.empty((count, *rotations.shape[1:]))
    for joint in range(rotations.shape[1]):
        turned[:, joint] = Slerp(kept, Rotation.from_matrix(rotations[clock.keep, joint]))(even).as_matrix()
    moved = np.column_stack([np.interp(even, kept, column) for column in root[clock.keep].T])
    return even, turned, moved, clock.notes
