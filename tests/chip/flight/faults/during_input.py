"""The faults again, while the logger flies an input of a card and learns from it.

A row is judged as without an input. Besides: no servo pulse that is neither the pilot's nor the
card's, the travel that the pilot showed never left, plain pulses within the limit where the fault
must end an input, none behind `input_end`, none after a reset.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from flight.faults.model import Fault, Seen
from flight.flown_row import GPS_S, FlownRow, deflected
from host.wire.schema_text import packed_schema

PLAIN_S, SILENT_S = 0.025, 0.030  # the limit; 1.5 frames of the receiver
LAST_S = PLAIN_S - 0.020  # the last deflected pulse: the next of that servo comes 20 ms later
STILL_S = 0.5 + 0.016
RELEASED_S = 0.050
PACKET_S, SCAN_S, MESSAGE_S = 0.010, 0.010, 0.030
CLOCK_S = 0.010  # the Mega's clock starts so late at most


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
    "supply dips to 4.0 V for 100 ms": after(RELEASED_S - LAST_S),
    "watchdog reset": after(RELEASED_S - LAST_S),
    "brown-out reset": after(RELEASED_S - LAST_S),
    "reset button": after(RELEASED_S - LAST_S),
    "main loop hangs": after(RELEASED_S - LAST_S),
    "hangs with interrupts off": after(RELEASED_S - LAST_S),
    "stack overflow": after(RELEASED_S - LAST_S),
    "interrupt storm": after(RELEASED_S - LAST_S),
}


def judge_input(seen: Seen, fault: Fault, row: FlownRow) -> list[str]:
    """Return what is wrong with the input of a flight with a fault."""
    starts = deflected(seen.rig, row)
    wrong = [] if np.count_nonzero(starts < seen.begin) >= 50 else ["no input was seen"]
    last_s = (starts.max(initial=0) - seen.begin) / 16e6
    if fault.injected in MUST_END:
        known_s = MUST_END[fault.injected](seen)
        if not last_s <= known_s + LAST_S:
            wrong.append(f"deflected {1e3 * last_s:.0f} ms behind, known {1e3 * known_s:.0f} ms")
    for ended in seen.events_of("input_end"):
        behind_s = last_s - (ended.t_us / 1e6 - seen.begin / 16e6 + CLOCK_S)
        if behind_s > LAST_S:
            wrong.append(f"deflected {1e3 * behind_s:.0f} ms behind input_end")
    if seen.events_of("input_start"):
        wrong.append("another input began")
    return wrong


def how_it_ended(seen: Seen, row: FlownRow) -> str:
    """Return why, by the log, and when the last deflected pulse began."""
    names = {value: name for name, value in packed_schema().enums["input_end"].items()}
    ends = seen.events_of("input_end")
    why = names.get(ends[0].arg >> 8 & 255, "?") if ends else "no end reported"
    last_ms = (deflected(seen.rig, row).max(initial=0) - seen.begin) / 16e3
    return f"{why}, last {last_ms:.0f} ms behind"
