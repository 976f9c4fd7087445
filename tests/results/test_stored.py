"""What a stored run gives besides its columns."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from a_run import a_result, a_run

from sssi_exudyn.terrain.surface import surface_over

RISE = 0.1
"""Of the snow, m a metre to the left."""


def test_the_snow_force_of_a_result() -> None:
    np.testing.assert_allclose(a_run().snow_force("right"), a_result().snow.force[:, 1], atol=1e-9)


def test_an_older_result_has_its_load_along_the_snow_under_the_foot() -> None:
    run, result = a_run(), a_result()
    old = run.series[[name for name in run.series if "_snow_" not in name]]
    empty = surface_over(result.com[:, :2], 5.0, 60.0)
    surface = replace(empty, mean=(RISE * empty.nodes()[:, 1]).reshape(empty.mean.shape))
    older = replace(run, series=old, model=replace(run.model, surface=surface))
    normal = np.array([0.0, -RISE, 1.0]) / np.hypot(1.0, RISE)
    expected = result.foot_load[:, :1] * normal + result.foot_friction[:, 0]
    np.testing.assert_allclose(older.snow_force("left"), expected, atol=1e-6)
