"""Files and sessions of the flight image: resumed, closed, prepared, never overwritten."""

from __future__ import annotations

import subprocess
import zlib
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest

import host

if TYPE_CHECKING:
    from flight.rig import FlightRig
    from simavr_bench.card_journal import CardJournal

MakeRig = Callable[..., "FlightRig"]
RESUMED_S, LOOK_S = 2.0, 0.1
PHASES_MS = tuple(range(0, 78, 3))  # a block is written every 73 ms, sent within 8


def resumed_s(rig: FlightRig, journal: CardJournal, cause: str, wait_ms: float) -> float:
    """Reset after a wait; give the time until a block is on its way to the card."""
    from flight.cut_flight import FILE_BLOCKS, place_of_file
    from simavr_bench import ResetCause

    rig.chip.run_s(wait_ms / 1000)
    rig.receiver.width_us[3] = 1000.0  # idle: the mark in .noinit alone decides
    rig.chip.reset(ResetCause[cause])
    for _ in range(round(RESUMED_S / LOOK_S)):
        rig.chip.run_s(LOOK_S)
        if journal.records()["begun"][-1] > rig.started[-1]:
            break
    rig.chip.run_s(0.5)
    rows = journal.records()
    place = rows["block"].astype(np.int64) - place_of_file(rows)
    later = rows["begun"] > rig.started[-1]
    assert np.all((place[later] >= 0) & (place[later] < FILE_BLOCKS))  # no metadata
    first = rows["begun"][later]
    return (int(first[0]) - rig.started[-1]) / 16e6 if len(first) else float("nan")


def test_reset_at_any_phase_of_a_block_resumes_at_once(
    recording: tuple[FlightRig, CardJournal],
) -> None:
    """Also in the middle of a block, and while the card is busy with one."""
    from simavr_bench import in_fork

    times_s = [
        in_fork(partial(resumed_s, *recording, "WATCHDOG", wait_ms)) for wait_ms in PHASES_MS
    ]
    late = {p: t for p, t in zip(PHASES_MS, times_s, strict=True) if not t <= RESUMED_S}
    assert late == {}


# ---- files --------------------------------------------------------------------------------------

FILE_BYTES = 64 << 20
BUTTON, BUZZER = "PG0", "PH4"
BYTES_PER_S = 7900  # at 100 Hz


def last_line(rig: FlightRig) -> str:
    """The last whole status line."""
    return [line for line in rig.status_lines() if line.endswith("mV")][-1]


def blocks_for(minutes: float) -> int:
    """Blocks of a file that so many minutes need."""
    return round(minutes * 60 * BYTES_PER_S / 480)


def size_of(image: Path, name: str) -> int:
    """Size of a file in the directory."""
    from flight.card_files import read_file

    return len(read_file(image, name, image.with_suffix(".tmp")))


@pytest.fixture(scope="module")
def open_card(
    recording: tuple[FlightRig, CardJournal], tmp_path_factory: pytest.TempPathFactory
) -> tuple[Path, int]:
    """A card whose battery was pulled in flight, and where its file begins."""
    from flight.cut_flight import place_of_file
    from simavr_bench import in_fork

    rig, journal = recording
    image = tmp_path_factory.mktemp("open") / "open.img"

    def pull() -> int:
        rig.chip.power_off()
        rig.save_card(image)
        return place_of_file(journal.records())

    return image, in_fork(pull)


def fill(open_card: tuple[Path, int], target: Path, left: int) -> Path:
    """Go on with the flight of a card until so many blocks of its file are left."""
    from flight.cut_flight import FILE_BLOCKS
    from simavr_bench.card_journal import copy_sparse

    image, first_lba = copy_sparse(open_card[0], target), open_card[1]
    with image.open("r+b") as file:
        file.seek(first_lba * 512)
        blocks = [file.read(512) for _ in range(200)]
        last = max(k for k, block in enumerate(blocks) if block[:4] == b"FLT1")
        head, body = blocks[last][:12], blocks[last][16:508]
        file.seek((first_lba + last + 1) * 512)
        for number in range(last + 1, FILE_BLOCKS - left):
            block = head + number.to_bytes(4, "little") + body
            file.write(block + zlib.crc32(block).to_bytes(4, "little"))
    return image


def fly_on(flight_elf: Path, image: Path, record_s: float) -> tuple[FlightRig, CardJournal]:
    """Power on in flight with a card, and record for a while."""
    from flight.rig import CRUISE_US, FlightRig
    from simavr_bench.card_journal import CardJournal

    rig = FlightRig(flight_elf, image, ground_s=0.0)
    journal = CardJournal(rig.card)
    rig.receiver.width_us[3] = CRUISE_US
    rig.chip.watch(BUZZER)
    rig.power_on()
    rig.chip.run_s(record_s)
    return rig, journal


def written(journal: CardJournal, since: int) -> int:
    """Blocks programmed since a cycle."""
    return int(np.count_nonzero(journal.records()["begun"] > since))


def test_full_file_stops_with_an_alarm_and_is_closed_on_the_ground(
    flight_elf: Path, open_card: tuple[Path, int], tmp_path: Path
) -> None:
    from flight.rig import CRUISE_US, IDLE_US, check_card, take_log

    image = fill(open_card, tmp_path / "full.img", left=60)
    rig, journal = fly_on(flight_elf, image, 8.0)
    at, level = rig.chip.edges(BUZZER)
    assert np.count_nonzero(level[at > 6 * 16_000_000] == 1) >= 3
    full_at = rig.chip.cycle
    # a glide: throttle idle, up, idle, and long idle while the GPS says 12 m/s
    for throttle_us, time_s in ((IDLE_US, 6.0), (CRUISE_US, 2.0), (IDLE_US, 15.0)):
        rig.receiver.width_us[3] = throttle_us
        rig.chip.run_s(time_s)
    assert written(journal, full_at) == 0
    assert "card full 1" in last_line(rig)
    rig.stand()
    rig.chip.run_s(12.0)
    assert "card ready 2" in last_line(rig)
    rig.land()
    check_card(image)
    assert size_of(image, "FLT00002.BIN") == FILE_BYTES
    log = host.read_log(take_log(image, tmp_path / "full.bin"))
    assert log.complete == "complete"
    events = log.frames["event"]
    ends = events[events["code"] == log.schema.number("event", "session_end")]
    assert log.schema.word("end_cause", int(ends["arg"][-1])) == "file_full"
    assert not log.loss.dropped_frames


@pytest.mark.parametrize(("minutes", "number"), [(25, 2), (40, 1)])
def test_with_less_than_half_an_hour_left_the_ground_prepares_a_new_file(
    flight_elf: Path, open_card: tuple[Path, int], tmp_path: Path, minutes: int, number: int
) -> None:
    from flight.rig import CRUISE_US, IDLE_US, check_card, take_log

    image = fill(open_card, tmp_path / "late.img", left=blocks_for(minutes))
    rig, _ = fly_on(flight_elf, image, 3.0)
    rig.stand()
    rig.receiver.width_us[3] = IDLE_US
    rig.chip.run_s(20.0)
    rig.receiver.width_us[3] = CRUISE_US
    rig.chip.run_s(4.0)
    rig.land()
    check_card(image)
    name = f"FLT{number:05d}.BIN"
    assert size_of(image, name) == FILE_BYTES
    log = host.read_log(take_log(image, tmp_path / "late.bin", number))
    assert len(log.frames["ident"]) > 200
    assert log.frames["event"]["code"][-1] != 2  # it records there


def test_blank_file_with_little_room_is_given_more(flight_elf: Path, tmp_path: Path) -> None:
    from flight.card_files import list_files, put_file, read_file
    from flight.rig import FlightRig, check_card, make_card

    image = make_card(tmp_path / "card.img")
    put = False
    for _ in range(2):
        rig = FlightRig(flight_elf, image)
        rig.power_on()
        rig.chip.run_s(11.0)
        rig.land()
        assert list_files(image) == ["FLT00001.BIN"]
        blank = read_file(image, "FLT00001.BIN", tmp_path / "blank")
        if not put:
            put = True
            subprocess.run(["mdel", "-i", str(image), "::FLT00001.BIN"], check=True)
            put_file(image, "FLT00001.BIN", blank[: 4 << 20])
    assert len(blank) == FILE_BYTES
    check_card(image)  # what it had before is free again


def test_button_starts_and_stops_and_no_file_is_overwritten(
    flight_elf: Path, tmp_path: Path
) -> None:
    """A press starts, 2 s stop it with throttle idle only; number, size and date of the file."""
    from flight.card_files import list_files, put_file, read_file
    from flight.rig import CRUISE_US, IDLE_US, FlightRig, check_card, make_card, take_log

    image = make_card(tmp_path / "card.img")
    put_file(image, "FLT00041.BIN", b"somebody's")
    rig = FlightRig(flight_elf, image)
    rig.gps.week, rig.gps.itow_ms = 2450, 360_000_000
    rig.power_on()

    def press(time_s: float) -> None:
        rig.chip.drive(BUTTON, False)
        rig.chip.run_s(time_s)
        rig.chip.drive(BUTTON, None)
        rig.chip.run_s(0.5)

    rig.chip.run_s(11.0)
    assert "card ready 42" in last_line(rig)
    lines = len(rig.status_lines())
    press(0.3)
    rig.receiver.width_us[3] = CRUISE_US
    rig.chip.run_s(1.0)
    press(2.5)
    rig.chip.run_s(2.0)
    assert len(rig.status_lines()) <= lines + 1  # it records: no line
    rig.receiver.width_us[3] = IDLE_US
    rig.chip.run_s(0.5)
    press(2.5)
    rig.stand()
    rig.chip.run_s(12.0)
    assert "card ready 43" in last_line(rig)
    rig.land()
    check_card(image)
    assert list_files(image) == ["FLT00041.BIN", "FLT00042.BIN", "FLT00043.BIN"]
    assert read_file(image, "FLT00041.BIN", tmp_path / "old")[:] == b"somebody's"
    assert size_of(image, "FLT00043.BIN") == FILE_BYTES
    log = host.read_log(take_log(image, tmp_path / "flight.bin", 42))
    assert log.complete == "complete"
    codes = [int(code) for code in log.frames["event"]["code"]]
    assert codes.count(1) == codes.count(2) == 1
    listed = subprocess.run(
        ["mdir", "-i", str(image), "::FLT00042.BIN"], capture_output=True, text=True, check=True
    ).stdout
    assert "2026-12-24" in listed  # as the GPS said


def outside_the_file(journal: CardJournal, first_lba: int) -> int:
    """Blocks programmed that are none of the flight's file."""
    from flight.cut_flight import FILE_BLOCKS

    place = journal.records()["block"].astype(np.int64) - first_lba
    return int(np.count_nonzero((place < 0) | (place >= FILE_BLOCKS)))


@pytest.mark.parametrize("missing", ["nothing", "imu", "gps", "baro"])
def test_idle_glide_behind_a_supply_dip_goes_on_in_its_file(
    flight_elf: Path, open_card: tuple[Path, int], tmp_path: Path, missing: str
) -> None:
    """The mark is lost with the supply, the receiver boots for 2.5 s, the throttle is idle."""
    from flight.rig import IDLE_US, FlightRig
    from simavr_bench.card_journal import CardJournal, copy_sparse

    image, first_lba = open_card
    rig = FlightRig(flight_elf, copy_sparse(image, tmp_path / "open.img"), ground_s=0.0)
    journal = CardJournal(rig.card)
    rig.receiver.width_us[3] = IDLE_US
    rig.receiver.lost = True
    rig.baro.source = lambda cycle: (27_898, 8 * 23_843 + cycle // 160_000)
    rig.power_on()
    rig.imu.silent, rig.gps.silent = missing == "imu", missing == "gps"
    rig.baro.present = missing != "baro"
    rig.chip.run_s(2.5)
    rig.receiver.lost = False
    rig.chip.run_s(27.5)
    assert written(journal, 0) > 300
    assert outside_the_file(journal, first_lba) == 0
    rig.land()


def test_aircraft_that_stands_still_closes_its_file_when_that_is_sure(
    flight_elf: Path, open_card: tuple[Path, int], tmp_path: Path
) -> None:
    """No metadata while the receiver boots, nor for 4 s behind a jolt; then file and a new one."""
    from flight.rig import IDLE_US, FlightRig
    from simavr_bench.card_journal import CardJournal, copy_sparse

    rig = FlightRig(flight_elf, copy_sparse(open_card[0], tmp_path / "open.img"), ground_s=30.0)
    journal = CardJournal(rig.card)
    rig.receiver.width_us[3] = IDLE_US
    rig.power_on()
    rig.chip.run_s(3.0)
    rig.moving = True
    rig.chip.run_s(0.5)
    rig.moving = False
    rig.chip.run_s(4.0)
    assert written(journal, 0) == 0
    rig.chip.run_s(9.0)
    assert "card ready 2" in last_line(rig)
    rig.land()
