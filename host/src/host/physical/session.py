"""One recording session of a log: its blocks, its clock, its slower frames."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from host.physical.calibration import Calibration
from host.physical.timebase import frame_times_us
from host.wire.frames import FrameSet
from host.wire.schema import Schema
from host.wire.store import FrameStore

Array = NDArray[np.float64]
_RATE_ROWS = 10_000  # enough for a median interval
_POTS = {
    "elevator": ("pot_elevator",),
    "aileron": ("pot_aileron_left", "pot_aileron_right"),
    "rudder": ("pot_rudder",),
}


@dataclass(slots=True)
class Session:
    """A run of blocks with one session number.

    Parameters
    ----------
    number : int
        Session number of the blocks.
    span : (int, int)
        First and last + 1 block among the log's blocks.
    store : FrameStore
    block_us : NDArray[np.int64]
        Unwrapped clock of every block of the log.
    calibration : Calibration
    inputs : mapping of str to str
        For each surface ``measured`` or ``commanded``.
    clock_scale : float
        GPS seconds per second of the Mega's clock.
    offset_s : float
        ``t_s`` of the session's first identification frame.
    """

    number: int
    span: tuple[int, int]
    store: FrameStore
    block_us: NDArray[np.int64]
    calibration: Calibration
    inputs: Mapping[str, str]
    clock_scale: float = 1.0
    offset_s: float = 0.0
    start_us: int = 0
    end_us: int = 0
    rate_hz: float = 0.0
    dlpf: int = 0
    rows: int = field(default=0)
    ident_span: tuple[int, int] = (0, 0)  # first and last block with identification frames

    def __post_init__(self) -> None:
        first = last = None
        for part in self.store.fast_pieces(self.span):
            if len(part.data):
                first = part if first is None else first
                last = part
                self.rows += len(part.data)
        if first is not None and last is not None:
            self.ident_span = int(first.block[0]), int(last.block[-1])
            self.start_us = int(self._times(_cut(first, 0, 1))[0])
            self.end_us = int(self._times(_cut(last, -1, None))[0])
            self.rate_hz = self._rate_hz(_cut(first, 0, _RATE_ROWS))
        elif self.span[1] > self.span[0]:
            self.start_us = int(self.block_us[self.span[0]])
            self.end_us = int(self.block_us[self.span[1] - 1])
        self.dlpf = self._dlpf()

    @property
    def interval_us(self) -> float:
        """Usual time between two identification frames."""
        return 1e6 / self.rate_hz if self.rate_hz else float("inf")

    @property
    def duration_s(self) -> float:
        """From the first identification frame to the last, s of ``t_s``."""
        return (self.end_us - self.start_us) * 1e-6 * self.clock_scale

    def since_start_us(self, frames: FrameSet) -> Array:
        """Return the unwrapped ``t_us`` of frames since the session's first ident frame."""
        return (self._times(frames) - self.start_us).astype(np.float64)

    def seconds(self, since_start_us: Array) -> Array:
        """Return ``t_s`` of instants on the session's clock."""
        return self.offset_s + since_start_us * (1e-6 * self.clock_scale)

    def slow(self, name: str) -> tuple[NDArray[Any], Array]:
        """Return frames of a slower kind and their time since the session's start, rising."""
        if name not in self.store.schema.by_name:
            return np.empty(0), np.empty(0)
        frames = self.store[name]
        low, high = np.searchsorted(frames.block, self.span)
        part = FrameSet(frames.data[low:high], frames.block[low:high])
        t_us = self.since_start_us(part)
        if len(t_us) and bool((np.diff(t_us) < 0).any()):
            order = np.argsort(t_us, kind="stable")
            return part.data[order], t_us[order]
        return part.data, t_us

    def _times(self, frames: FrameSet) -> NDArray[np.int64]:
        return frame_times_us(self.store.blocks, self.block_us, frames)

    def _rate_hz(self, first: FrameSet) -> float:
        # Settings state the wanted rate; the frames show the real one.
        t_us = self._times(first)
        count: NDArray[np.int64] = first.data["count"].astype(np.int64)
        turns = (count[1:] - count[:-1]) & 0xFFFF
        # A card has every frame; a radio carries every n-th, where n may alternate: its usual time.
        usual = int(np.bincount(turns).argmax()) if len(turns) else 1
        steps = np.diff(t_us)[turns == 1] if usual == 1 else np.diff(t_us)
        config, _ = self.slow("config")
        asked = float(config["rate_hz"][0]) if len(config) and usual == 1 else 0.0
        if not len(steps):
            return asked or 100.0
        seen = 1e6 / max(1.0, float(np.median(steps)))
        return asked if asked and abs(seen / asked - 1.0) < 0.02 else seen

    def _dlpf(self) -> int:
        """Key of the IMU's filter delays (protocol/README.md, "Sampling instants")."""
        attitude, _ = self.slow("attitude")
        if len(attitude):
            known = attitude["dlpf"][attitude["dlpf"] != 255]
            if len(known):
                return int(np.bincount(known).argmax())
        if _mostly(self.store.schema, self.store.sample, "imu_original"):
            return 4
        return 2 if self.rate_hz > 150.0 else 3


def _cut(frames: FrameSet, first: int, last: int | None) -> FrameSet:
    return FrameSet(frames.data[first:last], frames.block[first:last])


def surface_sources(store: FrameStore) -> dict[str, str]:
    """Return for each surface whether the table holds its measured position or the command.

    One answer per log: a column that changed its meaning halfway would mislead a fit.
    """
    sample = store.sample
    return {
        surface: "measured"
        if all(_mostly(store.schema, sample, pot) for pot in pots)
        else "commanded"
        for surface, pots in _POTS.items()
    }


def _mostly(schema: Schema, sample: NDArray[Any], bit: str) -> bool:
    mask = schema.bit("valid", bit)
    return bool(len(sample)) and bool(np.mean((sample["valid"] & mask) != 0) >= 0.5)
