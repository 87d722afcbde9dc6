"""Files and sessions: what survives a power cut, and which blocks belong to which flight."""

from pathlib import Path

import pytest
from host.twin.recorder.sitl_library import EEPROM_BYTES, TICKS_PER_S, Recorder
from host.wire.schema_text import packed_schema

from tests.protocol import oracle
from tests.sitl.bench import Bench, causes, events, flight, idle_receiver, missing
from tests.sitl.card_image import CARD_ID, format_fat32, new_card, read_file, remove_files
from tests.sitl.compare import NAMES, compare

ERASED = b"\xff" * EEPROM_BYTES
BROWN_OUT = packed_schema().number("reset_cause", "brown_out")


def power_cycle(bench: Bench) -> None:
    bench.sitl.power_cut(7)
    bench.sitl.run_for(0.5)
    bench.sitl.power_on()
    bench.sitl.run_for(0.5)


def short_flight(bench: Bench, seconds: float = 3.0) -> None:
    bench.power_on_and_record(seconds)
    bench.stop()


def decoded(bench: Bench, number: int = 1) -> oracle.Decoded:
    found = oracle.decode(read_file(bytes(bench.image), f"FLT{number:05d}.BIN"))
    assert found is not None
    return found


def test_files_are_numbered_and_never_overwritten(tmp_path: Path) -> None:
    bench = Bench()
    short_flight(bench)
    first = read_file(bytes(bench.image), "FLT00001.BIN")
    power_cycle(bench)
    bench.record(2.0)
    bench.stop()
    assert list(bench.files()) == ["FLT00001.BIN", "FLT00002.BIN", "FLT00003.BIN"]
    assert read_file(bytes(bench.image), "FLT00001.BIN") == first
    assert bench.log(tmp_path, 2).complete == "complete"
    assert bench.fsck(tmp_path) == ""


def test_pulled_battery_is_closed_when_it_is_the_ground_for_sure(tmp_path: Path) -> None:
    bench = Bench()
    idle_receiver(bench.sitl, 6.0, 40.0)
    bench.power_on_and_record(4.0)
    power_cycle(bench)
    assert bench.state() == Recorder.UNDECIDED
    written = bench.sitl.state().ground_writes
    bench.sitl.run_for(16.5)
    assert bench.sitl.state().ground_writes == written  # no metadata before the decision
    bench.sitl.run_for(5.0)
    assert bench.state() == Recorder.READY
    log = bench.log(tmp_path)
    assert causes(log, "session_end") == ["next_boot"]
    assert log.complete == "complete"
    assert len(bench.files()) == 2
    assert bench.files()["FLT00001.BIN"] < 512 * 400
    assert bench.fsck(tmp_path) == ""


def test_throttle_above_idle_resumes_an_open_file(tmp_path: Path) -> None:
    bench = Bench()
    idle_receiver(bench.sitl, 0.1, 1.0)
    idle_receiver(bench.sitl, 1.0, 30.0, throttle_us=1700)
    bench.sitl.power_on()
    bench.sitl.run_for(4.0)
    assert bench.state() == Recorder.RECORDING  # started by the throttle
    power_cycle(bench)
    bench.sitl.run_for(3.0)
    assert bench.state() == Recorder.RECORDING
    assert bench.sitl.state().file_number == 1
    assert decoded(bench).sessions == [1, 2, 3]


def test_reset_in_flight_resumes_within_two_seconds_without_metadata(tmp_path: Path) -> None:
    bench = Bench()
    plan = flight(40.0)
    plan.give(bench.sitl)
    bench.power_on_and_record(5.0)
    written = bench.sitl.state().ground_writes
    reset_at = bench.sitl.now()
    bench.sitl.reset(BROWN_OUT)
    bench.sitl.run_for(2.0)
    assert bench.state() == Recorder.RECORDING
    bench.sitl.run_for(10.0)
    assert bench.sitl.state().ground_writes == written
    bench.sitl.run_until(27 * TICKS_PER_S)
    bench.stop()
    log = bench.log(tmp_path)
    assert [session.number for session in log.sessions] == [1, 2, 3]
    assert causes(log, "session_start") == ["button", "resumed"]
    assert BROWN_OUT in events(log, "reset")
    assert log.complete == "complete"
    second = bench.log(tmp_path, session=3)
    clock_us = -(reset_at // 2)
    frames = {name: second.frames[name] for name in NAMES}
    assert [d for d in compare(frames, plan, clock_us=clock_us) if not d.good] == []
    assert missing(second.frames["ident"]["count"]) == 0


def test_eeprom_erased_between_two_flights(tmp_path: Path) -> None:
    bench = Bench()
    short_flight(bench)
    short_flight(bench)
    bench.sitl.power_cut()
    bench.sitl.set_eeprom(ERASED)
    short_flight(bench)
    sessions = [decoded(bench, number).sessions[-1] for number in (1, 2, 3)]
    assert sessions == sorted(set(sessions))  # larger than any in the file found at mount
    ids = {decoded(bench, number).file_id for number in (1, 2, 3)}
    assert len(ids) == 3


@pytest.mark.parametrize("wipe", ["delete", "format"])
def test_files_deleted_and_eeprom_erased_again_and_again(wipe: str) -> None:
    """The card's blocks are valid and old, the session number starts anew: only the id is left.

    The formatted card gives the new file the place of the old one, the other card does not. The
    id's CRC must not run over a block's own CRC, which would make it a constant.
    """
    bench = Bench(new_card())
    ids = []
    for seconds in (9.0, 6.0, 3.0, 2.0):
        short_flight(bench, seconds)
        log = decoded(bench)
        assert log.sessions == [log.sessions[-1]]
        assert log.foreign == []
        ids.append(log.file_id)
        bench.sitl.power_cut()
        bench.sitl.set_eeprom(ERASED)
        if wipe == "delete":
            remove_files(bench.image)
        else:
            format_fat32(memoryview(bench.image), 1)
    assert len(set(ids)) == 4


def test_old_blocks_behind_the_end_are_known_to_be_stale(tmp_path: Path) -> None:
    bench = Bench(new_card())
    short_flight(bench, 9.0)
    bench.sitl.power_cut()
    bench.sitl.set_eeprom(ERASED)
    format_fat32(memoryview(bench.image), 1)
    bench.power_on_and_record(3.0)
    bench.sitl.power_cut(3)
    found = decoded(bench)
    assert len(found.foreign) > 50
    assert found.sessions == [1]
    times = [values["t_us"] for values, _ in found.frames["ident"]]
    assert max(times) - min(times) < 4_000_000
    # The next boot finds the true end too.
    idle_receiver(bench.sitl, bench.sitl.now() / TICKS_PER_S, bench.sitl.now() / TICKS_PER_S + 25)
    bench.sitl.power_on()
    bench.sitl.run_for(22.0)
    assert bench.state() == Recorder.READY
    again = decoded(bench)
    assert again.foreign == []
    assert again.complete == "complete"
    assert len(again.frames["ident"]) == len(times)
    assert bench.fsck(tmp_path) == ""


def test_card_of_another_logger(tmp_path: Path) -> None:
    """Its files have our kind of name and our blocks; this logger has an EEPROM of its own."""
    other = Bench()
    for _ in range(3):
        short_flight(other)
    image = other.image
    theirs = read_file(bytes(image), "FLT00003.BIN")
    bench = Bench(image)
    short_flight(bench)
    assert read_file(bytes(image), "FLT00003.BIN") == theirs
    mine = decoded(bench, 4)
    assert mine.sessions[-1] > oracle_sessions(theirs)[-1]
    assert bench.fsck(tmp_path) == ""


def oracle_sessions(data: bytes) -> list[int]:
    found = oracle.decode(data)
    assert found is not None
    return found.sessions


def test_a_file_of_another_kind_is_left_alone() -> None:
    bench = Bench()
    short_flight(bench)
    image = bench.image
    # Rename the log and overwrite its content: now it is not a log.
    at = image.find(b"FLT00001BIN")
    image[at + 3 : at + 8] = b"00041"
    start = image.find(b"FLT1" + decoded_id(bench))
    image[start : start + 512] = b"not a log at all".ljust(512, b".")
    bench.sitl.power_cut()
    short_flight(bench)
    assert set(bench.files()) >= {"FLT00041.BIN", "FLT00042.BIN"}


def decoded_id(bench: Bench) -> bytes:
    return read_file(bytes(bench.image), "FLT00041.BIN")[4:8]


def test_full_file_ends_the_session_and_the_ground_makes_a_new_one(tmp_path: Path) -> None:
    bench = Bench(file_blocks=300)
    idle_receiver(bench.sitl, 0.1, 1.0)
    idle_receiver(bench.sitl, 1.0, 40.0, throttle_us=1700)
    idle_receiver(bench.sitl, 40.0, 70.0)
    bench.sitl.power_on()
    bench.sitl.run_for(30.0)
    assert bench.state() == Recorder.FILE_FULL
    log = bench.log(tmp_path)
    assert causes(log, "session_end") == ["file_full"]
    assert len(bench.files()) == 1
    # Neither throttle nor a reset in flight brings metadata onto the card.
    written = bench.sitl.state().ground_writes
    bench.sitl.reset(BROWN_OUT)
    bench.sitl.run_until(57 * TICKS_PER_S)
    assert bench.sitl.state().ground_writes == written
    bench.sitl.run_until(63 * TICKS_PER_S)
    assert bench.state() == Recorder.READY
    assert bench.log(tmp_path).complete == "complete"
    assert len(bench.files()) == 2


def test_no_new_file_is_prepared_in_flight() -> None:
    bench = Bench(new_card())
    idle_receiver(bench.sitl, 0.1, 8.0, throttle_us=1700)
    idle_receiver(bench.sitl, 8.0, 40.0)
    bench.sitl.power_on()  # a card without a file, throttle above idle
    bench.sitl.run_until(25 * TICKS_PER_S)
    assert bench.sitl.state().ground_writes == 0
    bench.sitl.run_until(28 * TICKS_PER_S)
    assert bench.state() == Recorder.READY


def test_identity_says_card_and_boots() -> None:
    bench = Bench()
    short_flight(bench)
    short_flight(bench)
    identity = decoded(bench, 2).frames["identity"][0][0]
    assert bytes(identity["card_id"]) == CARD_ID
    assert identity["boots"] == 2
    assert identity["session"] == decoded(bench, 2).sessions[-1]


@pytest.mark.parametrize("hole", [(250,), (-2,), (-5, -4, -3), (100, 101, 102, 103)])
def test_resume_behind_a_hole_overwrites_nothing(tmp_path: Path, hole: tuple[int, ...]) -> None:
    """Garbage between good blocks, also where the search for the end looks first (250)."""
    bench = Bench()
    idle_receiver(bench.sitl, 0.1, 1.0)
    idle_receiver(bench.sitl, 1.0, 60.0, throttle_us=1700)
    bench.sitl.power_on()
    bench.sitl.run_for(22.0)
    bench.sitl.power_cut(7)
    before = oracle.find_blocks(read_file(bytes(bench.image), "FLT00001.BIN"))
    good = [block for block in before if block.verdict == "ok"]
    assert len(good) > 270
    places = {}
    for number in hole:
        block = good[number]
        raw = read_file(bytes(bench.image), "FLT00001.BIN")[block.position :][:512]
        at = bytes(bench.image).index(raw)
        bench.image[at : at + 512] = bytes((b * 7 + 1) & 0xFF for b in raw)
        places[block.sequence] = at
    bench.sitl.run_for(0.5)
    bench.sitl.power_on()
    bench.sitl.run_for(6.0)
    assert bench.state() == Recorder.RECORDING
    bench.sitl.power_cut(8)
    after = {
        block.sequence: block
        for block in oracle.find_blocks(read_file(bytes(bench.image), "FLT00001.BIN"))
        if block.verdict == "ok"
    }
    for block in good:
        if block.sequence not in places:
            assert after[block.sequence] == block
    newest = [block for block in after.values() if block.session > good[-1].session]
    assert len(newest) > 50
    assert min(block.sequence for block in newest) == good[-1].sequence + 1
    log = bench.log(tmp_path)
    assert log.complete == "damaged"
    assert sum(loss.blocks for loss in log.loss.losses) == len(hole)
