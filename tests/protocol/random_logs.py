"""Logs of random content and history: every kind of frame, drops, resets, stale tails."""

import numpy as np

from tests.protocol.flights import simple_log
from tests.protocol.log_writer import BLOCK, CARD_ID, LogWriter, Timed


def random_log(rng: np.random.Generator) -> LogWriter:
    """Return the writer of a log of some 20 to 200 blocks with a random history."""
    writer = LogWriter(
        session=int(rng.integers(1, 2**31)),
        first_block_before=rng.bytes(BLOCK),
        card_id=bytes(rng.permutation(list(CARD_ID)).tolist()),
        preallocated=BLOCK * int(rng.integers(60, 300)),
    )
    rate_hz = int(rng.choice([50, 100, 200]))
    now_us = int(rng.integers(0, 2**33))  # beyond the wrap of t_us at times
    writer.begin(rate_hz=rate_hz, t_us=now_us & 0xFFFFFFFF)
    for _ in range(int(rng.integers(1, 8))):
        now_us += int(rng.integers(1_000, 2_000_000))
        _something(writer, rng, now_us, rate_hz)
    if rng.random() < 0.6:
        writer.end(t_us=now_us & 0xFFFFFFFF)
    if rng.random() < 0.5:
        tail = _tail(writer, rng)
        room = writer.preallocated - writer.sequence * BLOCK
        if room > 0 and rng.random() < 0.6:  # never closed: the file has its full size
            tail = tail[:room] + bytes(room - len(tail[:room]))
        writer.tail(tail)
    return writer


def random_rows(writer: LogWriter, name: str, count: int, rng: np.random.Generator) -> Timed:
    """Return rows of random bytes of one frame, at random places among others."""
    layout = writer.layouts[name]
    made = np.frombuffer(rng.bytes(layout.itemsize * count), layout).copy()
    made["id"] = writer.ids[name]
    return Timed(made, rng.integers(0, 1000, count))


def _something(writer: LogWriter, rng: np.random.Generator, now_us: int, rate_hz: int) -> None:
    choice = rng.random()
    if choice < 0.6:
        streams = []
        for name in writer.layouts:
            if name in ("config", "identity", "file"):  # they head sessions only
                continue
            stream = random_rows(writer, name, int(rng.integers(0, 40)), rng)
            stream.rows["t_us"] = (now_us + stream.finished_us) & 0xFFFFFFFF
            if name == "event":
                stream.rows["code"] = rng.integers(3, 27, len(stream.rows))
            streams.append(stream)
        writer.extend(streams)
    elif choice < 0.7:
        writer.drop(int(rng.integers(1, 500)), t_us=now_us)
    elif choice < 0.8:
        writer.flush()
        writer.skip(int(rng.integers(1, 4)), content=None)
    elif choice < 0.9:
        writer.schema()
        writer.head(rate_hz=rate_hz, t_us=now_us & 0xFFFFFFFF)
    else:
        writer.resume(rate_hz=rate_hz, t_us=int(rng.integers(0, 2**20)))


def _tail(writer: LogWriter, rng: np.random.Generator) -> bytes:
    """Return what the card held before behind the end: zeros, anything, or an older flight."""
    writer.flush()
    kind = rng.integers(0, 3)
    if kind == 0:
        return bytes(BLOCK * int(rng.integers(1, 20)))
    if kind == 1:
        return rng.bytes(BLOCK * int(rng.integers(1, 20)))
    older = simple_log(1.0, seed=int(rng.integers(1, 100)))
    return older.data()[writer.sequence * BLOCK :] or bytes(BLOCK)
