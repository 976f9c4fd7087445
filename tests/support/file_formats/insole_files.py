"""The loads under both feet of a skier of 70 kg as the exports of three systems have them."""

from __future__ import annotations

import numpy as np

from sssi_exudyn.core.frames import GRAVITY, Array

TIME = np.arange(0.0, 8.0, 0.02)


def left_load(time: Array) -> Array:
    return np.asarray(70.0 * GRAVITY * (0.5 + 0.3 * np.sin(1.5 * time)))


LEFT = left_load(TIME)
RIGHT = 70.0 * GRAVITY - LEFT


def opengo(separator: str = "\t", unit: str = "") -> str:
    """Return an export of OpenGo; the right insole begins three samples later."""
    names = ["left pressure 1[N/cm²]", "left total force[N]", "right total force[N]", "right steps[]"]
    head = (
        f"# Start time: 01.02.2026 10:00:00.000\n# Duration: 00:00:08\n# Sensor insoles: 1, 2\n# time{unit}{separator}"
    )
    factor = 1000.0 if unit == "[ms]" else 1.0
    rows = [
        separator.join([f"{factor * t:.2f}", "1.5", f"{left:.3f}", "nan" if i < 3 else f"{right:.3f}", ""])
        for i, (t, left, right) in enumerate(zip(TIME, LEFT, RIGHT, strict=True))
    ]
    return head + separator.join(names) + "\n" + "\n".join(rows) + "\n"


def loadsol() -> str:
    """Return an export of loadsol with two areas an insole; the right insole's clock is 5 ms later."""
    names = ["", "ABCD-L:heel", "ABCD-L:forefoot", "ABCD-L", "", "EFGH-R:heel", "EFGH-R:forefoot", "EFGH-R", "Notes"]
    units = ["Time[sec]", "N", "N", "N", "Time[sec]", "N", "N", "N", ""]
    rows = []
    for i, t in enumerate(TIME):
        later = 70.0 * GRAVITY - left_load(t + 0.005)
        left = ["-"] * 3 if i in (40, 41) else [f"{0.4 * LEFT[i]:.3f}", f"{0.6 * LEFT[i]:.3f}", f"{LEFT[i]:.3f}"]
        right = [f"{0.5 * later:.3f}", f"{0.5 * later:.3f}", f"{later:.3f}"]
        rows.append("\t".join([f"{t:.3f}", *left, f"{t + 0.005:.3f}", *right, ""]))
    return (
        "loadsol_2026-02-01_10-00-00.txt\n\n"
        + "\n".join("\t".join(row) for row in (names, units))
        + "\n"
        + "\n".join(rows)
    )


def pedar() -> str:
    """Return an export of pedar, whose 99 cells of an insole share its load unevenly."""
    share = np.linspace(1.0, 3.0, 99)
    head = ["file name:\trun.sol", *["about\tit"] * 8, "time[secs]\t" + "\t".join(str(cell) for cell in range(1, 199))]
    rows = [
        "\t".join([f"{t:.2f}", *(f"{load:.4f}" for load in np.r_[left * share, right * share] / 20.0)])
        for t, left, right in zip(TIME, LEFT, RIGHT, strict=True)
    ]
    return "\n".join([*head, *rows]) + "\n"


EXPORTS = {
    "opengo.txt": opengo(),
    "opengo.csv": opengo(","),
    "milliseconds.txt": opengo(unit="[ms]"),
    "loadsol.txt": loadsol(),
    "pedar.asc": pedar(),
}
