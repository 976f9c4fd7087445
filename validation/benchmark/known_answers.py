"""Recordings whose answers are known, diagnosed one after the other: what was found against what is hidden."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from sssi_exudyn.core.errors import InputError

TRUTH: Final = "truth.json"
NOTHING: Final = "none"


def read_truth(folder: Path) -> dict[str, dict[str, Any]]:
    """What is hidden in each recording of ``folder``, by its name.

    Raises InputError where there is no truth.json, or it is no table of names.
    """
    path = folder / TRUTH
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise InputError(path, "", "there is no such file", "name a folder of recordings with their answers") from None
    except (json.JSONDecodeError, UnicodeDecodeError) as error:
        raise InputError(path, "", f"not JSON: {error}", "correct the file") from None
    if not isinstance(found, dict) or not all(isinstance(each, dict) and "name" in each for each in found.values()):
        raise InputError(path, "", "not a table of recordings with a name each", "give {recording: {name: …}}")
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
