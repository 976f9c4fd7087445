"""Two passes of one slope in the benchmark's world: both meet effects of a place, one alone those of a time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
import pymap3d

from sssi_exudyn.core.errors import SimulationDiverged
from sssi_exudyn.model.from_recording import first_guess
from sssi_exudyn.model.model import Model
from sssi_exudyn.motion.motion import Motion
from sssi_exudyn.recording.instruments.gps import enu_from
from sssi_exudyn.recording.recording import Recording
from sssi_exudyn.simulation.full.run import simulate
from sssi_exudyn.validation.benchmark.balanced_skier import balance_skier
from sssi_exudyn.validation.benchmark.cases import Recorded, record
from sssi_exudyn.validation.benchmark.effects import EFFECTS, plain_run
from sssi_exudyn.validation.benchmark.world import draw_instruments, other_day
from sssi_exudyn.validation.diagnosis.context import diagnosis_problem
from sssi_exudyn.validation.diagnosis.hypotheses.catalogue import BY_NAME, HYPOTHESES
from sssi_exudyn.validation.diagnosis.hypotheses.hypothesis import Hypothesis
from sssi_exudyn.validation.diagnosis.search.compare_hypotheses import compare_hypotheses
from sssi_exudyn.validation.diagnosis.search.explanation import Refitted
from sssi_exudyn.validation.diagnosis.search.reestimate_rivals import estimate_rivals
from sssi_exudyn.validation.diagnosis.search.search_result import Accepted, SearchEnd
from sssi_exudyn.validation.diagnosis.state import first_fit, linear_model

_ATTEMPTS: Final = 10
_FASTER: Final = (0.08, 0.18)
"""Share by which the second pass begins faster or slower."""
_BESIDE: Final = 2.0
"""m; greatest distance of its begin from the first one's, down and across the fall line."""


@dataclass(frozen=True)
class Passes:
    """Two passes of one slope, and the times (s) between which the hidden effect acts on the first."""

    first: Recorded
    second: Recorded
    window: tuple[float, float] | None


def two_passes(name: str, size: float, base: Recorded, seed: int, *, long: float = 6.0) -> Passes:
    """Make two passes over the same snow with the effect of that name and size, from a stretch of ``base``, ``long`` s.

    The second pass has the same movement and begins faster or slower; its fixes count from its own first one.

    Raises SimulationDiverged when none of ten stretches can be simulated.
    """
    for attempt in range(_ATTEMPTS):
        try:
            return _draw(name, size, base, np.random.default_rng([seed, 2, attempt]), long)
        except SimulationDiverged as error:
            failure = error
    raise failure


def _draw(name: str, size: float, base: Recorded, rng: np.random.Generator, long: float) -> Passes:
    recording, motion, fitted = base
    begin = float(rng.uniform(motion.start, motion.stop - long))
    stated = replace(motion, start=begin, stop=begin + long)
    snow, skied = other_day(rng, recording, stated, fitted)
    effect = EFFECTS[name](rng, size, plain_run(simulate(replace(snow, solver=replace(snow.solver, step=0.01)), skied)))
    hidden = replace(snow, terms=(*snow.terms, *effect.terms))
    start, faster = snow.start, 1.0 + float(rng.choice([-1.0, 1.0]) * rng.uniform(*_FASTER))
    offset = rng.uniform(-_BESIDE, _BESIDE, 2)
    second_world = replace(hidden if BY_NAME[name].comes_again else snow, start=replace(
        start, f=start.f + float(offset[0]), l=start.l + float(offset[1]),
        velocity_f=faster * start.velocity_f, velocity_l=faster * start.velocity_l,
    ))  # fmt: skip
    passes = []
    for world in (hidden, second_world):
        instruments = draw_instruments(rng, skied)
        balanced = balance_skier(world, skied, recording)
        passes.append(record(rng, (recording, stated, fitted), balanced, world, instruments, 0.0, 0.0))
    return Passes(passes[0], _from_its_first_fix(*passes[1]), effect.window)


def first_finding(made: Recorded, hypotheses: Sequence[Hypothesis] = HYPOTHESES) -> SearchEnd:
    """Do the first round of a search among ``hypotheses``, by the reduced model; later findings are left out."""
    problem, state, fit = first_fit(diagnosis_problem(*made, hypotheses=hypotheses))
    searched, allowed = compare_hypotheses(problem, state, fit), problem.thresholds.stands_out
    if searched.nothing.probability > allowed or not isinstance(searched.best, Refitted):
        return SearchEnd(problem, state, fit, (), full=False)
    searched, estimates = estimate_rivals(problem, state, searched, full=False)
    best = searched.best
    if searched.nothing.probability > allowed or not isinstance(best, Refitted) or best.name not in estimates:
        return SearchEnd(problem, state, fit, (), full=False)
    about = estimates[best.name]
    accepted = Accepted(searched, best, about.fit, linear_model(about.problem, about.state, about.fit))
    return SearchEnd(about.problem, about.state, about.fit, (accepted,), full=False)


def _from_its_first_fix(recording: Recording, motion: Motion, model: Model) -> Recorded:
    """Return the same run as read from a file whose fixes begin with it."""
    gps = recording.gps
    assert gps is not None
    latitude, longitude, height = (float(x) for x in pymap3d.enu2geodetic(*gps.enu[0], *gps.origin))
    origin = latitude, longitude, height
    gps = replace(gps, enu=enu_from(gps.enu, gps.origin, origin), origin=origin)
    start = first_guess(gps, motion, model.inclination, model.fall_line_azimuth)
    return replace(recording, gps=gps), motion, replace(model, start=start)
