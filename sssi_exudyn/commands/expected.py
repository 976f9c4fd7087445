"""How long commands take, roughly, to say so when they begin."""

from __future__ import annotations

from typing import Final

from sssi_exudyn.motion.motion import Motion
from sssi_exudyn.recording.recording import Recording
from sssi_exudyn.runtime.private_folder import cache_folder

_SECONDS: Final = {"simulate": 0.3, "fit": 5.0, "diagnose": 25.0, "diagnose reduced": 20.0}
"""s of computing for each second of a run, on one core of a computer of 2024, force laws compiled."""
_FEW_SENSORS: Final = 0.2
"""Of that, for a recording of few sensors, whose coarse steps and free posture are less work."""
_COMPILING: Final = 90.0
"""s of computing that the force laws take once on a machine."""


def expected_seconds(command: str, recording: Recording, motion: Motion) -> float:
    """About how many seconds a stage of a command takes."""
    found = _SECONDS[command] * (motion.stop - motion.start)
    if recording.completed is not None and command == "fit":
        found *= _FEW_SENSORS
    return found + (0.0 if any(cache_folder().glob("__pycache__/*.nbc")) else _COMPILING)
