"""Logs for the tests of the host: written by tests.protocol.log_writer, changed as a test wants."""

from pathlib import Path
from typing import Any

import numpy as np
from host.log import FlightLog, read_log
from numpy.typing import NDArray

from tests.protocol.flights import ident, slow, wrapped
from tests.protocol.log_writer import LogWriter, Timed

ROOT = Path(__file__).resolve().parents[2]
START_US = 2_000_000


def flight(
    seconds: float = 3.0, *, rate_hz: int = 100, start_us: int = START_US, seed: int = 1
) -> list[Timed]:
    """Return identification and slower frames of a stretch of flight, identification first."""
    rng = np.random.default_rng(seed)
    count = round(seconds * rate_hz)
    return [
        ident(start_us, count, rate_hz=rate_hz, rng=rng),
        *slow(start_us, seconds, rng=rng),
    ]


def even(stream: Timed, *, rate_hz: int = 100, start_us: int = START_US) -> NDArray[np.int64]:
    """Put the rows of `stream` on an exact grid and return its unwrapped times."""
    t_us = start_us + np.arange(len(stream.rows), dtype=np.int64) * (1_000_000 // rate_hz)
    stream.rows["t_us"] = wrapped(t_us)
    stream.finished_us[:] = t_us + 4600
    return t_us


def written(*streams: Timed, rate_hz: int = 100, writer: LogWriter | None = None) -> bytes:
    """Return a complete log of one session that holds `streams`."""
    writer = writer or LogWriter()
    writer.begin(rate_hz=rate_hz, t_us=0)
    writer.extend(streams)
    writer.end()
    return writer.data()


def read(path: Path, data: bytes, **options: Any) -> FlightLog:
    """Write `data` to a file below `path` and read it."""
    file = path / "flight.bin"
    file.write_bytes(data)
    return read_log(file, **options)
