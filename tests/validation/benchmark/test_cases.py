"""Blind cases that are of no use are drawn again."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from bundled import bundled, coarse

from sssi_exudyn.contact.terms.friction_corrections import SnowCompaction
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.validation.benchmark import cases
from sssi_exudyn.validation.benchmark.cases import SkierStops, make, record
from sssi_exudyn.validation.benchmark.world import draw_instruments

pytestmark = pytest.mark.usefixtures("coarse_skis")


@pytest.mark.parametrize(("braking", "stops"), [(0.0, False), (2e5, True)])
def test_a_run_that_the_effect_stops_is_no_case(braking: float, stops: bool) -> None:
    recording, motion = bundled("beginner")
    motion = replace(motion, stop=motion.start + 4.0)
    model = coarse(model_of(recording, motion))
    rng = np.random.default_rng(5)
    instruments = draw_instruments(rng, motion)
    world = replace(model, terms=(*model.terms, SnowCompaction(braking)))
    known = (recording, motion, model)
    if stops:
        with pytest.raises(SkierStops, match="m/s left"):
            record(rng, known, motion, world, instruments, 0.0, 0.0)
    else:
        recorded, _, _ = record(rng, known, motion, world, instruments, 0.0, 0.0)
        assert recorded.gps is not None


def test_an_effect_that_stops_every_skier_becomes_weaker(monkeypatch: pytest.MonkeyPatch) -> None:
    shares: list[float] = []

    def draw(*arguments: object) -> str:
        shares.append(float(arguments[-1]))  # type: ignore[arg-type]
        if shares[-1] > 0.3:
            raise SkierStops("too strong")
        return "made"

    monkeypatch.setattr(cases, "_draw", draw)
    assert make(0, ("snow_compaction", "physics", 3), [], 1) == "made"  # type: ignore[comparison-overlap]
    assert shares == [1.0] * 10 + [0.5] * 10 + [0.25]
