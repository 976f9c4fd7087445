"""The measurements of GPS and insoles as one table of a result, so that a report needs no recording."""

from __future__ import annotations

import pandas as pd

from sssi_exudyn.recording.instruments.gps import Gps
from sssi_exudyn.recording.instruments.insoles import Insoles


def measured_table(gps: Gps | None, insoles: Insoles | None) -> pd.DataFrame | None:
    """Return one row an instant at which an instrument measured, in the order of time; None where there is none.

    The columns are NaN where that instrument has no sample: ``time_s``, ``gps_east_m``, ``gps_north_m``, ``gps_up_m``,
    ``gps_sigma_m``, ``left_insole_N``, ``right_insole_N``.
    """
    tables = []
    if gps is not None:
        columns = {f"gps_{axis}_m": gps.enu[:, k] for k, axis in enumerate(("east", "north", "up"))}
        tables.append(pd.DataFrame({"time_s": gps.time, **columns, "gps_sigma_m": gps.sigma}))
    if insoles is not None:
        columns = {"left_insole_N": insoles.left, "right_insole_N": insoles.right}
        tables.append(pd.DataFrame({"time_s": insoles.time, **columns}))
    if not tables:
        return None
    return pd.concat(tables, ignore_index=True).sort_values("time_s", kind="stable", ignore_index=True)
