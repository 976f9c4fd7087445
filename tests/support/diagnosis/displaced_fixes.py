"""A bundled run with fixes displaced to the path that further terms would have caused."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from bundled import bundled

from sssi_exudyn.contact.term import Term
from sssi_exudyn.core.frames import level_to_enu
from sssi_exudyn.fitting.first_fit import fit_reduced, problem_of
from sssi_exudyn.fitting.observations import predict_fixes
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.motion.motion import Motion
from sssi_exudyn.recording.recording import Recording
from sssi_exudyn.simulation.reduced.prepared import prepare
from sssi_exudyn.simulation.reduced.run import simulate_reduced
from sssi_exudyn.simulation.result import SimulationResult


def displaced_by(
    name: str, start: float, stop: float, terms_of: Callable[[SimulationResult], Sequence[Term]]
) -> tuple[Recording, Motion]:
    """Return the recording ``examples/name`` between two times (s), displaced by further terms.

    The terms follow from its fitted run.
    """
    recording, motion = bundled(name)
    assert recording.gps is not None
    motion = replace(motion, start=start, stop=stop)
    problem = problem_of(recording, motion, model_of(recording, motion), "joint")
    prepared = prepare(problem.model, motion)
    fixes, model = recording.gps.time, problem.model_at(fit_reduced(problem, prepared).values)
    before = simulate_reduced(model, prepared)
    more = replace(model, terms=(*model.terms, *terms_of(before)))
    after = simulate_reduced(more, prepared)
    places = [predict_fixes(at, run.time, run.antenna, fixes) for at, run in ((model, before), (more, after))]
    moved = np.where((fixes < motion.stop)[:, None], places[1] - places[0], 0.0)
    enu = recording.gps.enu + moved @ level_to_enu(model.fall_line_azimuth).T
    return replace(recording, gps=replace(recording.gps, enu=enu)), motion
