"""One step of a Kalman filter: what measurements do to state and covariance, and what time does."""

from __future__ import annotations

import numpy as np

from host.arrays import Array


def corrected(
    x: Array, P: Array, H: Array, innovation: Array, variance: Array
) -> tuple[Array, Array, Array]:
    """Return state and covariance given measurements, and the innovations whitened.

    With S = H P H' + R = L L' and B = L^-1 H P, the state moves by B' L^-1 nu and the covariance by
    -B' B, which keeps it symmetric (Anderson & Moore, Optimal Filtering, 1979, sec. 6.5).

    Parameters
    ----------
    x, P : Array, shape (n,), (n, n)
        Predicted.
    H : Array, shape (p, n)
        Slopes of the measurements by the state.
    innovation, variance : Array, shape (p,)
        Measured less predicted, and variances of the noise, uncorrelated.

    Raises
    ------
    numpy.linalg.LinAlgError
        If the covariance is none.
    """
    HP = H @ P
    S = HP @ H.T
    S.flat[:: len(S) + 1] += variance
    right = np.concatenate([innovation[:, None], HP], axis=1)
    both = np.linalg.solve(np.linalg.cholesky(S), right)
    white, B = both[:, 0], both[:, 1:]
    return x + B.T @ white, P - B.T @ B, white


def predicted(P: Array, F: Array, power: Array) -> Array:
    """Return the covariance F P F' + Q a sample ahead; `power` (n,) is the diagonal of Q."""
    ahead = np.asarray(F @ (0.5 * (P + P.T)) @ F.T)
    ahead.flat[:: len(P) + 1] += power
    return ahead
