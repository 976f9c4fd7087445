"""What-ifs of the intermediate on snow that decides the heading: what they cost, and whether both models agree.

``python benchmarks/what_ifs.py NAME=VALUE… [--seconds S] [--ski NAME] [--sidecut FACTOR] [--keep WHAT] [--full]``: the
run is the captured one on snow as it was fitted, on another ski where one is named, and each change is as of
``sssi whatif --set``.  ``--full`` simulates the answer with the full model, too.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import replace
from pathlib import Path
from typing import Final, get_args

import numpy as np

from sssi_exudyn.bodies.ski.ski import ski_named
from sssi_exudyn.commands.what_if import read_changes
from sssi_exudyn.contact.registry import combine_terms
from sssi_exudyn.contact.terms.carving import Carving
from sssi_exudyn.core.choices import Keep
from sssi_exudyn.core.frames import gravity_in_slope
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.model.model import PRESETS
from sssi_exudyn.motion.from_recording import motion_from_recording
from sssi_exudyn.motion.motion import spline_motion
from sssi_exudyn.recording.read import read_recording
from sssi_exudyn.simulation.full.run import simulate
from sssi_exudyn.simulation.reduced.carved_run import carved_run
from sssi_exudyn.simulation.reduced.prepared import ReducedRun, prepare
from sssi_exudyn.simulation.reduced.run import simulate_reduced
from sssi_exudyn.sweeps.asked_model import change_model, gates_of
from sssi_exudyn.what_if.answer import departures, off_path, reasons_of, seconds_lost
from sssi_exudyn.what_if.intent import SPEED
from sssi_exudyn.what_if.limits import imbalance
from sssi_exudyn.what_if.question import Played, Question
from sssi_exudyn.what_if.recorded_run import RecordedRun, nodes_of
from sssi_exudyn.what_if.solve import Solution, solve
from sssi_exudyn.what_if.windows import needs_windows, solve_in_windows

EXAMPLE: Final = Path(__file__).parents[1] / "examples" / "intermediate"
SNOW: Final = Carving(hardness=4.3e7, strength=8e4, mu=0.13)
"""As fitted to this recording."""
SIDECUT: Final = "ski.sidecut_scale"
FINE: Final = 0.001
"""s; steps at which those of a question no longer part the models."""


def recorded_run(seconds: float, ski: str | None, sidecut: float) -> RecordedRun:
    """Return the captured run's first seconds on that snow and ski, the snow to decide the heading of what differs."""
    recording = read_recording(EXAMPLE)
    motion = motion_from_recording(recording)
    nodes = nodes_of(motion.start, min(motion.start + seconds, motion.stop))
    short = spline_motion(motion.geometry, motion.inclination, nodes, motion.evaluate(nodes)[0])
    model = replace(model_of(recording, motion), sensors=())
    model = replace(model, terms=combine_terms(model.terms, (SNOW,)))
    if ski is not None:
        model = replace(model, ski=ski_named(ski, Path(), "benchmark", "--ski"))
    return RecordedRun(change_model(model, {SIDECUT: sidecut}, None), short, snow_turns=True)


def snow_of(played: Played) -> str:
    """Return what the snow takes of a run by friction along the edges and across them, kJ, and how far skis slip."""
    run, power = played.run, carved_run(played.model, played.prepared).series.power
    along, across = (np.trapezoid(power[:, i], run.time) / 1000.0 for i in range(2))
    moving, forward = run.foot_velocity[..., :2], run.foot_forward[..., :2]
    side = moving[..., 1] * forward[..., 0] - moving[..., 0] * forward[..., 1]
    slip = np.degrees(np.abs(np.arctan2(side, np.sum(moving * forward, axis=-1))))
    mean = float(np.average(slip, weights=run.foot_load))
    return f"along {along:.2f} kJ, across {across:.2f} kJ, slip {mean:.2f} deg"


def kinetic(played: Played) -> float:
    """Return the mean of the squared speed, m²/s²."""
    return float(np.mean(played.figures[:, SPEED] ** 2))


def answer_lines(solution: Solution) -> list[str]:
    """Return what came of a question."""
    question, played = solution.question, solution.played
    before, after = (imbalance(question, run).moment_Nm for run in (question.unchanged, played))
    departs = ", ".join(f"{part.name} {part.largest:.2g} {part.unit}" for part in departures(solution)[0])
    change = 100.0 * (kinetic(played) / kinetic(question.as_recorded) - 1.0)
    return [
        f"lost {seconds_lost(question, played)[-1]:.3f} s, kinetic energy {change:+.2f} %, "
        f"off the path {np.max(np.abs(off_path(question, played))):.2f} m, imbalance {before:.0f} to {after:.0f} N m",
        f"recorded: {snow_of(question.as_recorded)}; asked: {snow_of(played)}",
        f"{solution.rounds} rounds, converged {solution.converged}, {departs}",
        f"not skiable: {'; '.join(reasons_of(solution)) or 'no, it is'}",
    ]


def full_line(played: Played) -> str:
    """Return how far both models are apart over time, with a question's steps of the reduced one and with fine ones,
    and how energy and momentum of the full one close.
    """
    result = simulate(replace(played.model, solver=PRESETS["fast"]), played.motion)
    fine = simulate_reduced(played.model, prepare(played.model, played.motion, step=FINE))

    def apart(run: ReducedRun) -> str:
        places = np.stack([np.interp(result.time, run.time, column) for column in run.com[:, :2].T], axis=1)
        distance = np.linalg.norm(result.com[:, :2] - places, axis=1)
        return " ".join(f"{np.interp(result.time[0] + after, result.time, distance):.3f}" for after in (4.0, 9.0, 15.0))

    mass = played.prepared.mass
    force = result.snow.force.sum(axis=1) + result.drag + mass * gravity_in_slope(played.model.inclination)
    gained = mass * (result.com_velocity[-1] - result.com_velocity[0])
    left = np.linalg.norm(np.trapezoid(force, result.time, axis=0) - gained)
    return (
        f"models apart by {apart(played.run)} m after 4, 9, 15 s, with fine steps {apart(fine)} m; "
        f"energy {result.closure_percent:.4f} %, impulse {left:.2f} of {np.linalg.norm(gained):.0f} N s"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("changes", nargs="*", metavar="NAME=VALUE")
    parser.add_argument("--seconds", type=float, default=4.0)
    parser.add_argument("--ski")
    parser.add_argument("--sidecut", type=float, default=1.0, help="of the recorded run's ski")
    parser.add_argument("--keep", choices=get_args(Keep), default="path")
    parser.add_argument("--full", action="store_true")
    given = parser.parse_args()
    changes = read_changes(given.changes)
    recorded = recorded_run(given.seconds, given.ski, given.sidecut)
    began = time.process_time()
    # the recorded ski has its factor already
    relative = {name: value / given.sidecut if name == SIDECUT else value for name, value in changes.items()}
    question = Question(recorded, change_model(recorded.model, relative, None), given.keep, gates_of(changes))
    solution = (solve_in_windows if needs_windows(question) else solve)(question)
    print(given.keep, changes, f"{time.process_time() - began:.0f} s of processor")
    print("\n".join(answer_lines(solution)))
    if given.full:
        print(full_line(solution.played))


if __name__ == "__main__":
    main()
