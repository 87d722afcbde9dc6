"""A direction without information has no small variance."""

import numpy as np
from host.sysid.numerics.information_inverse import covariance_from_information


def test_what_is_not_known_is_not_known_exactly() -> None:
    rng = np.random.default_rng(1)
    X = rng.standard_normal((50, 4)) * [1.0, 1e6, 1e-6, 1.0]
    np.testing.assert_allclose(
        covariance_from_information(X.T @ X), np.linalg.inv(X.T @ X), rtol=1e-8
    )
    X[:, 3] = 0.5 * X[:, 0]  # the same column twice
    covariance = covariance_from_information(X.T @ X)
    alone = np.linalg.inv(X[:, 1:3].T @ X[:, 1:3])
    assert np.diag(covariance)[[0, 3]].min() > 1e9
    np.testing.assert_allclose(np.diag(covariance)[1:3], np.diag(alone), rtol=0.2)
    X[:, 3] = 0.0  # a parameter that nothing depends on, or one held on its bound
    assert not covariance_from_information(X.T @ X)[3].any()
    assert not covariance_from_information(np.zeros((2, 2))).any()
