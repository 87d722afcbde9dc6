"""What can happen to a log between the card and the decoder, and what must still be found.

A damage is a function of the bytes and of a seeded generator, so that a seed names it for ever.
"""

from collections.abc import Callable, Mapping

import numpy as np

from tests.protocol.log_writer import BLOCK, LogWriter, Rows

Damage = Callable[[bytes, np.random.Generator], bytes]


def truncate(data: bytes, rng: np.random.Generator) -> bytes:
    """Cut at any byte."""
    return data[: int(rng.integers(0, len(data) + 1))]


def flip_bits(data: bytes, rng: np.random.Generator) -> bytes:
    """Flip 1 to 20 bits anywhere."""
    damaged = bytearray(data)
    for at in rng.integers(0, 8 * len(data), int(rng.integers(1, 21))):
        damaged[at // 8] ^= 1 << at % 8
    return bytes(damaged)


def zero_sectors(data: bytes, rng: np.random.Generator) -> bytes:
    """Zero a run of sectors, at times by half a sector too much."""
    start, end = _run(data, rng)
    end = min(len(data), end + int(rng.integers(0, 2)) * BLOCK // 2)
    return data[:start] + bytes(end - start) + data[end:]


def randomise_sectors(data: bytes, rng: np.random.Generator) -> bytes:
    """Overwrite a run of sectors with random bytes."""
    start, end = _run(data, rng)
    return data[:start] + rng.bytes(end - start) + data[end:]


def duplicate_sectors(data: bytes, rng: np.random.Generator) -> bytes:
    """Put a copy of a run of sectors somewhere between others."""
    start, end = _run(data, rng)
    at = int(rng.integers(0, len(data) // BLOCK + 1)) * BLOCK
    return data[:at] + data[start:end] + data[at:]


def overwrite_with_copy(data: bytes, rng: np.random.Generator) -> bytes:
    """Write a run of sectors a second time over others (a card that mixed up its addresses)."""
    start, end = _run(data, rng)
    at = int(rng.integers(0, max(1, (len(data) - (end - start)) // BLOCK + 1))) * BLOCK
    return data[:at] + data[start:end] + data[at + end - start :]


def reorder_sectors(data: bytes, rng: np.random.Generator) -> bytes:
    """Shuffle the sectors of a stretch."""
    start, end = _run(data, rng, longest=40)
    sectors = [data[at : at + BLOCK] for at in range(start, end, BLOCK)]
    order = rng.permutation(len(sectors))
    return data[:start] + b"".join(sectors[i] for i in order) + data[end:]


def remove_sectors(data: bytes, rng: np.random.Generator) -> bytes:
    """Take out a run of sectors: what follows moves up."""
    start, end = _run(data, rng)
    return data[:start] + data[end:]


def remove_bytes(data: bytes, rng: np.random.Generator) -> bytes:
    """Take out some bytes: what follows leaves the grid of 512."""
    at = int(rng.integers(0, len(data)))
    return data[:at] + data[at + int(rng.integers(1, 1500)) :]


def insert_bytes(data: bytes, rng: np.random.Generator) -> bytes:
    """Put in some bytes: what follows leaves the grid of 512."""
    at = int(rng.integers(0, len(data) + 1))
    return data[:at] + rng.bytes(int(rng.integers(1, 1500))) + data[at:]


DAMAGES: Mapping[str, Damage] = {
    "truncated": truncate,
    "bits flipped": flip_bits,
    "sectors zeroed": zero_sectors,
    "sectors random": randomise_sectors,
    "sectors duplicated": duplicate_sectors,
    "sectors overwritten": overwrite_with_copy,
    "sectors reordered": reorder_sectors,
    "sectors missing": remove_sectors,
    "bytes missing": remove_bytes,
    "bytes put in": insert_bytes,
}


def surviving(original: bytes, damaged: bytes) -> set[int]:
    """Return the sequences of the blocks of `original` that stand whole somewhere in `damaged`.

    `original` is a log whose block n stands at byte 512 n. Blocks differ from each other in their
    sequence at least, so that a block is found by its bytes.
    """
    return {
        at // BLOCK
        for at in range(0, len(original) - BLOCK + 1, BLOCK)
        if original[at : at + 4] == b"FLT1" and original[at : at + BLOCK] in damaged
    }


def expected(writer: LogWriter, alive: set[int]) -> dict[str, Rows]:
    """Return the rows that must be found when the blocks `alive` are left, and no others."""
    wanted = np.array(sorted(alive), np.int64)
    return {
        name: written[np.isin(blocks, wanted)]
        for name, (written, blocks) in writer.truths().items()
    }


def _run(data: bytes, rng: np.random.Generator, longest: int = 12) -> tuple[int, int]:
    sectors = max(1, len(data) // BLOCK)
    start = int(rng.integers(0, sectors))
    count = int(rng.integers(1, longest + 1))
    return start * BLOCK, min(len(data), (start + count) * BLOCK)
