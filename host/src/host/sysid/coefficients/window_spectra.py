"""Windows of a flight in the frequency domain: transforms, trends, weights from residuals."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from host.arrays import Array, BoolArray, IntArray
from host.sysid.coefficients.aero_equations import KINEMATIC, LATERAL, LONGITUDINAL, Equation
from host.sysid.compatibility.inverse_sensor_model import Spectrum
from host.sysid.identification_error import IdentificationError

LOW_HZ, HIGH_HZ = 0.1, 4.5
KINEMATIC_LOW_HZ = 0.4  # below, the attitude filter's own errors rule
FLAT = 1e-9  # a constant has no transform at whole periods but rounding
TRENDS = 4  # constant to cubic, taken out of the kinematic equations; constant and slope elsewhere
SMOOTHING_HZ, GRID = 0.5, 12  # of residual spectra
LEAST_S = 2.0  # shortest window
Key = tuple[str, int]


@dataclass(frozen=True, slots=True)
class Window:
    """A maneuver: from and to in the time of the columns, and whether the elevator moved."""

    first_s: float
    last_s: float
    longitudinal: bool


@dataclass(frozen=True, slots=True)
class Block:
    """One window: its samples, their places among those of all windows, frequencies, transform,
    transformed trends."""

    samples: IntArray
    places: IntArray
    hertz: Array
    cosines: Array
    sines: Array
    trends: Spectrum
    names: tuple[str, ...]


def window_block(
    samples: IntArray,
    dt_s: float,
    window: Window,
    forces: tuple[str, str],
    every: IntArray | None = None,
) -> Block:
    """Return the transform of one window; `forces` are compared under the elevator.

    `every` are the samples of all windows, sorted; its own by default.

    Raises
    ------
    IdentificationError
        If it is too short.
    """
    n = len(samples)
    length = n * dt_s
    if length < LEAST_S:
        raise IdentificationError(
            f"window of {length:.1f} s at {window.first_s:.1f} s: {LEAST_S:.0f} s needed"
        )
    hertz = np.arange(1, int(HIGH_HZ * length) + 1) / length
    hertz = hertz[hertz >= LOW_HZ]
    phase = np.outer(hertz, np.arange(n) * dt_s)
    cosines, sines = (f(2.0 * np.pi * phase) / np.sqrt(n) for f in (np.cos, np.sin))
    trend = np.linspace(-1.0, 1.0, n)[:, None] ** np.arange(TRENDS)
    trends = cosines @ trend - 1j * (sines @ trend)
    names = (*forces, *LONGITUDINAL) if window.longitudinal else LATERAL
    places = np.searchsorted(samples if every is None else every, samples)
    return Block(samples, places, hertz, cosines, sines, trends, names)


def transformed(full: Mapping[str, Equation], blocks: Sequence[Block]) -> dict[Key, Spectrum]:
    """Return left side and regressors of every equation in every window, (F, 1 + terms) each.

    Equations are given at the samples of all windows.
    """
    result: dict[Key, Spectrum] = {}
    for number, block in enumerate(blocks):
        columns, ends = [], [0]
        for name in block.names:
            columns += [full[name].left, *full[name].terms.values()]
            ends.append(len(columns))
        table = np.stack([c[block.places] for c in columns], axis=1)
        table -= table.mean(axis=0)
        spectra = block.cosines @ table - 1j * (block.sines @ table)
        for k, name in enumerate(block.names):
            result[name, number] = spectra[:, ends[k] : ends[k + 1]]
    return result


def used(block: Block, name: str) -> BoolArray:
    """Return which frequencies of a window an equation is compared at."""
    return block.hertz >= (KINEMATIC_LOW_HZ if name in KINEMATIC else LOW_HZ)


def degree(name: str) -> int:
    """Return how many powers of time are taken out of an equation."""
    return TRENDS if name in KINEMATIC else 2


def row_weight(hertz: Array, noise: tuple[Array, Array] | None) -> Array:
    """Return the weight of real and imaginary parts from the spectrum of residuals, (F,)."""
    if noise is None:
        return np.full(len(hertz), np.sqrt(2.0))
    return np.asarray(np.sqrt(2.0 / np.interp(hertz, *noise)), dtype=np.float64)


def noise_spectra(
    blocks: Sequence[Block],
    residuals: Iterable[tuple[Key, Array]],
    before: Mapping[str, tuple[Array, Array]],
) -> dict[str, tuple[Array, Array]]:
    """Return the smoothed residual spectrum of every equation, pooled over maneuvers.

    `residuals` are weighted by the spectra `before`, real parts then imaginary ones.
    """
    found: dict[str, list[tuple[Array, Array]]] = {}
    for (name, window), residual in residuals:
        hertz = blocks[window].hertz[used(blocks[window], name)]
        power = 0.5 * np.sum(residual.reshape(2, -1) ** 2, axis=0)
        if name in before:
            power = power * np.interp(hertz, *before[name])
        found.setdefault(name, []).append((hertz, power))
    grid = np.linspace(LOW_HZ, HIGH_HZ, GRID)
    result: dict[str, tuple[Array, Array]] = {}
    for name, parts in found.items():
        hertz = np.concatenate([h for h, _ in parts])
        power = np.concatenate([p for _, p in parts])
        near = np.exp(-0.5 * ((hertz[None, :] - grid[:, None]) / SMOOTHING_HZ) ** 2)
        result[name] = (grid, np.maximum(near @ power / near.sum(axis=1), 1e-30))
    return result
