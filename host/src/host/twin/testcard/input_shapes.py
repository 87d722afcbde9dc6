"""Test inputs as functions of time, in units of their amplitude.

Shapes and frequencies: Klein & Morelli, Aircraft System Identification, chapter 9.
"""

from __future__ import annotations

import math

import numpy as np

from host.aircraft.airframe import Array

STEPS = {
    "pulse": ((1.0, 1.0),),
    "doublet": ((1.0, 1.0), (-1.0, 1.0)),
    "3211": ((1.0, 3.0), (-1.0, 2.0), (1.0, 1.0), (-1.0, 1.0)),
}  # (sign, length in units of the width)
KINDS = (*STEPS, "multisine", "sweep")


def staircase(t_s: Array, switches_s: Array, levels: Array, hand_s: float) -> Array:
    """Return a step input whose edges take a hand's time.

    Parameters
    ----------
    t_s : (n,) array
        Time from the start of the input.
    switches_s : (k + 1,) array
        Times of the edges; the last one is the end.
    levels : (k,) array
        Level after each of the first k edges; zero before and behind.
    hand_s : float
        Duration of an edge, a smooth half cosine; 0 for exact steps.

    Returns
    -------
    (n,) array
    """
    heights = np.diff(np.concatenate([[0.0], levels, [0.0]]))
    out = np.zeros(len(t_s))
    for at, height in zip(switches_s, heights, strict=True):
        if hand_s > 0.0:
            share = np.clip((t_s - at) / hand_s, 0.0, 1.0)
            out += height * 0.5 * (1.0 - np.cos(np.pi * share))
        else:
            out += height * (t_s >= at)
    return out


def harmonics(duration_s: float, low_hz: float, high_hz: float) -> Array:
    """Return the whole multiples of the fundamental 1/`duration_s` inside a band (k,)."""
    first, last = math.ceil(low_hz * duration_s), math.floor(high_hz * duration_s)
    return np.arange(first, last + 1, dtype=np.float64)


def multisine(
    duration_s: float, low_hz: float, high_hz: float, inputs: int
) -> tuple[list[Array], list[Array]]:
    """Choose harmonics and phases of mutually orthogonal inputs of low peak factor.

    Parameters
    ----------
    duration_s : float
        Fundamental period; all harmonics of it are orthogonal over it.
    low_hz, high_hz : float
        Band.
    inputs : int
        The harmonics of the band are dealt out to this many inputs in turn.

    Returns
    -------
    frequencies_hz, phases_rad : lists of arrays
        One array each per input; unit amplitude each. Phases by Schroeder (IEEE Trans. Inf.
        Theory 16, 1970), shifted so that the sum starts at zero.
    """
    tones = harmonics(duration_s, low_hz, high_hz)
    frequencies, phases = [], []
    for k in range(inputs):
        own = tones[k::inputs]
        index = np.arange(1, len(own) + 1)
        phase = -np.pi * index * (index - 1) / max(len(own), 1)
        f = own / duration_s
        # A common delay moves the start to a zero crossing and keeps the shape.
        lag = np.linspace(0.0, duration_s, 4001)
        total = np.sin(2 * np.pi * np.outer(lag, f) + phase).sum(axis=1)
        crossing = int(np.argmax((total[:-1] < 0.0) & (total[1:] >= 0.0)))
        frequencies.append(f)
        phases.append(np.mod(phase + 2 * np.pi * f * lag[crossing], 2 * np.pi))
    return frequencies, phases


def multisine_signal(
    t_s: Array, duration_s: float, frequencies_hz: Array, phases_rad: Array
) -> Array:
    """Return the sum of sines, scaled to a peak of one, zero outside 0..duration."""
    grid = np.linspace(0.0, duration_s, 4001)
    peak = np.abs(np.sin(2 * np.pi * np.outer(grid, frequencies_hz) + phases_rad).sum(axis=1)).max()
    inside = (t_s >= 0.0) & (t_s < duration_s)
    out = np.zeros(len(t_s))
    angle = 2 * np.pi * np.outer(t_s[inside], frequencies_hz) + phases_rad
    out[inside] = np.sin(angle).sum(axis=1) / peak
    return out


def sweep_signal(t_s: Array, duration_s: float, low_hz: float, high_hz: float) -> Array:
    """Return a logarithmic frequency sweep of unit amplitude, faded in and out over a tenth
    each."""
    rate = math.log(high_hz / low_hz)
    share = np.clip(t_s / duration_s, 0.0, 1.0)
    phase = 2 * np.pi * low_hz * duration_s / rate * (np.exp(rate * share) - 1.0)
    fade = np.clip(np.minimum(share, 1.0 - share) * 10.0, 0.0, 1.0)
    return np.where((t_s >= 0.0) & (t_s < duration_s), fade * np.sin(phase), 0.0)


def tone_signal(t_s: Array, duration_s: float, tones: Array) -> Array:
    """Return a multisine of chosen tones as the logger flies it: held within one, zero outside.

    Parameters
    ----------
    t_s : (n,) array
    duration_s : float
    tones : (k, 3) array
        Harmonic of 1/`duration_s`, share of the amplitude, phase in turns.

    Returns
    -------
    (n,) array
        ``sum share * sin(2 pi (harmonic t / duration + phase))`` (protocol/flight-card.md).
    """
    inside = (t_s >= 0.0) & (t_s < duration_s)
    turns = np.outer(t_s[inside] / duration_s, tones[:, 0]) + tones[:, 2]
    out = np.zeros(len(t_s))
    out[inside] = np.clip(np.sin(2.0 * np.pi * turns) @ tones[:, 1], -1.0, 1.0)
    return out
