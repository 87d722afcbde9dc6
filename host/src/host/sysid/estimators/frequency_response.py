"""Frequency response and coherence of a record, and of an identified model with its interval.

The record's needs no model: chirp-z transforms of whole records, averaged
over records and neighbouring lines. Pieces of a sweep (Welch) would hold each frequency in one of
them only, and one piece is always coherent. Where a model has several inputs each response is the
one next to the others, and coherence is partial: inputs that move together would else be taken for
each other (Bendat & Piersol, Random Data, ch. 7).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from host.arrays import Array
from host.constants import NORMAL_95
from host.errors import IdentificationError
from host.sysid.models.fit_result import FitResult
from host.sysid.models.maneuver import Maneuver
from host.sysid.models.state_space_model import LinearModel
from host.sysid.numerics.chirp_z import Spectrum, transform
from host.sysid.numerics.discretisation import discretise

COHERENT = 0.6  # Tischler & Remple, Aircraft and Rotorcraft System Identification
BY_CHANCE = 0.05
PERIODS = 2.0  # of the lowest frequency in a window
LINES = 4  # drawn from one harmonic of the window to the next
SLOPE_STEP = 1e-6  # of a parameter's half-width: central differences


@dataclass(frozen=True, slots=True)
class RecordedResponse:
    """Response of outputs to inputs as records have it, without a model.

    Attributes
    ----------
    frequency_hz : (f,) Array
        From two periods of the window on.
    response : (f, outputs, inputs) array, complex
        Outputs over inputs; given the other inputs where there are several.
    coherence : (f, outputs, inputs) Array
        Ordinary of one input, partial of several.
    window_s : float
        One over the band that is averaged.
    windows : int
        Windows of that length in all records: as many lines are averaged.
    """

    frequency_hz: Array
    response: NDArray[np.complexfloating]
    coherence: Array
    window_s: float
    windows: int

    @property
    def method(self) -> str:
        """How it was made, in words."""
        kind = "partial coherence" if self.response.shape[2] > 1 else "coherence"
        return (
            f"chirp-z of whole records, averaged over {1.0 / self.window_s:.2g} Hz as over"
            f" {self.windows} windows of {self.window_s:.2g} s; {kind}"
        )


def least_windows(inputs: int) -> int:
    """Return how many windows keep chance below `COHERENT` in 95 of 100 lines.

    Coherence of unrelated signals is above c in a share (1 - c)^(n - inputs) of the lines of n
    windows (Carter, Knapp & Nuttall, IEEE Trans. Audio Electroacoust. 21, 1973).
    """
    return inputs + int(np.ceil(np.log(BY_CHANCE) / np.log(1.0 - COHERENT)))


def recorded_response(maneuvers: Sequence[Maneuver]) -> RecordedResponse:
    """Estimate responses and coherence of every output over every input.

    Parameters
    ----------
    maneuvers : sequence of Maneuver
        All count together, whatever their rates.

    Raises
    ------
    IdentificationError
        If they are too short for the windows that coherence needs.
    """
    inputs = maneuvers[0].inputs.shape[1]
    lengths = [m.samples * m.dt_s for m in maneuvers]
    window_s = min(sum(lengths) / least_windows(inputs), max(lengths))
    lowest_hz = PERIODS / window_s
    highest_hz = 0.25 / max(m.dt_s for m in maneuvers)  # four samples in a period
    if highest_hz < 2.0 * lowest_hz:
        raise IdentificationError(
            f"windows of {window_s:.2g} s begin at {lowest_hz:.2g} Hz, and the rate tells up to"
            f" {highest_hz:.2g} Hz: fly a longer input"
        )
    # Two lines for each that the longest record resolves, averaged over what a window resolves.
    across = LINES * int(np.ceil(2.0 * max(lengths) / window_s / LINES))
    spacing_hz = 1.0 / (window_s * across)
    count = int((highest_hz - lowest_hz) / spacing_hz) // (across // LINES) * (across // LINES) + 1
    frequency_hz = lowest_hz + spacing_hz * np.arange(-(across // 2), count + across // 2)
    power = np.sum([_power(m, frequency_hz) for m in maneuvers], axis=0)
    total = np.cumsum(np.concatenate([np.zeros((1, *power.shape[1:])), power]), axis=0)
    power = (total[across + 1 :] - total[: -across - 1])[:: across // LINES]
    xx, yx = power[:, :inputs, :inputs], power[:, inputs:, :inputs]
    floor = np.einsum("fii->f", xx).real[:, None, None] * np.eye(inputs) * np.finfo(float).eps
    return RecordedResponse(
        frequency_hz[across // 2 : across // 2 + count : across // LINES],
        yx @ np.linalg.inv(xx + floor),
        _partial_coherence(power, inputs),
        window_s,
        int(sum(lengths) / window_s + 1e-9),
    )


def _power(maneuver: Maneuver, frequency_hz: Array) -> Spectrum:
    """Return what inputs and outputs of a record have in common, (f, signals, signals).

    A line through its ends is taken out: a record that ends elsewhere than it began leaks, and a
    taper cut off what a sweep begins with (0.10 of its response wrong, with the line 0.02).
    """
    both = np.hstack([maneuver.inputs, maneuver.outputs])
    line = both[:1] + np.linspace(0.0, 1.0, maneuver.samples)[:, None] * (both[-1:] - both[:1])
    z = transform(both - line, maneuver.dt_s, frequency_hz) * maneuver.dt_s
    return np.asarray(np.einsum("fi,fj->fij", z, z.conj()))


def _partial_coherence(power: Spectrum, inputs: int) -> Array:
    """Return the coherence of each output with each input, the other inputs taken out of both.

    |P_iy|^2 / (P_ii P_yy) of the inverse P of their power.
    """
    outputs = power.shape[1] - inputs
    found = np.zeros((len(power), outputs, inputs))
    for k in range(outputs):
        chosen = [*range(inputs), inputs + k]
        own = power[:, chosen][:, :, chosen]
        size = np.sqrt(np.maximum(np.einsum("fii->fi", own).real, 1e-300))
        own = own / size[:, :, None] / size[:, None, :]
        inverse = np.linalg.inv(own + 1e-12 * np.eye(inputs + 1))
        for i in range(inputs):
            top = np.abs(inverse[:, i, -1]) ** 2
            found[:, k, i] = top / (inverse[:, i, i].real * inverse[:, -1, -1].real)
    return np.clip(found, 0.0, 1.0)


@dataclass(frozen=True, slots=True)
class ModelResponse:
    """Response of outputs to inputs of a fitted model, (f, outputs, inputs) each.

    `half_width` is that of 95 %: real part relative in magnitude, imaginary part in rad of phase.
    """

    response: NDArray[np.complexfloating]
    half_width: NDArray[np.complexfloating]


def model_response(result: FitResult, frequency_hz: Array, dt_s: float) -> ModelResponse:
    """Return the response of a fitted model as sampled, delays included, with its interval.

    The response of equations that a user wrote is that of the tangent.

    Parameters
    ----------
    result : FitResult
    frequency_hz : (f,) Array
    dt_s : float
        Sample period: inputs are held or run on lines between samples, as the model says.
    """
    common = len(result.model.parameter_names)
    theta = result.estimate[:common]
    covariance = result.covariance[:common, :common]
    response = _response(result.model, theta, frequency_hz, dt_s)
    slopes = np.zeros((*response.shape, common), dtype=np.complex128)
    for k, deviation in enumerate(np.sqrt(np.maximum(np.diag(covariance), 0.0))):
        step = SLOPE_STEP * deviation
        if step > 0.0:
            theta_up, theta_down = theta.copy(), theta.copy()
            theta_up[k] += step
            theta_down[k] -= step
            up = _response(result.model, theta_up, frequency_hz, dt_s)
            down = _response(result.model, theta_down, frequency_hz, dt_s)
            slopes[..., k] = (up - down) / (2.0 * step)
    relative = slopes / np.where(np.abs(response) > 0.0, response, np.inf)[..., None]
    widths = [
        NORMAL_95 * np.sqrt(np.maximum(np.einsum("...i,ij,...j", part, covariance, part), 0.0))
        for part in (relative.real, relative.imag)
    ]
    return ModelResponse(response, widths[0] + 1j * widths[1])


def _response(model: LinearModel, theta: Array, frequency_hz: Array, dt_s: float) -> Spectrum:
    """Return C (z - Phi)^-1 (Gamma + (z - 1) Gamma1) + D, each output behind its delay."""
    A, B, C, D = model.matrices(theta)
    n, m = B.shape
    foh, none = model.hold == "foh", np.zeros(0, dtype=np.int64)
    AB = np.hstack([A, B, np.zeros((n, 1))])
    step = discretise(AB, n, m, foh, dt_s, none, none, none, np.zeros(0), 0)[0]
    z = np.exp(2j * np.pi * frequency_hz * dt_s)[:, None, None]
    drive = step[:, n : n + m] + (z - 1.0) * step[:, n + m + 1 :] if foh else step[:, n : n + m]
    found = C @ np.linalg.solve(z * np.eye(n) - step[:, :n], drive + 0.0 * z) + D
    for delay, late_s in zip(model.delays, theta[len(model.parameters) :], strict=False):
        rows = [model.outputs.index(name) for name in delay.outputs if name in model.outputs]
        found[:, rows] *= np.exp(-2j * np.pi * frequency_hz * late_s)[:, None, None]
    return np.asarray(found)
