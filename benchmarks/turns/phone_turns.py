"""Turns of telephones' sensors compared with turns labelled by people.

``python benchmarks/turns/phone_turns.py FOLDER …``: folders hold pairs ``NAME_imu.csv`` (t_s, gx, gy, gz in rad/s,
ax, ay, az in m/s², label left or right, status START or STOP) and ``NAME_gnss.csv`` (t_s, speed_mps), 10 Hz and 1 Hz.

A labelled turn is found when a turn to the same side shares at least half of the shorter one's time with it; each turn
found answers for one label.  Thresholds were chosen on the days of ``CHOSEN_ON``, so those are given apart.  The yaw
rate alone stands next to yaw rate and lean together.  Satellites' course lags by 1.4 to 1.7 s and is too coarse for
turns of 2 s.  The time of a change of side is the labelled one less the nearest one found.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sssi_exudyn.analysis.sensor_turns import turns_of_sensor
from sssi_exudyn.analysis.turns import Turn, turns_of_course
from sssi_exudyn.core.frames import Array
from sssi_exudyn.recording.few_sensors.attitude import attitude_of
from sssi_exudyn.recording.instruments.imu import Imu

SHARED = 0.5
CHOSEN_ON = ("2024-02-24", "2024-02-25", "2024-03-19")


def labelled(imu: pd.DataFrame) -> list[tuple[str, float, float]]:
    """Return (side, start, stop) of each labelled turn; a START without its STOP is left out."""
    turns, open_side, begin = [], "", 0.0
    for time, side, status in imu[["t_s", "label", "status"]].dropna().itertuples(index=False):
        if status == "START":
            open_side, begin = side, time
        elif side == open_side:
            turns.append((side, begin, time))
            open_side = ""
    return turns


def matched(truth: list[tuple[str, float, float]], detected: list[Turn]) -> tuple[set[int], set[int]]:
    """Match labels and found turns, the longest shared time first, and return the indices of both."""
    pairs = []
    for i, (side, start, stop) in enumerate(truth):
        for j, turn in enumerate(detected):
            both = min(stop, turn.end) - max(start, turn.start)
            if turn.side == side and both >= SHARED * min(stop - start, turn.duration):
                pairs.append((both, i, j))
    labels: set[int] = set()
    turns: set[int] = set()
    for _, i, j in sorted(pairs, reverse=True):
        if i not in labels and j not in turns:
            labels.add(i)
            turns.add(j)
    return labels, turns


def detected_by(imu: pd.DataFrame, gnss: pd.DataFrame) -> dict[str, list[Turn]]:
    """Return the turns of the yaw rate alone, and of yaw rate and lean."""
    time, rate, force = (imu[names].to_numpy(dtype=float) for names in ("t_s", ["gx", "gy", "gz"], ["ax", "ay", "az"]))
    attitude = attitude_of(Imu("telephone", "pocket", time, rate, force, None))
    yaw, up = attitude.yaw_rate, attitude.rotation[:, 2]
    speed = np.interp(time, gnss["t_s"], gnss["speed_mps"])
    course = np.concatenate([[0.0], np.cumsum(0.5 * (yaw[1:] + yaw[:-1]) * np.diff(time))])
    by_signal = {"yaw rate": turns_of_course(time, course, speed), "and lean": turns_of_sensor(time, yaw, up, speed)}
    return {name: list(turns.turns) for name, turns in by_signal.items()}


def changes_apart(truth: list[tuple[str, float, float]], detected: list[Turn]) -> Array:
    """Return by how much each labelled change of side comes after the nearest detected one, s."""
    labels, starts = np.array([start for _, start, _ in truth[1:]]), np.array([turn.start for turn in detected[1:]])
    if not len(labels) or not len(starts):
        return np.zeros(0)
    return np.asarray(labels - starts[np.argmin(np.abs(labels[:, None] - starts), axis=1)])


def main(folders: list[Path]) -> None:
    """Print a line for each run and signal, and sums."""
    print("| run | turns of | labelled | found | precision | recall | missed (s), side | false |\n" + "|---" * 8 + "|")
    totals: dict[tuple[str, str], NDArray[np.int_]] = {}
    apart: dict[str, list[Array]] = {}
    for path in sorted(path for folder in folders for path in folder.glob("*_imu.csv")):
        imu, gnss = pd.read_csv(path), pd.read_csv(path.with_name(path.name.replace("_imu", "_gnss")))
        truth, name = labelled(imu), path.name.removesuffix("_imu.csv")
        if not truth:
            continue
        days = "chosen on" if any(day in name for day in CHOSEN_ON) else "other days"
        for signal, turns in detected_by(imu, gnss).items():
            detected = [turn for turn in turns if truth[0][1] <= 0.5 * (turn.start + turn.end) <= truth[-1][2]]
            labels, hits = matched(truth, detected)
            missed = ", ".join(f"{t[1]:.1f}–{t[2]:.1f} {t[0]}" for i, t in enumerate(truth) if i not in labels)
            false = ", ".join(f"{t.start:.1f}–{t.end:.1f} {t.side}" for i, t in enumerate(detected) if i not in hits)
            counts = np.array([len(truth), len(detected), len(labels), len(hits)])
            print(line(name, signal, counts, missed, false))
            apart.setdefault(signal, []).append(changes_apart(truth, detected))
            for group in (days, "all"):
                totals[group, signal] = totals.get((group, signal), np.zeros(4, dtype=int)) + counts
    for (group, signal), counts in totals.items():
        print(line(group, signal, counts, "", ""))
    for signal, differences in apart.items():
        late = np.concatenate(differences)
        middle = float(np.median(late))
        print(f"\nlabelled changes of side after those of {signal}: median {middle:.2f} s,", end=" ")
        print(f"half of them within {np.median(np.abs(late - middle)):.2f} s of it")


def line(name: str, signal: str, counts: NDArray[np.int_], missed: str, false: str) -> str:
    """Return a line of the table; ``counts`` (4,) of labels, of turns, and of both with a match."""
    truth, detected, labels, hits = counts.tolist()
    rates = f"{hits / max(detected, 1):.3f} | {labels / max(truth, 1):.3f}"
    return f"| {name} | {signal} | {truth} | {detected} | {rates} | {missed} | {false} |"


if __name__ == "__main__":
    main([Path(argument) for argument in sys.argv[1:]])
