"""The work of ``sssi whatif``: a recorded run with something changed, into a folder of plain files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np
import pandas as pd

from sssi_exudyn.commands.runs import choose_model, fit_recording, lock_of, open_recording
from sssi_exudyn.core.choices import Keep
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.text import one_line
from sssi_exudyn.io.typed import convert
from sssi_exudyn.io.writing import to_json, write_atomically
from sssi_exudyn.model.model import PRESETS, Model
from sssi_exudyn.recording.inspection_plot import picture, save_picture
from sssi_exudyn.recording.recording import FILE
from sssi_exudyn.results.folder import SUMMARY
from sssi_exudyn.results.stored import StoredRun, read_run
from sssi_exudyn.results.summary import Provenance
from sssi_exudyn.runtime.progress import Progress
from sssi_exudyn.runtime.provenance import provenance
from sssi_exudyn.simulation.full.run import simulate
from sssi_exudyn.sweeps.asked_model import COMMAND, change_model, check_gates, check_steering, gates_of
from sssi_exudyn.what_if.answer import WhatIf, answer_of, off_path, seconds_lost
from sssi_exudyn.what_if.fastest import solutions
from sssi_exudyn.what_if.intent import SPEED
from sssi_exudyn.what_if.question import Played, Question
from sssi_exudyn.what_if.recorded_run import recorded_run
from sssi_exudyn.what_if.solve import Solution

RECORDED: Final = "recorded"
"""Folder within an answer: the result of the recording's fit."""
ANSWER: Final = "whatif.json"
_MOST: Final = 50


def read_changes(given: Sequence[str]) -> dict[str, float]:
    """Read changed numbers, ``NAME=VALUE`` each.  Raises InputError for anything else."""
    pairs = [text.partition("=")[::2] for text in given]
    if len(pairs) > _MOST:
        raise InputError(COMMAND, "--set", f"{len(pairs)} changes are too many", f"give {_MOST} at most")
    changes: dict[str, float] = {}
    for name, text in pairs:
        try:
            changes[name] = float(text)
        except ValueError:
            changes[name] = float("nan")
        if not np.isfinite(changes[name]):
            problem = f"{one_line(name)} is given no number"
            raise InputError(COMMAND, "--set", problem, "write NAME=VALUE, such as friction.mu_t=0.12")
    return changes


def ask(
    folder: Path,
    out: Path | None,
    changes: Mapping[str, float],
    ski: str | None,
    keep: Keep,
    *,
    reduced: bool,
    progress: Progress,
) -> WhatIf:
    """Answer a what-if of the result or recording in ``folder``, and write it into ``out`` if given.

    reduced : leave out the full model

    Raises InputError for bad input, and SimulationDiverged when the asked model cannot play the recorded movement.
    """
    check_gates(changes, keep, COMMAND, "--keep")
    with lock_of(out):
        stored = _stored(folder, out, progress)
        recorded = recorded_run(stored, folder)
        check_steering(recorded, keep, COMMAND, "--keep")
        asked = change_model(recorded.model, changes, ski)
        with progress.stage("what if") as stage:
            question = Question(recorded, asked, keep, gates_of(changes))
            solution, strict = solutions(question, stage.advance)
        ends: tuple[float | None, float | None] = (None, None)
        if not reduced:
            with progress.stage("full model"):
                ends = _full_end(solution.played), _recorded_end(stored, question)
        named: dict[str, str | float] = {**changes, **({} if ski is None else {"ski": asked.ski.name})}
        settings = {
            "command": "whatif",
            "keep": keep,
            "changes": named,
            **({"reduced": True} if reduced else {}),
        }
        origin = convert(provenance(stored.summary.provenance.inputs, settings, seed=None), Provenance)
        answer = answer_of(solution, strict, stored.name, named, _covariance(stored, recorded.model), ends, origin)
        if out is not None:
            _write(out, answer, solution)
        return answer


def _stored(folder: Path, out: Path | None, progress: Progress) -> StoredRun:
    """Return the result in a folder, or fit the recording there first."""
    if (folder / SUMMARY).is_file():
        return read_run(folder)
    if not (folder / FILE).is_file():
        raise InputError(folder, "", "neither a result nor a recording", "give the folder of one")
    with open_recording(folder, None if out is None else out / RECORDED, progress) as work:
        chosen = choose_model(work, None, (), "paper", None)
        return fit_recording(work, chosen, method="joint", parameters=()).run


def _covariance(stored: StoredRun, model: Model) -> tuple[tuple[str, ...], Array]:
    """Return the names (k,) of the fitted numbers that act on the run, and their covariance (k, k)."""
    fit = stored.summary.fit
    every = list((fit.parameters or {}).items())
    errors, kept = np.zeros(len(every)), []
    for i, (name, estimate) in enumerate(every):
        if estimate.se is None or name.startswith("start.clock"):
            continue
        try:
            model.value(name)
        except InputError:  # a fault of an instrument, which a what-if leaves out
            continue
        errors[i] = estimate.se
        kept.append(i)
    correlation = np.eye(len(every)) if fit.correlation is None else np.array(fit.correlation, dtype=np.float64)
    covariance = correlation * np.outer(errors, errors)
    return tuple(every[i][0] for i in kept), covariance[np.ix_(kept, kept)]


def _full_end(played: Played) -> float:
    """Return how far (m) the full model's centre of mass is from the reduced one's at the end."""
    result = simulate(replace(played.model, solver=PRESETS["fast"]), played.motion)
    end = min(float(result.time[-1]), float(played.times[-1]))
    return _apart(end, (result.time, result.com), played)


def _recorded_end(stored: StoredRun, question: Question) -> float:
    """Return the same of the recorded run, whose full model the result holds."""
    return _apart(float(question.samples[-1]), (stored.time, stored.com), question.as_recorded)


def _apart(end: float, full: tuple[Array, Array], played: Played) -> float:
    """Return how far (m) along the slope a full model's times and places of the centre of mass are from a reduced
    run's at ``end`` (s).
    """
    ends = (
        np.array([np.interp(end, time, com[:, i]) for i in range(2)])
        for time, com in (full, (played.run.time, played.run.com))
    )
    return float(np.linalg.norm(np.subtract(*ends)))


def _write(out: Path, answer: WhatIf, solution: Solution) -> None:
    """Write tables, picture and, last, the answer."""
    question = solution.question
    write_atomically(out / "runs.csv", _runs_table(solution).to_csv(index=False))
    amounts = question.amounts(solution.unknowns, question.samples)
    columns = {"recorded_s": question.samples, "own_s": solution.played.times}
    for correction, column in zip(question.intent.corrections, amounts.T, strict=True):
        unit, factor = correction.in_files
        columns[f"{correction.name}_{unit}"] = factor * column
    write_atomically(out / "corrections.csv", pd.DataFrame(columns).to_csv(index=False))
    _draw(out / "whatif.png", answer, solution)
    write_atomically(out / ANSWER, to_json(answer))


def _runs_table(solution: Solution) -> pd.DataFrame:
    parts = []
    for name, played in (("recorded", solution.question.as_recorded), ("asked", solution.played)):
        run = played.run
        parts.append(
            pd.DataFrame(
                {
                    "run": name,
                    "time_s": run.time,
                    "com_f_m": run.com[:, 0],
                    "com_l_m": run.com[:, 1],
                    "speed_mps": np.linalg.norm(run.com_velocity, axis=1),
                    "left_load_N": run.foot_load[:, 0],
                    "right_load_N": run.foot_load[:, 1],
                    "left_edge_angle_deg": np.degrees(run.edge_angle[:, 0]),
                    "right_edge_angle_deg": np.degrees(run.edge_angle[:, 1]),
                }
            )
        )
    return pd.concat(parts)


def _draw(path: Path, answer: WhatIf, solution: Solution) -> None:
    """Draw both runs over each other: paths, speeds, seconds lost and the distance off the path."""
    question, played = solution.question, solution.played
    figure = picture(path, (11.0, 8.0))
    paths, speeds, seconds, off = figure.subplots(2, 2).ravel()
    for name, run in (("recorded", question.as_recorded), ("asked", played)):
        paths.plot(run.run.com[:, 1], -run.run.com[:, 0], label=name)
        speeds.plot(question.samples, run.figures[:, SPEED], label=name)
    if question.path is not None:
        paths.plot(question.intended[:, 1], -question.intended[:, 0], "k:", label="between the gates")
    paths.set_aspect("equal", adjustable="datalim")
    paths.set_xlabel("to the left (m)")
    paths.set_ylabel("up the fall line (m)")
    seconds.plot(question.samples, seconds_lost(question, played))
    off.plot(question.samples, off_path(question, played))
    for axes, label in ((speeds, "speed (m/s)"), (seconds, "lost (s)"), (off, "to the left of the path (m)")):
        axes.set_xlabel("recorded clock (s)")
        axes.set_ylabel(label)
        for turn in answer.turns[::2]:
            axes.axvspan(turn.start_s, turn.end_s, color="0.5", alpha=0.15, linewidth=0)
    paths.legend()
    save_picture(figure, path)
