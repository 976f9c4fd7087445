"""Recordings with known answers, diagnosed one after the other: findings compared with hidden effects."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Literal

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.io.typed import read_table
from sssi_exudyn.validation.diagnosis.diagnosis_data import Diagnosis
from sssi_exudyn.validation.diagnosis.hypotheses.catalogue import BY_NAME

TRUTH: Final = "truth.json"
NOTHING: Final = "none"


def read_truth(folder: Path) -> dict[str, dict[str, Any]]:
    """Read the hidden effect of each recording of ``folder``, by its name.

    Raises InputError where there is no truth.json, it is no table of names, or a name is not that of a folder in
    ``folder``: results are written under these names.
    """
    path = folder / TRUTH
    truth = read_table(path)
    if not all(isinstance(entry, dict) and isinstance(entry.get("name"), str) for entry in truth.values()):
        raise InputError(path, "", "not a table of recordings with a name each", "give {recording: {name: …}}")
    folders = {entry.name for entry in folder.iterdir() if entry.is_dir() and not entry.is_symlink()}
    for name in truth:
        if name not in folders or name.startswith("."):
            raise InputError(path, name, "there is no recording of that name here", "name a folder next to this file")
    return truth


@dataclass(frozen=True)
class Comparison:
    """Comparison of a recording's hidden effect with the findings.

    hidden : its name, or where it is nothing, the world's effect under "also" that the diagnosis has a name for
    found : the findings' names, joined by " and "
    probability : probability of the first finding, None without one
    alternatives : other names that the findings may have
    mu_t, mu_n : friction over all explanations, with its 90 % interval, and the true one; None where it is not given
    """

    recording: str
    hidden: str
    found: str
    probability: float | None
    alternatives: tuple[str, ...]
    answer: Literal["right", "in the set", "wrong"]
    verdict: str
    mu_t: float | None
    mu_t_low: float | None
    mu_t_high: float | None
    mu_t_true: float | None
    mu_n: float | None
    mu_n_low: float | None
    mu_n_high: float | None
    mu_n_true: float | None


def compare(truth: Mapping[str, Mapping[str, Any]], diagnoses: Mapping[str, Diagnosis]) -> list[Comparison]:
    """Compare each diagnosis with the hidden effect of its recording."""
    rows = []
    for name, diagnosis in diagnoses.items():
        known = truth[name]
        hidden = str(known["name"])
        if hidden == NOTHING and known.get("also") in BY_NAME:
            hidden = str(known["also"])
        findings = diagnosis.findings
        names = [finding.name for finding in findings] or [NOTHING]
        others = {other.name for finding in findings for other in finding.alternatives}
        unexplained = known.get("kind") == "unexplained" and any(f.kind == "unexplained" for f in findings)
        answer: Literal["right", "in the set", "wrong"] = (
            "right" if hidden in names or unexplained else ("in the set" if hidden in others else "wrong")
        )
        probability = findings[0].probability if findings else None
        friction = [*_friction("mu_t", known, diagnosis), *_friction("mu_n", known, diagnosis)]
        rows.append(
            Comparison(
                name,
                hidden,
                " and ".join(names),
                probability,
                tuple(sorted(others)),
                answer,
                diagnosis.verdict,
                *friction,
            )
        )
    return rows


def _friction(name: str, known: Mapping[str, Any], diagnosis: Diagnosis) -> tuple[float | None, ...]:
    """Return friction of that name, its interval's ends, and the true one."""
    true = known.get(name)
    number = (diagnosis.friction_averaged or {}).get(name)
    ends = (None, None, None) if number is None else (number.value, number.low, number.high)
    return *ends, float(true) if isinstance(true, (int, float)) else None
