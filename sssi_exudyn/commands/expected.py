"""Rough durations of commands, which say them when they begin."""

from __future__ import annotations

from typing import Final

from sssi_exudyn.motion.motion import Motion
from sssi_exudyn.runtime.private_folder import cache_folder

_SECONDS: Final = {
    "simulate": 0.3,
    "simulate carving": 5.0,
    "fit": 5.0,
    "quick fit": 0.3,
    "fit few sensors": 0.2,
    "fit carving": 80.0,
    "diagnose": 16.0,
    "diagnose reduced": 11.0,
}
"""s of computing for each second of a run, on one core of a computer of 2024, force laws compiled."""
_COMPILING: Final = 90.0
"""s of computing that the force laws take once on a machine."""


def expected_seconds(command: str, motion: Motion) -> float:
    """Return roughly how many seconds a stage of a command takes."""
    computing = _SECONDS[command] * (motion.stop - motion.start)
    return computing + (0.0 if any(cache_folder().glob("__pycache__/*.nbc")) else _COMPILING)
