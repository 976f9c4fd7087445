"""A season from files to the page: nothing is lost, nothing is done twice, and only what has changed is done again."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pandas as pd
import pyarrow.parquet as pq
import pytest
from tiny import Tiny

import sssi_exudyn
from sssi_exudyn.api import runs
from sssi_exudyn.cli import main
from sssi_exudyn.core.errors import InputError, SssiError
from sssi_exudyn.results.data_dictionary import season_columns
from sssi_exudyn.sweeps.records import last_records

ROOT = Path(__file__).parents[2]
pytestmark = pytest.mark.usefixtures("words_only", "coarse_skis")
STRETCH = ":2.2"
"""Two seconds are the shortest run; here they are simulated without a fit, which takes a second."""
NAMES = ["club/b", "club/c", "monday"]


def write_season(folder: Path) -> Path:
    """Write files of three runs, one of them in a folder of its own, and two that cannot be read."""
    first = Tiny().write(folder / "monday")
    (first / "recording.toml").unlink()
    club = folder / "club"
    club.mkdir()
    for name in ("b", "c"):
        for kind in ("motion.bvh", "gps.csv"):
            shutil.copy(first / kind, club / f"{name}{Path(kind).suffix}")
    (folder / "letter.docx").write_bytes(b"no run")
    (folder / "broken.gpx").write_text("<gpx", encoding="utf-8")
    return folder


@pytest.fixture(scope="module")
def recordings(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("season")
    given = ["--mass-kg", "70", "--height-m", "1.65", "--skier", "Ada"]
    with pytest.raises(SystemExit) as end:
        main(["import", str(write_season(folder / "files")), "--out", str(folder / "runs"), *given])
    assert end.value.code == 1  # not all of it could be read
    return folder / "runs"


@pytest.fixture
def simulated(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Simulate where a season fits, and return the names of the recordings in the order of their runs."""
    names: list[str] = []

    def simulate(recording: Any, out: Path, *, quick: bool, **options: Any) -> Any:
        assert not quick
        names.append(recording.folder.name)
        return runs.simulate(recording, out, **options)

    monkeypatch.setattr(runs, "fit", simulate)
    return names


def done(folder: Path, out: Path) -> sssi_exudyn.SeasonResult:
    return sssi_exudyn.run_season(folder, out, workers=1, seconds=STRETCH)


def test_an_import_lists_what_it_read_and_what_it_could_not(recordings: Path) -> None:
    table = pd.read_csv(recordings / "recordings.csv", keep_default_na=False).set_index("recording")
    assert table["status"].to_dict() == {
        "broken": "failed", "club/b": "imported", "club/c": "imported", "monday": "imported", "letter.docx": "not read",
    }  # fmt: skip
    assert "broken XML" in table.loc["broken", "error"]
    assert table["error"].str.len().max() < 300
    assert sssi_exudyn.read_recording(recordings / "club" / "b").skier.name == "Ada"


@pytest.mark.long(seconds=20)
def test_a_season_is_one_table_and_one_page(recordings: Path, simulated: list[str], tmp_path: Path) -> None:
    season = done(recordings, tmp_path / "out")
    assert simulated == ["b", "c", "monday"]
    assert season.counts == {"runs": 3, "done": 3, "diverged": 0, "failed": 0, "crashed": 0, "left": 0}
    table = season.table
    assert sorted(table.loc[table["status"] == "done", "run"]) == NAMES
    assert set(table.loc[table["status"] != "done", "run"]) == {"broken", "letter.docx"}
    rows = table[table["status"] == "done"]
    assert set(rows["place"]) == {"A"}  # one track, three times
    assert set(rows["skier"]) == {"Ada"}
    assert rows["mean_speed_mps"].between(1.0, 20.0).all()
    assert rows["technique"].tolist() == [""] * 3  # no result says it
    assert table.columns.tolist() == [column.name for column in season_columns()]
    assert pd.read_csv(tmp_path / "out" / "season.csv")["run"].tolist() == table["run"].tolist()
    field = pq.read_schema(tmp_path / "out" / "season.parquet").field("vertical_m")
    assert field.metadata[b"unit"] == b"m"
    page = season.page.read_text(encoding="utf-8")
    assert 'href="club/b/report.html"' in page
    assert "letter.docx" in page
    origin = json.loads((tmp_path / "out" / "season.json").read_text(encoding="utf-8"))
    assert set(origin["provenance"]["inputs"]) == set(NAMES)
    assert origin["provenance"]["settings"] == {"seconds": [None, 2.2]}
    assert str(tmp_path) not in json.dumps(origin)
    assert sssi_exudyn.load_season(tmp_path / "out").counts == season.counts


@pytest.mark.long(seconds=20)
def test_a_bad_run_is_a_row_and_only_what_changes_is_done_again(
    recordings: Path, simulated: list[str], tmp_path: Path
) -> None:
    folder = tmp_path / "runs"
    shutil.copytree(recordings, folder)
    toml = folder / "club" / "c" / "recording.toml"
    sound = toml.read_text(encoding="utf-8")
    toml.write_text(sound.replace("mass_kg = 70.0", "mass_kg = 700.0"), encoding="utf-8")
    season = done(folder, tmp_path / "out")
    assert simulated == ["b", "monday"]
    assert (season.counts["done"], season.counts["failed"]) == (2, 1)
    row = season.table.set_index("run").loc["club/c"]
    assert "700 is outside" in row["error"]
    assert row["skier"] == "Ada"

    done(folder, tmp_path / "out")
    assert simulated == ["b", "monday"]  # nothing has changed

    toml.write_text(sound, encoding="utf-8")
    assert done(folder, tmp_path / "out").counts["done"] == 3
    assert simulated == ["b", "monday", "c"]

    track = folder / "monday" / "gps.csv"
    track.write_text(track.read_text(encoding="utf-8") + "\n", encoding="utf-8")
    assert done(folder, tmp_path / "out").counts["done"] == 3
    assert simulated == ["b", "monday", "c", "monday"]


KILLED = """
import os, signal, sys
import sssi_exudyn
from sssi_exudyn.api import runs

def simulate_one(recording, out, *, quick, **options):
    if recording.folder.name == "c":
        os.kill(os.getpid(), signal.SIGKILL)
    return runs.simulate(recording, out, **options)

runs.fit = simulate_one
sssi_exudyn.run_season(sys.argv[1], sys.argv[2], workers=1, seconds=sys.argv[3])
"""


@pytest.mark.long(seconds=20)
def test_a_season_that_was_killed_goes_on(recordings: Path, simulated: list[str], tmp_path: Path) -> None:
    out = tmp_path / "out"
    ended = subprocess.run([sys.executable, "-c", KILLED, str(recordings), str(out), STRETCH], cwd=ROOT, check=False)
    assert ended.returncode == -9
    assert len(last_records(out)[0]) == 1
    assert not (out / "season.csv").exists()
    assert done(recordings, out).counts["done"] == 3
    assert simulated == ["c", "monday"]
    assert last_records(out)[1] == 0


def test_what_is_no_season_is_refused(tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    with pytest.raises(InputError, match="no folder in it holds a recording"):
        sssi_exudyn.run_season(tmp_path / "empty", tmp_path / "out", workers=1)
    with pytest.raises(InputError, match="holds no season"):
        sssi_exudyn.load_season(tmp_path)
    with pytest.raises(SssiError, match="did you mean 'wind'"):
        sssi_exudyn.run_season(tmp_path / "empty", tmp_path / "out", workers=1, terms=["winds"])
