"""Each lost range is blamed on what was done to it."""

import os
import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from host.log import read_log

from tests.protocol.agreement import check_oracle, decoded
from tests.protocol.flights import simple_log
from tests.protocol.log_writer import BLOCK, ROOT, LogWriter, block

FLIGHT = simple_log(2.0)
DATA = FLIGHT.data()
FIRST, COUNT = 25, 3
START, STOP = FIRST * BLOCK, (FIRST + COUNT) * BLOCK
OLDER = simple_log(4.0, seed=9, start_us=70_000_000, session=2)


def flipped(data: bytes) -> bytes:
    damaged = bytearray(data)
    for at in range(START, STOP, BLOCK):
        damaged[at + 200] ^= 0x10
    return bytes(damaged)


def older_data() -> bytes:
    other = LogWriter(session=3, first_block_before=b"o" * BLOCK)
    other.begin()
    while other.sequence < FIRST + COUNT + 1:
        other.schema()
    return other.data()


# What is done to blocks 25 to 27, the cause that must be named, and its bytes in the file.
DONE: dict[str, tuple[Callable[[bytes], bytes], str, int]] = {
    "zeroed": (lambda d: d[:START] + bytes(STOP - START) + d[STOP:], "zeroed", STOP - START),
    "random": (
        lambda d: d[:START] + np.random.default_rng(1).bytes(STOP - START) + d[STOP:],
        "overwritten",
        STOP - START,
    ),
    "bit in each": (flipped, "crc", STOP - START),
    "cut out": (lambda d: d[:START] + d[STOP:], "missing", 0),
    "older blocks": (
        lambda d: d[:START] + older_data()[START:STOP] + d[STOP:],
        "not_written",
        STOP - START,
    ),
}


@pytest.mark.parametrize("what", DONE)
def test_cause(what: str) -> None:
    spoil, cause, length = DONE[what]
    damaged = spoil(DATA)
    with decoded(damaged) as log:
        assert log is not None
        (loss,) = log.loss.losses
        assert (loss.cause, loss.offset, loss.length) == (cause, START, length)
        assert loss.blocks == COUNT
        assert log.complete == "damaged"
    check_oracle(damaged)


def test_block_the_card_refused() -> None:
    writer = LogWriter()
    writer.begin()
    writer.put("ident", t_us=0, count=0)
    writer.flush()
    refused = writer.sequence
    writer.skip(1)
    writer.put("event", t_us=9_000, code=4, arg=refused)
    writer.put("ident", t_us=70_000, count=7)
    writer.end(t_us=80_000)
    with decoded(writer.data()) as log:
        assert log is not None
        (loss,) = log.loss.losses
        assert (loss.cause, loss.offset, loss.frames) == ("card_refused", refused * BLOCK, 6)


def test_frames_of_unknown_kind_are_counted() -> None:
    writer = LogWriter()
    writer.begin()
    data = bytearray(writer.data())
    payload = b"\xc8" + struct.pack("<I", 7)
    data += block(
        payload,
        file_id=writer.file_id,
        session=1,
        sequence=writer.sequence,
        schema_hash=writer.schema_hash,
    )
    with decoded(bytes(data)) as log:
        assert log is not None
        assert [(loss.cause, loss.length) for loss in log.loss.losses][:1] == [("unread", 5)]
        assert log.complete == "damaged"
    check_oracle(bytes(data))


def test_battery_pulled() -> None:
    # The block being written is torn; behind it the preallocated file goes on with older blocks.
    cut = FLIGHT.data()[: 30 * BLOCK]
    torn = DATA[30 * BLOCK : 30 * BLOCK + 100] + bytes(BLOCK - 100)
    older = OLDER.data()
    for behind in (bytes(20 * BLOCK), older[31 * BLOCK :]):
        with decoded(cut + torn + behind) as log:
            assert log is not None
            (loss,) = log.loss.losses
            assert (loss.cause, loss.offset, loss.blocks) == ("crc", 30 * BLOCK, 1)
            assert log.complete == "damaged"
        check_oracle(cut + torn + behind)


FULL = 60 * BLOCK
BEHIND = {"zeros": bytes(30 * BLOCK), "older flight": OLDER.data()[30 * BLOCK : 60 * BLOCK],
          "random": np.random.default_rng(3).bytes(30 * BLOCK)}  # fmt: skip


@pytest.mark.parametrize("what", BEHIND)
def test_end_of_a_file_never_closed_is_not_proven(what: str) -> None:
    data = simple_log(2.0, preallocated=FULL).data()[: 30 * BLOCK] + BEHIND[what]
    with decoded(data) as log:
        assert log is not None
        assert (log.complete, log.loss.losses) == ("truncated", ())
        assert log.loss.unproven_bytes == 30 * BLOCK
        assert log.loss.ending == (
            f"complete as far as blocks reach, {30 * BLOCK} bytes behind the last block are not of"
            " this flight"
        )
    check_oracle(data)


def test_closed_file_is_complete() -> None:
    with decoded(simple_log(2.0, preallocated=FULL).data()) as log:
        assert log is not None
        assert (log.complete, log.loss.losses, log.loss.ending) == ("complete", (), None)


@pytest.mark.parametrize("what", BEHIND)
def test_second_half_of_a_closed_file_replaced(what: str) -> None:
    damaged = DATA[: 30 * BLOCK] + BEHIND[what][: len(DATA) - 30 * BLOCK]
    with decoded(damaged) as log:
        assert log is not None
        (loss,) = log.loss.losses
        assert loss.offset == 30 * BLOCK
        assert (loss.cause, log.complete) == (
            {"zeros": "zeroed", "older flight": "truncated", "random": "overwritten"}[what],
            "damaged",
        )
    check_oracle(damaged)


def test_only_the_first_block_left() -> None:
    with decoded(DATA[:BLOCK]) as log:
        assert log is not None
        assert log.complete == "damaged"
        assert [loss.cause for loss in log.loss.losses] == ["truncated"]


def test_older_log_is_taken_for_64_mib(tmp_path: Path) -> None:
    released = (ROOT / "tests/data/format-1-sitl.bin").read_bytes()
    cut = released[: len(released) // 2 // BLOCK * BLOCK]
    path = tmp_path / "flight.bin"
    for size, said in ((64 << 20, "truncated"), ((64 << 20) + BLOCK, "damaged")):
        path.write_bytes(cut)
        os.truncate(path, size)
        assert read_log(path).complete == said


@pytest.mark.parametrize("keep", [30 * BLOCK, 30 * BLOCK + 1, 31 * BLOCK - 1])
def test_cut_file_is_damaged(keep: int) -> None:
    with decoded(DATA[:keep]) as log:
        assert log is not None
        (loss,) = log.loss.losses
        assert (loss.cause, loss.offset, loss.length) == ("truncated", 30 * BLOCK, keep % BLOCK)
        assert log.complete == "damaged"
    check_oracle(DATA[:keep])


def test_file_id_depends_on_the_valid_block_that_stood_there() -> None:
    # Over all 512 bytes it would not: behind its own CRC a block leaves no trace in a CRC.
    ids = []
    before = bytes(BLOCK)
    for _ in range(4):
        writer = LogWriter(session=1, first_block_before=before, card_block=8192)
        writer.schema()
        before = writer.data()[:BLOCK]
        ids.append(writer.file_id)
    assert len(set(ids)) == 4
