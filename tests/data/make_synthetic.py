"""Make format-1-synthetic.bin and its text: kept for the record, never run by a test.

A released log is never made anew. This program says how the first one came about:

    python tests/data/make_synthetic.py FOLDER
"""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "host/src"))
sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np

from tests.protocol.expected_text import text_of_oracle
from tests.protocol.flights import ident, simple_log, slow, wrapped_int
from tests.protocol.log_writer import BLOCK, LogWriter
from tests.protocol.oracle import decode

WRAP_US = 1 << 32


def flight() -> bytes:
    """Return a log with one of everything: wrap, drop, reset, refused and torn block, old data."""
    rng = np.random.default_rng(20261121)
    start_us = WRAP_US - 300_000  # t_us wraps after 0.3 s
    writer = LogWriter(session=41, first_block_before=b"\xa5" * BLOCK)
    writer.begin(t_us=wrapped_int(start_us - 1000))
    writer.extend([ident(start_us, 50, rng=rng), *slow(start_us, 0.5, rng=rng)])
    writer.flush()
    writer.drop(6, t_us=start_us + 500_000)
    writer.extend([ident(start_us + 560_000, 20, first_count=56, rng=rng)])
    writer.flush()
    refused = writer.sequence
    writer.skip(1, content=b"\xff" * BLOCK)
    writer.put("event", t_us=wrapped_int(start_us + 840_000), code=4, arg=refused)
    writer.extend([ident(start_us + 840_000, 20, first_count=84, rng=rng)])
    writer.resume(t_us=1_500_000)
    writer.put(
        "baro_coefficients", t_us=1_500_000, sensor=1, words=np.arange(12, dtype=np.uint16) * 1000
    )
    writer.extend([ident(2_000_000, 30, rng=rng), *slow(2_000_000, 1.0, rng=rng)])
    writer.flush()
    torn = simple_log(0.3, session=42).data()[-BLOCK:][:100].ljust(BLOCK, b"\0")
    older = simple_log(4.0, seed=7, session=12).data()
    end = writer.sequence * BLOCK
    writer.tail(torn + older[end + BLOCK : end + 9 * BLOCK])
    return writer.data()


def main() -> int:
    """Write the log and its text into the folder named."""
    folder = Path(sys.argv[1])
    data = flight()
    read = decode(data)
    assert read is not None
    order = list(LogWriter().layouts)
    (folder / "format-1-synthetic.bin").write_bytes(data)
    (folder / "format-1-synthetic.txt").write_text(text_of_oracle(read, order), encoding="ascii")
    return 0


if __name__ == "__main__":
    sys.exit(main())
