"""A recording prepared for diagnosis: what stays fixed while hypotheses are compared, and priors."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from sssi_exudyn.core.frames import Array
from sssi_exudyn.fitting.fit import problem_of
from sssi_exudyn.fitting.measurements import Measurements, measurements_of
from sssi_exudyn.fitting.objective import Prior
from sssi_exudyn.fitting.unknowns import FREE, USUAL_CUFF
from sssi_exudyn.model.model import Model
from sssi_exudyn.model.toml import model_to_dict
from sssi_exudyn.motion.motion import Motion
from sssi_exudyn.recording.recording import Recording
from sssi_exudyn.runtime.cache import Cache, fingerprint
from sssi_exudyn.simulation.reduced import Prepared, prepare
from sssi_exudyn.validation.diagnosis.evidence import Freedom
from sssi_exudyn.validation.diagnosis.refit import Parameter

Progress = Callable[[float | None, str], None]
"""Takes the share that is done, where it is known, and what is being done."""

_PLACE: Final = 3.0
_SPEED: Final = 2.0
"""m and m/s: priors of the start, so wide that the track alone decides; it is not counted beforehand too."""
CUFF: Final = Prior(USUAL_CUFF, 0.03)
"""Share of the load that a boot's cuff takes in an ordinary recording."""
_HEIGHT: Final = 0.3
"""m; the first fix, from which heights count, is no better known than that."""
_CLOCKS: Final = 0.005
"""s to which clocks of different instruments agree at best, and half a step of the reduced model."""
STEP: Final = 0.01
"""s; steps of the reduced model.  They move a run's path by a centimetre against short ones, evenly for all
explanations; what the full model predicts beyond is added to every prediction.
"""


@dataclass(frozen=True)
class DiagnosisProblem:
    """A recording prepared for diagnosis.

    parameters : what every fit has free, with priors;  prepared : the reduced model's tables of the motion
    key : of all of these, for the cache
    """

    motion: Motion
    model: Model
    parameters: tuple[Parameter, ...]
    prepared: Prepared
    measurements: Measurements
    key: str
    progress: Progress
    cache: Cache | None


def _silent(_share: float | None, _detail: str) -> None:
    pass


def diagnosis_problem(
    recording: Recording, motion: Motion, model: Model, progress: Progress = _silent, cache: Cache | None = None
) -> DiagnosisProblem:
    """Prepare a recording.  Raises ValueError when it has no GPS."""
    problem = problem_of(recording, motion, model, "joint")
    model = problem.model
    priors = dict(FREE)
    for name in problem.names:
        if name.startswith(("start.velocity", "start.f", "start.l")):
            priors[name] = Prior(model.value(name), _SPEED if "velocity" in name else _PLACE)
        elif name.startswith("start."):
            priors[name] = problem.priors[name]
    measurements = measurements_of(recording, model, motion.start, motion.stop)
    return DiagnosisProblem(
        motion=motion,
        model=model,
        parameters=tuple(Parameter((name,), priors[name]) for name in problem.names),
        prepared=prepare(model, motion, step=STEP),
        measurements=measurements,
        key=fingerprint(model_to_dict(model), motion, measurements.measured),
        progress=progress,
        cache=cache,
    )


def mounting_freedom(measurements: Measurements, sole: Array, later: Array) -> tuple[Freedom, Array]:
    """What varies with the instruments' mounting: the height's origin, the cuff's share and how well the clocks agree;
    and the mean effect (N,) of the cuff.

    sole : (m, 2) N, the soles' forces;  later : (N,) what changes when the GPS' clock is a second late
    """
    size = len(measurements.measured)
    height, cuff = np.zeros(size), np.zeros(size)
    height[measurements.blocks["height"]] = 1.0
    cuff[measurements.blocks["load"]] = -sole.sum(axis=1)
    cuff[measurements.blocks["difference"]] = -(sole[:, 0] - sole[:, 1])
    columns = np.column_stack([height, cuff, later])
    return Freedom(columns, np.array([_HEIGHT, CUFF.sigma, _CLOCKS])), CUFF.mean * cuff
