"""Test a residual for the signatures of usual model errors, all outputs at once.

Each signature is one added parameter; its score over its deviation is a t statistic (Rao's score
test; Klein & Morelli, Aircraft System Identification, ch. 5, for the same use of partial F). The
largest of them is judged by the number of signatures that are really different (Galwey, Genetic
Epidemiology 33, 2009: from the eigenvalues of their correlation).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import special

from host.arrays import Array
from host.sysid.numerics.ar_noise import ArNoise

TAKEN = 1e-4  # of a signature's power that the parameters leave: with less they are the same
SAME = 1e-3  # of the largest eigenvalue of their correlation: less tells no two apart
FEWEST_FREEDOM = 30.0  # of the noise along a signature, for a test
# Means: noise of two outputs is compared up to so many apart. A gust that rolls the aircraft
# reaches the roll rate at once, the bank angle two means later.
LONGEST_LAG = 3
SHOWS = 0.2  # of a signature's information: an output with more shows the error


@dataclass(frozen=True, slots=True)
class SignatureTest:
    """The signature that stands out most.

    Attributes
    ----------
    name : str
    p_value : float
        Corrected for the number of signatures.
    ratio : float
        Mean power over that of noise along all that signatures span: 1 if the model is right.
    outputs : tuple of str
        Those that show it.
    shift : Array, shape (P,)
        Of the estimate, had the model this error at the size that the residual shows: the bias of
        omitted variables, -C J' W z a with signature z and size a (EQUATIONS.md, eq. 36).
    """

    name: str
    p_value: float
    ratio: float
    outputs: tuple[str, ...]
    shift: Array


@dataclass(frozen=True)
class WhitenedOutput:
    """One output: sensitivities and residuals whitened, signatures as they are, per maneuver."""

    slopes: Sequence[Array]
    signatures: Sequence[Array]
    residuals: Sequence[Array]
    noise: ArNoise
    variance: float


def signature_test(
    outputs: Sequence[str],
    names: Sequence[str],
    data: Sequence[WhitenedOutput],
    inverse: Array,
    score: Array,
) -> SignatureTest:
    """Return the signature that explains most of the residual beside the parameters.

    Parameters
    ----------
    outputs, names : sequence of str
        Of the outputs and the signatures.
    data : sequence of WhitenedOutput
    inverse : Array, shape (P, P)
        Covariance of the parameters, prior included.
    score : Array, shape (P,)
    """
    white = [[d.noise.whiten(Z) for Z in d.signatures] for d in data]
    cross = np.sum(
        [
            J.T @ Z / d.variance
            for d, blocks in zip(data, white, strict=True)
            for J, Z in zip(d.slopes, blocks, strict=True)
        ],
        axis=0,
    )
    parts = np.array(
        [
            np.sum([np.sum(Z * Z, axis=0) for Z in blocks], axis=0) / d.variance
            for d, blocks in zip(data, white, strict=True)
        ]
    )
    gram = sum(Z.T @ Z / d.variance for d, blocks in zip(data, white, strict=True) for Z in blocks)
    right = sum(
        Z.T @ e / d.variance
        for d, blocks in zip(data, white, strict=True)
        for Z, e in zip(blocks, d.residuals, strict=True)
    )
    link = inverse @ cross
    inner = gram - cross.T @ link
    left = np.diag(inner) > TAKEN * np.maximum(np.diag(gram), 1e-300)
    reduced = [
        [Z - J @ link for Z, J in zip(blocks, d.slopes, strict=True)]
        for d, blocks in zip(data, white, strict=True)
    ]
    freedom = _freedom(data, reduced)
    free = left & (freedom >= FEWEST_FREEDOM)
    if not free.any():
        return SignatureTest("", 1.0, 1.0, (), np.zeros(len(score)))
    inner, power = inner[np.ix_(free, free)], np.diag(inner)[free]
    variance = power + np.maximum(_between_outputs(data, reduced)[free], 0.0)
    scores = (right - link.T @ score)[free] / np.sqrt(variance)
    squares = scores**2
    values, vectors = np.linalg.eigh(inner / np.sqrt(np.outer(power, power)))
    values = np.maximum(values, 0.0)
    known = values > SAME * values[-1]
    different = float(np.sum(np.sqrt(values)) ** 2 / np.sum(values))
    single = special.fdtrc(1.0, freedom[free], squares)
    best = int(np.argmin(single))
    place = int(np.flatnonzero(free)[best])
    share = parts[:, place] / np.sum(parts[:, place])
    return SignatureTest(
        name=names[place],
        p_value=float(-np.expm1(different * np.log1p(-min(single[best], 1.0 - 1e-16)))),
        ratio=float(np.mean((vectors.T @ scores)[known] ** 2 / values[known])),
        outputs=tuple(y for y, part in zip(outputs, share, strict=True) if part > SHOWS),
        shift=-link[:, place] * scores[best] * np.sqrt(variance[best]) / power[best],
    )


def _between_outputs(data: Sequence[WhitenedOutput], reduced: Sequence[Sequence[Array]]) -> Array:
    """Return what noise that two outputs share adds to the variance of each score, (errors,).

    A gust moves all outputs. Taken for independent, they made an error out of one gust that two of
    them felt: beta and ay go together by -0.8 there.
    """
    total = np.zeros(reduced[0][0].shape[1])
    lags = range(-LONGEST_LAG, LONGEST_LAG + 1)
    for k, (second, late) in enumerate(zip(data, reduced, strict=True)):
        for first, early in list(zip(data, reduced, strict=True))[:k]:
            both = first.variance * second.variance
            samples = sum(len(e) for e in first.residuals)
            for lag in lags:
                noise = sum(
                    float(a @ b) for a, b in _lagged(first.residuals, second.residuals, lag)
                )
                power = sum(np.sum(a * b, axis=0) for a, b in _lagged(early, late, lag))
                taper = 1.0 - abs(lag) / (LONGEST_LAG + 1)  # Bartlett's, for a positive variance
                total += 2.0 * taper * noise / samples * power / both
    return total


def _lagged(
    first: Sequence[Array], second: Sequence[Array], lag: int
) -> Iterator[tuple[Array, Array]]:
    """Return rows of the first beside rows of the second that are `lag` later."""
    for a, b in zip(first, second, strict=True):
        n = len(a) - abs(lag)
        if n > 0:
            yield a[max(-lag, 0) :][:n], b[max(lag, 0) :][:n]


def _freedom(data: Sequence[WhitenedOutput], reduced: Sequence[Sequence[Array]]) -> Array:
    """Return the degrees of freedom of the noise's power along each signature, (errors,).

    As of `input_coherence`: 2 / var(log power), outputs by their share.
    """
    powers, variances = [], []
    for d, white in zip(data, reduced, strict=True):
        order = d.noise.order
        samples = sum(len(e) for e in d.residuals)
        power = np.sum([np.sum(w * w, axis=0) for w in white], axis=0)
        log_variance = np.full(len(power), 2.0 / samples)
        if order > 0:
            slopes = np.zeros((order, len(power)))
            for w, Z in zip(white, d.signatures, strict=True):
                for k in range(1, order + 1):
                    slopes[k - 1] -= 2.0 * np.sum(w[order:] * Z[order - k : len(Z) - k], axis=0)
            slopes /= np.maximum(power, 1e-300)
            log_variance += np.sum((d.noise.start_whitener @ slopes) ** 2, axis=0) / samples
        powers.append(power / d.variance)
        variances.append(log_variance)
    share = np.array(powers) / np.maximum(np.sum(powers, axis=0), 1e-300)
    return np.asarray(2.0 / np.maximum(np.sum(share**2 * np.array(variances), axis=0), 1e-300))
