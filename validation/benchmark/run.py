"""The blind benchmark of the diagnosis: cases with sealed answers, one scoring run, figures with confidence intervals.

Cases come from ``cases``.  Answers are written and hashed before anything is diagnosed.  Each case leaves one file; a
run that was interrupted continues with the missing ones.  Only the answer of a made case is kept: index and seed make
it again for its diagnosis.  Next to the diagnosis two baselines see the same cases (the best Bayesian information
criterion with white noise; the best fit in sample).  So does an oracle that sees the same run without the effect,
fitted as well.
"""

from __future__ import annotations

import hashlib
import signal
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict, dataclass, replace
from multiprocessing import get_context
from pathlib import Path
from typing import Final

import numpy as np

from sssi_exudyn.core.advance import Advance, part_of
from sssi_exudyn.core.choices import Concealed
from sssi_exudyn.core.errors import InputError, SimulationDiverged
from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.new_files import make_folder
from sssi_exudyn.core.number_ref import MU_N, MU_T
from sssi_exudyn.fitting.estimate import estimate
from sssi_exudyn.fitting.evidence import LinearModel, uncertain
from sssi_exudyn.fitting.first_fit import problem_of
from sssi_exudyn.fitting.parameters import snow_beforehand
from sssi_exudyn.fitting.snow_surface import on_snow_surface
from sssi_exudyn.io.typed import read_json
from sssi_exudyn.io.writing import clear_errors, to_json, write_atomically
from sssi_exudyn.model.model import Model
from sssi_exudyn.motion.correction import correct_posture
from sssi_exudyn.motion.motion import Motion
from sssi_exudyn.recording.recording import Recording
from sssi_exudyn.runtime.provenance import source_digest
from sssi_exudyn.runtime.workers import end_with_parent
from sssi_exudyn.validation.benchmark.cases import Case, Made, Planned, Recorded, make, plan
from sssi_exudyn.validation.benchmark.page import benchmark_page
from sssi_exudyn.validation.benchmark.scores import CaseResult, Scores, score
from sssi_exudyn.validation.benchmark.world import Instruments
from sssi_exudyn.validation.diagnosis.diagnose import diagnose, fit_without_findings
from sssi_exudyn.validation.diagnosis.diagnosis_data import Friction
from sssi_exudyn.validation.diagnosis.search.explanation import Round

ANSWERS, SEAL = "answers.json", "answers.sha256"
Bases = list[Recorded]
_MADE: Final = 0.1
"""Share of a benchmark's computing after which its cases are made, roughly."""
_ROUNDING: Final = 1e-8
"""Share by which the numbers of a case differ where it is made again: 1e-13 of an estimate, grown along a run."""


def base_of(recording: Recording, motion: Motion, model: Model) -> Recorded:
    """Return a recording with its movement and friction, corrected by an estimate, from which cases are made.

    Raises ValueError without a GPS.
    """
    problem = problem_of(recording, motion, on_snow_surface(model, recording, motion), "joint")
    estimated = estimate(problem, recording, motion, full=False).fitted.model
    friction = {name: estimated.value(name) for name in snow_beforehand(model)}
    return recording, correct_posture(motion, estimated.posture), model.with_values(friction)


def seal(folder: Path, cases: Sequence[Case], bases: Sequence[Recorded] = ()) -> str:
    """Write the answers and their hash, which covers also the recordings and the method, and return the hash.

    Raises ValueError where other answers are sealed there already.
    """
    text = to_json([asdict(case) for case in cases])
    sealed = [text, source_digest(), *(to_json(recording.hashes) for recording, _, _ in bases)]
    digest = hashlib.sha256("\n".join(sealed).encode()).hexdigest()
    seal = folder / SEAL
    if seal.exists() and seal.read_text(encoding="utf-8").strip() != digest:
        raise ValueError(f"{folder} holds the seal of other answers, or of another method; choose another folder")
    write_atomically(folder / ANSWERS, text)
    write_atomically(seal, digest + "\n")
    return digest


def is_same_case(one: Case, other: Case) -> bool:
    """Tell whether two cases conceal the same: estimates that cases are made from agree to rounding only."""
    (words, numbers), (other_words, other_numbers) = _split(one), _split(other)
    return (
        words == other_words
        and len(numbers) == len(other_numbers)
        and np.allclose(numbers, other_numbers, rtol=_ROUNDING, atol=0.0)
    )


def _split(case: Case) -> tuple[Case, list[float]]:
    """Return a case without its numbers, and these."""
    others = [number for number in (case.mu_t, case.mu_n, case.seconds) if number is not None]
    words = replace(case, truth=dict.fromkeys(case.truth, 0.0), window=None, mu_t=None, mu_n=None, seconds=None)
    return words, [*case.truth.values(), *(case.window or ()), *others]


@dataclass(frozen=True)
class SealedCases:
    """The cases of a benchmark in its folder, each made and diagnosed once.

    full : how many of them, the first ones, are diagnosed with the full model
    """

    bases: Bases
    seed: int
    full: int
    folder: Path

    def answer_file(self, index: int) -> Path:
        """Return where the answer of a case is."""
        return self.folder / "made" / f"{index:03d}.json"

    def result_file(self, index: int) -> Path:
        """Return where the diagnosis of a case is."""
        return self.folder / f"case_{index:03d}.json"

    def make(self, index: int, planned: Planned) -> Case:
        """Make a case and keep its answer; read the answer alone where it was made before.

        Raises InputError where the folder holds the answer of another plan.
        """
        path = self.answer_file(index)
        if not path.exists():
            with clear_errors(path.parent):
                make_folder(path.parent)
            write_atomically(path, to_json(make(index, planned, self.bases, self.seed).case))
        case = read_json(path, Case)
        if (case.index, case.name, case.kind, case.strength) != (
            index, planned.name, planned.kind, planned.strength
        ):  # fmt: skip
            raise InputError(path, "", "the answer of another benchmark", "choose another folder with --out")
        return case

    def diagnose(self, case: Case, planned: Planned) -> None:
        """Diagnose a case, made again from its seed, unless it was diagnosed before.

        Raises InputError where the case made differs from the sealed one.
        """
        path = self.result_file(case.index)
        if path.exists():
            return
        made = make(case.index, planned, self.bases, self.seed)
        if not is_same_case(made.case, case):
            answer = self.answer_file(case.index)
            raise InputError(answer, "", "its seed makes another case", "choose another folder with --out")
        write_atomically(path, to_json(diagnose_case(made, full=case.index < self.full)))


def diagnose_case(made: Made, *, full: bool) -> CaseResult:
    """Diagnose one case, and return its diagnosis with the answers of the baselines and the oracle."""
    try:
        outcome = diagnose(made.recording, made.motion, made.model, full=full)
    except SimulationDiverged as error:
        return CaseResult(made.case.index, failed=str(error))
    first = outcome.rounds[0]
    oracle = held_out_plain = None
    strengths: list[float] = []
    if made.effects:
        without, figures = fit_without_findings(*made.with_effects(()))
        oracle, held_out_plain = _strength(made.instruments, first.linear, without), figures.held_out_error
    for effect in range(made.effects if made.effects > 1 else 0):
        without, _ = fit_without_findings(*made.with_effects(set(range(made.effects)) - {effect}))
        strengths.append(_strength(made.instruments, first.linear, without))
    bic, in_sample = _baselines(first)
    latent = outcome.diagnosis.latent_force
    return CaseResult(
        index=made.case.index,
        full=full,
        diagnosis=outcome.diagnosis,
        friction=Friction(outcome.model.value(MU_T), outcome.model.value(MU_N)),
        held_out_m=outcome.figures[-1].held_out_error,
        held_out_plain_m=held_out_plain,
        bic=bic,
        in_sample=in_sample,
        oracle=oracle,
        strengths=tuple(strengths),
        force_log_bayes_factor=None if latent is None else latent.before.log_bayes_factor,
    )


def _baselines(searched: Round) -> tuple[str, str]:
    """Return names by the Bayesian information criterion with white noise, and by the best fit in sample."""
    linear = searched.linear
    count = len(linear.residual)
    scale = np.ones(count)
    for place in linear.measurements.blocks.values():
        if place.stop > place.start:
            scale[place] = np.std(linear.residual[place]) or 1.0
    y, x = linear.residual / scale, linear.free.columns / scale[:, None]

    def remaining(columns: Array) -> float:
        table = np.column_stack([x, columns / scale[:, None]])
        solution = np.linalg.lstsq(table, y, rcond=None)[0]
        return float(np.sum((y - table @ solution) ** 2))

    nothing = remaining(np.zeros((count, 0)))
    best_bic, best_fit = ("none", count * np.log(nothing)), ("none", nothing)
    by_name = {explanation.name: explanation for explanation in searched.hypotheses}
    for name in (name for name in searched.responses if name in by_name):
        explanation = by_name[name]
        columns = explanation.candidate.free.columns
        remains = remaining(columns)
        places = len(explanation.candidate.places)
        bic = count * np.log(remains) + (columns.shape[1] + places) * np.log(count)
        best_bic = min(best_bic, (name, bic), key=lambda item: item[1])
        best_fit = min(best_fit, (name, remains), key=lambda item: item[1])
    return best_bic[0], best_fit[0]


def _strength(instruments: Instruments, linear: LinearModel, without: LinearModel) -> float:
    """Return the strength of an effect in standard errors, from the χ² that a fit cannot explain.

    It is the increase over the χ² of the same fit to the same run ``without`` the effect, with the same noise.  χ² uses
    the true noise and all priors, each about its own fit.

    A linear computation about one fit is not possible: friction takes up grooves whose resistance would count as 739
    such standard errors.
    """
    hidden, plain = (
        uncertain(model, instruments.levels(model.measurements)).chi_squared for model in (linear, without)
    )
    return float(np.sqrt(max(0.0, hidden - plain)))


def run_benchmark(
    folder: Path,
    bases: Bases,
    *,
    count: int,
    seed: int,
    full: int,
    workers: int,
    progress: Advance,
    conceal: Concealed,
) -> Scores:
    """Make, seal, diagnose and score ``count`` cases into ``folder``, in ``workers`` processes.

    The first ``full`` cases are diagnosed with the full model.
    """
    planned = plan(count, seed, conceal)
    cases: dict[int, Case] = {}
    sealed = SealedCases(bases, seed, full, folder)
    with ProcessPoolExecutor(workers, get_context("spawn"), _prepare_worker, (sealed,)) as pool:
        making = [pool.submit(_make_case, index, case) for index, case in enumerate(planned)]
        for future in as_completed(making):
            case = future.result()
            cases[case.index] = case
            part_of(progress, 0.0, _MADE)(len(cases) / count, f"made {len(cases)} of {count}")
        ordered = [cases[index] for index in range(count)]
        digest = seal(folder, ordered, bases)
        diagnosing = [pool.submit(_diagnose_case, case, planned[case.index]) for case in ordered]
        for number, diagnosed in enumerate(as_completed(diagnosing), 1):
            diagnosed.result()
            part_of(progress, _MADE, 1.0)(number / count, f"diagnosed {number} of {count}")
    scores = score(ordered, [read_json(sealed.result_file(index), CaseResult) for index in range(count)], digest)
    write_atomically(folder / "scores.json", to_json(scores))
    write_atomically(folder / "scores.md", benchmark_page(scores))
    return scores


_worker: list[SealedCases] = []
"""The cases that a worker process makes and diagnoses, received when it began."""


def _prepare_worker(sealed: SealedCases) -> None:
    end_with_parent()
    signal.signal(signal.SIGINT, signal.SIG_DFL)  # a case takes minutes: an interrupt does not wait for it
    _worker[:] = [sealed]


def _make_case(index: int, planned: Planned) -> Case:
    return _worker[0].make(index, planned)


def _diagnose_case(case: Case, planned: Planned) -> None:
    _worker[0].diagnose(case, planned)
