"""Find blocks with a valid CRC-32 at any byte of a stretch, in one pass.

A CRC is linear: what a byte adds to it depends on the byte and on its distance to the end. Summed
(xor) from the left in chunks of 512 bytes, two sums give any window. A forged megabyte with 150 000
beginnings of blocks costs 20 ms so, and 100 ms with a CRC of its own for each.
"""

from __future__ import annotations

import zlib
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from host.wire.extents import BLOCK_BYTES

RESIDUE = 0x2144DF1C  # CRC-32 of any bytes followed by their own CRC-32
_ONES = 0xFFFFFFFF
_Words = NDArray[np.uint32]


def sealed(buffer: memoryview | bytes, starts: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Return at which of `starts` 512 bytes begin that end in their own CRC-32.

    Parameters
    ----------
    buffer : bytes
    starts : NDArray[np.int64], shape (n,)
        Each at least 512 bytes before the end of `buffer`.

    Returns
    -------
    NDArray[np.bool_], shape (n,)
    """
    adds, carry, wanted = _tables()
    chunks = len(buffer) // BLOCK_BYTES + 2
    padded = np.zeros(chunks * BLOCK_BYTES, np.uint8)
    padded[: len(buffer)] = np.frombuffer(buffer, np.uint8)
    columns = np.ascontiguousarray(padded.reshape(chunks, BLOCK_BYTES).T)
    sums = np.zeros((BLOCK_BYTES + 1, chunks), np.uint32)
    for place in range(BLOCK_BYTES):  # the table of one place stays in the cache
        np.bitwise_xor(sums[place], adds[place].take(columns[place]), out=sums[place + 1])
    chunk, offset = np.divmod(starts, BLOCK_BYTES)
    head = sums[BLOCK_BYTES, chunk] ^ sums[offset, chunk]
    return np.asarray(
        _advance_register(head, carry) ^ sums[offset, chunk + 1] == wanted[offset], np.bool_
    )


@lru_cache(maxsize=1)
def _tables() -> tuple[_Words, _Words, _Words]:
    """Return what a byte adds by place in a chunk, the carry over a chunk, the sums wanted."""
    step = np.array([zlib.crc32(bytes([byte]), _ONES) ^ _ONES for byte in range(256)], np.uint32)
    adds = np.empty((BLOCK_BYTES, 256), np.uint32)
    adds[-1] = step
    for place in range(BLOCK_BYTES - 1, 0, -1):
        adds[place - 1] = _one_zero(adds[place], step)
    # A register's bits behind a further chunk of zeros, by its four bytes.
    single = np.arange(256, dtype=np.uint32)
    carry = np.stack([single << np.uint32(8 * byte) for byte in range(4)])
    register = np.array([_ONES], np.uint32)
    for _ in range(BLOCK_BYTES):
        carry, register = _one_zero(carry, step), _one_zero(register, step)
    wanted = np.empty(BLOCK_BYTES, np.uint32)
    sought = register ^ np.uint32(RESIDUE ^ _ONES)
    for offset in range(BLOCK_BYTES - 1, -1, -1):
        sought = _one_zero(sought, step)
        wanted[offset] = sought[0]
    return adds, carry, wanted


def _one_zero(register: _Words, step: _Words) -> _Words:
    """Return CRC registers behind one more byte of zero."""
    return np.asarray(step[register & np.uint32(0xFF)] ^ (register >> np.uint32(8)), np.uint32)


def _advance_register(register: _Words, carry: _Words) -> _Words:
    """Return CRC registers behind one more chunk of zeros."""
    by_byte = np.ascontiguousarray(register, "<u4").view(np.uint8).reshape(-1, 4)
    out = carry[0].take(by_byte[:, 0])
    for byte in (1, 2, 3):
        out ^= carry[byte].take(by_byte[:, byte])
    return np.asarray(out, np.uint32)
