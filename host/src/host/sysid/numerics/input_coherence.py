"""Test whether what a fit leaves is driven by the inputs, in noise of any colour.

The columns of `input_regressors` are added to one output. If the model is right they explain no
more than noise does by chance: an F test of the added columns, everything whitened by AR models of
the noise and freed of what the model's own parameters could still take (a Lagrange multiplier test;
Engle, Handbook of Econometrics II, 1984, ch. 13). All lags are tested as one, so their number is
counted by the degrees of freedom; the number of outputs by Sidak's level. Inputs are what a pilot
moves: thrust and bank, measured columns of a user's equations, follow the gusts that outputs feel.
Lags are taken by hat functions whose knots double, so that a few columns reach from one sample to
seconds.

A second test asks for the signatures of usual errors (`model_error_signatures`), each with its own
shape in all outputs at once, so that a small error is seen; the level of 1 % is shared by halves.

The noise model is estimated together with those columns (restricted likelihood): what inputs
drive is then not taken for noise.

What sensors may have wrong by their file is in the intervals by itself, and no lack of the model:
each error takes of the residual what its deviation allows. Otherwise a right pitot, 1 % off, is
"the scale of az_mps2" in calm air, and half-widths of Cm_q are 3.8 times the rms error.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import special

from host.arrays import Array, BoolArray
from host.constants import BLOCK_S, SIGNIFICANCE
from host.sysid.numerics.ar_noise import HIGHEST_ORDER, ArNoise
from host.sysid.numerics.information_inverse import covariance_from_information
from host.sysid.numerics.input_drive import (
    FittedParameters,
    OutputData,
    added_power,
    gram,
    noise_model,
    reduced_normal,
    total_score,
    whiten,
)
from host.sysid.numerics.model_error_signatures import model_error_signatures
from host.sysid.numerics.output_error_problem import OutputProblem
from host.sysid.numerics.signature_test import SignatureTest, WhitenedOutput, signature_test
from host.sysid.numerics.simulator import Response

SUSPICION = 0.10  # from here on intervals count that it may
ROUNDS_WITHOUT, ROUNDS_WITH = 2, 3  # of the noise models: first without the added columns
SHOWS = 0.1  # of the power of noise: a known error with less takes nothing of the residual


@dataclass(frozen=True)
class InputCoherence:
    """Residuals of a fit against what its inputs could drive.

    Attributes
    ----------
    outputs : tuple of str
    ratio : Array, shape (p,)
        F: power along the added columns over that of noise; 1 if the model is right.
    p_value : Array, shape (p,)
        Probability of each output alone.
    columns : Array, shape (p,)
        Degrees of freedom of the numerator.
    noise : tuple of ArNoise
        Noise of each output, without what the inputs drive.
    innovation_variance : Array, shape (p,)
    signature : SignatureTest
        Test of the signatures of usual errors of a model.
    samples : int
        Means that were tested, of each output.
    information : Array, shape (p, P, P)
        Information of each output, whitened by this noise.
    prior_precision : Array, shape (P,)
    """

    outputs: tuple[str, ...]
    ratio: Array
    p_value: Array
    columns: Array
    noise: tuple[ArNoise, ...]
    innovation_variance: Array
    signature: SignatureTest
    samples: int
    information: Array
    prior_precision: Array

    @property
    def coherent(self) -> tuple[str, ...]:
        """Outputs whose residual the inputs drive; 1 % of right fits name any."""
        return self._outputs_at(SIGNIFICANCE)

    @property
    def suspected(self) -> tuple[str, ...]:
        """The same at 10 %: for intervals an error that may be there counts too."""
        return self._outputs_at(SUSPICION)

    @property
    def likely_error(self) -> str:
        """What the model lacks or has wrong, by its signature; empty if none stands out."""
        return self.signature.name if self.signature.p_value < 0.5 * SIGNIFICANCE else ""

    @property
    def shift(self) -> Array:
        """Bias of the estimate by the error that is suspected, (P,); zero without."""
        return self.signature.shift * float(self.signature.p_value < 0.5 * SUSPICION)

    def dominated(self, ratio: float) -> tuple[str, ...]:
        """Return the coherent outputs whose power ratio is at least so large."""
        powers = dict(zip(self.outputs, self._weights(), strict=True))
        return tuple(name for name in self.coherent if powers[name] >= ratio)

    def _outputs_at(self, significance: float) -> tuple[str, ...]:
        """Return the outputs that either test names; each test takes half of the level."""
        level = 1.0 - (1.0 - 0.5 * significance) ** (1.0 / len(self.outputs))
        shown = self.signature.outputs if self.signature.p_value < 0.5 * significance else ()
        return tuple(
            n for n, p in zip(self.outputs, self.p_value, strict=True) if p < level or n in shown
        )

    def _weights(self) -> Array:
        """Return the power ratio of each suspected output, 1 of the others."""
        shown = self.signature.p_value < 0.5 * SUSPICION
        least = max(self.signature.ratio, 1.0) if shown else 1.0
        suspected = np.array([name in self.suspected for name in self.outputs])
        return np.where(suspected, np.maximum(self.ratio, least), 1.0)

    def covariance(self) -> Array:
        """Return the covariance in this noise, (P, P)."""
        total = np.diag(self.prior_precision) + np.sum(self.information, axis=0)
        return covariance_from_information(total)

    def widened_covariance(self) -> Array:
        """Return the covariance if the model lacks along its parameters what it lacks outside them.

        The power of a coherent residual over that of noise is `ratio` along the columns that the
        parameters cannot take. Along those that they took it cannot be seen, and is held to be the
        same: the score of that output has `ratio` times its variance (as by a Birge ratio).
        """
        inverse = self.covariance()
        weighed = np.einsum("j,jkl->kl", self._weights(), self.information)
        return np.asarray(inverse @ (np.diag(self.prior_precision) + weighed) @ inverse)


def input_coherence(
    problem: OutputProblem,
    responses: Sequence[Response],
    theta: Array,
    *,
    nuisance: Sequence[Array] = (),
    highest_order: int = HIGHEST_ORDER,
    block_s: float = BLOCK_S,
) -> InputCoherence:
    """Test the residuals of a free simulation against what the inputs drive.

    Parameters
    ----------
    problem : OutputProblem
        Model and data.
    responses : sequence of Response
        Response of the model at the estimate, one of each maneuver.
    theta : Array, shape (P,)
        The estimate, constants of the maneuvers included.
    nuisance : sequence of Array, shape (p, samples, k)
        Change of the residual of each maneuver by one deviation of each of k errors that are
        counted elsewhere; none without.
    highest_order : int
        Highest order of the AR models.
    block_s : float
        Residuals are taken in means over this long; 0 keeps the samples, and the noise models are
        then those of samples.
    """
    data = driven_data(problem, responses, nuisance, block_s)
    count = len(problem.names)
    prior, pulled = prior_of(problem, theta, data)
    noise = [ArNoise.white() for _ in data]
    variance = np.array([np.mean(np.concatenate(d.residuals) ** 2) for d in data])
    variance = np.maximum(variance, problem.least_variance)
    whitened = [whiten(d, n) for d, n in zip(data, noise, strict=True)]
    for number in range(ROUNDS_WITHOUT + ROUNDS_WITH):
        total = np.diag(prior) + sum(
            gram(w.slopes) / v for w, v in zip(whitened, variance, strict=True)
        )
        fitted = FittedParameters.of(total, pulled + total_score(whitened, variance))
        updated = [
            noise_model(d, w, v, fitted, highest_order, with_added=number >= ROUNDS_WITHOUT)
            for d, w, v in zip(data, whitened, variance, strict=True)
        ]
        noise = [n for n, _ in updated]
        variance = np.maximum([v for _, v in updated], problem.least_variance)
        whitened = [whiten(d, n) for d, n in zip(data, noise, strict=True)]
    every = np.array([gram(w.slopes) / v for w, v in zip(whitened, variance, strict=True)])
    total = np.diag(prior) + np.sum(every, axis=0)
    fitted = FittedParameters.of(total, pulled + total_score(whitened, variance))
    ratio, p_value, columns = [], [], []
    for d, w, n, v in zip(data, whitened, noise, variance, strict=True):
        excess, added, freedom = added_power(d, w, n, v, reduced_normal(w, v, fitted))
        ratio.append(excess / max(added, 1))
        columns.append(added)
        p_value.append(special.fdtrc(added, freedom, ratio[-1]) if added else 1.0)
    found = [
        model_error_signatures(problem, number, response, theta)
        for number, response in enumerate(responses)
    ]
    signature = signature_test(
        problem.model.outputs,
        found[0].names,
        [
            WhitenedOutput(
                slopes=w.slopes,
                signatures=[
                    block_means(
                        s.columns[j], block_length(m.dt_s, block_s), problem.seen(number, j)
                    )
                    for number, (s, m) in enumerate(zip(found, problem.maneuvers, strict=True))
                ],
                residuals=w.residuals,
                noise=noise[j],
                variance=float(variance[j]),
            )
            for j, w in enumerate(whitened)
        ],
        fitted.inverse,
        fitted.score,
    )
    return InputCoherence(
        outputs=problem.model.outputs,
        ratio=np.array(ratio),
        p_value=np.array(p_value),
        columns=np.array(columns, dtype=np.float64),
        noise=tuple(noise),
        innovation_variance=variance,
        signature=replace(signature, shift=signature.shift[:count]),
        samples=sum(len(e) for e in data[0].residuals),
        information=every[:, :count, :count],
        prior_precision=problem.prior_precision,
    )


def driven_data(
    problem: OutputProblem,
    responses: Sequence[Response],
    nuisance: Sequence[Array] = (),
    block_s: float = BLOCK_S,
) -> list[OutputData]:
    """Return means of each output: residuals, slopes, and columns that the inputs drive.

    Behind the slopes by the parameters stand those by the known errors that show, in deviations.

    Parameters
    ----------
    problem : OutputProblem
    responses : sequence of Response
    nuisance : sequence of Array, shape (p, samples, k)
    block_s : float
    """
    model, size = problem.model, len(problem.names)
    shortest_s = min(m.samples * m.dt_s for m in problem.maneuvers)
    knots_s = lag_knots_s(max(m.dt_s for m in problem.maneuvers), shortest_s)
    moving = [j for j, y in enumerate(model.outputs) if y in model.states]
    added = [
        input_regressors(m.inputs[:, : len(model.controls())], r.y[moving].T, m.dt_s, knots_s)
        for m, r in zip(problem.maneuvers, responses, strict=True)
    ]
    blocks = [block_length(m.dt_s, block_s) for m in problem.maneuvers]
    found = []
    for j in range(len(model.outputs)):
        slopes, residuals, extra = [], [], []
        for number, (response, block) in enumerate(zip(responses, blocks, strict=True)):
            seen = problem.seen(number, j)
            own = block_means(response.sensitivities[j], block, seen)
            whole = np.zeros((len(own), size))
            whole[:, problem.columns(number)] = own
            known = [block_means(nuisance[number][j], block, seen)] if len(nuisance) else []
            slopes.append(np.hstack([whole, *known]))
            left = problem.residual(number, response.y)[j]
            residuals.append(block_means(left[:, None], block, seen)[:, 0])
            extra.append(block_means(added[number], block, seen))
        found.append(OutputData(residuals, slopes, extra))
    return _with_what_shows(found, size, problem.least_variance)


def prior_of(
    problem: OutputProblem, theta: Array, data: Sequence[OutputData]
) -> tuple[Array, Array]:
    """Return the precision of parameters and known errors, and its pull on an estimate, (P + k,).

    Known errors are in deviations, about none.

    Parameters
    ----------
    problem : OutputProblem
    theta : Array, shape (P,)
    data : sequence of OutputData
        Data by `driven_data`.
    """
    own, known = problem.prior_precision, data[0].slopes[0].shape[1] - len(problem.names)
    pulled = np.concatenate([own * (problem.prior_mean - theta), np.zeros(known)])
    return np.concatenate([own, np.ones(known)]), pulled


def _with_what_shows(data: list[OutputData], count: int, least_variance: Array) -> list[OutputData]:
    """Return the data without the known errors behind the first columns that no output shows."""
    power = np.zeros(data[0].slopes[0].shape[1])
    for d, least in zip(data, least_variance, strict=True):
        variance = max(float(np.mean(np.concatenate(d.residuals) ** 2)), float(least))
        power += np.sum([np.sum(J * J, axis=0) for J in d.slopes], axis=0) / variance
    kept = np.append(np.ones(count, dtype=bool), power[count:] > SHOWS)
    return [OutputData(d.residuals, [J[:, kept] for J in d.slopes], d.added) for d in data]


def block_length(dt_s: float, block_s: float = BLOCK_S) -> int:
    """Return how many samples a mean is taken over."""
    return max(1, round(block_s / dt_s))


def block_means(values: Array, block: int, seen: BoolArray | None = None) -> Array:
    """Return the means of successive blocks of samples, (samples // block, columns).

    Only those `seen` count, (samples,) or of each column, where it is given: a mean with what a
    slower sensor did not measure as zero says a part of its noise. Zero where nothing was seen.
    """
    count = len(values) // block
    blocks = values[: count * block].reshape(count, block, -1)
    if seen is None or block == 1:
        return np.asarray(blocks.mean(axis=1))
    weight = seen[: count * block].reshape(count, block, -1)
    return np.asarray((blocks * weight).sum(axis=1) / np.maximum(weight.sum(axis=1), 1))


LONGEST_S = 3.2  # last of the lags
# A share of the shortest record: a longer memory is not seen often enough (Box & Jenkins, Time
# Series Analysis, 1970).
LAG_SHARE = 0.25


def lag_knots_s(dt_s: float, shortest_s: float) -> Array:
    """Return the knots of the lags, s: 0, then doubling.

    Parameters
    ----------
    dt_s : float
        Sample period; no knot is nearer to zero.
    shortest_s : float
        Length of the shortest record.
    """
    longest_s = min(LONGEST_S, LAG_SHARE * shortest_s)
    knots = [0.0, max(BLOCK_S, dt_s)]
    while 2.0 * knots[-1] <= longest_s:
        knots.append(2.0 * knots[-1])
    return np.array(knots)


def input_regressors(inputs: Array, modelled: Array, dt_s: float, knots_s: Array) -> Array:
    """Return columns that the inputs drive, (samples, inputs x knots + 3 x modelled).

    Parameters
    ----------
    inputs : Array, shape (samples, m)
        Before the record they stood where they begin.
    modelled : Array, shape (samples, k)
        Simulated outputs: an error of a slow mode lasts longer than any lag. Their squares, with
        and without sign, stand for what is not linear.
    dt_s : float
    knots_s : Array
        Knots by `lag_knots_s`.
    """
    samples = len(inputs)
    lag_s = np.arange(int(np.ceil(knots_s[-1] / dt_s)) + 1) * dt_s
    hats = np.array([np.interp(lag_s, knots_s, row) for row in np.eye(len(knots_s))])
    hats[:, lag_s > knots_s[-1] + 1e-9] = 0.0
    columns = []
    for u in (inputs - inputs[0]).T:
        columns += [np.convolve(u, hat)[:samples] for hat in hats]
    y = modelled - modelled[0]
    return np.column_stack([*columns, y, y * y, y * np.abs(y)])
