"""Clocks that run fast or slow: which one and by how much, where a third instrument shows it; a notice where not."""

from __future__ import annotations

import re
import shutil
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from tiny import TOML, Tiny, motion

from sssi_exudyn.core.frames import Array
from sssi_exudyn.recording.cross_checks.pace import find_pace
from sssi_exudyn.recording.read import read_recording
from sssi_exudyn.recording.recording import Recording

EXAMPLES = Path(__file__).parents[3] / "examples"


def with_rate(folder: Path, name: str, instrument: str, factor: float, *, insoles: bool = True) -> Path:
    """Copy a bundled recording with the times of an instrument multiplied by ``factor``."""
    shutil.copytree(EXAMPLES / name, folder)
    if instrument == "motion":
        text = (folder / "motion.bvh").read_text(encoding="utf-8")
        declared = re.search(r"Frame Time:\s*(\S+)", text)
        assert declared is not None
        made = text.replace(declared[0], f"Frame Time: {float(declared[1]) * factor:.9f}")
        (folder / "motion.bvh").write_text(made, encoding="utf-8")
    else:
        path = folder / f"{instrument}.csv"
        head, *lines = path.read_text(encoding="utf-8").strip().split("\n")
        assert head.startswith("time_s,")
        rows = [line.partition(",") for line in lines]
        scaled = [f"{float(time) * factor:.6f},{rest}" for time, _, rest in rows]
        path.write_text("\n".join([head, *scaled]) + "\n", encoding="utf-8")
    if not insoles:
        toml = (folder / "recording.toml").read_text(encoding="utf-8")
        (folder / "recording.toml").write_text(toml.split("[insoles]")[0], encoding="utf-8")
    return folder


def times(recording: Recording) -> dict[str, Array]:
    assert recording.gps is not None
    assert recording.insoles is not None
    return {"motion": recording.bvh.time, "gps": recording.gps.time, "insoles": recording.insoles.time}


@pytest.mark.parametrize("instrument", ["motion", "gps", "insoles"])
@pytest.mark.parametrize(("name", "factor"), [("intermediate", 0.95), ("beginner", 1.1), ("intermediate", 1.05)])
def test_the_instrument_that_is_wrong_is_corrected(tmp_path: Path, name: str, instrument: str, factor: float) -> None:
    right = times(read_recording(EXAMPLES / name))
    recording = read_recording(with_rate(tmp_path / name, name, instrument, factor))
    (notice,) = (words for words in recording.notices if "its clock runs" in words)
    file = {"motion": "motion.bvh"}.get(instrument, f"{instrument}.csv")
    assert notice.startswith(f"{file}: ")
    assert f"{'slow' if factor < 1.0 else 'fast'} against" in notice
    shown = float(notice.split("multiplied by ")[1].split()[0])
    # a skier's balance shows a rate to half a percent, the least exact of the comparisons
    assert shown == pytest.approx(1.0 / factor, abs=0.007)
    for instrument_, time in times(recording).items():
        # half a percent of 15 s at the end of the run
        np.testing.assert_allclose(time, right[instrument_], atol=0.11)
    assert recording.uncertainty.clock > 0.005


@pytest.mark.parametrize(("name", "factor"), [("intermediate", 0.95), ("beginner", 1.05), ("intermediate", 1.02)])
def test_two_instruments_do_not_show_which_of_them_is_wrong(tmp_path: Path, name: str, factor: float) -> None:
    recording = read_recording(with_rate(tmp_path / name, name, "motion", factor, insoles=False))
    (notice,) = (words for words in recording.notices if "at the same pace" in words)
    shown = float(notice.split("capture is ")[1].split()[0])
    assert shown == pytest.approx(1.0 / factor, abs=0.01)
    unchanged = read_recording(EXAMPLES / name).bvh.time * factor
    np.testing.assert_allclose(recording.bvh.time, unchanged, atol=1e-5)  # nine digits of a frame's time


@pytest.mark.parametrize("factor", [1.2, 0.9, 1.25])
def test_a_frame_rate_that_is_far_off(tmp_path: Path, factor: float) -> None:
    rotations, gps = motion(swing=2.5)
    tiny = Tiny(toml=TOML.split("[insoles]")[0], rotations=rotations, gps=gps, frame_time=factor / 60.0)
    words = "\n".join(read_recording(tiny.write(tmp_path)).notices)
    shown = float(words.split("for the times of the capture is ")[1].split()[0])
    assert shown == pytest.approx(1.0 / factor, abs=0.02)  # two turns only


@pytest.mark.parametrize("name", ["beginner", "intermediate"])
def test_clocks_that_agree_are_left_alone(name: str) -> None:
    assert not [words for words in read_recording(EXAMPLES / name).notices if "clock" in words or "pace" in words]


@dataclass(frozen=True)
class Waves:
    """A wave of two seconds and its half tone, seen by two clocks of which one runs at ``rate`` and is ``late`` (s)."""

    rate: float
    late: float
    middle: float = 10.0
    span: float = 20.0
    floor: float = 1e-4

    def left(self, rate: float, offsets: Array) -> Array:
        """Return what another rate and offset leave of it."""
        time = np.linspace(0.0, 20.0, 201)
        at = self.middle + (time - self.middle - offsets[:, None]) / rate
        back = self.middle + self.rate * (at - self.middle) + self.late
        noise = 0.1 * np.sin(17.0 * time)
        seen, true = (np.sin(np.pi * t) + np.sin(1.9 * t) for t in (back, time))
        return np.asarray(np.mean((seen - true - noise) ** 2, axis=1) / np.var(true))


@pytest.mark.parametrize(("rate", "late"), [(1.0, 0.0), (0.95, 0.3), (1.01, -0.2), (1.08, 0.0)])
def test_rate_and_offset_of_a_known_wave_come_back(rate: float, late: float) -> None:
    pace = find_pace(Waves(rate, late))
    assert pace.rate == pytest.approx(np.log(rate), abs=4.0 * pace.sigma)
    assert pace.offset == pytest.approx(late, abs=0.02)
    assert pace.left < pace.as_is or rate == 1.0
    assert pace.sigma < 0.003
