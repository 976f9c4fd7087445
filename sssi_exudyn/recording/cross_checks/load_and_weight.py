"""The loads under the feet against the skier's weight."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from sssi_exudyn.core.frames import GRAVITY
from sssi_exudyn.recording.cross_checks.check import Evidence, Finding

_USUAL: Final = (0.1, 3.0)
"""Mean load over weight, at least and at most: boots' cuffs carry part of the weight, never nine tenths, and turns
add less than that again.
"""
_LIGHT: Final = 0.35
"""Mean load over weight below which another unit is a better explanation than the cuffs."""
_NEAR: Final = 0.25
"""Relative distance from the weight of skier and equipment within which a load of another unit explains it."""


class LoadAndWeight:
    """Loads in kilograms, pounds, or percent of the weight."""

    compares = "mean load under both feet with the weight of skier, boots and skis"

    def judge(self, evidence: Evidence) -> Sequence[Finding]:
        """Return a sure finding where loads in another unit are the weight, a doubt where none explains them."""
        insoles = evidence.insoles
        if insoles is None:
            return ()
        mass, gear = evidence.skier.mass, evidence.equipment
        load = float(np.mean(insoles.left + insoles.right))
        weight = (mass + 2.0 * (gear.boot_mass + gear.ski_mass)) * GRAVITY
        units = {
            "kilograms": GRAVITY,
            "percent of the weight": 0.01 * mass * GRAVITY,
            "pounds": 0.45359 * GRAVITY,
            "kilonewtons": 1000.0,
            "parts of the weight": mass * GRAVITY,
        }
        unit = min(units, key=lambda name: abs(np.log(max(load, 1e-9) * units[name] / weight)))
        seen = load / (mass * GRAVITY)
        path, place = evidence.files["insoles"], "columns of forces"
        if seen < _LIGHT and abs(load * units[unit] / weight - 1.0) < _NEAR:
            problem = f"both feet carry {load:.3g} on average, {seen:.2g} times the weight: that looks like {unit}"
            fix = f"convert the forces to newtons (times {units[unit]:.4g}), or leave [insoles] out"
            return (Finding(path, place, problem, fix, sure=True),)
        if _USUAL[0] < seen < _USUAL[1]:
            return ()
        problem = f"the feet carry {seen:.2g} times the skier's weight on average"
        return (Finding(path, "", problem, "check the unit (newtons)"),)
