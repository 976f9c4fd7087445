"""The work of ``sssi diagnose`` and ``sssi benchmark``."""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from dataclasses import replace
from itertools import zip_longest
from pathlib import Path
from typing import Final

import numpy as np

from sssi_exudyn.commands.expected import expected_seconds
from sssi_exudyn.commands.outcome import Made, Outcome, write_outcome
from sssi_exudyn.commands.recordings import SILENT, read_folder
from sssi_exudyn.commands.runs import CACHE, cache_in, chosen_seconds, lock_of
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.new_files import check_no_link
from sssi_exudyn.io.typed import convert, read_json
from sssi_exudyn.io.writing import clear_errors, folder_lock, to_json, write_atomically
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.model.model import Model
from sssi_exudyn.model.toml import model_files, model_to_dict
from sssi_exudyn.recording.recording import FILE, Recording
from sssi_exudyn.reports.day_page import day_page, sentence_of_day
from sssi_exudyn.results.day import Day
from sssi_exudyn.results.folder import DIAGNOSIS, LAW, check_own, write_model
from sssi_exudyn.results.summary import Estimate, Fit, Provenance
from sssi_exudyn.results.uncertainty import uncertainty_figures
from sssi_exudyn.runtime.cache import Cache
from sssi_exudyn.runtime.progress import Progress
from sssi_exudyn.runtime.provenance import provenance
from sssi_exudyn.simulation.full.run import simulate as simulate_model
from sssi_exudyn.validation.benchmark.cases import SHORTEST_RUN
from sssi_exudyn.validation.benchmark.known_answers import Comparison, compare, read_truth
from sssi_exudyn.validation.benchmark.run import Bases, base_of
from sssi_exudyn.validation.benchmark.semi_real import Stretch, middle
from sssi_exudyn.validation.diagnosis.diagnose import diagnose as find_missing
from sssi_exudyn.validation.diagnosis.diagnosis_data import Diagnosis
from sssi_exudyn.validation.diagnosis.search.search_result import SearchResult
from sssi_exudyn.validation.diagnosis.several_runs.friction_regression import find_law, model_with_law
from sssi_exudyn.validation.diagnosis.several_runs.joint_fit import compare_for_day
from sssi_exudyn.validation.diagnosis.several_runs.second_pass import ask_other_runs

_BY_REDUCED: Final = (
    "diagnosed by the reduced model alone: the full model confirmed no fit and simulated only the run that is shown"
)


def make_diagnosis(
    source: Path | Recording,
    out: Path | None,
    *,
    reduced: bool = False,
    seconds: tuple[float, float] | None = None,
    progress: Progress = SILENT,
) -> Made:
    """Find what physics is missing in a recording, or which instrument is at fault, and run the extended model.

    With ``reduced`` the full model confirms nothing, and the result says so.  Without ``out`` nothing is written, and
    an interrupted diagnosis is lost.
    """
    made = search_into(source, out, reduced, progress, seconds)[0]
    cache = cache_in(out)
    if cache is not None:
        cache.remove()
    return made


def diagnose_day(
    folders: Sequence[Path],
    out: Path,
    *,
    reduced: bool = False,
    seconds: tuple[float, float] | None = None,
    progress: Progress = SILENT,
) -> Day:
    """Diagnose several runs of one day, each into a folder of its recording's name in ``out``, and compare them.

    ``day.json`` in ``out`` holds the answer.  Where a law of friction is offered that is in no list, the folder ``law``
    of each run holds its model with that.

    Raises InputError where two folders have the same name.
    """
    names = _names(folders, out)
    with folder_lock(out):
        searched = {
            name: search_into(folder, out / name, reduced, progress, seconds)
            for folder, name in zip(folders, names, strict=True)
        }
        with progress.stage("compare together") as stage:
            runs_alone = [search.separate_fit() for _, search in searched.values()]
            explanations = compare_for_day(runs_alone, stage.advance)
            law, with_law = find_law(runs_alone, explanations, stage.advance)
            models = [model_with_law(fitted) for fitted in with_law]
        with progress.stage("ask the other runs of a place") as stage:
            same_place = ask_other_runs({name: search.end for name, (_, search) in searched.items()}, stage.advance)
        sentence = sentence_of_day(explanations, len(names), searched[names[0]][1].model, law)
        sentence = " ".join([sentence, *(answer.sentence for answer in same_place if answer.settled)])
        hashes = {
            f"{name}/{file}": digest
            for name, (made, _) in searched.items()
            for file, digest in made.run.summary.provenance.inputs.items()
        }
        settings = {"command": "diagnose", "recordings": names, **chosen_seconds(seconds)}
        origin = convert(provenance(hashes, settings, seed=0), Provenance)
        day = Day(1, tuple(names), sentence, tuple(explanations), origin, same_place, law)
        for name, model in zip_longest(names, models):
            _keep_law(out / name / LAW, model)
        write_atomically(out / "day.json", to_json(day))
        write_atomically(out / "report.html", day_page(day))
        for name in names:  # kept until now, so that an interrupted day goes on where it was
            Cache(out / name / CACHE).remove()
        return day


def _keep_law(folder: Path, model: Model | None) -> None:
    """Write the model with a law of friction into a folder of its own; without one, an older folder goes away."""
    with clear_errors(folder):
        shutil.rmtree(folder, ignore_errors=True)
        if model is not None:
            folder.mkdir()
            write_model(folder, model_to_dict(model), model_files(model))


def _names(folders: Sequence[Path], out: Path) -> list[str]:
    """Return the folders' names, under which ``out`` holds their results.

    Raises InputError where two are the same, or a link stands in the place of one's results.
    """
    names = [folder.resolve().name for folder in folders]
    for name in names:
        with clear_errors(out / name):
            check_no_link(out / name)
        if names.count(name) > 1:
            raise InputError(out / name, "", "two recordings would leave their results here", "rename one's folder")
    return names


def search_into(
    source: Path | Recording,
    out: Path | None,
    reduced: bool,
    progress: Progress,
    seconds: tuple[float, float] | None = None,
) -> tuple[Made, SearchResult]:
    """Diagnose into ``out``, where the cache stays; return the run of the extended model, and the answer."""
    with lock_of(out):
        recording, motion = read_folder(source, progress, seconds)
        check_own(out, recording.name)
        if recording.gps is None:
            raise InputError(
                recording.folder / FILE, "[gps]", "there is no GPS to hold the simulation against", "add it"
            )
        model, cache = model_of(recording, motion), cache_in(out)
        expected = expected_seconds("diagnose reduced" if reduced else "diagnose", motion)
        with progress.stage("diagnose", expected) as stage:
            search = find_missing(recording, motion, model, full=not reduced, cache=cache, progress=stage.advance)
        result, diagnosis = search.result, search.diagnosis
        if reduced:
            with progress.stage("simulate") as stage:
                result = simulate_model(search.model, motion, progress=stage.advance)
            diagnosis = replace(diagnosis, tier="reduced")
            recording = replace(recording, notices=(*recording.notices, _BY_REDUCED))
        assert result is not None
        posterior = search.posterior
        outcome = Outcome(
            {"command": "diagnose", **({"reduced": True} if reduced else {}), **chosen_seconds(seconds)},
            Fit(method="diagnosis", converged=True, parameters=_parameters(search)),
            uncertainty=None if posterior is None else uncertainty_figures(posterior),
            diagnosis=diagnosis,
        )
        return write_outcome(out, recording, motion, search.model, result, outcome), search


def _parameters(search: SearchResult) -> dict[str, Estimate]:
    """Return values and standard errors of all fitted numbers."""
    if search.posterior is not None:
        sought = [(unknown.names, i) for i, unknown in enumerate(search.posterior.setting.unknowns)]
        values, covariance = search.posterior.numbers, search.posterior.covariance_of_numbers
    else:
        sought = [(parameter.names, i) for i, parameter in enumerate(search.fit.parameters)]
        values, covariance = search.fit.values, search.fit.covariance
    errors = np.sqrt(np.diag(covariance))
    return {name: Estimate(float(values[i]), float(errors[i])) for names, i in sought for name in names}


def diagnose_known(
    folders: Sequence[Path], out: Path, *, reduced: bool = False, progress: Progress = SILENT
) -> list[Comparison]:
    """Diagnose every recording in ``folders`` that a ``truth.json`` there names, each into a folder of its own.

    Returns what was found against what is hidden, a row a recording.  Those that ``out`` has already are not done
    again.

    Raises InputError where two recordings have the same name.
    """
    truths = [(folder, read_truth(folder)) for folder in folders]
    every = [folder / name for folder, truth in truths for name in sorted(truth)]
    names = _names(every, out)
    diagnoses: dict[str, Diagnosis] = {}
    for recording, name in zip(every, names, strict=True):
        made = out / name
        if (made / DIAGNOSIS).is_file():
            diagnoses[name] = read_json(made / DIAGNOSIS, Diagnosis)
        else:
            diagnosis = make_diagnosis(recording, made, reduced=reduced, progress=progress).run.diagnosis
            assert diagnosis is not None
            diagnoses[name] = diagnosis
    return compare({name: known for _, truth in truths for name, known in truth.items()}, diagnoses)


def bases_of(folders: Sequence[Path], progress: Progress) -> Bases:
    """Read recordings from whose movements a benchmark makes its cases.

    Raises InputError for one without a GPS, and for one that is too short.
    """
    bases: Bases = []
    for folder in folders:
        recording, motion = read_folder(folder, progress)
        if recording.gps is None:
            raise InputError(folder / FILE, "[gps]", "there is no GPS to start from", "add it")
        if motion.stop - motion.start < SHORTEST_RUN:
            words = f"the run has {motion.stop - motion.start:.1f} s, and {SHORTEST_RUN:g} s are needed"
            raise InputError(folder / FILE, "", words, "leave this recording out")
        bases.append(base_of(recording, motion, model_of(recording, motion)))
    return bases


def stretches_of(folders: Sequence[Path], out: Path, seconds: float, progress: Progress) -> list[Stretch]:
    """Read the middle ``seconds`` of recordings, whose answers go into folders of their names in ``out``.

    Raises InputError for a recording that cannot be used, and where two have the same name.
    """
    stretches: list[Stretch] = []
    for folder, name in zip(folders, _names(folders, out), strict=True):
        recording, motion = read_folder(folder, progress)
        try:
            stretches.append(middle(replace(recording, name=name), motion, seconds))
        except ValueError as error:
            raise InputError(folder / FILE, "[gps]", str(error), "leave this recording out") from error
    return stretches
