"""The pilot keeps control whatever the Mega does, judged behind the modelled relay."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
from flight.servos import (
    LONGEST_GAP_MS,
    MS,
    SERVOS,
    cuts_allowed,
    released_ms,
    spoiled,
    worst_gap_ms,
)

import host

if TYPE_CHECKING:
    from flight.rig import FlightRig

MakeRig = Callable[..., "FlightRig"]

# Written over the first instruction of hal::now_us(), which every turn of the main loop calls.
HANG = b"\xff\xcf"  # rjmp to itself
HANG_WITHOUT_INTERRUPTS = b"\xf8\x94\xff\xcf"  # cli before it
RECURSE = b"\xff\xdf"  # rcall to itself: the stack grows through all of RAM
STS_PINH = 0x100
ALL_TASKS = 0b111  # of app/pilot_link.h


def patch(rig: FlightRig, address: int, code: bytes) -> None:
    """Overwrite program memory."""
    from simavr_bench import Image

    rig.chip.load(Image({address: code}))


def watch_fault(
    rig: FlightRig, fault: Callable[[], None], run_s: float = 0.5
) -> tuple[float, float, int]:
    """Inject a fault; give release and worst gap in ms, spoiled pulses beyond the relay's cuts."""
    since = rig.chip.cycle
    fault()
    rig.chip.run_s(run_s)
    extra = max(spoiled(rig, since, servo) - cuts_allowed(rig, since) for servo in SERVOS)
    return released_ms(rig, since), worst_gap_ms(rig, since), extra


def test_flying_rig_drives_through_the_mega(flying: FlightRig) -> None:
    from simavr_bench import in_fork

    def look() -> tuple[bool, float, int]:
        since = flying.chip.cycle
        flying.chip.run_s(1.0)
        worst = max(spoiled(flying, since, servo) for servo in SERVOS)
        return flying.relay.engaged, worst_gap_ms(flying, since), worst

    engaged, gap, extra = in_fork(look)
    assert engaged
    assert gap == pytest.approx(20.0, abs=1.0)
    assert extra == 0


@pytest.mark.parametrize("code", [HANG, HANG_WITHOUT_INTERRUPTS, RECURSE])
def test_program_that_hangs_lets_go_within_50_ms(flying: FlightRig, code: bytes) -> None:
    from simavr_bench import in_fork

    now_us = flying.chip.symbols["_ZN3hal6now_usEv"][0]
    release, gap, extra = in_fork(
        lambda: watch_fault(flying, lambda: patch(flying, now_us, code), run_s=0.2)
    )
    assert release <= 50
    assert gap <= LONGEST_GAP_MS
    assert extra <= 0


@pytest.mark.parametrize(
    ("frame_s", "sequential"), [(0.014, True), (0.014, False), (0.0225, True), (0.0225, False)]
)
def test_pulses_reach_the_servos_whenever_the_program_hangs(
    make_rig: MakeRig, frame_s: float, sequential: bool
) -> None:
    """Every receiver timing, any phase of its frame; interrupts off is the longest wait."""
    from simavr_bench import in_fork

    rig = make_rig(frame_s=frame_s, sequential=sequential)
    rig.take_off()
    assert rig.relay.engaged
    now_us = rig.chip.symbols["_ZN3hal6now_usEv"][0]

    def end(wait_s: float) -> tuple[float, float, int]:
        rig.chip.run_s(wait_s)
        return watch_fault(rig, lambda: patch(rig, now_us, HANG_WITHOUT_INTERRUPTS), run_s=0.2)

    for part in range(5):
        release, gap, extra = in_fork(partial(end, 0.05 + frame_s * part / 5))
        assert release <= 50
        assert gap <= LONGEST_GAP_MS
        assert extra <= 0


def test_task_that_does_not_report_lets_go_within_50_ms(flying: FlightRig) -> None:
    """The proof of life asks for one task more than there are; all else runs on."""
    from simavr_bench import in_fork

    chip = flying.chip
    start, size = next(v for k, v in chip.symbols.items() if "12g_instrumentE" in k)
    memory = chip.data(start, size)
    now_us = chip.cycle // 16
    gates = [
        at
        for at in range(size - 6)
        if memory[at] == ALL_TASKS
        and memory[at + 1] <= ALL_TASKS
        and 0 <= now_us - int.from_bytes(memory[at + 2 : at + 6], "little") < 20_000
    ]
    assert len(gates) == 1  # core::HealthGate: required tasks, reported tasks, time of the beat
    release, gap, extra = in_fork(
        lambda: watch_fault(
            flying, lambda: chip.poke(start + gates[0], bytes([2 * ALL_TASKS + 1])), run_s=0.2
        )
    )
    assert release <= 50
    assert gap <= LONGEST_GAP_MS
    assert extra <= 0


@pytest.mark.parametrize("level", [True, False])
def test_stuck_heartbeat_lets_go_within_50_ms(flying: FlightRig, level: bool) -> None:
    from simavr_bench import in_fork

    start, size = flying.chip.symbols["_ZN3app9PilotLink4beatERNS_6OutletEm"]
    code = np.frombuffer(flying.chip.flash(start, size), "<u2")
    stores = np.flatnonzero((code[:-1] & 0xFE0F == 0x9200) & (code[1:] == STS_PINH))
    assert len(stores) == 1

    def stick() -> None:
        while flying.chip.level("PH5") != level:
            flying.chip.run_s(0.0001)
        patch(flying, start + 2 * int(stores[0]), b"\0\0\0\0")

    release, gap, extra = in_fork(lambda: watch_fault(flying, stick))
    assert release <= 50
    assert gap <= LONGEST_GAP_MS
    assert extra <= 0


@pytest.mark.parametrize("cause", ["WATCHDOG", "BROWN_OUT", "EXTERNAL"])
def test_reset_lets_go_and_the_mega_comes_back_behind_the_receiver(
    flying: FlightRig, cause: str
) -> None:
    from simavr_bench import ResetCause, in_fork

    def run() -> tuple[float, float, int, bool, float]:
        flying.chip.watch("PE4")
        since = flying.chip.cycle
        release, gap, extra = watch_fault(
            flying, lambda: flying.chip.reset(ResetCause[cause]), run_s=1.5
        )
        at, level = flying.chip.edges("PE4")
        again = at[(level == 1) & (at > since)]
        assert len(again) > 0
        # the switch still says Mega: it must be seen at direct first
        return release, gap, extra, flying.relay.engaged, (int(again[0]) - since) / MS

    release, gap, extra, engaged, outputs_ms = in_fork(run)
    assert release <= 50
    assert gap <= LONGEST_GAP_MS
    assert extra <= 0
    assert not engaged
    assert outputs_ms < 500


@pytest.mark.parametrize("sequential", [True, False])
def test_lost_receiver_lets_go_within_100_ms(flying: FlightRig, sequential: bool) -> None:
    from simavr_bench import in_fork

    def run() -> tuple[float, int]:
        flying.receiver.sequential = sequential
        flying.chip.run_s(0.3)
        assert flying.relay.engaged
        flying.receiver.lost = True
        flying.chip.run_s(0.4)
        since = max(end for _, _, end in flying.receiver.sent)  # the worst phase of a loss
        release = released_ms(flying, since)
        # no pulses come, so none may be made up: nothing but repeats, none after 100 ms
        late = [
            int(pulses[-1, 0]) - since
            for pulses in (flying.relay.servo_pulses(servo) for servo in SERVOS)
        ]
        return release, max(late) // MS

    release, last_pulse_ms = in_fork(run)
    assert release <= 100
    assert last_pulse_ms <= 100


@pytest.mark.parametrize(
    ("width_us", "limit_ms"), [(None, 110.0), (800.5, 100.0), (1500.0, 100.0), (1000.0, 100.0)]
)
def test_switch_that_is_not_at_mega_is_direct(
    flying: FlightRig, width_us: float | None, limit_ms: float
) -> None:
    from simavr_bench import in_fork

    def move() -> None:
        if width_us is None:
            flying.receiver.lost_channels.add(4)
        else:
            flying.receiver.width_us[4] = width_us

    release, gap, extra = in_fork(lambda: watch_fault(flying, move))
    assert release <= limit_ms
    assert gap <= LONGEST_GAP_MS
    assert extra <= 0


def test_storm_on_a_receiver_pin_is_bounded_and_lets_go(flying: FlightRig) -> None:
    from simavr_bench import in_fork

    def run() -> tuple[float, float, float]:
        since = flying.chip.cycle
        flying.chip.clear_statistics()
        flying.receiver.noise(0, at_cycle=since + MS, time_s=0.4, rate_hz=100_000)
        flying.chip.run_s(0.45)
        load = flying.chip.load_now().busy_fraction
        gap = worst_gap_ms(flying, since, servos=("elevator", "rudder", "throttle"))
        return released_ms(flying, since), gap, load

    release, gap, load = in_fork(run)
    assert release <= 50
    assert gap <= LONGEST_GAP_MS
    assert load < 0.6


@pytest.mark.parametrize("hold_ms", [300, 1000])
def test_hold_keeps_surfaces_only_and_no_longer_than_asked(make_rig: MakeRig, hold_ms: int) -> None:
    from flight.settings import settings_image

    rig = make_rig()
    rig.chip.load(settings_image(hold_ms=hold_ms))
    rig.take_off()
    assert rig.relay.engaged
    last = {servo: rig.relay.servo_pulses(servo)[-1] for servo in SERVOS}
    rig.receiver.lost = True
    rig.chip.run_s(hold_ms / 1000 + 0.3)
    since = max(end for _, _, end in rig.receiver.sent)
    assert hold_ms <= released_ms(rig, since) <= hold_ms + 100
    for servo in SERVOS:
        pulses = rig.relay.servo_pulses(servo)
        held = pulses[pulses[:, 0] > since + 120 * MS]
        if servo == "throttle":
            assert len(held) == 0
        else:
            assert len(held) >= (hold_ms - 150) // 20 - 2
            width = int(last[servo][1] - last[servo][0])
            assert np.all(np.abs(held[:-1, 1] - held[:-1, 0] - width) <= 80)


def test_engages_only_behind_direct_and_then_mega(make_rig: MakeRig) -> None:
    from flight.rig import DIRECT_US, MEGA_US

    rig = make_rig()
    rig.receiver.width_us[4] = MEGA_US
    rig.power_on()
    rig.chip.run_s(2.0)
    assert all(state != 2 for _, state in rig.relay.contacts)
    assert worst_gap_ms(rig, 60 * MS) <= LONGEST_GAP_MS
    assert max(spoiled(rig, 0, servo) for servo in SERVOS) == 0
    rig.receiver.width_us[4] = DIRECT_US
    rig.chip.run_s(0.4)
    assert all(state != 2 for _, state in rig.relay.contacts)
    rig.receiver.width_us[4] = MEGA_US
    since = rig.chip.cycle
    rig.chip.run_s(0.6)
    assert rig.relay.engaged
    assert worst_gap_ms(rig, since) <= LONGEST_GAP_MS
    assert max(spoiled(rig, since, servo) for servo in SERVOS) <= 1


@pytest.mark.parametrize("trouble", ["supply", "receiver"])
def test_does_not_engage_without_self_test_or_pulses(make_rig: MakeRig, trouble: str) -> None:
    """A supply of 4.4 V from power-on; a receiver that is silent, then comes with the switch up."""
    from flight.rig import DIRECT_US, MEGA_US
    from flight.settings import reference_image

    rig = make_rig()
    if trouble == "supply":
        rig.chip.load(reference_image(1100))
        rig.chip.analog_supply(4.4)
    else:
        rig.receiver.lost = True
    rig.power_on()
    rig.chip.run_s(1.5)
    rig.receiver.lost = False
    rig.receiver.width_us[4] = MEGA_US
    rig.chip.run_s(1.0)
    if trouble == "supply":
        rig.receiver.width_us[4] = DIRECT_US
        rig.chip.run_s(0.5)
        rig.receiver.width_us[4] = MEGA_US
        rig.chip.run_s(0.5)
    assert all(state != 2 for _, state in rig.relay.contacts)
    assert max(spoiled(rig, 0, servo) for servo in SERVOS) == 0


def test_outputs_repeat_the_receiver_within_half_a_second_of_the_start(make_rig: MakeRig) -> None:
    rig = make_rig()
    rig.chip.watch("PE4", "PE5", "PB5", "PE3")
    rig.power_on()
    rig.chip.run_s(0.6)
    for channel, pin in enumerate(("PE4", "PE5", "PB5", "PE3")):
        at, level = rig.chip.edges(pin)
        at = at.astype(np.int64)
        rises, falls = at[level == 1], at[level == 0]
        falls = falls[falls > rises[0]]
        assert rises[0] < 500 * MS
        wanted = rig.receiver.width_us[channel] * 16
        widths = falls[: len(rises)] - rises[: len(falls)]
        assert np.all(np.abs(widths - wanted) <= 80)  # the first one too: no twitch


def test_reset_in_flight_goes_through_the_bootloader_and_records_again(
    make_rig: MakeRig, tmp_path: Path
) -> None:
    """The watchdog's reset starts Debian's real bootloader: the receiver drives meanwhile."""
    from flight.rig import take_log
    from simavr_bench import ResetCause

    rig = make_rig(bootloader=True)
    rig.take_off(ground_s=15.0)
    assert rig.relay.engaged
    since = rig.chip.cycle
    written = rig.card.count().written
    rig.chip.reset(ResetCause.WATCHDOG)
    application = 0
    while application == 0 and rig.chip.cycle < since + 4 * 16_000_000:
        rig.chip.run_s(0.01)
        application = rig.chip.cycle * (rig.chip.pc < 0x3E000 and rig.chip.state == "running")
    assert application
    rig.chip.run_s(2.0)
    assert rig.card.count().written > written
    assert not rig.relay.engaged
    # The bootloader clears the register: what memory lost is a power-on, the rest unknown.
    log = host.read_log(take_log(rig.card_image, tmp_path / "flight.bin"))
    assert [int(cause) for cause in log.frames["identity"]["reset_cause"]] == [1, 0]
    assert released_ms(rig, since) <= 50
    assert worst_gap_ms(rig, since) <= LONGEST_GAP_MS
    assert max(spoiled(rig, since, servo) for servo in SERVOS) <= 1


def test_crash_and_flight_are_remembered_through_the_bootloader(
    make_rig: MakeRig, tmp_path: Path
) -> None:
    """A hang in a glide: its address and the mark of a flight outlive the bootloader's own RAM."""
    from flight.rig import IDLE_US, take_log

    rig = make_rig(bootloader=True)
    rig.take_off(ground_s=15.0)
    rig.receiver.width_us[3] = IDLE_US
    rig.chip.run_s(0.5)
    start, size = rig.chip.symbols["_ZN3hal6now_usEv"]
    right = rig.chip.flash(start, len(HANG))
    patch(rig, start, HANG)
    rig.chip.run_s(0.2)
    assert rig.chip.pc >= 0x3E000
    patch(rig, start, right)
    while rig.chip.pc >= 0x3E000:
        rig.chip.run_s(0.01)
    written = rig.card.count().written
    rig.chip.run_s(2.0)
    assert rig.card.count().written > written
    rig.land()
    log = host.read_log(take_log(rig.card_image, tmp_path / "flight.bin"))
    identity = log.frames["identity"]
    assert identity["reset_cause"].tolist() == [1, 5]
    assert identity["resumed"].tolist() == [0, 1]
    crashes = log.frames["event"][
        log.frames["event"]["code"] == log.schema.number("event", "crash")
    ]
    assert len(crashes) == 1
    assert start <= int(crashes["arg"][0]) < start + size


def test_bootloader_leaves_the_servos_to_the_receiver(make_rig: MakeRig) -> None:
    rig = make_rig(bootloader=True)
    rig.receiver.width_us[4] = 1900.0
    rig.power_on()
    rig.chip.run_s(0.1)
    in_bootloader = 0
    while rig.chip.cycle < 2.5 * 16e6:
        rig.chip.run_s(0.05)
        if rig.chip.pc >= 0x3E000:
            in_bootloader += 1
            assert not rig.chip.is_output("PH5")
    assert in_bootloader >= 5
    assert rig.chip.pc < 0x3E000  # the application runs
    assert all(state != 2 for _, state in rig.relay.contacts)
    assert worst_gap_ms(rig, 60 * MS) <= LONGEST_GAP_MS
    assert max(spoiled(rig, 0, servo) for servo in SERVOS) == 0
