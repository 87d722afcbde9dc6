"""Fly a row of three axes that teaches one or holds two, and measure the recorder while it runs.

The row is the costliest there is: ten sines on three axes, and the roll axis with all of its
signals; or ten sines on the rudder while aileron and elevator are held. Receivers of 20 and of
14 ms; the card stalls as in the flight without a flight card.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from flight.bench.plan import CYCLES_PER_S, STALL_EVERY_S, STALL_S
from flight.bench.watch import find_symbol
from flight.input_rig import InputRig
from flight.rig import SERVOS, check_card, make_card, take_log
from flight.settings import settings_image
from host.planning.learning_card import SIX_HARMONICS, LearningCondition, learning_card
from host.planning.onboard_sums import ROLL
from host.wire.schema_text import packed_schema
from numpy.typing import NDArray
from owners import find_member
from simavr_bench import Chip

import host
from tests.sitl import flight_cards as cards
from tests.sitl.hold_flight import TILTS_S, hold_flight
from tests.sitl.input_flight import ELEVATOR, TRIGGER_S, UP_S, input_flight

FRAMES_S = (0.020, 0.014)
ROW_S = 12.0
SEED = 31_300
CARD = "inputs.img"
QUIET_S = 0.2
BEHIND_S = 2.5  # the last second's estimates are sent, the last block is written
SURFACES = 3
CYCLES_PER_US, TICKS_PER_US = CYCLES_PER_S // 1_000_000, 2
PAINTED_S, RAM_END = 0.03, 0x2200
PERIOD_CYCLES, ON_ITS_WAY_CYCLES = 20_000 * CYCLES_PER_US, 20 * CYCLES_PER_US
LEARNED_HEAD = b"\xa5\x5a\x12\x0f"  # of frame `learned` on the radio
ROLL_CARD = learning_card("ultrastick25e", ROLL, LearningCondition(17.0, harmonics=SIX_HARMONICS))


def learning_cards(duration_s: float) -> bytes:
    """Return a flight card: ten sines on three axes, and roll to be learned from them."""
    row = cards.row(
        shape=cards.MULTISINE, axes=7, quiet_ms=round(1000 * QUIET_S),
        duration_ms=round(1000 * duration_s), amplitude_us=(100, -80, 120),
        components=[
            byte for k in range(10) for byte in (2 + 3 * k, 25 * k, 64 * (k % 3) + 18)
        ],
    )  # fmt: skip
    return cards.card([row], [ROLL_CARD], [1])


def holding_card(duration_s: float) -> bytes:
    """Return a flight card: ten sines on the rudder, aileron and elevator held."""
    row = cards.row(
        shape=cards.MULTISINE, axes=4 | 3 << 4, quiet_ms=round(1000 * QUIET_S),
        duration_ms=round(1000 * duration_s), amplitude_us=(0, 0, 120),
        components=[byte for k in range(10) for byte in (2 + 3 * k, 25 * k, 64 * 2 + 18)],
    )  # fmt: skip
    return cards.card([row], hold=cards.HOLD)


@dataclass(frozen=True, slots=True)
class InputFigures:
    """What was measured while the row ran.

    Attributes
    ----------
    busy_fraction : float
        Share of the chip's time, from the end of the quiet time to the end of the row.
    width_error_us : NDArray[np.float64], shape (n,)
        Error of every surface pulse of that time against the width commanded as it began.
    deflected_us : float
        From the narrowest to the widest of those of the elevator, whose stick rests.
    held : bool
        Whether the row held bank and pitch, in place of teaching.
    told : int
        Derivatives that were sent by radio.
    untouched_bytes : int
        Bytes of the stack, since power-on.
    frames_lost, stalls : int
    ends : tuple of int
        Reasons of the inputs' ends, from the log.
    """

    rate_hz: int
    frame_s: float
    seconds: float
    busy_fraction: float
    width_error_us: NDArray[np.float64]
    deflected_us: float
    held: bool
    told: int
    untouched_bytes: int
    frames_lost: int
    stalls: int
    ends: tuple[int, ...]


class CommandWatch:
    """Compares each surface pulse on the pins with the width that the firmware asked for.

    The timers take up a width as a pulse begins: what is in the firmware's memory at that
    instant is the command. One that is on its way from there into the timer's register as the
    pulse begins is the next pulse's: then the one that stood there 20 us ago is this one's.

    Attributes
    ----------
    width_us, error_us : list of list of float
        By servo: of every pulse, and how far it is off its command.
    """

    def __init__(self, chip: Chip, elf: Path) -> None:
        place = find_member(elf, "Instrument", "pilot_.sent_ticks_")
        self._chip = chip
        self._address = find_symbol(chip, "g_instrument") + place.offset
        pins = [pin for _, pin in SERVOS.values()][:SURFACES]
        self._begun: list[tuple[int, set[int]] | None] = [None] * SURFACES
        self._before: dict[int, int] = {}
        self.width_us: list[list[float]] = [[] for _ in pins]
        self.error_us: list[list[float]] = [[] for _ in pins]
        for servo, pin in enumerate(pins):
            chip.on_pin(pin, partial(self._see, servo))

    def _see(self, servo: int, level: bool, cycle: int) -> None:
        begun = self._begun[servo]
        if level:
            now = self._command(servo)
            self._begun[servo] = cycle, {now, self._before.get(servo, now)}
            self._chip.at(cycle + PERIOD_CYCLES - ON_ITS_WAY_CYCLES, partial(self._keep, servo))
        elif begun is not None:
            width_us = (cycle - begun[0]) / CYCLES_PER_US
            self.width_us[servo].append(width_us)
            self.error_us[servo].append(
                min(abs(width_us - ticks / TICKS_PER_US) for ticks in begun[1])
            )

    def _keep(self, servo: int) -> None:
        self._before[servo] = self._command(servo)

    def _command(self, servo: int) -> int:
        return int.from_bytes(self._chip.data(self._address + 2 * servo, 2), "little")


def input_rig(
    elf: Path,
    *,
    rate_hz: int,
    frame_s: float,
    duration_s: float,
    folder: Path,
    seed: int = SEED,
    holds: bool = False,
) -> InputRig:
    """Return a rig, switched on, whose flight triggers one row.

    Parameters
    ----------
    elf : Path
        The flight image.
    rate_hz : int
        100 or 200.
    frame_s : float
        Frame of the receiver, channels one after the other.
    duration_s : float
        Length of the row, behind its quiet time; 19.8 at most.
    folder : Path
        Where the card's image goes.
    seed : int
        Seed of the flight.
    holds : bool
        The row holds two axes; behind the sign come the tilts.
    """
    seconds, random = TRIGGER_S + QUIET_S + duration_s + BEHIND_S, np.random.default_rng(seed)
    up_s = UP_S
    if holds:
        flight = hold_flight(seconds + TILTS_S, random, frame_s)
        up_s += TILTS_S
    else:
        flight = input_flight(seconds, random, frame_s)
    flight.width_us[int((up_s + 1.0) / frame_s) :, :3] = 1500
    card = holding_card(duration_s) if holds else learning_cards(duration_s)
    eeprom = bytearray(cards.eeprom_with(card))
    for address, piece in settings_image(rate_hz=rate_hz).eeprom.items():
        eeprom[address : address + len(piece)] = piece
    return InputRig(elf, make_card(folder / CARD), flight, bytes(eeprom))


def fly_input(
    elf: Path,
    *,
    rate_hz: int,
    frame_s: float,
    duration_s: float,
    folder: Path,
    seed: int = SEED,
    holds: bool = False,
) -> InputFigures:
    """Fly one row at one rate of the log, with one receiver; arguments as of :func:`input_rig`."""
    rig = input_rig(
        elf, rate_hz=rate_hz, frame_s=frame_s, duration_s=duration_s, folder=folder, seed=seed,
        holds=holds,
    )  # fmt: skip
    chip = rig.chip
    stack = int(chip.symbols["_end"][0]) & 0xFFFF
    rig.run_to(PAINTED_S)
    painted = chip.data(stack, RAM_END - stack)
    trigger_s = TRIGGER_S + (TILTS_S if holds else 0.0)
    begin_s, end_s = trigger_s + QUIET_S + 0.1, trigger_s + QUIET_S + duration_s
    rig.run_to(begin_s)
    chip.clear_statistics()
    begin = chip.cycle
    stalls_s = np.arange(begin_s + 0.5, end_s - STALL_S[rate_hz], STALL_EVERY_S)
    for at_s in stalls_s:
        cycle = begin + round((at_s - begin_s) * CYCLES_PER_S)
        chip.at(cycle, partial(rig.replay.card.stall, STALL_S[rate_hz], at_cycle=cycle))
    watch = CommandWatch(chip, elf)
    rig.run_to(end_s)
    load, end = chip.load_now(), chip.cycle
    errors = np.concatenate([np.array(of_servo) for of_servo in watch.error_us])
    deflected_us = float(np.ptp(watch.width_us[ELEVATOR]))
    rig.run_to(rig.flight.seconds)
    told = chip.uart_sent(3).count(LEARNED_HEAD)
    # What was taken and left unwritten shows in the stack pointer alone.
    untouched = min(chip.untouched_stack(stack, painted), chip.lowest_sp + 1 - stack)
    chip.power_off()
    chip.close()
    check_card(folder / CARD)
    log = host.read_log(take_log(folder / CARD, folder / "inputs.bin"))
    events = log.frames["event"]
    ended = events["arg"][events["code"] == packed_schema().number("event", "input_end")]
    return InputFigures(
        rate_hz=rate_hz,
        frame_s=frame_s,
        seconds=(end - begin) / CYCLES_PER_S,
        busy_fraction=load.busy_fraction,
        width_error_us=errors,
        deflected_us=deflected_us,
        held=holds,
        told=told,
        untouched_bytes=untouched,
        frames_lost=log.loss.frames,
        stalls=len(stalls_s),
        ends=tuple(int(arg) >> 8 & 0xFF for arg in ended),
    )
