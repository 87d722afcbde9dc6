"""The faults again, while the logger flies an input of a card and learns from it.

A row is judged as without an input. Beside that: no servo pulse that is neither the pilot's nor the
card's, the travel that the pilot showed never left, plain pulses within the limit where the fault
must end an input, none behind `input_end`, none after a reset.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from flight.faults.model import Fault, Seen
from flight.rig import DIRECT_US, FlightRig, make_card
from flight.servos import SERVOS, strange
from flight.settings import reference_image
from host.planning.learning_card import SIX_HARMONICS, LearningCondition, learning_card
from host.sysid.estimators.onboard_sums import ROLL
from host.wire.framing import EnvelopeReader
from host.wire.schema_text import packed_schema
from numpy.typing import NDArray
from simavr_bench import Image, cycles
from simavr_bench.card_journal import CardJournal

from tests.sitl import flight_cards as cards
from tests.sitl.input_flight import ARMED_US, LEAST_US, MEGA_US, MOST_US
from tests.sitl.input_judge import slewed
from tests.sitl.input_shapes import shape_of

QUIET_S, BEFORE_S = 0.2, 1.5  # of the row; flown of it before a fault
SHOWN_S, SIGN_S = 1.0, 3.4
GROUND_S = 12.0 + 5.0 * SHOWN_S + SIGN_S
HIGH_US = 1790.0  # the elevator's stick: 60 us below its end, so that the row is cut there
CLIMB_UP = 300 * 8  # 900 Pa of the pressure sensor
MOVES_UP, MOVES_1E7 = 64, 8  # what a sensor that is alive does by itself
WIDE = {
    "dp_min": 600, "dp_max": 4000, "alpha_min": 100, "alpha_max": 4000, "beta_min": 100,
    "beta_max": 4000, "phi_max": 18000, "theta_min": -18000, "theta_max": 18000, "p_max": 32767,
    "q_max": 32767, "r_max": 32767, "az_min": -32768, "az_max": 32767, "height_max_pa": 6000,
}  # fmt: skip
ROW = cards.row(
    shape=cards.MULTISINE, axes=7, quiet_ms=200, duration_ms=19_000, amplitude_us=(100, -80, 120),
    components=[byte for k in range(10) for byte in (20 + 4 * k, 25 * k, 64 * (k % 3) + 60)],
)  # fmt: skip
LEARNED = learning_card("ultrastick25e", ROLL, LearningCondition(17.0, harmonics=SIX_HARMONICS))

PLAIN_S, SILENT_S = 0.025, 0.030  # the limit; 1.5 frames of the receiver
STILL_S = 0.5 + 0.016
RELEASED_S = 0.050
PACKET_S, SCAN_S, GPS_S, MESSAGE_S = 0.010, 0.010, 0.2, 0.030
CLOCK_S = 0.010  # the Mega's clock starts so late at most
SPREAD_MS = 85  # a servo period, whole ticks of the rate, and that clock
NEAR = 80 * 1.6  # cycles: the relay's own judge takes 5 us, and 3 us of a command's steps


def told(*names: str) -> Callable[[Seen], float]:
    """Make a rule: the firmware knows it with the first of these events, s since the fault."""

    def known_s(seen: Seen) -> float:
        at = [event.t_us for name in names for event in seen.events_of(name)]
        return min(at) / 1e6 - seen.begin / 16e6 + CLOCK_S if at else float("nan")

    return known_s


def after(seconds: float) -> Callable[[Seen], float]:
    """Make a rule: the firmware can know it so long after the fault began."""
    return lambda seen: seconds


def gps_is_old(seen: Seen) -> float:
    """Give when the last row of the GPS, of its first byte, is a second old."""
    at = seen.log.frames["gps"]["t_us"].astype(np.int64) / 1e6 - seen.begin / 16e6
    return float(at[at < GPS_S].max()) + MESSAGE_S + GPS_SILENT + CLOCK_S


CARD_STOPS = told("frames_dropped", "card_removed", "card_error")
IMU_SILENT, BARO_SILENT, GPS_SILENT = 0.030 + PACKET_S, 0.150, 1.0
# When the firmware can know of a fault that must end an input; behind it plain within PLAIN_S.
MUST_END: dict[str, Callable[[Seen], float]] = {
    "card busy 1.2 s": CARD_STOPS,
    "card busy 4 s": CARD_STOPS,
    "card's line low for 4 s": CARD_STOPS,
    "card pulled, put back": CARD_STOPS,
    "card pulled for good": after(1.0),
    "every block refused for 3 s": CARD_STOPS,
    "SPI switched off in its register": CARD_STOPS,
    "IMU dies, lets lines go": after(IMU_SILENT),
    "IMU dies holding SDA": after(IMU_SILENT),
    "IMU dies holding SCL": after(IMU_SILENT),
    "IMU silent": after(IMU_SILENT),
    "IMU reset in flight": after(IMU_SILENT),
    "gyro saturated": after(2 * PACKET_S),
    "pressure bus SDA low": after(BARO_SILENT),
    "pressure bus SCL low": after(BARO_SILENT),
    "pressure sensor silent": after(BARO_SILENT),
    "pressure words 0xFFFF": after(BARO_SILENT),
    "pressure words 0": after(BARO_SILENT),
    "pressure stuck at 0": after(BARO_SILENT),
    "two vanes at 0 V": after(2 * SCAN_S),
    "two vanes at 5 V": after(2 * SCAN_S),
    "pitot ports swapped": after(STILL_S + SCAN_S),
    "pitots blocked": after(STILL_S + SCAN_S),
    "no conversion ever ends": after(0.100 + SCAN_S),
    "rudder channel lost": after(SILENT_S),
    "all channels lost": after(SILENT_S),
    "failsafe pulses: switch 920 us": after(0.030),
    "noise of 10 kHz on aileron": after(SILENT_S + 0.020),
    "storm of 100 kHz on aileron": after(SILENT_S + 0.020),
    "supply sags to 4.4 V": told("drive_changed"),
    "GPS silent": gps_is_old,
    "GPS sends garbage": gps_is_old,
    "GPS at 100 deg N, 200 deg E": after(2 * GPS_S),
    "GPS loses its fix": after(2 * GPS_S),
    "GPS back at 9600 baud, NMEA": gps_is_old,
    # The relay lets go: what the timers repeat meanwhile reaches nobody behind it.
    "supply dips to 4.0 V for 100 ms": after(RELEASED_S - PLAIN_S),
    "watchdog reset": after(RELEASED_S - PLAIN_S),
    "brown-out reset": after(RELEASED_S - PLAIN_S),
    "reset button": after(RELEASED_S - PLAIN_S),
    "main loop hangs": after(RELEASED_S - PLAIN_S),
    "hangs with interrupts off": after(RELEASED_S - PLAIN_S),
    "stack overflow": after(RELEASED_S - PLAIN_S),
    "interrupt storm": after(RELEASED_S - PLAIN_S),
}


@dataclass(frozen=True, slots=True)
class FlownRow:
    """The row that is flown when a fault begins.

    Attributes
    ----------
    start : int
        Cycle of its trigger, by the log's clock.
    deflection : NDArray[np.float64], shape (ms, 3)
        Cycles, from the beginning of the shape.
    """

    start: int
    deflection: NDArray[np.float64]

    def made(self, channel: int, start: int, width: int, sticks: NDArray[np.int64]) -> bool:
        """Tell whether a pulse may be a late stick's and what the card asks for about then."""
        within = 16 * LEAST_US - NEAR <= width <= 16 * MOST_US + NEAR
        ms = round((start - self.start) / 16e3 - 1e3 * QUIET_S)
        if channel >= self.deflection.shape[1] or not within or ms < 0:
            return False
        asked = self.deflection[max(0, ms - SPREAD_MS) : ms + 2, channel]
        if not asked.size:
            return False
        low, high = min(0.0, asked.min()), max(0.0, asked.max())
        return bool(np.any((width - sticks >= low - NEAR) & (width - sticks <= high + NEAR)))


def input_rig(
    elf: Path, folder: Path, *, threshold_volt: float | None = None
) -> tuple[FlightRig, CardJournal, FlownRow]:
    """Bring a rig into the middle of a row, its card in private pages and journalled."""
    card = make_card(folder / "empty.img")
    rig = FlightRig(elf, card, in_place=False, threshold_volt=threshold_volt, ground_s=GROUND_S)
    own = cards.card([ROW], [LEARNED], [1], **WIDE)
    rig.chip.load(
        Image(flash={}, eeprom={cards.VALID_AT: cards.eeprom_with(own)[cards.VALID_AT :]})
    )
    rig.chip.load(reference_image(1100))
    journal = CardJournal(rig.card)
    _keep_alive(rig)
    _show(rig)
    rig.baro.raw_pressure -= CLIMB_UP
    for width_us, seconds in ((MEGA_US, 0.8), (ARMED_US, 0.3 + QUIET_S + BEFORE_S)):
        rig.receiver.width_us[4] = width_us
        rig.chip.run_s(seconds)
    started_us = _events(rig, "input_start")
    if len(started_us) != 1:
        raise AssertionError(f"no input began: {started_us}")
    shape = 8.0 * slewed(shape_of(ROW), cards.HEAD["rate_max_usps"])
    return rig, journal, FlownRow(16 * started_us[0], shape)


def _keep_alive(rig: FlightRig) -> None:
    """Let pressure and position move a little, as those of an aircraft do."""
    baro = rig.baro

    def pressure(cycle: int) -> tuple[int, int]:
        moved = MOVES_UP * (cycle // cycles(0.1) % 2)
        raw = baro.raw_pressure
        return baro.raw_temperature, raw and raw & ~MOVES_UP | moved

    def drift() -> None:
        rig.gps.longitude_1e7 ^= MOVES_1E7
        rig.chip.at(rig.chip.cycle + cycles(GPS_S), drift)

    baro.source = pressure
    drift()


def _show(rig: FlightRig) -> None:
    """Power on, show the sticks' travel, give the sign that enables the card, take off."""
    width_us = rig.receiver.width_us
    rig.power_on()
    rig.chip.run_s(10.0)
    for place_us in (LEAST_US, 1500.0, MOST_US, 1500.0):
        width_us[:3] = [float(place_us)] * 3
        rig.chip.run_s(SHOWN_S)
    width_us[0], width_us[2] = float(MOST_US), float(LEAST_US)
    rig.chip.run_s(SIGN_S)
    width_us[:] = [1500.0, HIGH_US, 1500.0, width_us[3], DIRECT_US]
    rig.chip.run_s(rig.ground_s - rig.chip.cycle / 16e6 + 1.0)
    width_us[3] = 1500.0
    rig.chip.run_s(3.0)


def _events(rig: FlightRig, name: str) -> list[int]:
    """Return the times (us) of an event, by what the radio sent of it."""
    schema = packed_schema()
    frame, code = schema.by_name["event"], schema.enums["event"][name]
    found = []
    for data in EnvelopeReader().feed(rig.chip.uart_sent(3)):
        if data[0] == frame.id:
            row = np.frombuffer(data, frame.dtype)[0]
            found += [int(row["t_us"])] if int(row["code"]) == code else []
    return found


def judge_input(seen: Seen, fault: Fault, row: FlownRow) -> list[str]:
    """Return what is wrong with the input of a flight with a fault."""
    starts = deflected(seen, row)
    wrong = [] if np.count_nonzero(starts < seen.begin) >= 50 else ["no input was seen"]
    last_s = (starts.max(initial=0) - seen.begin) / 16e6
    if fault.injected in MUST_END:
        known_s = MUST_END[fault.injected](seen)
        if not last_s <= known_s + PLAIN_S:
            wrong.append(f"deflected {1e3 * last_s:.0f} ms behind, known {1e3 * known_s:.0f} ms")
    for ended in seen.events_of("input_end"):
        behind_s = last_s - (ended.t_us / 1e6 - seen.begin / 16e6 + CLOCK_S)
        if behind_s > PLAIN_S:
            wrong.append(f"deflected {1e3 * behind_s:.0f} ms behind input_end")
    if seen.events_of("input_start"):
        wrong.append("another input began")
    return wrong


def deflected(seen: Seen, row: FlownRow) -> NDArray[np.int64]:
    """Return the starts (cycles) of pulses at the servos that the card made."""
    starts = [
        start
        for channel, servo in enumerate(SERVOS)
        for start, width, sticks in strange(seen.rig, row.start, servo)
        if row.made(channel, start, width, sticks)
    ]
    return np.array(starts, dtype=np.int64)


def how_it_ended(seen: Seen, row: FlownRow) -> str:
    """Return why, by the log, and when the last deflected pulse began."""
    names = {value: name for name, value in packed_schema().enums["input_end"].items()}
    ends = seen.events_of("input_end")
    why = names.get(ends[0].arg >> 8 & 255, "?") if ends else "no end told"
    last_ms = (deflected(seen, row).max(initial=0) - seen.begin) / 16e3
    return f"{why}, last {last_ms:.0f} ms behind"
