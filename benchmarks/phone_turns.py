"""Turns from phones' yaw rate compared with turns labelled by people.

``python benchmarks/phone_turns.py FOLDER``: FOLDER holds pairs ``NAME_imu.csv`` (t_s, yawrate_about_up_radps, label
left or right, status START or STOP) and ``NAME_gnss.csv`` (t_s, speed_mps), 10 Hz and 1 Hz.  The course is the sum of
the yaw rate; satellites' course lags by 1.4 to 1.7 s and is too coarse for turns of 2 s.

A labelled turn is found when a turn to the same side shares at least half of the shorter one's time with it; each turn
found answers for one label.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pandas as pd

from sssi_exudyn.analysis.turns import Turn, turns_of_course

SHARED = 0.5


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


def main(folder: Path) -> None:
    print("| run | labelled | found | precision | recall | missed (s), side |\n|---|---|---|---|---|---|")
    total = np.zeros(4, dtype=int)
    for path in sorted(folder.glob("*_imu.csv")):
        imu = pd.read_csv(path)
        gnss = pd.read_csv(path.with_name(path.name.replace("_imu", "_gnss")))
        time = imu["t_s"].to_numpy(dtype=float)
        rate = imu["yawrate_about_up_radps"].to_numpy(dtype=float)
        course = np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(time))])
        speed = np.interp(time, gnss["t_s"], gnss["speed_mps"])
        truth = labelled(imu)
        within = (truth[0][1], truth[-1][2]) if truth else (0.0, 0.0)
        turns = turns_of_course(time, course, speed).turns
        detected = [turn for turn in turns if within[0] <= 0.5 * (turn.start + turn.end) <= within[1]]
        labels, hits = matched(truth, detected)
        missed = ", ".join(f"{t[1]:.1f}–{t[2]:.1f} {t[0]}" for i, t in enumerate(truth) if i not in labels)
        total += (len(truth), len(detected), len(labels), len(hits))
        name = path.name.removesuffix("_imu.csv")
        print(
            f"| {name} | {len(truth)} | {len(detected)} | {len(hits) / max(len(detected), 1):.2f} | "
            f"{len(labels) / max(len(truth), 1):.2f} | {missed} |"
        )
    print(f"| all | {total[0]} | {total[1]} | {total[3] / total[1]:.3f} | {total[2] / total[0]:.3f} | |")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
