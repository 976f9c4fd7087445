"""How friction builds up with slip, and how snow resists penetration, are estimated: the paper states neither."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from bundled import bundled, steady

from sssi_exudyn.core.number_ref import COMPLIANCE, DAMPING, EPS, EXPONENTS, MU_N, MU_T, SHARPNESS, SLIP
from sssi_exudyn.fitting.balance import SLIP_NOISE, moment_by_slip_noise
from sssi_exudyn.fitting.estimate import setting_of
from sssi_exudyn.fitting.first_fit import problem_of
from sssi_exudyn.fitting.linearised_run import Setting, linearise_at
from sssi_exudyn.fitting.parameters import law_unknowns
from sssi_exudyn.fitting.posterior import Posterior, find_posterior
from sssi_exudyn.fitting.posture_errors import fast_errors
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.model.model import Model
from sssi_exudyn.recording.uncertainty import Uncertainty
from sssi_exudyn.simulation.reduced.run import simulate_reduced
from sssi_exudyn.validation.drawn_run import draw_run

pytestmark = pytest.mark.usefixtures("coarse_skis")
HELD = Uncertainty(friction_onset=0.0, snow_damping=0.0, snow_exponents=0.0, leg_compliance=0.0)
SNOW = {"friction.mu_t": 0.19, "friction.mu_n": 0.9, "friction.eps": 0.3}


@cache
def setting_about(about: Uncertainty) -> tuple[Model, Setting]:
    """Return the model on soft snow and what is sought of the first seconds of the intermediate skier."""
    recording, motion = bundled("intermediate")
    recording = steady(replace(recording, uncertainty=about))
    motion = replace(motion, stop=motion.start + 6.0)
    problem = problem_of(recording, motion, model_of(recording, motion), "joint")
    return setting_of(problem.model.with_values(SNOW), problem, recording, motion)


@cache
def estimate_of_soft_snow(about: Uncertainty) -> Posterior:
    """Return the estimate of a run on snow with ε = 0.3 m/s, of a model that states 0.1 m/s."""
    model, setting = setting_about(HELD)
    drawn = draw_run(model, setting, np.random.default_rng(47))
    stated, sought = setting_about(about)
    return find_posterior(
        stated.with_values({EPS: 0.1}), replace(sought, seen=replace(sought.seen, measured=drawn.setting.seen.measured))
    )


def test_a_number_known_to_a_factor_is_estimated_by_its_logarithm() -> None:
    model, _ = setting_about(Uncertainty())
    stated = model.with_values({EPS: 0.1, SLIP: 0.0})
    unknowns = {unknown.name: unknown for unknown in law_unknowns(stated, Uncertainty())}
    assert set(unknowns) == {EPS, SLIP, SHARPNESS, DAMPING, *EXPONENTS, COMPLIANCE}
    assert unknowns[EPS].prior.mean == pytest.approx(math.log(0.1))
    assert unknowns[EPS].of(model) == pytest.approx(math.log(0.3))
    assert unknowns[EPS].slope(model) == pytest.approx(0.3)
    assert unknowns[EXPONENTS[0]].of(model) == 1.5
    assert unknowns[EXPONENTS[0]].slope(model) == 1.0
    assert not law_unknowns(stated, HELD)
    assert COMPLIANCE not in {unknown.name for unknown in law_unknowns(setting_about(HELD)[0], Uncertainty())}
    undamped = {unknown.name for unknown in law_unknowns(stated.with_values({DAMPING: 0.0}), Uncertainty())}
    assert undamped == {EPS, SLIP, SHARPNESS, *EXPONENTS, COMPLIANCE}  # no damping has no logarithm


def test_numbers_and_logarithms_of_a_setting_belong_together() -> None:
    model, setting = setting_about(Uncertainty())
    values = setting.values(model)
    assert np.count_nonzero(setting.logarithmic) == 4  # ε, τ, the sharpness and the snow's damping
    np.testing.assert_allclose(setting.in_units(values), [model.value(name) for name in setting.names], rtol=1e-14)
    higher = setting.in_units(values + 1e-6) - setting.in_units(values - 1e-6)
    # differences of second order, rounded by 1e-10 of the largest number, which is 5000
    np.testing.assert_allclose(higher / 2e-6, setting.slopes(model), rtol=1e-6, atol=1e-6)
    low, high = setting.bounds(model).T
    assert np.all(np.isfinite(low))
    assert np.all(low < high)
    assert setting.at(model, values).value(EPS) == pytest.approx(0.3)


@pytest.mark.long
def test_noise_of_the_slip_counts_where_skis_stick() -> None:
    """By hand for skis that stand across nothing: the force answers by μ_n·N·σ/√(σ² + ε²), at the pelvis' height."""
    model, setting = setting_about(Uncertainty())
    point, _ = linearise_at(model, setting)
    run = simulate_reduced(model, point.prepared)
    sticking = replace(run, foot_velocity=10.0 * run.foot_forward)
    arms = np.linalg.norm(run.foot_position - run.pelvis[:, None], axis=-1)
    law = replace(model.friction, slip=0.0)
    stick = moment_by_slip_noise(model.with_values({SLIP: 0.0}), sticking)
    answer = law.mu_n * run.foot_load * SLIP_NOISE / math.hypot(SLIP_NOISE, law.eps)
    np.testing.assert_allclose(stick, np.linalg.norm(answer * arms, axis=1), rtol=1e-9)
    across = np.stack([-run.foot_forward[..., 1], run.foot_forward[..., 0], np.zeros(arms.shape)], axis=-1)
    sliding = replace(run, foot_velocity=10.0 * run.foot_forward + 3.0 * across)
    # the slope of u/√(1 + u²) at ten times ε is a thousandth of that at rest
    assert np.all(moment_by_slip_noise(model, sliding) <= 0.002 * stick + 1e-9)


@pytest.mark.long
def test_moments_count_less_where_skis_stick() -> None:
    model, setting = setting_about(Uncertainty())
    point, _ = linearise_at(model, setting)
    run = simulate_reduced(model, point.prepared)
    seen = setting.seen.with_slip_noise(model, run)
    ratio = seen.scale.total / setting.seen.scale.total
    assert np.all(ratio[: seen.blocks["moment_f"].start] == 1.0)
    assert np.all(ratio[seen.blocks["moment_n"]] == 1.0)
    assert ratio[seen.blocks["moment_f"]].max() > 1.1
    np.testing.assert_array_equal(ratio[seen.blocks["moment_f"]], ratio[seen.blocks["moment_l"]])


@pytest.mark.long
def test_loads_answer_to_fast_turns_of_feet_where_skis_hold() -> None:
    """So a larger ε, by which they answer less, would hide what a suit adds to them."""
    model, setting = setting_about(Uncertainty())
    motion = setting.motion
    errors = fast_errors(Uncertainty.foot_yaw_fast, motion.start, motion.stop)[10:40:5]
    setting = replace(setting, errors=errors)
    answers = []
    for eps in (0.03, 0.3):
        _, responses = linearise_at(model.with_values({EPS: eps}), setting)
        columns = responses.by_error[setting.seen.blocks["difference"], :-1]
        answers.append(np.sqrt(np.mean(np.max(np.abs(columns), axis=0) ** 2)))
    assert answers[0] > 1.5 * answers[1]
    assert answers[0] > 2.0  # N


@pytest.mark.long
def test_friction_on_snow_of_another_onset_lies_in_its_interval() -> None:
    """The snow's ε is three times the model's: held, μ_n is many standard errors off; estimated, it is right."""
    held, sought = estimate_of_soft_snow(HELD), estimate_of_soft_snow(Uncertainty())

    def errors(posterior: Posterior) -> list[float]:
        sigmas = np.sqrt(np.diag(posterior.covariance))
        places = [posterior.setting.names.index(name) for name in (MU_T, MU_N)]
        return [(posterior.values[i] - SNOW[posterior.setting.names[i]]) / sigmas[i] for i in places]

    assert max(map(abs, errors(held))) > 5.0
    # one draw of two numbers, of which none in a hundred draws is beyond 2.8
    assert max(map(abs, errors(sought))) < 2.8
    low, high = sought.interval(EPS, 2.6)[1:]  # 99 %
    assert 0.1 < low < 0.3 < high
    assert sought.log_evidence > held.log_evidence + 5.0
