"""A fit and a diagnosis give measurements the same probability, where the noise and all that may vary are the same."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest
from bundled import bundled

from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.noise import ExponentialNoise
from sssi_exudyn.fitting.evidence import Freedom, LinearModel, NoiseLevels, log_evidence
from sssi_exudyn.fitting.noise import LinearRun
from sssi_exudyn.fitting.observation import observation_of
from sssi_exudyn.fitting.observations import HEIGHT_ORIGIN, measurements_of
from sssi_exudyn.model.from_recording import model_of

LEVELS = NoiseLevels(
    gps=ExponentialNoise(0.025, 3.1),
    height=ExponentialNoise(0.04, 1.2),
    load=ExponentialNoise(35.0, 0.07),
    difference=ExponentialNoise(50.0, 0.4),
    posture=0.8,
    surface=1.3,
)
BY_BLOCK = {"x": LEVELS.gps, "y": LEVELS.gps, "height": LEVELS.height}
BY_BLOCK |= {"load": LEVELS.load, "difference": LEVELS.difference}


def test_both_evidences_agree_at_equal_levels() -> None:
    recording, motion = bundled("beginner")
    motion = replace(motion, stop=motion.start + 3.0)
    model = model_of(recording, motion)
    seen = measurements_of(recording, model, motion.start, motion.stop)
    rng = np.random.default_rng(11)
    seen = replace(seen, counts=seen.counts * rng.uniform(0.3, 1.0, len(seen.fixes)))
    by_fit = observation_of(recording, model, motion, seen.counts, balanced=False, heights=True)
    parts = {
        name: LEVELS.of(name).sigma * rng.normal(size=(at.stop - at.start, 10)) for name, at in seen.blocks.items()
    }

    def stacked(blocks: Mapping[str, slice], count: int) -> Array:
        table = np.zeros((count, 10))
        for name, part in parts.items():
            table[blocks[name]] = part
        return table

    fitted, compared = stacked(by_fit.blocks, len(by_fit.measured)), stacked(seen.blocks, len(seen.measured))
    usual = np.array([0.7, 0.2, 1.9])
    run = LinearRun(by_fit, fitted[:, 0], fitted[:, 1:] * [*usual, *[LEVELS.posture] * 3, *[LEVELS.surface] * 3])
    origin = np.zeros((len(compared), 1))
    origin[seen.blocks["height"]] = 1.0
    free = Freedom(compared[:, 1:4], usual).with_more(origin, np.array([HEIGHT_ORIGIN]))
    linear = LinearModel(seen, compared[:, 0], free, compared[:, 4:7], compared[:, 7:])
    # rounding of sums of hundreds of numbers of 1 and of the origin, 1e4 standard deviations wide
    assert log_evidence(linear, LEVELS) == pytest.approx(run.log_evidence(BY_BLOCK), rel=0.0, abs=1e-9)
