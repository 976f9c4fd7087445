"""A season's table and tracks that no run has made, with all that its page shows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
from passages import draw_passages

from sssi_exudyn.core.frames import Array
from sssi_exudyn.results.data_dictionary import season_columns
from sssi_exudyn.results.summary import Provenance
from sssi_exudyn.season.figures import TECHNIQUES
from sssi_exudyn.season.joint_friction import JointFriction, compare_runs
from sssi_exudyn.season.outliers import add_outliers

DAYS = ("2026-01-10", "2026-01-11", "2026-02-20")
ORIGIN = replace(
    Provenance(),
    inputs={f"saturday/run_{number:02d}": "3c" * 32 for number in range(3)},
    versions={"sssi_exudyn": "0.1.0", "exudyn": "1.13.6"},
    settings={"seconds": [None, 12.5]},
)


def compared_descents() -> tuple[JointFriction, ...]:
    """Return a descent of three runs with long names, of which one differs and one has a patch of slow snow."""
    place = np.array([0.08, 0.15, 0.10, 0.12, 0.07, 0.11])
    rng = np.random.default_rng(3)
    passages = draw_passages(rng, place, [0.0, 0.06, 0.0], {(0, 2): 0.15}, [0.003] * 3)
    names = [f"{DAYS[0]}/telephone_in_a_pocket_{DAYS[0]}_{number:02d}" for number in range(3)]
    return (replace(compare_runs("A", names, *passages), left_out=("saturday/run_07",)),)


def a_season(count: int = 18) -> tuple[pd.DataFrame, dict[str, Array]]:
    """Return a table of runs on three days and two skis, of which one failed and two stand out, and their tracks."""
    rng = np.random.default_rng(7)
    rows, tracks = [], dict[str, Array]()
    for number in range(count):
        day, place = DAYS[number * len(DAYS) // count], ("A", "B")[number % 2]
        name = f"{day}/telephone_in_a_pocket_{day}_{number:02d}"
        shares = rng.dirichlet((3.0, 2.0, 0.5))
        friction = rng.normal(0.08, 0.01)
        likely = TECHNIQUES[int(np.argmax(shares))]
        rows.append(
            {
                **dict.fromkeys((column.name for column in season_columns() if not column.unit), ""),
                **{
                    "run": name,
                    "recording": name,
                    "place": place,
                    "day": day,
                    "began_utc": f"{day}T10:{number:02d}:00Z",
                },
                **{
                    "skier": ("Ada", "Bo")[number % 3 == 0],
                    "ski": "slalom_165",
                    "snow_kind": "groomed",
                    "status": "done",
                },
                **{"duration_s": rng.normal(70.0, 5.0), "length_m": rng.normal(800.0, 9.0), "slope_deg": 11.0},
                **{"vertical_m": rng.normal(150.0, 3.0), "mean_speed_mps": rng.normal(11.0, 0.3), "turns": 20.0},
                **{"top_speed_mps": 40.0 if number == 4 else rng.normal(16.0, 0.4), "track_error_m": 4.0},
                **{"effective_friction": 0.3 if number == 7 else friction, "energy_lost_a_turn_J_per_kg": 60.0},
                **{"effective_friction_low": friction - 0.02, "effective_friction_high": friction + 0.02},
                **{f"technique_{name}": share for name, share in zip(TECHNIQUES, shares, strict=True)},
                "technique": likely,
            }
        )
        down = np.linspace(0.0, 1.0, 40)
        north = 46.8 + (0.3 if number > 14 else 0.0) - 0.007 * down
        east = 9.8 + 0.002 * (place == "B") + 1e-4 * np.sin(40.0 * down) + rng.normal(0.0, 3e-5)
        tracks[name] = np.column_stack([north, east, 2000.0 - 150.0 * down])
    rows[-1] |= {"status": "failed", "error": "saturday/gps.csv: line 42: 95 is no latitude; " + "correct it, " * 20}
    table = pd.DataFrame(rows, columns=[column.name for column in season_columns()])
    table = table.astype({column.name: "float64" for column in season_columns() if column.unit})
    return add_outliers(table), tracks
