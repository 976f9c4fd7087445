"""Technique from friction, slope and speed: limits of the regression, and its figures in a table of turns."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from sssi_exudyn.analysis.turn_style import STYLES, add_styles, style_features, style_model, style_of
from sssi_exudyn.core.noise import ExponentialNoise
from sssi_exudyn.fitting.few_sensors.path_balance import PathData, PathEstimate, estimate_path
from sssi_exudyn.results.summary import Summary, summary_from_dict, summary_to_dict

LOAD, DRAG, SLOPE = 0.98, 0.0032, 0.16


def steady(speed: float, seconds: float = 40.0) -> PathEstimate:
    """Return the balance of a run at one speed, so that friction is the slope less the air's share."""
    time = np.arange(0.0, seconds)
    data = PathData(
        time,
        np.full(len(time), speed),
        0.1,
        time,
        -SLOPE * speed * time,
        0.1,
        ExponentialNoise(0.1, 60.0),
        LOAD,
        DRAG,
    )
    return estimate_path(data)


def test_features_of_a_steady_run() -> None:
    path = steady(6.0)
    friction, slope, log_speed = style_features(path)
    assert slope == pytest.approx(SLOPE, rel=3e-3)  # of the slope prior, over 240 m
    assert np.exp(log_speed) == pytest.approx(6.0, rel=1e-2)
    # what the slope pulls is lost to snow and air alone; priors hold friction off it by less than a percent
    longer = np.hypot(1.0, SLOPE)
    lost = SLOPE / longer - DRAG * (longer * 6.0) ** 2 / 9.81
    assert friction == pytest.approx(lost / LOAD, rel=0.02)
    np.testing.assert_allclose(style_features(path, 10.0, 20.0), [friction, slope, log_speed], rtol=0.02)


@pytest.mark.parametrize(("speed", "style"), [(14.0, "carving"), (6.0, "skidding"), (2.0, "wedge")])
def test_a_fast_run_is_carved_and_a_slow_one_a_wedge(speed: float, style: str) -> None:
    figures = style_of(steady(speed))
    assert figures.most_likely == style
    assert figures.carving + figures.skidding + figures.wedge == pytest.approx(1.0, rel=1e-12)


def test_more_friction_is_less_carving_and_doubt_draws_towards_the_middle() -> None:
    model = style_model()
    features = model.mean.copy()
    little, much = (features + [change, 0.0, 0.0] for change in (-0.08, 0.08))
    carved = STYLES.index("carving")
    assert model.probabilities(little)[carved] > model.probabilities(much)[carved]
    sure, unsure = model.probabilities(little), model.probabilities(little, 0.2)
    assert unsure[carved] < sure[carved]
    assert unsure.sum() == pytest.approx(1.0, rel=1e-12)


def test_whole_turns_have_their_technique_and_phases_none() -> None:
    path = steady(14.0)
    turns = pd.DataFrame({"phase": ["turn", "control", "turn"], "start_s": [5.0, 6.0, 38.9], "end_s": [8.0, 7.0, 39.0]})
    table = add_styles(turns, path)
    shares = table[[f"technique_{style}" for style in STYLES]].to_numpy()
    np.testing.assert_allclose(shares[[0, 2]].sum(axis=1), 1.0, rtol=1e-12)
    assert np.all(np.isnan(shares[1]))
    assert list(turns.columns) == ["phase", "start_s", "end_s"]


def test_a_time_between_two_nodes_has_the_nearest_interval() -> None:
    path = steady(6.0)
    instant = style_features(path, 10.01, 10.02)
    np.testing.assert_allclose(instant, style_features(path), rtol=0.02)


def test_a_summary_holds_the_technique_and_one_without_it_has_no_such_group() -> None:
    figures = style_of(steady(6.0))
    table = summary_to_dict(replace(Summary(), technique=figures))
    assert set(table["technique"]) == {*STYLES, "most_likely"}
    assert summary_from_dict(table).technique == figures
    assert "technique" not in summary_to_dict(Summary())
