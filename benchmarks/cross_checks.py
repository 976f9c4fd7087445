"""False alarms of the cross-checks: every recording below some folders is read, and what the checks find is listed.

    python benchmarks/cross_checks.py examples ../recordings ../phone_runs

A folder is a recording, or holds recordings, or files ``NAME_imu.csv`` and ``NAME_gnss.csv`` of a telephone in a
pocket, or ``imu_left.csv``, ``imu_right.csv``, ``imu_central.csv``, ``baro.csv`` and ``gps.csv`` of sensors on skis and
chest.  The table has what each check compares as numbers, and whatever it finds.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from sssi_exudyn.core.errors import SssiError
from sssi_exudyn.importing.answers import Answers
from sssi_exudyn.importing.assemble import import_recording
from sssi_exudyn.recording import read
from sssi_exudyn.recording.cross_checks.check import Check, Evidence, hold_against_each_other
from sssi_exudyn.recording.cross_checks.clock_rates import compare_clocks
from sssi_exudyn.recording.cross_checks.loaded_foot import load_correlation
from sssi_exudyn.recording.cross_checks.sensor_turning import evidence_of_turned, turning_lags
from sssi_exudyn.recording.cross_checks.turning_offset import offset_of_turns
from sssi_exudyn.recording.recording import FILE

PLACES = {"imu_left": "left_ski", "imu_right": "right_ski", "imu_central": "chest", "baro": "barometer"}


class Listener:
    """Stands in for the reader's own application of the checks, and keeps the figures and findings."""

    def __init__(self) -> None:
        self.figures: list[str] = []
        self.notices: list[str] = []

    def __call__(self, evidence: Evidence, checks: Sequence[Check]) -> tuple[Evidence, tuple[str, ...]]:
        """Apply the checks as the reader does."""
        for imu in evidence.imus:
            lags = None if evidence.gps is None or imu.force is None else turning_lags(imu, evidence.gps)
            if evidence.gps is not None and lags is not None:
                turns = f"turns with {lags[0].correlation:.2f}, turned over {lags[1].correlation:.2f}"
                better = evidence_of_turned(imu, evidence.gps, *lags)
                size = float(np.sqrt(np.mean(np.sum(imu.rate**2, axis=1))))
                self.figures.append(f"{imu.place}: {turns}, evidence {better:.1f}, {size:.1f} rad/s")
        offset = offset_of_turns(evidence)
        if offset is not None:
            self.figures.append(f"skis unexplained {offset.as_is:.3f}, {offset.left:.3f} at {offset.value:+.1f} s")
        self.figures += [
            f"{one.instrument} on {one.other}: rate {100.0 * one.pace.rate:+.2f} ± {100.0 * one.pace.sigma:.2f} %,"
            f" unexplained {one.pace.left:.3f}"
            for one in compare_clocks(evidence)
        ]
        load = load_correlation(evidence)
        if load is not None:
            self.figures.append(f"load {load:.2f}")
        evidence, notices = hold_against_each_other(evidence, checks)
        self.notices += notices
        return evidence, notices


def inputs(folder: Path) -> Iterator[tuple[str, list[Path]]]:
    """Yield the name of every run below a folder, and the files to import; none for a recording."""
    if (folder / FILE).exists():
        yield str(folder), []
        return
    placed = [
        Path(f"{place}={folder / name}.csv") for name, place in PLACES.items() if (folder / f"{name}.csv").exists()
    ]
    if placed and (folder / "gps.csv").exists():
        yield str(folder), [*placed, folder / "gps.csv"]
    for imu in sorted(folder.glob("*_imu.csv")):
        fixes = imu.with_name(imu.name.replace("_imu", "_gnss"))
        if fixes.exists():
            yield imu.stem, [Path(f"pocket={imu}"), fixes]
    for below in sorted(path for path in folder.iterdir() if path.is_dir()):
        yield from inputs(below)


def main(folders: Sequence[str]) -> None:
    """Print a line for each run and one for all."""
    runs = alarms = failed = 0
    for name, files in (one for folder in folders for one in inputs(Path(folder))):
        listener = Listener()
        read.hold_against_each_other = listener  # type: ignore[attr-defined]
        runs += 1
        try:
            if files:
                with tempfile.TemporaryDirectory() as made:
                    recording = import_recording(files, Path(made) / "run", replace(Answers(), name=name))
            else:
                recording = read.read_recording(name)
            result = f"{recording.stop - recording.start:.0f} s"
        except SssiError as error:
            failed += 1
            result = f"REFUSED: {error}"
        alarms += len(listener.notices)
        print(f"{name}\n    {result}; {'; '.join(listener.figures)}", flush=True)
        for words in listener.notices:
            print(f"    FOUND {words}", flush=True)
    print(f"{runs} runs, {alarms} findings, {failed} refused")


if __name__ == "__main__":
    main(sys.argv[1:])
