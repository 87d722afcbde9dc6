"""Test a residual for the signatures of usual model errors, all outputs at once.

Each signature is one added parameter; its score over its deviation is a t statistic (Rao's score
test; Klein & Morelli, Aircraft System Identification, ch. 5, for the same use of partial F). The
largest of them is judged by the number of signatures that are really different (Galwey, Genetic
Epidemiology 33, 2009: from the eigenvalues of their correlation).

A gust moves every output: beta and ay go together by -0.8 there, the bank angle follows the roll
rate. Output error weighs outputs as if their noises were independent; a score that two of them show
then varies by twice what it says. Each output is whitened by a model of its own, so that what they
share is a correlation over a few lags (Newey & West, Econometrica 55, 1987).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from scipy import special

from host.arrays import Array
from host.sysid.numerics.ar_noise import ArNoise
from host.sysid.numerics.information_inverse import identified_inverse
from host.sysid.numerics.input_drive import FEWEST_FREEDOM

TAKEN = 1e-4  # of a signature's power that the parameters leave: with less they are the same
SAME = 1e-3  # of the largest eigenvalue of their correlation: less tells no two apart
LEAST = 0.1  # of a score's variance in independent noise: what two outputs may take off it
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
        Shift of the estimate, had the model this error at the size that the residual shows: the
        bias of omitted variables, -C J' W z a with signature z and size a (EQUATIONS.md, eq. 36).
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
    """Return the signature that explains most of the residual besides the parameters.

    Parameters
    ----------
    outputs, names : sequence of str
        Names of the outputs and the signatures.
    data : sequence of WhitenedOutput
    inverse : Array, shape (P, P)
        Covariance of the parameters, prior included.
    score : Array, shape (P,)
    """
    white = [[d.noise.whiten(Z) for Z in d.signatures] for d in data]
    cross, gram, right, parts = _sums(data, white)
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
    inner, raw = inner[np.ix_(free, free)], (right - link.T @ score)[free]
    testable = [[w[:, free] for w in own] for own in reduced]
    size = identified_inverse(inner) @ raw
    covariance = _score_covariance(data, testable, inner, size, inverse @ score)
    deviation = np.sqrt(np.maximum(np.diag(covariance), LEAST * np.diag(inner)))
    scores = raw / deviation
    values, vectors = np.linalg.eigh(covariance / np.outer(deviation, deviation))
    values = np.maximum(values, 0.0)
    known = values > SAME * values[-1]
    different = float(np.sum(np.sqrt(values)) ** 2 / np.sum(values))
    single = special.fdtrc(1.0, freedom[free], scores**2)
    best = int(np.argmin(single))
    place = int(np.flatnonzero(free)[best])
    share = parts[:, place] / np.sum(parts[:, place])
    return SignatureTest(
        name=names[place],
        p_value=float(-np.expm1(different * np.log1p(-min(single[best], 1.0 - 1e-16)))),
        ratio=float(np.mean((vectors.T @ scores)[known] ** 2 / values[known])),
        outputs=tuple(y for y, part in zip(outputs, share, strict=True) if part > SHOWS),
        shift=-link[:, place] * raw[best] / inner[best, best],
    )


def _sums(
    data: Sequence[WhitenedOutput], white: Sequence[Sequence[Array]]
) -> tuple[Array, Array, Array, Array]:
    """Return sums of the whitened signatures (k) over all outputs and maneuvers.

    With the slopes, (P, k); with themselves, (k, k); with the residuals, (k,); the power of each in
    each output, (p, k).
    """
    rows = [
        (J, Z, e, d.variance)
        for d, blocks in zip(data, white, strict=True)
        for J, Z, e in zip(d.slopes, blocks, d.residuals, strict=True)
    ]
    cross = np.sum([J.T @ Z / v for J, Z, _, v in rows], axis=0)
    gram = np.sum([Z.T @ Z / v for _, Z, _, v in rows], axis=0)
    right = np.sum([Z.T @ e / v for _, Z, e, v in rows], axis=0)
    parts = [
        np.sum([np.sum(Z * Z, axis=0) for Z in blocks], axis=0) / d.variance
        for d, blocks in zip(data, white, strict=True)
    ]
    return cross, gram, right, np.array(parts)


def _score_covariance(
    data: Sequence[WhitenedOutput],
    reduced: Sequence[Sequence[Array]],
    inner: Array,
    size: Array,
    step: Array,
) -> Array:
    """Return the covariance of the scores, noise that outputs share included, (errors, errors).

    Noise is what parameters and signatures together leave: an error that is there is none.
    """
    scale = [np.sqrt(d.variance) for d in data]
    noise = [
        [(e - J @ step - w @ size) / s for e, J, w in zip(d.residuals, d.slopes, own, strict=True)]
        for d, own, s in zip(data, reduced, scale, strict=True)
    ]
    columns = [[w / s for w in own] for own, s in zip(reduced, scale, strict=True)]
    return np.asarray(inner + shared_noise_covariance(noise, columns))


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


# Means: a gust that rolls the aircraft reaches the roll rate at once, the bank angle two later.
LONGEST_LAG = 3


def shared_noise_covariance(
    noise: Sequence[Sequence[Array]], columns: Sequence[Sequence[Array]]
) -> Array:
    """Return what noise between outputs adds to the covariance of sums of columns' times noise.

    Parameters
    ----------
    noise : sequence of sequence of Array, shape (samples,)
        Innovations of each output in each maneuver, of variance one.
    columns : sequence of sequence of Array, shape (samples, k)
        What each is summed with, in the same units.

    Returns
    -------
    Array, shape (k, k)
    """
    total = np.zeros((columns[0][0].shape[1],) * 2)
    samples = sum(len(e) for e in noise[0])
    for (first, early), (second, late) in combinations(zip(noise, columns, strict=True), 2):
        for lag in range(-LONGEST_LAG, LONGEST_LAG + 1):
            correlation = sum(float(a @ b) for a, b in _lagged(first, second, lag)) / samples
            taper = 1.0 - abs(lag) / (LONGEST_LAG + 1)  # Bartlett's, for a positive variance
            product = sum(a.T @ b for a, b in _lagged(early, late, lag))
            total += taper * correlation * (product + np.transpose(product))
    return total


def _lagged(
    first: Sequence[Array], second: Sequence[Array], lag: int
) -> Iterator[tuple[Array, Array]]:
    """Yield rows of the first with rows of the second that are `lag` later."""
    for a, b in zip(first, second, strict=True):
        n = len(a) - abs(lag)
        if n > 0:
            yield a[max(-lag, 0) :][:n], b[max(lag, 0) :][:n]
