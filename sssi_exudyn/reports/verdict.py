"""The verdict on a result: a light, and the figure that decides it.

Every check looks at one figure of a summary.  The worst light decides; among equal ones the first check does.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, Literal

from sssi_exudyn.analysis.biomechanics import RESIDUAL_MOMENT, ResidualMoment
from sssi_exudyn.core.text import metres
from sssi_exudyn.results.summary import Summary

Level = Literal["good", "care", "bad"]
WORDS: Final[dict[Level, str]] = {"good": "good", "care": "with care", "bad": "do not trust"}
SYMBOLS: Final[dict[Level, str]] = {"good": "✓", "care": "!", "bad": "✗"}
"""A light's word and symbol: colour alone would tell nothing to one reader in twelve, and nothing in print."""
_ORDER: Final[tuple[Level, ...]] = ("good", "care", "bad")
_UNPREDICTED: Final = 2.0
"""Times the error of a constant speed from which a prediction is not to be trusted at all; chosen."""
LEAST_CLOSURE: Final = 1.0
"""% of the turnover; a gap in the energy balance of that size changes μ_t by as much as its standard error or less."""
MOST_OF_LENGTH: Final = 3.0
"""% of the path's length by which a run of few sensors leaves the GPS on average before it is said; chosen: skis that
point 3° another way all the time."""


@dataclass(frozen=True)
class Verdict:
    """A light and its reason.

    level : ``good``, ``care`` or ``bad``
    figure : the figure that decides; "" where every figure is within its limits
    reason : one sentence about that figure
    """

    level: Level
    figure: str
    reason: str

    @property
    def words(self) -> str:
        """Return symbol and word."""
        return f"{SYMBOLS[self.level]} {WORDS[self.level]}"

    @property
    def sentence(self) -> str:
        """Return what decides, and why."""
        return f"{self.figure} decides. {self.reason}" if self.figure else self.reason


def verdict_of(summary: Summary) -> Verdict:
    """Return the worst of all checks; where none objects every figure is within its limits."""
    objections = [objection for check in CHECKS if (objection := check(summary)) is not None]
    if not objections:
        return Verdict("good", "", f"Every figure that was checked is within its limits. {moment_sentence(summary)}")
    worst = max(_ORDER.index(objection.level) for objection in objections)
    return next(objection for objection in objections if objection.level == _ORDER[worst])


def moment_sentence(summary: Summary) -> str:
    """State peak and rms of the residual moment against OpenSim's limits; "" where it is not known."""
    moment = summary.residual_moment
    if moment.rms_Nm is None or moment.peak_Nm is None:
        return ""
    peak, rms = (f"the {name} ({value:.0f} N\u00a0m{when})" for name, value, when in _figures(moment))
    peak_limit, rms_limit = (f"{RESIDUAL_MOMENT[name][1]:.0f} N\u00a0m" for name in ("peak", "rms"))
    beyond = beyond_limits(summary)
    if not beyond:
        return f"Of the residual moment, {peak} and {rms} are within OpenSim's limits of {peak_limit} and {rms_limit}."
    if len(beyond) == 2:
        return f"Of the residual moment, {peak} and {rms} exceed OpenSim's limits of {peak_limit} and {rms_limit}."
    if beyond == ["peak"]:
        return f"{_capital(peak)} exceeds OpenSim's limit of {peak_limit}; {rms} is within its limit of {rms_limit}."
    return f"{_capital(rms)} exceeds OpenSim's limit of {rms_limit}; {peak} is within its limit of {peak_limit}."


def _capital(words: str) -> str:
    """Return words with a first capital; those of units stay as they are."""
    return words[:1].upper() + words[1:]


def _figures(moment: ResidualMoment) -> tuple[tuple[str, float, str], tuple[str, float, str]]:
    """Return name, size (N m) and instant in words of peak and rms."""
    when = "" if moment.peak_at_s is None else f" at {moment.peak_at_s:.1f}\u00a0s"
    return ("peak", moment.peak_Nm or 0.0, when), ("rms", moment.rms_Nm or 0.0, "")


def beyond_limits(summary: Summary) -> list[str]:
    """Return which of peak and rms of the residual moment exceed OpenSim's limits."""
    return [name for name, value, _ in _figures(summary.residual_moment) if value > RESIDUAL_MOMENT[name][1]]


def _stopped(summary: Summary) -> Verdict | None:
    if summary.diverged is None:
        return None
    return Verdict("bad", "The simulation", f"It stopped before the end ({summary.diverged}).")


def _not_converged(summary: Summary) -> Verdict | None:
    if summary.fit.converged is not False:
        return None
    return Verdict("bad", "The fit", f"It did not converge: {summary.fit.reason or 'no reason is given'}.")


def _withheld(summary: Summary) -> Verdict | None:
    uncertainty = summary.uncertainty
    if uncertainty is None or uncertainty.withheld is None:
        return None
    return Verdict("bad", "The interval", f"There is none: {uncertainty.withheld}.")


def _missed(summary: Summary) -> Verdict | None:
    if summary.uncertainty is None or summary.uncertainty.missed is None:
        return None
    kind, times = summary.uncertainty.missed
    wide = summary.uncertainty.widened or 1.0
    intervals = f"Intervals are {wide:.1f} times as wide for it." if wide > 1.0 else "Intervals are too narrow for it."
    return Verdict(
        "care" if wide > 1.0 else "bad",
        f"The residual of the {kind}",
        f"It is {times:.1f} times the usual noise of such instruments. {intervals}",
    )


def _beyond_priors(summary: Summary) -> Verdict | None:
    uncertainty = summary.uncertainty
    if uncertainty is None or uncertainty.fits_priors or not uncertainty.largest:
        return None
    worst = uncertainty.largest[0]
    much = f"It is {abs(worst.sigmas):.1f} standard deviations: the stated value or the model is wrong."
    return Verdict("care", f"The correction of {worst.what}", much)


def _diagnosed(summary: Summary) -> Verdict | None:
    if summary.diagnosis is None or summary.diagnosis.verdict not in _DIAGNOSES:
        return None
    level, reason = _DIAGNOSES[summary.diagnosis.verdict]
    return Verdict(level, "The diagnosis", reason)


_DIAGNOSES: Final[dict[str, tuple[Level, str]]] = {
    "ambiguous": ("care", "Something is missing, and several explanations remain."),
    "unexplained": ("care", "A force is missing that no known cause explains."),
    "not_adequate": (
        "bad",
        "The recording cannot tell whether something is missing, or the model does not describe it.",
    ),
}


def _speed_is_not_predicted(summary: Summary) -> Verdict | None:
    if summary.posture is None:
        return None
    half = summary.posture.second_half
    predicted, constant = half.speed_rms_mps, half.constant_speed_rms_mps
    if predicted is None or constant is None or predicted < constant:
        return None
    unknown = predicted > _UNPREDICTED * constant
    reason = (
        f"It misses the second half by {predicted:.1f} m/s; the first half's mean speed misses it by {constant:.1f}"
        ", so this recording does not identify friction."
    )
    return Verdict("bad" if unknown else "care", "The predicted speed", reason)


def _track_of_few_sensors(summary: Summary) -> Verdict | None:
    share, error = summary.trajectory.percent_of_length, summary.trajectory.mean_error_m
    if summary.posture is None or share is None or error is None or share <= MOST_OF_LENGTH:
        return None
    reason = (
        f"It leaves the GPS by {metres(error)} m on average, {share:.1f}\u00a0% of the path: "
        "the course is poorly known. Effective friction follows from speed and height along the measured path."
    )
    return Verdict("care", "The simulated path", reason)


def _moment(summary: Summary) -> Verdict | None:
    beyond = beyond_limits(summary)
    if not beyond or summary.posture is not None:  # a moment of an assumed posture measures only the assumptions
        return None
    figure = f"The {beyond[0]} of the residual moment" if len(beyond) == 1 else "The residual moment"
    return Verdict("care" if len(beyond) == 1 else "bad", figure, moment_sentence(summary))


def _closure(summary: Summary) -> Verdict | None:
    gap = summary.energy.closure_percent
    if gap is None or gap <= LEAST_CLOSURE:
        return None
    return Verdict(
        "care", "The energy balance", f"Its largest gap is {gap:.1f}\u00a0% of the turnover; 1\u00a0% is the limit."
    )


def _assumed(summary: Summary) -> Verdict | None:
    if summary.posture is None:
        return None
    return Verdict(
        "care", "The posture", "Most of it was assumed, so that joint angles, moments and load shares are too."
    )


def _not_fitted(summary: Summary) -> Verdict | None:
    if summary.fit.method is not None:
        return None
    return Verdict("care", "Friction", "It was not fitted: the model states it.")


CHECKS: Final[tuple[Callable[[Summary], Verdict | None], ...]] = (
    _stopped,
    _not_converged,
    _withheld,
    _missed,
    _beyond_priors,
    _diagnosed,
    _speed_is_not_predicted,
    _moment,
    _closure,
    _track_of_few_sensors,
    _assumed,
    _not_fitted,
)
"""Every check: it returns an objection, or None.  A new one is a function and a line here."""
