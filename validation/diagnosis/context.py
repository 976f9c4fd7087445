"""A recording prepared for diagnosis: what stays fixed while hypotheses are compared, and priors."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np

from sssi_exudyn.core.advance import Advance, part_of, silent
from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.noise import ExponentialNoise, parts_in_cells
from sssi_exudyn.core.number_ref import CLOCK_OFFSET, STIFFNESS, NumberRef
from sssi_exudyn.fitting.changing_drag import responses_to_changing_drag
from sssi_exudyn.fitting.evidence import Freedom, fewer_columns
from sssi_exudyn.fitting.first_fit import problem_of
from sssi_exudyn.fitting.noise import HEIGHT_ORIGIN
from sssi_exudyn.fitting.objective import Problem, counts_of
from sssi_exudyn.fitting.observations import Measurements, measurements_of
from sssi_exudyn.fitting.parameters import (
    FREE,
    USUAL_CUFF,
    Parameter,
    antenna_numbers,
    drag_coefficient,
    insole_numbers,
    known_to_a_share,
    law_unknowns,
    lift_number,
    posture_errors,
    started_anywhere,
)
from sssi_exudyn.fitting.posture_errors import PostureError, PostureErrors
from sssi_exudyn.fitting.snow_surface import SurfaceProcess, on_snow_surface
from sssi_exudyn.model.faults import SENSORS, BootCuff
from sssi_exudyn.model.model import Model
from sssi_exudyn.motion.correction import correct_posture
from sssi_exudyn.motion.motion import Motion
from sssi_exudyn.recording.instruments.gps import Gps
from sssi_exudyn.recording.recording import Recording
from sssi_exudyn.recording.uncertainty import Uncertainty
from sssi_exudyn.runtime.cache import Cache, fingerprint
from sssi_exudyn.runtime.threads import both
from sssi_exudyn.simulation.assembly import Parts
from sssi_exudyn.simulation.reduced.derivatives import skier_mass_change
from sssi_exudyn.simulation.reduced.prepared import COARSE_STEP, Prepared, prepare
from sssi_exudyn.simulation.reduced.run import simulate_reduced
from sssi_exudyn.simulation.reduced.sensitivities import sensitivities
from sssi_exudyn.terrain.from_heights import TILTS
from sssi_exudyn.validation.diagnosis.hypotheses.catalogue import HYPOTHESES, LATENT_FORCE
from sssi_exudyn.validation.diagnosis.hypotheses.hypothesis import FittedRun, Hypothesis, probes_by, responses_of
from sssi_exudyn.validation.diagnosis.thresholds import THRESHOLDS, Thresholds


@dataclass(frozen=True)
class DiagnosisProblem:
    """A recording prepared for diagnosis.

    gps : the recording's fixes;  model : as it is given, on the snow surface that the heights show
    ground : the snow as a process, None on the plane;  prepared : the reduced model's tables; both as
        estimated
    parameters : what every fit has free, with priors;  fitting : the ordinary fit of the same recording
    key : of all of these, for the cache
    hypotheses : what is compared;  thresholds : the chosen numbers of the search
    """

    recording: Recording
    gps: Gps
    motion: Motion
    model: Model
    ground: SurfaceProcess | None
    parameters: tuple[Parameter, ...]
    prepared: Prepared
    measurements: Measurements
    fitting: Problem
    key: str
    progress: Advance
    cache: Cache | None
    hypotheses: tuple[Hypothesis, ...]
    thresholds: Thresholds = THRESHOLDS

    @property
    def about(self) -> Uncertainty:
        """Standard deviations of what the recording states."""
        return self.recording.uncertainty

    @property
    def errors(self) -> tuple[PostureError, ...]:
        """All ways in which the posture may be wrong."""
        return posture_errors(self.about, self.motion.start, self.motion.stop, self.motion.foot_sigma)

    def place(self, model: Model) -> tuple[Model, Array]:
        """Return the model on the surface that the heights show apart from what its own terms make of the snow, and the
        amounts (s,) of the surface's modes.
        """
        if self.ground is None:
            return model, np.zeros(0)
        surface = self.ground.without_terms_of(model)
        return replace(model, surface=surface), np.array(surface.amounts)

    def reporting(self, begin: float, end: float) -> DiagnosisProblem:
        """Return the same for a part of the work, whose progress goes from ``begin`` to ``end`` of this one's."""
        return replace(self, progress=part_of(self.progress, begin, end))

    def stamped_by(self, model: Model) -> Measurements:
        """Return the measurements as the model's clock has stamped them."""
        return self.measurements.stamped_by(model.start.clock_offset, self.motion.start, self.motion.stop)

    def with_residual(self, residual: Array) -> DiagnosisProblem:
        """Return the same with fixes that count less where a residual (n, 2) m is far off its neighbours'."""
        counts = counts_of(self.fitting.track, residual)
        return replace(
            self,
            measurements=replace(self.measurements, counts=counts),
            fitting=self.fitting.with_counts(counts),
            key=fingerprint(self.key, counts),
        )


def diagnosis_problem(
    recording: Recording,
    motion: Motion,
    model: Model,
    progress: Advance = silent,
    cache: Cache | None = None,
    *,
    hypotheses: Sequence[Hypothesis] = HYPOTHESES,
    thresholds: Thresholds = THRESHOLDS,
) -> DiagnosisProblem:
    """Prepare a recording.  Raises ValueError when it has no GPS."""
    if recording.gps is None:
        raise ValueError("the recording has no GPS")
    fitting = problem_of(recording, motion, on_snow_surface(model, recording, motion), "joint")
    model = fitting.model
    known = {name: prior for name, prior in fitting.priors.items() if name.part != "surface"}
    drag = drag_coefficient(model)
    of_drag = known_to_a_share(model, recording.uncertainty)[drag]
    # fitted and not linear, since a wind pushes in proportion to it: where nothing was said to be missing next to a
    # gust of 15 m/s the drag came out as a sixth, and about that the gust that fits had 33 m/s
    priors = {**FREE, **started_anywhere(known), **({drag: of_drag} if of_drag.sigma > 0.0 else {})}
    measurements = measurements_of(recording, model, motion.start, motion.stop)
    return DiagnosisProblem(
        recording=recording,
        gps=recording.gps,
        motion=motion,
        model=model,
        ground=None,
        parameters=tuple(Parameter((name,), prior) for name, prior in priors.items()),
        prepared=prepare(model, motion, step=COARSE_STEP),
        measurements=measurements,
        fitting=fitting,
        key=fingerprint(
            model,
            motion,
            measurements.measured,
            measurements.counts,
            recording.uncertainty,
            recording.snow,
        ),
        progress=progress,
        cache=cache,
        hypotheses=tuple(hypotheses),
        thresholds=thresholds,
    )


@dataclass(frozen=True)
class Nuisances:
    """What may vary in addition to a fit's parameters, linearised about a run.

    free : instruments and skier;  posture : (N, c) errors of the posture;  surface : (N, s) modes of the snow, the
        plane's tilt first;  force : (N, k) the force that every explanation has; each for a usual one
    mean : (N,) what is added to the prediction of the run for one of what is most probable beforehand, but for the
        waves of the snow
    """

    free: Freedom
    posture: Array
    surface: Array
    force: Array
    mean: Array

    @property
    def fixed(self) -> Freedom:
        """Effects of instruments and skier, and the plane's tilt: what no noise level makes larger."""
        tilt = self.surface[:, :TILTS]
        return self.free.with_more(tilt, np.ones(tilt.shape[1]))

    @property
    def sized(self) -> dict[str, Array]:
        """Effects that a noise level makes larger, by its name; of the snow the waves alone, not the plane's tilt."""
        return {"posture": self.posture, "surface": self.surface[:, TILTS:], "force": self.force}


def no_nuisances(size: int) -> Nuisances:
    """Return nuisances that are none, for ``size`` measurements."""
    none = np.zeros((size, 0))
    return Nuisances(Freedom(none, np.zeros(0)), none, none, none, np.zeros(size))


def nuisances_of(problem: DiagnosisProblem, model: Model, sizes: Array, sought: Collection[NumberRef]) -> Nuisances:
    """Linearise what may vary about a run of ``model``, corrected by errors of posture and mass of ``sizes`` (m,);
    numbers that are ``sought`` with a prior of their own are as they should be.

    Raises SimulationDiverged when it cannot be simulated.
    """
    measurements, prepared, about = problem.measurements, problem.prepared, problem.about
    run = simulate_reduced(model, prepared)
    fitted = FittedRun(
        model, prepared, run, measurements, measurements.predict(model, run), thresholds=problem.thresholds
    )
    size = len(measurements.measured)
    height = np.zeros(size)
    height[measurements.blocks["height"]] = 1.0
    stated = problem.model
    numbers = {
        CLOCK_OFFSET: about.clock,
        STIFFNESS: known_to_a_share(stated, about)[STIFFNESS].sigma,
        **lift_number(stated, about),
    }
    moved = [0.0 if name in sought else model.value(name) - stated.value(name) for name in numbers]
    laws = [unknown for unknown in law_unknowns(stated, about) if model.value(unknown.name) > 0.0]
    moved += [unknown.of(model) - unknown.prior.mean for unknown in laws]
    numbers |= {unknown.name: unknown.prior.sigma for unknown in laws}
    waves = () if model.surface is None else model.surface.names
    every = problem.errors
    errors = PostureErrors(Parts(model, correct_posture(problem.motion, model.posture)), prepared, every)
    changes = [*(errors.change(error) for error in every), skier_mass_change(model, problem.motion, prepared)]
    problem.progress(None, f"{len(every)} possible errors of the posture, {len(waves)} of the snow surface")
    instruments = antenna_numbers(about) | insole_numbers(about)
    parts = {kind.name: kind() for kind in SENSORS}
    probes = [probe for name in instruments for probe in probes_by(model, parts[name.owner], [name.key])]

    def responses_to_parts() -> tuple[Array, Array, Array]:
        """Return those to instruments, to a changing drag area and to the force that every explanation has."""
        by_drag = responses_to_changing_drag(model, prepared, measurements.predict, about.drag_area_wander, size)
        return responses_of(probes, prepared, measurements), by_drag, _null_force(fitted)

    columns, (by_instrument, by_drag, force) = both(  # on a core each
        lambda: sensitivities(model, prepared, [*numbers, *waves], measurements.predict, changes)[1],
        responses_to_parts,
    )
    by_number, by_wave, by_error, by_mass = np.split(columns, np.cumsum([len(numbers), len(waves), len(every)]), axis=1)
    by_number[:, len(numbers) - len(laws) :] *= [unknown.slope(model) for unknown in laws]
    cuff = by_instrument[:, list(instruments).index(NumberRef.of(BootCuff.name, "share"))]
    usual_cuff = 0.0 if any(isinstance(sensor, BootCuff) for sensor in stated.sensors) else USUAL_CUFF
    scales = [HEIGHT_ORIGIN, *numbers.values(), about.mass, *instruments.values()]
    scales += [1.0] * by_drag.shape[1]
    free = Freedom(np.column_stack([height, by_number, by_mass, by_instrument, by_drag]), np.array(scales))
    mean = usual_cuff * cuff - by_number @ moved - by_error @ sizes[:-1] - about.mass * sizes[-1] * by_mass[:, 0]
    return Nuisances(free, fewer_columns(measurements, by_error), by_wave, force, np.asarray(mean))


def _null_force(fitted: FittedRun) -> Array:
    """Return (N, k) what the force that every explanation has does to the measurements, each column for a usual one;
    k is 0 where explanations have none.
    """
    usual = fitted.measurements.usual.null_force
    if usual is None:
        return np.zeros((len(fitted.prediction), 0))
    latent = responses_of(LATENT_FORCE.probes(fitted), fitted.prepared, fitted.measurements)
    one = parts_in_cells(fitted.time_edges, ExponentialNoise(usual.size, usual.memory), fitted.thresholds.cell)
    lower = np.kron(np.eye(len(LATENT_FORCE.keys)), one)
    return fewer_columns(fitted.measurements, latent @ lower)
