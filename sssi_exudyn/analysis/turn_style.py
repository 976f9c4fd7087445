"""Carving, skidding or wedge: probabilities from what few sensors show of a run or of a turn.

A multinomial logistic regression on three figures of the balance along the path (``path_balance``): effective
friction, slope and speed.  Skis that carve lose little at high speed; skidding brakes what the slope pulls; a wedge
does so at low speed.  Slope is among them because skiers hold their speed: by itself friction tells mostly the slope.
The probabilities are averages over the error of friction.

The coefficients are in ``turn_style.toml``; ``benchmarks/turns/turn_style.py`` makes them and shows how often they are
right.
"""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import Final

import numpy as np
import pandas as pd

from sssi_exudyn.core.frames import Array
from sssi_exudyn.fitting.few_sensors.path_balance import PathEstimate

STYLES: Final = ("carving", "skidding", "wedge")
FEATURES: Final = ("effective_friction", "slope", "log_speed")
_SHORTEST: Final = 8.0
"""s; a turn is judged with what is around it up to this: friction of single seconds is mostly noise."""
_LEAST_SPEED: Final = 0.5
"""m/s; whose logarithm is taken of slower ones."""
_POINTS, _WEIGHTS = np.polynomial.hermite_e.hermegauss(7)


@dataclass(frozen=True)
class StyleModel:
    """The regression: features' means and deviations (3,), and of each style an intercept (3,) and weights (3, 3)."""

    mean: Array
    deviation: Array
    intercept: Array
    weights: Array

    def probabilities(self, features: Array, friction_sigma: float = 0.0) -> Array:
        """Return the probabilities (3,) of ``STYLES`` for ``features`` (3,), averaged over friction's error."""
        moved = features + np.outer(friction_sigma * _POINTS, [1.0, 0.0, 0.0])
        scores = self.intercept + (moved - self.mean) / self.deviation @ self.weights.T
        odds = np.exp(scores - scores.max(axis=1, keepdims=True))
        return np.asarray(_WEIGHTS / _WEIGHTS.sum() @ (odds / odds.sum(axis=1, keepdims=True)))


@dataclass(frozen=True)
class StyleFigures:
    """Probabilities of a run's technique; ``most_likely`` is one of their names."""

    carving: float
    skidding: float
    wedge: float
    most_likely: str


@cache
def style_model() -> StyleModel:
    """Return the regression that comes with the program."""
    table = tomllib.loads((resources.files("sssi_exudyn.analysis") / "turn_style.toml").read_text(encoding="utf-8"))
    return StyleModel(
        mean=np.array([table["mean"][name] for name in FEATURES]),
        deviation=np.array([table["deviation"][name] for name in FEATURES]),
        intercept=np.array([table[style]["intercept"] for style in STYLES]),
        weights=np.array([[table[style][name] for name in FEATURES] for style in STYLES]),
    )


def style_features(path: PathEstimate, start: float = -np.inf, stop: float = np.inf) -> Array:
    """Return effective friction, slope (drop over distance) and the logarithm of the speed (m/s) of a stretch, (3,)."""
    middle = 0.5 * (path.time[1:] + path.time[:-1])
    inside = (middle >= start) & (middle <= stop)
    if not np.any(inside):
        inside = np.abs(middle - 0.5 * (start + stop)) == np.min(np.abs(middle - 0.5 * (start + stop)))
    along, slope = np.diff(path.distance)[inside], path.slope[inside]
    travelled = along * np.sqrt(1.0 + slope**2)
    speed = float(np.sum(along) / np.sum(np.diff(path.time)[inside]))
    return np.array(
        [
            float(np.average(path.friction[inside], weights=travelled)),
            -float(np.average(slope, weights=along)),
            np.log(max(speed, _LEAST_SPEED)),
        ]
    )


def style_of(path: PathEstimate) -> StyleFigures:
    """Return the technique of a run."""
    shares = style_model().probabilities(style_features(path), path.effective_sigma)
    carving, skidding, wedge = shares.tolist()
    return StyleFigures(carving, skidding, wedge, STYLES[int(np.argmax(shares))])


def add_styles(turns: pd.DataFrame, path: PathEstimate) -> pd.DataFrame:
    """Return the table of turns with the technique of each whole turn; phases of turns are too short to tell."""
    shares = np.full((len(turns), len(STYLES)), np.nan)
    for row, (phase, start, stop) in enumerate(zip(turns["phase"], turns["start_s"], turns["end_s"], strict=True)):
        if phase == "turn":
            more = max(0.0, 0.5 * (_SHORTEST - (stop - start)))
            shares[row] = style_model().probabilities(
                style_features(path, start - more, stop + more), path.effective_sigma
            )
    return turns.assign(**{f"technique_{style}": shares[:, i] for i, style in enumerate(STYLES)})
