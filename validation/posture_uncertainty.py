"""Uncertainty of a fit from a posture that is mostly assumed and a slope that is estimated.

It also predicts the rest of a run that was fitted over its first half alone.

Skis that point farther into every turn than assumed skid, and skidding brakes: μ_n |sin β| at a steering angle β.
Where it is not measured, skidding cannot be distinguished from friction along the ski.  Their sum, the effective
friction along the path, can be estimated.

Every possible error of the feet shifts the fitted numbers: where it moves the simulated track by r, by −H⁻¹ w ∫
(∂x/∂θ)ᵀ r dt, with H the objective's curvature.  The shifts, each times its standard deviation, add up in squares.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Final

import numpy as np

from sssi_exudyn.core.frames import Array
from sssi_exudyn.fitting.first_fit import COARSE_STEP, Fitted, fit_reduced
from sssi_exudyn.fitting.objective import Problem
from sssi_exudyn.fitting.observations import Track
from sssi_exudyn.model.model import Model
from sssi_exudyn.motion.motion import Motion
from sssi_exudyn.recording.few_sensors.complete import Completed
from sssi_exudyn.recording.few_sensors.posture_model import CLEAR_LEAN
from sssi_exudyn.recording.instruments.gps import Gps
from sssi_exudyn.simulation.reduced.prepared import Prepared, ReducedRun, prepare
from sssi_exudyn.simulation.reduced.run import simulate_reduced
from sssi_exudyn.simulation.reduced.sensitivities import sensitivities
from sssi_exudyn.validation.capture_error import CaptureError, with_error

_SPANS: Final = 6
"""Number of stretches of a run, each with its own error of an assumption; an error that lasts longer moves a track
more.
"""
_PROBE: Final = 0.1
"""Size of a tried error, as a share of its standard deviation."""
_SKID_PROBE: Final = 0.5
"""Size of a tried skid, in standard deviations: skidding acts from a degree on only, as friction across is smooth."""
_SIGNS: Final = {"roll": (1.0, 1.0), "pitch": (1.0, 1.0), "yaw": (1.0, 1.0), "height": (0.5, -0.5)}
"""Signs for the left and the right foot: skis have the same error, heights opposite ones."""


@dataclass(frozen=True)
class Shares:
    """Standard deviations (k,) of the fitted numbers by source, and their sum as a covariance (k, k).

    track : noise of the fixes;  posture : errors of the feet that vary;  slope : error of its inclination
    steering : skis that point farther into every turn than assumed
    effective : friction's work over the load's path, both of the fitted run
    """

    track: Array
    posture: Array
    slope: Array
    steering: Array
    covariance: Array
    effective: float


@dataclass(frozen=True)
class _Turning(CaptureError):
    """An error that follows the turns: ``turning`` (m,), between −1 and 1, at ``at`` (m,) s."""

    at: Array
    turning: Array

    def profile(self, time: Array) -> Array:
        return np.interp(time, self.at, self.turning)


@dataclass(frozen=True)
class SecondHalf:
    """A run fitted up to its middle, and predicted from there.

    mu_t : estimate from the first half
    speed_rms, usual_rms : m/s, rms of predicted less measured speed over ground in the second half, and of the first
        half's mean speed less the measured one
    time, predicted, measured : (n,) s and m/s over the whole run
    split : s
    """

    mu_t: float
    speed_rms: float
    usual_rms: float
    time: Array
    predicted: Array
    measured: Array
    split: float


def shares_of(
    fitted: Fitted, problem: Problem, motion: Motion, completed: Completed, sigma_inclination: float
) -> Shares:
    """Compute what track, posture and slope (``sigma_inclination``, rad) each add to a fit's uncertainty."""
    sigma = completed.sigma
    problem = replace(problem, model=fitted.model)
    prepared = prepare(problem.model, motion, step=COARSE_STEP)

    def residual_of(model: Model, tables: Prepared) -> Array:
        run = simulate_reduced(model, tables)
        return problem.residual(model, run.time, run.antenna)

    edges = np.linspace(prepared.time[0], prepared.time[-1], _SPANS)
    spans = [(float(centre), float(edges[1] - edges[0])) for centre in edges]
    changes = [partial(_wrong_feet, kind, span, getattr(sigma, kind)) for kind in _SIGNS for span in spans]
    base, responses = sensitivities(
        problem.model,
        prepared,
        problem.names,
        lambda model, run: problem.residual(model, run.time, run.antenna),
        changes,
    )
    slopes, of_posture = np.split(responses, [len(problem.names)], axis=-1)
    problem = problem.with_noise(fitted.noise)
    inverse = np.linalg.pinv(problem.curvature(slopes), hermitian=True)

    def shift(moved: Array) -> Array:
        """Return the shift (k,) of the fitted numbers where the residual changes by ``moved`` (n, 2)."""
        return np.asarray(-inverse @ (problem.weight * np.einsum("n,nc,nck->k", problem.seconds, moved, slopes)))

    # to the left in a left turn, which is a lean to the left
    into = -np.tanh(completed.lean / CLEAR_LEAN)
    tables = prepared
    for side in range(2):
        skid = _Turning("yaw", side, None, completed.bvh.time, into)
        tables = with_error(tables, skid, _SKID_PROBE * sigma.yaw)
    steering = shift((residual_of(problem.model, tables) - base) / _SKID_PROBE)
    posture = np.stack([shift(moved) for moved in np.moveaxis(of_posture, -1, 0)])
    steeper = problem.model.inclination + _PROBE * sigma_inclination
    slope = np.zeros(len(problem.names))
    if sigma_inclination > 0.0:
        tilted = replace(prepared, inclination=steeper)
        slope = shift((residual_of(replace(problem.model, inclination=steeper), tilted) - base) / _PROBE)
    return Shares(
        track=fitted.standard_errors,
        posture=np.asarray(np.sqrt(np.sum(posture**2, axis=0))),
        slope=np.abs(slope),
        steering=np.abs(steering),
        covariance=np.asarray(
            fitted.covariance + posture.T @ posture + np.outer(slope, slope) + np.outer(steering, steering)
        ),
        effective=effective_friction(simulate_reduced(problem.model, prepared)),
    )


def _wrong_feet(kind: str, span: tuple[float, float], sigma: float, prepared: Prepared, size: complex) -> Prepared:
    """Return the tables where both feet are wrong by ``size`` standard deviations over a stretch of the run."""
    for side, sign in enumerate(_SIGNS[kind]):
        prepared = with_error(prepared, CaptureError(kind, side, span), sign * sigma * size)
    return prepared


def effective_friction(run: ReducedRun) -> float:
    """Return the work of the snow's friction over the path of the load: the loss of a sledge of that friction."""
    power = np.sum(run.foot_friction * run.foot_velocity, axis=(1, 2))
    load_speed = np.sum(run.foot_load * np.linalg.norm(run.foot_velocity, axis=2), axis=1)
    return -float(np.sum(power) / np.sum(load_speed))


def second_half(fitted: Fitted, problem: Problem, motion: Motion, gps: Gps) -> SecondHalf:
    """Fit the reduced model to the first half's fixes and compare the second half's speed with the receiver's."""
    track = problem.track
    split = 0.5 * float(track.time[0] + track.time[-1])
    early = track.time <= split
    part = Track(track.time[early], track.place[early], track.sigma[early])
    first = replace(problem, track=part, counts=problem.counts[early], model=fitted.model).with_noise(fitted.noise)
    optimum = fit_reduced(first, prepare(first.model, motion, stop=split, step=COARSE_STEP), tolerance=0.1)
    model = first.model_at(optimum.values)
    run = simulate_reduced(model, prepare(model, motion, step=COARSE_STEP))
    predicted = over_ground(run.time, run.antenna, model.inclination)
    inside = (gps.time >= run.time[0]) & (gps.time <= run.time[-1])
    time = gps.time[inside]
    measured = gps.speed[inside] if gps.speed is not None else over_ground(gps.time, gps.enu, 0.0)(time)
    late = time > split
    speed = predicted(time)
    usual = float(np.mean(measured[~late]))
    return SecondHalf(
        mu_t=model.friction.mu_t,
        speed_rms=float(np.sqrt(np.mean((speed - measured)[late] ** 2))),
        usual_rms=float(np.sqrt(np.mean((usual - measured)[late] ** 2))),
        time=time,
        predicted=speed,
        measured=measured,
        split=split,
    )


def over_ground(time: Array, path: Array, inclination: float) -> Callable[[Array], Array]:
    """Return horizontal speed (m/s) as a function of time, averaged over a second.

    It is that of a path (n, 3) m in a frame inclined by ``inclination`` (rad) about its second axis.
    """
    flat = np.stack([path[:, 0] * np.cos(inclination) + path[:, 2] * np.sin(inclination), path[:, 1]])

    def speed(at: Array) -> Array:
        ends = [np.stack([np.interp(at + half, time, axis) for axis in flat]) for half in (-0.5, 0.5)]
        spans = np.clip(at + 0.5, None, time[-1]) - np.clip(at - 0.5, time[0], None)
        return np.asarray(np.linalg.norm(ends[1] - ends[0], axis=0) / spans)

    return speed
