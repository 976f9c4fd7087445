"""A posture correction on disk: ``[posture]`` of ``model.toml``, and its angles in a Parquet file next to it."""

from __future__ import annotations

import hashlib
import io
from pathlib import Path
from typing import Any, Final

import numpy as np

from sssi_exudyn.bodies.skier.chain import PRESCRIBED
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.io.bounds import MAX_DURATION
from sssi_exudyn.io.files import inside, is_as_written
from sssi_exudyn.io.parquet import check_finite, check_time, read_parquet
from sssi_exudyn.io.settings import Settings, check_keys, text_of
from sssi_exudyn.motion.correction import PostureCorrection

FILE: Final = "posture_correction.parquet"
_KEYS: Final = ("file", "sha256")
_COLUMNS: Final = ("time_s", *(f"{name}_rad" for name in PRESCRIBED))
_MOST: Final = 1.6
"""Largest correction, rad; a posture that needs more was not captured."""


def correction_to_dict(correction: PostureCorrection) -> dict[str, Any]:
    """Return the table ``[posture]``; the angles are ``correction_bytes``."""
    return {"file": FILE, "sha256": hashlib.sha256(correction_bytes(correction)).hexdigest()}


def correction_bytes(correction: PostureCorrection) -> bytes:
    """Return the angles to add to the captured ones, one row per instant, as a Parquet file."""
    import pandas as pd  # here: most uses of a model need no table

    table = pd.DataFrame(np.column_stack([correction.time, correction.angles]), columns=list(_COLUMNS))
    stream = io.BytesIO()
    table.to_parquet(stream, index=False)
    return stream.getvalue()


def read_correction(table: Settings, path: Path) -> PostureCorrection:
    """Read the correction that ``[posture]`` of the file ``path`` names.

    Raises InputError for unknown keys, and for a file that is missing, not such a table, or not the one that the model
    was written with.
    """
    check_keys(table, _KEYS, path, "[posture]")
    file = inside(path.parent, text_of(table, "file", path, "[posture]"), path, "[posture] file")
    frame = read_parquet(file, _COLUMNS)
    if len(frame) < 2:
        raise InputError(file, "", "fewer than two instants", "take the file that the model was written with")
    check_time(file, frame, MAX_DURATION, strict=True)
    check_finite(file, frame, _COLUMNS)
    angles = frame[list(_COLUMNS[1:])].to_numpy(dtype=float)
    if np.max(np.abs(angles)) > _MOST:
        raise InputError(file, "", f"an angle is corrected by more than {_MOST:g} rad", "give radians")
    correction = PostureCorrection(frame["time_s"].to_numpy(dtype=float), angles)
    if not is_as_written(file, table.get("sha256"), lambda: correction.digest):
        raise InputError(
            file, "", "not the correction that the model was written with", f"take it away from {path.name}: sha256"
        )
    return correction
