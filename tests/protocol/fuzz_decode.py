"""Fuzz target: random logs, random damage, the host decoder against truth and oracle.

    python -m tests.protocol.fuzz_decode --seconds 60 --seed 1

Prints the seed of each failure; `--seed N --count 1` repeats it. Exit code 1 if there was one.
"""

import argparse
import struct
import sys
import time
import traceback
import zlib

import numpy as np

from tests.protocol.agreement import check_oracle, check_rows
from tests.protocol.damage import DAMAGES
from tests.protocol.flights import simple_log
from tests.protocol.log_writer import BLOCK
from tests.protocol.random_logs import random_log


def one(seed: int) -> None:
    """Make the log of a seed, damage it, decode it; raises if the host decoder is wrong."""
    rng = np.random.default_rng(seed)
    writer = random_log(rng) if seed % 3 else simple_log(float(rng.uniform(0.05, 4)), seed=seed)
    damaged = writer.data()
    for name in rng.choice(sorted(DAMAGES), int(rng.integers(0, 6))):
        if damaged:
            damaged = DAMAGES[str(name)](damaged, rng)
    if seed % 7 == 0:  # forged headers: whatever stands in them, their CRC is right
        damaged = _forge(damaged, rng)
        check_oracle(damaged)
        return
    check_rows(writer, damaged)
    check_oracle(damaged)


def main(arguments: list[str] | None = None) -> int:
    """Run the command line; return the exit code."""
    parser = argparse.ArgumentParser(prog="fuzz_decode", description=__doc__)
    parser.add_argument("--seed", type=int, default=0, help="first seed")
    parser.add_argument("--count", type=int, help="how many seeds; without it, until time is up")
    parser.add_argument("--seconds", type=float, default=30.0)
    options = parser.parse_args(arguments)
    began = time.monotonic()
    failures = 0
    seed = options.seed
    while True:
        if options.count is not None and seed - options.seed >= options.count:
            break
        if options.count is None and time.monotonic() - began >= options.seconds:
            break
        try:
            one(seed)
        except Exception:
            failures += 1
            print(f"seed {seed}:")
            traceback.print_exc(file=sys.stdout)
        seed += 1
    print(f"{seed - options.seed} logs from seed {options.seed} on, {failures} failures")
    return 1 if failures else 0


def _forge(data: bytes, rng: np.random.Generator) -> bytes:
    """Change header or payload of some blocks and seal them with a right CRC."""

    forged = bytearray(data)
    for at in rng.integers(0, max(1, len(data) // BLOCK), int(rng.integers(1, 6))).tolist():
        start = at * BLOCK
        if start + BLOCK > len(forged):
            continue
        field, size = [(8, 4), (12, 2), (20, 4), (24, 2), (26, 1), (28, 40)][rng.integers(0, 6)]
        content = rng.bytes(size)
        if field == 24:  # `used`: beyond 480 the block would not count
            content = struct.pack("<H", rng.integers(0, 482))
        forged[start + field : start + field + size] = content
        body = bytes(forged[start : start + BLOCK - 4])
        forged[start + BLOCK - 4 : start + BLOCK] = struct.pack("<I", zlib.crc32(body))
    return bytes(forged)


if __name__ == "__main__":
    sys.exit(main())
