"""Noise of all outputs together: a vector autoregression, estimated with what a fit took of it.

A gust moves all outputs, one after the other. Autoregressions of single outputs, of which only the
innovations are correlated, give the yaw row of a white fit 0.7 of its deviation in side gusts.

Reinsel, Elements of Multivariate Time Series Analysis, 2nd ed., sec. 4.3 and 5.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from host.arrays import Array
from host.sysid.models.uncertainty import covariance_root
from host.sysid.numerics.ar_noise import HIGHEST_ORDER, POLE_LIMIT
from host.sysid.numerics.information_inverse import identified_inverse
from host.sysid.numerics.input_coherence import driven_data, prior_of
from host.sysid.numerics.input_drive import OutputData
from host.sysid.numerics.output_error_problem import OutputProblem
from host.sysid.numerics.simulator import Response

# Rounds of expectation and maximisation. Thirty make a dutch roll's deviation 1.3 times as large,
# but the order of least BIC changes between them, and rounding decides which is the last.
ROUNDS = 5


@dataclass(frozen=True, slots=True)
class JointNoise:
    """Noise e[k] = A1 e[k-1] + ... + w[k] of p outputs, w white (EQUATIONS.md, eq. 27).

    Attributes
    ----------
    coefficients : Array, shape (order, p, p)
    covariance : Array, shape (p, p)
        Covariance of the innovations w.
    """

    coefficients: Array
    covariance: Array

    def whiten(self, values: Array) -> Array:
        """Return the innovations in their deviations, (samples - order, p, c).

        Parameters
        ----------
        values : Array, shape (samples, p, c)
        """
        order = len(self.coefficients)
        left = values[order:].copy()
        for lag, A in enumerate(self.coefficients, start=1):
            left -= A @ values[order - lag : len(values) - lag]
        lower = np.linalg.cholesky(self.covariance)
        return np.asarray(np.linalg.inv(lower) @ left)

    def power(self, samples: int) -> Array:
        """Return the mean square of each output so long after rest, (p,).

        Parameters
        ----------
        samples : int
        """
        outputs, order = len(self.covariance), len(self.coefficients)
        response = [np.linalg.cholesky(self.covariance)]
        for _ in range(samples - 1 if order else 0):
            last = zip(self.coefficients, reversed(response[-order:]), strict=False)
            response.append(sum((A @ before for A, before in last), np.zeros((outputs, outputs))))
        return np.asarray(np.sum(np.square(response), axis=(0, 2)))

    def by_innovations(self, slopes: Array) -> Array:
        """Return G with S' n = G' w for a noise n that began a record's length before the slopes S.

        The innovations w are in their deviations.

        Parameters
        ----------
        slopes : Array, shape (samples, p, c)

        Returns
        -------
        Array, shape (2 samples, p, c)
        """
        result = np.concatenate([np.zeros_like(slopes), slopes])
        turned = np.swapaxes(self.coefficients, 1, 2)
        for t in range(len(result) - 2, -1, -1):
            for lag, A in enumerate(turned[: len(result) - 1 - t], start=1):
                result[t] += A @ result[t + lag]
        return np.asarray(np.linalg.cholesky(self.covariance).T @ result)


def noise_of_outputs(
    problem: OutputProblem,
    responses: Sequence[Response],
    theta: Array,
    nuisance: Sequence[Array] = (),
) -> JointNoise:
    """Return the noise of all outputs, without what inputs drive and known errors do.

    Parameters
    ----------
    problem : OutputProblem
    responses : sequence of Response
        At the estimate.
    theta : Array, shape (P,)
        The estimate, constants of the maneuvers included.
    nuisance : sequence of Array, shape (p, samples, k)
        As of `input_coherence`.
    """
    data = driven_data(problem, responses, nuisance)
    return joint_noise(data, *prior_of(problem, theta, data), problem.least_variance)


def joint_noise(
    data: Sequence[OutputData], prior: Array, pulled: Array, least_variance: Array
) -> JointNoise:
    """Return the noise in the residuals of a fit, by restricted likelihood.

    What the parameters and the added columns of each output may have taken is counted as noise
    (expectation-maximisation); the order is that of least BIC.

    Parameters
    ----------
    data : sequence of OutputData
        One of each output, of successive means.
    prior, pulled : Array, shape (P,)
        Prior by `prior_of`.
    least_variance : Array, shape (p,)
    """
    residuals = [np.stack(e, axis=1) for e in zip(*(d.residuals for d in data), strict=True)]
    slopes = [_stacked(data, number) for number in range(len(residuals))]
    more = np.zeros(slopes[0].shape[2] - len(prior))
    precision, score = np.concatenate([prior, more]), np.concatenate([pulled, more])
    power = np.maximum(np.mean(np.concatenate(residuals) ** 2, axis=0), least_variance)
    noise = JointNoise(np.zeros((0, len(data), len(data))), np.diag(power))
    for _ in range(ROUNDS):
        total, right = np.diag(precision), score.copy()
        for e, J in zip(residuals, slopes, strict=True):
            flat = noise.whiten(J).reshape(-1, J.shape[2])
            total += flat.T @ flat
            right += flat.T @ noise.whiten(e[:, :, None]).ravel()
        inverse = identified_inverse(total)
        step, root = inverse @ right, covariance_root(inverse)
        parts = [
            np.concatenate([(e - J @ step)[:, :, None], J @ root], axis=2)
            for e, J in zip(residuals, slopes, strict=True)
        ]
        noise = _of_least_bic(parts, np.diag(least_variance))
    return noise


def _stacked(data: Sequence[OutputData], number: int) -> Array:
    """Return slopes of a maneuver, the added columns of each output behind, (samples, p, P + k)."""
    blocks = []
    for d in data:
        added = [other.added[number] * float(other is d) for other in data]
        blocks.append(np.hstack([d.slopes[number], *added]))
    return np.stack(blocks, axis=1)


def _of_least_bic(parts: Sequence[Array], least: Array) -> JointNoise:
    """Return the autoregression of least BIC; columns are draws of vectors, (samples, p, c)."""
    moments = _moments(parts, HIGHEST_ORDER)
    outputs = parts[0].shape[1]
    count = max(sum(len(x) for x in parts) - HIGHEST_ORDER * len(parts), 1)
    best, found = np.inf, None
    for order in range(HIGHEST_ORDER + 1):
        coefficients, squares = _solved(moments, order)
        covariance = _positive(squares, np.diag(moments[0, 0])) / count + least
        criterion = count * np.linalg.slogdet(covariance)[1] + np.log(count) * order * outputs**2
        if found is None or criterion < best:
            best, found = criterion, JointNoise(_stable(coefficients), covariance)
    assert found is not None
    return found


def _moments(parts: Sequence[Array], highest: int) -> Array:
    """Return sums of x[k - a] x[k - b]' over k, (a, b, p, p)."""
    outputs = parts[0].shape[1]
    total = np.zeros((highest + 1, highest + 1, outputs, outputs))
    for x in parts:
        rows = len(x) - highest
        if rows < 1:
            continue
        lagged = [
            np.swapaxes(x[highest - a : highest - a + rows], 0, 1).reshape(outputs, -1)
            for a in range(highest + 1)
        ]
        for a, left in enumerate(lagged):
            for b, right in enumerate(lagged[: a + 1]):
                both = left @ right.T
                total[a, b] += both
                if a != b:
                    total[b, a] += both.T
    return total


def _solved(moments: Array, order: int) -> tuple[Array, Array]:
    """Return coefficients (order, p, p) and the sum of squared innovations (p, p)."""
    outputs = moments.shape[-1]
    if order == 0:
        return np.zeros((0, outputs, outputs)), moments[0, 0]
    inner = moments[1 : order + 1, 1 : order + 1].swapaxes(1, 2).reshape(order * outputs, -1)
    right = moments[0, 1 : order + 1].swapaxes(0, 1).reshape(outputs, -1)
    found = right @ identified_inverse(inner)
    squares = moments[0, 0] - found @ right.T
    return found.reshape(outputs, order, outputs).swapaxes(0, 1), squares


def _positive(squares: Array, power: Array) -> Array:
    """Return squares of which rounding made some less than nothing: of a straight line, say."""
    size = np.sqrt(np.maximum(power, 1e-300))
    values, vectors = np.linalg.eigh(squares / np.outer(size, size))
    values = np.maximum(values, len(size) * np.finfo(np.float64).eps)
    return np.asarray(np.outer(size, size) * ((vectors * values) @ vectors.T))


def _stable(coefficients: Array) -> Array:
    """Return coefficients whose poles are shrunk into a circle of radius `POLE_LIMIT`."""
    order, outputs = coefficients.shape[:2]
    if order == 0:
        return coefficients
    companion = np.eye(order * outputs, k=-outputs)
    companion[:outputs] = coefficients.swapaxes(0, 1).reshape(outputs, -1)
    radius = float(np.max(np.abs(np.linalg.eigvals(companion))))
    shrunk = min(1.0, POLE_LIMIT / max(radius, 1e-300)) ** np.arange(1, order + 1)
    return np.asarray(coefficients * shrunk[:, None, None])
