"""Present readings of the logger's sensors: a thread reads its envelopes on USB.

The logger sends 20 a second while it records nothing, and the hash of their schema before each of
its status lines. Nothing is ever sent to it.
"""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from types import TracebackType
from typing import Protocol, Self

import numpy as np
from numpy.typing import NDArray

from host.bench_calibration.raw_channel import raw_channel
from host.link.serial import DeviceError
from host.wire.framing import SCHEMA_HASH_ID, EnvelopeReader
from host.wire.schema import Schema
from host.wire.schema_text import known_schemas, packed_schema, parse_schema

SILENT_S = 10.0  # time allowed for bootloader, start of the logger and its first line
_KEPT = 1300  # rows: 65 s, a pressure is held for 60


class Link(Protocol):
    """An open port."""

    device: str

    def data(self) -> bytes:
        """Return what has come in, after a short wait; DeviceError when it goes away."""
        ...


class UsbChannels:
    """The newest rows of an open port; ``with`` begins and ends the reading.

    Parameters
    ----------
    link : Link
    keep : callable, optional
        Takes every portion of received bytes.

    Attributes
    ----------
    schema : Schema or None
        None until the logger named it.
    seen : callable or None
        Called behind each portion with new rows, in the thread that reads.
    """

    def __init__(self, link: Link, keep: Callable[[bytes], object] | None = None) -> None:
        self.schema: Schema | None = None
        self.seen: Callable[[], None] | None = None
        self._link, self._keep = link, keep
        self._reader = EnvelopeReader()
        self._rows: deque[bytes] = deque(maxlen=_KEPT)
        self._came = 0
        self._error: DeviceError | None = None
        self._change = threading.Condition()
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name="usb", daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._stop.set()
        self._thread.join()

    def newest(self, name: str) -> float:
        """Return a channel of the last row; NaN before there is one, or where it is not valid."""
        with self._change:
            last = list(self._rows)[-1:]
        if not last:
            return float("nan")
        schema, rows = self._parsed(last)
        return float(raw_channel(schema, rows, name)[0])

    def next_rows(self, count: int) -> tuple[Schema, NDArray[np.void]]:
        """Wait for rows that come from now on; return them with their schema.

        Raises
        ------
        DeviceError
            If the port goes away, or sends none for ten seconds.
        """
        with self._change:
            first = self._came
            while self._came - first < count:
                woken = self._change.wait(SILENT_S)
                if self._error is not None:
                    raise self._error
                if not woken:
                    raise DeviceError(
                        f"{self._link.device}: no channel for {SILENT_S:g} s; the logger sends"
                        " them while it records nothing: end the session; or is its image older"
                        " than this program?"
                    )
            return self._parsed(list(self._rows)[-(self._came - first) :][:count])

    def _run(self) -> None:
        try:
            while not self._stop.is_set():
                data = self._link.data()
                if data and self._keep is not None:
                    self._keep(data)
                if self._took(self._reader.feed(data)) and self.seen is not None:
                    self.seen()
        except DeviceError as error:
            with self._change:
                self._error = error
                self._change.notify_all()

    def _took(self, frames: list[bytes]) -> bool:
        """Keep the rows among frames; return whether there were any."""
        with self._change:
            before = self._came
            for frame in frames:
                if frame[0] == SCHEMA_HASH_ID:
                    self._named(int.from_bytes(frame[1:5], "little"))
                    continue
                ident = self.schema.by_name["ident"] if self.schema is not None else None
                if ident is not None and (frame[0], len(frame)) == (ident.id, ident.size_bytes):
                    self._rows.append(frame)
                    self._came += 1
            if self._came == before:
                return False
            self._change.notify_all()
            return True

    def _named(self, number: int) -> None:
        packed = packed_schema()
        if number == packed.hash:
            self.schema = packed
            return
        text = known_schemas().get(number)
        if text is None:
            raise DeviceError(
                f"{self._link.device}: channels of schema {number:08x}, which this program does not"
                " know; install the host tool of that firmware"
            )
        self.schema = parse_schema(text)

    def _parsed(self, frames: list[bytes]) -> tuple[Schema, NDArray[np.void]]:
        assert self.schema is not None  # rows are kept only with one
        return self.schema, np.frombuffer(b"".join(frames), self.schema.by_name["ident"].dtype)
