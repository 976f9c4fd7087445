"""Each chosen number of the diagnosis, 1.5 times as large and as small: what it changes of unseen cases.

``python benchmarks/thresholds.py FOLDER [--seed 46201] [--cases 36] [--again 0]`` keeps a file a case in the folder,
goes on with what it lacks, and prints which numbers changed anything.

First every case is diagnosed once, with numbers that keep what they were compared with.  Where a number was not read,
or was compared alone and no comparison would have come out otherwise, the diagnosis would be the same: it is not
repeated.  Of the others each number is then tried on ``--again`` cases, those of the next number being others; refits,
responses and noise levels whose inputs are the same are taken from memory.
"""

from __future__ import annotations

import argparse
import hashlib
import operator
import pickle
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import Any, ClassVar, Final

import numpy as np

from sssi_exudyn.fitting.evidence import best_levels
from sssi_exudyn.io.typed import read_json
from sssi_exudyn.io.writing import to_json, write_atomically
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.motion.from_recording import motion_from_recording
from sssi_exudyn.recording.read import read_recording
from sssi_exudyn.runtime.cache import Cache
from sssi_exudyn.runtime.threads import with_one_thread_for_products
from sssi_exudyn.validation.benchmark.cases import Case, Made, make, plan
from sssi_exudyn.validation.benchmark.run import base_of
from sssi_exudyn.validation.diagnosis import state
from sssi_exudyn.validation.diagnosis.diagnose import diagnose
from sssi_exudyn.validation.diagnosis.diagnosis_data import Diagnosis, Number
from sssi_exudyn.validation.diagnosis.search import compare_hypotheses, reestimate_rivals
from sssi_exudyn.validation.diagnosis.thresholds import THRESHOLDS, Thresholds

EXAMPLES: Final = Path(__file__).parents[1] / "examples"
FACTOR: Final = 1.5
CASES: Final = 36
SEED: Final = 46201
Outcome = dict[str, Any]
"""What of a diagnosis counts: verdict, names, what is said surely, and which intervals hold the truth."""


@dataclass(frozen=True)
class Row:
    """A case with one number changed.

    again : whether it was diagnosed again; False where no comparison came out otherwise, None where that is to be done
    changed : what of the outcome is another one, each before and after
    """

    threshold: str
    factor: float
    again: bool | None
    changed: dict[str, tuple[str, str]]


@dataclass(frozen=True)
class Studied:
    """A case, what its diagnosis says, and a row a number and factor."""

    case: int
    hidden: str
    kind: str
    strength: int
    outcome: Outcome
    rows: tuple[Row, ...]


@dataclass(frozen=True)
class Watched(Thresholds):
    """Numbers that keep which of them were read."""

    read: ClassVar[set[str]] = set()

    def __getattribute__(self, name: str) -> Any:
        Watched.read.add(name)
        return super().__getattribute__(name)


class Traced(float):
    """A number that keeps what it is compared with (``compared``), and whether it was computed with (``used``)."""

    __array_ufunc__ = None  # so that NumPy's numbers leave comparisons to this class
    compared: list[float]
    used: bool

    def __new__(cls, value: float) -> Traced:
        made = super().__new__(cls, value)
        made.compared, made.used = [], False
        return made

    def same_with(self, value: float) -> bool:
        """Return whether every comparison would come out the same with another ``value``, and nothing else was done."""
        plain = float.__add__(self, 0.0)
        return not self.used and all(
            (other > plain, other == plain) == (other > value, other == value) for other in self.compared
        )


def _comparison(by: Callable[[Any, Any], Any]) -> Callable[[Traced, Any], Any]:
    def compare(self: Traced, other: Any) -> Any:
        self.compared.extend(np.ravel(other).tolist())
        return by(float.__add__(self, 0.0), other)

    return compare


def _computation(name: str) -> Callable[..., Any]:
    plain = getattr(operator, name.strip("_").removeprefix("r"))

    def compute(self: Traced, *others: Any) -> Any:
        self.used = True
        value = float.__add__(self, 0.0)
        return plain(*others, value) if name.startswith("__r") else plain(value, *others)

    return compute


for _name in ("lt", "le", "gt", "ge"):
    setattr(Traced, f"__{_name}__", _comparison(getattr(operator, _name)))
for _name in ("add", "sub", "mul", "truediv", "pow"):
    setattr(Traced, f"__{_name}__", _computation(f"__{_name}__"))
    setattr(Traced, f"__r{_name}__", _computation(f"__r{_name}__"))
setattr(Traced, "__neg__", _computation("__neg__"))  # noqa: B010 - a method that mypy knows is assigned


def remembered(function: Callable[..., Any]) -> Callable[..., Any]:
    """Return the function with a memory of what it gave of the same arguments."""
    memory: dict[bytes, Any] = {}

    def recall(*arguments: Any) -> Any:
        key = hashlib.sha256(pickle.dumps(arguments)).digest()
        if key not in memory:
            memory[key] = function(*arguments)
        return memory[key]

    return recall


def scaled(value: float | tuple[float, ...], factor: float) -> Any:
    """Return the number so many times as large; a count is rounded, and of a share near one what is left of one is
    scaled.
    """
    if isinstance(value, tuple):
        return tuple(scaled(part, factor) for part in value)
    if isinstance(value, int):
        return max(1, round(value * factor))
    return 1.0 - (1.0 - value) / factor if 0.5 < value < 1.0 <= FACTOR * value else value * factor


def outcome_of(diagnosis: Diagnosis, case: Case) -> Outcome:
    """Return what of a diagnosis counts."""
    friction = diagnosis.friction_averaged or {}
    numbers = {name: number for finding in diagnosis.findings for name, number in finding.parameters.items()}

    def holds(number: Number, truth: float | None) -> str:
        return "" if truth is None else str(number.low <= truth <= number.high)

    return {
        "verdict": diagnosis.verdict,
        "names": " ".join(finding.name for finding in diagnosis.findings),
        "alternatives": " ".join(rival.name for finding in diagnosis.findings for rival in finding.alternatives),
        "surely": " ".join(str(finding.probability >= THRESHOLDS.sure) for finding in diagnosis.findings),
        "mu_t held": holds(friction["mu_t"], case.mu_t),
        "mu_n held": holds(friction["mu_n"], case.mu_n),
        "sizes held": " ".join(f"{k} {holds(numbers[k], v)}" for k, v in case.truth.items() if k in numbers),
        "next": " ".join(proposal.measurement for proposal in diagnosis.next),
    }


def diagnosed(made: Made, cache: Cache, thresholds: Thresholds) -> Outcome:
    """Return what a diagnosis by the reduced model says of a case with those numbers."""
    result = diagnose(made.recording, made.motion, made.model, full=False, cache=cache, thresholds=thresholds)
    return outcome_of(result.diagnosis, made.case)


def numbers() -> dict[str, Any]:
    """Return all chosen numbers by name."""
    return {field.name: getattr(THRESHOLDS, field.name) for field in fields(THRESHOLDS)}


def first_pass(made: Made, cache: Cache) -> Studied:
    """Diagnose a case as it is, and say of which numbers it has to be diagnosed again."""
    traced = {name: Traced(value) for name, value in numbers().items() if isinstance(value, float)}
    Watched.read.clear()
    outcome = diagnosed(made, cache, Watched(**{**numbers(), **traced}))
    read = set(Watched.read)
    rows = []
    for name, value in numbers().items():
        for factor in (FACTOR, 1.0 / FACTOR):
            other = scaled(value, factor)
            same = name not in read or other == value or (name in traced and traced[name].same_with(other))
            rows.append(Row(name, factor, False if same else None, {}))
    case = made.case
    return Studied(case.index, case.name, case.kind, case.strength, outcome, tuple(rows))


def chosen_rows(cases: Sequence[Studied], count: int) -> list[set[int]]:
    """Return the rows of each case that are diagnosed again: ``count`` cases a number, with both factors."""
    chosen: list[set[int]] = [set() for _ in cases]
    for place, name in enumerate(numbers()):
        order = [(place + step) % len(cases) for step in range(len(cases))]
        rows = {k: {i for i, row in enumerate(cases[k].rows) if row.threshold == name} for k in order}
        tried = [k for k in order if any(cases[k].rows[i].again is not False for i in rows[k])]
        for k in tried[:count]:
            chosen[k] |= rows[k]
    return chosen


def second_pass(made: Made, studied: Studied, chosen: set[int], cache: Cache, write: Callable[[Studied], None]) -> None:
    """Diagnose a case again with each of the ``chosen`` rows' numbers, and ``write`` it after each."""
    rows, before = list(studied.rows), studied.outcome
    for index in sorted(chosen):
        row = rows[index]
        if row.again is not None:
            continue
        changed_number = {row.threshold: scaled(numbers()[row.threshold], row.factor)}
        after = diagnosed(made, cache, replace(THRESHOLDS, **changed_number))
        changed = {key: (before[key], after[key]) for key in before if before[key] != after[key]}
        rows[index] = replace(row, again=True, changed=changed)
        write(replace(studied, rows=tuple(rows)))


def summary(cases: Sequence[Studied]) -> str:
    """Return numbers by what they change, those that change most first."""
    lines = [
        "| number | cases | diagnosed again | to be | verdict or name | sure or held | other |",
        "|---|---|---|---|---|---|---|",
    ]
    counts = []
    for name in numbers():
        rows = [row for studied in cases for row in studied.rows if row.threshold == name]
        changed = [set(row.changed) for row in rows]
        named = sum(bool(keys & {"verdict", "names"}) for keys in changed)
        flags = sum(bool(keys & {"surely", "mu_t held", "mu_n held", "sizes held"}) for keys in changed)
        other = sum(bool(keys & {"alternatives", "next"}) for keys in changed)
        again, open_rows = sum(row.again is True for row in rows), sum(row.again is None for row in rows)
        counts.append((named, flags, other, name, again, open_rows))
    for named, flags, other, name, again, open_rows in sorted(counts, key=lambda count: tuple(-n for n in count[:3])):
        lines.append(f"| {name} | {len(cases)} | {again} | {open_rows} | {named} | {flags} | {other} |")
    return "\n".join(lines)


@with_one_thread_for_products
def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, help="where a file a case is kept")
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--cases", type=int, default=CASES, help="of a plan of 36, the first so many")
    parser.add_argument("--again", type=int, default=0, help="cases on which each number is tried")
    options = parser.parse_args()
    levels = remembered(best_levels)
    for module in (compare_hypotheses, reestimate_rivals, state):
        module.best_levels = levels  # type: ignore[attr-defined]
    bases = []
    for name in ("beginner", "intermediate"):
        recording = read_recording(EXAMPLES / name)
        motion = motion_from_recording(recording)
        bases.append(base_of(recording, motion, model_of(recording, motion)))
    options.folder.mkdir(parents=True, exist_ok=True)
    planned = plan(CASES, options.seed)[: options.cases]

    def file_of(index: int) -> Path:
        return Path(options.folder) / f"case_{index:02}.json"

    def write(studied: Studied) -> None:
        write_atomically(file_of(studied.case), to_json(asdict(studied)))

    for index, concealed in enumerate(planned):
        if not file_of(index).exists():
            write(first_pass(make(index, concealed, bases, options.seed), Cache(options.folder / f"cache_{index:02}")))
    studied = [read_json(file_of(index), Studied) for index in range(len(planned))]
    for index, chosen in enumerate(chosen_rows(studied, options.again)):
        if any(studied[index].rows[row].again is None for row in chosen):
            made = make(index, planned[index], bases, options.seed)
            second_pass(made, studied[index], chosen, Cache(options.folder / f"cache_{index:02}"), write)
    print(summary([read_json(file_of(index), Studied) for index in range(len(planned))]))


if __name__ == "__main__":
    main()
