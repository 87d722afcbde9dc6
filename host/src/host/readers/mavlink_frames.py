"""The frames of a telemetry log, found and proven in portions.

Each frame stands behind the ground station's time (8 bytes, us, most significant first). A frame of
a wanted kind counts only if its checksum is right. Nothing of a wrong one is trusted, not even its
length, so the search goes on one byte further until it meets a frame that was found before.
"""

from __future__ import annotations

from bisect import bisect
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from host.arrays import BoolArray, IntArray

STAMP_BYTES = 8
V1, V2 = 0xFE, 0xFD
V1_HEAD_BYTES, V2_HEAD_BYTES, CRC_BYTES, SIGNATURE_BYTES = 6, 10, 2, 13
SIGNED = 1
SHORTEST_BYTES = STAMP_BYTES + V1_HEAD_BYTES + CRC_BYTES
_POLYNOMIAL = 0x8408  # CRC-16/MCRF4XX, which MAVLink calls X.25: reflected 0x1021, start 0xFFFF
Bytes = NDArray[np.uint8]


def _crc_table() -> NDArray[np.uint16]:
    crc = np.arange(256, dtype=np.uint16)
    for _ in range(8):
        crc = np.where(crc & 1, (crc >> 1) ^ _POLYNOMIAL, crc >> 1).astype(np.uint16)
    return crc


_TABLE = _crc_table()


@dataclass(frozen=True, slots=True)
class Frames:
    """Frames of a portion, in its order.

    Attributes
    ----------
    starts : (n,) array
        Offset of the time in front of each, in the portion.
    kinds, senders, numbers : (n,) arrays
        Message, 256 times system plus component, and the sender's running number of each.
    body_at, body_bytes : (n,) arrays
        Where the payload begins, and how much of it was sent: MAVLink 2 leaves zeros out.
    wrong_crc, strange_bytes : int
        Frames whose checksum is wrong, and bytes that belong to no frame.
    rest : int
        Offset from which the next portion has to begin.
    """

    starts: IntArray
    kinds: IntArray
    senders: IntArray
    numbers: Bytes
    body_at: IntArray
    body_bytes: IntArray
    wrong_crc: int
    strange_bytes: int
    rest: int


def frames_of(data: bytes, extras: Mapping[int, int]) -> Frames:
    """Return the frames of a portion.

    Parameters
    ----------
    data : bytes
        Begins with a frame, or with damage.
    extras : mapping of int to int
        What the checksum of each wanted kind counts besides; frames of others are not proven.
    """
    view = np.frombuffer(data, dtype=np.uint8)
    walked, rest = _walk(data)
    starts = np.array(walked, dtype=np.int64)
    right = _right(view, starts, extras)
    wrong = 0
    if not right.all():
        kept, wrong, end = _around_wrong(data, view, walked, right, extras)
        starts, rest = np.array(kept, dtype=np.int64), end or rest
    second, kinds, senders, numbers, lengths = _heads(view, starts)
    own_bytes = sum(STAMP_BYTES + _frame_bytes(data, at) for at in starts.tolist())
    return Frames(
        starts, kinds, senders, numbers,
        body_at=starts + STAMP_BYTES + np.where(second, V2_HEAD_BYTES, V1_HEAD_BYTES),
        body_bytes=lengths, wrong_crc=wrong, strange_bytes=rest - own_bytes - wrong, rest=rest,
    )  # fmt: skip


def _frame_bytes(data: bytes, at: int) -> int:
    """Return how long the frame behind the time at an offset says it is; 0 where none begins."""
    first = at + STAMP_BYTES
    if data[first] == V2:
        signed = SIGNATURE_BYTES if data[first + 2] & SIGNED else 0
        return data[first + 1] + V2_HEAD_BYTES + CRC_BYTES + signed
    return data[first + 1] + V1_HEAD_BYTES + CRC_BYTES if data[first] == V1 else 0


def _walk(data: bytes) -> tuple[list[int], int]:
    """Return where frames begin, one behind the other, and where the first cut one does."""
    found, at, size = [], 0, len(data)
    while at + SHORTEST_BYTES <= size:
        length = _frame_bytes(data, at)
        if not length:
            at += 1
            continue
        if at + STAMP_BYTES + length > size:
            break
        found.append(at)
        at += STAMP_BYTES + length
    return found, at


def _around_wrong(
    data: bytes, view: Bytes, walked: list[int], right: BoolArray, extras: Mapping[int, int]
) -> tuple[list[int], int, int]:
    """Return the proven frames, how many were wrong, and where a search ended that met none.

    The last is 0 if every search met a frame that was found before, as it nearly always does.
    """
    known = {at: k for k, at in enumerate(walked)}
    kept: list[int] = []
    wrong, k = 0, 0
    for turn in np.flatnonzero(~right).tolist():
        if turn < k:
            continue
        kept += walked[k:turn]
        wrong += 1
        at = walked[turn] + 1
        while at not in known:
            length = _frame_bytes(data, at) if at + SHORTEST_BYTES <= len(data) else SHORTEST_BYTES
            if at + STAMP_BYTES + length > len(data):
                return kept, wrong, at
            end = at + STAMP_BYTES + length
            wanted = length and int(_heads(view, np.array([at]))[1][0]) in extras
            # A frame of a kind that is not read has no proof; it counts where the next frame
            # follows it.
            behind = walked[bisect(walked, at)] if at < walked[-1] else len(data)
            if length and (_right(view, np.array([at]), extras)[0] if wanted else end == behind):
                kept.append(at)
                at = end
                continue
            wrong += bool(wanted)
            at += 1
        k = known[at]
    return kept + walked[k:], wrong, 0


def _heads(view: Bytes, starts: IntArray) -> tuple[BoolArray, IntArray, IntArray, Bytes, IntArray]:
    """Return of each frame: is it MAVLink 2, kind, sender, number, bytes of payload."""
    first = starts + STAMP_BYTES
    second = view[first] == V2

    def at(in_2: int, in_1: int) -> IntArray:
        return view[first + np.where(second, in_2, in_1)].astype(np.int64)

    kinds = at(7, 5)
    kinds[second] |= view[first[second] + 8].astype(np.int64) << 8
    kinds[second] |= view[first[second] + 9].astype(np.int64) << 16
    senders = at(5, 3) << 8 | at(6, 4)
    return second, kinds, senders, at(4, 2).astype(np.uint8), view[first + 1].astype(np.int64)


def _right(view: Bytes, starts: IntArray, extras: Mapping[int, int]) -> BoolArray:
    """Return which frames are proven by their checksum, or are of no wanted kind."""
    right = np.ones(len(starts), dtype=bool)
    for rows, ends, crc in _checksums(view, starts, extras):
        right[rows] = crc == (view[ends].astype(np.uint16) | view[ends + 1].astype(np.uint16) << 8)
    return right


def sign(data: Bytes, found: Frames, extras: Mapping[int, int]) -> None:
    """Write the right checksum into frames of wanted kinds that were changed in place."""
    for _, ends, crc in _checksums(data, found.starts, extras):
        data[ends], data[ends + 1] = crc & 0xFF, crc >> 8


def _checksums(
    view: Bytes, starts: IntArray, extras: Mapping[int, int]
) -> Iterator[tuple[IntArray, IntArray, NDArray[np.uint16]]]:
    """Yield of frames of one length: which, where their checksum stands, what it has to be."""
    second, kinds, _, _, lengths = _heads(view, starts)
    wanted = np.isin(kinds, list(extras))
    counted = lengths + np.where(second, V2_HEAD_BYTES, V1_HEAD_BYTES) - 1  # without the marker
    for size in np.unique(counted[wanted]).tolist():
        rows = np.flatnonzero(wanted & (counted == size))
        body = starts[rows] + STAMP_BYTES + 1
        crc = np.full(len(rows), 0xFFFF, dtype=np.uint16)
        for k in range(size):
            crc = crc >> 8 ^ _TABLE[(crc ^ view[body + k]) & 0xFF]
        extra = np.array([extras[kind] for kind in kinds[rows].tolist()], dtype=np.uint16)
        yield rows, body + size, crc >> 8 ^ _TABLE[(crc ^ extra) & 0xFF]
