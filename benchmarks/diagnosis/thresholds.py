"""Each chosen number of the diagnosis, 1.5 times as large and as small: what it changes of unseen cases.

``python benchmarks/diagnosis/thresholds.py FOLDER [--seed 46201] [--cases 36]`` keeps a file a case in the folder,
goes on with what it lacks, and prints which numbers changed anything.

Every case is diagnosed once, and again with each number changed.  Each stage of a diagnosis keeps which numbers it read
and what they were compared with.  It is taken from memory where its arguments are the same, and where every number that
it read is the same, or was compared alone and no comparison would come out otherwise.
"""

from __future__ import annotations

import argparse
import hashlib
import operator
import pickle
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields, is_dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, ClassVar, Final

import numpy as np

from sssi_exudyn.io.typed import read_json
from sssi_exudyn.io.writing import to_json, write_atomically
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.motion.from_recording import motion_from_recording
from sssi_exudyn.recording.read import read_recording
from sssi_exudyn.runtime.cache import Cache
from sssi_exudyn.runtime.threads import with_one_thread_for_products
from sssi_exudyn.validation.benchmark.cases import Case, Made, make, plan
from sssi_exudyn.validation.benchmark.run import base_of
from sssi_exudyn.validation.diagnosis import diagnose as diagnosis_stages
from sssi_exudyn.validation.diagnosis import state
from sssi_exudyn.validation.diagnosis.diagnose import diagnose
from sssi_exudyn.validation.diagnosis.diagnosis_data import Diagnosis, Number
from sssi_exudyn.validation.diagnosis.search import compare_hypotheses, reestimate_rivals
from sssi_exudyn.validation.diagnosis.thresholds import THRESHOLDS, Thresholds
from sssi_exudyn.validation.diagnosis.worlds import weigh

EXAMPLES: Final = Path(__file__).parents[2] / "examples"
FACTOR: Final = 1.5
CASES: Final = 36
SEED: Final = 46201
NUMBERS: Final = {number.name: getattr(THRESHOLDS, number.name) for number in fields(THRESHOLDS)}
"""All chosen numbers by name."""
Outcome = dict[str, Any]
"""What of a diagnosis counts: verdict, names, what is said surely, and which intervals hold the truth."""
_STAGES: Final = {
    diagnosis_stages: (
        "first_fit",
        "compare_hypotheses",
        "estimate_rivals",
        "weigh_finding",
        "weigh_nothing",
        "estimate_again",
        "last_estimate",
        "describe",
    ),
    compare_hypotheses: ("responses_by_name",),
    reestimate_rivals: ("weigh_free_form",),
    weigh: ("responses_by_name", "_judge", "train"),
}
"""Functions that read the numbers, by the module that calls them."""
_PLAIN: Final = {
    state: ("_estimate_with", "best_levels"),
    compare_hypotheses: ("best_evidence",),
    reestimate_rivals: ("best_evidence",),
}
"""Functions that read none of the numbers, likewise."""
_LEFT_OUT: Final = ("progress", "cache")
"""Fields on which no result depends."""


@dataclass(frozen=True)
class Row:
    """A case with one number changed.

    again : whether any stage of its diagnosis was computed again
    changed : what of the outcome is another one, each before and after
    """

    threshold: str
    factor: float
    again: bool
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
        """Return whether ``value`` is the same, or would do the same in all that was done with the number."""
        plain = float.__add__(self, 0.0)
        if plain == value:
            return True
        return (
            not self.used
            and bool(self.compared)
            and all((other > plain, other == plain) == (other > value, other == value) for other in self.compared)
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

Reads = list[tuple[str, Any]]
"""Numbers that were read by name, as they were, a ``Traced`` where it is a float."""


@dataclass(frozen=True)
class Varied(Thresholds):
    """The numbers as ``changed`` has them; every stage that is under way keeps what it reads."""

    changed: ClassVar[dict[str, Any]] = {}
    under_way: ClassVar[list[Reads]] = []

    def __getattribute__(self, name: str) -> Any:
        if name not in NUMBERS:
            return super().__getattribute__(name)
        value = Varied.changed.get(name, NUMBERS[name])
        read = Traced(value) if isinstance(value, float) else value
        for reads in Varied.under_way:
            reads.append((name, read))
        return read


def _is_same(read: Any, name: str) -> bool:
    now = Varied.changed.get(name, NUMBERS[name])
    return read.same_with(now) if isinstance(read, Traced) else bool(read == now)


@dataclass
class Memory:
    """What the stages of a case's diagnoses gave, by their arguments.

    computed : stages that were not in memory
    """

    results: dict[tuple[str, bytes], list[tuple[Reads, Any]]] = field(default_factory=dict)
    digests: dict[int, tuple[object, bytes]] = field(default_factory=dict)
    first_of: dict[bytes, Any] = field(default_factory=dict)
    computed: int = 0

    def recall(self, stage: Callable[..., Any], arguments: object, compute: Callable[[], Any], *, reads: bool) -> Any:
        """Return what the stage gives, from memory where nothing that it depends on is another."""
        key = stage.__qualname__, self.digest(arguments)
        for read, result in self.results.setdefault(key, []):
            if all(_is_same(value, name) for name, value in read):
                for others in Varied.under_way:
                    others.extend(read)
                return result
        self.computed += 1
        read = []
        if reads:
            Varied.under_way.append(read)
        try:
            result = compute()
        finally:
            if reads:
                Varied.under_way.pop()
        result = self.first_of.setdefault(self.digest(result), result)
        self.results[key].append((read, result))
        return result

    def digest(self, thing: object) -> bytes:
        """Return the hash of a thing's content, but for the numbers and what no result depends on."""
        if thing is None or isinstance(thing, bool | int | float | str | bytes | np.generic):
            kind = float if isinstance(thing, Traced) else type(thing)
            return hashlib.sha256(repr((kind.__name__, thing)).encode()).digest()
        known = self.digests.get(id(thing))
        if known is None:
            known = thing, hashlib.sha256(self._content(thing)).digest()
            self.digests[id(thing)] = known  # which keeps the thing: its id stays its own
        return known[1]

    def _content(self, thing: object) -> bytes:
        if isinstance(thing, Varied):
            return b"numbers"
        if isinstance(thing, np.ndarray):
            return repr((thing.dtype.str, thing.shape)).encode() + thing.tobytes()
        if isinstance(thing, list | tuple):
            return b"sequence" + b"".join(map(self.digest, thing))
        if isinstance(thing, Mapping):
            return b"mapping" + b"".join(self.digest(name) + self.digest(value) for name, value in thing.items())
        if is_dataclass(thing) and not isinstance(thing, type):
            values = [getattr(thing, f.name) for f in fields(thing) if f.name not in _LEFT_OUT]
            return type(thing).__qualname__.encode() + b"".join(map(self.digest, values))
        return pickle.dumps(thing)


def remember(memory: Callable[[], Memory]) -> None:
    """Give all stages the memory of the case that is studied."""
    for stages, reads in ((_STAGES, True), (_PLAIN, False)):
        for module, names in stages.items():
            for name in names:
                setattr(module, name, _remembered(getattr(module, name), memory, reads=reads))


def _remembered(stage: Callable[..., Any], memory: Callable[[], Memory], *, reads: bool) -> Callable[..., Any]:
    def recall(*arguments: Any, **options: Any) -> Any:
        return memory().recall(stage, (arguments, options), lambda: stage(*arguments, **options), reads=reads)

    return recall


VARIED: Final = Varied()


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


def diagnosed(made: Made, cache: Cache) -> Outcome:
    """Return what a diagnosis by the reduced model says of a case with the numbers as they are varied."""
    result = diagnose(made.recording, made.motion, made.model, full=False, cache=cache, thresholds=VARIED)
    return outcome_of(result.diagnosis, made.case)


def study(made: Made, memory: Memory, cache: Cache) -> Studied:
    """Diagnose a case as it is, and with each number changed."""
    before, rows = diagnosed(made, cache), []
    for name, value in NUMBERS.items():
        for factor in (FACTOR, 1.0 / FACTOR):
            Varied.changed[name] = scaled(value, factor)
            memory.computed = 0
            try:
                after = diagnosed(made, cache)
            finally:
                Varied.changed.clear()
            changed = {key: (str(before[key]), str(after[key])) for key in before if before[key] != after[key]}
            rows.append(Row(name, factor, memory.computed > 0, changed))
    case = made.case
    return Studied(case.index, case.name, case.kind, case.strength, before, tuple(rows))


def summary(cases: Sequence[Studied]) -> str:
    """Return numbers by what they change, those that change most first."""
    lines = [
        "| number | cases | something computed again | verdict or name | sure or held | other |",
        "|---|---|---|---|---|---|",
    ]
    counts = []
    for name in NUMBERS:
        rows = [row for studied in cases for row in studied.rows if row.threshold == name]
        changed = [set(row.changed) for row in rows]
        named = sum(bool(keys & {"verdict", "names"}) for keys in changed)
        flags = sum(bool(keys & {"surely", "mu_t held", "mu_n held", "sizes held"}) for keys in changed)
        other = sum(bool(keys & {"alternatives", "next"}) for keys in changed)
        counts.append((named, flags, other, name, sum(row.again for row in rows)))
    for named, flags, other, name, again in sorted(counts, key=lambda count: tuple(-n for n in count[:3])):
        lines.append(f"| {name} | {len(cases)} | {again} | {named} | {flags} | {other} |")
    return "\n".join(lines)


@with_one_thread_for_products
def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, help="where a file a case is kept")
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--cases", type=int, default=CASES, help="of a plan of 36, the first so many")
    options = parser.parse_args()
    bases = []
    for name in ("beginner", "intermediate"):
        recording = read_recording(EXAMPLES / name)
        motion = motion_from_recording(recording)
        bases.append(base_of(recording, motion, model_of(recording, motion)))
    options.folder.mkdir(parents=True, exist_ok=True)
    files = {}
    memory = Memory()
    remember(lambda: memory)
    for index, concealed in enumerate(plan(CASES, options.seed)[: options.cases]):
        files[index] = options.folder / f"case_{index:02}.json"
        if files[index].exists():
            continue
        memory = Memory()
        with TemporaryDirectory() as folder:
            studied = study(make(index, concealed, bases, options.seed), memory, Cache(Path(folder)))
        write_atomically(files[index], to_json(asdict(studied)))
    print(summary([read_json(file, Studied) for file in files.values()]))


if __name__ == "__main__":
    main()
