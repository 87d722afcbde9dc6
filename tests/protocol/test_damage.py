"""Whatever happens to a log: never a wrong row, never a traceback, every intact block's frames."""

import os
from pathlib import Path

import numpy as np
import pytest
from host.errors import NotALogError
from host.log import read_log
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.protocol.agreement import check_oracle, check_rows, decoded
from tests.protocol.damage import DAMAGES
from tests.protocol.flights import simple_log
from tests.protocol.log_writer import BLOCK, LogWriter
from tests.protocol.random_logs import random_log

SEEDS = st.integers(0, 2**32 - 1)
FLIGHT = simple_log(2.0)
OTHER_FILES = {
    "empty": b"",
    "one byte": b"F",
    "text": b"t_s,alpha_rad\n0.00,0.05\n" * 300,
    "zeros": bytes(100_000),
    "ones": b"\xff" * 100_000,
    "magic only": b"FLT1" * 5_000,
    "random": np.random.default_rng(5).bytes(100_000),
    "ULog": b"ULog\x01\x12\x35\x01" + bytes(2000),
    "DataFlash": b"\xa3\x95\x80\x80\x59FMT\0BBnNZ" * 100,
    "schema text": (Path(__file__).parents[2] / "protocol/generated/schema.json").read_bytes(),
}


@settings(max_examples=150)
@given(seed=SEEDS, names=st.lists(st.sampled_from(sorted(DAMAGES)), min_size=1, max_size=4))
def test_rows_of_every_intact_block_and_no_other(seed: int, names: list[str]) -> None:
    rng = np.random.default_rng(seed)
    writer = FLIGHT if seed % 2 else random_log(rng)
    damaged = writer.data()
    for name in names:
        if damaged:
            damaged = DAMAGES[name](damaged, rng)
    check_rows(writer, damaged)


@pytest.mark.parametrize("size", [0, 1, 511, 512, 513, 7 * 512, 15 * 512 + 100, 40 * 512 - 1])
def test_log_cut_at_any_byte(size: int) -> None:
    check_rows(FLIGHT, FLIGHT.data()[:size])


def test_log_cut_at_every_eighth_byte_of_a_block() -> None:
    data = FLIGHT.data()
    for size in range(20 * BLOCK, 21 * BLOCK + 1, 8):
        check_rows(FLIGHT, data[:size])


@settings(max_examples=60)
@given(seed=SEEDS, names=st.lists(st.sampled_from(sorted(DAMAGES)), max_size=3))
def test_agrees_with_the_independent_decoder(seed: int, names: list[str]) -> None:
    rng = np.random.default_rng(seed)
    data = random_log(rng).data()
    for name in names:
        if data:
            data = DAMAGES[name](data, rng)
    check_oracle(data)


def test_two_logs_glued_together() -> None:
    first, second = simple_log(1.0, seed=3), LogWriter(session=2, first_block_before=b"x" * BLOCK)
    second.begin()
    second.put("event", t_us=1, code=24)
    second.end(t_us=2)
    for glued in (first.data() + second.data(), first.data()[:-700] + second.data()):
        check_oracle(glued)
        check_rows(first, glued)
    check_rows(second, second.data() + first.data())
    with decoded(first.data() + second.data()) as log:
        assert log is not None
        assert [other.file_id for other in log.selection.foreign] == [second.file_id]


@pytest.mark.parametrize("what", OTHER_FILES)
def test_other_files_are_no_logs(tmp_path: Path, what: str) -> None:
    path = tmp_path / "other.bin"
    path.write_bytes(OTHER_FILES[what])
    with pytest.raises(NotALogError) as caught:
        read_log(path)
    assert "\n" not in str(caught.value)
    assert str(path) in str(caught.value)


def test_sparse_file_of_ten_gigabytes(tmp_path: Path) -> None:
    path = tmp_path / "sparse.bin"
    path.write_bytes(FLIGHT.data())
    os.truncate(path, 10 * 1024**3)
    log = read_log(path)
    assert log.frames["ident"].tobytes() == FLIGHT.truth("ident")[0].tobytes()
    assert log.complete == "complete"
    empty = tmp_path / "empty.bin"
    empty.touch()
    os.truncate(empty, 10 * 1024**3)
    with pytest.raises(NotALogError):
        read_log(empty)


def test_lost_stretch_is_named_with_bytes_seconds_and_frames() -> None:
    data = bytearray(FLIGHT.data())
    rows, blocks = FLIGHT.truth("ident")
    first, count = 30, 4
    data[first * BLOCK : (first + count) * BLOCK] = bytes(count * BLOCK)
    with decoded(bytes(data)) as log:
        assert log is not None
        (loss,) = log.loss.losses
        gone = (blocks >= first) & (blocks < first + count)
        assert (loss.cause, loss.offset) == ("zeroed", first * BLOCK)
        assert (loss.length, loss.blocks) == (count * BLOCK, count)
        assert loss.frames == int(gone.sum())
        t_us = rows["t_us"].astype(np.int64)
        before, behind = t_us[blocks < first][-1], t_us[blocks >= first + count][0]
        assert loss.seconds == pytest.approx((behind - before) * 1e-6 - 0.01, abs=2e-5)
        assert log.complete == "damaged"


def test_frames_dropped_in_flight_are_named() -> None:
    writer = LogWriter()
    writer.begin()
    for count, t_us in ((0, 0), (1, 10_000), (7, 70_000), (8, 80_000)):
        if count == 7:
            writer.flush()
            writer.drop(5, t_us=20_000)
        writer.put("ident", t_us=t_us, count=count)
    writer.end(t_us=90_000)
    with decoded(writer.data()) as log:
        assert log is not None
        (loss,) = log.loss.losses
        assert (loss.cause, loss.frames) == ("ring_full", 5)
        assert log.loss.dropped_frames == 5
        assert log.complete == "complete"
