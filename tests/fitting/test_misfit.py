"""A misfit that no noise describes is carried into the answer: no interval, and the reason for it."""

from __future__ import annotations

from dataclasses import replace

import pytest
from bundled import bundled

from sssi_exudyn.fitting.estimate import estimate
from sssi_exudyn.fitting.first_fit import fit, problem_of
from sssi_exudyn.fitting.misfit import believable_estimate, believable_fit, why_missed, why_unidentified
from sssi_exudyn.fitting.snow_surface import on_snow_surface
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.recording.recording import Recording
from sssi_exudyn.results.uncertainty import uncertainty_figures
from sssi_exudyn.sweeps.outputs import figures_of_fit

pytestmark = pytest.mark.usefixtures("coarse_skis")
SECONDS = 5.0
SHORT = 3.5
"""s of a run that leaves no interval: the less it says, the more of a misfit what is uncertain may take up."""


def with_wrong_clock(name: str, late: float) -> Recording:
    """Return the beginner's recording with the ``time_offset_s`` of an instrument wrong by ``late`` s."""
    recording, _ = bundled("beginner")
    if name == "gps":
        assert recording.gps is not None
        return replace(recording, gps=replace(recording.gps, time=recording.gps.time + late))
    assert recording.insoles is not None
    return replace(recording, insoles=replace(recording.insoles, time=recording.insoles.time + late))


@pytest.mark.parametrize(("insoles", "late"), [(True, 3.0), (False, 3.0), (False, -3.0)])
@pytest.mark.long(seconds=20)
def test_a_receivers_clock_that_is_seconds_wrong_leaves_no_interval(insoles: bool, late: float) -> None:
    _, motion = bundled("beginner")
    recording = with_wrong_clock("gps", late)
    recording = recording if insoles else replace(recording, insoles=None)
    begin = motion.start + max(late, 0.0)
    motion = replace(motion, start=begin, stop=begin + SHORT)
    model = on_snow_surface(model_of(recording, motion), recording, motion)
    estimated = estimate(problem_of(recording, motion, model, "joint"), recording, motion, full=False)
    words = why_unidentified(estimated.posterior)
    assert "does not identify friction: the track is missed by" in words
    assert "Noise of such a receiver is 0.064 m at most" in words  # 3.2 times its 0.02 m (FixNoise)
    figures = uncertainty_figures(estimated.posterior)
    assert figures.interval_90 == {}
    assert figures.shares == {}
    assert figures.doubts[0] == figures.withheld == words
    row = figures_of_fit(believable_estimate(estimated))
    assert row["fitted_mu_n_se"] is None
    assert row["fitted_mu_n"] == estimated.fitted.value("friction.mu_n")


@pytest.mark.long(seconds=20)
def test_a_sole_s_clock_that_is_seconds_wrong_widens_the_interval_and_is_said() -> None:
    _, motion = bundled("beginner")
    recording = with_wrong_clock("insoles", 3.0)
    motion = replace(motion, start=motion.start + 3.0, stop=motion.start + 3.0 + SECONDS)
    model = on_snow_surface(model_of(recording, motion), recording, motion)
    estimated = estimate(problem_of(recording, motion, model, "joint"), recording, motion, full=False)
    figures = uncertainty_figures(estimated.posterior)
    assert figures.withheld is None  # the track is as it should be
    assert believable_estimate(estimated) == estimated.fitted
    assert figures.interval_90["mu_n"].low < 0.55 < figures.interval_90["mu_n"].high
    assert any("intervals are" in words and "times as wide" in words for words in figures.doubts)


@pytest.mark.parametrize("late", [0.0, 3.0, -3.0])
@pytest.mark.long(seconds=5)
def test_a_fit_of_friction_alone_has_no_standard_errors_where_it_misses_the_track(late: float) -> None:
    _, motion = bundled("beginner")
    recording = with_wrong_clock("gps", late)
    begin = motion.start + max(late, 0.0)
    motion = replace(motion, start=begin, stop=begin + SECONDS)
    fitted = fit(problem_of(recording, motion, model_of(recording, motion), "paper"), motion, "paper", full=False)
    words = why_missed(fitted, recording)
    row = figures_of_fit(believable_fit(fitted, recording))
    if late == 0.0:
        assert words == ""
        assert row["fitted_mu_n_se"] == fitted.standard_error("friction.mu_n")
        return
    assert words.startswith("this fit does not identify friction: the track is missed by ")
    assert "skis that point 1.5° wrong" in words  # [uncertainty] foot
    assert row["fitted_mu_n_se"] is None
    assert row["fitted_mu_n"] == fitted.value("friction.mu_n")
