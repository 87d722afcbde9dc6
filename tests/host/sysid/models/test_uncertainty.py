"""What a model lacks is in an interval once, in whatever order the tests are heard."""

from __future__ import annotations

from itertools import permutations

import numpy as np
from host.sysid.models.uncertainty import ModelError, Uncertainty

RNG = np.random.default_rng(7)
ROOT = RNG.standard_normal((4, 4))
NOISE = Uncertainty(ROOT @ ROOT.T, np.full(4, np.inf), ("thrust",))


def test_no_order_of_the_tests_moves_the_covariance() -> None:
    heard = (
        ModelError(factor=np.array([1.0, 3.0]), freedom=np.array([np.inf, 4.0]), warnings=("a",)),
        ModelError(factor=np.array([2.0, 1.5, 1.0]), shift=np.array([0.1, -0.4, 2.0])),
        ModelError(least=np.array([90.0, 0.0, 50.0]), shift=np.array([3.0, 0.0, 1.0])),
        ModelError(variance=np.array([0.0, 0.0, 0.7]), freedom=np.array([8.0, 2.0])),
        None,
    )
    first = NOISE.with_model_error(heard)
    assert np.all(first.variance >= NOISE.variance)
    for other in permutations(heard):
        again = NOISE.with_model_error(other)
        np.testing.assert_allclose(again.covariance, first.covariance, rtol=1e-12)
        np.testing.assert_array_equal(again.degrees_of_freedom, [8.0, 2.0, np.inf, np.inf])
        assert set(again.warnings) == {"thrust", "a"}


def test_each_test_speaks_of_the_noise_alone() -> None:
    """Six deviations of a factor hold a variance of 20; 90 is held by nothing but itself."""
    noise = Uncertainty(np.eye(2), np.full(2, np.inf))
    found = [
        ModelError(factor=np.array([2.0, 2.0])),
        ModelError(factor=np.array([3.0, 3.0])),
        ModelError(least=np.array([20.0, 90.0])),
        ModelError(shift=np.array([1.0, 0.0])),
    ]
    np.testing.assert_allclose(noise.with_model_error(found).variance, [37.0, 90.0])


def test_what_is_certain_stays_so_and_no_test_changes_nothing() -> None:
    noise = Uncertainty(np.diag([0.0, 1.0]), np.full(2, np.inf))
    wide = noise.with_model_error([ModelError(least=np.array([5.0, 5.0]))])
    np.testing.assert_allclose(wide.variance, [0.0, 5.0])
    assert noise.with_model_error([None, None]) is noise
