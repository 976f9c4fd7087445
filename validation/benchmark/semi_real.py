"""Semi-real runs: recordings from the field with a concealed fault of an instrument, diagnosed.

It is unknown what else is wrong with a run from the field.  So each run is diagnosed untouched first: findings then
were not concealed, and the noise of the fixes that it shows is the unit in which sizes of faults are measured.  Each
case leaves one file; a benchmark that was interrupted continues with the missing ones.

A fault is added once the recording is read.  Where the posture is made of few sensors, reading it has already used the
fixes: it would take off a late clock itself, as it does with the receiver's own lag.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final, Literal
from zlib import crc32

import numpy as np

from sssi_exudyn.core.advance import Advance
from sssi_exudyn.core.errors import InputError, SimulationDiverged
from sssi_exudyn.core.frames import Array, level_to_enu
from sssi_exudyn.core.new_files import make_folder
from sssi_exudyn.core.quantity import quantities
from sssi_exudyn.fitting.observations import track_of
from sssi_exudyn.io.typed import read_json
from sssi_exudyn.io.writing import clear_errors, to_json, write_atomically
from sssi_exudyn.model.faults import GpsJump
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.model.model import Start
from sssi_exudyn.motion.from_recording import motion_from_recording
from sssi_exudyn.motion.motion import Motion
from sssi_exudyn.recording.instruments.gps import Gps
from sssi_exudyn.recording.recording import Recording
from sssi_exudyn.runtime.provenance import provenance
from sssi_exudyn.validation.benchmark.known_answers import NOTHING
from sssi_exudyn.validation.benchmark.scores import inside_90, overlap
from sssi_exudyn.validation.diagnosis.diagnose import diagnose
from sssi_exudyn.validation.diagnosis.diagnosis_data import Diagnosis
from sssi_exudyn.validation.diagnosis.hypotheses.instruments.gps_delay import GpsDelay
from sssi_exudyn.validation.diagnosis.hypotheses.instruments.gps_jump import DisplacedFixes
from sssi_exudyn.validation.diagnosis.hypotheses.instruments.heading_misalignment import HeadingMisalignment

PROVENANCE: Final = "provenance.json"
FEWEST_FIXES: Final = 12
"""Least number of fixes of a stretch, so that a fault of a fifth of it touches some."""
_WITHIN: Final = 0.85
"""Largest share of a number's bounds that a fault reaches: beyond them the model cannot hold it."""


@dataclass(frozen=True)
class Stretch:
    """The diagnosed part of a recorded run; ``begin`` and ``end`` in s."""

    recording: Recording
    begin: float
    end: float

    @property
    def gps(self) -> Gps:
        """Fixes of the receiver.  Raises ValueError without a GPS."""
        if self.recording.gps is None:
            raise ValueError("the recording has no GPS")
        return self.recording.gps

    @property
    def motion(self) -> Motion:
        """Captured movement of the stretch."""
        return replace(motion_from_recording(self.recording), start=self.begin, stop=self.end)

    @property
    def fixes(self) -> tuple[Array, Array]:
        """Times (n,) s and places (n, 2) m in the level frame of its fixes."""
        track = track_of(self.gps, self.recording.slope.fall_line_azimuth, self.begin, self.end)
        return track.time, track.place

    @property
    def stated(self) -> float:
        """Median standard deviation (m) that the receiver states of its fixes."""
        inside = self.gps.between(self.begin, self.end)
        return float(np.median(self.gps.sigma[inside]))


@dataclass(frozen=True)
class Fault:
    """A fault in the data.

    recording : with the fault;  moved : root mean square distance (m) by which it moves the fixes that it touches
    numbers : its size, by the names of its hypothesis' own numbers;  window : times (s) between which it acts, None for
        always
    """

    recording: Recording
    moved: float
    numbers: dict[str, float]
    window: tuple[float, float] | None = None


def middle(recording: Recording, motion: Motion, seconds: float) -> Stretch:
    """Return the middle of a run, of that length, or the whole of a shorter one.

    Raises ValueError without a GPS, or where it has too few fixes there.
    """
    spare = max(0.0, 0.5 * (motion.stop - motion.start - seconds))
    stretch = Stretch(recording, motion.start + spare, motion.stop - spare)
    count = len(stretch.fixes[0])
    if count < FEWEST_FIXES:
        raise ValueError(f"{count} fixes in {stretch.end - stretch.begin:.0f} s are too few")
    return stretch


def _late_clock(rng: np.random.Generator, run: Stretch, distance: float) -> Fault:
    time, place = run.fixes
    speed = float(np.sqrt(np.mean(np.sum(np.gradient(place, time, axis=0) ** 2, axis=1))))
    late = min(distance / speed, _WITHIN * quantities(Start())["clock_offset"].high)
    recording = replace(run.recording, gps=replace(run.gps, time=run.gps.time + late))
    return Fault(recording, late * speed, {"clock_offset": late})


def _displaced_fixes(rng: np.random.Generator, run: Stretch, distance: float) -> Fault:
    long = run.end - run.begin
    lasts = float(rng.uniform(0.2, 0.35)) * long
    begin = run.begin + float(rng.uniform(0.1 * long, 0.9 * long - lasts))
    moved = min(distance, _WITHIN * quantities(GpsJump())["x"].high)
    turn = float(rng.uniform(0.0, 2.0 * np.pi))
    level = moved * np.array([np.cos(turn), np.sin(turn), 0.0])
    inside = (run.gps.time >= begin) & (run.gps.time < begin + lasts)
    offset = inside[:, None] * (level_to_enu(run.recording.slope.fall_line_azimuth) @ level)
    recording = replace(run.recording, gps=replace(run.gps, enu=run.gps.enu + offset))
    return Fault(recording, moved, {"x": float(level[0]), "y": float(level[1])}, (begin, begin + lasts))


def _turned_capture(rng: np.random.Generator, run: Stretch, distance: float) -> Fault:
    """Turn the capture clockwise, which a turn to the left corrects."""
    _, place = run.fixes
    reach = float(np.sqrt(np.mean(np.sum((place - place.mean(axis=0)) ** 2, axis=1))))
    turn = min(distance / reach, _WITHIN * quantities(Start())["heading_offset"].high)
    sign = 1.0 if rng.uniform() < 0.5 else -1.0
    heading = replace(run.recording.heading, value=run.recording.heading.value + sign * turn)
    return Fault(replace(run.recording, heading=heading), turn * reach, {"heading_offset": sign * turn})


FAULTS: Final[dict[str, Callable[[np.random.Generator, Stretch, float], Fault]]] = {
    GpsDelay.name: _late_clock,
    DisplacedFixes.name: _displaced_fixes,
    HeadingMisalignment.name: _turned_capture,
}
"""Makers of faults that move the fixes by a distance (m), by the names of the hypotheses that explain them."""


def conceal(name: str, run: Stretch, distance: float, seed: int) -> Fault:
    """Conceal the fault of that name, at the same place and in the same direction whatever its size."""
    drawn = [seed, crc32(run.recording.name.encode()), list(FAULTS).index(name)]
    return FAULTS[name](np.random.default_rng(drawn), run, distance)


@dataclass(frozen=True)
class SemiReal:
    """A case as in its file.

    fault : its hypothesis' name, "none" for an untouched run;  times : its requested size, in units of the noise
    moved_m, numbers, window : as in a ``Fault``
    noise_m : root mean square error of a fix's place, as the untouched run shows it, None where that is not known
    stated_m : standard deviation that the receiver states;  begin_s, end_s, fixes : of the stretch
    failed : reason why it could not be diagnosed
    """

    recording: str
    fault: str
    times: float
    begin_s: float
    end_s: float
    fixes: int
    stated_m: float
    noise_m: float | None = None
    moved_m: float | None = None
    numbers: dict[str, float] = field(default_factory=dict)
    window: tuple[float, float] | None = None
    failed: str | None = None
    diagnosis: Diagnosis | None = None


Verdict = Literal["right", "in the set", "wrong name", "not found", "nothing claimed", "claimed", "failed"]


@dataclass(frozen=True)
class Answer:
    """Comparison of a case with the findings.

    times : movement of the fixes by the fault, in units of the noise; less than requested where the model cannot hold
        more
    found : the findings' names, joined by " and ";  probability : of the first, None without one
    answer : "right" where a finding has the fault's name, "in the set" where one has it among its alternatives; for an
        untouched run, whether one of the three faults is claimed
    overlap : intersection over union of the times found and concealed, None where either has none
    sized : whether the 90 % intervals hold all of the fault's numbers, None unless it is rightly named
    """

    recording: str
    fault: str
    times: float
    verdict: str
    found: str
    probability: float | None
    alternatives: tuple[str, ...]
    answer: Verdict
    overlap: float | None
    sized: bool | None


def judge(case: SemiReal) -> Answer:
    """Compare the findings with a case's fault."""
    times = 0.0 if case.moved_m is None or not case.noise_m else case.moved_m / case.noise_m
    if case.diagnosis is None:
        return Answer(case.recording, case.fault, times, "", "", None, (), "failed", None, None)
    findings = case.diagnosis.findings
    names = [finding.name for finding in findings]
    others = tuple(sorted({other.name for finding in findings for other in finding.alternatives}))
    right = next((finding for finding in findings if finding.name == case.fault), None)
    placed, sized = None, None
    if right is not None:
        sized = all(inside_90(case.numbers, right))
        if right.where is not None and case.window is not None:
            placed = overlap(case.window, right.where)
    return Answer(
        recording=case.recording,
        fault=case.fault,
        times=times,
        verdict=case.diagnosis.verdict,
        found=" and ".join(names) or NOTHING,
        probability=findings[0].probability if findings else None,
        alternatives=others,
        answer=_answer(case.fault, names, others),
        overlap=placed,
        sized=sized,
    )


def _answer(fault: str, names: Sequence[str], others: Sequence[str]) -> Verdict:
    if fault == NOTHING:
        return "claimed" if any(name in FAULTS for name in names) else "nothing claimed"
    if fault in names:
        return "right"
    if fault in others:
        return "in the set"
    return "wrong name" if names else "not found"


def run_semi_real(
    folder: Path, runs: Sequence[Stretch], *, sizes: Sequence[float], seed: int, progress: Advance
) -> list[Answer]:
    """Diagnose each run untouched and with every fault at every size, by the reduced model, into ``folder``.

    Each case has a file in a folder of the run's name.  A size that the model's bounds cut to that of a smaller one is
    left out.

    Raises InputError where ``folder`` holds results of another version, or of other runs or settings.
    """
    _keep_provenance(folder, runs, sizes, seed)
    planned = [(name, times) for times in sorted(sizes) for name in FAULTS]
    count = len(runs) * (1 + len(planned))
    answers: list[Answer] = []
    for run in runs:
        for case in _cases(folder, run, planned, seed, lambda text: progress(len(answers) / count, text)):
            answers.append(judge(case))
            progress(len(answers) / count, f"{len(answers)} of {count} at most")
    write_atomically(folder / "answers.json", to_json(answers))
    return answers


def _cases(
    folder: Path, run: Stretch, planned: Sequence[tuple[str, float]], seed: int, say: Callable[[str], None]
) -> Iterator[SemiReal]:
    """Yield every case of a run, untouched first; that alone where it cannot be diagnosed."""
    time, _ = run.fixes
    plain = SemiReal(run.recording.name, NOTHING, 0.0, run.begin, run.end, len(time), run.stated)
    untouched = _read_or_diagnose(folder, plain, run, say)
    yield untouched
    diagnosis = untouched.diagnosis
    if diagnosis is None:
        return
    noise = float(np.sqrt(2.0)) * diagnosis.noise.gps_sigma_m  # not what a simulation misses: it is led along the fixes
    largest = dict.fromkeys(FAULTS, 0.0)
    for name, times in planned:
        fault = conceal(name, run, times * noise, seed)
        if fault.moved <= largest[name]:
            continue  # at the model's bounds already
        largest[name] = fault.moved
        case = replace(
            plain,
            fault=name,
            times=times,
            noise_m=noise,
            moved_m=fault.moved,
            numbers=fault.numbers,
            window=fault.window,
        )
        yield _read_or_diagnose(folder, case, replace(run, recording=fault.recording), say)


def _read_or_diagnose(folder: Path, case: SemiReal, run: Stretch, say: Callable[[str], None]) -> SemiReal:
    """Return the case with its diagnosis, from its file where there is one."""
    path = folder / case.recording / f"{case.fault}_{case.times:g}.json"
    if path.exists():
        return read_json(path, SemiReal)
    about = f"{case.recording}, {case.fault} {case.times:g}"
    motion = run.motion
    try:
        outcome = diagnose(
            run.recording,
            motion,
            model_of(run.recording, motion),
            full=False,
            progress=lambda _share, detail: say(f"{about}: {detail}"),
        )
        done = replace(case, diagnosis=replace(outcome.diagnosis, tier="reduced"))
    except SimulationDiverged as error:
        done = replace(case, failed=str(error))
    with clear_errors(path.parent):
        make_folder(path.parent)
    write_atomically(path, to_json(done))
    return done


def _keep_provenance(folder: Path, runs: Sequence[Stretch], sizes: Sequence[float], seed: int) -> None:
    hashes = {f"{run.recording.name}/{file}": digest for run in runs for file, digest in run.recording.hashes.items()}
    stretches = {run.recording.name: [run.begin, run.end] for run in runs}
    settings: dict[str, Any] = {"command": "benchmark semi-real", "sizes": list(sizes), "stretches_s": stretches}
    text = to_json(provenance(hashes, settings, seed))
    path = folder / PROVENANCE
    if path.exists() and path.read_text(encoding="utf-8") != text:
        raise InputError(
            path, "", "made by another version, or of other recordings or sizes", "choose another folder with --out"
        )
    write_atomically(path, text)
