"""Test inputs on the chip: as commanded, given up in time, the recorder's figures with them.

One flight to the middle of an input; each fault begins there, in a child process.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from copy import deepcopy
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from flight.bench.inputs import input_rig, learning_cards
from flight.faults.program import HANG, NOW_US
from flight.input_rig import CYCLES_PER_TICK, TICKS_PER_S, InputRig
from flight.rig import make_card
from flight.slices import SliceWatch
from simavr_bench import Image, ResetCause
from simavr_bench.fork import in_fork

from tests.sitl import flight_cards as cards
from tests.sitl.hold_flight import TILTS_S
from tests.sitl.input_faults import ROWS
from tests.sitl.input_flight import (
    AILERON,
    DIRECT_US,
    ELEVATOR,
    MEGA_US,
    PACKET_S,
    SWITCH,
    TRIGGER_S,
    UP_S,
    InputFlight,
    input_flight,
)
from tests.sitl.input_judge import Trigger, deflected, slewed, wrong_pulses
from tests.sitl.input_shapes import shape_of

ROW = ROWS[4]  # a multisine on three axes: the longest to compute
QUIET_S, LENGTH_S = 0.2, 2.0
TAUGHT_S = 4.2
LONGEST_CYCLES = 4800
FORK_S = TRIGGER_S + 0.5
FAULT_S = FORK_S + 0.4
NEAR_TICKS = 8  # a width measured on the chip is 2.6 us off at most
PLAIN_S = 0.025
SERVO_S = 0.020  # between two pulses of a servo: the first plain one comes behind the last other
SENSE_S = 0.045
HELD_S = TRIGGER_S + TILTS_S + 1.0
HELD_FAULT_S = HELD_S + 0.4


@pytest.fixture(scope="module")
def running(flight_elf: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[InputRig]:
    """A rig in the middle of an input: for children made by in_fork only."""
    card = make_card(tmp_path_factory.mktemp("inputs") / "card.img")
    flight = input_flight(TRIGGER_S + QUIET_S + LENGTH_S + 1.0, np.random.default_rng(30_020))
    flight.width_us[int((UP_S + 1.0) / flight.frame_s) :, :3] = 1500
    rig = InputRig(flight_elf, card, flight, cards.eeprom_with(cards.card([ROW])))
    rig.run_to(FORK_S)
    yield rig
    rig.chip.close()


def wrong(rig: InputRig, known_s: float | None, within_s: float = PLAIN_S) -> list[str]:
    """Return what is wrong with the servo pulses."""
    shape = slewed(shape_of(ROW), cards.HEAD["rate_max_usps"])
    end_s = TRIGGER_S + QUIET_S + LENGTH_S + 0.085
    trigger = Trigger(TRIGGER_S, end_s, QUIET_S, shape)
    pulses = rig.pulses()
    found = wrong_pulses(pulses, rig.flight, trigger, near=NEAR_TICKS)
    begun = deflected(pulses, rig.flight, 0.0, near=NEAR_TICKS)
    if begun.size < 20:
        found.append("no input was seen")
    if known_s is not None:
        late = deflected(pulses, rig.flight, known_s + within_s - SERVO_S, near=NEAR_TICKS)
        found += [f"deflected at {at / TICKS_PER_S:.4f} s" for at in late[:3]]
    return found


def frame(flight: InputFlight, at_s: float) -> int:
    return int(np.ceil(at_s / flight.frame_s))


def test_a_row_on_the_chip_is_what_the_page_says(running: InputRig) -> None:
    """Pulses as commanded, no turn of the loop late, nothing lost."""

    def fly() -> tuple[list[str], int, int]:
        running.run_to(running.flight.seconds)
        dropped = running.chip.uart_lost(2)
        return wrong(running, None), dropped, running.replay.card.count().lost

    said, uart_lost, blocks_lost = in_fork(fly)
    assert said == []
    assert (uart_lost, blocks_lost) == (0, 0)


@pytest.fixture(scope="module")
def teaching(flight_elf: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[InputRig]:
    """A rig 2 s before a row of ten sines on three axes that teaches roll, the costliest."""
    card = make_card(tmp_path_factory.mktemp("teaching") / "card.img")
    flight = input_flight(TRIGGER_S + TAUGHT_S + 1.0, np.random.default_rng(30_021))
    flight.width_us[int((UP_S + 1.0) / flight.frame_s) :, :3] = 1500
    rig = InputRig(flight_elf, card, flight, cards.eeprom_with(learning_cards(6.0)))
    rig.run_to(TRIGGER_S - 1.0)
    yield rig
    rig.chip.close()


@pytest.mark.parametrize(
    ("name", "least"),
    [("TestInputs3see", 800), ("TestInputs4look", 600), ("TestInputs5judge", 1),
     ("RowLearning4step", 500)],
)  # fmt: skip
def test_no_slice_of_an_input_or_of_its_learning_lasts_0p3_ms(
    teaching: InputRig, flight_elf: Path, name: str, least: int
) -> None:
    """From call to return in the image, without the interrupts that came between."""

    def fly() -> list[int]:
        watch = SliceWatch(teaching.chip, flight_elf, name)
        teaching.run_to(TRIGGER_S + TAUGHT_S)
        return [int(cycles) for cycles in watch.cycles()]

    lengths = in_fork(fly)
    assert len(lengths) >= least
    print(f"{name}: {len(lengths)} slices, {max(lengths) / 16:.0f} us at most")
    assert max(lengths) < LONGEST_CYCLES


@pytest.fixture(scope="module")
def holding(flight_elf: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[InputRig]:
    """A rig in the middle of a row that holds bank and pitch."""
    folder = tmp_path_factory.mktemp("holding")
    rig = input_rig(
        flight_elf, rate_hz=200, frame_s=0.014, duration_s=6.0, folder=folder, holds=True
    )
    rig.run_to(HELD_S)
    yield rig
    rig.chip.close()


def test_no_slice_of_a_row_that_holds_lasts_0p3_ms(holding: InputRig, flight_elf: Path) -> None:
    def fly() -> list[int]:
        watch = SliceWatch(holding.chip, flight_elf, "TestInputs3see")
        holding.run_to(HELD_S + 1.0)
        return [int(cycles) for cycles in watch.cycles()]

    lengths = in_fork(fly)
    assert len(lengths) >= 200
    print(f"see, holding: {len(lengths)} slices, {max(lengths) / 16:.0f} us at most")
    assert max(lengths) < LONGEST_CYCLES


def _stick(flight: InputFlight, at_s: float) -> float:
    first = frame(flight, at_s)
    flight.width_us[first:, ELEVATOR] += 100
    return first * flight.frame_s + 0.001 + 0.0023 * ELEVATOR + 0.0025


def _switch(flight: InputFlight, at_s: float) -> float:
    first = frame(flight, at_s)
    flight.width_us[first:, SWITCH] = MEGA_US
    return first * flight.frame_s + 0.001 + 0.0023 * SWITCH + 0.0025


def _silence(flight: InputFlight, at_s: float) -> float:
    first = frame(flight, at_s)
    flight.width_us[first:] = 0
    return (first - 1) * flight.frame_s + 0.001 + 1.5 * flight.frame_s


def _channel(flight: InputFlight, at_s: float) -> float:
    first = frame(flight, at_s)
    flight.width_us[first:, AILERON] = 0
    return (first - 1) * flight.frame_s + 0.001 + 1.5 * flight.frame_s


def _imu_silent(flight: InputFlight, at_s: float) -> float:
    flight.imu_sent[int(at_s / PACKET_S) :] = False
    return at_s + 0.030


def _imu_bank(flight: InputFlight, at_s: float) -> float:
    packet = int(at_s / PACKET_S)
    flight.imu[packet:, 6] = 6200
    return packet * PACKET_S + 0.005


def _direct(flight: InputFlight, at_s: float) -> float:
    first = frame(flight, at_s)
    flight.width_us[first:, SWITCH] = DIRECT_US
    return first * flight.frame_s + 0.001 + 0.0023 * SWITCH + 0.0025


def _held_bank(flight: InputFlight, at_s: float) -> float:
    packet = int(at_s / PACKET_S)
    flight.imu[packet:, 6] = 4510
    return packet * PACKET_S + 0.005


def _held_roll(flight: InputFlight, at_s: float) -> float:
    """45 deg of bank within 0.16 s."""
    packet = int(at_s / PACKET_S)
    flight.imu[packet:, 6], flight.imu[packet:, 0] = 3000, 6100
    return packet * PACKET_S + 0.005


@pytest.mark.parametrize(
    "fault",
    [_stick, _direct, _silence, _imu_silent, _held_bank, _held_roll],
)
def test_held_surfaces_are_plain_behind_a_fault(
    holding: InputRig, fault: Callable[[InputFlight, float], float]
) -> None:
    def fly() -> tuple[int, int]:
        flight = deepcopy(holding.flight)
        known_s = fault(flight, HELD_FAULT_S)
        holding.change(flight)
        holding.run_to(HELD_FAULT_S + 0.4)
        pulses = holding.pulses()
        late = deflected(pulses, flight, known_s + PLAIN_S - SERVO_S, near=NEAR_TICKS)
        return deflected(pulses, flight, HELD_S - 1.0, near=NEAR_TICKS).size, late.size

    moved, late = in_fork(fly)
    assert moved > 20
    assert late == 0


def test_a_reset_forgets_what_was_proven_and_held(holding: InputRig) -> None:
    def fly() -> int:
        holding.run_to(HELD_FAULT_S)
        holding.chip.reset(ResetCause.BROWN_OUT)
        holding.run_to(HELD_FAULT_S + 0.5)
        behind_s = HELD_FAULT_S + SERVO_S
        return deflected(holding.pulses(), holding.flight, behind_s, near=NEAR_TICKS).size

    assert in_fork(fly) == 0


@pytest.mark.parametrize(
    "fault", [_stick, _switch, _direct, _silence, _channel, _imu_silent, _imu_bank]
)
def test_plain_pulses_behind_a_fault_of_the_pilots_link_or_the_imu(
    running: InputRig, fault: Callable[[InputFlight, float], float]
) -> None:
    def fly() -> list[str]:
        flight = deepcopy(running.flight)
        known_s = fault(flight, FAULT_S)
        running.change(flight)
        running.run_to(FAULT_S + 0.4)
        return wrong(running, known_s)

    assert in_fork(fly) == []


def _alpha_open(rig: InputRig) -> float:
    rig.chip.analog(1, 5.0)
    return 0.016


def _baro_off(rig: InputRig) -> float:
    rig.replay.baro.present = False
    return 0.150


def _button(rig: InputRig) -> float:
    rig.chip.drive(rig.pins["button"], False)
    return 0.007


def _watchdog(rig: InputRig) -> float:
    rig.chip.reset(ResetCause.WATCHDOG)
    return SERVO_S - PLAIN_S  # none begins behind it


def _hang(rig: InputRig) -> float:
    """The last pulse is repeated by the timer; 50 ms later the relay has given it up."""
    rig.chip.load(Image({rig.chip.symbols[NOW_US][0]: HANG}))
    return 0.050


@pytest.mark.parametrize("fault", [_alpha_open, _baro_off, _button, _watchdog, _hang])
def test_plain_pulses_behind_a_fault_of_the_board(
    running: InputRig, fault: Callable[[InputRig], float]
) -> None:
    def fly() -> list[str]:
        running.run_to(FAULT_S)
        behind_s = fault(running)
        running.run_to(FAULT_S + 0.5)
        if fault is _hang:
            cycle = running.zero + round((FAULT_S + behind_s) * TICKS_PER_S) * CYCLES_PER_TICK
            mega = [c for c, state in running.relay.contacts if state == 2 and c > cycle]
            return ["the relay is engaged"] if mega or running.relay.engaged else []
        return wrong(running, FAULT_S + behind_s)

    assert in_fork(fly) == []


def test_plain_pulses_within_45_ms_of_a_contact_that_opens(running: InputRig) -> None:
    """Its sense line at 24 instants, spread over two looks and two servo pulses."""

    def fly(at_s: float) -> tuple[list[str], float]:
        running.run_to(at_s)
        running.chip.drive("PH6", True)  # the sense line, as if the contact opened
        running.run_to(at_s + 0.2)
        late = deflected(running.pulses(), running.flight, at_s, near=NEAR_TICKS)
        last_s = float(late.max()) / TICKS_PER_S + SERVO_S - at_s if late.size else 0.0
        return wrong(running, at_s, SENSE_S), last_s

    found = [in_fork(partial(fly, FAULT_S + 0.0017 * k)) for k in range(24)]
    print(f"first plain pulse begins {1000 * max(s for _, s in found):.1f} ms behind it at most")
    assert [said for said, _ in found if said] == []
