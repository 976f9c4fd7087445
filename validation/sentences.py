"""Results in plain words, with their figures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from sssi_exudyn.validation.run import Run


def in_words(runs: Sequence[Run]) -> list[str]:
    """What came out, a sentence or two a recording."""
    return [f"{run.name}: {_agreement(run.summary)}" for run in runs]


def _agreement(summary: Mapping[str, Any]) -> str:
    error, percent = summary["trajectory"]["mean_error_m"], summary["trajectory"]["percent_of_length"]
    if error is None:
        return "The run was simulated; there is no GPS track to hold it against."
    words = f"The simulated track misses the GPS by {error:.3f} m on average, {percent:.2f} % of its length"
    correlation = summary["pressure_ratio"]["correlation"]
    if correlation is not None:
        words += f"; the load's shift between the feet correlates {correlation:.3f} with the insoles"
    return words + "."
