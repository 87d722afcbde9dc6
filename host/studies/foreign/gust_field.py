"""A frozen field of gusts along the flight path, von Karman or Dryden, by its spectrum.

MIL-F-8785C, 3.7.1 and 3.7.2, one-sided in rad/m. The package's twin filters white noise in time;
here a random field is drawn in space by its Fourier series.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

# 3.9 km. At 18 m/s and 100 Hz a field of 60 mm ends at three times the highest frequency sampled,
# and what it lacks made M_alpha 0.4 % large in an equation error of noise-free columns.
SAMPLES, STEP_M = 2**18, 0.015
LONG_WAVES = 2**15 + 1  # down to 120 mm
BEHIND_M = 100.0  # of the field lies behind the start
ALONG_SHARE = 1.3  # u and v gusts in terms of w near the ground
VERTICAL_M, LEVEL_M = 50.0, 150.0  # scale lengths at 50 m of height


@dataclass(frozen=True)
class Gusts:
    """Gusts along the path: `u`, `v`, `w` in m/s, `p` in rad/s; each (SAMPLES,)."""

    u: NDArray[np.float64]
    v: NDArray[np.float64]
    w: NDArray[np.float64]
    p: NDArray[np.float64]

    def lists(self) -> GustLists:
        """Return the same as lists, of which single values are read in a third of the time."""
        return GustLists(self.u.tolist(), self.v.tolist(), self.w.tolist(), self.p.tolist())


@dataclass(frozen=True)
class GustLists:
    """The gusts of `Gusts` as lists."""

    u: list[float]
    v: list[float]
    w: list[float]
    p: list[float]


def gusts(rng: np.random.Generator, intensity_mps: float, form: str, span_m: float | None) -> Gusts:
    """Draw a field; without `span_m` it acts on a point and does not roll.

    Parameters
    ----------
    rng : Generator
    intensity_mps : float
        Standard deviation of the vertical gust.
    form : str
        ``dryden`` or ``karman``.
    span_m : float, optional
        Wing span.
    """
    still = np.zeros(SAMPLES)
    if intensity_mps == 0.0:
        return Gusts(still, still, still, still)
    wave = np.asarray(2.0 * np.pi * np.fft.rfftfreq(SAMPLES, STEP_M), dtype=np.float64)
    level = ALONG_SHARE * intensity_mps
    p = still
    if span_m is not None:
        reach = (0.25 * np.pi * VERTICAL_M / span_m) ** (1.0 / 3.0)
        corner = 4.0 * span_m / np.pi
        power = 0.8 * intensity_mps**2 / VERTICAL_M * reach / (1.0 + (corner * wave) ** 2)
        p = _drawn(rng, power)
    return Gusts(
        _drawn(rng, _along(wave, level, LEVEL_M, form)),
        _drawn(rng, _across(wave, level, LEVEL_M, form)),
        _drawn(rng, _across(wave, intensity_mps, VERTICAL_M, form)),
        p,
    )


def at(field: NDArray[np.float64] | list[float], way_m: float) -> float:
    """Return a field at a place by the cubic through its neighbours (Catmull-Rom)."""
    x = (way_m + BEHIND_M) / STEP_M
    i = int(x)
    f = x - i
    a, b, c, d = field[i - 1], field[i], field[i + 1], field[i + 2]
    bend = 2.0 * a - 5.0 * b + 4.0 * c - d + f * (3.0 * (b - c) + d - a)
    return b + 0.5 * f * (c - a + f * bend)


def _along(wave: NDArray[np.float64], sd: float, scale_m: float, form: str) -> NDArray[np.float64]:
    whole = 2.0 * sd**2 * scale_m / np.pi
    if form == "dryden":
        return np.asarray(whole / (1.0 + (scale_m * wave) ** 2))
    return np.asarray(whole / (1.0 + (1.339 * scale_m * wave) ** 2) ** (5.0 / 6.0))


def _across(wave: NDArray[np.float64], sd: float, scale_m: float, form: str) -> NDArray[np.float64]:
    whole = sd**2 * scale_m / np.pi
    if form == "dryden":
        square = (scale_m * wave) ** 2
        return np.asarray(whole * (1.0 + 3.0 * square) / (1.0 + square) ** 2)
    square = (1.339 * scale_m * wave) ** 2
    return np.asarray(whole * (1.0 + 8.0 / 3.0 * square) / (1.0 + square) ** (11.0 / 6.0))


def _drawn(rng: np.random.Generator, power: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return a field of this spectrum: random amplitudes and phases.

    Those of short waves are a stream apart, which leaves long waves and noise of a seed alone.
    """
    step = 2.0 * np.pi / (SAMPLES * STEP_M)
    [apart] = rng.spawn(1)
    z = np.concatenate([_phasors(rng, LONG_WAVES), _phasors(apart, len(power) - LONG_WAVES)])
    z[0] = 0.0
    return np.asarray(np.fft.irfft(z * np.sqrt(0.5 * power * step) * SAMPLES, SAMPLES))


def _phasors(rng: np.random.Generator, count: int) -> NDArray[np.complex128]:
    real, imaginary = rng.standard_normal(count), rng.standard_normal(count)
    return np.asarray((real + 1j * imaginary) / np.sqrt(2.0))
