"""How large a force without a known cause is in runs of telephones: log evidence of "nothing is missing" by its size.

``python benchmarks/null_force.py RECORDING... [--seconds 25] [--json FILE]`` takes the middle of each recording.  The
model is fitted as at the beginning of a diagnosis and linearised there.  At each size the other noise levels are those
that suit it best.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np

from sssi_exudyn.fitting.evidence import best_evidence
from sssi_exudyn.fitting.noise import NULL_FORCE
from sssi_exudyn.io.writing import to_json, write_atomically
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.motion.from_recording import motion_from_recording
from sssi_exudyn.recording.read import read_recording
from sssi_exudyn.runtime.threads import with_one_thread_for_products
from sssi_exudyn.validation.benchmark.semi_real import middle
from sssi_exudyn.validation.diagnosis.context import diagnosis_problem
from sssi_exudyn.validation.diagnosis.state import first_fit, linear_model

SIZES: Final = (0.01, 15.0, 30.0, 45.0, 60.0, 90.0, 130.0, 200.0)
"""N; standard deviation of each component."""


def evidence_by_size(folder: Path, seconds: float) -> list[float]:
    """Return the log evidence of a recording with nothing added, at each of ``SIZES``."""
    recording = read_recording(folder)
    run = middle(recording, motion_from_recording(recording), seconds)
    motion = run.motion
    start = diagnosis_problem(run.recording, motion, model_of(run.recording, motion))
    problem, state, fit = first_fit(start)
    linear, evidence = linear_model(problem, state, fit), []
    for size in SIZES:
        force = size / NULL_FORCE.size * linear.sized["force"]  # its own level stays: it is not sought
        held = replace(linear, sized={name: columns for name, columns in linear.sized.items() if name != "force"})
        held = replace(held, free=held.free.with_more(force, np.ones(force.shape[1])))
        evidence.append(best_evidence(held, state.levels)[1])
    return evidence


@with_one_thread_for_products
def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("recordings", type=Path, nargs="+")
    parser.add_argument("--seconds", type=float, default=25.0)
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    print("recording", *(f"{size:g} N" for size in SIZES), sep=" | ")
    by_recording = {}
    for folder in options.recordings:
        by_recording[folder.name] = evidence_by_size(folder, options.seconds)
        print(folder.name, *(f"{value:.1f}" for value in by_recording[folder.name]), sep=" | ", flush=True)
    if options.json:
        write_atomically(options.json, to_json({"sizes_N": SIZES, "log_evidence": by_recording}))


if __name__ == "__main__":
    main()
