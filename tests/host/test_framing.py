"""protocol/cases.toml and random streams against the host's telemetry decoder."""

import tomllib
from typing import Any

import pytest
from host.wire.framing import EnvelopeReader, crc16, envelope, is_text_cut_short
from hypothesis import given
from hypothesis import strategies as st

from tests.host.logs import ROOT

TABLE = tomllib.loads((ROOT / "protocol/cases.toml").read_text())


def unhex(text: str) -> bytes:
    return bytes.fromhex("".join(text.split()))


@pytest.mark.parametrize("portion", [1, 7, 1000])
@pytest.mark.parametrize("case", TABLE["telemetry"], ids=lambda case: case["name"])
def test_case(case: dict[str, Any], portion: int) -> None:
    stream = unhex(case["bytes"])
    reader = EnvelopeReader()
    frames = []
    for at in range(0, len(stream), portion):
        frames += reader.feed(stream[at : at + portion])
    assert frames == [unhex(frame) for frame in case["frames"]]
    counts = (reader.failed, reader.skipped, reader.pending)
    assert counts == (case["failed"], case["skipped"], case["pending"])


def test_crc_of_the_catalogue() -> None:
    assert crc16(b"123456789") == 0x29B1


@given(st.lists(st.tuples(st.binary(max_size=20), st.binary(min_size=1, max_size=128))))
def test_every_frame_comes_back(parts: list[tuple[bytes, bytes]]) -> None:
    # Noise without a sync byte cannot swallow a frame.
    stream = b"".join(noise.replace(b"\xa5", b"") + envelope(frame) for noise, frame in parts)
    reader = EnvelopeReader()
    assert reader.feed(stream) == [frame for _, frame in parts]
    assert (reader.failed, reader.pending) == (0, 0)


@pytest.mark.parametrize("length", [0, 129])
def test_frames_that_do_not_fit_are_refused(length: int) -> None:
    with pytest.raises(ValueError, match=f"{length} bytes"):
        envelope(bytes(length))


def test_text_with_an_envelope_still_coming_is_no_damage() -> None:
    """A capture of USB ends wherever it was stopped: once in three inside an envelope."""
    line, sent = b"ready, 3.9 V\r\nnext li", envelope(bytes(range(20)))
    assert all(is_text_cut_short(line + sent[:size]) for size in range(1, len(sent)))
    assert not is_text_cut_short(line + b"\x07" + sent[:9])  # no text
    assert not is_text_cut_short(sent[:9])  # the radio's own end
    broken = bytearray(sent)
    broken[-1] ^= 1
    assert not is_text_cut_short(line + bytes(broken))  # whole, and wrong
