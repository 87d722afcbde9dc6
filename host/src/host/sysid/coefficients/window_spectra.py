"""Spectra of the equations over the windows of a flight, and weights from residual spectra.

Equation error in the frequency domain: EQUATIONS.md, eq. 20.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from host.arrays import Array, IntArray
from host.constants import DRIFT_POWERS
from host.errors import IdentificationError
from host.sysid.coefficients.aero_equations import KINEMATIC, LATERAL, LONGITUDINAL, Equation
from host.sysid.reconstruction.inverse_sensor_model import Spectrum

LOW_HZ, HIGH_HZ = 0.1, 4.5
ROUNDING_SHARE = 1e-9  # a constant has no transform at whole periods but rounding
AERO_TREND = 2  # powers of time removed, constant and slope; of kinematic equations `DRIFT_POWERS`
SMOOTHING_HZ, GRID = 1.0, 12  # of residual spectra
SHORTEST_S = 2.0  # shortest window
EquationKey = tuple[str, int]  # equation, number of the window
ResidualSpectra = Mapping[str, tuple[Array, Array]]  # by equation: frequency (Hz) and spectrum


@dataclass(frozen=True, slots=True)
class Window:
    """A maneuver: from and to in the time of the columns, and whether the elevator moved."""

    first_s: float
    last_s: float
    longitudinal: bool


@dataclass(frozen=True, slots=True)
class WindowTransform:
    """The discrete Fourier transform of one window.

    Attributes
    ----------
    samples : IntArray, shape (n,)
        Indices into the flight.
    positions : IntArray, shape (n,)
        The same samples as indices into those of all windows.
    frequency_hz : Array, shape (F,)
    cosines, sines : Array, shape (F, n)
    trends : complex Array, shape (F, 4)
        Transforms of the powers of time.
    equations : tuple of str
        Equations that hold in it.
    """

    samples: IntArray
    positions: IntArray
    frequency_hz: Array
    cosines: Array
    sines: Array
    trends: Spectrum
    equations: tuple[str, ...]


def window_transform(
    samples: IntArray,
    dt_s: float,
    window: Window,
    forces: tuple[str, str],
    all_samples: IntArray | None = None,
    fitted: Collection[str] | None = None,
) -> WindowTransform:
    """Return the transform of one window.

    Parameters
    ----------
    samples : IntArray, shape (n,)
        Indices into the flight.
    dt_s : float
    window : Window
    forces : tuple of str
        Names of the two force equations of an elevator maneuver.
    all_samples : IntArray, optional
        Samples of all windows, sorted; those of this window without.
    fitted : collection of str, optional
        Force and moment equations of the model; all of the axis without.

    Raises
    ------
    IdentificationError
        If the window is too short.
    """
    n = len(samples)
    length = n * dt_s
    if length < SHORTEST_S - dt_s:  # one of just so long may miss a sample on the grid of the fit
        raise IdentificationError(
            f"window of {length:.1f} s at {window.first_s:.1f} s: {SHORTEST_S:.0f} s needed"
        )
    frequency_hz = np.arange(1, int(HIGH_HZ * length) + 1) / length
    frequency_hz = frequency_hz[frequency_hz >= LOW_HZ]
    phase = np.outer(frequency_hz, np.arange(n) * dt_s)
    cosines, sines = (f(2.0 * np.pi * phase) / np.sqrt(n) for f in (np.cos, np.sin))
    trend = np.linspace(-1.0, 1.0, n)[:, None] ** np.arange(DRIFT_POWERS)
    trends = cosines @ trend - 1j * (sines @ trend)
    of_axis = (*forces, *LONGITUDINAL) if window.longitudinal else LATERAL
    known = {*of_axis} if fitted is None else {*fitted, *KINEMATIC}
    equations = tuple(name for name in of_axis if name in known)
    positions = np.searchsorted(samples if all_samples is None else all_samples, samples)
    return WindowTransform(samples, positions, frequency_hz, cosines, sines, trends, equations)


def equation_spectra(
    equations: Mapping[str, Equation], windows: Sequence[WindowTransform]
) -> dict[EquationKey, Spectrum]:
    """Return response and regressors of every equation in every window, (F, 1 + terms) each.

    Parameters
    ----------
    equations : mapping
        By name, at the samples of all windows.
    windows : sequence of WindowTransform
    """
    result: dict[EquationKey, Spectrum] = {}
    for number, window in enumerate(windows):
        columns, ends = [], [0]
        for name in window.equations:
            columns += [equations[name].response, *equations[name].regressors.values()]
            ends.append(len(columns))
        table = np.stack([c[window.positions] for c in columns], axis=1)
        table -= table.mean(axis=0)
        spectra = window.cosines @ table - 1j * (window.sines @ table)
        for k, name in enumerate(window.equations):
            result[name, number] = spectra[:, ends[k] : ends[k + 1]]
    return result


def trend_count(equation: str) -> int:
    """Return how many powers of time are removed from an equation."""
    return DRIFT_POWERS if equation in KINEMATIC else AERO_TREND


def equation_weight(frequency_hz: Array, noise: tuple[Array, Array] | None) -> Array:
    """Return the weight of real and imaginary parts from the spectrum of residuals, (F,).

    Each part has half of the power, so the weight is the square root of 2 / S.
    """
    if noise is None:
        return np.full(len(frequency_hz), np.sqrt(2.0))
    return np.asarray(np.sqrt(2.0 / np.interp(frequency_hz, *noise)), dtype=np.float64)


def residual_spectra(
    windows: Sequence[WindowTransform],
    residuals: Iterable[tuple[EquationKey, Array]],
    before: Mapping[str, tuple[Array, Array]],
) -> dict[str, tuple[Array, Array]]:
    """Return the smoothed residual spectrum of every equation, pooled over maneuvers.

    Parameters
    ----------
    windows : sequence of WindowTransform
    residuals : iterable
        Residuals of each block, (2 F,): real parts then imaginary ones, weighted by the spectra
        `before`.
    before : mapping
        Frequency (Hz) and spectrum by equation.

    Returns
    -------
    dict
        Frequency (Hz) and spectrum, (12,) each, by equation.
    """
    found: dict[str, list[tuple[Array, Array]]] = {}
    for (name, number), residual in residuals:
        frequency_hz = windows[number].frequency_hz
        power = 0.5 * np.sum(residual.reshape(2, -1) ** 2, axis=0)
        if name in before:
            power = power * np.interp(frequency_hz, *before[name])
        found.setdefault(name, []).append((frequency_hz, power))
    grid = np.linspace(LOW_HZ, HIGH_HZ, GRID)
    result: dict[str, tuple[Array, Array]] = {}
    for name, parts in found.items():
        frequency_hz = np.concatenate([h for h, _ in parts])
        power = np.concatenate([p for _, p in parts])
        kernel = np.exp(-0.5 * ((frequency_hz[None, :] - grid[:, None]) / SMOOTHING_HZ) ** 2)
        result[name] = (grid, np.maximum(kernel @ power / kernel.sum(axis=1), 1e-30))
    return result
