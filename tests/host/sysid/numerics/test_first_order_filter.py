"""The filter of first order beside scipy's."""

import numpy as np
import pytest
from host.sysid.numerics.first_order_filter import first_order_filter
from scipy.signal import lfilter


@pytest.mark.parametrize("shape", [(300,), (300, 3), (1,), (2, 2)])
@pytest.mark.parametrize("pole", [0.0, 0.97, -0.5, 1.0])
def test_it_is_that_of_scipy(shape: tuple[int, ...], pole: float) -> None:
    values = np.random.default_rng(3).normal(size=shape)
    b, a = np.array([0.3, -0.1]), np.array([1.0, -pole])
    expected = lfilter(b, a, values, axis=0)
    np.testing.assert_allclose(first_order_filter(b, a, values), expected, atol=1e-12)
