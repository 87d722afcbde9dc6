"""The gust-free simulation behind the instrumental variables never runs away."""

import numpy as np
import pytest
from host.sysid.coefficients.auxiliary_model import stabilised


def test_growing_motion_dies_away_as_fast_and_the_rest_stays() -> None:
    rng = np.random.default_rng(8)
    turn = rng.standard_normal((4, 4))
    roots = np.diag([0.5, -3.0, -1.0, -1.0])
    roots[2, 3], roots[3, 2] = 2.0, -2.0
    A = turn @ roots @ np.linalg.inv(turn)
    found = np.sort_complex(np.linalg.eigvals(stabilised(A)))
    expected = np.sort_complex(np.array([-3.0, -1.0 - 2.0j, -1.0 + 2.0j, -0.5]))
    np.testing.assert_allclose(found, expected, atol=1e-9)
    calm = turn @ np.diag([-0.5, -3.0, -1.0, -2.0]) @ np.linalg.inv(turn)
    assert stabilised(calm) is calm


def test_a_motion_that_stands_dies_away_too() -> None:
    assert np.linalg.eigvals(stabilised(np.zeros((2, 2)))).real == pytest.approx(-0.1)
