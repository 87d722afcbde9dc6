"""Streams as the logger's radio sends them: every n-th identification frame, hash every 5 s."""

from dataclasses import dataclass
from zlib import crc32

import numpy as np

from tests.host.logs import START_US, flight
from tests.protocol.log_writer import Timed, envelope, rows, schema_text

HASH_EVERY_S = 5.0
EVERY = 5  # of 100 identification frames a second the radio carries 20


@dataclass(frozen=True)
class Sent:
    """One frame as sent: when, and its envelope."""

    t_us: int
    data: bytes

    @property
    def is_ident(self) -> bool:
        return self.data[3] == 1


def sent(seconds: float = 12.0, *, session: int = 7, every: int = EVERY) -> list[Sent]:
    """Return the envelopes of a stretch of flight in their order."""
    return as_sent(flight(seconds), seconds, session=session, every=every)


def as_sent(
    streams: list[Timed], seconds: float, *, session: int = 7, every: int = EVERY
) -> list[Sent]:
    """Return the envelopes of frames that were made elsewhere, identification first."""
    ident = streams[0]
    streams[0] = Timed(ident.rows[::every], ident.finished_us[::every])
    parts = [
        Sent(int(at), envelope(row.tobytes()))
        for stream in streams
        for at, row in zip(stream.finished_us, stream.rows, strict=True)
    ]
    for second in np.arange(2.0, seconds, HASH_EVERY_S):
        at = START_US + round(second * 1e6)
        who = rows("identity", 1, t_us=np.array([at], np.uint32))
        who["session"] = session
        told = b"\0" + crc32(schema_text()).to_bytes(4, "little")
        parts += [Sent(at, envelope(told)), Sent(at + 1, envelope(who.tobytes()))]
    return sorted(parts, key=lambda part: part.t_us)


def joined(parts: list[Sent]) -> bytes:
    return b"".join(part.data for part in parts)
