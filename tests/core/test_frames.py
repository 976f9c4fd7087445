"""Frames: products of vectors."""

import numpy as np
import pytest

from sssi_exudyn.core.frames import cross


@pytest.mark.parametrize("shapes", [((3,), (3,)), ((50, 3), (3,)), ((3,), (7, 2, 3)), ((5, 4, 3), (4, 3))])
@pytest.mark.parametrize("step", [0.0, 1e-20j])
def test_cross_is_numpys_bit_for_bit(shapes, step):
    random = np.random.default_rng(3)
    a, b = (random.standard_normal(shape) + step * random.standard_normal(shape) for shape in shapes)
    np.testing.assert_array_equal(cross(a, b), np.cross(a, b))
