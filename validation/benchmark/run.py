"""The blind benchmark of the diagnosis: sealed cases, one scoring run, figures with their confidence intervals.

Cases come from ``benchmark_world``.  Answers are written and hashed before anything is diagnosed.  Each case leaves one
file; a run that was interrupted goes on with those that are missing.  Beside the diagnosis two baselines see the same
cases (the best Bayesian information criterion with white noise; the best fit in sample), and an oracle that knows the
effect's form and asks only whether it is there.
"""

from __future__ import annotations

import hashlib
import json
import pickle
import signal
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict
from itertools import pairwise
from multiprocessing import get_context
from pathlib import Path
from typing import Any, Final

import numpy as np
from scipy.stats import beta

from sssi_exudyn.errors import SimulationDiverged
from sssi_exudyn.fitting.fit import fit_reduced, problem_of
from sssi_exudyn.frames import Array
from sssi_exudyn.model import Model
from sssi_exudyn.motion import Motion
from sssi_exudyn.recording import Recording
from sssi_exudyn.reduced import prepare
from sssi_exudyn.result_folder import to_json, write_atomically
from sssi_exudyn.validation.benchmark_page import benchmark_page
from sssi_exudyn.validation.benchmark_world import Case, Made, Recorded, make, plan
from sssi_exudyn.validation.diagnosis import Diagnosis, diagnose, diagnosis_to_dict, figures_as_it_is
from sssi_exudyn.validation.evidence import Account, log_factors
from sssi_exudyn.validation.hypotheses import BY_NAME, HYPOTHESES
from sssi_exudyn.validation.search import Round
from sssi_exudyn.workers import end_with_parent

ANSWERS, SEAL = "answers.json", "answers.sha256"
STRONG: Final = 8.0
"""Standard errors from which an effect counts as clear."""
SURE: Final = 0.8
"""Probability from which a wrong name is worse than none."""
_BINS: Final = (0.0, 0.5, 0.8, 0.95, 1.01)
Bases = list[Recorded]


def base_of(recording: Recording, motion: Motion, model: Model) -> Recorded:
    """A recording with its movement and its model fitted to it, as cases are made from.

    Raises ValueError without a GPS.
    """
    problem = problem_of(recording, motion, model, "joint")
    return recording, motion, problem.model_at(fit_reduced(problem, prepare(problem.model, motion)).values)


def sealed(folder: Path, cases: Sequence[Case]) -> str:
    """Write the answers and their hash; the hash.  Raises ValueError where other answers are sealed there already."""
    text = to_json([asdict(case) for case in cases])
    digest = hashlib.sha256(text.encode()).hexdigest()
    seal = folder / SEAL
    if seal.exists() and seal.read_text(encoding="utf-8").strip() != digest:
        raise ValueError(f"{folder} holds the seal of other answers")
    write_atomically(folder / ANSWERS, text)
    write_atomically(seal, digest + "\n")
    return digest


def judged_case(made: Made, *, full: bool) -> dict[str, Any]:
    """Diagnose one case; what it said, with what baselines and oracle say of it."""
    try:
        found = diagnose(made.recording, made.motion, made.model, full=full)
    except SimulationDiverged as error:
        return {"index": made.case.index, "failed": str(error)}
    first = found.rounds[0]
    oracle = _oracle(made.case, found, first)
    clear = found.findings and (oracle or 0.0) >= STRONG  # where it is asked for
    return {
        "index": made.case.index,
        "full": full,
        "said": diagnosis_to_dict(found),
        "friction": {k: found.model.value(f"friction.{k}") for k in ("mu_t", "mu_n")},
        "held_out_m": found.figures[-1].held_out_error,
        "held_out_plain_m": figures_as_it_is(*made.plain).held_out_error if made.plain and clear else None,
        **_baselines(first),
        "oracle": oracle,
    }


def _baselines(weighed: Round) -> dict[str, str]:
    """Names that white-noise BIC and the best fit in sample give, by the same linear responses."""
    account = weighed.account
    count = len(account.residual)
    scale = np.ones(count)
    for place in account.witnesses.blocks.values():
        if place.stop > place.start:
            scale[place] = np.std(account.residual[place]) or 1.0
    y, x = account.residual / scale, account.free.columns / scale[:, None]

    def left(columns: Array) -> float:
        table = np.column_stack([x, columns / scale[:, None]])
        solution = np.linalg.lstsq(table, y, rcond=None)[0]
        return float(np.sum((y - table @ solution) ** 2))

    nothing = left(np.zeros((count, 0)))
    best_bic, best_fit = ("none", count * np.log(nothing)), ("none", nothing)
    for hypothesis in HYPOTHESES:
        verdict = next((v for v in weighed.verdicts if v.name == hypothesis.name), None)
        if verdict is None or verdict.candidate is None:
            continue
        columns = verdict.candidate.free.columns
        remains = left(columns)
        places = len(verdict.candidate.places)
        bic = count * np.log(remains) + (columns.shape[1] + places) * np.log(count)
        best_bic = min(best_bic, (hypothesis.name, bic), key=lambda each: each[1])
        best_fit = min(best_fit, (hypothesis.name, remains), key=lambda each: each[1])
    return {"bic": best_bic[0], "in_sample": best_fit[0]}


def _oracle(case: Case, found: Diagnosis, weighed: Round) -> float | None:
    """How many standard errors strong the effect is to one who knows its form: root of twice the log likelihood ratio
    of the best candidate of its name.  None where the program has no such name.
    """
    hypothesis = BY_NAME.get(case.name)
    if hypothesis is None:
        return None
    candidates = hypothesis.candidates(weighed.scene, weighed.responses[hypothesis.name])
    account: Account = weighed.account
    if not candidates:
        return None
    best = float(np.max(log_factors(account, found.noise, [c.free for c in candidates])))
    return float(np.sqrt(max(0.0, 2.0 * best)))


def run_benchmark(
    folder: Path, bases: Bases, *, count: int, seed: int, full: int, workers: int, say: Any
) -> dict[str, Any]:
    """Make, seal, diagnose and score ``count`` cases into ``folder``, in ``workers`` processes; the first ``full`` with
    the full model.
    """
    planned = plan(count, seed)
    cases: dict[int, Case] = {}
    with ProcessPoolExecutor(workers, get_context("spawn"), _prepare_worker, (bases, seed, full, folder)) as pool:
        making = [pool.submit(_made, index, each) for index, each in enumerate(planned)]
        for future in as_completed(making):
            case = future.result()
            cases[case.index] = case
            say(len(cases) / count, f"made {len(cases)} of {count}")
        ordered = [cases[index] for index in range(count)]
        digest = sealed(folder, ordered)
        judging = [pool.submit(_judged, index) for index in range(count)]
        for number, each in enumerate(as_completed(judging), 1):
            each.result()
            say(number / count, f"judged {number} of {count}")
    done = [json.loads(_case_file(folder, index).read_text(encoding="utf-8")) for index in range(count)]
    scores = scored(ordered, done)
    scores["seal"] = digest
    write_atomically(folder / "scores.json", to_json(scores))
    write_atomically(folder / "scores.md", benchmark_page(scores))
    return scores


_given: list[Any] = []
"""What a worker process was given when it began."""


def _prepare_worker(bases: Bases, seed: int, full: int, folder: Path) -> None:
    end_with_parent()
    signal.signal(signal.SIGINT, signal.SIG_DFL)  # a case takes minutes: an interrupt does not wait for it
    _given[:] = [bases, seed, full, folder]


def _case_file(folder: Path, index: int) -> Path:
    return folder / f"case_{index:03d}.json"


def _made(index: int, planned: tuple[str, str, int]) -> Case:
    """Make a case and keep it for its judge; made before, it is taken as it was."""
    bases, seed, _, folder = _given
    path = folder / "made" / f"{index:03d}.pickle"
    if path.exists():
        return _kept(path).case
    made = make(index, planned, bases, seed)
    path.parent.mkdir(exist_ok=True)
    write_atomically(path, pickle.dumps(made))
    return made.case


def _kept(path: Path) -> Made:
    made = pickle.loads(path.read_bytes())  # this program's own, of this run
    assert isinstance(made, Made)
    return made


def _judged(index: int) -> None:
    _, _, full, folder = _given
    path = _case_file(folder, index)
    if not path.exists():
        made = _kept(folder / "made" / f"{index:03d}.pickle")
        write_atomically(path, to_json(judged_case(made, full=index < full)))


def share(hits: int, of: int) -> dict[str, float | int | None]:
    """A share with its 95 % interval (Clopper and Pearson)."""
    low = float(beta.ppf(0.025, hits, of - hits + 1)) if hits else 0.0
    high = float(beta.ppf(0.975, hits + 1, of - hits)) if hits < of else 1.0
    return {
        "hits": hits,
        "of": of,
        "share": hits / of if of else None,
        "low": low if of else None,
        "high": high if of else None,
    }


def _named(said: Mapping[str, Any]) -> list[set[str]]:
    """The set of names of each finding: the most probable and its alternatives until 95 % are reached."""
    sets = []
    for finding in said["findings"]:
        names, total = {finding["name"]}, finding["probability"]
        for other in finding["alternatives"]:
            if total >= 0.95:
                break
            names.add(other["name"])
            total += other["probability"]
        sets.append(names)
    return sets


def scored(cases: Sequence[Case], done: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """All figures from the answers and what was said."""
    rows = [(case, each) for case, each in zip(cases, done, strict=True) if "failed" not in each]
    nothing = [(c, d) for c, d in rows if c.kind == "none"]
    single = [(c, d) for c, d in rows if c.kind in ("physics", "sensor")]
    strong = [(c, d) for c, d in single if (d["oracle"] or 0.0) >= STRONG]
    found = [(c, d) for c, d in single if d["said"]["findings"]]
    unknown = [(c, d) for c, d in rows if c.kind == "unexplained" and d["said"]["findings"]]
    pairs = [(c, d) for c, d in rows if c.kind == "pair"]

    def holds(case: Case, each: Mapping[str, Any], most: int = 99) -> bool:
        sets = _named(each["said"])
        return bool(sets) and case.name in sets[0] and len(sets[0]) <= most

    overlaps = [
        _overlap(c.window, d["said"]["findings"][0]["where"])
        for c, d in found
        if c.window and d["said"]["findings"][0]["name"] == c.name and d["said"]["findings"][0]["where"]
    ]
    inside = [_inside(c, d) for c, d in found if d["said"]["findings"][0]["name"] == c.name]
    intervals = [hit for each in inside for hit in each]
    wrong_sure = [d for c, d in rows if _wrong_and_sure(c, d)]
    told = [(d, d["said"]["findings"]) for _, d in strong if d["said"]["findings"]]
    before = np.array([findings[0]["evidence"]["held_out_error_m"]["before"] for _, findings in told])
    after = np.array([findings[-1]["evidence"]["held_out_error_m"]["after"] for _, findings in told])
    plain = np.array([d["held_out_plain_m"] for d, _ in told])
    placebo = [findings[0]["evidence"]["placebo_held_out_error_m"] for _, findings in told]
    undisturbed = np.array([d["held_out_m"] for _, d in nothing])
    noise = float(np.median(undisturbed)) if nothing else float("nan")
    levels = range(4)
    return {
        "cases": len(cases),
        "failed": len(cases) - len(rows),
        "with_full_model": sum(bool(d.get("full")) for _, d in rows),
        "false_alarms": share(sum(bool(d["said"]["findings"]) for _, d in nothing), len(nothing)),
        "false_alarms_bic": share(sum(d["bic"] != "none" for _, d in nothing), len(nothing)),
        "false_alarms_in_sample": share(sum(d["in_sample"] != "none" for _, d in nothing), len(nothing)),
        "strong_right_or_small_set": share(sum(holds(c, d, 3) for c, d in strong), len(strong)),
        "strong_right_name_first": share(
            sum(d["said"]["findings"][0]["name"] == c.name for c, d in strong if d["said"]["findings"]), len(strong)
        ),
        "strong_right_bic": share(sum(d["bic"] == c.name for c, d in strong), len(strong)),
        "strong_right_in_sample": share(sum(d["in_sample"] == c.name for c, d in strong), len(strong)),
        "set_coverage_where_found": share(sum(holds(c, d) for c, d in found), len(found)),
        "found_by_strength": [
            share(
                sum(bool(d["said"]["findings"]) for c, d in single if c.strength == k),
                sum(c.strength == k for c, _ in single),
            )
            for k in levels
        ],
        "right_first_by_strength": [
            share(
                sum(
                    bool(d["said"]["findings"]) and d["said"]["findings"][0]["name"] == c.name
                    for c, d in single
                    if c.strength == k
                ),
                sum(c.strength == k for c, _ in single),
            )
            for k in levels
        ],
        "oracle_sees_by_strength": [
            share(
                sum((d["oracle"] or 0.0) > 3.0 for c, d in single if c.strength == k),
                sum(c.strength == k for c, _ in single),
            )
            for k in levels
        ],
        "overlap_in_time": {
            "cases": len(overlaps),
            "mean": float(np.mean(overlaps)) if overlaps else None,
            "at_least_0.6": share(sum(o >= 0.6 for o in overlaps), len(overlaps)),
        },
        "interval_coverage_90": share(sum(intervals), len(intervals)),
        "wrong_and_sure": share(len(wrong_sure), len(rows)),
        "unexplained_called_so": share(
            sum(any(f["kind"] == "unexplained" for f in d["said"]["findings"]) for _, d in unknown), len(unknown)
        ),
        "pairs_both_named": share(
            sum(set(c.name.split("+")) <= set().union(*_named(d["said"]), set()) for c, d in pairs), len(pairs)
        ),
        "held_out_after_over_before_strong": {
            "median": float(np.median(after / before)) if told else None,
            "cases": len(told),
        },
        "placebo_after_over_before_strong": (
            float(np.median([each["median"] / b for each, b in zip(placebo, before, strict=True)])) if told else None
        ),
        "strong_better_than_placebos": share(
            sum(a < each["least"] for each, a in zip(placebo, after, strict=True)), len(told)
        ),
        "strong_back_within_1.5_plain": share(int(np.sum(after <= 1.5 * plain)), len(told)),
        "held_out_noise_m": noise,
        "strong_back_within_1.5_noise": share(int(np.sum(after <= 1.5 * noise)), len(told)),
        "nothing_within_1.5_noise": share(int(np.sum(undisturbed <= 1.5 * noise)), len(nothing)),
        "calibration": _calibration(rows),
        "by_name": _by_name(single),
    }


def _by_name(single: Sequence[tuple[Case, Mapping[str, Any]]]) -> dict[str, dict[str, int]]:
    """For each concealed name: how often each name was said first."""
    table: dict[str, dict[str, int]] = {}
    for case, each in single:
        findings = each["said"]["findings"]
        said = findings[0]["name"] if findings else "nothing"
        row = table.setdefault(case.name, {})
        row[said] = row.get(said, 0) + 1
    return table


def _overlap(window: tuple[float, float] | list[float], where: Mapping[str, float]) -> float:
    """Intersection over union."""
    both = min(window[1], where["t1_s"]) - max(window[0], where["t0_s"])
    either = max(window[1], where["t1_s"]) - min(window[0], where["t0_s"])
    return max(0.0, both) / either


def _inside(case: Case, each: Mapping[str, Any]) -> list[bool]:
    numbers = each["said"]["findings"][0]["parameters"]
    return [numbers[k]["low"] <= v <= numbers[k]["high"] for k, v in case.truth.items() if k in numbers]


def _right(case: Case, finding: Mapping[str, Any]) -> bool:
    """Whether a finding says what is concealed: its name, or that it is none of the list's."""
    if case.kind == "unexplained":
        return bool(finding["kind"] == "unexplained")
    return finding["name"] in case.name.split("+")


def _wrong_and_sure(case: Case, each: Mapping[str, Any]) -> bool:
    return any(f["probability"] > SURE and not _right(case, f) for f in each["said"]["findings"])


def _calibration(rows: Sequence[tuple[Case, Mapping[str, Any]]]) -> list[dict[str, Any]]:
    """How often findings of a probability are right, by bins of it."""
    said = [(f["probability"], _right(case, f)) for case, each in rows for f in each["said"]["findings"]]
    table = []
    for low, high in pairwise(_BINS):
        inside = [(p, right) for p, right in said if low <= p < high]
        mean = float(np.mean([p for p, _ in inside])) if inside else None
        table.append({"from": low, "said": mean, **share(sum(right for _, right in inside), len(inside))})
    return table
