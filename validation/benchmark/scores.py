"""Figures of the benchmark: counts, shares with their intervals, calibration."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any, Final

import numpy as np
from scipy.stats import beta

from sssi_exudyn.validation.benchmark.cases import Case
from sssi_exudyn.validation.diagnosis.result import NOTHING_MISSING
from sssi_exudyn.validation.diagnosis.search_result import SURE

STRONG: Final = 8.0
"""Standard errors from which an effect counts as clear."""
_BINS: Final = (0.0, 0.5, 0.8, 0.95, 1.01)


def share(hits: int, of: int) -> dict[str, float | int | None]:
    """A share with its 95 % interval (Clopper and Pearson)."""
    low = float(beta.ppf(0.025, hits, of - hits + 1)) if hits else 0.0
    high = float(beta.ppf(0.975, hits + 1, of - hits)) if hits < of else 1.0
    return {
        "hits": hits,
        "of": of,
        "share": hits / of if of else None,
        "low": low if of else None,
        "high": high if of else None,
    }


def _names_of(diagnosis: Mapping[str, Any]) -> list[set[str]]:
    """The set of names of each finding: the most probable and its alternatives until 95 % are reached."""
    sets = []
    for finding in diagnosis["findings"]:
        names, total = {finding["name"]}, finding["probability"]
        for other in finding["alternatives"]:
            if total >= 0.95:
                break
            names.add(other["name"])
            total += other["probability"]
        sets.append(names)
    return sets


def score(cases: Sequence[Case], done: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """All figures from the answers and the diagnoses."""
    rows = [(case, each) for case, each in zip(cases, done, strict=True) if "failed" not in each]
    nothing = [(c, d) for c, d in rows if c.kind == "none"]
    single = [(c, d) for c, d in rows if c.kind in ("physics", "sensor")]
    strong = [(c, d) for c, d in single if (d["oracle"] or 0.0) >= STRONG]
    found = [(c, d) for c, d in single if d["diagnosis"]["findings"]]
    unknown = [(c, d) for c, d in rows if c.kind == "unexplained" and d["diagnosis"]["findings"]]
    pairs = [(c, d) for c, d in rows if c.kind == "pair"]

    def holds(case: Case, each: Mapping[str, Any], most: int = 99) -> bool:
        sets = _names_of(each["diagnosis"])
        return bool(sets) and case.name in sets[0] and len(sets[0]) <= most

    overlaps = [
        _overlap(c.window, d["diagnosis"]["findings"][0]["where"])
        for c, d in found
        if c.window and d["diagnosis"]["findings"][0]["name"] == c.name and d["diagnosis"]["findings"][0]["where"]
    ]
    inside = [_inside(c, d) for c, d in found if d["diagnosis"]["findings"][0]["name"] == c.name]
    intervals = [hit for each in inside for hit in each]
    wrong_sure = [d for c, d in rows if _wrong_and_sure(c, d)]
    clear = [(d, d["diagnosis"]["findings"]) for _, d in strong if d["diagnosis"]["findings"]]
    before = np.array([findings[0]["evidence"]["held_out_error_m"]["before"] for _, findings in clear])
    after = np.array([findings[-1]["evidence"]["held_out_error_m"]["after"] for _, findings in clear])
    plain = np.array([d["held_out_plain_m"] for d, _ in clear])
    placebo = [findings[0]["evidence"]["placebo_held_out_error_m"] for _, findings in clear]
    undisturbed = np.array([d["held_out_m"] for _, d in nothing])
    noise = float(np.median(undisturbed)) if nothing else float("nan")
    levels = range(4)
    return {
        "cases": len(cases),
        "failed": len(cases) - len(rows),
        "with_full_model": sum(bool(d.get("full")) for _, d in rows),
        "false_alarms": share(sum(bool(d["diagnosis"]["findings"]) for _, d in nothing), len(nothing)),
        "false_alarms_bic": share(sum(d["bic"] != "none" for _, d in nothing), len(nothing)),
        "false_alarms_in_sample": share(sum(d["in_sample"] != "none" for _, d in nothing), len(nothing)),
        "strong_right_or_small_set": share(sum(holds(c, d, 3) for c, d in strong), len(strong)),
        "strong_right_name_first": share(sum(_first_name(d) == c.name for c, d in strong), len(strong)),
        "strong_right_bic": share(sum(d["bic"] == c.name for c, d in strong), len(strong)),
        "strong_right_in_sample": share(sum(d["in_sample"] == c.name for c, d in strong), len(strong)),
        "set_coverage_where_found": share(sum(holds(c, d) for c, d in found), len(found)),
        "found_by_strength": [
            share(
                sum(bool(d["diagnosis"]["findings"]) for c, d in single if c.strength == k),
                sum(c.strength == k for c, _ in single),
            )
            for k in levels
        ],
        "right_first_by_strength": [
            share(
                sum(_first_name(d) == c.name for c, d in single if c.strength == k),
                sum(c.strength == k for c, _ in single),
            )
            for k in levels
        ],
        "oracle_sees_by_strength": [
            share(
                sum((d["oracle"] or 0.0) > 3.0 for c, d in single if c.strength == k),
                sum(c.strength == k for c, _ in single),
            )
            for k in levels
        ],
        "overlap_in_time": {
            "cases": len(overlaps),
            "mean": float(np.mean(overlaps)) if overlaps else None,
            "at_least_0.6": share(sum(o >= 0.6 for o in overlaps), len(overlaps)),
        },
        "interval_coverage_90": share(sum(intervals), len(intervals)),
        "wrong_and_sure": share(len(wrong_sure), len(rows)),
        "unexplained_called_so": share(
            sum(any(f["kind"] == "unexplained" for f in d["diagnosis"]["findings"]) for _, d in unknown), len(unknown)
        ),
        "pairs_both_named": share(
            sum(set(c.name.split("+")) <= set().union(*_names_of(d["diagnosis"]), set()) for c, d in pairs), len(pairs)
        ),
        "held_out_after_over_before_strong": {
            "median": float(np.median(after / before)) if clear else None,
            "cases": len(clear),
        },
        "placebo_after_over_before_strong": (
            float(np.median([each["median"] / b for each, b in zip(placebo, before, strict=True)])) if clear else None
        ),
        "strong_better_than_placebos": share(
            sum(a < each["least"] for each, a in zip(placebo, after, strict=True)), len(clear)
        ),
        "strong_back_within_1.5_plain": share(int(np.sum(after <= 1.5 * plain)), len(clear)),
        "held_out_noise_m": noise,
        "strong_back_within_1.5_noise": share(int(np.sum(after <= 1.5 * noise)), len(clear)),
        "nothing_within_1.5_noise": share(int(np.sum(undisturbed <= 1.5 * noise)), len(nothing)),
        "calibration": _calibration(rows),
        "by_name": _by_name(single),
    }


def _by_name(single: Sequence[tuple[Case, Mapping[str, Any]]]) -> dict[str, dict[str, int]]:
    """For each concealed name: how often each name was given first."""
    table: dict[str, dict[str, int]] = {}
    for case, each in single:
        first = _first_name(each)
        row = table.setdefault(case.name, {})
        row[first] = row.get(first, 0) + 1
    return table


def _first_name(each: Mapping[str, Any]) -> str:
    findings = each["diagnosis"]["findings"]
    return str(findings[0]["name"]) if findings else NOTHING_MISSING


def _overlap(window: tuple[float, float] | list[float], where: Mapping[str, float]) -> float:
    """Intersection over union."""
    both = min(window[1], where["t1_s"]) - max(window[0], where["t0_s"])
    either = max(window[1], where["t1_s"]) - min(window[0], where["t0_s"])
    return max(0.0, both) / either


def _inside(case: Case, each: Mapping[str, Any]) -> list[bool]:
    numbers = each["diagnosis"]["findings"][0]["parameters"]
    return [numbers[k]["low"] <= v <= numbers[k]["high"] for k, v in case.truth.items() if k in numbers]


def _right(case: Case, finding: Mapping[str, Any]) -> bool:
    """Whether a finding is what is concealed: its name, or that no name of the list explains it."""
    if case.kind == "unexplained":
        return bool(finding["kind"] == "unexplained")
    return finding["name"] in case.name.split("+")


def _wrong_and_sure(case: Case, each: Mapping[str, Any]) -> bool:
    return any(f["probability"] > SURE and not _right(case, f) for f in each["diagnosis"]["findings"])


def _calibration(rows: Sequence[tuple[Case, Mapping[str, Any]]]) -> list[dict[str, Any]]:
    """How often findings of a probability are right, by bins of it."""
    stated = [(f["probability"], _right(case, f)) for case, each in rows for f in each["diagnosis"]["findings"]]
    table = []
    for low, high in pairwise(_BINS):
        inside = [(p, right) for p, right in stated if low <= p < high]
        mean = float(np.mean([p for p, _ in inside])) if inside else None
        table.append({"from": low, "stated": mean, **share(sum(right for _, right in inside), len(inside))})
    return table
