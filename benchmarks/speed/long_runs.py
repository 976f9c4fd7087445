"""Time and memory over the length of a telephone's run.

    python benchmarks/speed/long_runs.py GNSS_CSV IMU_CSV --json FILE [--seconds 100 300 1000] [--command fit]

The files are a telephone's as ``sssi import`` reads them.  A longer run is this one several times end to end, each
time from where, and as high as, the last one ended.  The table has wall and processor time of all cores (s) and the
largest memory (MB) of the import and of the command; where one is refused, its line says why.
"""

from __future__ import annotations

import argparse
import json
import tempfile
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Final

import pandas as pd
from commands import Cost, run_measured

CARRIED: Final = ("east_m", "north_m", "alt_m", "lat", "lon")
"""Columns of fixes that go on from where the last time ended."""
SECONDS: Final = (100.0, 300.0, 1000.0)


@dataclass(frozen=True)
class Row:
    """A line of the table; ``refused`` is what the program said, and the costs are those until then."""

    seconds: float
    fixes: int
    imported: Cost
    done: Cost | None
    refused: str

    def line(self) -> str:
        """Return the line as Markdown."""
        shown = [
            "–" if cost is None else f"{cost.wall:.0f} s, {cost.cpu:.0f} s, {cost.memory:.0f} MB"
            for cost in (self.imported, self.done)
        ]
        return f"| {self.seconds:.0f} s | {self.fixes} | {' | '.join(shown)} | {self.refused} |"


def repeated(table: pd.DataFrame, seconds: float, period: float, carried: tuple[str, ...]) -> pd.DataFrame:
    """Return a table end to end until ``seconds``, its time ``t_s`` begun again every ``period`` s."""
    ends = {name: table[name].iloc[-1] - table[name].iloc[0] for name in carried}
    parts = []
    for number in range(int(seconds // period) + 1):
        part = table.copy()
        part["t_s"] += number * period
        for name in carried:
            part[name] += number * ends[name]
        parts.append(part)
    whole = pd.concat(parts, ignore_index=True)
    return whole[whole["t_s"] <= seconds]


def measure(gnss: Path, imu: Path, seconds: float, command: str) -> Row:
    """Import the run of that length, and give it to the command."""
    fixes, turning = pd.read_csv(gnss), pd.read_csv(imu)
    step = float(fixes["t_s"].diff().median())
    period = float(fixes["t_s"].iloc[-1] - fixes["t_s"].iloc[0]) + step
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "logs" / "long").mkdir(parents=True)
        long_fixes = repeated(fixes, seconds, period, CARRIED)
        long_fixes.to_csv(folder / "logs" / "long" / "gnss.csv", index=False)
        repeated(turning[turning["t_s"] < period], seconds, period, ()).to_csv(
            folder / "logs" / "long" / "imu.csv", index=False
        )
        imported, said = run_measured(["import", str(folder / "logs"), "--out", str(folder / "runs")])
        made = sorted(folder.glob("runs/**/recording.toml"))
        if not made:
            return Row(seconds, len(long_fixes), imported, None, said)
        done, said = run_measured([command, str(made[0].parent), "--out", str(folder / "out"), "--quiet"])
        return Row(seconds, len(long_fixes), imported, done, said)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("gnss", type=Path)
    parser.add_argument("imu", type=Path)
    parser.add_argument("--seconds", type=float, nargs="+", default=list(SECONDS))
    parser.add_argument("--command", default="fit")
    parser.add_argument("--json", type=Path, required=True)
    given = parser.parse_args()

    def rows() -> Iterator[Row]:
        for seconds in given.seconds:
            row = measure(given.gnss, given.imu, seconds, given.command)
            print(row.line(), flush=True)
            yield row

    print("| length | fixes | import: wall, processor, memory |", f"{given.command}: the same | refused |")
    print("|---|---|---|---|---|")
    given.json.write_text(json.dumps([asdict(row) for row in rows()], indent=1), encoding="utf-8")


if __name__ == "__main__":
    main()
