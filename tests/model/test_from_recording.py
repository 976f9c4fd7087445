"""The model before a fit: where a run is guessed to begin."""

from dataclasses import replace

import numpy as np
import pytest
from bundled import bundled

from sssi_exudyn.model.from_recording import first_guess


@pytest.mark.parametrize("far", [(), (0,), (1,), (0, 1), (4, 9)])
def test_fixes_that_are_far_off_do_not_bend_the_first_guess(far: tuple[int, ...]) -> None:
    recording, motion = bundled("beginner")
    gps, slope = recording.gps, recording.slope
    assert gps is not None
    first = int(np.searchsorted(gps.time, motion.start))
    enu = gps.enu.copy()
    enu[[first + i for i in far]] += [0.3, -0.4, 0.0]
    usual = first_guess(gps, motion, slope.inclination, slope.fall_line_azimuth)
    guess = first_guess(replace(gps, enu=enu), motion, slope.inclination, slope.fall_line_azimuth)
    # a cubic through the rest, seen beyond its end: fixes of 2 cm leave 10 cm and 0.5 m/s without the first two of them
    assert np.hypot(guess.f - usual.f, guess.l - usual.l) < 0.12
    assert np.hypot(guess.velocity_f - usual.velocity_f, guess.velocity_l - usual.velocity_l) < 0.6
