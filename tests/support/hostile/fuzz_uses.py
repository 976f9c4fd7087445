"""The program's use of the files of a fuzzed case, by kind: every reader, up to the point where it simulates."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from unittest import mock

import numpy as np
from fuzz_seeds import KEY, KNOWN, PLACED, entry

import sssi_exudyn
from sssi_exudyn.bodies.muscles.osim import read_osim
from sssi_exudyn.bodies.ski.bench_tests import read_measurements
from sssi_exudyn.bodies.ski.mesh import mesh
from sssi_exudyn.bodies.ski.ski import read_ski
from sssi_exudyn.commands.diagnosis import diagnose_known
from sssi_exudyn.commands.pages import report, validate
from sssi_exudyn.fitting.first_fit import problem_of
from sssi_exudyn.fitting.snow_surface import on_snow_surface
from sssi_exudyn.importing.answers import Answers
from sssi_exudyn.importing.assemble import import_recording
from sssi_exudyn.importing.days.day import import_day
from sssi_exudyn.importing.motion_capture.motion_formats import MOTION_READERS, read_motion
from sssi_exudyn.importing.sensors.insole_exports import is_insole_export, read_insole_export
from sssi_exudyn.importing.sensors.opensense import SUFFIX as ORIENTATIONS
from sssi_exudyn.importing.sensors.opensense import places_in
from sssi_exudyn.importing.sensors.sensor_logs import read_logs
from sssi_exudyn.io.writing import folder_lock
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.model.toml import read_model
from sssi_exudyn.motion.from_recording import motion_from_recording
from sssi_exudyn.recording.inspection import format_inspection, inspect_recording
from sssi_exudyn.recording.instruments.gopro import SUFFIXES as CAMERAS
from sssi_exudyn.recording.instruments.gps import read_gps
from sssi_exudyn.recording.read import read_recording
from sssi_exudyn.recording.recording import Recording
from sssi_exudyn.results.stored import read_run
from sssi_exudyn.runtime.cache import Cache
from sssi_exudyn.sweeps import sweep as sweeps
from sssi_exudyn.sweeps.file import read_sweep
from sssi_exudyn.sweeps.plan import plan_sweep

SHAPES = {"time": (None,), "track": (None, 3), "name": ()}
"""Shapes of the cache's entry."""


def read_any(folder: Path, names: list[str], out: Path, imported: bool) -> Recording:
    """Read or import a recording and inspect it."""
    sources = [_source(folder, name) for name in names]
    recording = import_recording(sources, out, KNOWN) if imported else read_recording(folder)
    format_inspection(inspect_recording(recording))
    return recording


def _source(folder: Path, name: str) -> Path:
    """Return a file to import, with the place that is written before it or that belongs to its name."""
    place, placed, file = name.rpartition("=")
    return Path(f"{place}{placed}{folder / file}" if placed else f"{PLACED.get(name, '')}{folder / name}")


def _prepare(recording: Recording) -> None:
    """Do the steps before the first simulation."""
    motion = motion_from_recording(recording)
    model = model_of(recording, motion)
    if recording.gps is not None:
        problem_of(recording, motion, on_snow_surface(model, recording, motion), "joint")


def resume_without_runs(folder: Path) -> sweeps.Counts:
    """Call ``sweep status`` and ``resume`` as they are, except that no worker does a run."""
    sweeps.status(folder)
    with mock.patch.object(sweeps, "do_all"):
        return sweeps.resume(folder, workers=1)


def _sweep(folder: Path, _names: list[str], out: Path) -> None:
    resume_without_runs(folder)
    report([folder], out.with_suffix(".html"))


def _model(folder: Path, _names: list[str], _out: Path) -> None:
    model = read_model(folder / "model.toml")
    model.with_values({"friction.mu_t": 0.1})
    mesh(model.ski)


def _truth(folder: Path, _names: list[str], _out: Path) -> None:
    """Score ``benchmark recordings`` whose diagnoses are all there."""
    diagnose_known([folder / "recordings"], folder / "diagnosed")


def _cache(folder: Path, _names: list[str], _out: Path) -> None:
    with folder_lock(folder):  # as every command has it
        Cache(folder).get_or_make(KEY, entry, SHAPES)


def _read_alone(folder: Path, names: list[str], _out: Path) -> None:
    """Read a file with the readers that take it, up to where an import goes on."""
    (path,) = (folder / name for name in names)
    suffix = path.suffix.lower()
    if suffix == ORIENTATIONS:
        read_logs([(place, path) for place in places_in(path)])
        return
    if suffix in MOTION_READERS:
        read_motion(path, KNOWN.height_m)
        return
    if is_insole_export(path):
        export = read_insole_export(path)
        export.table(75.0, None)
        export.table(75.0, (1.0, 2.0))
        return
    if suffix in CAMERAS:
        read_logs([("helmet", path)])
    read_gps(path, segment="Hips", offset=np.zeros(3), sigma=3.0)


def _day(folder: Path, names: list[str], out: Path) -> None:
    import_day([folder / name for name in names], out, Answers())


USES: dict[str, Callable[[Path, list[str], Path], object]] = {
    "recording": lambda folder, names, out: read_any(folder, names, out, False),
    "import": lambda folder, names, out: read_any(folder, names, out, True),
    "reader": _read_alone,
    "day": _day,
    "recording to fit": lambda folder, names, out: _prepare(read_any(folder, names, out, False)),
    "import to fit": lambda folder, names, out: _prepare(read_any(folder, names, out, True)),
    "model": _model,
    "ski": lambda folder, _, __: mesh(read_ski("own.toml", folder)),
    "bench": lambda folder, _, __: read_measurements(folder),
    "osim": lambda folder, names, _: read_osim(folder / names[0]),
    "truth": _truth,
    "result": lambda folder, _, __: read_run(folder),
    "report": lambda folder, _, out: report([folder], out.with_suffix(".html")),
    "report on paper": lambda folder, _, out: report([folder], out.with_suffix(".pdf")),
    "muscles": lambda folder, _, out: sssi_exudyn.muscles(folder, out),
    "validate": lambda folder, _, out: validate(folder / "recording", folder / "result", out),
    "sweep": _sweep,
    "sweep file": lambda folder, _, __: plan_sweep(read_sweep(folder / "sweep.toml")),
    "cache": _cache,
}
"""Use by kind of seed."""
