"""The estimate of all that is uncertain against an independent world, whose friction is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from bundled import bundled

from sssi_exudyn.fitting.estimate import estimate
from sssi_exudyn.fitting.fit import problem_of
from sssi_exudyn.fitting.snow_surface import on_snow_surface
from sssi_exudyn.model.from_recording import model_of

SECONDS = 5.0


@pytest.mark.parametrize(("name", "true"), [("beginner", (0.06, 0.55)), ("intermediate", (0.19, 0.90))])
@pytest.mark.long(seconds=15)
def test_friction_of_another_world_is_found_within_its_standard_error(name: str, true: tuple[float, float]) -> None:
    recording, motion = bundled(name)
    model = on_snow_surface(model_of(recording, motion), recording, motion)
    motion = replace(motion, stop=motion.start + SECONDS)
    found = estimate(problem_of(recording, motion, model, "joint"), recording, motion, full=False)
    assert found.fitted.names[:2] == ("friction.mu_t", "friction.mu_n")
    spread = np.sqrt(np.diag(found.posterior.covariance)[:2])
    # beyond 2.6 standard deviations lies one of four numbers in one of 25 worlds
    assert np.all(np.abs(found.posterior.values[:2] - true) < 2.6 * spread)
    # 0.01 of μ_t is what half a degree of slope does: less than that is asked of a standard error
    assert np.all(spread < 0.01)
    # noise of 2 cm in both directions leaves 2 √(π/2) = 2.5 cm, the mean of 50 fixes up to 1 cm more
    assert np.mean(np.linalg.norm(found.fitted.residual, axis=1)) < 0.035
    moments = found.posterior.setting.seen.moments
    assert np.sqrt(np.mean(np.square(found.posterior.residual[moments]))) < 20.0  # N m: what is stated of the balance
