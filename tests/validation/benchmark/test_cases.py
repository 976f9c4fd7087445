"""Blind cases that are of no use are drawn again."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from bundled import bundled, coarse

from sssi_exudyn.contact.terms.friction_corrections import SnowCompaction
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.simulation.full.run import simulate
from sssi_exudyn.validation.benchmark import cases
from sssi_exudyn.validation.benchmark.cases import Planned, SkierStops, make, record
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


def test_a_skier_is_recorded_once_he_has_settled_on_the_snow() -> None:
    recording, motion = bundled("beginner")
    begin = motion.start + 1.0
    stated = replace(motion, start=begin, stop=begin + 4.0)
    model = coarse(model_of(recording, motion))
    instruments = draw_instruments(np.random.default_rng(5), stated)
    known = (recording, stated, model)
    recorded, captured, _ = record(
        np.random.default_rng(6), known, replace(stated, start=motion.start), model, instruments, 0.0, 0.0
    )
    assert recorded.gps is not None
    assert recorded.insoles is not None
    assert (recorded.gps.time[0], recorded.insoles.time[0], captured.start) == (begin, begin, begin)
    run = simulate(model, replace(stated, start=motion.start))
    times = recorded.insoles.time
    loads = np.stack([np.interp(times, run.time, sole) for sole in run.sole_force.T], axis=1)
    shown = np.stack([recorded.insoles.left, recorded.insoles.right], axis=1)
    noise = shown - (1.0 - instruments.cuff) * instruments.gains * loads
    loaded = loads > 60.0  # a reading is never negative
    # 12 N of noise in each of some hundred readings: its standard deviation is known to a tenth
    assert 9.0 < float(np.std(noise[loaded])) < 15.0


@pytest.mark.parametrize(("recorded", "least", "most"), [(5.5, 4.5, 4.5), (11.0, 5.5, 7.0)])
def test_a_case_is_as_long_as_its_recording_at_most(
    recorded: float, least: float, most: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    recording, motion = bundled("beginner")
    motion = replace(motion, stop=motion.start + recorded)
    model = coarse(model_of(recording, motion))
    monkeypatch.setattr(cases, "balance_skier", lambda world, moved, _: moved)
    made = make(0, Planned("none", "none", 0), [(recording, motion, model)], 3)
    assert made.case.seconds == pytest.approx(made.motion.stop - made.motion.start)
    assert least - 1e-9 <= made.motion.stop - made.motion.start <= most + 1e-9
    assert made.motion.start >= motion.start + 1.0


def test_an_effect_that_stops_every_skier_becomes_weaker(monkeypatch: pytest.MonkeyPatch) -> None:
    shares: list[float] = []

    def draw(*arguments: object) -> str:
        shares.append(float(arguments[-1]))  # type: ignore[arg-type]
        if shares[-1] > 0.3:
            raise SkierStops("too strong")
        return "made"

    monkeypatch.setattr(cases, "_draw", draw)
    assert make(0, Planned("snow_compaction", "physics", 3), [], 1) == "made"  # type: ignore[comparison-overlap]
    assert shares == [1.0] * 10 + [0.5] * 10 + [0.25]
