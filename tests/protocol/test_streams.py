"""Telemetry streams of random content: host and independent decoder find the same frames."""

import numpy as np
from host.wire.framing import EnvelopeReader
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.protocol.damage import Damage, flip_bits, insert_bytes, remove_bytes, truncate
from tests.protocol.log_writer import envelope
from tests.protocol.oracle import decode_stream

DAMAGES = (flip_bits, insert_bytes, remove_bytes, truncate)


@settings(max_examples=150)
@given(seed=st.integers(0, 2**32 - 1), damages=st.lists(st.sampled_from(DAMAGES), max_size=3))
def test_damaged_stream_in_any_portions(seed: int, damages: list[Damage]) -> None:
    rng = np.random.default_rng(seed)
    stream = b"".join(
        envelope(_rich_in_syncs(rng, int(rng.integers(1, 129))))
        for _ in range(int(rng.integers(1, 40)))
    )
    for damage in damages:
        if stream:
            stream = damage(stream, rng)
    wanted = decode_stream(stream)
    reader = EnvelopeReader()
    found: list[bytes] = []
    at = 0
    while at < len(stream):
        portion = int(rng.integers(1, 200))
        found += reader.feed(stream[at : at + portion])
        at += portion
    assert found == wanted.frames
    assert (reader.failed, reader.skipped) == (wanted.failed, wanted.skipped)
    assert reader.pending == wanted.pending


def _rich_in_syncs(rng: np.random.Generator, length: int) -> bytes:
    """Return bytes in which every third is half a sync: false starts are the rule."""
    content = rng.integers(0, 256, length)
    content[rng.random(length) < 0.2] = 0xA5
    content[1:][(content[:-1] == 0xA5) & (rng.random(length - 1) < 0.7)] = 0x5A
    return bytes(content.astype(np.uint8).tolist())
