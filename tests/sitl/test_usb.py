"""USB while nothing is recorded: the channels in envelopes between whole status lines."""

from __future__ import annotations

import binascii
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from zlib import crc32

import numpy as np
import pytest
from host.link.status_line import parse_status
from host.log import read_log
from host.twin.recorder.sitl_library import TICKS_PER_S, Port, Recorder
from host.wire.schema_text import packed_schema

from tests.sitl.bench import Bench, flight
from tests.sitl.compare import compare

IDENT = packed_schema().by_name["ident"]
LOOK_S = 0.1


def ticks(seconds: float) -> int:
    return round(seconds * TICKS_PER_S)


def pieces(stream: bytes) -> Iterator[bytes | str]:
    """Yield frames and lines in their order; AssertionError where one is torn."""
    at = 0
    while at < len(stream):
        if stream[at] == 0xA5:
            end = at + 3 + stream[at + 2] + 2
            assert stream[at + 1] == 0x5A
            crc = binascii.crc_hqx(stream[at + 2 : end - 2], 0xFFFF).to_bytes(2, "little")
            assert stream[end - 2 : end] == crc, f"torn at {at}"
            yield stream[at + 3 : end - 2]
        else:
            end = stream.index(b"\r\n", at) + 2
            line = stream[at : end - 2].decode("ascii")
            assert line.isprintable(), f"torn at {at}: {line!r}"
            yield line
        at = end


def ident_times_us(stream: bytes) -> list[int]:
    found = [one for one in pieces(stream) if isinstance(one, bytes) and one[0] == IDENT.id]
    return [int.from_bytes(one[1:5], "little") for one in found]


@pytest.mark.parametrize("rate_hz", [100, 200])
def test_whole_envelopes_between_whole_lines_and_none_while_recording(
    tmp_path: Path, rate_hz: int
) -> None:
    bench = Bench()
    plan = flight(34.0)
    plan.give(bench.sitl)
    bench.configure(rate_hz=rate_hz, auto_start=0)
    bench.sitl.press(ticks(5.0), 0.2)
    bench.sitl.press(ticks(10.0), 2.5)
    bench.sitl.power_on()
    sent: list[tuple[Recorder, bytes]] = []
    while bench.sitl.now() < ticks(18.0):
        bench.sitl.run_for(LOOK_S)
        sent.append((bench.state(), bench.sitl.sent(Port.USB)))
    stream = sent[-1][1]

    # A line or envelope that was under way when the session began is ended: 30 ms.
    recording = [
        after[1][len(before[1]) :]
        for before, after in pairwise(sent)
        if before[0] == after[0] == Recorder.RECORDING
    ]
    assert len(recording) > 40
    assert max(map(len, recording[1:])) == 0

    found = list(pieces(stream))
    lines = [one for one in found if isinstance(one, str)]
    assert all(parse_status(line) for line in lines[1:])  # the first is the boot line
    hashes = [one for one in found if isinstance(one, bytes) and one[0] == 0]
    assert {one[1:] for one in hashes} == {crc32(packed_schema().text).to_bytes(4, "little")}

    t_us = ident_times_us(stream)
    step_us = np.diff(t_us)
    assert np.count_nonzero(step_us > 1_000_000) == 1  # the session
    # At 200 Hz the radio's turn and this one fall together at times: the next frame is taken.
    late = np.abs(step_us - 50_000) > 100
    assert np.count_nonzero(late) <= (1 if rate_hz == 100 else len(step_us) // 8)
    assert np.all(step_us[step_us < 1_000_000] <= 55_100)
    assert len(t_us) > 200
    assert len(lines) > len(t_us) / 22

    # What was heard is a capture like any other, and holds what the sensors were given.
    capture = tmp_path / "usb.radio"
    capture.write_bytes(stream)
    log = read_log(capture)
    assert [loss.cause for loss in log.loss.losses] == ["radio_lost"]  # the session's time
    frames = {name: np.empty(0, packed_schema().by_name[name].dtype)
              for name in ("mag", "attitude", "baro", "gps")}  # fmt: skip
    told = [d for d in compare({"ident": log.frames["ident"], **frames}, plan) if d.samples]
    assert len(told) > 20
    assert [d for d in told if not d.good] == []


def test_a_card_that_is_searched_delays_no_envelope() -> None:
    """The main loop does not sleep then."""
    bench = Bench(bytearray(64 << 20))  # no file system on it
    flight(34.0).give(bench.sitl)
    bench.sitl.power_on()
    bench.sitl.run_for(8.0)
    step_us = np.diff(ident_times_us(bench.sitl.sent(Port.USB)))
    assert len(step_us) > 150
    assert step_us.max() <= 60_000
