"""The clocks of capture, fixes and insoles against each other: one that runs fast, or a frame rate declared wrong.

Two instruments show that their clocks disagree, a third shows which one is wrong.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from sssi_exudyn.core.frames import Array
from sssi_exudyn.recording.cross_checks.check import Evidence, Finding
from sssi_exudyn.recording.cross_checks.clock_pairs import (
    lean_of_turns,
    loads_of_acceleration,
    loads_of_lean,
    skis_along_course,
)
from sssi_exudyn.recording.cross_checks.pace import Comparison, Pace, find_pace

_EXPLAINED: Final = 0.4
"""Share that may be left unexplained of what two instruments see of the same turns, at the best rate.
In recordings whose clocks agree it is 0.00 to 0.29, where the receiver is as exact as turns require, else 0.7 to 1.
"""
_NOTICED: Final = 9.0
_SURE: Final = 25.0
"""Sums of squares, in standard deviations, by which another rate fits better: 3 and 5 standard deviations.
In 24 recordings whose clocks agree the largest is 3.3.
"""
_OTHER: Final = 9.0
"""Sum of squares by which one instrument's clock has to explain all rates better than another's."""
_SHIFTED: Final = 0.15
"""Offset at an instrument's first sample, s, from which on it is corrected as well: prediction is exact to 0.05 s."""
_NAMES: Final = {"motion": "capture", "insoles": "insoles", "gps": "fixes"}
"""Instruments by the table that names them; of two that are as likely to be wrong, the first is named: a satellite's
clock is right more often than a declared frame rate.
"""
_PLACES: Final = {"motion": "Frame Time", "gps": "times", "insoles": "time_s"}


@dataclass(frozen=True)
class Seen:
    """One comparison: the instrument whose times are multiplied, the one that it then fits, and by how much."""

    instrument: str
    other: str
    pace: Pace
    shows_offset: bool


@dataclass(frozen=True)
class _Explanation:
    """One instrument's clock that runs at another rate: logarithm of its factor, standard deviation, and what is left.

    left : sum of squares of all comparisons, in their standard deviations
    """

    instrument: str
    rate: float
    sigma: float
    left: float


class ClockRates:
    """A clock that runs fast or slow."""

    compares = "lean, course and loads of the same turns with each other: rates of the clocks"

    def judge(self, evidence: Evidence) -> Sequence[Finding]:
        """Return a correction where a third instrument shows which clock is wrong, a doubt where none does."""
        seen = compare_clocks(evidence)
        agreed = sum((one.pace.rate / one.pace.sigma) ** 2 for one in seen)
        instruments = [name for name in _NAMES if any(name in (one.instrument, one.other) for one in seen)]
        if agreed < _NOTICED:
            return ()
        best, *others = sorted((_explain(seen, name) for name in instruments), key=lambda one: one.left)
        if agreed - best.left < _NOTICED:
            return ()
        sure = agreed - best.left > _SURE and all(other.left - best.left > _OTHER for other in others)
        factor, error = float(np.exp(best.rate)), best.sigma
        words = f"{100.0 * abs(1.0 / factor - 1.0):.1f} ± {100.0 * error:.1f} % {'slow' if factor > 1.0 else 'fast'}"
        against = " and ".join(_NAMES[name] for name in instruments if name != best.instrument)
        path, place = evidence.files[best.instrument], _PLACES[best.instrument]
        if not sure:
            all_names = " and ".join(_NAMES[name] for name in instruments)
            problem = (
                f"the clocks of {all_names} do not run at the same pace: the best factor for the times of the"
                f" {_NAMES[best.instrument]} is {factor:.3f} ± {error:.3f}"
            )
            fix = "check the frame rate (Frame Time) and the times; friction may be wrong by more than its interval"
            return (Finding(path, "", problem, fix),)
        pivot, shift = _shift(evidence, seen, best)
        corrected = _on_clock(evidence, best, pivot, shift)
        moved = f" and moved by {shift:+.2f} s" if shift else ""
        problem = f"its clock runs {words} against {against}, which agree"
        return (Finding(path, place, problem, f"times were multiplied by {factor:.4f}{moved}", True, corrected),)


def compare_clocks(evidence: Evidence) -> tuple[Seen, ...]:
    """Return every comparison of two clocks that shows their rate."""
    pairs: tuple[tuple[str, str, Comparison | None, bool], ...] = (
        ("motion", "gps", skis_along_course(evidence), False),
        ("motion", "gps", lean_of_turns(evidence), True),
        ("insoles", "gps", loads_of_acceleration(evidence), True),
        ("insoles", "motion", loads_of_lean(evidence), False),
    )
    seen = (Seen(one, two, find_pace(pair), exact) for one, two, pair, exact in pairs if pair is not None)
    return tuple(one for one in seen if one.pace.left < _EXPLAINED)


def _explain(seen: Sequence[Seen], instrument: str) -> _Explanation:
    """Return how well one instrument's wrong clock explains all comparisons."""
    signs = np.array([(one.instrument == instrument) - (one.other == instrument) for one in seen], dtype=np.float64)
    rates = np.array([one.pace.rate for one in seen])
    weights = np.array([one.pace.sigma for one in seen]) ** -2.0
    information = float(np.sum(weights * signs**2))
    rate = float(np.sum(weights * signs * rates)) / information
    return _Explanation(instrument, rate, information**-0.5, float(np.sum(weights * (rates - signs * rate) ** 2)))


def _times(evidence: Evidence) -> Mapping[str, Array]:
    times: dict[str, Array] = {}
    if evidence.bvh is not None:
        times["motion"] = evidence.bvh.time
    if evidence.gps is not None:
        times["gps"] = evidence.gps.time
    if evidence.insoles is not None:
        times["insoles"] = evidence.insoles.time
    return times


def _shift(evidence: Evidence, seen: Sequence[Seen], best: _Explanation) -> tuple[float, float]:
    """Return the first sample's time (s), about which times are multiplied, and by how much they are moved then (s)."""
    pivot = float(_times(evidence)[best.instrument][0])
    middle = 0.5 * (evidence.start + evidence.stop)
    factor = float(np.exp(best.rate))
    exact = [one for one in seen if one.shows_offset and best.instrument in (one.instrument, one.other)]
    if not exact:
        return pivot, 0.0
    one = min(exact, key=lambda one: one.pace.sigma)
    # an offset of the other instrument in the middle is minus that of this one
    offset = one.pace.offset if one.instrument == best.instrument else -one.pace.offset
    shift = (factor - 1.0) * (pivot - middle) + offset
    return pivot, shift if abs(shift) > _SHIFTED else 0.0


def _on_clock(evidence: Evidence, best: _Explanation, pivot: float, shift: float) -> Evidence:
    """Return the evidence with one instrument's times multiplied, and the stretch that all cover then."""

    def right(time: Array) -> Array:
        return pivot + float(np.exp(best.rate)) * (time - pivot) + shift

    bvh, gps, insoles = evidence.bvh, evidence.gps, evidence.insoles
    if bvh is not None and best.instrument == "motion":
        bvh = replace(bvh, time=right(bvh.time))
    if gps is not None and best.instrument == "gps":
        gps = replace(gps, time=right(gps.time))
    if insoles is not None and best.instrument == "insoles":
        insoles = replace(insoles, time=right(insoles.time))
    changed = replace(evidence, bvh=bvh, gps=gps, insoles=insoles)
    times = _times(changed).values()
    start, stop = max(float(time[0]) for time in times), min(float(time[-1]) for time in times)
    return replace(changed, start=start, stop=stop, clock_sigma=0.5 * best.sigma * (stop - start))
