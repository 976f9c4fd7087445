"""A fit and a diagnosis give measurements the same probability, where the noise and all that may vary are the same."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest
from a_linear_model import LEVELS
from bundled import bundled

from sssi_exudyn.core.frames import Array
from sssi_exudyn.fitting.evidence import Freedom, LinearModel, LinearProblem, log_evidence
from sssi_exudyn.fitting.noise import HEIGHT_ORIGIN
from sssi_exudyn.fitting.observations import measurements_of, observation_of
from sssi_exudyn.model.from_recording import model_of


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

    def sized(columns: Array) -> dict[str, Array]:
        return {"posture": columns[:, :3], "surface": columns[:, 3:]}

    fitted, compared = stacked(by_fit.blocks, len(by_fit.measured)), stacked(seen.blocks, len(seen.measured))
    usual = np.array([0.7, 0.2, 1.9])
    origin = np.zeros((len(compared), 1))
    origin[seen.blocks["height"]] = 1.0
    free = Freedom(compared[:, 1:4], usual).with_more(origin, np.array([HEIGHT_ORIGIN]))
    linear = LinearModel(seen, compared[:, 0], free, sized(compared[:, 4:]))
    free_of_fit = Freedom(fitted[:, 1:4], usual).with_more(by_fit.height_origin, np.ones(1))
    problem = LinearProblem(by_fit, fitted[:, 0], free_of_fit, sized(fitted[:, 4:]))
    # rounding of sums of hundreds of numbers of 1 and of the origin, 1e4 standard deviations wide
    assert log_evidence(linear, LEVELS) == pytest.approx(log_evidence(problem, LEVELS), rel=0.0, abs=1e-9)
    # once the posture and the waves are of their levels' size, they are as free as all else
    sizes = [*usual, *[LEVELS.posture] * 3, *[LEVELS.surface] * 3]
    every = Freedom(fitted[:, 1:], np.array(sizes)).with_more(by_fit.height_origin, np.ones(1))
    whole = log_evidence(LinearProblem(by_fit, fitted[:, 0], every), LEVELS)
    assert whole == pytest.approx(log_evidence(problem, LEVELS), rel=0.0, abs=1e-9)
