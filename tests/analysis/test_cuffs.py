"""A standing skier in boots: the moment that the cuffs take, and the moment left to the muscles."""

from dataclasses import replace
from pathlib import Path

import gliding
import numpy as np
import pytest
import standing

from sssi_exudyn.analysis.boots import add_cuffs, cuff_column
from sssi_exudyn.core.frames import slope_to_enu
from sssi_exudyn.model.model import Model
from sssi_exudyn.muscle_forces.forces import MUSCLED
from sssi_exudyn.muscle_forces.of_result import muscles_of
from sssi_exudyn.results.stored import StoredRun
from sssi_exudyn.results.summary import Summary

STIFF, LEAN = 200.0, 0.1
BENT = standing.CROUCH["ankle_angle"]


def in_boots() -> Model:
    level = replace(gliding.model(), inclination=0.0)
    return replace(level, equipment=replace(level.equipment, cuff_flexion=STIFF, cuff_lean=LEAN))


def test_a_static_cuff_in_series_and_figures() -> None:
    model = in_boots()
    stood = standing.standing(model)
    series, figures = add_cuffs(stood.to_frame(slope_to_enu(0.0, 0.0)), stood, model)
    expected = -STIFF * (BENT - LEAN)  # -50 N m: it pushes the shank back, the foot down
    np.testing.assert_allclose(series[cuff_column("left", "flexion")], expected, rtol=1e-12)
    assert cuff_column("left", "edging") not in series.columns  # this result has no moment about the foot's long axis
    assert figures is not None
    assert figures.flexion_se_Nm_per_deg is None
    assert figures.lean_stated
    assert figures.ankles is not None
    left = figures.ankles["left"]
    assert left.cuff_peak_Nm == pytest.approx(expected)
    assert left.moment_peak_Nm is not None
    # nothing moves: what is left is the ankle's moment less the cuff's
    assert left.muscles_rms_Nm == pytest.approx(abs(left.moment_peak_Nm - expected), rel=1e-6)
    assert left.edging_rms_Nm is None


def test_a_cuff_that_is_not_stated_bears_what_an_ankle_bears_all_the_time() -> None:
    model = replace(gliding.model(), inclination=0.0)
    stood = standing.standing(model)
    _, figures = add_cuffs(stood.to_frame(slope_to_enu(0.0, 0.0)), stood, model)
    assert figures is not None
    assert figures.ankles is not None
    assert figures.flexion_se_Nm_per_deg is not None
    assert figures.ankles["left"].muscles_rms_Nm == pytest.approx(0.0, abs=1e-6)


def test_muscles_are_asked_for_what_the_cuff_leaves() -> None:
    model = in_boots()
    stood = standing.standing(model, samples=10)
    bare = stood.to_frame(slope_to_enu(0.0, 0.0))
    worn, _ = add_cuffs(bare, stood, model)
    wanted = [
        muscles_of(StoredRun(Summary(), series, model, geometry=standing.geometry()), Path()).forces.wanted
        for series in (bare, worn)
    ]
    change = wanted[1] - wanted[0]
    ankles = [MUSCLED.index(f"ankle_angle_{side}") for side in "lr"]
    np.testing.assert_allclose(change[:, ankles], STIFF * (BENT - LEAN), rtol=1e-9)
    others = [k for k in range(len(MUSCLED)) if k not in ankles]
    np.testing.assert_array_equal(change[:, others], 0.0)  # inside the ankle: knee and hip notice nothing
