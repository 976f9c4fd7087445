"""Recordings whose answers are known, diagnosed one after the other: what was found against what is hidden."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.io.typed import read_table

TRUTH: Final = "truth.json"
NOTHING: Final = "none"


def read_truth(folder: Path) -> dict[str, dict[str, Any]]:
    """What is hidden in each recording of ``folder``, by its name.

    Raises InputError where there is no truth.json, it is no table of names, or a name is not that of a folder in
    ``folder``: results are written under these names.
    """
    path = folder / TRUTH
    found = read_table(path)
    if not all(isinstance(each, dict) and isinstance(each.get("name"), str) for each in found.values()):
        raise InputError(path, "", "not a table of recordings with a name each", "give {recording: {name: …}}")
    folders = {each.name for each in folder.iterdir() if each.is_dir() and not each.is_symlink()}
    for name in found:
        if name not in folders or name.startswith("."):
            raise InputError(path, name, "there is no recording of that name here", "name a folder beside this file")
    return found


def compare(truth: Mapping[str, Mapping[str, Any]], diagnoses: Mapping[str, Mapping[str, Any]]) -> list[dict[str, str]]:
    """One row a recording: what is hidden, what was found, and whether that is right."""
    rows = []
    for name, diagnosis in diagnoses.items():
        hidden = str(truth[name]["name"])
        findings: Sequence[Mapping[str, Any]] = diagnosis["findings"]
        names = [NOTHING] if not findings else [str(finding["name"]) for finding in findings]
        might = {str(other["name"]) for finding in findings for other in finding["alternatives"]}
        unexplained = truth[name].get("kind") == "unexplained" and any(f["kind"] == "unexplained" for f in findings)
        right = "right" if hidden in names or unexplained else ("in the set" if hidden in might else "wrong")
        rows.append(
            {
                "recording": name,
                "hidden": hidden,
                "found": " and ".join(names),
                "probability": "" if not findings else f"{findings[0]['probability']:.2f}",
                "might be": ", ".join(sorted(might)),
                "answer": right,
            }
        )
    return rows
