"""Text exports of pressure insoles: the same loads from each system, missing values, and texts of something else."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tiny import ANSWERS, Tiny

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.frames import GRAVITY, Array
from sssi_exudyn.importing.assemble import import_recording
from sssi_exudyn.importing.insole_exports import is_insole_export, read_insole_export

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


def write(path: Path, text: str) -> Path:
    path.write_text(text, encoding="utf-8")
    return path


def table(text: str) -> Array:
    return np.loadtxt(text.split("\n")[1:], delimiter=",")


@pytest.mark.parametrize("name", EXPORTS)
def test_every_export_gives_the_loads(name: str, tmp_path: Path) -> None:
    path = write(tmp_path / name, EXPORTS[name])
    assert is_insole_export(path)
    time, left, right = table(read_insole_export(path).table(70.0, None)).T
    # loads between two samples are taken along straight lines: 690 N · 0.3 · 1.5² · 0.02² / 8
    np.testing.assert_allclose(left, np.interp(time, TIME, LEFT), atol=0.05)
    np.testing.assert_allclose(right, np.interp(time, TIME, RIGHT), atol=0.05)


def test_missing_values_cost_themselves_and_are_counted(tmp_path: Path) -> None:
    notes = read_insole_export(write(tmp_path / "opengo.txt", opengo())).notes
    assert notes == ("opengo.txt: 3 of 400 row(s) without a load of the right foot left out (first: line 5)",)
    loads = read_insole_export(write(tmp_path / "loadsol.txt", loadsol()))
    assert any("2 of 400 row(s) without a load of the left foot" in note and "line 45" in note for note in loads.notes)
    assert len(loads.time) == 397  # and the first lies before the right foot's first


def test_pressures_are_scaled_to_the_weight_and_say_so(tmp_path: Path) -> None:
    export = read_insole_export(write(tmp_path / "pedar.asc", pedar()))
    assert not export.is_force
    assert any("scaled to the skier's weight" in note for note in export.notes)
    _, left, right = table(export.table(81.0, None)).T
    assert np.mean(left + right) == pytest.approx(81.0 * GRAVITY, rel=1e-6)


def test_a_stretch_begins_at_zero(tmp_path: Path) -> None:
    export = read_insole_export(write(tmp_path / "opengo.txt", opengo()))
    time, left, _ = table(export.table(70.0, (2.0, 5.0))).T
    assert (time[0], time[-1]) == pytest.approx((0.0, 3.0))
    np.testing.assert_allclose(left, np.interp(time + 2.0, TIME, LEFT), atol=0.05)


def test_an_export_becomes_part_of_a_recording(tmp_path: Path) -> None:
    folder = Tiny().write(tmp_path / "raw")
    export = write(tmp_path / "opengo.txt", opengo())
    made = import_recording([folder / "motion.bvh", folder / "gps.csv", export], tmp_path / "out", replace(ANSWERS))
    assert made.insoles is not None
    assert np.mean(made.insoles.left + made.insoles.right) == pytest.approx(70.0 * GRAVITY, rel=1e-3)


def test_other_texts_are_none(tmp_path: Path) -> None:
    for text in (
        "hello\n",
        "time_s,left_N,right_N\n0,1,2\n",
        "# left total force[N]\n",
        opengo().replace("left total", "left"),
    ):
        path = write(tmp_path / "other.txt", text)
        assert not is_insole_export(path)
        with pytest.raises(InputError, match="no export of insoles that is known"):
            read_insole_export(path)
    short = "\n".join(opengo().split("\n")[:6])
    with pytest.raises(InputError, match="2 samples are no recording"):
        read_insole_export(write(tmp_path / "short.txt", short))
    silent = "\n".join(line.rpartition("\t")[0].rpartition("\t")[0] + "\tnan\t" for line in opengo().split("\n")[4:])
    with pytest.raises(InputError, match="without a load of the right foot"):
        read_insole_export(write(tmp_path / "silent.txt", "\n".join(opengo().split("\n")[:4]) + "\n" + silent))
    back = opengo().split("\n")
    back[4:] = reversed(back[4:])
    with pytest.raises(InputError, match="stands still or runs back"):
        read_insole_export(write(tmp_path / "back.txt", "\n".join(back)))
