"""The plan of a season: its recordings, each under the hash of its files and of the settings."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final

from sssi_exudyn.contact.term import Term, parameters
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.text import one_line
from sssi_exudyn.importing.days.run_files import DEEPEST
from sssi_exudyn.io.bounds import MAX_NAME
from sssi_exudyn.io.files import sha256
from sssi_exudyn.io.settings import Settings, read_toml
from sssi_exudyn.recording.recording import FILE
from sssi_exudyn.runtime.cache import fingerprint
from sssi_exudyn.runtime.plugins import Plugin, origins_of
from sssi_exudyn.runtime.provenance import versions
from sssi_exudyn.season.listed import listed_tracks
from sssi_exudyn.sweeps.plan import SweepRun, TermValues

_MOST: Final = 5_000
"""Maximum number of runs: a resort's ski school in a winter has fewer."""
_MOST_FILES: Final = 200
"""Maximum number of files of a recording, whose hashes tell whether it has changed."""
_DEEPEST: Final = DEEPEST + 2
"""Maximum depth of folders within folders: those of an import, a folder for a file's name, and one for each descent."""
_KEY: Final = 32
"""Characters of a run's key."""


@dataclass(frozen=True)
class Options:
    """What a user chose for all runs, as texts and numbers.

    terms : additional force terms, by name with their numbers
    snow, heading, seconds, csv, quick : as the options of ``sssi run``
    """

    terms: tuple[TermValues, ...] = ()
    snow: str = "paper"
    heading: str | None = None
    seconds: tuple[float | None, float | None] | None = None
    csv: bool = False
    quick: bool = False

    @property
    def settings(self) -> dict[str, Any]:
        """Return the choices that are not the usual ones, by name."""
        terms = [{"name": name, **dict(numbers)} for name, numbers in self.terms]
        chosen = {
            "terms": terms,
            "snow": self.snow,
            "heading": self.heading,
            "seconds": self.seconds,
            "csv": self.csv,
            "quick": self.quick,
        }
        return {name: value for name, value in chosen.items() if value not in (None, [], False, "paper")}


def options_of(
    terms: Sequence[Term],
    snow: str,
    heading: str | None,
    seconds: tuple[float, float] | None,
    *,
    csv: bool,
    quick: bool,
) -> Options:
    """Return options as texts and finite numbers; an end of a stretch that is not given is None."""
    given = tuple((term.name, tuple(parameters(term).items())) for term in terms)
    stretch = None if seconds is None else tuple(None if abs(end) == float("inf") else end for end in seconds)
    return Options(given, snow, heading, stretch, csv, quick)  # type: ignore[arg-type]  # a pair stays a pair


@dataclass(frozen=True)
class SeasonJob:
    """Common data of all runs, which goes to the workers as JSON.

    versions : versions of the program and of the packages that it uses
    folders, names : of each recording its folder, and that of its result below the season's
    plugins : plug-ins named by the user, from which terms come
    """

    versions: tuple[tuple[str, str], ...]
    folders: tuple[str, ...]
    names: tuple[str, ...]
    options: Options
    plugins: tuple[Plugin, ...] = ()


@dataclass(frozen=True)
class Stated:
    """What ``recording.toml`` states of a run, by which runs are compared; "" or None where it does not.

    began : UTC of the clock's zero, s since 1970;  day : its date, ISO 8601
    air_temperature_C, snow_temperature_C : of ``[snow]``
    """

    recording: str = ""
    began: float | None = None
    day: str = ""
    skier: str = ""
    ski: str = ""
    snow_kind: str = ""
    wax: str = ""
    air_temperature_C: float | None = None
    snow_temperature_C: float | None = None


@dataclass(frozen=True)
class SeasonPlan:
    """A whole season, its runs in the order of their names.

    keys, digests : hash of each run's inputs, and of its files alone
    stated : what each recording states
    """

    job: SeasonJob
    keys: tuple[str, ...]
    digests: tuple[str, ...]
    stated: tuple[Stated, ...]

    def runs(self) -> list[SweepRun]:
        """Return all runs."""
        return [SweepRun(row, key, row, ()) for row, key in enumerate(self.keys)]


def plan_season(folder: Path, out: Path, options: Options, terms: Sequence[Term]) -> SeasonPlan:
    """Plan the season of all recordings below ``folder`` but in ``out``.

    Raises InputError where there is neither a recording nor the track of a listed run, for more runs than any season
    has, and for files that cannot be read.
    """
    folders = list(find_recordings(folder, out))
    if not folders and next(listed_tracks(folder), None) is None:
        raise InputError(folder, "", f"no folder in it holds a {FILE}", "make recordings with sssi import")
    plugins = origins_of(type(term) for term in terms)
    known = versions()
    shared = ("season", options, known, [plugin.as_table() for plugin in plugins])
    digests = [_digest(path) for path in folders]
    names = tuple(path.relative_to(folder).as_posix() for path in folders)
    return SeasonPlan(
        SeasonJob(tuple(known.items()), tuple(str(path) for path in folders), names, options, plugins),
        tuple(fingerprint(*shared, name, digest)[:_KEY] for name, digest in zip(names, digests, strict=True)),
        tuple(digests),
        tuple(_stated(path) for path in folders),
    )


def find_recordings(folder: Path, out: Path) -> Iterator[Path]:
    """Yield the folders of recordings below ``folder`` but in ``out``, in the order of their names.

    Hidden folders and links are not followed.  Raises InputError for more of them than any season has.
    """
    if not folder.is_dir():
        raise InputError(folder, "", "this is no folder", f"give a recording, or a folder of folders with {FILE}")
    count, apart = 0, out.resolve()
    for where, below, files in os.walk(folder):
        place = Path(where)
        depth = len(place.relative_to(folder).parts)
        below[:] = sorted(name for name in below if not name.startswith(".") and (place / name).resolve() != apart)
        if depth >= _DEEPEST:
            below.clear()
        if FILE in files and depth:
            below.clear()
            count += 1
            if count > _MOST:
                raise InputError(folder, "", f"more than {_MOST} recordings", "give some of them")
            yield place


def _digest(folder: Path) -> str:
    """Return the hash of all files of a recording, and of other runs of the slope that it names."""
    hashes = _hashes(folder)
    try:
        runs = read_toml(folder / FILE).get("terrain", {}).get("runs", [])
    except (AttributeError, InputError):  # what is wrong with it is said by the run itself
        runs = []
    for name in runs if isinstance(runs, list) else ():
        other = folder / str(name)
        if isinstance(name, str) and other.resolve().parent == folder.resolve().parent and other.is_dir():
            hashes |= {f"{name}/{file}": digest for file, digest in _hashes(other).items()}
    return fingerprint(hashes)


def _hashes(folder: Path) -> dict[str, str]:
    files = sorted(path for path in folder.rglob("*") if path.is_file() and not path.name.startswith("."))
    if len(files) > _MOST_FILES:
        problem = f"{len(files)} files are more than any recording has"
        raise InputError(folder, "", problem, "keep results and other files elsewhere")
    hashes = {}
    for path in files:
        name = path.relative_to(folder).as_posix().encode(errors="backslashreplace").decode()
        try:
            hashes[name] = sha256(path)
        except InputError as error:  # too large, or not readable: the run says so
            hashes[name] = str(error)
    return hashes


def _stated(folder: Path) -> Stated:
    """Return what a recording states, as far as it can be read."""
    try:
        settings = read_toml(folder / FILE)
    except InputError:
        return Stated(recording=one_line(folder.name))
    skier, equipment, snow = (_table(settings, name) for name in ("skier", "equipment", "snow"))
    began = settings.get("began")
    began = began if isinstance(began, datetime) and began.tzinfo is not None else None
    return Stated(
        recording=_word(settings, "name") or one_line(folder.name),
        began=began.timestamp() if began is not None else None,
        day=began.astimezone(UTC).date().isoformat() if began is not None else "",
        skier=_word(skier, "name"),
        ski=_word(equipment, "skis"),
        snow_kind=_word(snow, "kind"),
        wax=_word(snow, "wax"),
        air_temperature_C=_number(snow, "air_temperature_C"),
        snow_temperature_C=_number(snow, "snow_temperature_C"),
    )


def _table(settings: Settings, name: str) -> Mapping[str, Any]:
    table = settings.get(name)
    return table if isinstance(table, Mapping) else {}


def _word(table: Mapping[str, Any], key: str) -> str:
    return one_line(table[key], MAX_NAME).strip() if isinstance(table.get(key), str) else ""


def _number(table: Mapping[str, Any], key: str) -> float | None:
    value = table.get(key)
    return float(value) if isinstance(value, int | float) and not isinstance(value, bool) else None
