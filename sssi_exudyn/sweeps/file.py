"""The file of a sweep, read and checked before anything runs.

::

    format = 1
    recordings = ["beginner", "season/*"]     # folders, relative to this file

    [design]
    kind = "grid"                             # list, latin_hypercube, sobol, sobol_indices, morris

    [[parameter]]
    name = "friction.mu_t"
    values = [0.05, 0.1]                      # or low, high and, on a grid, count
"""

from __future__ import annotations

import glob
import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Literal, TypeVar

from sssi_exudyn.bodies.ski.ski import ski_named
from sssi_exudyn.contact.registry import check_together, is_carved, read_term
from sssi_exudyn.contact.term import Term
from sssi_exudyn.core.choices import HEADING_MODES, KEEPS, METHODS, HeadingMode, Keep, Method
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.io.settings import Settings, check_keys, read_toml, table_of, text_of
from sssi_exudyn.runtime.plugins import Plugin, origins_of, require, tables_of
from sssi_exudyn.sweeps.design import INDEXED, KINDS, LISTED, Design
from sssi_exudyn.sweeps.patterns import matching_recordings

Task = Literal["simulate", "fit", "turn", "whatif"]
Tier = Literal["reduced", "full"]
TASKS: Final[tuple[Task, ...]] = ("simulate", "fit", "turn", "whatif")
TIERS: Final[tuple[Tier, ...]] = ("reduced", "full")
_KEYS: Final = (
    "format", "name", "recordings", "model", "task", "tier", "method", "duration_s", "series", "outputs",
    "design", "parameter", "term", "plugin", "skis", "heading", "keep",
)  # fmt: skip
_OF_MODELS: Final = ("model", "tier", "method", "series", "term", "heading")
_WITHOUT_MEANING: Final[Mapping[Task, tuple[str, ...]]] = {
    "simulate": ("skis", "keep"),
    "fit": ("skis", "keep"),
    "turn": ("recordings", "duration_s", *_OF_MODELS, "keep"),
    "whatif": ("skis", *_OF_MODELS),
}
_FIXES: Final = {"skis": 'write task = "turn"', "keep": 'write task = "whatif"'}
LARGEST: Final = 10_000_000
"""Greatest number of points of a design."""
_LONGEST: Final = 1000
"""Greatest length of a folder's name or pattern, in characters."""
Word = TypeVar("Word", bound=str)


@dataclass(frozen=True)
class SweepFile:
    """A sweep's file; its parameters are not looked up yet, since the recordings' models declare them.

    path : the file;  model : a ``model.toml`` or None
    folders : of the recordings, in order, or the skis of turns: names of the catalogue and files
    settings : the file's content
    duration : s of each run from its start, None for whole runs
    series : whether each run's time series is kept
    heading : control of the skiers' heading; None for the model's own
    keep : what the skier of a what-if keeps
    outputs : figures that indices and plots show; empty for the usual ones
    """

    path: Path
    name: str
    folders: tuple[Path, ...]
    model: Path | None
    task: Task
    tier: Tier
    method: Method
    duration: float | None
    series: bool
    outputs: tuple[str, ...]
    terms: tuple[Term, ...]
    heading: HeadingMode | None
    keep: Keep
    design: Design
    settings: Settings

    def portable(self, folder: Path) -> dict[str, Any]:
        """Return the file's content for a copy in ``folder``, with paths relative to it."""
        copy = dict(self.settings)
        copy["name"] = self.name
        places = [_relative(place, folder) if place.is_absolute() else str(place) for place in self.folders]
        copy["skis" if self.task == "turn" else "recordings"] = places
        if self.model is not None:
            copy["model"] = _relative(self.model, folder)
        if self.plugins:
            copy["plugin"] = [plugin.as_table() for plugin in self.plugins]
        return copy

    @property
    def plugins(self) -> tuple[Plugin, ...]:
        """Plug-ins that its terms come from."""
        return origins_of(type(term) for term in self.terms)


def read_sweep(path: Path) -> SweepFile:
    """Read the sweep in a TOML file.  Raises InputError, with file, place and fix, for every mistake in it."""
    return sweep_from(read_toml(path), path)


def sweep_from(settings: Settings, path: Path) -> SweepFile:
    """Read the sweep that ``settings`` describe, as if they were in ``path``.  Raises InputError."""
    check_keys(settings, _KEYS, path, "")
    if settings.get("format") != 1 or isinstance(settings["format"], bool):
        raise InputError(path, "format", f"{settings.get('format')!r} is not known", "write format = 1")
    require(tables_of(settings, path), path)
    task = _one_of(settings, "task", TASKS, path)
    _check_task(settings, task, path)
    folders = _skis(settings.get("skis"), path) if task == "turn" else _folders(settings.get("recordings"), path)
    model = text_of(settings, "model", path, "") if "model" in settings else None
    if model is not None:
        _check_name(model, path, "model")
    if model is not None and len(folders) > 1:
        raise InputError(path, "model", "one model for several recordings", "sweep one recording, or leave it out")
    tier = _one_of(settings, "tier", TIERS, path)
    method = _one_of(settings, "method", METHODS, path)
    if "method" in settings and task != "fit":
        raise InputError(path, "method", "nothing is fitted", 'write task = "fit", or leave it out')
    series = settings.get("series", True)
    if not isinstance(series, bool):
        raise InputError(path, "series", f"{series!r} is neither true nor false", "write true or false")
    return SweepFile(
        path=path,
        name=text_of(settings, "name", path, "", default=path.stem),
        folders=folders,
        model=None if model is None else (path.parent / model).resolve(),
        task=task,
        tier=tier,
        method=method,
        duration=_duration(settings.get("duration_s"), path),
        series=series and task in ("simulate", "fit"),
        outputs=words_of(settings.get("outputs", []), path, "outputs"),
        terms=_terms(settings, path, task),
        heading=_heading(settings, path, task),
        keep=_one_of({"keep": "path"} | dict(settings), "keep", KEEPS, path),
        design=_design(settings, path),
        settings=settings,
    )


def _check_task(settings: Settings, task: Task, path: Path) -> None:
    """Raise InputError for a key that means nothing to this task."""
    for key in _WITHOUT_MEANING[task]:
        if key in settings:
            fix = (
                'leave it out; the skis are skis = ["slalom_165"]'
                if task == "turn"
                else _FIXES.get(key, "leave it out")
            )
            raise InputError(path, key, f'it means nothing to task = "{task}"', fix)


def _skis(names: object, path: Path) -> tuple[Path, ...]:
    skis = []
    for name in words_of(list_of(names, path, "skis"), path, "skis"):
        _check_name(name, path, "skis")
        ski_named(name, path.parent, path, "skis")
        skis.append((path.parent / name).resolve() if name.endswith(".toml") else Path(name))
    if len({ski.name for ski in skis}) < len(skis):
        raise InputError(path, "skis", "two skis have one name", "give each ski its own, once")
    return tuple(skis)


def _design(settings: Settings, path: Path) -> Design:
    if "design" not in settings:
        return Design("grid", 0, 0)
    table = table_of(settings, "design", path)
    check_keys(table, ("kind", "size", "seed"), path, "[design]")
    kind = _one_of(table, "kind", KINDS, path, "[design] ")
    if kind in LISTED:
        if len(table) > 1:
            raise InputError(path, "[design]", f"a {kind} has neither size nor seed", "leave them out")
        return Design(kind, 0, 0)
    size = count_of(table.get("size"), path, "[design] size", least=2 if kind in INDEXED else 1)
    if kind in ("sobol", "sobol_indices") and size & (size - 1):
        better = 2 ** round(math.log2(size))
        raise InputError(path, "[design] size", f"{size} is no power of two, which Sobol wants", f"write {better}")
    return Design(kind, size, count_of(table.get("seed", 0), path, "[design] seed", least=0))


def _terms(settings: Settings, path: Path, task: Task) -> tuple[Term, ...]:
    """Read the force terms; fits leave out those of the edges."""
    tables = settings.get("term", [])
    if not isinstance(tables, list) or not all(isinstance(table, Mapping) for table in tables):
        raise InputError(path, "[[term]]", "these must be tables", "write [[term]] with name and parameters below")
    terms = tuple(
        read_term(str(table.get("name")), {k: v for k, v in table.items() if k != "name"}, path, f"[[term]] {count}")
        for count, table in enumerate(tables, 1)
    )
    check_together(terms, path)
    if task == "fit" and is_carved(terms):
        problem = "a sweep fits the paper's snow alone"
        raise InputError(path, "[[term]]", problem, "fit one recording by sssi fit --snow carving, or simulate")
    return terms


def _heading(settings: Settings, path: Path, task: Task) -> HeadingMode | None:
    """Read the control of the skiers' heading; a fit has the captured one."""
    if "heading" not in settings:
        return None
    if task == "fit":
        raise InputError(path, "heading", "fits are with the captured heading", "leave it out")
    return _one_of(settings, "heading", HEADING_MODES, path)


def _folders(patterns: object, path: Path) -> tuple[Path, ...]:
    folders: list[Path] = []
    for pattern in words_of(list_of(patterns, path, "recordings"), path, "recordings"):
        _check_name(pattern, path, "recordings")
        try:
            folders += _matches(pattern, path)
        except (OSError, ValueError) as error:  # a name that is too long, or ** next to letters
            problem = f"{pattern[:60]!r}: {getattr(error, 'strerror', None) or error}"
            raise InputError(path, "recordings", problem, "correct the pattern") from None
    resolved = tuple(folder.resolve() for folder in folders)
    for folder in resolved:
        try:
            str(folder).encode()
        except UnicodeEncodeError:
            raise InputError(path, "recordings", f"{str(folder)!r} is no text in UTF-8", "rename the folder") from None
    if len({folder.name for folder in resolved}) < len(resolved):
        raise InputError(path, "recordings", "two folders have one name", "give each recording its own, once")
    return resolved


def _check_name(name: str, path: Path, place: str) -> None:
    if len(name) > _LONGEST or not name.isprintable():
        problem = f"{name[:60]!r} is no name of a file or folder"
        raise InputError(path, place, problem, f"write at most {_LONGEST} printable characters")


def _matches(pattern: str, path: Path) -> list[Path]:
    """Return the folder of that name, or the recordings that match the pattern."""
    plain = path.parent / pattern
    if plain.is_dir() or not glob.has_magic(pattern):
        return [plain]
    return matching_recordings(path.parent, pattern, path)


def _duration(value: object, path: Path) -> float | None:
    if value is None:
        return None
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0.1 <= value <= 7200.0:
        raise InputError(path, "duration_s", f"{value!r} is not a length from 0.1 to 7200 s", "give seconds")
    return float(value)


def _one_of(table: Settings, key: str, words: Sequence[Word], path: Path, place: str = "") -> Word:
    """Return one of ``words``; the first where the key is missing."""
    value = table.get(key, words[0])
    for word in words:
        if value == word:
            return word
    raise InputError(path, f"{place}{key}", f"{value!r} is not known", f"use one of: {', '.join(words)}")


def count_of(value: object, path: Path, place: str, *, least: int) -> int:
    """Check a whole number of at least ``least`` at ``place``.  Raises InputError for anything else."""
    if isinstance(value, bool) or not isinstance(value, int) or not least <= value <= LARGEST:
        what = "is missing" if value is None else f"{value!r} is no whole number from {least} to {LARGEST}"
        raise InputError(path, place, what, "give a whole number")
    return value


def list_of(value: object, path: Path, place: str) -> list[Any]:
    """Check a list that is not empty.  Raises InputError for anything else."""
    if not isinstance(value, list) or not value:
        raise InputError(path, place, "is no list with something in it", "write [first, second]")
    return value


def words_of(value: object, path: Path, place: str) -> tuple[str, ...]:
    """Check a list of words.  Raises InputError for anything else."""
    if not isinstance(value, list) or not all(isinstance(word, str) and word for word in value):
        raise InputError(path, place, f"{str(value)[:60]} is not a list of words", 'write ["first", "second"]')
    return tuple(value)


def _relative(path: Path, folder: Path) -> str:
    return Path(os.path.relpath(path, folder.resolve())).as_posix()
