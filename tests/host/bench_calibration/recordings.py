"""Recordings of the bench as the logger has them: positions held, motion between."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tests.host.live.radio import as_sent, joined
from tests.host.logs import START_US, even, flight, written
from tests.protocol.flights import wrapped
from tests.protocol.log_writer import Timed, rows

RATE_HZ = 100
MOVE_S = 1.0


def held_counts(
    levels: Sequence[float], hold_s: float = 3.0, *, noise: float = 0.4, seed: int = 1
) -> NDArray[np.float64]:
    """Return a channel that holds each level and moves evenly to the next."""
    hold, move = round(hold_s * RATE_HZ), round(MOVE_S * RATE_HZ)
    parts = []
    for level, after in zip(levels, [*levels[1:], levels[-1]], strict=True):
        parts += [np.full(hold, float(level)), np.linspace(level, after, move)]
    out = np.concatenate(parts)
    return out + noise * np.random.default_rng(seed).standard_normal(len(out))


def recording(
    path: Path,
    channels: dict[str, NDArray[np.float64]],
    marks_s: Sequence[float] = (),
    *,
    radio: bool = False,
) -> Path:
    """Write a log whose channels have these values, in the raw unit of frames.toml, IMU in SI;
    or what the radio carries of it, every fifth frame."""
    count = len(next(iter(channels.values())))
    streams = flight(count / RATE_HZ)
    ident = streams[0].rows
    even(streams[0])
    scale = {"p": 2.664624812204e-4, "a": 1.197100830078e-3, "r": 0.5}
    for name in ("alpha_a", "alpha_b", "beta_a", "beta_b", "dp_a", "dp_b"):
        ident[name] = 2048
    for name in ("p", "q", "r", "ax", "ay", "az"):
        ident[name] = 0
    for name, value in channels.items():
        step = 0.25
        if name in ("p", "q", "r"):
            step = scale["p"]
        elif name in ("ax", "ay", "az"):
            step = scale["a"]
        elif name.startswith("rc_"):
            step = scale["r"]
        ident[name] = np.round(value / step)
    marks_us = START_US + np.round(np.array(marks_s) * 1e6).astype(np.int64)
    if len(marks_us):
        events = rows("event", len(marks_us), t_us=wrapped(marks_us), code=24)
        streams.append(Timed(events, marks_us + 5000))
    path.write_bytes(joined(as_sent(streams, count / RATE_HZ)) if radio else written(*streams))
    return path
