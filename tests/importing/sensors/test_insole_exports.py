"""Text exports of pressure insoles: the same loads from each system, missing values, and texts of something else."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from insole_files import EXPORTS, LEFT, RIGHT, TIME, loadsol, opengo, pedar
from tiny import ANSWERS, Tiny

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.frames import GRAVITY, Array
from sssi_exudyn.importing.assemble import import_recording
from sssi_exudyn.importing.sensors.insole_exports import is_insole_export, read_insole_export


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


def test_units_of_loadsol_may_have_their_quantity(tmp_path: Path) -> None:
    names = ["", "PGV1-L::heel", "PGV1-L", "", "PGV1-L::xAcc", "", "PGV2-R::heel", "PGV2-R", "", "PGV2-R::xAcc", ""]
    foot = ["Time[secs]", "Force[N]", "Force[N]", "Time[secs]", "[g]"]
    rows = [[f"{0.005 * i:.3f}", "90", f"{294.55 + i}", f"{0.005 * i:.3f}", "0.7"] for i in range(4)]
    rows = [[*row, row[0], "60", f"{269.7 - i}", *row[3:], ""] for i, row in enumerate(rows)]
    lines = ["\t".join(cells) for cells in (names, [*foot, *foot, ""], *rows)]
    path = write(tmp_path / "loadsol.txt", "loadapp.loadflux\ncomment weights\n" + "\n".join(lines) + "\n")
    assert is_insole_export(path)
    time, left, right = table(read_insole_export(path).table(70.0, None)).T
    np.testing.assert_allclose(time, 0.005 * np.arange(4))
    np.testing.assert_allclose(left, 294.55 + np.arange(4))
    np.testing.assert_allclose(right, 269.7 - np.arange(4))


def test_an_export_of_one_foot_asks_for_the_other(tmp_path: Path) -> None:
    one_loadsol = "\n".join("\t".join(line.split("\t")[:4]) for line in loadsol().splitlines())
    one_opengo = opengo().replace("right total force[N]", "right balance[]")
    for name, text, foot in (("loadsol.txt", one_loadsol, "left"), ("opengo.txt", one_opengo, "left")):
        path = write(tmp_path / name, text)
        assert is_insole_export(path)
        with pytest.raises(InputError, match=f"loads of the {foot} foot alone; export both insoles"):
            read_insole_export(path)


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
    # no file ties the two clocks: that they are one is said
    (note,) = (note for note in made.notices if "its clock is taken" in note)
    assert "opengo.txt" in note
    assert "motion.bvh" in note
    assert "[insoles] time_offset_s" in note


def test_other_texts_are_none(tmp_path: Path) -> None:
    for text in (
        "hello\n",
        "time_s,left_N,right_N\n0,1,2\n",
        "# left total force[N]\n",
        opengo().replace("total force", "force"),
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
