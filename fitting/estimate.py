"""The whole fit of a recording: friction from the track, then all that is uncertain with all that is measured."""

from __future__ import annotations

import itertools
import time as clock
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from sssi_exudyn.core.advance import Advance, part_of, silent
from sssi_exudyn.core.choices import Method
from sssi_exudyn.core.errors import SimulationDiverged
from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.number_ref import VELOCITY_F, VELOCITY_L, NumberRef
from sssi_exudyn.fitting.first_fit import Fitted, fit, with_surface
from sssi_exudyn.fitting.linearised_run import Setting
from sssi_exudyn.fitting.objective import Prior, Problem, counts_of
from sssi_exudyn.fitting.observations import observation_of
from sssi_exudyn.fitting.parameters import (
    FIRST_COMPLIANCE,
    Parameter,
    posture_errors,
    unknown_numbers,
    with_unknown_parts,
)
from sssi_exudyn.fitting.posterior import Posterior, find_posterior
from sssi_exudyn.fitting.posture_errors import fast_errors
from sssi_exudyn.fitting.snow_surface import SurfaceProcess
from sssi_exudyn.model.from_recording import VELOCITY_SIGMA
from sssi_exudyn.model.legs import USUAL_COMPLIANCE
from sssi_exudyn.model.model import PRESETS, Model
from sssi_exudyn.motion.motion import Motion
from sssi_exudyn.recording.recording import Recording
from sssi_exudyn.runtime.cache import Cache, fingerprint
from sssi_exudyn.simulation.full.run import simulate

_UNSURE: Final = 1.0
"""m/s by which the velocity at the start may be wrong before the search begins at several."""
_APART: Final = 1.3
"""Standard deviations between these."""
_FIRST_SHARE: Final = 0.15
"""Share of the computing that the first fit takes, roughly."""


@dataclass(frozen=True)
class Estimated:
    """The fit as others see it, and all that is known after it."""

    fitted: Fitted
    posterior: Posterior


@dataclass(frozen=True)
class JudgingRun:
    """What instruments see of a run of the full model: times (n,) s, antenna (n, 3) m, the soles' forces (n, 2) N."""

    time: Array
    antenna: Array
    sole_force: Array


def is_estimated(recording: Recording, method: Method) -> bool:
    """Return whether a fit by that method estimates all that is uncertain, and not friction, start and heading alone.
    The paper's does not, nor one of few sensors, whose posture is mostly assumed: ``few_sensors_fit`` is theirs.
    """
    return method == "joint" and recording.completed is None


def estimate(
    problem: Problem,
    recording: Recording,
    motion: Motion,
    *,
    full: bool = True,
    comparing: bool = False,
    process: SurfaceProcess | None = None,
    cache: Cache | None = None,
    progress: Advance = silent,
) -> Estimated:
    """Solve the problem with the reduced model, then estimate all that is uncertain, ``full`` or not judged by the full
    model.  An estimate for ``comparing`` hypotheses uses what these are compared by: instruments, each reading at its
    word, not the moment about the pelvis; the snow surface is a ``process`` then, of which heights are a measurement
    among others.  Intermediate results are kept in ``cache``.

    A heading that is to be found is so only once all else is estimated with the captured one: by then snow and posture
    agree on most of it.

    Raises SimulationDiverged when a simulation does.
    """
    begin = clock.perf_counter()
    first = fit(problem, motion, "joint", full=False, coarse=True, cache=cache, progress=progress)
    progress(_FIRST_SHARE, "")
    counted = problem.with_counts(counts_of(problem.track, first.residual))
    model, known, heading = _on_process(first.model, process), None, problem.model.heading
    heights, others = process is not None and model.surface is not None, other_starts(problem, recording)
    again = heading.is_found or bool(others)
    shares = np.linspace(_FIRST_SHARE, 1.0, (3 if again else 2) + len(others))
    parts = iter([part_of(progress, *ends) for ends in itertools.pairwise(shares.tolist())])

    def roughly(model: Model) -> Posterior:
        return estimate_from(
            model, with_surface(counted, model), recording, motion,
            full=False, comparing=comparing or bool(others), heights=heights, progress=next(parts),
        )  # fmt: skip

    if again:
        known = roughly(model)
        for i, other in enumerate(others, start=2):
            progress(None, f"start {i} of {len(others) + 1}: coarse fixes leave the velocity there open")
            try:
                coarse = fit(other, motion, "joint", full=False, coarse=True, cache=cache, progress=progress)
                known = max(
                    known, roughly(_on_process(coarse.model, process)), key=lambda posterior: posterior.log_evidence
                )
            except SimulationDiverged:
                continue
        model = replace(known.model, heading=heading)
    posterior = estimate_from(
        model, with_surface(counted, model), recording, motion,
        known=known, full=full, comparing=comparing, heights=heights, cache=cache, progress=list(parts)[-1],
    )  # fmt: skip
    seen, setting = posterior.setting.seen, posterior.setting
    x, y = (posterior.residual[seen.blocks[name]] for name in ("x", "y"))
    fitted = replace(
        first,
        model=posterior.model,
        names=setting.names,
        values=posterior.numbers,
        covariance=posterior.covariance_of_numbers,
        residual=np.stack([x, y], axis=1),
        noise=posterior.levels.gps,
        optimum=posterior.optimum,
        wall=clock.perf_counter() - begin,
    )
    return Estimated(fitted, posterior)


def _on_process(model: Model, process: SurfaceProcess | None) -> Model:
    """Return the model with its snow surface as a ``process``, where there is one."""
    if process is None or model.surface is None:
        return model
    return replace(model, surface=process.at(model.surface).surface)


def other_starts(problem: Problem, recording: Recording) -> list[Problem]:
    """Return the problem begun at other velocities, where coarse fixes leave these open and loads are measured.  Loads
    know the run's turns so well that no small step leads to a velocity that is metres a second away.
    """
    names = (VELOCITY_F, VELOCITY_L)
    if recording.insoles is None or problem.priors[names[0]].sigma < _UNSURE:
        return []
    others = []
    for moved in names:
        for way in (_APART, -_APART):
            values = {name: problem.priors[name].mean for name in names}
            values[moved] += way * problem.priors[moved].sigma
            held = {name: Prior(value, VELOCITY_SIGMA) for name, value in values.items()}
            others.append(replace(problem, model=problem.model.with_values(values), priors={**problem.priors, **held}))
    return others


def estimate_from(
    model: Model,
    problem: Problem,
    recording: Recording,
    motion: Motion,
    *,
    more: Mapping[tuple[NumberRef, ...], Prior] | None = None,
    known: Posterior | None = None,
    full: bool = True,
    comparing: bool = False,
    heights: bool = False,
    cache: Cache | None = None,
    progress: Advance = silent,
) -> Posterior:
    """Estimate all that is uncertain, from the numbers that the model has; with ``more`` numbers, or with other priors
    of the usual ones, by their names (several move together).  ``known`` is an estimate by whose errors of posture and
    mass the model is corrected already; ``comparing`` as in ``estimate``; ``heights`` are measured where the surface is
    a process.

    Raises SimulationDiverged when a simulation does.
    """
    model, setting = setting_of(model, problem, recording, motion, more, balanced=not comparing, heights=heights)
    seen = setting.seen

    def by_full_model(model: Model) -> Array:
        run = judging_run(model, motion, cache)
        predicted = np.zeros(len(seen.measured))
        predicted[: seen.moments.start] = seen.predict_instruments(model, run.time, run.antenna, run.sole_force)
        return predicted

    judge = by_full_model if full else None
    return find_posterior(model, setting, judge, progress, known, comparing=comparing)


def setting_of(
    model: Model,
    problem: Problem,
    recording: Recording,
    motion: Motion,
    more: Mapping[tuple[NumberRef, ...], Prior] | None = None,
    *,
    balanced: bool = True,
    heights: bool = False,
) -> tuple[Model, Setting]:
    """The model with the parts whose numbers are sought along, and what is sought with what is measured, as
    ``observation_of`` has it; priors and what each fix counts are the problem's, those of ``more`` come before.
    """
    stated = with_unknown_parts(problem.model, recording, compliance=USUAL_COMPLIANCE if balanced else 0.0)
    model = with_unknown_parts(model, recording, compliance=FIRST_COMPLIANCE if balanced else 0.0)
    about = recording.uncertainty
    usual = {unknown.names: unknown for unknown in unknown_numbers(stated, problem.priors, recording)}
    given = {names: Parameter(names, prior) for names, prior in (more or {}).items()}
    fast = fast_errors(about.foot_yaw_fast if balanced else 0.0, motion.start, motion.stop)
    return model, Setting(
        motion=motion,
        seen=observation_of(recording, model, motion, problem.counts, balanced=balanced, heights=heights),
        unknowns=tuple({**usual, **given}.values()),
        errors=(*posture_errors(about, motion.start, motion.stop), *fast),
        mass=(recording.skier.mass, about.mass),
        changing_drag=about.drag_area_wander,
    )


def judging_run(model: Model, motion: Motion, cache: Cache | None) -> JudgingRun:
    """Simulate with the full model, fast, kept in ``cache``.  Raises SimulationDiverged when it does."""
    fast = PRESETS["fast"]
    elements = min(model.solver.elements, fast.elements)
    model = replace(model, solver=replace(model.solver, step=fast.step, elements=elements))

    def run() -> dict[str, Array]:
        result = simulate(model, motion)
        assert result.antenna is not None
        return {"time": result.time, "antenna": result.antenna, "sole": result.sole_force}

    key = fingerprint("full run", model, motion)
    shapes = {"time": (None,), "antenna": (None, 3), "sole": (None, 2)}
    kept = cache.get_or_make(key, run, shapes) if cache else run()
    return JudgingRun(*(np.asarray(kept[name], dtype=np.float64) for name in shapes))
