"""Prints the table of docs/notebook/real-runs.md: fits of recorded runs on three kinds of snow.

The snow is the plane, the surface from a run's own heights, or the surface shared with the runs that ``[terrain] runs``
names.

Run it from the top folder: ``python docs/make_real_runs.py FOLDER``; FOLDER holds recordings as ``sssi import`` makes
them of few sensors (docs/notebook/real-runs.md has the commands).
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import astuple, dataclass, replace
from pathlib import Path

import numpy as np

from sssi_exudyn.fitting.first_fit import COARSE_STEP, Fitted, fit, problem_of
from sssi_exudyn.fitting.snow_surface import on_snow_surface
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.model.model import Model
from sssi_exudyn.motion.from_recording import motion_from_recording
from sssi_exudyn.motion.motion import Motion
from sssi_exudyn.recording.read import read_recording
from sssi_exudyn.recording.recording import FILE, Recording
from sssi_exudyn.simulation.reduced.prepared import prepare
from sssi_exudyn.simulation.reduced.run import simulate_reduced
from sssi_exudyn.validation.posture_uncertainty import effective_friction, second_half

HEADER = """\
| run | snow | track error (mean) | speed error, predicted | speed error, mean speed | μ_t | effective friction |
|---|---|---|---|---|---|---|"""


@dataclass(frozen=True)
class Outcome:
    """Result of a fitted run.

    It holds the track's mean error (m); in the half that was not fitted, the error (rms, m/s) of the predicted speed
    and of the first half's mean speed; μ_t and effective friction.
    """

    track: float
    speed: float
    usual_speed: float
    mu_t: float
    effective: float


def outcomes(recording: Recording) -> Iterator[tuple[str, Outcome]]:
    """Yield the recording's fits by the reduced model, each with the name of its snow."""
    motion = motion_from_recording(recording)
    plane = model_of(recording, motion)
    alone = on_snow_surface(plane, replace(recording, runs=()), motion)
    on_plane, first = outcome(recording, motion, plane)
    yield "plane", on_plane
    yield "own heights", outcome(recording, motion, alone, first)[0]
    if recording.runs:
        shared = on_snow_surface(plane, recording, motion)
        yield f"heights of {1 + len(recording.runs)} runs", outcome(recording, motion, shared, first)[0]


def outcome(recording: Recording, motion: Motion, model: Model, begin: Fitted | None = None) -> tuple[Outcome, Fitted]:
    """Fit the reduced model, from the end of another fit if given, and predict the second half from the first."""
    if recording.gps is None:
        raise ValueError("the recording has no fixes")
    problem = problem_of(recording, motion, model, "joint")
    if begin is not None:
        values = dict(zip(begin.names, begin.values.tolist(), strict=True))
        problem = replace(problem, model=problem.model.with_values(values))
    fitted = fit(problem, motion, full=False)
    half = second_half(fitted, problem, motion, recording.gps)
    run = simulate_reduced(fitted.model, prepare(fitted.model, motion, step=COARSE_STEP))
    track = float(np.mean(np.linalg.norm(fitted.residual, axis=1)))
    mu_t = fitted.value("friction.mu_t")
    return Outcome(track, half.speed_rms, half.usual_rms, mu_t, effective_friction(run)), fitted


def row(name: str, snow: str, result: Outcome) -> str:
    """Return a line of the table."""
    track, speed, usual, mu_t, effective = astuple(result)
    return f"| {name} | {snow} | {track:.1f} m | {speed:.2f} m/s | {usual:.2f} m/s | {mu_t:.3f} | {effective:.3f} |"


def main(folder: Path) -> None:
    """Print the table."""
    sys.stdout.write(f"{HEADER}\n")
    for path in sorted(file.parent for file in folder.glob(f"*/{FILE}")):
        for snow, result in outcomes(read_recording(path)):
            sys.stdout.write(f"{row(path.name, snow, result)}\n")
            sys.stdout.flush()


if __name__ == "__main__":
    main(Path(sys.argv[1]))
