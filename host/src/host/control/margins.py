"""Gain, phase and disk margin of many loops at once, from their frequency responses."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from host.arrays import Array

Spectra = NDArray[np.complexfloating[Any, Any]]  # frequency responses
FAR_DB = 60.0  # no crossing: what is printed as none
FAR_DEG = 180.0


@dataclass(frozen=True, slots=True)
class Margins:
    """Margins of loops, each array of shape (N,).

    Attributes
    ----------
    gain_db : Array
        Smallest change of gain, up or down, that reaches -1.
    phase_deg : Array
    disk : Array
        Disk margin of balanced sensitivity (Seiler, Packard & Gahinet 2020).
    crossover_radps : Array
        Highest frequency of unit gain; 0 where there is none.
    """

    gain_db: Array
    phase_deg: Array
    disk: Array
    crossover_radps: Array


def margins(response: Spectra, frequency_radps: Array) -> Margins:
    """Return the margins of loops; that they are stable is asked elsewhere.

    Between two frequencies the loop is a straight line, in the logarithm of gain and frequency.

    Parameters
    ----------
    response : Array, shape (N, F)
        Response of each loop L, negative feedback: the critical point is -1.
    frequency_radps : Array, shape (F,)
    """
    size = np.log(np.maximum(np.abs(response), 1e-300))
    phase = np.unwrap(np.angle(response), axis=1)
    left, right = slice(None, -1), slice(1, None)

    # Odd multiples of 180 degrees between two frequencies.
    turns = (phase + np.pi) / (2.0 * np.pi)
    before, after = turns[:, left], turns[:, right]
    low, high = np.minimum(before, after), np.maximum(before, after)
    crossed = np.floor(high) > np.floor(low)
    span = np.where(after == before, 1.0, after - before)
    at = np.clip((np.floor(high) - before) / span, 0.0, 1.0)
    gain = np.abs(size[:, left] + at * (size[:, right] - size[:, left])) * 20.0 / np.log(10.0)
    gain_db = np.min(np.where(crossed, gain, FAR_DB), axis=1)

    unit = np.signbit(size[:, left]) != np.signbit(size[:, right])
    step = np.where(unit, size[:, left] - size[:, right], 1.0)
    share = np.clip(size[:, left] / step, 0.0, 1.0)
    angle = phase[:, left] + share * (phase[:, right] - phase[:, left])
    away = np.abs(np.rad2deg((angle + 2.0 * np.pi) % (2.0 * np.pi) - np.pi))
    phase_deg = np.min(np.where(unit, away, FAR_DEG), axis=1)

    logarithm = np.log(frequency_radps)
    where = logarithm[None, left] + share * np.diff(logarithm)[None, :]
    crossover = np.max(np.where(unit, np.exp(where), 0.0), axis=1)

    sensitivity = 1.0 / (1.0 + response)
    disk = 1.0 / np.max(np.abs(sensitivity - 0.5), axis=1)
    return Margins(np.minimum(gain_db, FAR_DB), phase_deg, np.minimum(disk, 2.0), crossover)
