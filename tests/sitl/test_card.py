"""The card at its worst: busy, refusing, gone, full, cut off; and every loss accounted for."""

from pathlib import Path

import numpy as np
import pytest
from host.twin.recorder.sitl_library import TICKS_PER_S, CardFault, Level, Recorder, Sitl, Volume

from tests.campaign import every_nth
from tests.protocol import oracle
from tests.sitl.bench import (
    EVENTS,
    GROUND_S,
    Bench,
    causes,
    events,
    flight,
    idle_receiver,
    missing,
    spread,
)
from tests.sitl.card_image import BLOCK, format_fat32, new_card, read_file


def ticks(seconds: float) -> int:
    return round(seconds * TICKS_PER_S)


@pytest.mark.parametrize(("rate_hz", "stall_ms"), [(100, 500), (200, 250)])
def test_stall_within_the_ring_loses_nothing(tmp_path: Path, rate_hz: int, stall_ms: int) -> None:
    bench = Bench()
    bench.set_rate(rate_hz)
    flight(34.0).give(bench.sitl)
    bench.sitl.add_card_fault(0, CardFault.EVERY_BUSY, 5000)
    for at_s in np.arange(3.0, 15.0, 3.0) + spread(rate_hz, 1, 0.0, 1.0)[0]:
        bench.sitl.add_card_fault(ticks(at_s), CardFault.BUSY, stall_ms * 1000)
    bench.power_on_and_record(18.0)
    bench.sitl.run_until(ticks(20.0))
    bench.stop()
    log = bench.log(tmp_path)
    assert len(events(log, "card_stall")) == 4
    assert min(events(log, "card_stall")) >= stall_ms
    assert missing(log.frames["ident"]["count"]) == 0
    assert log.complete == "complete"
    assert len(log.frames["ident"]) > 21 * rate_hz


def test_session_that_ends_in_a_stall_tells_its_last_losses(tmp_path: Path) -> None:
    bench = Bench()
    flight(34.0).give(bench.sitl)
    # The ring is full for a second when the button ends the session.
    bench.sitl.add_card_fault(ticks(19.9), CardFault.BUSY, 1_900_000)
    bench.power_on_and_record(12.0)
    bench.sitl.run_until(ticks(19.3))
    bench.stop()
    log = bench.log(tmp_path)
    told = events(log, "frames_dropped")
    blocks = oracle.find_blocks(read_file(bytes(bench.image), "FLT00001.BIN"))
    assert sum(told) == blocks[-1].dropped > 50
    assert log.loss.dropped_frames == sum(told)
    assert causes(log, "session_end") == ["button"]
    assert int(log.frames["event"]["code"][-1]) == EVENTS["session_end"]
    assert log.complete == "complete"


def test_stall_beyond_the_ring_is_accounted_for_exactly(tmp_path: Path) -> None:
    bench = Bench()
    plan = flight(34.0)
    plan.give(bench.sitl)
    for at_s in (3.0, 6.0, 9.0):
        bench.sitl.add_card_fault(ticks(at_s), CardFault.BUSY, 1_500_000)
    bench.power_on_and_record(12.0)
    bench.sitl.run_until(ticks(20.0))
    bench.stop()
    log = bench.log(tmp_path)
    lost = missing(log.frames["ident"]["count"])
    told = events(log, "frames_dropped")
    assert lost > 100
    assert len(told) == 3
    # Other kinds of frames are dropped too: the events count all, header and system alike.
    blocks = [
        block
        for block in oracle.find_blocks(read_file(bytes(bench.image), "FLT00001.BIN"))
        if block.sequence > 0
    ]
    assert blocks[-1].dropped == sum(told)
    assert int(log.frames["system"]["frames_dropped"].max()) == sum(told)
    others = sum(told) - lost
    expected = {"mag": 15, "attitude": 10, "baro": 25, "gps": 5, "system": 1}
    seconds = (int(log.frames["ident"]["count"][-1]) - int(log.frames["ident"]["count"][0])) / 100
    short = sum(rate * seconds - len(log.frames[name]) for name, rate in expected.items())
    assert abs(others - short) <= 6
    assert log.loss.dropped_frames == sum(told)
    assert log.loss.frames == lost
    # What was in the ring when the card stalled is on it: the gaps are behind the full ring.
    first = np.flatnonzero(np.diff(log.frames["ident"]["count"]).astype(np.uint16) != 1)
    assert len(first) == 3


def test_refused_block_is_sent_again(tmp_path: Path) -> None:
    bench = Bench()
    flight(34.0).give(bench.sitl)
    for at_s in (3.0, 4.0, 5.0):
        bench.sitl.add_card_fault(ticks(at_s), CardFault.REJECT, 1)
    bench.power_on_and_record(8.0)
    bench.sitl.run_until(ticks(20.0))
    bench.stop()
    log = bench.log(tmp_path)
    assert missing(log.frames["ident"]["count"]) == 0
    assert log.complete == "complete"
    assert int(log.frames["system"]["card_errors"].max()) == 3


def test_block_refused_twice_is_skipped_and_named(tmp_path: Path) -> None:
    bench = Bench()
    flight(34.0).give(bench.sitl)
    bench.sitl.add_card_fault(ticks(3.0), CardFault.REJECT, 2)
    bench.power_on_and_record(8.0)
    bench.sitl.run_until(ticks(20.0))
    bench.stop()
    log = bench.log(tmp_path)
    (skipped,) = events(log, "block_skipped")
    found = oracle.decode(read_file(bytes(bench.image), "FLT00001.BIN"))
    assert found is not None
    assert found.missing == [(skipped, skipped)]
    assert missing(log.frames["ident"]["count"]) == 0  # its frames went into the next place


def test_card_removed_and_put_back(tmp_path: Path) -> None:
    bench = Bench()
    flight(40.0).give(bench.sitl)
    bench.sitl.add_card_fault(ticks(6.0), CardFault.REMOVE)
    bench.sitl.add_card_fault(ticks(9.0), CardFault.INSERT)
    bench.power_on_and_record(5.4)
    bench.sitl.run_until(ticks(7.0))
    assert bench.state() == Recorder.FAILED
    before, _, _ = bench.sitl.pulses()
    bench.sitl.run_until(ticks(8.0))
    after, _, _ = bench.sitl.pulses()
    assert len(after) - len(before) == 4 * 50  # the servos never notice
    bench.sitl.run_until(ticks(27.0))
    assert bench.state() == Recorder.RECORDING
    bench.stop()
    log = bench.log(tmp_path)
    assert [session.number for session in log.sessions] == [1, 2, 3]
    assert events(log, "card_removed") == [0]
    assert bench.fsck(tmp_path) == ""


def boot_with(image: bytearray | None, *, unreadable: bool = False) -> tuple[Volume, int]:
    """Boot with a card and return its state and the flashes of one group of the LED."""
    sitl = Sitl()
    sitl.set_file_blocks(4000)
    if image is not None:
        sitl.insert_card(image, b"\x01" * 16)
    if unreadable:
        sitl.add_card_fault(0, CardFault.UNREADABLE, 1)
    sitl.power_on()
    sitl.run_for(GROUND_S + 12.0)
    state = sitl.state()
    at, level = sitl.levels(Level.LED)
    rising = at[(level == 1) & (at > GROUND_S * TICKS_PER_S)]
    groups = np.split(rising, np.flatnonzero(np.diff(rising) > TICKS_PER_S) + 1)
    return Volume(state.volume), len(groups[1]) if len(groups) > 2 else 0


def full_card(*, fragmented: bool) -> bytearray:
    """Mark clusters as used: all but a few, or every 500th."""
    image = new_card()
    fats = int.from_bytes(image[36:40], "little")
    table = np.frombuffer(image, dtype="<u4", count=fats * 128, offset=32 * BLOCK).copy()
    used = np.zeros(len(table), dtype=bool)
    used[3:] = True
    if fragmented:
        used[3:] = np.arange(len(table) - 3) % 500 == 0
    table[used] = 0x0FFFFFFF
    image[BLOCK + 488 : BLOCK + 492] = b"\xff" * 4  # the free count is not known
    for copy in range(2):
        start = (32 + copy * fats) * BLOCK
        image[start : start + fats * BLOCK] = table.tobytes()
    return image


def exfat_card() -> bytearray:
    """A boot record as Windows writes it on cards of 64 GB."""
    image = bytearray(1 << 20)
    image[0:11] = b"\xeb\x76\x90EXFAT   "
    image[510:512] = b"\x55\xaa"
    return image


def test_every_trouble_has_its_own_code() -> None:
    found = {
        "none": boot_with(None),
        "exfat": boot_with(exfat_card()),
        "empty": boot_with(bytearray(1 << 20)),
        "unreadable": boot_with(new_card(), unreadable=True),
        "full": boot_with(full_card(fragmented=False)),
        "fragmented": boot_with(full_card(fragmented=True)),
        "good": boot_with(new_card()),
    }
    assert found == {
        "none": (Volume.NO_CARD, 2),
        "exfat": (Volume.NO_FAT, 3),
        "empty": (Volume.NO_FAT, 3),
        "unreadable": (Volume.UNREADABLE, 4),
        "full": (Volume.FULL, 5),
        "fragmented": (Volume.FRAGMENTED, 6),
        "good": (Volume.READY, 0),
    }


def test_card_behind_a_partition_table_and_with_large_clusters(tmp_path: Path) -> None:
    image = new_card(4, partitioned=True)
    bench = Bench(image)
    bench.power_on_and_record(3.0)
    bench.stop()
    path = tmp_path / "card.img"
    path.write_bytes(image)
    content = read_file(path, "FLT00001.BIN", partitioned=True)
    found = oracle.decode(content)
    assert found is not None
    assert found.complete == "complete"


@pytest.mark.parametrize("seed", every_nth(range(16), 4))
def test_power_cut_at_a_random_instant_of_flight(tmp_path: Path, seed: int) -> None:
    """Every block whose busy ended decodes, the file system is clean, the next boot goes on."""
    bench = Bench()
    plan = flight(34.0)
    plan.give(bench.sitl)
    bench.sitl.add_card_fault(0, CardFault.EVERY_BUSY, 20_000)
    bench.power_on_and_record(0.6)
    (cut_s,) = spread(seed, 1, 1.2, 12.0)
    bench.sitl.run_until(ticks(cut_s))
    state = bench.sitl.state()
    whole = state.blocks_taken - state.programming
    bench.sitl.power_cut(seed)
    assert bench.fsck(tmp_path) == ""
    content = read_file(bytes(bench.image), "FLT00001.BIN")
    blocks = oracle.find_blocks(content)
    good = [block for block in blocks if block.file_id == blocks[0].file_id]
    # Block 0 was written on the ground; the block under way is lost as garbage.
    assert [block.sequence for block in good] == list(range(whole + 1))
    cut = bench.log(tmp_path).frames["ident"]["count"]
    assert missing(cut) == 0
    later = bench.sitl.now() / TICKS_PER_S + 40
    bench.sitl.run_until(ticks(later))
    idle_receiver(bench.sitl, later, later + 20)
    bench.sitl.power_on()
    bench.sitl.run_for(14.0)
    assert bench.state() == Recorder.READY
    closed = bench.log(tmp_path)
    assert closed.complete == "complete"
    assert causes(closed, "session_end") == ["next_boot"]
    assert np.array_equal(closed.frames["ident"]["count"], cut)
    assert bench.fsck(tmp_path) == ""


def test_formatting_clears_what_was_there() -> None:
    """The card of these tests is a card: what it formats, fsck agrees on."""
    image = new_card()
    before = bytes(image)
    image[40 * BLOCK : 50 * BLOCK] = b"x" * (10 * BLOCK)
    format_fat32(memoryview(image), 1)
    assert bytes(image) == before
