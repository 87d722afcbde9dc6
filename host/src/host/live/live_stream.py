"""Bytes from the radio -> rows and frames, as they come; many consumers read them.

The one place where the stream is decoded: page, bridges, and whatever judges a test point in flight
subscribe here and get the same `LiveUpdate`.
"""

from __future__ import annotations

import zlib
from collections import deque
from collections.abc import Callable, Collection, Sequence
from dataclasses import replace
from statistics import median
from typing import Any

import numpy as np
from numpy.typing import NDArray

from host.link.serial import LineSplitter
from host.link.status_line import StatusLine, parse_status
from host.live.gps_fix import GpsFix, fix_of_frame
from host.live.height_over_start import HeightOverStart
from host.live.live_sample import LIVE_UNITS, Array, LiveUpdate, SlowFrame
from host.live.text_rows import TextRows
from host.people_units import people_columns
from host.physical.airdata import calibrated_airspeed_mps, pressure_altitude_m
from host.physical.calibration import Calibration
from host.physical.channels import ChannelMaker, Rows
from host.wire.framing import SCHEMA_HASH_ID, EnvelopeReader, is_text
from host.wire.schema import Schema
from host.wire.schema_text import known_schemas, parse_schema

Consumer = Callable[[LiveUpdate], None]

_WAITING = 20_000  # frames kept until the schema is known: ten minutes of the radio
_REMEMBERED = 8
_LATE = 1.5  # of the usual time between two rows
_USUAL_OF = 51
_RESET_S = -1.0
_DLPF = 3


class LiveStream:
    """Decodes a stream and hands it on.

    Parameters
    ----------
    calibration : Calibration
        Counts to SI.
    texts : collection of bytes
        Schemas known besides the released ones.
    row_rate_hz : float, optional
        Rate of rows of text that are played again; others are placed where they arrive.

    Attributes
    ----------
    safely : callable
        Calls a consumer with an update; a session's own keeps a mistake in one from the others.
    """

    def __init__(
        self,
        calibration: Calibration,
        texts: Collection[bytes] = (),
        row_rate_hz: float | None = None,
    ) -> None:
        self.safely: Callable[[Consumer, LiveUpdate], None] = lambda one, update: one(update)
        self.calibration = calibration
        self.schema: Schema | None = None
        self.frames = 0
        self.rows = 0
        self.lost = 0
        self.repeated = 0
        self.unread = 0
        self._known = known_schemas() | {zlib.crc32(text): text for text in texts}
        self._reader = EnvelopeReader()
        self._lines = LineSplitter()
        self._text_bytes = 0
        self._text = TextRows(calibration, row_rate_hz)
        self._waiting: deque[bytes] = deque(maxlen=_WAITING)
        self._recent: dict[int, deque[bytes]] = {}
        self._consumers: list[Consumer] = []
        self._refused: set[int] = set()
        self._steps: deque[float] = deque(maxlen=_USUAL_OF)
        self._last_us: int | None = None
        self._t_s = 0.0
        self._last_row_s: float | None = None
        self._static_pa = np.nan
        self._height = HeightOverStart()
        self._maker: ChannelMaker | None = None

    @property
    def damaged_bytes(self) -> int:
        """Bytes in no whole envelope and no text."""
        return 0 if self._text.rows else self._reader.skipped - self._text_bytes

    @property
    def text_variant(self) -> str:
        """Which of the original logger's rows the stream holds; empty for frames."""
        return self._text.variant

    @property
    def received(self) -> bool:
        """True once anything was understood, or waits for the hash of its schema."""
        return bool(self.rows or self.frames or self._waiting or self._refused)

    @property
    def usual_s(self) -> float:
        """Usual time between two rows; 0 before there are three."""
        return median(self._steps) if len(self._steps) > 1 else 0.0

    def subscribe(self, consumer: Consumer) -> None:
        """Call `consumer` with every update from now on, in the thread that feeds."""
        self._consumers.append(consumer)

    def feed(self, data: bytes, arrived_s: float) -> LiveUpdate:
        """Take more of the stream, and hand on what it completes.

        Parameters
        ----------
        data : bytes
        arrived_s : float
            On the clock of `time.time`.
        """
        messages: list[str] = []
        frames: list[bytes] = []
        for frame in self._reader.feed(data):
            if frame[0] == SCHEMA_HASH_ID:
                frames += self._schema_named(frame, messages)
            elif self.schema is None:
                self._waiting.append(frame)
            elif self._is_new(frame):
                frames.append(frame)
        update = replace(self._decoded(frames, arrived_s, messages), status=self._status())
        if self._reader.skipped and not self.frames:
            text = self._text.feed(data, arrived_s)
            if text is not None:
                self.rows += len(text)
                update = text
        for consumer in self._consumers:
            self.safely(consumer, update)
        return update

    def _status(self) -> StatusLine | None:
        """Return the last status line that ended between the envelopes of this portion."""
        text = self._reader.between
        if not is_text(text):
            return None
        self._text_bytes += len(text)
        found = [parse_status(line) for line in self._lines.feed(text)]
        return next(filter(None, reversed(found)), None)

    def _schema_named(self, frame: bytes, messages: list[str]) -> list[bytes]:
        """Take the hash of the schema; return the frames that waited for it."""
        value = int.from_bytes(frame[1:5], "little")
        if self.schema is not None and self.schema.hash == value:
            return []
        text = self._known.get(value)
        if text is None:
            if value not in self._refused:
                self._refused.add(value)
                messages.append(
                    f"telemetry of schema {value:08x}, which this program does not know: it is"
                    " recorded and not shown; install the host tool of that firmware"
                )
            self.schema = None
            return []
        self.schema = parse_schema(text)
        self._maker = ChannelMaker(
            self.schema, self.calibration, dlpf=_DLPF, interval_us=np.inf, aligned=False
        )
        waited = [one for one in self._waiting if self._is_new(one)]
        self._waiting.clear()
        return waited

    def _is_new(self, frame: bytes) -> bool:
        recent = self._recent.setdefault(frame[0], deque(maxlen=_REMEMBERED))
        if frame in recent:
            self.repeated += 1
            return False
        recent.append(frame)
        return True

    def _decoded(
        self, frames: Sequence[bytes], arrived_s: float, messages: list[str]
    ) -> LiveUpdate:
        schema = self.schema
        slow: list[SlowFrame] = []
        fixes: list[GpsFix] = []
        idents: list[bytes] = []
        times: list[float] = []
        static_pa: list[float] = []
        lost = 0
        by_id = {frame.id: frame for frame in schema.frames} if schema else {}
        for data in frames:
            layout = by_id.get(data[0])
            if layout is None or layout.size_bytes != len(data):
                self.unread += 1
                continue
            self.frames += 1
            row = np.frombuffer(data, layout.dtype)
            t_s = self._seconds(int(row["t_us"][0]))
            if layout.name == "ident":
                idents.append(data)
                times.append(t_s)
                # The pressure that came last before it, in however large portions both came.
                static_pa.append(self._static_pa)
                lost += self._missing(t_s)
            else:
                self._air(layout.name, row[0])
                slow.append(SlowFrame(layout.name, row[0], t_s))
                if layout.name == "gps" and schema is not None:
                    fixes.append(fix_of_frame(schema, row[0], t_s))
        self.rows += len(idents)
        self.lost += lost
        rows, drives = self._rows(idents, times, static_pa)
        return LiveUpdate(rows, drives, lost, slow, arrived_s, messages, fixes)

    def _seconds(self, t_us: int) -> float:
        """Return a frame's time since the first one; a reset of the Mega does not turn it back."""
        if self._last_us is None:
            self._last_us = t_us
        step_s = ((t_us - self._last_us + (1 << 31)) % (1 << 32) - (1 << 31)) * 1e-6
        if step_s < _RESET_S:
            step_s = 1.0
            self._last_row_s = None
            self._steps.clear()
        if step_s > 0.0:
            self._t_s += step_s
            self._last_us = t_us
            return self._t_s
        return self._t_s + step_s

    def _missing(self, t_s: float) -> int:
        """Return how many rows did not arrive before this one: by time, for n is decimated."""
        before, self._last_row_s = self._last_row_s, t_s
        if before is None or t_s <= before:
            return 0
        step, usual = t_s - before, self.usual_s
        self._steps.append(step)
        if usual > 0.0 and step > _LATE * usual:
            return max(1, round(step / usual) - 1)
        return 0

    def _air(self, name: str, row: Any) -> None:
        if name == "baro" and self.schema is not None:
            field = self.schema.by_name["baro"].field("static_pressure")
            raw = float(row["static_pressure"])
            self._static_pa = raw * field.scale if raw != field.invalid else np.nan

    def _rows(
        self, idents: list[bytes], times: list[float], static_pa: list[float]
    ) -> tuple[dict[str, Array], NDArray[np.bool_]]:
        if not idents or self._maker is None or self.schema is None:
            return {}, np.empty(0, bool)
        data = np.frombuffer(b"".join(idents), self.schema.by_name["ident"].dtype)
        t_s = np.array(times)
        made = self._maker.columns(Rows(data, t_s * 1e6))
        out = people_columns(made)
        out["t_s"] = t_s
        out["airspeed_a_mps"] = calibrated_airspeed_mps(made["differential_a_pa"])
        out["airspeed_b_mps"] = calibrated_airspeed_mps(made["differential_b_pa"])
        out["altitude_m"] = pressure_altitude_m(np.array(static_pa))
        out["height_m"] = self._height.of(np.asarray(out["altitude_m"], np.float64))
        drives = (data["valid"] & self.schema.bit("valid", "mega_drives")) != 0
        return {name: np.asarray(out[name], np.float64) for name in LIVE_UNITS}, np.asarray(drives)
