"""Two runs of a day in which a law acts on both, as the benchmark's world records them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from bundled import bundled, coarse, steady

from sssi_exudyn.contact.term import Term
from sssi_exudyn.model.from_recording import first_guess, model_of
from sssi_exudyn.validation.benchmark.cases import record
from sssi_exudyn.validation.benchmark.world import draw_instruments
from sssi_exudyn.validation.diagnosis.context import diagnosis_problem
from sssi_exudyn.validation.diagnosis.diagnose import separate_fit
from sssi_exudyn.validation.diagnosis.search.search_result import SeparateFit
from sssi_exudyn.validation.diagnosis.state import first_fit


def fits_of_two_runs(law: Term) -> list[SeparateFit]:
    """Fit two stretches of the intermediate's run at different speeds, each without the law.

    The suit's errors are constant, in the world as in what is stated of it.
    """
    recording, motion = bundled("intermediate")
    recording = steady(recording)
    assert recording.gps is not None
    # values of a fit of the whole recording; the data are those of the world below, so no fit is needed to make them
    fitted = coarse(model_of(recording, motion)).with_values({"friction.mu_t": 0.19, "friction.mu_n": 0.9})
    own: list[SeparateFit] = []
    for number, after in enumerate((0.2, 8.0)):
        stretch = replace(motion, start=motion.start + after, stop=motion.start + after + 7.0)
        start = first_guess(recording.gps, stretch, fitted.inclination, fitted.fall_line_azimuth)
        world = replace(fitted, start=start, terms=(*fitted.terms, law))
        given = (recording, stretch, fitted)
        rng = np.random.default_rng([3, number])
        usual = replace(draw_instruments(rng, stretch), outliers=0.0, lost=None, wander=0.0)
        made = record(rng, given, stretch, world, usual, 0.0, 0.0)
        own.append(separate_fit(*first_fit(diagnosis_problem(*made))))
    return own
