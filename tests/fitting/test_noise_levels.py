"""The declared noise and its levels: one value a number, bounds about it, and what is known of it beforehand."""

from __future__ import annotations

from dataclasses import fields

import numpy as np
import pytest
from bundled import bundled

from sssi_exudyn.core.quantity import quantities
from sssi_exudyn.fitting.noise import (
    BLOCKS_OF,
    NOISE,
    SCALES,
    NoiseLevels,
    level_priors,
    log_prior,
    usual_levels,
)
from sssi_exudyn.fitting.observations import measurements_of, observation_of
from sssi_exudyn.model.from_recording import model_of

USUAL = usual_levels(fix=0.02, height=0.03, load=700.0, moment=20.0)


def test_every_instrument_has_its_four_numbers_with_their_sources() -> None:
    assert {entry.name for entry in fields(NOISE)} == set(BLOCKS_OF)
    for instrument in BLOCKS_OF:
        declared = quantities(getattr(NOISE, instrument))
        assert list(declared) == ["size", "memory", "size_spread", "memory_spread"]
        assert all(about.source and about.meaning for about in declared.values())


@pytest.mark.parametrize("instrument", BLOCKS_OF)
@pytest.mark.parametrize("number", ["size", "memory"])
def test_bounds_are_three_spreads_away_or_what_is_given(instrument: str, number: str) -> None:
    about, spread = quantities(getattr(NOISE, instrument)), getattr(getattr(NOISE, instrument), f"{number}_spread")
    low, high = (np.log(bound / about[number].default) for bound in (about[number].low, about[number].high))
    if instrument == "moment":  # how well a skier balances is never better than stated, and may be far worse
        assert low == 0.0
    else:
        # declared to two digits: 3 % of a number, and a twentieth of the least spread of 0.35 three times
        assert [low, high] == pytest.approx([-3.0 * spread, 3.0 * spread], abs=0.05)


def test_levels_are_numbers_by_name() -> None:
    assert NoiseLevels.of_numbers(USUAL.numbers).numbers == USUAL.numbers
    changed = USUAL.with_numbers({"load.correlation_time": 0.2, "posture": 1.5})
    assert changed.load.correlation_time == 0.2
    assert changed.load.sigma == USUAL.load.sigma
    assert (changed.posture, changed.surface) == (1.5, SCALES.surface)
    assert {block: changed.of(block) for block in BLOCKS_OF["gps"]} == dict.fromkeys(BLOCKS_OF["gps"], USUAL.gps)


def test_noise_that_remembers_longer_changes_as_much_from_one_reading_to_the_next() -> None:
    longer = USUAL.remembering("gps", 8.0)
    assert longer.gps.correlation_time == 8.0
    assert longer.gps.sigma**2 / 8.0 == pytest.approx(USUAL.gps.sigma**2 / USUAL.gps.correlation_time)
    assert longer.height == USUAL.height


def test_what_is_known_beforehand_is_normal_in_the_logarithm() -> None:
    assert log_prior(USUAL, USUAL) == 0.0
    moved = USUAL.with_numbers({"gps.sigma": USUAL.gps.sigma * np.exp(NOISE.gps.size_spread)})
    assert log_prior(USUAL, moved) == pytest.approx(-0.5)
    more = moved.with_numbers({"surface": float(np.exp(-2.0 * SCALES.surface_spread))})
    assert log_prior(USUAL, more) == pytest.approx(-0.5 - 2.0)
    prior = level_priors(USUAL)["moment.correlation_time"]
    assert prior.low == prior.high == prior.usual  # as given


def test_a_fit_and_a_diagnosis_have_the_same_noise() -> None:
    recording, motion = bundled("beginner")
    model = model_of(recording, motion)
    compared = measurements_of(recording, model, motion.start, motion.stop)
    observed = observation_of(recording, model, motion, compared.counts)
    assert compared.usual == observed.usual
    assert compared.usual.gps.sigma == NOISE.gps.size * compared.gps_sigma
