"""A recording played again as the radio would have sent it, in real time or faster."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from host.errors import NotALogError, UsageError
from host.files.regular import regular_file
from host.live.live_sources import SPEED, Tell
from host.log import FlightLog, read_log
from host.original.rows import looks_like_rows
from host.physical.calibration import load_calibration
from host.wire.framing import SCHEMA_HASH_ID, envelope
from host.wire.stream import Stream

RADIO_RATE_HZ = 20.0
_HASH_S = 5.0
_WAIT_S = 0.02
_CHUNK_S = 2.0  # of flight made into envelopes at a time
_AT_ONCE = 1 << 16  # bytes of a portion where nothing waits
_TEXT_BYTES_PER_S = 5 * 269.0  # rows of text carry no time: five a second of the thesis's length
_HEAD = 4096
# Least time between two frames of a kind on the radio, s (firmware/app/telemetry.cpp).
_LEAST_S = {"mag": 0.484 * 1.024, "attitude": 0.191 * 1.024, "baro": 0.191 * 1.024}


@dataclass(slots=True)
class ReplaySource:
    """A log of the card, a ground capture or a file of text rows, played again.

    Parameters
    ----------
    path : Path
    speed : float
        Flight seconds per second; infinite as fast as it is decoded.
    rate_hz : float
        Identification frames a second of a log of the card; a capture is played as received.
    """

    path: Path
    speed: float = 1.0
    rate_hz: float = RADIO_RATE_HZ
    baud: int = 0
    recorded: bool = True

    @property
    def name(self) -> str:
        """As on the command line."""
        if self.speed == 1.0:
            return f"replay:{self.path}"
        return f"replay:{self.path}@{'max' if math.isinf(self.speed) else f'{self.speed:g}x'}"

    def portions(self, tell: Tell) -> Iterator[bytes]:
        """Yield what the radio would have sent; ends with the recording."""
        parts = self._text() if self._is_text() else self._parts(read_log(self.path))
        start_s = yielded_s = time.monotonic()
        gathered = bytearray()
        for at_s, data in parts:
            gathered += data
            if len(gathered) >= _AT_ONCE:
                yield bytes(gathered)
                gathered.clear()
            if math.isinf(self.speed):
                continue
            while (wait_s := start_s + at_s / self.speed - time.monotonic()) > 0.0:
                time.sleep(min(_WAIT_S, wait_s))
                if time.monotonic() - yielded_s > _WAIT_S:
                    yield bytes(gathered)
                    gathered.clear()
                    yielded_s = time.monotonic()
        yield bytes(gathered)
        tell(f"end of {self.path}")

    def _is_text(self) -> bool:
        with self.path.open("rb") as file:
            return looks_like_rows(file.read(_HEAD))

    def _text(self) -> Iterator[tuple[float, bytes]]:
        data = self.path.read_bytes()
        step = 64
        for at in range(0, len(data), step):
            yield (at + step) / _TEXT_BYTES_PER_S, data[at : at + step]

    def _parts(self, log: FlightLog) -> Iterator[tuple[float, bytes]]:
        return self._timed(log) if log.stream is None else _as_received(log.stream)

    def _timed(self, log: FlightLog) -> Iterator[tuple[float, bytes]]:
        """Yield seconds since the first row and an envelope, in order."""
        hash_envelope = envelope(bytes([SCHEMA_HASH_ID]) + log.schema.hash.to_bytes(4, "little"))
        next_hash_s = -math.inf
        for session in log.sessions:
            slow = {name: session.slow(name) for name in log.schema.by_name if name != "ident"}
            first_s, last_s = -math.inf, dict.fromkeys(log.schema.by_name, -math.inf)
            for part in session.store.fast_pieces(session.span):
                t_us = session.since_start_us(part)
                kinds = {"ident": (part.data, t_us), **slow}
                end_s = (t_us[0] if len(t_us) else 0.0) * 1e-6
                while len(t_us) and first_s <= t_us[-1] * 1e-6:
                    end_s += _CHUNK_S
                    chunk = sorted(
                        self._chunk(kinds, first_s, end_s, last_s), key=lambda one: one[0]
                    )
                    for at_s, frame in chunk:
                        if at_s + session.offset_s >= next_hash_s:
                            next_hash_s = at_s + session.offset_s + _HASH_S
                            yield at_s + session.offset_s, hash_envelope
                        yield at_s + session.offset_s, envelope(frame)
                    first_s = end_s

    def _chunk(
        self,
        kinds: dict[str, tuple[Any, Any]],
        first_s: float,
        end_s: float,
        last_s: dict[str, float],
    ) -> Iterator[tuple[float, bytes]]:
        """Yield time and frame of each kind as often as the radio sends it."""
        for name, (data, t_us) in kinds.items():
            low, high = np.searchsorted(t_us, (first_s * 1e6, end_s * 1e6))
            least_s = self._least_s(name)
            for at in range(int(low), int(high)):
                at_s = float(t_us[at]) * 1e-6
                if at_s - last_s[name] >= least_s:
                    last_s[name] = at_s
                    yield at_s, data[at].tobytes()

    def _least_s(self, name: str) -> float:
        if name == "ident":
            return 0.9 / self.rate_hz
        return _LEAST_S.get(name, 0.0)


def _as_received(stream: Stream) -> Iterator[tuple[float, bytes]]:
    """Yield seconds and bytes of a capture in the order in which they came, damage included."""
    blocks = stream.blocks
    # Clocks wrap; a reset takes no time.
    step_us = np.diff(blocks.first_t_us, prepend=blocks.first_t_us[:1]).astype(np.int32)
    step_us[np.diff(blocks.session, prepend=blocks.session[:1]) != 0] = 0
    at_s = np.maximum.accumulate(np.cumsum(step_us, dtype=np.int64)) * 1e-6
    ends = [*blocks.position[1:].tolist(), len(stream.data)]
    begin = 0
    for at, end in zip(at_s.tolist(), ends, strict=True):
        yield at, stream.data[begin:end]
        begin = end


def replay_source(text: str, rate_hz: float) -> ReplaySource:
    """Return the source of ``FILE`` or ``FILE@10x``; raises UsageError or NotALogError."""
    speed = 1.0
    found = SPEED.fullmatch(text)
    if found and not Path(text).exists():
        text = found[1]
        speed = math.inf if found[2].lower() == "max" else float(found[2])
    if not speed > 0.0:
        raise UsageError(f"{text}: a speed of {speed:g}, expected more than 0, such as @10x")
    path = regular_file(Path(text))
    source = ReplaySource(path, speed, rate_hz)
    if not source._is_text():
        log = read_log(path, calibration=load_calibration(), limit_bytes=_HEAD * 64)
        if not len(log.blocks):
            raise NotALogError(f"{path}: nothing in it to play")
    return source
