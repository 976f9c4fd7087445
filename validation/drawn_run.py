"""A run with errors drawn from their priors, to test how often intervals hold the truth."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.number_ref import MU_T, START_F, START_L, VELOCITY_F, VELOCITY_L
from sssi_exudyn.fitting.autocorrelated_noise import draw_uneven_noise
from sssi_exudyn.fitting.linearised_run import Setting, linearise_at, moved_point
from sssi_exudyn.model.model import Model


@dataclass(frozen=True)
class DrawnRun:
    """Input of an estimate, and the truth.

    setting : with the measurements of the drawn run
    values : θ (k,);  sizes : η (m,), in standard deviations
    """

    setting: Setting
    values: Array
    sizes: Array


def draw_run(model: Model, setting: Setting, rng: np.random.Generator) -> DrawnRun:
    """Draw measurements, with noise of the usual size, of a run of the reduced model with errors.

    The run's numbers, mass and posture differ from the model's by errors drawn from the priors, numbers within their
    bounds; a changing drag area acts linearly.  Friction, place and velocity at the start are the model's: their priors
    are so wide that they say nothing.
    """
    point, responses = linearise_at(model, setting)
    values = setting.values(model)
    for i, (name, sigma) in enumerate(zip(setting.names, setting.sigmas, strict=True)):
        if name.part != MU_T.part and name not in (START_F, START_L, VELOCITY_F, VELOCITY_L):
            values[i] += sigma * rng.standard_normal()
    values = np.clip(values, *setting.bounds(model).T)
    sizes = rng.standard_normal(len(setting.errors) + 1)
    measured = moved_point(setting, point, responses, values, sizes).predicted.copy()
    seen = setting.seen
    for block, rows in seen.blocks.items():
        if rows.stop > rows.start:
            measured[rows] += draw_uneven_noise(rng, seen.times[block], seen.usual.of(block), seen.scale[rows])
    measured += responses.by_drag @ rng.standard_normal(responses.by_drag.shape[1])
    return DrawnRun(replace(setting, seen=replace(seen, measured=measured)), values, sizes)
