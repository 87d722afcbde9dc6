"""When the analogue scan of a frame begins: at the STOP of its IMU packet, whatever the main loop
does."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
from numpy.typing import NDArray

import host

if TYPE_CHECKING:
    from flight.rig import FlightRig

MakeRig = Callable[..., "FlightRig"]

CYCLES_PER_US = 16
TURN_CYCLES = 65536 * 8  # of timer 5
OVERFLOW_VECTOR = 50
ADCSRA = 0x7A
GPIOR2 = 0x4B  # conversions of the scan still to come (boards/mega2560/analog_input.cpp)
TRIGGERED, FRESH = 0x2000, 0x0400
LONGEST_US = 40.0  # from STOP to the start of the scan


def clock_zero(rig: FlightRig) -> int:
    """Cycle at which the Mega's clock was zero, from the overflows of its timer."""
    from simavr_bench.log import LogKind

    rig.chip.log_interrupts(True)
    rig.chip.run_s(0.5)
    rig.chip.log_interrupts(False)
    entered = rig.chip.records(LogKind.INTERRUPT, OVERFLOW_VECTOR)
    cycles = entered["cycle"][entered["value"] == 1].astype(np.int64)
    assert len(cycles) > 10
    return int((cycles % TURN_CYCLES).min())


def stop_cycles(rig: FlightRig) -> dict[int, int]:
    """Cycle of the STOP of each packet that is over, by packet number."""
    from simavr_bench.log import LogKind, TwiNote

    over = rig.chip.records(LogKind.TWI, TwiNote.DONE)
    return {int(r["value"]) >> 8: int(r["cycle"]) for r in over}


@dataclass(frozen=True, slots=True)
class Flown:
    """Frames of six seconds of flight, the cycle of the clock's zero, STOP by packet number."""

    ident: NDArray[np.void]
    zero: int
    stops: dict[int, int]


def after_stop_us(rig: FlightRig, flown: Flown, which: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Time from the STOP of the packet whose sample a frame holds to its t_us, shape (n,)."""
    by_value = {s.sample.rates[0]: s for s in rig.imu.sent}
    late = []
    for row in flown.ident[which]:
        sent = by_value[int(row["p"])]
        assert int(row["imu_seq"]) == sent.sequence
        assert int(row["q"]) == sent.sample.rates[1]
        stop_us = (flown.stops[sent.packets[0]] - flown.zero) / CYCLES_PER_US
        late.append(int(row["t_us"]) - stop_us)
    return np.array(late)


def fly(rig: FlightRig, rate_hz: int, folder: Path) -> Flown:
    """Record six seconds of flight at a rate."""
    from flight.rig import take_log
    from flight.settings import settings_image

    rig.chip.load(settings_image(rate_hz=rate_hz))
    rig.take_off()
    zero = clock_zero(rig)
    begin_us = (rig.chip.cycle - zero) / CYCLES_PER_US
    rig.chip.run_s(6.0)
    stops = stop_cycles(rig)
    rig.land()
    ident = host.read_log(take_log(rig.card_image, folder / "flight.bin")).frames["ident"]
    return Flown(ident[ident["t_us"] > begin_us], zero, stops)


@pytest.mark.parametrize(("imu_hz", "rate_hz"), [(100.0, 100), (200.0, 100), (200.0, 200)])
def test_scan_begins_with_the_stop_of_its_packet(
    make_rig: MakeRig, tmp_path: Path, imu_hz: float, rate_hz: int
) -> None:
    rig = make_rig(imu_hz=imu_hz)
    flown = fly(rig, rate_hz, tmp_path)
    ident = flown.ident
    assert len(ident) > 5 * rate_hz
    assert np.all(ident["valid"] & (TRIGGERED | FRESH) == TRIGGERED | FRESH)
    assert np.all(np.diff(ident["imu_seq"].astype(np.uint8)) == round(imu_hz / rate_hz))
    late_us = after_stop_us(rig, flown, np.full(len(ident), True))
    assert late_us.min() > 0.0
    assert late_us.max() <= LONGEST_US


def test_damaged_packets_leave_no_frame_with_a_wrong_time(
    make_rig: MakeRig, tmp_path: Path
) -> None:
    rig = make_rig(imu_hz=200.0)
    rig.imu.flip_fraction = 0.1
    rig.imu.short_fraction = 0.05
    flown = fly(rig, 100, tmp_path)
    ident = flown.ident
    fresh = (ident["valid"] & FRESH) != 0
    assert 0.7 < float(fresh.mean()) < 0.99
    triggered = (ident["valid"] & TRIGGERED) != 0
    late_us = after_stop_us(rig, flown, fresh & triggered)
    # The frame of a damaged packet holds the sample of the one before it, 5 ms older.
    assert late_us.min() > 0.0
    assert late_us.max() <= 5000.0 + LONGEST_US
    assert float(np.mean(late_us <= LONGEST_US)) > 0.8
    gaps_us = np.diff(ident["t_us"].astype(np.int64))
    assert gaps_us.min() > 4_576  # never two scans at a time
    assert gaps_us.max() < 17_500  # the timer's 1.5 periods and a turn of the loop
    assert float(np.mean(np.abs(gaps_us - 10_000) < 100)) > 0.8


def test_packets_that_meet_the_end_of_a_scan_do_not_stop_the_next(
    make_rig: MakeRig, tmp_path: Path
) -> None:
    # A scan takes 4.59 ms; packets every 4.61 ms end at any instant around its last interrupt.
    rig = make_rig(imu_hz=217.0)
    rig.imu.clock_ppm = 300.0
    flown = fly(rig, 200, tmp_path)
    gaps_us = np.diff(flown.ident["t_us"].astype(np.int64))
    assert len(flown.ident) > 6 * 190
    assert gaps_us.max() < 12_000
    assert gaps_us.min() > 4_576
    # Some begin at once, those that find the converter busy at a turn of the main loop.
    after_start_us = flown.ident["imu_age"] * 4.0 - rig.imu.delay_us
    at_once = after_start_us < 1_000
    assert after_start_us.min() > 900
    assert 0.1 < float(at_once.mean()) < 1.0


def test_converter_that_was_disturbed_is_started_anew(flying: FlightRig, tmp_path: Path) -> None:
    from simavr_bench import in_fork

    in_fork(partial(disturb_converter, flying, tmp_path))


def disturb_converter(rig: FlightRig, folder: Path) -> None:
    """Switch the converter off in the middle of a scan and look at the log."""
    from flight.rig import take_log

    rig.chip.run_s(1.0)
    while rig.chip.data(GPIOR2, 1)[0] != 20:
        rig.chip.run_s(0.00005)
    rig.chip.poke(ADCSRA, b"\x00")
    rig.chip.run_s(1.0)
    rig.chip.power_off()
    log = host.read_log(take_log(rig.save_card(folder / "card.img"), folder / "flight.bin"))
    ident = log.frames["ident"]
    gaps_us = np.diff(ident["t_us"].astype(np.int64))
    # The scan that ended in nothing costs its frame the analogue values, and nobody else anything.
    assert len(ident) > 150
    assert gaps_us.max() < 12_000
    analogue = (ident["valid"] & 0x3FF) == 0x3FF
    lost = np.flatnonzero(~analogue)
    assert 1 <= len(lost) <= 2
    assert np.all((ident["valid"][lost] & 0x3FF) == 0)
    assert np.all((ident["valid"][lost] >> 10) & 1 == 1)
