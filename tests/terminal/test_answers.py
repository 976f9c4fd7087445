"""Answers on the terminal: a few lines, the answer first, then where the page is."""

from __future__ import annotations

from argparse import Namespace
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
from a_run import a_run
from tiny import Tiny

from sssi_exudyn.api.result import Result
from sssi_exudyn.recording.read import read_recording
from sssi_exudyn.sweeps.page import PAGE
from sssi_exudyn.sweeps.sensitivity_indices import COLUMNS
from sssi_exudyn.sweeps.sweep import INDICES
from sssi_exudyn.terminal.shown import show_counts, show_imported, show_muscles, show_result

COUNTS = {"name": "edges", "runs": 12, "done": 10, "diverged": 2, "failed": 0, "crashed": 0, "left": 0, "repeated": 0}


def asked(**options: Any) -> Namespace:
    return Namespace(json=False, verbose=False, **options)


def test_a_result_is_five_lines_with_interval_turns_agreement_verdict_and_page() -> None:
    interval = {"mu_t": {"low": 0.054, "high": 0.065}, "mu_n": {"low": 0.54, "high": 0.56}}
    uncertain = {
        "interval_90": interval, "shares": {}, "posture_rms_deg": {}, "largest": [], "noise": {}, "fits_priors": True,
    }  # fmt: skip
    run = a_run(14.0, uncertainty=uncertain, fit={"converged": True, "method": "joint"}, notices=["A remark."])
    lines = show_result(Result(run, {}, Path("out")), asked()).splitlines()
    assert len(lines) == 5
    assert "μ_t 0.061 (90\u00a0% interval 0.054 to 0.065); μ_n 0.550 (90\u00a0% interval 0.540 to 0.560)" in lines[0]
    assert lines[1].startswith("turns: 7 (in 14 s, 8.")
    assert "almost carved, parallel to 0°" in lines[1]
    assert lines[2].startswith("agreement: track 0.500 m (from the GPS on average")
    assert "load share 0\u00a0% (rms from the insoles, correlation 1.000)" in lines[2]
    assert lines[3].startswith("verdict: ✓ good. ")
    assert lines[4] == f"page: {Path('out') / 'report.html'} (--verbose prints every figure; 1 remark on the recording)"
    every = show_result(Result(run, {}, Path("out")), Namespace(json=False, verbose=True))
    assert every.endswith("\n".join(lines) + "\n")
    assert len(every.splitlines()) > 30


def test_a_result_in_memory_has_no_page_and_one_without_figures_says_so() -> None:
    bare = a_run(0.04, measured=False, friction=None, solver=None)
    lines = show_result(Result(bare, {}), asked()).splitlines()
    assert len(lines) == 5
    assert "no friction is known" in lines[0]
    assert "there is no GPS track" in lines[2]
    assert lines[4].startswith("page: none was written")


def test_a_sweep_says_what_is_done_what_matters_most_and_where_its_page_is(tmp_path: Path) -> None:
    assert show_counts(COUNTS, asked(out=tmp_path)).splitlines() == ["edges: 10 of 12 runs complete, 2 diverged"]
    rows = [("hill", "mean_speed_mps", "share", name, "", share, None, 10) for name, share in (("a", 0.2), ("b", 0.7))]
    pd.DataFrame(rows, columns=COLUMNS).to_csv(tmp_path / INDICES, index=False)
    (tmp_path / PAGE).write_text("", encoding="utf-8")
    lines = show_counts(COUNTS, asked(folder=tmp_path)).splitlines()
    assert lines[1:] == ["mean_speed_mps: b matters most (share 0.7)", f"page: {tmp_path / PAGE}"]
    running = {**COUNTS, "running": True, "per_minute": 30.0, "time_left_s": 90.0}
    assert "running, 30 a minute, 90 s left" in show_counts(running, asked(folder=tmp_path / "new"))


def test_an_import_says_what_was_made_and_what_comes_next(tmp_path: Path) -> None:
    recording = read_recording(Tiny().write(tmp_path))
    first, *notes, last = show_imported(recording, asked(out=Path("monday"))).splitlines()
    assert first == "monday: a recording of 8.0 s with motion, gps, insoles"
    assert len(notes) == len(recording.notices)
    assert last == "next: sssi inspect monday, then sssi run monday --out monday_result"


@pytest.mark.parametrize("lacking", [True, False])
def test_muscles_say_whether_they_suffice(lacking: bool) -> None:
    joint = {
        "coordinate": "hip_flexion_l", "share_of_samples": 0.02, "worst_Nm": 31.0, "wanted_then_Nm": 90.0, "at_s": 2.5,
    }  # fmt: skip
    figures = {
        "count": 322, "power": 3, "samples": 100, "wall_s": 1.0, "strong_enough_share": 0.98, "reserve": {},
        "lacking": [joint] if lacking else [], "contact_peak_bodyweights": {"knee_l": 3.21, "hip_l": 4.0},
    }  # fmt: skip
    lines = show_muscles(Result(a_run(1.0, muscles=figures), {}, Path("out")), asked()).splitlines()
    assert "322 muscles make all joint moments in 98 % of the samples" in lines[0]
    assert lines[1] == "largest joint loads (body weights): hip l 4.0, knee l 3.2"
    assert lines[2] == f"lacking at most: {'hip flexion l 31 N m at 2.5 s' if lacking else 'nothing'}"
    assert len(lines) == 4
