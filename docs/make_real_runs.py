"""Prints the table of docs/notebook/real-runs.md: what few sensors show of recorded runs, and what it costs.

Run it from the top folder: ``python docs/make_real_runs.py FOLDER``; FOLDER holds recordings as ``sssi import`` makes
them of few sensors (docs/notebook/real-runs.md has the commands).
"""

from __future__ import annotations

import sys
import time as clock
from pathlib import Path

import numpy as np

from sssi_exudyn.fitting.few_sensors.few_sensors_fit import FewSensorsFit, fit_few_sensors
from sssi_exudyn.fitting.snow_surface import on_snow_surface
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.motion.from_recording import motion_from_recording
from sssi_exudyn.recording.read import read_recording
from sssi_exudyn.recording.recording import FILE

HEADER = """\
| run | length | effective friction | of the simulated run | μ_t | track error (mean) | speed error, predicted | speed error, mean speed | computing |
|---|---|---|---|---|---|---|---|---|"""


def outcome(path: Path) -> FewSensorsFit:
    """Return the fit of a recording, on the surface of a barometer's heights where it has them."""
    recording = read_recording(path)
    motion = motion_from_recording(recording)
    model = model_of(recording, motion)
    if recording.gps is not None and recording.gps.barometric:
        model = on_snow_surface(model, recording, motion)
    return fit_few_sensors(recording, motion, model, "joint")


def row(name: str, fit: FewSensorsFit, seconds: float) -> str:
    """Return a line of the table; ``seconds`` of computing."""
    path, half = fit.path, fit.half
    track = float(np.mean(np.linalg.norm(fit.fitted.residual, axis=1)))
    return (
        f"| {name} | {path.distance[-1]:.0f} m | {path.effective:.3f} ± {path.effective_sigma:.3f} | {fit.confirmed:.3f} |"
        f" {fit.fitted.value('friction.mu_t'):.3f} | {track:.1f} m | {half.speed_rms:.2f} m/s | {half.usual_rms:.2f} m/s |"
        f" {seconds:.1f} s |"
    )


def main(folder: Path) -> None:
    """Print the table."""
    sys.stdout.write(f"{HEADER}\n")
    for path in sorted(file.parent for file in folder.glob(f"*/{FILE}")):
        begin = clock.process_time()
        fit = outcome(path)
        sys.stdout.write(f"{row(path.name, fit, clock.process_time() - begin)}\n")
        sys.stdout.flush()


if __name__ == "__main__":
    main(Path(sys.argv[1]))
