"""The Mega's 32-bit clock -> unwrapped microseconds -> seconds, corrected by GPS."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from host.constants import HUBER_LIMIT, MEDIAN_TO_SIGMA, NORMAL_95
from host.wire.blocks import KIND_FRAMES, Blocks
from host.wire.frames import FrameSet

WRAP_US = 1 << 32
_SCALE_LIMIT = 0.02  # a ceramic resonator is good to 0.5 %; more than 2 % is no clock
_MIN_FIXES = 20
MIN_SPAN_S = 20.0
_MAX_HALF_WIDTH = 500e-6  # a fit with a wider interval is not used
_CONVERGED = 1e-9  # of the scale: a thousandth of a ppm


@dataclass(frozen=True, slots=True)
class ClockFit:
    """The Mega's clock against GPS.

    Parameters
    ----------
    scale_error : float
        GPS seconds per second of the Mega's clock, minus 1. Positive: the Mega's clock is slow.
    half_width : float
        95 % interval of `scale_error`, widened for correlated residuals.
    fixes : int
        GPS solutions used.
    span_s : float
        Time they span.
    residual_ms : float
        Standard deviation of the residuals (latency of the receiver), s.
    applied : bool
        True if ``t_s`` is corrected by it.
    """

    scale_error: float
    half_width: float
    fixes: int
    span_s: float
    residual_ms: float
    applied: bool


def block_times_us(blocks: Blocks, system: FrameSet | None) -> NDArray[np.int64]:
    """Return the unwrapped clock at the start of each block.

    Within a session the clock is unwrapped by the signed 32-bit difference between blocks; where
    blocks are missing for half an hour or more, ``system.uptime_s`` says how many wraps they held.

    Parameters
    ----------
    blocks : Blocks
        The log's blocks in order.
    system : FrameSet or None
        Frames `system` of the log.

    Returns
    -------
    NDArray[np.int64], shape (len(blocks),)
        Microseconds; the count starts anew with each session.
    """
    out = np.zeros(len(blocks), np.int64)
    timed = (blocks.kind == KIND_FRAMES) & (blocks.used >= 5)
    for first, last in session_slices(blocks):
        which = first + np.flatnonzero(timed[first:last])
        if not len(which):
            continue
        low = blocks.first_t_us[which]
        steps = np.diff(low.astype(np.int64)).astype(np.uint32).astype(np.int32)
        times = np.r_[np.int64(low[0]), steps].cumsum(dtype=np.int64)
        if system is not None and len(system.data):
            times += _missed_wraps(blocks, which, times, system)
        # Blocks without frames (schema) stand at the time of the frames before them.
        behind = np.searchsorted(which, np.arange(first, last), side="right") - 1
        out[first:last] = times[np.maximum(behind, 0)]
    return out


def session_slices(blocks: Blocks) -> list[tuple[int, int]]:
    """Return first and last + 1 block of each run of one session."""
    edges = np.flatnonzero(np.diff(blocks.session.astype(np.int64))) + 1
    bounds = [0, *edges.tolist(), len(blocks)]
    return [(a, b) for a, b in itertools.pairwise(bounds) if b > a]


def frame_times_us(
    blocks: Blocks, block_us: NDArray[np.int64], frames: FrameSet
) -> NDArray[np.int64]:
    """Return the unwrapped ``t_us`` of frames, microseconds.

    Parameters
    ----------
    blocks : Blocks
    block_us : NDArray[np.int64], shape (len(blocks),)
        From `block_times_us`.
    frames : FrameSet

    Returns
    -------
    NDArray[np.int64], shape (len(frames.data),)
    """
    base = block_us[frames.block]
    step = (frames.data["t_us"] - base.astype(np.uint32)).astype(np.int32)
    return np.asarray(base + step, np.int64)


def fit_gps(parts: list[tuple[NDArray[np.int64], NDArray[np.int64]]]) -> ClockFit | None:
    """Fit the clock's scale to GPS time, one offset per session, robustly.

    Parameters
    ----------
    parts : list of (t_us, gps_ms)
        Per session: unwrapped clock and GPS time of its valid solutions.

    Returns
    -------
    ClockFit or None
        None without enough fixes.

    Notes
    -----
    Iteratively reweighted least squares with Huber's weights, of robust standard deviations.
    """
    parts = [part for part in parts if len(part[0]) >= 3]
    count = sum(len(part[0]) for part in parts)
    if count < _MIN_FIXES:
        return None
    t_s = [(t - t[0]) * 1e-6 for t, _ in parts]
    late_s = [(g - g[0]) * 1e-3 - t for (_, g), t in zip(parts, t_s, strict=True)]
    owner = np.repeat(np.arange(len(parts)), [len(t) for t in t_s])
    x, y = np.concatenate(t_s), np.concatenate(late_s)
    weight = np.ones(count)
    slope, sigma = 0.0, 0.0
    for _ in range(20):
        total = np.bincount(owner, weight)
        xc = x - (np.bincount(owner, weight * x) / total)[owner]
        yc = y - (np.bincount(owner, weight * y) / total)[owner]
        spread = float(np.sum(weight * xc * xc))
        if spread <= 0.0:
            return None
        before, slope = slope, float(np.sum(weight * xc * yc)) / spread
        residual = yc - slope * xc
        sigma = MEDIAN_TO_SIGMA * float(np.median(np.abs(residual - np.median(residual))))
        sigma = max(sigma, 1e-4)  # GPS times of week are whole milliseconds
        weight = np.minimum(1.0, HUBER_LIMIT * sigma / np.maximum(np.abs(residual), 1e-12))
        if abs(slope - before) < _CONVERGED:
            break
    # Latency wanders slowly: first-order correlation r leaves n (1 - r)/(1 + r) independent fixes.
    lagged = 0.0
    if np.ptp(residual[1:]) > 0.0 and np.ptp(residual[:-1]) > 0.0:
        lagged = float(np.clip(np.corrcoef(residual[1:], residual[:-1])[0, 1], 0.0, 0.95))
    half_width = NORMAL_95 * sigma / np.sqrt(spread) * np.sqrt((1 + lagged) / (1 - lagged))
    span_s = float(max(t[-1] for t in t_s))
    good = half_width <= _MAX_HALF_WIDTH and span_s >= MIN_SPAN_S and abs(slope) <= _SCALE_LIMIT
    return ClockFit(slope, float(half_width), count, span_s, sigma * 1e3, bool(good))


def gps_times_ms(data: NDArray[Any], fixes: tuple[int, ...]) -> NDArray[np.int64]:
    """Return GPS time of frames `gps`, ms since GPS week 0, or -1 where it is not valid."""
    itow = data["itow_ms"].astype(np.int64)
    out = itow + data["week"].astype(np.int64) * 604_800_000
    valid = np.isin(data["fix"], fixes) & (data["itow_ms"] != 0xFFFFFFFF)
    return np.asarray(np.where(valid, out, -1), np.int64)


def _missed_wraps(
    blocks: Blocks, which: NDArray[np.intp], times: NDArray[np.int64], system: FrameSet
) -> NDArray[np.int64]:
    inside = (system.block >= which[0]) & (system.block <= which[-1])
    extra = np.zeros(len(times), np.int64)
    if not inside.any():
        return extra
    data, block = system.data[inside], system.block[inside]
    place = np.searchsorted(which, block)
    seen = times[place] + (data["t_us"] - times[place].astype(np.uint32)).astype(np.int32)
    uptime_us = data["uptime_s"].astype(np.int64) * 1_000_000
    # Uptime only grows: its running maximum bounds the sum, whatever a forged log says.
    missed = np.maximum.accumulate(np.rint((uptime_us - seen) / WRAP_US).astype(np.int64))
    jumps = np.flatnonzero(np.diff(missed) > 0)
    for jump in jumps.tolist():
        # Somewhere between these two frames: where most blocks are missing.
        low, high = int(place[jump]), int(place[jump + 1])
        gaps = np.diff(blocks.sequence[which[low : high + 1]].astype(np.int64))
        if len(gaps) and gaps.max() > 1:
            extra[low + 1 + int(np.argmax(gaps))] += int(missed[jump + 1] - missed[jump])
    return np.asarray(extra.cumsum() * WRAP_US, np.int64)
