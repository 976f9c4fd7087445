"""A diagnosis in words: one sentence that says it all, and what would part what cannot be told apart."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final

import numpy as np

from sssi_exudyn.model.model import Model
from sssi_exudyn.validation.diagnosis.result import Alternative, Finding, Number
from sssi_exudyn.validation.diagnosis.search_result import Figures

Numbers = dict[str, Number]


def _way(value: float, up: str, down: str) -> str:
    return up if value > 0.0 else down


def _patch(n: Numbers, model: Model) -> str:
    here = model.friction.mu_t + n["delta_mu_t"].value
    return (
        f"the skis glide on {_way(n['delta_mu_t'].value, 'slower', 'faster')} snow: μ_t is {here:.3f} there against "
        f"{model.friction.mu_t:.3f} elsewhere"
    )


def _blowing(n: Numbers) -> str:
    f, l = n["w_f"].value, n["w_l"].value  # noqa: E741  the slope frame's name of the axis
    parts = [f"{abs(f):.1f} m/s {_way(f, 'down', 'up')} the slope"]
    if abs(l) > 0.5:
        parts.append(f"{abs(l):.1f} m/s to the {_way(l, 'left', 'right')}")
    return " and ".join(parts)


_SAYINGS: Final[dict[str, Callable[[Numbers, Model], str]]] = {
    "wind": lambda n, m: f"a steady wind blows, {_blowing(n)}",
    "gust": lambda n, m: f"a gust blows, {_blowing(n)} at its peak",
    "drag_area": lambda n, m: f"the skier's drag area is {100 * n['share'].value:+.0f} % of the assumed one",
    "snow_patch": _patch,
    "speed_dependent_friction": lambda n, m: f"μ_t changes by {n['b'].value:+.4f} for each m/s of speed",
    "edge_dependent_friction": lambda n, m: f"μ_t changes by {n['b'].value * np.pi / 18:+.4f} for each 10° of edging",
    "load_dependent_friction": lambda n, m: f"μ_t changes by {n['b'].value:+.4f} when the load on a ski doubles",
    "snow_compaction": lambda n, m: "the snow resists being pressed down ahead of the skis",
    "slope_change": lambda n, m: (
        f"the piste is {abs(np.degrees(n['delta'].value)):.1f}° {_way(n['delta'].value, 'steeper', 'flatter')} than "
        "before"
    ),
    "terrain_bump": lambda n, m: (
        f"the skis go over a {_way(n['rise'].value, 'roll', 'dip')} of {abs(n['rise'].value):.2f} m"
    ),
    "pole_plant": lambda n, m: (
        f"each pole plant gives {n['forward'].value:+.0f} N s along the way and {n['up'].value:+.0f} N s up"
    ),
    "gps_delay": lambda n, m: f"the GPS clock is {n['clock_offset'].value:+.3f} s late; no physics is missing",
    "gps_jump": lambda n, m: (
        f"the GPS fixes are displaced by {np.hypot(n['x'].value, n['y'].value):.2f} m; no physics is missing"
    ),
    "heading_misalignment": lambda n, m: (
        f"the capture is turned by {np.degrees(n['heading_offset'].value):+.1f}°; no physics is missing"
    ),
    "heading_drift": lambda n, m: (
        f"the capture's heading drifts by {60 * np.degrees(n['rate'].value):+.1f}° a minute; no physics is missing"
    ),
    "lever_arm": lambda n, m: (
        "the antenna sits "
        f"{np.sqrt(sum(n[k].value ** 2 for k in ('forward', 'left', 'up'))):.2f} m from where the recording says"
    ),
    "insole_gain": lambda n, m: (
        f"the insoles read {100 * n['left'].value:+.0f} % (left) and {100 * n['right'].value:+.0f} % (right) wrong"
    ),
    "boot_cuff": lambda n, m: f"the boots' cuffs carry {100 * n['share'].value:.0f} % more of the load than usual",
    "unexplained_force": lambda n, m: (
        f"a force acts that no known law explains: {n['force_f'].value:+.0f} N down the slope, "
        f"{n['force_l'].value:+.0f} N to the left, {n['force_n'].value:+.0f} N away from the snow"
    ),
}

PARTED_BY: Final = {
    frozenset({"wind", "drag_area", "speed_dependent_friction"}): (
        "an anemometer on the slope, or the same skier at another speed or posture on the same snow"
    ),
    frozenset({"edge_dependent_friction", "load_dependent_friction", "snow_compaction"}): (
        "a straight run beside the turns on the same snow"
    ),
    frozenset({"pole_plant", "edge_dependent_friction"}): "a force sensor in the pole, or a run without planting",
    frozenset({"gust", "unexplained_force", "snow_patch"}): "a second run over the same place",
    frozenset({"gps_delay", "lever_arm"}): "the receiver's time pulse, or the antenna's place measured",
    frozenset({"insole_gain", "boot_cuff"}): "the insoles read while standing still",
}
"""What would part hypotheses that one recording cannot."""


def sentence_of(
    verdict: str,
    findings: Sequence[Finding],
    before: Model,
    after: Model,
    first: Figures,
    last: Figures,
) -> str:
    """The sentence that says it all."""
    if verdict == "none":
        return (
            f"Nothing is missing: the track is met to {first.trajectory_error:.2f} m, which is what the instruments' "
            f"noise leaves; μ_t is {before.friction.mu_t:.3f} and μ_n {before.friction.mu_n:.2f}."
        )
    parts = [_said(finding, after) for finding in findings]
    told = " Besides, ".join(part if i else part[0].upper() + part[1:] for i, part in enumerate(parts))
    return (
        f"{told} With this the track is met to {last.trajectory_error:.2f} m instead of {first.trajectory_error:.2f} m"
        f" (turns not fitted: {last.held_out_error:.2f} instead of {first.held_out_error:.2f} m)."
    )


def saying(name: str, numbers: Numbers, model: Model) -> str:
    """What a finding of that name means, with its numbers by their keys."""
    return _SAYINGS[name](numbers, model)


def _said(finding: Finding, model: Model) -> str:
    where = finding.where
    when = "" if where is None else f"between {where.t0_s:.1f} s and {where.t1_s:.1f} s "
    words = when + saying(finding.name, finding.parameters, model)
    if finding.probability < 0.8 and finding.alternatives:
        words += f" ({finding.probability:.0%} probable; {doubt(finding.name, finding.alternatives)})"
    return words + "."


def doubt(name: str, others: Sequence[Alternative]) -> str:
    """What else it may be than that name, with probabilities, and what would tell."""
    listed = ", ".join(f"{other.name} ({other.probability:.0%})" for other in others)
    return f"it may as well be {listed}{_parted(name, [other.name for other in others])}"


def _parted(name: str, others: Sequence[str]) -> str:
    for group, measurement in PARTED_BY.items():
        if name in group and group & set(others):
            return f"; {measurement} would tell"
    return ""
