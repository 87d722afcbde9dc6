"""A short selection of `make faults`, one of each kind; and that the judges can say no."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from flight.flown_row import FlownRow
    from flight.rig import FlightRig
    from simavr_bench.card_journal import CardJournal

    InInput = tuple[FlightRig, CardJournal, FlownRow]

CHOSEN = (
    "card busy 1.2 s",
    "card's line low for 4 s",
    "SPI switched off in its register",
    "supply's conversion never ends",
    "no conversion ever ends",
    "block refused twice",
    "every block refused for 3 s",
    "pressure words 0xFFFF",
    "IMU dies holding SCL",
    "gyro saturated",
    "all channels lost",
    "60 glitches of 50 to 700 us",
    "supply sags to 4.4 V",
    "stack overflow",
    "interrupt storm",
    "GPS week ends",
)


@pytest.mark.parametrize("injected", CHOSEN)
def test_fault_in_flight(
    recording: tuple[FlightRig, CardJournal], tmp_path: Path, injected: str
) -> None:
    from flight.faults.rows import FAULTS
    from flight.faults.run import run_fault
    from simavr_bench import in_fork

    fault = next(fault for fault in FAULTS if fault.injected == injected)
    assert in_fork(partial(run_fault, *recording, fault, tmp_path)).wrong == []


# While a row of a card is flown: one of each way in which the firmware learns of a fault, and one
# that it survives.
DURING_INPUT = (
    "card busy 1.2 s",
    "block refused twice",
    "pressure sensor silent",
    "IMU dies holding SCL",
    "all channels lost",
    "failsafe pulses: switch 920 us",
    "no conversion ever ends",
    "watchdog reset",
    "main loop hangs",
    "GPS silent",
)


# The same while a row holds: by the IMU that it holds by, the pilot's link, a reset.
WHILE_HELD = ("IMU silent", "gyro saturated", "all channels lost", "watchdog reset")


@pytest.fixture(scope="module")
def in_input(flight_elf: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[InInput]:
    """A rig in the middle of a row of a card: for children made by in_fork only."""
    from flight.flown_row import input_rig

    found = input_rig(flight_elf, tmp_path_factory.mktemp("in_input"), threshold_volt=0.8)
    yield found
    found[0].chip.close()


@pytest.fixture(scope="module")
def in_held_row(flight_elf: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[InInput]:
    """The same in a row that holds bank and pitch."""
    from flight.flown_row import HOLDS, input_rig

    found = input_rig(flight_elf, tmp_path_factory.mktemp("in_row"), HOLDS, threshold_volt=0.8)
    yield found
    found[0].chip.close()


@pytest.mark.parametrize("injected", DURING_INPUT)
def test_fault_while_a_row_is_flown(in_input: InInput, tmp_path: Path, injected: str) -> None:
    assert wrong_of(in_input, tmp_path, injected) == []


@pytest.mark.parametrize("injected", WHILE_HELD)
def test_fault_while_a_row_holds(in_held_row: InInput, tmp_path: Path, injected: str) -> None:
    assert wrong_of(in_held_row, tmp_path, injected) == []


def test_a_held_surface_beyond_its_authority_is_said(in_held_row: InInput, tmp_path: Path) -> None:
    """A flight without a fault, judged as if the card gave a tenth of its authority."""
    rig, journal, row = in_held_row
    little = replace(row, authority=tuple(0.1 * cycles for cycles in row.authority))
    wrong = wrong_of((rig, journal, little), tmp_path, "none")
    assert [one.partition(" at ")[2].partition(",")[0] for one in wrong] == ["aileron", "elevator"]


def wrong_of(flown: InInput, folder: Path, injected: str) -> list[str]:
    from flight.faults.rows import FAULTS
    from flight.faults.run import run_fault
    from simavr_bench import in_fork

    rig, journal, row = flown
    fault = next(fault for fault in FAULTS if fault.injected == injected)
    return in_fork(partial(run_fault, rig, journal, fault, folder, row)).wrong


def test_an_input_that_goes_on_or_is_nobodys_is_said(in_input: InInput, tmp_path: Path) -> None:
    """A flight without a fault, judged as if one must end its row; then as if none was flown."""
    from flight.faults.rows import NONE
    from flight.faults.run import run_fault
    from simavr_bench import in_fork

    rig, journal, row = in_input
    none = replace(NONE, injected="IMU silent", fault_s=0.5, after_s=1.0)
    wrong = in_fork(partial(run_fault, rig, journal, none, tmp_path, row)).wrong
    assert len(wrong) == 1
    assert wrong[0].startswith("deflected")
    wrong = in_fork(partial(run_fault, rig, journal, none, tmp_path)).wrong
    assert [one.partition(" at ")[2].partition(",")[0] for one in wrong] == [
        "aileron", "elevator", "rudder",
    ]  # fmt: skip


@pytest.mark.parametrize(
    "injected", ["card not formatted", "card that cannot be read", "card with FLT99999.BIN"]
)
def test_card_that_cannot_be_recorded_on(flight_elf: Path, tmp_path: Path, injected: str) -> None:
    from flight.faults.boot import BAD_CARDS, boot
    from simavr_bench import in_fork

    bad = next(bad for bad in BAD_CARDS if bad.injected == injected)
    assert in_fork(partial(boot, flight_elf, tmp_path, bad)).wrong == []


@pytest.mark.parametrize(
    "injected",
    [
        "closing cut, chain first, 4 kB",
        "newest chain cyclic at its begin",
        "first cluster out of range",
        "3 s stall while mounting",
        "3 s stall in the search",
    ],
)
def test_strange_card_at_power_on(flight_elf: Path, tmp_path: Path, injected: str) -> None:
    from flight.faults.strange import STRANGE_CARDS, fly_strange

    row = next(row for row in STRANGE_CARDS if row.injected == injected)
    assert fly_strange(flight_elf, tmp_path, row).judgement.wrong == []


@pytest.mark.parametrize(
    "threshold_volt", [1.5, pytest.param(0.8, marks=pytest.mark.campaign)]
)  # a row is flown with the other
def test_refused_block_with_either_transistor(
    flight_elf: Path, tmp_path: Path, threshold_volt: float
) -> None:
    from flight.faults.rows import FAULTS
    from flight.faults.run import ready_rig, run_fault
    from simavr_bench import in_fork

    rig, journal = ready_rig(flight_elf, tmp_path, threshold_volt=threshold_volt)
    fault = next(fault for fault in FAULTS if fault.injected == "block refused twice")
    assert in_fork(partial(run_fault, rig, journal, fault, tmp_path)).wrong == []


def test_an_expectation_that_is_not_met_is_said(
    recording: tuple[FlightRig, CardJournal], tmp_path: Path
) -> None:
    """A flight without a fault, judged as if the receiver, the IMU and the card had failed."""
    from flight.faults.card import drops_are_counted
    from flight.faults.receiver import all_lost
    from flight.faults.rows import NONE
    from flight.faults.run import run_fault
    from flight.faults.sensors import stale
    from simavr_bench import in_fork

    for check in (drops_are_counted, all_lost, stale):
        row = replace(
            NONE, check=check, events=("imu_lost",), engaged=False, fault_s=1.5, after_s=1.0
        )
        wrong = in_fork(partial(run_fault, *recording, row, tmp_path)).wrong
        assert wrong[:2] == ["the Mega drives", "no event imu_lost"]
        assert len(wrong) >= 3
