"""A ski as data: its outline, its thickness, its running surface, its material.

Everything varies along s = (distance from the tail)/length, 0 at the tail and 1 at the tip; x = s·length − boot_centre
is the same measured forwards from the boot centre.  The catalogue is ``skis.toml``; its head explains the format.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import ArrayLike

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.quantity import build_checked, quantities, quantity
from sssi_exudyn.core.text import did_you_mean, one_line
from sssi_exudyn.io.files import inside
from sssi_exudyn.io.settings import read_toml

if TYPE_CHECKING:
    import pandas as pd

CATALOGUE: Final = Path(__file__).with_name("skis.toml")
KINDS: Final = ("linear", "flat_at_start", "flat_at_end")
PROFILES: Final = {"width": (20.0, 300.0), "thickness": (1.0, 60.0), "height": (-50.0, 400.0)}
"""The profiles of a ski and the bounds of their values (mm): wide enough for snowboards, too narrow for metres."""
_UNCERTAINTY: Final = "uncertainty"
_GAUSS_S, _GAUSS_W = np.polynomial.legendre.leggauss(8)


_MOST_POINTS: Final = 1000
"""Most points of a profile in a file; scans have one every few centimetres."""


@dataclass(frozen=True)
class Profile:
    """A value (m) over s, given at break points with a kind of curve between each two of them.

    ``s`` (n,) rises strictly from 0 to 1, ``value`` (n,), ``between`` (n − 1,) words of ``KINDS``.
    """

    s: tuple[float, ...]
    value: tuple[float, ...]
    between: tuple[str, ...]

    def __post_init__(self) -> None:
        s = np.asarray(self.s)
        if len(s) < 2 or s[0] != 0.0 or s[-1] != 1.0 or not np.all(np.diff(s) > 0):
            raise ValueError("s must rise strictly from 0 to 1")
        if len(self.value) != len(s) or len(self.between) != len(s) - 1:
            raise ValueError(f"{len(s)} points of s want {len(s)} values and {len(s) - 1} words between them")
        if not set(self.between) <= set(KINDS):
            raise ValueError(f"between may be {', '.join(KINDS)}")

    def __call__(self, s: ArrayLike) -> Array:
        """Return the value at s (any shape), in metres."""
        value, _ = self._evaluate(np.asarray(s, float), "right")
        return value

    def slope(self, s: ArrayLike) -> Array:
        """Return d value/ds at s (any shape), in metres; at a kink the mean of both sides."""
        s = np.asarray(s, float)
        return 0.5 * (self._evaluate(s, "left")[1] + self._evaluate(s, "right")[1])

    def _evaluate(self, s: Array, side: str) -> tuple[Array, Array]:
        """Return value and one-sided derivative."""
        knots, values = np.asarray(self.s), np.asarray(self.value)
        knots_before = np.searchsorted(knots, s, side="left" if side == "left" else "right")
        i = np.clip(knots_before - 1, 0, len(knots) - 2)
        width, start, rise = np.diff(knots)[i], values[i], np.diff(values)[i]
        u = (s - knots[i]) / width
        kind = np.array([KINDS.index(word) for word in self.between])[i]
        shape = np.choose(kind, [u, u**2, 1.0 - (1.0 - u) ** 2])
        rate = np.choose(kind, [np.ones_like(u), 2.0 * u, 2.0 * (1.0 - u)])
        return start + rise * shape, rise * rate / width


@dataclass(frozen=True)
class SkiUncertainty:
    """Standard errors of a ski as shares, such as its bench tests gave them."""

    bending: float = quantity(0.0, "1", low=0.0, high=0.5, source="bench tests", meaning="of EI, all along the ski")
    torsion: float = quantity(0.0, "1", low=0.0, high=0.5, source="bench tests", meaning="of GJ, all along the ski")
    outline: float = quantity(
        0.0, "1", low=0.0, high=0.5, source="bench tests", meaning="of a turn's radius, from the points of the outline"
    )


@dataclass(frozen=True)
class Ski:
    """One ski: three profiles and the numbers of its material (SI).

    uncertainty : standard errors of its stiffness and outline; None where they are not known

    Examples
    --------
    >>> ski = sssi_exudyn.Ski.load("slalom_165")
    >>> ski.sidecut_radius(), ski.bending_stiffness(0.5)
    >>> ski.curves().plot("ahead_of_boot_m", "bending_stiffness_Nm2")
    """

    name: str
    source: str
    width: Profile
    thickness: Profile
    height: Profile
    length: float = quantity(1.65, "m", low=0.5, high=3.0, source="slalom_165", meaning="straight length, tail to tip")
    boot_centre: float = quantity(
        0.76, "m", low=0.1, high=2.0, source="slalom_165", meaning="boot centre's distance from the tail"
    )
    mass: float = quantity(1.75, "kg", low=0.2, high=10.0, source="slalom_165", meaning="the ski without its binding")
    young_modulus: float = quantity(
        8.37e9, "Pa", low=5e8, high=3e11, source="slalom_165: three-point bending", meaning="E in EI = E·w·t³/12"
    )
    shear_modulus: float = quantity(2.31e9, "Pa", low=1e8, high=1e11, source="slalom_165", meaning="G in GJ = G·w·t³/3")
    poisson_ratio: float = quantity(0.3, "1", low=0.0, high=0.49, source="paper 2.2.2", meaning="for shear alone")
    damping_ratio: float = quantity(
        0.05, "1", low=0.0, high=0.5, source="slalom_165", meaning="of critical, in the first bending modes, clamped"
    )
    uncertainty: SkiUncertainty | None = None

    @staticmethod
    def names() -> tuple[str, ...]:
        """Return the names of the skis that come with the program.

        Examples
        --------
        >>> sssi_exudyn.Ski.names()
        """
        return catalogue()

    @staticmethod
    def load(ski: str | Path) -> Ski:
        """Return a ski of the catalogue by its name, or the one ski in a ``.toml`` file.

        Raises InputError for an unknown name, with the nearest one, and for a file that is no ski.

        Examples
        --------
        >>> sssi_exudyn.Ski.load("my_ski.toml").mass
        """
        return ski_named(str(ski), Path(), "Ski.load", "ski")

    def sidecut_radius(self) -> float:
        """Return the radius (m) of the circle through the edge at the widest place behind, the waist, and the widest
        place ahead.

        It is the radius that makers print on a ski, up to where they take the widths (ISO 6289).
        """
        behind, waist, ahead = self.widest_and_waist()
        points = [np.array([float(self.x_of_s(s)), 0.5 * float(self.width(s))]) for s in (behind, waist, ahead)]
        sides = [float(np.linalg.norm(points[i] - points[i - 1])) for i in range(3)]
        (x, y), (u, v) = points[1] - points[0], points[2] - points[0]
        area = 0.5 * abs(x * v - y * u)
        return float("inf") if area == 0.0 else sides[0] * sides[1] * sides[2] / (4.0 * area)

    def widest_and_waist(self) -> tuple[float, float, float]:
        """Return the places s of the greatest width behind the waist, of the waist, and of the greatest width ahead."""
        s = np.linspace(0.0, 1.0, 2001)
        width = self.width(s)
        waist = int(np.argmin(np.where((s > 0.2) & (s < 0.8), width, np.inf)))
        return float(s[np.argmax(width[:waist])]), float(s[waist]), float(s[waist + np.argmax(width[waist:])])

    def curves(self, points: int = 201) -> pd.DataFrame:
        """Return the ski's curves along its length, one row a place.

        Columns: ``s_1`` (0 at the tail, 1 at the tip), ``ahead_of_boot_m``, ``width_m``, ``thickness_m``, ``height_m``
        of the running surface, ``bending_stiffness_Nm2`` (EI), ``torsional_stiffness_Nm2`` (GJ),
        ``mass_per_length_kgpm``.
        """
        import pandas as pd  # here: a simulation needs no table

        s = np.linspace(0.0, 1.0, points)
        columns = {
            "s_1": s,
            "ahead_of_boot_m": self.x_of_s(s),
            "width_m": self.width(s),
            "thickness_m": self.thickness(s),
            "height_m": self.height(s),
            "bending_stiffness_Nm2": self.bending_stiffness(s),
            "torsional_stiffness_Nm2": self.torsional_stiffness(s),
            "mass_per_length_kgpm": self.mass_per_length(s),
        }
        return pd.DataFrame(columns)

    def s_of_x(self, x: ArrayLike) -> Array:
        """Return s at x metres ahead of the boot centre."""
        return (np.asarray(x, float) + self.boot_centre) / self.length

    def x_of_s(self, s: ArrayLike) -> Array:
        """Return the distance (m) ahead of the boot centre at s."""
        return np.asarray(s, float) * self.length - self.boot_centre

    def bending_stiffness(self, s: ArrayLike) -> Array:
        """Return EI = E·w·t³/12 (N m²), for bending up and down."""
        return self.young_modulus * self.width(s) * self.thickness(s) ** 3 / 12.0

    def lateral_stiffness(self, s: ArrayLike) -> Array:
        """Return EI = E·t·w³/12 (N m²), for bending in the ski's plane."""
        return self.young_modulus * self.thickness(s) * self.width(s) ** 3 / 12.0

    def torsional_stiffness(self, s: ArrayLike) -> Array:
        """Return GJ = G·w·t³/3 (N m²), that of a thin rectangle."""
        return self.shear_modulus * self.width(s) * self.thickness(s) ** 3 / 3.0

    def axial_stiffness(self, s: ArrayLike) -> Array:
        """Return the stiffness E·w·t (N) along the ski."""
        return self.young_modulus * self.width(s) * self.thickness(s)

    def shear_stiffness(self, s: ArrayLike) -> Array:
        """Return κ·E/(2(1 + ν))·w·t (N), κ = 10(1 + ν)/(12 + 11ν).

        The formula is that of Cowper (1966, https://doi.org/10.1115/1.3625046) for beams with shear.  The modulus
        follows from E and ν, since ``shear_modulus`` is an effective figure for twisting a layered section.
        """
        nu = self.poisson_ratio
        return 10.0 * (1.0 + nu) / (12.0 + 11.0 * nu) / (2.0 * (1.0 + nu)) * self.axial_stiffness(s)

    def mass_per_length(self, s: ArrayLike) -> Array:
        """Return the mass a metre of straight length (kg/m): the ski's mass is spread as ``w·t``."""
        area = integrate_pieces(self, np.array([0.0, 1.0]), lambda r: self.width(r) * self.thickness(r)).item()
        return self.mass / (self.length * area) * self.width(s) * self.thickness(s)


def integrate_pieces(ski: Ski, edges: Array, function: Callable[[Array], Array]) -> Array:
    """Integrate ∫ function(s) ds over each interval of ``edges`` (n + 1,), from the tail on: (…, n).

    ``function`` maps s (p, 8) to (…, p, 8).  Gauss with eight points on every piece between the profiles' break
    points: exact to rounding for polynomials to degree 15, hence for mass, and near it for a compliance.
    """
    cuts = np.unique(np.concatenate([edges, ski.width.s, ski.thickness.s, ski.height.s]))
    cuts = cuts[(cuts >= edges[0]) & (cuts <= edges[-1])]
    half = 0.5 * np.diff(cuts)
    s = cuts[:-1, None] + half[:, None] * (1.0 + _GAUSS_S)
    pieces = half * (function(s) @ _GAUSS_W)
    result: Array = np.add.reduceat(pieces, np.searchsorted(cuts, edges[:-1]), axis=-1)
    return result


def catalogue() -> tuple[str, ...]:
    """Return the names of the skis that come with the program."""
    return tuple(_catalogue())


@cache
def _catalogue() -> Mapping[str, Ski]:
    """Return those skis by name, read once: whatever writes a model asks whether its ski is one of them."""
    return {name: ski_from_table(name, table, CATALOGUE.name) for name, table in _tables(CATALOGUE).items()}


def read_ski(name_or_path: str, folder: str | Path, named_in: Path | None = None) -> Ski:
    """Read a ski of the catalogue, or the one ski in a file (relative to ``folder``, and inside it).

    Parameters
    ----------
    named_in : the file that names it; the recording's in ``folder`` if left out

    Raises InputError for an unknown name, a file that is missing, outside the folder or not a ski.
    """
    folder = Path(folder)
    known = _catalogue()
    if name_or_path in known:
        return known[name_or_path]
    recording = folder / "recording.toml" if named_in is None else named_in
    if not name_or_path.endswith(".toml"):
        raise InputError(
            recording,
            "[equipment] skis",
            f"no ski is called {name_or_path!r}",
            f"use one of {', '.join(known)}, or the path of a .toml file",
        )
    path = inside(folder, name_or_path, recording, "[equipment] skis")
    tables = _tables(path)
    if len(tables) != 1:
        raise InputError(path, "", f"{len(tables)} skis in one file", "keep exactly one table, named after the ski")
    ((name, table),) = tables.items()
    return ski_from_table(name, table, path)


def ski_named(name: str, folder: Path, file: str | Path, place: str) -> Ski:
    """Return a ski of the catalogue, or the one ski in a .toml file, whose path counts from ``folder``.

    Raises InputError, at ``place`` of ``file`` for a name that is neither.
    """
    if name in catalogue():
        return read_ski(name, folder)
    if not name.endswith(".toml"):
        fix = f"{did_you_mean(name, catalogue())}, or give the path of a .toml file"
        raise InputError(file, place, f"no ski is called {name!r}", fix)
    path = folder / name
    return read_ski(path.name, path.parent, path)


def ski_from_table(name: str, table: object, file: str | Path) -> Ski:
    """Read a ski from its table (see ``skis.toml``); the inverse of ``ski_to_table``.  Raises InputError."""
    place = f"[{name}]"
    if not isinstance(table, Mapping):
        raise InputError(file, place, "is not a table", "write the ski as in the catalogue")
    keys = _number_keys()
    numbers: dict[str, object] = {"name": name}
    for key, value in table.items():
        if key in PROFILES:
            numbers[key] = _profile(value, key, file, f"[{name}.{key}]")
        elif key == "source":
            numbers[key] = one_line(value, 500)
        elif key == _UNCERTAINTY:
            numbers[key] = _uncertainty(value, file, f"[{name}.{key}]")
        elif key in keys:
            numbers[keys[key]] = value
        else:
            wanted = ", ".join([*keys, "source", *PROFILES, _UNCERTAINTY])
            raise InputError(file, f"{place} {key}", "unknown key", f"use one of: {wanted}")
    for key in [*keys, "source", *PROFILES]:
        if keys.get(key, key) not in numbers:
            raise InputError(file, place, f"{key} is missing", "add it")
    ski = build_checked(Ski, numbers, file, place)
    if not 0.0 < ski.boot_centre < ski.length:
        raise InputError(file, f"{place} boot_centre_m", "lies off the ski", "measure it from the tail, in metres")
    return ski


def ski_to_table(ski: Ski) -> dict[str, object]:
    """Return the table a ski is written as; ``ski_from_table`` reads it back."""
    table: dict[str, object] = {"source": ski.source}
    table |= {key: getattr(ski, name) for key, name in _number_keys().items()}
    for name in PROFILES:
        profile: Profile = getattr(ski, name)
        millimetres = [round(1e3 * value, 9) for value in profile.value]
        table[name] = {"s": list(profile.s), "mm": millimetres, "between": list(profile.between)}
    if ski.uncertainty is not None:
        table[_UNCERTAINTY] = {name: getattr(ski.uncertainty, name) for name in quantities(SkiUncertainty)}
    return table


def _number_keys() -> dict[str, str]:
    """Map each key in a file to its field: the field's name with its unit."""
    return {name if q.unit == "1" else f"{name}_{q.unit}": name for name, q in quantities(Ski).items()}


def _uncertainty(table: object, file: str | Path, place: str) -> SkiUncertainty:
    names = quantities(SkiUncertainty)
    if not isinstance(table, Mapping) or not set(table) <= set(names):
        raise InputError(file, place, f"its keys are {', '.join(names)}", "give shares such as 0.02")
    return build_checked(SkiUncertainty, dict(table), file, place)


def _profile(table: object, name: str, file: str | Path, place: str) -> Profile:
    if not isinstance(table, Mapping) or set(table) != {"s", "mm", "between"}:
        raise InputError(
            file, place, "a profile has exactly the keys s, mm and between", "write it as in the catalogue"
        )
    low, high = PROFILES[name]
    for key, (least, most) in {"s": (0.0, 1.0), "mm": (low, high)}.items():
        column = table[key]
        if not isinstance(column, list) or not all(
            isinstance(v, int | float) and not isinstance(v, bool) and least <= v <= most for v in column
        ):
            raise InputError(file, f"{place} {key}", f"not a list of numbers from {least:g} to {most:g}", "correct it")
    s, between = table["s"], table["between"]
    if len(s) > _MOST_POINTS:
        raise InputError(file, f"{place} s", f"{len(s)} points are more than a profile needs", "leave some out")
    words = [between] * (len(s) - 1) if isinstance(between, str) else between
    if not isinstance(words, list) or not all(isinstance(word, str) for word in words):
        raise InputError(file, f"{place} between", "is neither a word nor a list of words", f"use {', '.join(KINDS)}")
    try:
        return Profile(tuple(map(float, s)), tuple(1e-3 * float(v) for v in table["mm"]), tuple(words))
    except ValueError as error:
        raise InputError(file, place, str(error), "correct the table") from None


def _tables(path: Path) -> dict[str, object]:
    return dict(read_toml(path))


def uniform_ski(
    name: str, *, length: float, width: float, thickness: float, young_modulus: float, mass: float, **numbers: float
) -> Ski:
    """Return a flat bar (SI), boot centre in its middle unless stated otherwise, for which closed forms are known."""

    def constant(value: float) -> Profile:
        return Profile((0.0, 1.0), (value, value), ("linear",))

    return Ski(
        name=name,
        source="a uniform bar",
        width=constant(width),
        thickness=constant(thickness),
        height=constant(0.0),
        length=length,
        mass=mass,
        young_modulus=young_modulus,
        **({"boot_centre": 0.5 * length} | numbers),  # type: ignore[arg-type]  # numbers alone
    )
