"""A skier who balances: on other snow, slope or weight he changes his posture until no moment is left over.

A recorded movement balances the forces of its own run.  Under other forces, a steady moment of 20 to 50 N m would
remain.  No real skier leaves such a moment, and an estimate rightly takes it for evidence about friction.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from sssi_exudyn.fitting.linearised_run import Setting, linearise_at
from sssi_exudyn.fitting.observations import observation_of
from sssi_exudyn.fitting.posture_errors import errors_of, grown
from sssi_exudyn.model.model import Model
from sssi_exudyn.motion.correction import correct_posture
from sssi_exudyn.motion.motion import Motion
from sssi_exudyn.recording.recording import Recording

_DEGREE: Final = np.radians(1.0).item()
_MOVES: Final = {
    "forward": (0.05, 0.02),
    "height": (0.005, 0.003),
    "yaw": (_DEGREE, 0.5 * _DEGREE),
    "trunk_sideways": (2.0 * _DEGREE, _DEGREE),
}
"""m or rad by which each part is moved, standing and within seconds: feet under the body first."""
_LEFT: Final = 10.0
"""N m; residual moment of a balanced skier: the independent world's leave 11 to 25 (root mean square of three axes)."""
_ROUNDS: Final = 2
_NO_MASS: Final = 1e-9
"""kg; the skier does not balance by his mass."""


def balance_skier(model: Model, motion: Motion, recording: Recording) -> Motion:
    """Return the movement of a skier who balances the forces of that model's run.

    The model has no corrections of posture.

    Raises SimulationDiverged when the model cannot be simulated.
    """
    assert recording.gps is not None
    time = recording.gps.time
    counts = np.ones(np.count_nonzero((time >= motion.start - 1e-9) & (time <= motion.stop + 1e-9)))
    seen = observation_of(recording, model, motion, counts)
    setting = Setting(motion, seen, (), errors_of(_MOVES, motion.start, motion.stop), (model.skier.mass, _NO_MASS))
    for _ in range(_ROUNDS):
        point, responses = linearise_at(model, setting)
        residual, by_move = point.predicted[seen.moments] / _LEFT, responses.by_error[seen.moments, :-1] / _LEFT
        sizes = -by_move.T @ np.linalg.solve(by_move @ by_move.T + np.eye(len(residual)), residual)
        change = responses.posture.angles(sizes)
        model = replace(model, posture=grown(model.posture, responses.posture.time, change))
    return correct_posture(motion, model.posture)
