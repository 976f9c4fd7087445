"""Faults that are concealed in the data of a recording, and their diagnoses."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from a_diagnosis import diagnosis_of, finding_of
from bundled import bundled

from sssi_exudyn.api.benchmark import semi_real as semi_real_command
from sssi_exudyn.core.errors import InputError, SimulationDiverged
from sssi_exudyn.fitting.observations import correct_fixes
from sssi_exudyn.io.typed import read_json
from sssi_exudyn.model.faults import GpsJump
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.motion.motion import turn_motion
from sssi_exudyn.validation.benchmark import semi_real
from sssi_exudyn.validation.benchmark.semi_real import FAULTS, SemiReal, Stretch, conceal, judge, middle, run_semi_real
from sssi_exudyn.validation.diagnosis.diagnosis_data import Adequacy, Diagnosis, Finding, Number, Where


@pytest.fixture(scope="module")
def run() -> Stretch:
    return middle(*bundled("beginner"), 6.0)


def test_a_stretch_is_the_middle_of_its_run() -> None:
    recording, motion = bundled("beginner")
    run = middle(recording, motion, 6.0)
    assert run.end - run.begin == pytest.approx(6.0)
    assert run.begin - motion.start == pytest.approx(motion.stop - run.end)
    assert (run.motion.start, run.motion.stop) == (run.begin, run.end)
    full_run = middle(recording, motion, 1000.0)
    assert (full_run.begin, full_run.end) == (motion.start, motion.stop)
    with pytest.raises(ValueError, match=r"fixes in 1 s are too few"):
        middle(recording, motion, 1.0)
    with pytest.raises(ValueError, match="no GPS"):
        middle(replace(recording, gps=None), motion, 6.0)


@pytest.mark.parametrize("name", FAULTS)
def test_a_fault_is_what_its_hypothesis_takes_off_again(name: str, run: Stretch) -> None:
    fault = conceal(name, run, 0.5, seed=1)
    recording, numbers = fault.recording, fault.numbers
    assert fault.moved == pytest.approx(0.5)
    model = model_of(run.recording, run.motion)
    if "heading_offset" in numbers:
        turned = turn_motion(
            replace(run, recording=recording).motion, lambda time: np.full(len(time), numbers["heading_offset"])
        )
        # the chain is fitted again to the turned capture
        instants = np.linspace(run.begin, run.end, 50)
        assert np.max(np.abs(turned.evaluate(instants)[0] - run.motion.evaluate(instants)[0])) < 1e-6
        return
    if fault.window is not None:
        jump = GpsJump(numbers["x"], numbers["y"], *fault.window)
        assert run.begin < jump.t0 < jump.t1 < run.end
        model = replace(model, sensors=(jump,))
    else:
        model = model.with_values({f"start.{key}": value for key, value in numbers.items()})
    corrected = correct_fixes(recording.gps, model)
    assert np.max(np.abs(corrected.time - run.gps.time)) < 1e-9
    assert np.max(np.abs(corrected.enu - run.gps.enu)) < 1e-9
    if fault.window is not None:
        touched = np.any(recording.gps.enu != run.gps.enu, axis=1)
        assert 0 < np.count_nonzero(touched) < 0.4 * len(run.fixes[0])


@pytest.mark.parametrize("name", FAULTS)
def test_faults_of_all_sizes_are_alike_and_within_the_model_s_bounds(name: str, run: Stretch) -> None:
    small, large, huge = (conceal(name, run, distance, seed=1) for distance in (0.1, 0.2, 1e4))
    for key, value in small.numbers.items():
        assert large.numbers[key] == pytest.approx(2.0 * value)
    assert small.window == huge.window
    assert huge.moved < 1e4
    drawn = {tuple(conceal(name, run, 0.1, seed).numbers.values()) for seed in range(8)}
    assert len(drawn) == 1 if name == "gps_delay" else len(drawn) > 1  # a clock is always late, a turn goes either way


def diagnosis_with(*findings: Finding) -> Diagnosis:
    return replace(diagnosis_of(*findings), adequacy=Adequacy(0.1, 0.5))


def case_of(fault: str, diagnosis: Diagnosis | None) -> SemiReal:
    window = (2.5, 4.5) if fault == "gps_jump" else None
    return SemiReal("a", fault, 3.0, 0.0, 6.0, 60, 0.02, 0.1, 0.3, {"w_f": -5.5}, window, diagnosis=diagnosis)


def test_what_was_found_against_what_was_concealed() -> None:
    jump = finding_of("gps_jump", 0.9)
    answer = judge(case_of("gps_jump", diagnosis_with(jump)))
    assert (answer.answer, answer.found, answer.probability, answer.sized) == ("right", "gps_jump", 0.9, True)
    assert answer.times == pytest.approx(3.0)
    assert answer.overlap == pytest.approx(1.5 / 2.5)  # 2 s to 4 s against 2.5 s to 4.5 s
    far = replace(
        jump, parameters={"w_f": Number(0.0, -1.0, 1.0, "m/s")}, where=Where(5.0, 6.0, (0.0, 1.0), "both", ())
    )
    wrong = judge(case_of("gps_jump", diagnosis_with(far)))
    assert (wrong.overlap, wrong.sized) == (0.0, False)
    other = finding_of("gust", 0.5, ("gps_jump", 0.4))
    assert judge(case_of("gps_jump", diagnosis_with(other))).answer == "in the set"
    assert judge(case_of("gps_delay", diagnosis_with(other))).answer == "wrong name"
    assert judge(case_of("gps_delay", diagnosis_with())).answer == "not found"
    assert judge(case_of("gps_delay", None)).answer == "failed"
    assert judge(case_of("none", diagnosis_with(other))).answer == "nothing claimed"
    assert judge(case_of("none", diagnosis_with(jump))).answer == "claimed"


@pytest.fixture
def diagnosed(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Return the names of the recordings that were diagnosed; those named "lost" cannot be."""
    names: list[str] = []

    def diagnose(recording: Any, *_: Any, **__: Any) -> Any:
        names.append(recording.name)
        if recording.name == "lost":
            raise SimulationDiverged(1.0, "the run")
        return SimpleNamespace(diagnosis=diagnosis_with())

    monkeypatch.setattr(semi_real, "diagnose", diagnose)
    return names


@pytest.mark.long
def test_a_benchmark_goes_on_where_it_was(tmp_path: Path, run: Stretch, diagnosed: list[str]) -> None:
    messages: list[str] = []

    def again(runs: list[Stretch], sizes: list[float]) -> Any:
        return run_semi_real(tmp_path, runs, sizes=sizes, seed=1, progress=lambda _share, text: messages.append(text))

    lost = replace(run, recording=replace(run.recording, name="lost"))
    answers = again([run, lost], [3.0])
    assert [answer.answer for answer in answers] == ["nothing claimed", *["not found"] * 3, "failed"]
    assert [answer.times for answer in answers[1:4]] == pytest.approx([3.0] * 3)
    assert diagnosed == [*[run.recording.name] * 4, "lost"]
    assert messages[-1] == "5 of 8 at most"
    stored = read_json(tmp_path / run.recording.name / "gps_jump_3.json", SemiReal)
    assert stored.noise_m == pytest.approx(np.sqrt(2.0) * 0.02)  # of both axes
    assert stored.diagnosis is not None
    assert stored.diagnosis.tier == "reduced"
    (tmp_path / run.recording.name / "gps_jump_3.json").unlink()
    assert again([run, lost], [3.0]) == answers
    assert len(diagnosed) == 6
    with pytest.raises(InputError, match="of other recordings or sizes; choose another folder"):
        again([run, lost], [10.0])


@pytest.mark.long
def test_a_size_beyond_the_bounds_is_asked_for_once(tmp_path: Path, run: Stretch, diagnosed: list[str]) -> None:
    sizes = [1e4, 2e4]
    answers = run_semi_real(tmp_path, [run], sizes=sizes, seed=1, progress=lambda _share, _text: None)
    assert [answer.fault for answer in answers] == ["none", *FAULTS]
    assert all(answer.times < 1e4 for answer in answers)


@pytest.mark.long
def test_what_cannot_be_used_is_one_clear_line(tmp_path: Path, diagnosed: list[str]) -> None:
    beginner = Path("examples/beginner").resolve()
    usual: Any = {"sizes": [3.0], "seed": 1}
    with pytest.raises(InputError, match=r"\[gps\]: .* fixes in 1 s are too few; leave this recording out"):
        semi_real_command([beginner], tmp_path, seconds=1.0, **usual)
    with pytest.raises(InputError, match="two recordings would leave their results here"):
        semi_real_command([beginner, beginner], tmp_path, seconds=6.0, **usual)
    with pytest.raises(InputError, match=r"recording\.toml"):
        semi_real_command([beginner, tmp_path], tmp_path / "out", seconds=6.0, **usual)
    assert diagnosed == []
    rows = semi_real_command([beginner], tmp_path / "out", seconds=6.0, **usual)
    assert {row.recording for row in rows} == {"beginner"}
    assert (tmp_path / "out" / "beginner" / "none_0.json").is_file()
