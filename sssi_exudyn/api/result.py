"""A run as scripts and notebooks use it: figures, series with units, plots, report, in memory or from a folder."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from html import escape
from pathlib import Path
from typing import Final

import numpy as np
import pandas as pd

from sssi_exudyn.analysis.biomechanics import ResidualMoment, TurnFigures
from sssi_exudyn.api.result_plots import ResultPlots
from sssi_exudyn.api.result_tables import ResultTables, with_units
from sssi_exudyn.commands.outcome import Made
from sssi_exudyn.commands.pages import write_report
from sssi_exudyn.core.checked import checked
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.text import one_line
from sssi_exudyn.io.files import read_text
from sssi_exudyn.model.model import Model
from sssi_exudyn.reports.report import render_folder, write_run
from sssi_exudyn.reports.sentences import sentences
from sssi_exudyn.results.folder import MUSCLES, OPENSIM, amend_result
from sssi_exudyn.results.stored import StoredRun, read_run
from sssi_exudyn.results.summary import Estimate, Fit, Friction, PressureRatio, Summary, Trajectory, UncertaintyFigures
from sssi_exudyn.validation.diagnosis.diagnosis_data import Diagnosis

_LONGEST: Final = 1500
"""Characters of a sentence in a notebook's table."""


@dataclass(frozen=True, repr=False)
class Result(ResultTables, ResultPlots):
    """A result is one run with its figures, its series, its model, and what was measured.

    Attributes
    ----------
    stored : everything, as the result's folder holds it
    opensim : texts of the files for OpenSim by name
    folder : where it is stored; None for a run in memory

    Examples
    --------
    >>> result = sssi_exudyn.run("examples/beginner")
    >>> result.friction.mu_t.value
    >>> result.plot_loads().savefig("loads.png")
    >>> result.over_turns("left_load_N").groupby("percent").mean(numeric_only=True)
    >>> result.report("beginner.html")
    """

    stored: StoredRun
    opensim: Mapping[str, str]
    folder: Path | None = None

    @property
    def name(self) -> str:
        """Return the recording's name."""
        return self.stored.name

    @property
    def summary(self) -> Summary:
        """Return all figures, as ``summary.json`` holds them."""
        return self.stored.summary

    @property
    def model(self) -> Model:
        """Return the model that was simulated."""
        return self.stored.model

    @property
    def friction(self) -> Friction:
        """Return the friction coefficients with their standard errors."""
        return self.summary.friction

    @property
    def trajectory(self) -> Trajectory:
        """Return the errors of the simulated track against the GPS."""
        return self.summary.trajectory

    @property
    def pressure_ratio(self) -> PressureRatio:
        """Return the agreement of the left foot's share of the load with the insoles."""
        return self.summary.pressure_ratio

    @property
    def fitted(self) -> Fit:
        """Return how the fit ended, and every fitted parameter."""
        return self.summary.fit

    @property
    def uncertainty(self) -> UncertaintyFigures | None:
        """Return what the fit leaves uncertain; None where nothing was estimated."""
        return self.summary.uncertainty

    @property
    def turn_figures(self) -> TurnFigures:
        """Return figures of technique, turn by turn."""
        return self.summary.turns

    @property
    def residual_moment(self) -> ResidualMoment:
        """Return the moment at the pelvis that a real skier does not have."""
        return self.summary.residual_moment

    @property
    def diagnosis(self) -> Diagnosis | None:
        """Return the diagnosis; None where none was made."""
        return self.stored.diagnosis

    @property
    def notices(self) -> tuple[str, ...]:
        """Return what a reader should know of the recording, such as what had to be assumed."""
        return self.summary.notices

    @cached_property
    def series(self) -> pd.DataFrame:
        """Return the time series, one row a sample; its ``attrs["units"]`` has the unit of each column."""
        return with_units(self.stored.series)

    @cached_property
    def measured(self) -> pd.DataFrame | None:
        """Return what GPS and insoles measured, one row an instant; None where there was nothing."""
        return None if self.stored.measured is None else with_units(self.stored.measured)

    @checked
    def save(self, folder: str | os.PathLike[str]) -> Result:
        """Write the result's folder, with its report, and return the result as it is stored there.

        Raises InputError where it cannot be written.
        """
        out = Path(folder)
        if self.folder is not None:
            amend_result(self.folder, out, {}, render=render_folder)
        else:
            write_run(out, self.stored, self.opensim)
        return Result(self.stored, self.opensim, out)

    @checked
    def report(self, file: str | os.PathLike[str]) -> Path:
        """Write the report, a page (.html) or a document to print (.pdf), and return that file's path."""
        return write_report([(self.stored, self.name)], Path(file))

    def __repr__(self) -> str:
        figures = ", ".join(f"{name} {value}" for name, value in self._rows())
        where = "in memory" if self.folder is None else f"in {self.folder}"
        return f"<Result {self.name}: {figures}; {where}>"

    def _repr_html_(self) -> str:
        rows = "".join(f"<tr><th>{escape(name)}</th><td>{escape(value)}</td></tr>" for name, value in self._rows())
        words = one_line(" ".join(sentences([self.stored])), _LONGEST)
        return f"<table><caption>{escape(self.name)}</caption>{rows}</table><p>{escape(words)}</p>"

    def _rows(self) -> list[tuple[str, str]]:
        summary = self.summary
        rows = [
            ("μ_t", _with_error(self.friction.mu_t)),
            ("μ_n, largest lateral load ratio", _with_error(self.friction.mu_n)),
        ]
        if summary.carving is not None:
            rows = [("μ, along the edges", _with_error(summary.carving.mu))]
        if summary.trajectory.mean_error_m is not None:
            rows.append(("track error", f"{summary.trajectory.mean_error_m:.3f} m"))
        if summary.turns.count is not None:
            rows.append(("turns", str(summary.turns.count)))
        if len(self.stored.time):
            rows.append(("duration", f"{np.ptp(self.stored.time):.1f} s"))
        if self.diagnosis is not None:
            rows.append(("diagnosis", self.diagnosis.verdict))
        if summary.diverged is not None:
            rows.append(("stopped early", one_line(summary.diverged, _LONGEST)))
        return rows


def result_of(made: Made, folder: Path | None, *, csv: bool = False) -> Result:
    """Return the result of a command, which ``folder`` holds if given, with ``csv`` its tables as CSV too.

    Raises InputError for CSV without a folder.
    """
    result = Result(made.run, made.opensim, folder)
    if csv:
        if folder is None:
            raise InputError("--csv", "", "there is no folder to write into", "give out, or use result.to_csv")
        result.to_csv(folder)
    return result


def load_result(folder: Path) -> Result:
    """Load the result in a folder.  Raises InputError where there is none or a file of it cannot be read."""
    texts = {name: read_text(folder / name) for name in (*OPENSIM, *MUSCLES) if (folder / name).is_file()}
    return Result(read_run(folder), texts, folder)


def _with_error(estimate: Estimate) -> str:
    if estimate.value is None:
        return "unknown"
    return f"{estimate.value:.4f}" if estimate.se is None else f"{estimate.value:.4f} ± {estimate.se:.4f}"
