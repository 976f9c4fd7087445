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
from sssi_exudyn.validation.diagnosis.thresholds import THRESHOLDS

STRONG: Final = 8.0
"""Standard errors above which an effect counts as clear."""
_SEEN: Final = 5.0
"""Standard errors above which both effects of a pair are to be seen."""
_VERY_SURE: Final = 0.99
_FORCE: Final = float(np.log(20.0))
"""Log Bayes factor above which a force is taken to act, by this criterion alone."""
_BINS: Final = (0.0, 0.5, 0.8, 0.95, 1.01)


@dataclass(frozen=True)
class CaseResult:
    """Result of a case, as in its file; where it could not be diagnosed, only the reason.

    full : whether the full model confirmed the fits
    friction : fitted with all findings
    held_out_m : error on turns not fitted;  held_out_plain_m : the same with nothing concealed
    bic, in_sample : the name by the Bayesian information criterion with white noise, and by the best fit in sample
    oracle : strength of the effect in standard errors by comparison with the same run without it, both fitted by the
        model without effects; None where nothing is concealed
    strengths : the same of each of several effects, next to the others
    force_log_bayes_factor : that of some force against none
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
    strengths: tuple[float, ...] = ()
    force_log_bayes_factor: float | None = None

    @property
    def findings(self) -> tuple[Finding, ...]:
        """Findings; empty where there were none, and where the case could not be diagnosed."""
        return () if self.diagnosis is None else self.diagnosis.findings

    @property
    def first_name(self) -> str:
        """Name of the first finding, or that nothing is missing."""
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
    """Intersection over union of the times found and concealed: number, mean, and those of at least 0.6."""

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
    """Findings whose stated probability is at least ``low``: its mean, and the share of right ones."""

    low: float
    stated: float | None
    right: Share


@dataclass(frozen=True)
class Scores:
    """All figures of the benchmark.

    strong : among clear effects;  by_strength : weak to strong;  force : by the latent force alone
    sure_right : of findings with a probability above 0.99;  friction_inside_90 : of all cases, and where nothing is
        concealed
    within_plain : error on turns not fitted within 1.5 times that of the run without the effect
    within_noise : the same, within 1.5 times ``held_out_noise_m``, the median of runs with nothing concealed
    seen_pairs_both_named : of those whose weaker effect is to be seen next to the other
    by_name : for each concealed name, the counts of the names given first
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
    seen_pairs_both_named: Share
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
    """Return a share with its 95 % interval (Clopper and Pearson)."""
    if not of:
        return Share(hits, of, None, None, None)
    low = float(betaincinv(hits, of - hits + 1, 0.025)) if hits else 0.0
    high = float(betaincinv(hits + 1, of - hits, 0.975)) if hits < of else 1.0
    return Share(hits, of, hits / of, low, high)


def score(cases: Sequence[Case], results: Sequence[CaseResult], seal: str) -> Scores:
    """Compute all figures from the answers, sealed with the hash ``seal``, and the diagnoses."""
    rows = [(case, result) for case, result in zip(cases, results, strict=True) if result.diagnosis is not None]
    nothing = [d for c, d in rows if c.kind == "none"]
    single = [(c, d) for c, d in rows if c.kind in ("physics", "sensor")]
    strong = [(c, d) for c, d in single if (d.oracle or 0.0) >= STRONG]
    with_findings = [(c, d) for c, d in single if d.findings]
    unknown = [d for c, d in rows if c.kind == "unexplained"]
    said = [(f.probability, is_right(c, f)) for c, d in rows for f in d.findings]
    pairs = [(c, d) for c, d in rows if c.kind == "pair"]
    overlaps = [
        overlap(c.window, d.findings[0].where)
        for c, d in with_findings
        if c.window and d.first_name == c.name and d.findings[0].where
    ]
    intervals = [
        inside for c, d in with_findings if d.first_name == c.name for inside in inside_90(c.truth, d.findings[0])
    ]
    clear = [d for _, d in strong if d.findings]
    before = _metres([d.findings[0].evidence.held_out_error_m.before for d in clear])
    after = _metres([d.findings[-1].evidence.held_out_error_m.after for d in clear])
    plain = _metres([d.held_out_plain_m for d in clear])
    placebos = [d.findings[0].evidence.placebo_held_out_error_m for d in clear]
    least = _metres([None if placebo is None else placebo.least for placebo in placebos])
    median = _metres([None if placebo is None else placebo.median for placebo in placebos])
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
        set_coverage_where_found=_share_of(_set_holds(c, d) for c, d in with_findings),
        found_by_strength=tuple(_share_of(bool(d.findings) for _, d in level) for level in by_strength),
        right_first_by_strength=tuple(_share_of(d.first_name == c.name for c, d in level) for level in by_strength),
        oracle_sees_by_strength=tuple(_share_of((d.oracle or 0.0) > 3.0 for _, d in level) for level in by_strength),
        overlap_in_time=Overlap(
            cases=len(overlaps),
            mean=float(np.mean(overlaps)) if overlaps else None,
            large=_share_of(share >= 0.6 for share in overlaps),
        ),
        interval_coverage_90=_share_of(intervals),
        wrong_and_sure=_share_of(not right for p, right in said if p > THRESHOLDS.sure),
        sure_right=_share_of(right for p, right in said if p > _VERY_SURE),
        friction_inside_90=_share_of(inside for c, d in rows for inside in _friction_inside(c, d)),
        friction_inside_90_nothing=_share_of(
            inside for c, d in rows if c.kind == "none" for inside in _friction_inside(c, d)
        ),
        unexplained_called_so=_share_of(any(f.kind == "unexplained" for f in d.findings) for d in unknown),
        unexplained_wrongly_named=_share_of(
            any(f.kind != "unexplained" and f.probability > THRESHOLDS.sure for f in d.findings) for d in unknown
        ),
        unexplained_where_found=_share_of(
            any(f.kind == "unexplained" for f in d.findings) for d in unknown if d.findings
        ),
        pairs_both_named=_share_of(_both_named(c, d) for c, d in pairs),
        seen_pairs_both_named=_share_of(_both_named(c, d) for c, d in pairs if min(d.strengths, default=0.0) >= _SEEN),
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
    """Return the set of names of each finding: the most probable and its alternatives up to 95 %."""
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


def _both_named(case: Case, result: CaseResult) -> bool:
    return set(case.name.split("+")) <= set().union(*_names_of(result))


def _set_holds(case: Case, result: CaseResult, most: float = math.inf) -> bool:
    """Tell whether the first finding's set holds the name, and at most so many."""
    sets = _names_of(result)
    return bool(sets) and case.name in sets[0] and len(sets[0]) <= most


def _by_name(single: Sequence[tuple[Case, CaseResult]]) -> dict[str, dict[str, int]]:
    """Count for each concealed name how often each name was given first."""
    table: dict[str, dict[str, int]] = {}
    for case, result in single:
        row = table.setdefault(case.name, {})
        row[result.first_name] = row.get(result.first_name, 0) + 1
    return table


def overlap(window: tuple[float, float], where: Where) -> float:
    """Return intersection over union of two stretches of time."""
    both = min(window[1], where.t1_s) - max(window[0], where.t0_s)
    either = max(window[1], where.t1_s) - min(window[0], where.t0_s)
    return max(0.0, both) / either


def inside_90(truth: Mapping[str, float], finding: Finding) -> list[bool]:
    """Tell for each of the true numbers whether it is inside its 90 % interval, as far as the finding has it."""
    numbers = finding.parameters
    return [numbers[k].low <= v <= numbers[k].high for k, v in truth.items() if k in numbers]


def is_right(case: Case, finding: Finding) -> bool:
    """Tell whether a finding is the concealed effect: its name, or that no name of the list explains it."""
    if case.kind == "unexplained":
        return finding.kind == "unexplained"
    return finding.name in case.name.split("+")


def _force_seen(result: CaseResult) -> bool:
    return (result.force_log_bayes_factor or 0.0) > _FORCE


def _not_adequate(result: CaseResult) -> bool:
    return result.diagnosis is not None and result.diagnosis.verdict == "not_adequate"


def _friction_inside(case: Case, result: CaseResult) -> list[bool]:
    """Tell for each friction whether the interval that the user is shown holds it."""
    shown = None if result.diagnosis is None else result.diagnosis.friction_averaged
    true = {"mu_t": case.mu_t, "mu_n": case.mu_n}
    return [
        number.low <= value <= number.high
        for name, number in (shown or {}).items()
        if (value := true[name]) is not None
    ]


def _calibration(rows: Sequence[tuple[Case, CaseResult]]) -> tuple[Calibration, ...]:
    """Return by bins of probability how often findings are right."""
    stated = [(finding.probability, is_right(case, finding)) for case, result in rows for finding in result.findings]
    bins = []
    for low, high in pairwise(_BINS):
        inside = [(p, right) for p, right in stated if low <= p < high]
        mean = float(np.mean([p for p, _ in inside])) if inside else None
        bins.append(Calibration(low, mean, _share_of(right for _, right in inside)))
    return tuple(bins)
