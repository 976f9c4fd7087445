"""A season as scripts and notebooks use it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from html import escape
from pathlib import Path

import pandas as pd

from sssi_exudyn.season.joint_friction import JointFriction
from sssi_exudyn.season.page import PAGE
from sssi_exudyn.season.season import Season
from sssi_exudyn.season.table import read_season_table


@dataclass(frozen=True, repr=False)
class SeasonResult:
    """A result of a season reads the folder that the season has written.

    season : counts of its runs, hashes of the recordings, versions and settings, as ``season.json`` holds them

    Examples
    --------
    >>> season = sssi_exudyn.load_season("results")
    >>> season.table.groupby("day")["vertical_m"].sum()
    """

    folder: Path
    season: Season

    @property
    def counts(self) -> dict[str, int]:
        """Count the runs by how they ended."""
        return self.season.runs

    @cached_property
    def table(self) -> pd.DataFrame:
        """Return a row a run; ``attrs["units"]`` has the unit of each column.

        Raises InputError where the table cannot be read.
        """
        return read_season_table(self.folder)

    @property
    def descents(self) -> tuple[JointFriction, ...]:
        """Return what the runs of each descent show together, with 90 % intervals."""
        return self.season.descents

    @property
    def page(self) -> Path:
        """Return the path of the season's page."""
        return self.folder / PAGE

    def __repr__(self) -> str:
        return f"<SeasonResult: {self.counts['done']} of {self.counts['runs']} runs done; in {self.folder}>"

    def _repr_html_(self) -> str:
        rows = "".join(f"<tr><th>{escape(name)}</th><td>{count}</td></tr>" for name, count in self.counts.items())
        return f"<table><caption>{escape(self.folder.name)}</caption>{rows}</table>"
