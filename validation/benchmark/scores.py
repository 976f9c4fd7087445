"""Figures of the benchmark: counts, shares with their intervals, calibration."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np
from scipy.special import betaincinv

from sssi_exudyn.core.frames import Array
from sssi_exudyn.validation.benchmark.cases import Case
from sssi_exudyn.validation.diagnosis.diagnosis_data import NOTHING_MISSING, Diagnosis, Finding, Friction, Where
from sssi_exudyn.validation.diagnosis.search.search_result import SURE

STRONG: Final = 8.0
"""Standard errors from which an effect counts as clear."""
_VERY_SURE: Final = 0.99
_FORCE: Final = float(np.log(20.0))
"""Log Bayes factor from which a force is taken to act, were nothing else asked."""
_BINS: Final = (0.0, 0.5, 0.8, 0.95, 1.01)


@dataclass(frozen=True)
class CaseResult:
    """What was found in a case, as its file holds it; where it could not be diagnosed, only why.

    full : whether the full model confirmed the fits
    friction : fitted with all findings
    held_out_m : error on turns not fitted;  held_out_plain_m : the same were nothing concealed
    bic, in_sample : the name by the Bayesian information criterion with white noise, and by the best fit in sample
    oracle : standard errors that the effect is strong to one who sees the same run without it, both fitted by the model
        without effects; None where nothing is concealed
    force_log_bayes_factor : of some force against none
    """

    index: int
    failed: str | None = None
    full: bool = False
    diagnosis: Diagnosis | None = None
    friction: Friction | None = None
    held_out_m: float | None = None
    held_out_plain_m: float | None = None
    bic: str = "none"
    in_sample: str = "none"
    oracle: float | None = None
    force_log_bayes_factor: float | None = None

    @property
    def findings(self) -> tuple[Finding, ...]:
        """What was found; empty where nothing was, and where the case could not be diagnosed."""
        return () if self.diagnosis is None else self.diagnosis.findings

    @property
    def first_name(self) -> str:
        """The first finding's name, or that nothing is missing."""
        return self.findings[0].name if self.findings else NOTHING_MISSING


@dataclass(frozen=True)
class Share:
    """Hits among so many, with the 95 % interval; None among none."""

    hits: int
    of: int
    share: float | None
    low: float | None
    high: float | None


@dataclass(frozen=True)
class Overlap:
    """Intersection over union of the times found and concealed: how many, their mean, and those of at least 0.6."""

    cases: int
    mean: float | None
    large: Share


@dataclass(frozen=True)
class Median:
    """The median over so many cases."""

    median: float | None
    cases: int


@dataclass(frozen=True)
class Calibration:
    """Findings whose stated probability is at least ``low``: its mean, and how many of them are right."""

    low: float
    stated: float | None
    right: Share


@dataclass(frozen=True)
class Scores:
    """All figures of the benchmark.

    strong : among clear effects;  by_strength : weak to strong;  force : by the latent force alone
    sure_right : of what is said with more than 0.99;  friction_inside_90 : of all cases, and where nothing is concealed
    within_plain : error on turns not fitted within 1.5 times what the run without the effect leaves
    within_noise : the same, within 1.5 times ``held_out_noise_m``, the median of runs with nothing concealed
    by_name : for each concealed name, how often each name was given first
    seal : sha256 of the answers, which were written before anything was diagnosed
    """

    cases: int
    failed: int
    with_full_model: int
    false_alarms: Share
    false_alarms_bic: Share
    false_alarms_in_sample: Share
    false_alarms_force: Share
    nothing_not_adequate: Share
    right_name_first: Share
    strong_right_or_small_set: Share
    strong_right_name_first: Share
    strong_right_bic: Share
    strong_right_in_sample: Share
    strong_seen_force: Share
    set_coverage_where_found: Share
    found_by_strength: tuple[Share, ...]
    right_first_by_strength: tuple[Share, ...]
    oracle_sees_by_strength: tuple[Share, ...]
    overlap_in_time: Overlap
    interval_coverage_90: Share
    wrong_and_sure: Share
    sure_right: Share
    friction_inside_90: Share
    friction_inside_90_nothing: Share
    unexplained_called_so: Share
    unexplained_wrongly_named: Share
    unexplained_where_found: Share
    pairs_both_named: Share
    held_out_after_over_before_strong: Median
    placebo_after_over_before_strong: float | None
    strong_better_than_placebos: Share
    strong_within_plain: Share
    held_out_noise_m: float | None
    strong_within_noise: Share
    nothing_within_noise: Share
    calibration: tuple[Calibration, ...]
    by_name: dict[str, dict[str, int]]
    seal: str


def share(hits: int, of: int) -> Share:
    """A share with its 95 % interval (Clopper and Pearson)."""
    if not of:
        return Share(hits, of, None, None, None)
    low = float(betaincinv(hits, of - hits + 1, 0.025)) if hits else 0.0
    high = float(betaincinv(hits + 1, of - hits, 0.975)) if hits < of else 1.0
    return Share(hits, of, hits / of, low, high)


def score(cases: Sequence[Case], results: Sequence[CaseResult], seal: str) -> Scores:
    """All figures from the answers, sealed with the hash ``seal``, and the diagnoses."""
    rows = [(case, each) for case, each in zip(cases, results, strict=True) if each.diagnosis is not None]
    nothing = [d for c, d in rows if c.kind == "none"]
    single = [(c, d) for c, d in rows if c.kind in ("physics", "sensor")]
    strong = [(c, d) for c, d in single if (d.oracle or 0.0) >= STRONG]
    found = [(c, d) for c, d in single if d.findings]
    unknown = [d for c, d in rows if c.kind == "unexplained"]
    said = [(f.probability, is_right(c, f)) for c, d in rows for f in d.findings]
    pairs = [(c, d) for c, d in rows if c.kind == "pair"]
    overlaps = [
        overlap(c.window, d.findings[0].where)
        for c, d in found
        if c.window and d.first_name == c.name and d.findings[0].where
    ]
    intervals = [inside for c, d in found if d.first_name == c.name for inside in inside_90(c.truth, d.findings[0])]
    clear = [d for _, d in strong if d.findings]
    before = _metres([d.findings[0].evidence.held_out_error_m.before for d in clear])
    after = _metres([d.findings[-1].evidence.held_out_error_m.after for d in clear])
    plain = _metres([d.held_out_plain_m for d in clear])
    placebos = [d.findings[0].evidence.placebo_held_out_error_m for d in clear]
    least = _metres([None if each is None else each.least for each in placebos])
    median = _metres([None if each is None else each.median for each in placebos])
    undisturbed = _metres([d.held_out_m for d in nothing])
    noise = float(np.median(undisturbed)) if nothing else float("nan")
    by_strength = [[(c, d) for c, d in single if c.strength == k] for k in range(4)]
    return Scores(
        cases=len(cases),
        failed=len(cases) - len(rows),
        with_full_model=sum(d.full for _, d in rows),
        false_alarms=_share_of(bool(d.findings) for d in nothing),
        false_alarms_bic=_share_of(d.bic != "none" for d in nothing),
        false_alarms_in_sample=_share_of(d.in_sample != "none" for d in nothing),
        false_alarms_force=_share_of(_force_seen(d) for d in nothing),
        nothing_not_adequate=_share_of(_not_adequate(d) for d in nothing),
        right_name_first=_share_of(d.first_name == c.name for c, d in single),
        strong_right_or_small_set=_share_of(d.first_name == c.name or _set_holds(c, d, 3) for c, d in strong),
        strong_right_name_first=_share_of(d.first_name == c.name for c, d in strong),
        strong_right_bic=_share_of(d.bic == c.name for c, d in strong),
        strong_right_in_sample=_share_of(d.in_sample == c.name for c, d in strong),
        strong_seen_force=_share_of(_force_seen(d) for _, d in strong),
        set_coverage_where_found=_share_of(_set_holds(c, d) for c, d in found),
        found_by_strength=tuple(_share_of(bool(d.findings) for _, d in each) for each in by_strength),
        right_first_by_strength=tuple(_share_of(d.first_name == c.name for c, d in each) for each in by_strength),
        oracle_sees_by_strength=tuple(_share_of((d.oracle or 0.0) > 3.0 for _, d in each) for each in by_strength),
        overlap_in_time=Overlap(
            cases=len(overlaps),
            mean=float(np.mean(overlaps)) if overlaps else None,
            large=_share_of(each >= 0.6 for each in overlaps),
        ),
        interval_coverage_90=_share_of(intervals),
        wrong_and_sure=_share_of(not right for p, right in said if p > SURE),
        sure_right=_share_of(right for p, right in said if p > _VERY_SURE),
        friction_inside_90=_share_of(inside for c, d in rows for inside in _friction_inside(c, d)),
        friction_inside_90_nothing=_share_of(
            inside for c, d in rows if c.kind == "none" for inside in _friction_inside(c, d)
        ),
        unexplained_called_so=_share_of(any(f.kind == "unexplained" for f in d.findings) for d in unknown),
        unexplained_wrongly_named=_share_of(
            any(f.kind != "unexplained" and f.probability > SURE for f in d.findings) for d in unknown
        ),
        unexplained_where_found=_share_of(
            any(f.kind == "unexplained" for f in d.findings) for d in unknown if d.findings
        ),
        pairs_both_named=_share_of(set(c.name.split("+")) <= set().union(*_names_of(d)) for c, d in pairs),
        held_out_after_over_before_strong=Median(float(np.median(after / before)) if clear else None, len(clear)),
        placebo_after_over_before_strong=float(np.median(median / before)) if clear else None,
        strong_better_than_placebos=_share_of(after < least),
        strong_within_plain=_share_of(after <= 1.5 * plain),
        held_out_noise_m=noise if nothing else None,
        strong_within_noise=_share_of(after <= 1.5 * noise),
        nothing_within_noise=_share_of(undisturbed <= 1.5 * noise),
        calibration=_calibration(rows),
        by_name=_by_name(single),
        seal=seal,
    )


def _share_of(answers: Iterable[bool | np.bool_]) -> Share:
    counted = list(answers)
    return share(sum(map(bool, counted)), len(counted))


def _metres(lengths: Sequence[float | None]) -> Array:
    return np.array([np.nan if length is None else length for length in lengths])


def _names_of(result: CaseResult) -> list[set[str]]:
    """The set of names of each finding: the most probable and its alternatives until 95 % are reached."""
    sets = []
    for finding in result.findings:
        names, total = {finding.name}, finding.probability
        for other in finding.alternatives:
            if total >= 0.95:
                break
            names.add(other.name)
            total += other.probability
        sets.append(names)
    return sets


def _set_holds(case: Case, result: CaseResult, most: float = math.inf) -> bool:
    """Whether the first finding's set holds the name, and at most so many."""
    sets = _names_of(result)
    return bool(sets) and case.name in sets[0] and len(sets[0]) <= most


def _by_name(single: Sequence[tuple[Case, CaseResult]]) -> dict[str, dict[str, int]]:
    """For each concealed name: how often each name was given first."""
    table: dict[str, dict[str, int]] = {}
    for case, each in single:
        row = table.setdefault(case.name, {})
        row[each.first_name] = row.get(each.first_name, 0) + 1
    return table


def overlap(window: tuple[float, float], where: Where) -> float:
    """Intersection over union of two stretches of time."""
    both = min(window[1], where.t1_s) - max(window[0], where.t0_s)
    either = max(window[1], where.t1_s) - min(window[0], where.t0_s)
    return max(0.0, both) / either


def inside_90(truth: Mapping[str, float], finding: Finding) -> list[bool]:
    """Whether each of the true numbers is inside its 90 % interval, as far as the finding has it."""
    numbers = finding.parameters
    return [numbers[k].low <= v <= numbers[k].high for k, v in truth.items() if k in numbers]


def is_right(case: Case, finding: Finding) -> bool:
    """Whether a finding is what is concealed: its name, or that no name of the list explains it."""
    if case.kind == "unexplained":
        return finding.kind == "unexplained"
    return finding.name in case.name.split("+")


def _force_seen(result: CaseResult) -> bool:
    return (result.force_log_bayes_factor or 0.0) > _FORCE


def _not_adequate(result: CaseResult) -> bool:
    return result.diagnosis is not None and result.diagnosis.verdict == "not_adequate"


def _friction_inside(case: Case, result: CaseResult) -> list[bool]:
    """Of each friction, whether the interval that the user is shown holds it."""
    shown = None if result.diagnosis is None else result.diagnosis.friction_averaged
    true = {"mu_t": case.mu_t, "mu_n": case.mu_n}
    return [each.low <= value <= each.high for name, each in (shown or {}).items() if (value := true[name]) is not None]


def _calibration(rows: Sequence[tuple[Case, CaseResult]]) -> tuple[Calibration, ...]:
    """How often findings of a probability are right, by bins of it."""
    stated = [(finding.probability, is_right(case, finding)) for case, each in rows for finding in each.findings]
    bins = []
    for low, high in pairwise(_BINS):
        inside = [(p, right) for p, right in stated if low <= p < high]
        mean = float(np.mean([p for p, _ in inside])) if inside else None
        bins.append(Calibration(low, mean, _share_of(right for _, right in inside)))
    return tuple(bins)
