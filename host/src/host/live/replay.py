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
from host.original.row_rate import RowRate, row_rate
from host.original.rows import OriginalRows, looks_like_rows, read_rows
from host.physical.calibration import load_calibration
from host.wire.framing import SCHEMA_HASH_ID, envelope
from host.wire.stream import Stream

RADIO_RATE_HZ = 20.0
_HASH_S = 5.0
_WAIT_S = 0.02
_CHUNK_S = 2.0  # of flight made into envelopes at a time
_AT_ONCE = 1 << 16  # bytes of a portion where nothing waits
_NOMINAL_HZ = {"27 readings": 10.0, "23 readings": 10.0, "26 readings": 20.0}  # thesis 4.3, 5.2
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
    rate_hz : float, optional
        Identification frames a second of a log of the card, the radio's without it; a capture is
        played as received. Rows of text a second as they were printed; without it GPS tells.
    """

    path: Path
    speed: float = 1.0
    rate_hz: float | None = None
    baud: int = 0
    recorded: bool = True
    _rows: tuple[OriginalRows, RowRate] | None = None

    @property
    def name(self) -> str:
        """As on the command line."""
        if self.speed == 1.0:
            return f"replay:{self.path}"
        return f"replay:{self.path}@{'max' if math.isinf(self.speed) else f'{self.speed:g}x'}"

    def portions(self, tell: Tell) -> Iterator[bytes]:
        """Yield what the radio would have sent; ends with the recording."""
        if (rows := self._text_rows()) is not None:
            tell(f"{self.path}: {_rate_words(*rows)}")
            parts = self._text(rows[0])
        else:
            parts = self._parts(read_log(self.path))
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

    @property
    def row_rate_hz(self) -> float | None:
        """Rows of text a second; None for frames, which carry their time."""
        rows = self._text_rows()
        return None if rows is None else _played_hz(*rows)

    def _text_rows(self) -> tuple[OriginalRows, RowRate] | None:
        if self._rows is None:
            with self.path.open("rb") as file:
                text = looks_like_rows(file.read(_HEAD))
            if text:
                rows = read_rows(self.path)
                self._rows = rows, row_rate(rows, self.rate_hz)
        return self._rows

    def _text(self, rows: OriginalRows) -> Iterator[tuple[float, bytes]]:
        data, rate_hz = self.path.read_bytes(), self.row_rate_hz or 1.0
        begin = 0
        for number, end in enumerate([*rows.offset[1:].tolist(), len(data)]):
            yield number / rate_hz, data[begin:end]
            begin = end

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
            return 0.9 / (self.rate_hz or RADIO_RATE_HZ)
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


def _played_hz(rows: OriginalRows, rate: RowRate) -> float:
    """Return the rate of rows, or that of the thesis's flights where they do not tell it."""
    return rate.rate_hz if rate.known else _NOMINAL_HZ[rows.variant]


def _rate_words(rows: OriginalRows, rate: RowRate) -> str:
    if rate.known:
        return f"{len(rows)} rows at {rate.text}"
    return (
        f"{len(rows)} rows without a time, and GPS saw no way to tell it from: played at"
        f" {_NOMINAL_HZ[rows.variant]:g} a second, as the thesis flew; --rate if it was another"
    )


def replay_source(text: str, rate_hz: float | None = None) -> ReplaySource:
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
    if source.row_rate_hz is None:
        log = read_log(path, calibration=load_calibration(), limit_bytes=_HEAD * 64)
        if not len(log.blocks):
            raise NotALogError(f"{path}: nothing in it to play")
    return source
