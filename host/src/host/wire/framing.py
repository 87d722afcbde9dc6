"""Telemetry envelopes: a stream of bytes -> frames (protocol/README.md, "Telemetry").

One loop serves a stream that comes in portions and a file of one; 1.1 us per byte run of noise or
per envelope, so that eight hours from the radio (a million envelopes) take seconds.
"""

from __future__ import annotations

import binascii
import re
from dataclasses import dataclass, field

SYNC = b"\xa5\x5a"
LONGEST_FRAME = 128
HEAD_BYTES = 3  # sync and length
TAIL_BYTES = 2  # CRC-16
SCHEMA_HASH_ID = 0  # an envelope of five bytes: id 0 and the hash of the schema
_TEXT = re.compile(rb"\n?[ -~]*(?:\r\n[ -~]*)*\r?")


def crc16(data: bytes | memoryview) -> int:
    """Return CRC-16/CCITT-FALSE; "123456789" gives 0x29B1."""
    return binascii.crc_hqx(data, 0xFFFF)


def envelope(frame: bytes) -> bytes:
    """Return one frame, with its id, in its envelope.

    Raises
    ------
    ValueError
        If the frame is empty or longer than 128 bytes.
    """
    if not 1 <= len(frame) <= LONGEST_FRAME:
        raise ValueError(f"a frame of {len(frame)} bytes; an envelope holds 1 to {LONGEST_FRAME}")
    covered = bytes([len(frame)]) + frame
    return SYNC + covered + crc16(covered).to_bytes(TAIL_BYTES, "little")


@dataclass(slots=True)
class EnvelopeScan:
    """Envelopes in a piece of stream.

    Parameters
    ----------
    places : list of int
        Where each begins.
    failed : int
        Syncs followed by a bad length or a wrong CRC.
    skipped : int
        Bytes in no good envelope and not pending.
    pending_from : int
        Where bytes begin that may still become an envelope.
    """

    places: list[int] = field(default_factory=list)
    failed: int = 0
    skipped: int = 0
    pending_from: int = 0


def find_envelopes(data: bytes | bytearray, *, ended: bool = False) -> EnvelopeScan:
    """Find the good envelopes of a stream.

    After a length out of range or a wrong CRC the search goes on from the byte behind the first
    sync byte: an envelope may begin inside.

    Parameters
    ----------
    data : bytes
    ended : bool
        No more will come: what still waits for bytes is a failed envelope too.
    """
    found = EnvelopeScan()
    at, size, view = 0, len(data), memoryview(data)
    while True:
        sync = data.find(SYNC, at)
        if sync < 0:  # the last byte may be the first half of a sync
            sync = size - (1 if size > at and data[size - 1] == SYNC[0] and not ended else 0)
            found.skipped += sync - at
            found.pending_from = sync
            break
        found.skipped += sync - at
        at = sync
        length = data[at + 2] if at + 2 < size else 1
        end = at + HEAD_BYTES + length + TAIL_BYTES
        if 1 <= length <= LONGEST_FRAME:
            if end > size and not ended:
                found.pending_from = at
                break
            if end <= size and crc16(view[at + 2 : end - 2]) == data[end - 2] | data[end - 1] << 8:
                found.places.append(at)
                at = end
                continue
        found.failed += 1
        found.skipped += 1
        at += 1
    view.release()
    return found


def _between(data: bytes | bytearray, found: EnvelopeScan) -> bytes:
    """Return the bytes that were skipped."""
    parts, at = [], 0
    for place in found.places:
        parts.append(data[at:place])
        at = place + HEAD_BYTES + data[place + 2] + TAIL_BYTES
    return b"".join([*parts, data[at : found.pending_from]])


def text_of(data: bytes) -> bytes:
    """Return the bytes between the envelopes of a whole recording: on USB, lines of text."""
    reader = EnvelopeReader()
    reader.feed(data)
    return reader.between


def is_text(data: bytes) -> bool:
    r"""Tell whether bytes between envelopes are printable ASCII with line ends, cut or whole."""
    return _TEXT.fullmatch(data) is not None


def is_text_cut_short(data: bytes) -> bool:
    """Tell whether a recording's last bytes are text and an envelope that was still coming."""
    at = data.rfind(SYNC[:1])
    if at < 1 or not is_text(data[:at]):
        return False
    rest = data[at:]
    whole = HEAD_BYTES + rest[2] + TAIL_BYTES if len(rest) > 2 else HEAD_BYTES
    return SYNC.startswith(rest[:2]) and len(rest) < whole


@dataclass(slots=True)
class EnvelopeReader:
    """Finds frames in a stream that comes in any portions.

    Parameters
    ----------
    failed : int
        Syncs followed by a bad length or a wrong CRC.
    skipped : int
        Bytes that belong to no good envelope.
    between : bytes
        Those of the last portion. On USB they are text: see `is_text`.
    """

    failed: int = 0
    skipped: int = 0
    between: bytes = b""
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
        held = self._held
        held += data
        found = find_envelopes(held)
        frames = [
            bytes(held[at + HEAD_BYTES : at + HEAD_BYTES + held[at + 2]]) for at in found.places
        ]
        self.failed += found.failed
        self.skipped += found.skipped
        self.between = _between(held, found) if found.skipped else b""
        del held[: found.pending_from]
        return frames
