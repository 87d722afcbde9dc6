"""Fly the image through all eight receivers and keep everything that can be judged."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from devices.ardu_imu import SentSample
from flight.bench.plan import (
    BUSY_S,
    CYCLES_PER_S,
    IMU_DELAY_US,
    IMU_FLAGS,
    IMU_HZ,
    IMU_PPM,
    RAMP_SLOTS,
    RECEIVERS,
    SETTLE_S,
    STALL_S,
    Profile,
    ReceiverKind,
    Sticks,
    imu_aux,
    ramp,
    stalls,
    steps,
)
from flight.bench.watch import ReceiverWatch, StallScript, clock_zero, find_symbol, read_word
from flight.rig import ANALOG_CHANNELS, CRUISE_US, DIRECT_US, MEGA_US, SERVOS, FlightRig, make_card
from flight.settings import settings_image
from numpy.typing import NDArray
from simavr_bench import Chip
from simavr_bench.log import CardNote, LogKind
from simavr_bench.loop_probe import LoopProbe, LoopTimes
from simavr_bench.sd_card import CardCount
from simavr_bench.statistics import CpuLoad, VectorStatistics

FLYING = 0x464C5921  # boards/mega2560/system.cpp: the mark of a session under way
LAST_S = 1.5  # at the end: what may still have been in the ring when the battery was pulled
FIELDS = 10  # analogue fields of the identification frame; the last slot is the servo rail
VECTORS = range(1, 57)


class FlightError(RuntimeError):
    """The flight did not come about; the text says why."""


@dataclass(frozen=True, slots=True)
class Leg:
    """The judged part of the flight with one receiver."""

    receiver: ReceiverKind
    begin: int
    end: int
    engaged: bool  # the relay, all the time


@dataclass(frozen=True, slots=True)
class Flight:
    """Everything measured in one flight; cycles are those of the simulation."""

    rate_hz: int
    seconds: float
    cpu_s: float
    begin: int
    end: int
    zero: int  # cycle at which the firmware's clock showed 0
    card_image: Path
    legs: tuple[Leg, ...]
    load: CpuLoad
    vectors: dict[int, VectorStatistics]
    loop: LoopTimes
    pulses_sent: dict[int, NDArray[np.int64]]  # by receiver line: first, last cycle
    pulses_accepted: NDArray[np.int64]  # as in ReceiverWatch
    servo_pulses: dict[int, NDArray[np.int64]]  # by channel: first, last cycle
    samples_sent: list[SentSample]
    profiles: tuple[Profile, ...]
    card: CardCount
    stalls: int
    stalls_in_schema: int
    stalls_of_resends: int
    ring_bytes: int
    faults: int


def fly(
    elf: Path,
    *,
    rate_hz: int,
    minutes: float,
    folder: Path,
    seed: int = 1,
    ground_s: float = 12.0,
    receivers: tuple[ReceiverKind, ...] = RECEIVERS,
) -> Flight:
    """Fly one rate; the card's image stays in the folder.

    Parameters
    ----------
    elf : Path
        The flight image.
    rate_hz : int
        100 or 200.
    minutes : float
        Simulated time with the Mega driving, shared by the receivers.
    folder : Path
        Where the card's image goes.
    seed : int
        For stalls, sticks and steps.
    ground_s : float
        From power on to throttle.
    receivers : tuple of ReceiverKind
        Flown one after the other.

    Raises
    ------
    FlightError
        If no session starts.
    """
    began, began_cpu = time.perf_counter(), time.process_time()
    rng = np.random.default_rng(seed)
    card_image = make_card(folder / f"card{rate_hz}.img")
    rig = FlightRig(
        elf,
        card_image,
        imu_hz=float(IMU_HZ),
        busy_s=BUSY_S,
        frame_s=receivers[0].true_frame_s,
        sequential=receivers[0].sequential,
    )
    rig.imu.flags, rig.imu.aux_source = IMU_FLAGS, imu_aux
    rig.imu.delay_us, rig.imu.clock_ppm = IMU_DELAY_US, IMU_PPM
    chip = rig.chip
    chip.load(settings_image(rate_hz=rate_hz))
    zero = _begin_session(rig, ground_s)
    begin = chip.cycle
    end = begin + round(minutes * 60 * CYCLES_PER_S)
    script = StallScript(chip, rig.card, elf, rate_hz, stalls(rate_hz, begin, end, rng))
    profiles = _drive_inputs(chip, begin, end, rng)
    sticks = Sticks(seed)
    rig.receiver.source = sticks
    chip.watch(*(pin for _, pin in SERVOS.values()))
    watch = ReceiverWatch(chip, elf)
    watch.start()
    probe = LoopProbe(chip)
    chip.clear_statistics()
    written = rig.card.count()

    legs = []
    length = (end - begin) // len(receivers)
    for number, kind in enumerate(receivers):
        _change_receiver(rig, sticks, kind)
        judged = chip.cycle
        since = len(rig.relay.contacts)
        engaged = rig.relay.engaged
        for now in _slices(judged, begin + (number + 1) * length):
            chip.run_until(now)
            _progress(rate_hz, now - begin, end - begin, time.perf_counter() - began)
        still = all(state == 2 for _, state in rig.relay.contacts[since:])
        legs.append(Leg(kind, judged, chip.cycle, engaged and still))
    watch.stop()

    servo = {channel: _pulses(chip, pin) for channel, (_, pin) in enumerate(SERVOS.values())}
    count = rig.card.count()
    flight = Flight(
        rate_hz=rate_hz,
        seconds=(chip.cycle - begin) / CYCLES_PER_S,
        cpu_s=time.process_time() - began_cpu,
        begin=begin,
        end=chip.cycle,
        zero=zero,
        card_image=card_image,
        legs=tuple(legs),
        load=chip.load_now(),
        vectors={number: chip.interrupt(number) for number in VECTORS},
        loop=probe.times(),
        pulses_sent={channel: rig.receiver.pulses(channel) for channel in range(5)},
        pulses_accepted=watch.rows(),
        servo_pulses=servo,
        # a lower rate takes the samples whose number divides
        samples_sent=[s for s in rig.imu.sent if s.sequence % (IMU_HZ // rate_hz) == 0],
        profiles=profiles,
        card=CardCount(
            commands=count.commands,
            written=count.written - written.written,
            read=count.read,
            rejected=count.rejected,
            lost=count.lost,
            bytes_ignored=count.bytes_ignored,
            erased=count.erased,
        ),
        stalls=len(script.made),
        stalls_in_schema=script.in_schema,
        stalls_of_resends=_stalled_resends(rig, script.made, rate_hz),
        ring_bytes=read_word(chip, elf, "ring_.capacity_"),
        faults=len(chip.faults()),
    )
    rig.land()
    return flight


def _begin_session(rig: FlightRig, ground_s: float) -> int:
    """Power on, find the clock, throttle up; gives the cycle of the clock's zero."""
    chip = rig.chip
    rig.power_on()
    chip.run_s(ground_s)
    zero = clock_zero(chip)
    mark = find_symbol(chip, "g_flight_mark")
    rig.receiver.width_us[3] = CRUISE_US
    for _ in range(3000):
        chip.run_s(0.001)
        if int.from_bytes(chip.data(mark, 4), "little") == FLYING:
            break
    else:
        raise FlightError("no session started within 3 s of throttle; `host status` would say why")
    rig.receiver.width_us[4] = MEGA_US
    chip.run_s(1.0)
    return zero


def _drive_inputs(
    chip: Chip, begin: int, end: int, rng: np.random.Generator
) -> tuple[Profile, ...]:
    profiles = []
    for slot in range(FIELDS):
        profile = ramp(begin, end, slot) if slot in RAMP_SLOTS else steps(begin, end, rng)
        channel = ANALOG_CHANNELS[slot]
        chip.analog(channel, 1.0)  # without noise: what is put in is known to a count
        chip.analog_profile(channel, profile.cycles, profile.volts)
        profiles.append(profile)
    return tuple(profiles)


def _change_receiver(rig: FlightRig, sticks: Sticks, kind: ReceiverKind) -> None:
    """Hand over to the pilot, change the receiver, hand back."""
    sticks.switch_us = DIRECT_US
    rig.chip.run_s(0.2)
    rig.receiver.frame_s, rig.receiver.sequential = kind.true_frame_s, kind.sequential
    rig.chip.run_s(1.3)
    sticks.switch_us = MEGA_US
    rig.chip.run_s(SETTLE_S - 1.5)


def _slices(begin: int, end: int) -> Iterator[int]:
    """Cycles once a second, the last one the end."""
    yield from range(begin + CYCLES_PER_S, end, CYCLES_PER_S)
    yield end


def _pulses(chip: Chip, pin: str) -> NDArray[np.int64]:
    at, level = chip.edges(pin)
    at = at.astype(np.int64)
    rising = np.flatnonzero(level[:-1] == 1)
    return np.column_stack((at[rising], at[rising + 1]))


def _stalled_resends(rig: FlightRig, stalled: list[int], rate_hz: int) -> int:
    """How many stalls hit a block that was sent again."""
    records = rig.chip.records(LogKind.CARD, CardNote.WRITTEN)
    rejected = set(rig.chip.records(LogKind.CARD, CardNote.REJECTED)["value"].tolist())
    # the first block accepted behind the plan is programmed for as long as the stall
    behind = np.array(stalled, np.uint64) + np.uint64(STALL_S[rate_hz] * CYCLES_PER_S)
    at = np.searchsorted(records["cycle"], behind)
    return sum(int(block) in rejected for block in records["value"][at[at < len(records)]])


def _progress(rate_hz: int, done: int, whole: int, wall_s: float) -> None:
    if not sys.stderr.isatty():
        return
    part = min(1.0, done / whole)
    bar = "#" * round(30 * part)
    speed = done / CYCLES_PER_S / wall_s if wall_s > 0 else 0.0
    ending = "\n" if part >= 1.0 else ""
    sys.stderr.write(f"\r{rate_hz} Hz [{bar:30}] {100 * part:3.0f} %, {speed:.1f}x{ending}")
    sys.stderr.flush()
