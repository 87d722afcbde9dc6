"""Vector autoregression of noise: statsmodels, innovations made by hand, power of draws."""

import numpy as np
import pytest
from host.arrays import Array
from host.sysid.numerics.input_drive import OutputData
from host.sysid.numerics.joint_noise import JointNoise, joint_noise
from statsmodels.tsa.api import VAR

A1 = np.array([[1.2, 0.3], [-0.4, 0.7]])
A2 = np.array([[-0.5, 0.0], [0.2, -0.3]])
COVARIANCE = np.array([[0.04, 0.03], [0.03, 0.09]])
NOISE = JointNoise(np.array([A1, A2]), COVARIANCE)


def drawn(samples: int, *seeds: int) -> tuple[Array, Array]:
    """Return noise that begins at rest, (samples, 2) of each seed, and its innovations.

    These are in their deviations.
    """
    w = np.array([np.random.default_rng(s).standard_normal((samples, 2)) for s in seeds])
    n = np.zeros_like(w)
    for k in range(samples):
        n[:, k] = w[:, k] @ np.linalg.cholesky(COVARIANCE).T
        n[:, k] += (n[:, k - 1] @ A1.T if k > 0 else 0.0) + (n[:, k - 2] @ A2.T if k > 1 else 0.0)
    return (n, w) if len(seeds) > 1 else (n[0], w[0])


def of_records(records: list[Array]) -> JointNoise:
    """Return what is estimated of records from which no fit took anything."""
    data = [
        OutputData(
            [r[:, j] for r in records],
            [np.zeros((len(r), 1)) for r in records],
            [np.zeros((len(r), 0)) for r in records],
        )
        for j in range(2)
    ]
    return joint_noise(data, np.ones(1), np.zeros(1), np.full(2, 1e-12))


def test_one_record_as_statsmodels_has_it() -> None:
    n, _ = drawn(800, 1)
    found = of_records([n])
    assert len(found.coefficients) == 2
    peer = VAR(n[4:]).fit(2, trend="n")  # orders up to six are compared over the same samples
    np.testing.assert_allclose(found.coefficients, peer.coefs, rtol=1e-6)
    np.testing.assert_allclose(found.covariance, peer.sigma_u_mle, rtol=1e-6)


def test_whitened_are_the_innovations() -> None:
    n, w = drawn(50, 2)
    np.testing.assert_allclose(NOISE.whiten(n[:, :, None])[:, :, 0], w[2:])


def test_score_by_innovations() -> None:
    """S' n = G' w, the noise a record older than the slopes."""
    n, w = drawn(100, 3)
    slopes = np.random.default_rng(4).standard_normal((50, 2, 3))
    G = NOISE.by_innovations(slopes)
    score = np.einsum("tja,tj->a", slopes, n[50:])
    np.testing.assert_allclose(np.einsum("tja,tj->a", G, w), score)


def test_power_is_that_of_draws() -> None:
    last = drawn(60, *range(3000))[0][:, -1]
    np.testing.assert_allclose(NOISE.power(60), np.mean(last**2, axis=0), rtol=0.1)


@pytest.mark.parametrize("rank", [4, 70])
def test_what_a_fit_took_is_counted(rank: int) -> None:
    """Residuals of a fit with as many slow columns have less power than the noise."""
    records, slopes = [], []
    rng = np.random.default_rng(5)
    for seed in range(8):
        n, _ = drawn(120, 10 + seed)
        J = np.cumsum(rng.standard_normal((120, 2, rank)), axis=0)
        flat = J.reshape(240, rank)
        step = np.linalg.lstsq(flat, n.ravel(), rcond=None)[0]
        records.append(n - J @ step)
        slopes.append(J)
    data = []
    for j in range(2):
        own = []
        for k, J in enumerate(slopes):
            wide = np.zeros((120, rank * len(slopes)))
            wide[:, k * rank : (k + 1) * rank] = J[:, j]
            own.append(wide)
        data.append(OutputData([r[:, j] for r in records], own, [np.zeros((120, 0))] * 8))
    none = np.zeros(rank * len(slopes))
    found = joint_noise(data, none, none, np.full(2, 1e-12))
    true = NOISE.power(400)
    left = np.mean(np.concatenate(records) ** 2, axis=0)
    assert np.all(np.abs(found.power(400) / true - 1.0) < 0.25)
    assert rank < 70 or np.sum(left) < 0.75 * np.sum(true)


def test_a_straight_line_is_no_growing_noise() -> None:
    line = np.outer(np.arange(100.0), [1.0, -2.0])
    found = of_records([line])
    companion = np.eye(2 * len(found.coefficients), k=-2)
    companion[:2] = found.coefficients.swapaxes(0, 1).reshape(2, -1)
    assert np.max(np.abs(np.linalg.eigvals(companion)), initial=0.0) < 1.0
    assert np.isfinite(found.power(200)).all()
