"""The plan of a sweep: all runs, each under the hash of its inputs, before the first one starts."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from sssi_exudyn.bodies.ski.ski import ski_named, ski_to_table
from sssi_exudyn.contact.registry import PAPER_TERMS, combine_terms
from sssi_exudyn.contact.term import Term, parameters
from sssi_exudyn.core.choices import HeadingMode, Keep, Method
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.model.heading import Heading, check_heading
from sssi_exudyn.model.model import Model
from sssi_exudyn.model.toml import read_model
from sssi_exudyn.recording.read import read_recording
from sssi_exudyn.runtime.cache import fingerprint, later_defaults
from sssi_exudyn.runtime.plugins import Plugin, origins_of
from sssi_exudyn.runtime.provenance import versions
from sssi_exudyn.sweeps.axes import axes_of
from sssi_exudyn.sweeps.design import Axis, points_of
from sssi_exudyn.sweeps.file import SweepFile, Task, Tier
from sssi_exudyn.sweeps.outputs import Column, columns_of, usual_outputs
from sssi_exudyn.sweeps.parameters import Parameter, parameters_of, parameters_of_turn
from sssi_exudyn.sweeps.what_ifs import COLUMNS, USUAL, check_numbers, declared_numbers, result_hashes

SKI: Final = "ski"
"""Key of a ski's hash among those of files."""
TermValues = tuple[str, tuple[tuple[str, float], ...]]
"""A force term as its name and its numbers."""


@dataclass(frozen=True)
class Job:
    """Common data of all runs of a sweep: texts and numbers only, so that it goes to a worker as JSON with every run.

        identity : hash of the whole sweep
        versions : versions of the program and of the packages that it uses
        recordings : folders of recordings or results, or skis;  hashes : hash of each recording's files, or of the ski
        model : a ``model.toml``, None for the recorded skier's own model
    terms : additional force terms
        duration : s of each run from its start, None for whole runs
        series : whether each run's time series is kept
        heading : control of the skiers' heading; None for the model's own
        keep : what the skier of a what-if keeps
        plugins : plug-ins named by the user, from which the terms come
    """

    identity: str
    versions: tuple[tuple[str, str], ...]
    recordings: tuple[str, ...]
    hashes: tuple[str, ...]
    model: str | None
    terms: tuple[TermValues, ...]
    task: Task
    tier: Tier
    method: Method
    duration: float | None
    series: bool
    heading: HeadingMode | None = None
    keep: Keep = "path"
    plugins: tuple[Plugin, ...] = ()


@dataclass(frozen=True)
class SweepRun:
    """One run: its row in the table, the hash of its inputs, its recording's number, its parameters as in the file."""

    row: int
    key: str
    recording: int
    values: tuple[tuple[str, float | str], ...]
    attempt: int = 0


@dataclass(frozen=True)
class Plan:
    """A whole sweep: rows go through the recordings, and for each through the design's points.

    keys : keys of all rows; equal points have equal keys
    files : hash of every file read, by recording and name
    """

    file: SweepFile
    job: Job
    axes: tuple[Axis, ...]
    points: list[tuple[float | str, ...]]
    keys: list[str]
    columns: tuple[Column, ...]
    outputs: tuple[str, ...]
    files: dict[str, str]

    def runs(self) -> Iterator[SweepRun]:
        """Yield the runs in order; of equal ones only the first."""
        seen = set()
        for row, key in enumerate(self.keys):
            if key not in seen:
                seen.add(key)
                yield self.run(row)

    def run(self, row: int) -> SweepRun:
        """Return the run of a row."""
        recording, point = divmod(row, len(self.points))
        names = (axis.name for axis in self.axes)
        return SweepRun(row, self.keys[row], recording, tuple(zip(names, self.points[point], strict=True)))


def fingerprint_ski(name: str) -> str:
    """Return the hash of a ski of the catalogue, or of that of a file."""
    return fingerprint(ski_to_table(ski_named(name, Path(), "sweep", "skis")))


def plan_sweep(file: SweepFile) -> Plan:
    """Plan a sweep: read its recordings and lay out its runs.

    Raises InputError for any mistake in the file or a recording, SssiError where a package is missing.
    """
    if file.task == "turn":
        return plan_of(file, {f"{ski.name}/{SKI}": fingerprint_ski(str(ski)) for ski in file.folders})
    if file.task == "whatif":
        hashes = {folder: result_hashes(folder) for folder in file.folders}
        files = {f"{folder.name}/{name}": digest for folder, of in hashes.items() for name, digest in of.items()}
        plan = plan_of(file, files)
        check_numbers(file, tuple(axis.name for axis in plan.axes))
        return plan
    recordings = [read_recording(folder) for folder in file.folders]
    for recording in recordings:
        if file.task == "fit" and recording.gps is None:
            toml = recording.folder / "recording.toml"
            raise InputError(toml, "[gps]", "there is no GPS to fit to", "leave this recording out of the sweep")
    files = {
        f"{recording.folder.name}/{name}": digest
        for recording in recordings
        for name, digest in recording.hashes.items()
    }
    return plan_of(file, files)


def _as_before(term: Term) -> dict[str, float]:
    """Return a term's numbers, without those that it was given later and that hold their defaults."""
    later = later_defaults(term)
    return {key: value for key, value in parameters(term).items() if key not in later}


def plan_of(file: SweepFile, files: Mapping[str, str]) -> Plan:
    """Plan a sweep of recordings whose files have these hashes, by recording and name.

    Raises InputError for any mistake in the file, SssiError where a package is missing.
    """
    model = None if file.model is None else read_model(file.model)
    plugins = origins_of(type(term) for term in (*file.terms, *(() if model is None else model.terms)))
    if file.heading is not None:
        terms = (*file.terms, *(() if model is None else model.terms))
        check_heading(Heading(file.heading), terms, file.path, "heading")
    axes = axes_of(file, _declared_parameters(file, model))
    points = points_of(file.design, axes)
    columns = COLUMNS if file.task == "whatif" else columns_of(file.task, file.tier, file.method)
    outputs = _outputs(file, columns)
    shared = (
        "sweep", file.task, file.tier, file.method if file.task == "fit" else "", file.duration, model,
        [(term.name, _as_before(term)) for term in file.terms], [axis.name for axis in axes],
        *([plugin.as_table() for plugin in plugins],) * bool(plugins), *([file.heading] if file.heading else []),
        *([file.keep] if file.task == "whatif" else []),
    )  # fmt: skip
    hashes = tuple(fingerprint(_files_below(folder.name, files)) for folder in file.folders)
    bases = [fingerprint(*shared, digest) for digest in hashes]
    keys = [fingerprint(base, point)[:32] for base in bases for point in points]
    job = Job(
        identity=fingerprint(keys, file.series, outputs, [folder.name for folder in file.folders]),
        versions=tuple(versions().items()),
        recordings=tuple(str(folder) for folder in file.folders),
        hashes=hashes,
        model=None if file.model is None else str(file.model),
        terms=tuple((term.name, tuple(parameters(term).items())) for term in file.terms),
        task=file.task,
        tier=file.tier,
        method=file.method,
        duration=file.duration,
        series=file.series,
        heading=file.heading,
        keep=file.keep,
        plugins=plugins,
    )
    return Plan(file, job, axes, points, keys, columns, outputs, dict(files))


def _files_below(recording: str, files: Mapping[str, str]) -> dict[str, str]:
    """Return the hashes of one recording's files by their names in it."""
    names = {name: name.partition("/") for name in files}
    return {below: files[name] for name, (folder, _, below) in names.items() if folder == recording}


def _declared_parameters(file: SweepFile, model: Model | None) -> dict[str, Parameter]:
    """Return the parameters that the swept models declare; they all have the same parts."""
    if file.task == "turn":
        return parameters_of_turn()
    if file.task == "whatif":
        return declared_numbers()
    if model is None:
        return parameters_of(combine_terms(PAPER_TERMS, file.terms))
    return parameters_of((*combine_terms(model.terms, file.terms), *model.sensors))


def _outputs(file: SweepFile, columns: tuple[Column, ...]) -> tuple[str, ...]:
    names = [column.name for column in columns]
    for name in file.outputs:
        if name not in names:
            raise InputError(file.path, "outputs", f"no figure is called {name!r}", f"use one of: {', '.join(names)}")
    return file.outputs or (USUAL if file.task == "whatif" else usual_outputs(file.task, file.tier))
