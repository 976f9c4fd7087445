"""``sssi ski turn``: its arguments, its table, its JSON and its page."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

import sssi_exudyn
from sssi_exudyn.cli import main
from sssi_exudyn.commands.ski_turn import edge_angles
from sssi_exudyn.core.errors import InputError


@pytest.mark.parametrize(
    ("text", "angles"),
    [
        ("60", [60.0]),
        ("60,30", [30.0, 60.0]),
        ("30:70", [30.0, 40.0, 50.0, 60.0, 70.0]),
        ("30:70:20", [30.0, 50.0, 70.0]),
        ("45:45", [45.0]),
        ("30:44", [30.0, 40.0]),
    ],
)
def test_edge_angles(text: str, angles: list[float]) -> None:
    assert edge_angles(text) == angles


@pytest.mark.parametrize(
    "text",
    ["", "steep", "30:", "70:30", "30:70:0", "30-70", "4", "80", "1.2.3", "30:70:.1", "nan", "-30", "1:2:3:4"],
)
def test_what_is_no_edge_angle_is_one_clear_line(text: str) -> None:
    with pytest.raises(InputError, match=r"sssi ski turn: --edge: .*; give degrees as 60"):
        edge_angles(text)


def test_numbers_are_edge_angles_too() -> None:
    assert edge_angles(50) == [50.0]
    assert edge_angles([60.0, 30]) == [30.0, 60.0]
    with pytest.raises(InputError, match="'None' is no edge angle"):
        edge_angles(None)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (["banana"], "sssi ski turn: SKI: no ski is called 'banana'; use one of: "),
        (["missing.toml"], "missing.toml"),
        (["slalom_165", "--speed", "0"], "speed"),
        (["slalom_165", "--load", "1e9"], "load"),
        (["slalom_165", "--edge", "90"], "--edge: '90' goes beyond 5 to 75 degrees"),
        (["slalom_165"] * 11, "SKI: 11 skis are too many"),
    ],
)
def test_bad_input_is_one_clear_line(
    arguments: list[str], line: str, capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as end:
        main(["ski", "turn", *arguments])
    assert end.value.code == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert line in said.err
    assert said.err.count("\n") == 1


def check_power(row: str) -> None:
    """Drag, power, three losses and what is left over, as the page has them."""
    cells = re.findall(r"<td[^>]*>(.*?)</td>", row)
    drag, power, *losses, left, _, _ = (float(re.sub(r"[^-0-9.]", "", cell)) for cell in cells)
    assert power == pytest.approx(sum(losses) + left, abs=2.5)  # five numbers rounded to 1 W
    assert abs(left) < 5e-3 * power + 0.5  # the turn still swings a little
    assert drag * 10.0 == pytest.approx(power, rel=0.03)  # N, rounded, times the speed along the ski: 10 m/s


@pytest.mark.long
def test_two_skis_side_by_side(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    asked = ["ski", "turn", "slalom_165", "voile_v6_183", "--edge", "45", "--speed", "10"]
    with pytest.raises(SystemExit) as end:
        main([*asked, "--json", "turns.json", "--out", "turns.html"])
    assert end.value.code == 0
    assert capsys.readouterr().out == ""
    rows = json.loads(Path("turns.json").read_text(encoding="utf-8"))
    assert [row["ski"] for row in rows] == ["slalom_165", "voile_v6_183"]
    for row in rows:
        assert list(row) == ["ski", "edge_deg", "radius_m", "radius_low_m", "radius_high_m", "side_reserve"]
        assert row["edge_deg"] == 45.0
        assert 0.0 < row["radius_low_m"] < row["radius_m"] < row["radius_high_m"]
        assert 0.0 < row["side_reserve"] < 1.0
    assert rows[0]["radius_m"] < rows[1]["radius_m"]
    page = Path("turns.html").read_text(encoding="utf-8")
    for word in (
        "voile_v6_183",
        "backcountrymagazine.com",
        "side reserve",
        "pressure (kN/m)",
        "hardness",
        "S_f·a, u = U + h·v_n",  # the formula to its end
        "Against slalom_165",
    ):
        assert word in page
    assert re.search(r'class="result">voile_v6_183 turns \d+ % wider at 45°, compared with slalom_165', page)
    assert "square to the base: 990 N at 45°" in page  # 700 N along the normal over the cosine
    for word in ("sidecut radius", "bending stiffness EI", "torsional stiffness GJ", "width (mm)"):
        assert word in page
    powers = re.findall(r">45°</th>(<td.*? W<.*?)</tr>", page)
    assert len(powers) == 2
    for row in powers:
        check_power(row)
    with pytest.raises(SystemExit) as end:
        main(["ski", "turn", "slalom_165", "--edge", "45"])
    assert end.value.code == 0
    assert sssi_exudyn.turn("slalom_165", edge=45) == rows[:1]
    table = capsys.readouterr().out.splitlines()
    assert table[0].split() == list(rows[0])
    assert float(table[1].split()[2]) == pytest.approx(rows[0]["radius_m"], rel=1e-3)  # four digits are shown
