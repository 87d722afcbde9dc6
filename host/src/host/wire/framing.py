"""Telemetry envelopes: a stream of bytes -> frames (protocol/README.md, "Telemetry").

The rate is a few kB/s: clarity before speed. The log has its own, vectorised way (blocks.py).
"""

from __future__ import annotations

import binascii
from dataclasses import dataclass, field

from construct import (
    Checksum,
    ChecksumError,
    Const,
    ExprValidator,
    GreedyBytes,
    Int8ul,
    Int16ul,
    Prefixed,
    RawCopy,
    StreamError,
    Struct,
    ValidationError,
    this,
)

SYNC = b"\xa5\x5a"
LONGEST_FRAME = 128


def crc16(data: bytes) -> int:
    """Return CRC-16/CCITT-FALSE; "123456789" gives 0x29B1."""
    return binascii.crc_hqx(data, 0xFFFF)


_LENGTH = ExprValidator(Int8ul, lambda length, _: 1 <= length <= LONGEST_FRAME)
ENVELOPE = Struct(
    "sync" / Const(SYNC),
    "covered" / RawCopy(Prefixed(_LENGTH, GreedyBytes)),
    "crc" / Checksum(Int16ul, crc16, this.covered.data),
)


def envelope(frame: bytes) -> bytes:
    """Return one frame, with its id, in its envelope.

    Raises
    ------
    ValueError
        If the frame is empty or longer than 128 bytes.
    """
    if not 1 <= len(frame) <= LONGEST_FRAME:
        raise ValueError(f"a frame of {len(frame)} bytes; an envelope holds 1 to {LONGEST_FRAME}")
    return bytes(ENVELOPE.build({"covered": {"value": frame}}))


@dataclass(slots=True)
class EnvelopeReader:
    """Finds frames in a stream that comes in any portions.

    Parameters
    ----------
    failed : int
        Syncs followed by a bad length or a wrong CRC.
    skipped : int
        Bytes that belong to no good envelope.
    """

    failed: int = 0
    skipped: int = 0
    _held: bytearray = field(default_factory=bytearray)

    @property
    def pending(self) -> int:
        """Bytes at the end of the stream that may still become an envelope."""
        return len(self._held)

    def feed(self, data: bytes) -> list[bytes]:
        """Take more of the stream and return the frames that are now whole, each with its id.

        Parameters
        ----------
        data : bytes

        Returns
        -------
        list of bytes
            Frames of unknown id too: what an id means is for the reader of frames.
        """
        self._held += data
        frames: list[bytes] = []
        while True:
            self._skip_to_sync()
            try:
                found = ENVELOPE.parse(self._held)
            except StreamError:  # not all of it is here yet
                return frames
            except (ValidationError, ChecksumError):
                self._fail()
                continue
            frames.append(found.covered.value)
            del self._held[: found.covered.length + len(SYNC) + Int16ul.sizeof()]

    def _skip_to_sync(self) -> None:
        at = self._held.find(SYNC)
        if at < 0:  # the last byte may be the first half of a sync
            at = len(self._held) - (1 if self._held.endswith(SYNC[:1]) else 0)
        self.skipped += at
        del self._held[:at]

    def _fail(self) -> None:
        # Search on from the byte behind the first sync byte: an envelope may begin inside.
        self.failed += 1
        self.skipped += 1
        del self._held[:1]
