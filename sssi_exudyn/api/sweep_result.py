"""A sweep as scripts and notebooks use it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from html import escape
from pathlib import Path

import pandas as pd

from sssi_exudyn.core.checked import checked
from sssi_exudyn.io.writing import write_atomically
from sssi_exudyn.sweeps.sweep import Status, read_swept, render_folder, status


@dataclass(frozen=True, repr=False)
class SweepResult:
    """A result of a sweep reads the folder that the sweep has written.

    Examples
    --------
    >>> swept = sssi_exudyn.load_sweep("results/edge_angle")
    >>> swept.table.groupby("friction.mu_t")["mean_speed_mps"].mean()
    """

    folder: Path

    @property
    def counts(self) -> Status:
        """Count the runs by how they ended, and tell whether the sweep is running."""
        return status(self.folder)

    @cached_property
    def table(self) -> pd.DataFrame:
        """Return a row a run: its parameters and figures; ``attrs["units"]`` has the unit of each column.

        Raises InputError where no run has ended.
        """
        table, columns = read_swept(self.folder)
        table.attrs["units"] = {column.name: column.unit for column in columns if column.unit}
        return table

    @checked
    def report(self, file: str | Path) -> Path:
        """Write the sweep's page and return that file's path."""
        write_atomically(Path(file), render_folder(self.folder))
        return Path(file)

    def __repr__(self) -> str:
        counts = self.counts
        return f"<SweepResult {counts['name']}: {counts['done']} of {counts['runs']} runs done; in {self.folder}>"

    def _repr_html_(self) -> str:
        counts: Mapping[str, object] = self.counts
        shown = ("runs", "done", "diverged", "failed", "crashed", "left")
        rows = "".join(f"<tr><th>{name}</th><td>{counts[name]}</td></tr>" for name in shown)
        return f"<table><caption>{escape(str(counts['name']))}</caption>{rows}</table>"
