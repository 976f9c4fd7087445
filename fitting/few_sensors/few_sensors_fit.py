"""The fit of a recording of few sensors: friction from the balance along its path, confirmed by the reduced model.

Few sensors show how much energy a skier loses, not what the skis do.  So the balance (``path_balance``) estimates what
they show, with the model's own terms: gravity on the ground, the air's drag on the posture, the load square to the
slope.  The model then gets friction with which its own run loses as much: mu_t at the run's mean speed, and friction
that rises with speed as the skier brakes.  Friction across the ski, of which nothing is seen, stays at its prior.  Last
the run is led along the fixes (``led_run``).
"""

from __future__ import annotations

import time as clock
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from sssi_exudyn.contact.term import Term
from sssi_exudyn.contact.terms.friction_corrections import SpeedDependentFriction
from sssi_exudyn.core.advance import Advance, silent
from sssi_exudyn.core.choices import Method
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.frames import GRAVITY, Array
from sssi_exudyn.core.noise import ExponentialNoise
from sssi_exudyn.core.number_ref import MU_N, MU_T, NumberRef
from sssi_exudyn.core.quantity import quantities
from sssi_exudyn.fitting.few_sensors.led_run import Fixes, lead
from sssi_exudyn.fitting.few_sensors.path_balance import (
    PathData,
    PathEstimate,
    SecondHalf,
    estimate_path,
    predict_second_half,
)
from sssi_exudyn.fitting.first_fit import UNSTEERED, Fitted, noise_of, problem_of
from sssi_exudyn.fitting.noise import usual_levels
from sssi_exudyn.fitting.objective import counts_of
from sssi_exudyn.fitting.optimise import Optimum
from sssi_exudyn.fitting.snow_surface import BAROMETER
from sssi_exudyn.model.heading import REPLAY
from sssi_exudyn.model.model import Model
from sssi_exudyn.motion.motion import Motion
from sssi_exudyn.recording.few_sensors.course import velocity_of
from sssi_exudyn.recording.few_sensors.posture_model import CLEAR_LEAN
from sssi_exudyn.recording.instruments.gps import Gps
from sssi_exudyn.recording.recording import FILE, Recording
from sssi_exudyn.simulation.full.forces_numpy import ArrayLaws
from sssi_exudyn.simulation.heading import HEADING
from sssi_exudyn.simulation.reduced.prepared import COARSE_STEP, Prepared, ReducedRun, prepare
from sssi_exudyn.simulation.reduced.run import simulate_reduced

B: Final = NumberRef("speed_dependent_friction.b")
_RECEIVER: Final = (0.5, ExponentialNoise(4.0, 60.0))
"""Of a receiver's heights at most, however unsure it says it is: m that are independent, and a wander of 5 m from start
to end of a run (``few_sensors.complete`` has 5.7 m)."""
_SPEED: Final = (0.1, 0.3)
"""m/s; errors of speeds that receivers measure, of the best (Doppler, 0.03 to 0.2) and of telephones, which smooth."""
_OF_PLACES: Final = 1.0
"""m/s; the largest error of speeds that follow from places alone."""
_SPEED_SHARE: Final = 0.03
"""1/s; error of a speed over that of a place: 0.3 m/s where a telephone states 10 m."""
_ROUNDS: Final = 3
"""Reduced runs, each with mu_t corrected by what the one before was too fast: the third is within 2 % of the speed."""
_LEAST_HOLDING: Final = 0.005
"""s/m; friction by speed below which a correction of mu_t is not taken for larger than it is."""
_UNCONFIRMED: Final = 2.5
"""Standard deviations of the balance beyond which the simulated run does not confirm it: one run in eighty."""
_TURNED_FAR: Final = 1.0
"""rad; a posture that has to turn farther does not follow the fixes: no skis point so far from their path."""
_REASONS: Final = {True: "converged: the objective no longer changes", False: "stopped: too many iterations"}


@dataclass(frozen=True)
class FewSensorsFit:
    """The fit, the balance that it rests on, and the second half as the first predicts it.

    fitted : with the model whose run is led along the fixes
    steering : part of mu_t's standard deviation from skis that point farther into every turn than assumed
    confirmed : effective friction of the reduced model's run
    unled : (n, 2) m, measured less simulated place of the run that is not led, level frame
    """

    fitted: Fitted
    path: PathEstimate
    half: SecondHalf
    steering: float
    confirmed: float
    unled: Array

    @property
    def unled_fit(self) -> Fitted:
        """The fit with what its run misses before it is led: leading hides a misfit."""
        return replace(self.fitted, residual=self.unled)

    @property
    def unconfirmed(self) -> str:
        """Return why the reduced model's run does not confirm the balance, in one sentence; "" where it does."""
        path, posture = self.path, self.fitted.model.posture
        turned = np.zeros(1) if posture is None else np.abs(posture.angles[:, HEADING])
        if posture is not None and turned.max() > _TURNED_FAR:
            return (
                f"the simulated run cannot follow the fixes: at {posture.time[turned.argmax()]:.0f} s the posture would"
                f" have to turn by {np.degrees(_TURNED_FAR):.0f}° or more; compare the friction of the balance along"
                " the measured path"
            )
        if abs(self.confirmed - path.effective) < _UNCONFIRMED * path.effective_sigma:
            return ""
        return (
            f"the simulated run has effective friction {self.confirmed:.3f} and the balance along the measured path"
            f" {path.effective:.3f} ± {path.effective_sigma:.3f}: the receiver's course does not show the path that its"
            " speeds are of; compare the latter"
        )


def fit_few_sensors(
    recording: Recording, motion: Motion, model: Model, method: Method, progress: Advance = silent
) -> FewSensorsFit:
    """Return the fit of a recording of few sensors.

    Raises InputError where there are too few fixes for a balance, and SimulationDiverged when a simulation does.
    """
    begin = clock.perf_counter()
    problem = problem_of(recording, motion, model, "joint")
    model = replace(problem.model.with_values({MU_N: UNSTEERED.mean}), heading=REPLAY)
    prepared = prepare(model, motion, step=COARSE_STEP)
    data = path_data(recording, motion, model, prepared)
    try:
        path = estimate_path(data)
        half = predict_second_half(data, path)
    except ValueError as error:
        raise InputError(recording.folder / FILE, "[gps]", str(error), "give a longer run") from None
    progress(0.3, f"balance along the path: effective friction {path.effective:.3f} ± {path.effective_sigma:.3f}")
    model = replace(model, terms=holding_terms(model.terms, path))
    model, run = _as_fast(model, prepared, path)
    unled = problem.residual(model, run.time, run.antenna)
    progress(0.7, "reduced model: led along the fixes")
    model, run = lead(
        model,
        prepared,
        run,
        fixes_of(recording, data),
        lambda led, made: problem.residual(led, made.time, made.antenna),
    )
    confirmed = effective_friction(run)
    progress(0.9, f"reduced model: effective friction {confirmed:.3f}")
    steering = _steering(model, recording)
    residual = problem.residual(model, run.time, run.antenna)
    problem = problem.with_counts(counts_of(problem.track, residual))
    names, values = (MU_T, B), np.array([model.value(MU_T), model.value(B)])
    sigmas = np.array([np.hypot(path.effective_sigma, steering), path.holding_sigma / GRAVITY])
    optimum = Optimum(values, path.objective, path.iterations, path.converged, _REASONS[path.converged])
    fitted = Fitted(
        method=method,
        model=model,
        names=names,
        values=values,
        covariance=np.diag(sigmas**2),
        time=problem.track.time,
        residual=residual,
        noise=noise_of(problem, residual),
        optimum=optimum,
        reduced=replace(optimum, evaluations=_ROUNDS),
        wall=clock.perf_counter() - begin,
    )
    return FewSensorsFit(fitted, path, half, steering, confirmed, unled)


def _as_fast(model: Model, prepared: Prepared, path: PathEstimate) -> tuple[Model, ReducedRun]:
    """Return the model with that mu_t with which its run is as fast as the estimated one on average, and the run.

    Friction that rises by b with speed holds the run: more friction by b δ slows it by δ.
    """
    low, high = model.bounds(MU_T)
    mu_t, b = path.mu, max(model.value(B), _LEAST_HOLDING)
    longer = float(np.sqrt(1.0 + path.mean_slope**2))
    wanted = longer * float(np.mean(path.speed))
    for _ in range(_ROUNDS):
        model = model.with_values({MU_T: float(np.clip(mu_t, low, high))})
        run = simulate_reduced(model, prepared)
        mu_t = model.value(MU_T) + b * (float(np.mean(np.linalg.norm(run.com_velocity, axis=1))) - wanted)
    return model, run


def path_data(recording: Recording, motion: Motion, model: Model, prepared: Prepared) -> PathData:
    """Return what the recording shows along its path, and the model's drag and load on it.

    Raises ValueError when the recording has no GPS.
    """
    gps = recording.gps
    if gps is None:
        raise ValueError("the recording has no GPS")
    inside = gps.between(motion.start, motion.stop)
    stated = float(np.median(gps.sigma))
    speed = np.linalg.norm(velocity_of(gps), axis=1)[inside]
    height_sigma, wander = height_noise(gps, stated)
    return PathData(
        time=gps.time[inside],
        speed=speed,
        speed_sigma=speed_noise(gps, stated),
        height_time=gps.time[inside],
        height=gps.enu[inside, 2],
        height_sigma=height_sigma,
        wander=wander,
        load=float(np.cos(model.inclination)),
        drag=drag_of(model, prepared, float(np.mean(speed))),
    )


def fixes_of(recording: Recording, data: PathData) -> Fixes:
    """Return what the recording's run is led by, with the usual noise of such a receiver."""
    assert recording.gps is not None
    assert recording.completed is not None
    stated = float(np.median(recording.gps.sigma))
    noise = usual_levels(stated, stated, 1.0, 1.0).gps
    return Fixes(data.time, data.speed, data.speed_sigma, stated, noise, recording.completed.sigma.yaw)


def speed_noise(gps: Gps, stated: float) -> float:
    """Return the error of a speed, m/s; ``stated`` is the receiver's error of a place, m."""
    return float(np.clip(_SPEED_SHARE * stated, _SPEED[0], _OF_PLACES if gps.speed is None else _SPEED[1]))


def height_noise(gps: Gps, stated: float) -> tuple[float, ExponentialNoise]:
    """Return the independent and the slow error of heights; ``stated`` is the receiver's error of a place, m."""
    if gps.barometric:
        return BAROMETER
    independent, wander = _RECEIVER
    vertical = gps.vertical * stated
    return min(independent, vertical), replace(wander, sigma=min(wander.sigma, vertical))


def drag_of(model: Model, prepared: Prepared, speed: float) -> float:
    """Return drag over mass and squared speed, 1/m: the model's laws of the air at that speed, mean over the run."""
    laws = ArrayLaws(model.terms)
    every = slice(0, None, max(1, round(1.0 / prepared.step)))
    forward = prepared.foot_rotation[every, :, :, 0].mean(axis=1)
    forward /= np.linalg.norm(forward, axis=1, keepdims=True)
    shares = []
    for time, ahead, own, facing in zip(
        prepared.time[every], forward, prepared.exposed_velocity[every], prepared.exposed_facing[every], strict=True
    ):
        force = laws.segments(float(time), 0.0, 0.0, speed * ahead + own, prepared.area, facing)
        shares.append(-float(np.sum(force, axis=0) @ ahead))
    return float(np.mean(shares)) / (prepared.mass * max(speed, 1.0) ** 2)


def holding_terms(terms: Sequence[Term], path: PathEstimate) -> tuple[Term, ...]:
    """Return the terms with friction that rises with speed as the skier brakes, unless they have such friction."""
    if any(isinstance(term, SpeedDependentFriction) for term in terms):
        return tuple(terms)
    longer = float(np.sqrt(1.0 + path.mean_slope**2))
    most = quantities(SpeedDependentFriction)["b"].high
    return (*terms, SpeedDependentFriction(min(path.holding / (GRAVITY * longer), most), path.mean_speed * longer))


def effective_friction(run: ReducedRun) -> float:
    """Return the work of the snow's friction over the path of the load: the loss of a sledge of that friction."""
    power = np.sum(run.foot_friction * run.foot_velocity, axis=(1, 2))
    load_speed = np.sum(run.foot_load * np.linalg.norm(run.foot_velocity, axis=2), axis=1)
    return -float(np.sum(power) / np.sum(load_speed))


def _steering(model: Model, recording: Recording) -> float:
    """Return friction that turns into skidding where skis point by a standard deviation farther into every turn than
    assumed: along the ski it would then be missing.
    """
    assert recording.completed is not None
    turning = float(np.mean(np.abs(np.tanh(recording.completed.lean / CLEAR_LEAN))))
    return model.value(MU_N) * float(np.sin(recording.completed.sigma.yaw)) * turning
