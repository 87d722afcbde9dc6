"""The board's hal against its contracts, every peripheral at work at once."""

from __future__ import annotations

import struct
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
import pytest

if TYPE_CHECKING:
    from simavr_bench import Chip

MakeProbe = Callable[[], "Chip"]

MS = 16_000
US = 16
EECR = 0x3F
LINES = [f"PK{bit}" for bit in range(5)]


def poke_u16(chip: Chip, symbol: str, values: list[int]) -> None:
    """Write 16-bit variables of the probe."""
    chip.poke(chip.symbols[symbol][0], struct.pack(f"<{len(values)}H", *values))


def poke_u8(chip: Chip, symbol: str, value: int) -> None:
    """Write a byte of the probe."""
    chip.poke(chip.symbols[symbol][0], bytes([value]))


def make_busy(chip: Chip, duration_s: float, rng: np.random.Generator) -> None:
    """Load the chip: scans at 200 Hz, IMU packets, GPS and radio bytes."""
    poke_u8(chip, "scan_period_ms", 5)
    poke_u8(chip, "chatter", 1)
    start = chip.cycle
    for packet in range(int(duration_s * 200)):
        at = start + packet * 5 * MS + int(rng.integers(2 * MS))
        chip.twi_send(43, bytes(rng.integers(0, 256, 36, dtype=np.uint8)), at_cycle=at, scl_hz=4e5)
    chip.uart_send(2, bytes(int(duration_s * 3000)), baud=38400)


def drive_receiver(
    chip: Chip,
    frame_us: float,
    duration_s: float,
    *,
    simultaneous: bool,
    skew_us: float,
    rng: np.random.Generator,
) -> list[list[int]]:
    """Give all five channels random pulses; returns widths in cycles per channel."""
    widths: list[list[int]] = [[] for _ in LINES]
    start = chip.cycle + MS
    for frame in range(int(duration_s * 1e6 / frame_us)):
        at = start + round(frame * frame_us * US)
        for channel, line in enumerate(LINES):
            width = int(rng.integers(1000 * US, 2000 * US))
            begin = at + round(skew_us * US * channel) if simultaneous else at
            chip.drive(line, True, at_cycle=begin)
            chip.drive(line, False, at_cycle=begin + width)
            widths[channel].append(width)
            if not simultaneous:
                at = begin + width + 4 * US
    return widths


def measured_widths(chip: Chip) -> list[list[int]]:
    """Pulse widths in ticks as the probe's edges give them, per channel."""
    count = min(chip.read("edges"), 512)
    ticks = chip.read_array("edge_ticks", "<u2")[:count]
    levels = chip.read_array("edge_levels", "u1")[:count]
    rise: dict[int, int] = {}
    widths: list[list[int]] = [[] for _ in LINES]
    before = 0
    for tick, level in zip(ticks.tolist(), levels.tolist(), strict=True):
        changed = before ^ level
        for channel in range(5):
            if changed >> channel & 1:
                if level >> channel & 1:
                    rise[channel] = tick
                elif channel in rise:
                    widths[channel].append((tick - rise.pop(channel)) & 0xFFFF)
        before = level
    return widths


@pytest.mark.parametrize(
    ("frame_us", "simultaneous", "skew_us"),
    [(22_500, False, 0.0), (14_000, True, 0.0), (20_000, True, 3.0), (14_000, True, 30.0)],
)
def test_pulses_are_measured_within_4_us_under_load(
    make_probe: MakeProbe, frame_us: float, simultaneous: bool, skew_us: float
) -> None:
    rng = np.random.default_rng(1)
    chip = make_probe()
    make_busy(chip, 0.6, rng)
    truth = drive_receiver(chip, frame_us, 0.6, simultaneous=simultaneous, skew_us=skew_us, rng=rng)
    chip.run_s(0.65)
    seen = measured_widths(chip)
    assert chip.read("edges_lost") == 0
    assert chip.read("scans") > 100
    assert chip.read("packets") > 100
    errors_us = []
    for channel in range(5):
        assert len(seen[channel]) == len(truth[channel])
        for ticks, width in zip(seen[channel], truth[channel], strict=True):
            errors_us.append(ticks / 2 - width / US)
    assert np.max(np.abs(errors_us)) <= 4.0
    assert np.percentile(np.abs(errors_us), 99) <= 3.0


def test_storm_masks_the_bank_and_the_loop_goes_on(make_probe: MakeProbe) -> None:
    chip = make_probe()
    before = chip.read("turns")
    for edge in range(20_000):  # 100 kHz for 200 ms
        chip.drive("PK0", edge % 2 == 0, at_cycle=chip.cycle + edge * 160)
    chip.run_s(0.22)
    assert chip.read("turns") - before > 180
    taken = chip.read("edges")
    assert taken < 400
    chip.run_s(0.03)
    chip.drive("PK1", True)
    chip.run_s(0.0015)
    chip.drive("PK1", False)
    chip.run_s(0.005)
    assert chip.read("edges") == taken + 2


def test_edge_at_the_millisecond_does_not_mask_the_bank_for_good(make_probe: MakeProbe) -> None:
    # The 25th edge of a millisecond masks the bank until 20 ticks have passed. Put it at every
    # cycle around the tick that looks at the count and resets it: none may leave the bank masked.
    chip = make_probe()
    guard = chip.symbols["capture_guard"][0]
    for edge in range(5):
        chip.drive("PK0", edge % 2 == 0, at_cycle=chip.cycle + 100 + edge * 320)
    chip.run_until(chip.cycle + 100 + 5 * 320)
    while chip.data(guard, 1) != b"\0":
        chip.run_until(chip.cycle + 1)
    reset_at = chip.cycle
    level = True
    for trial, offset in enumerate(range(-40, 20), start=1):
        at = reset_at + trial * 32 * MS + offset
        for before in (*range(24, 0, -1), 0):
            level = not level
            chip.drive("PK0", level, at_cycle=at - before * 320)
    chip.run_until(reset_at + 61 * 32 * MS)
    taken = chip.read("edges")
    chip.drive("PK1", True)
    chip.run_s(0.0015)
    chip.drive("PK1", False)
    chip.run_s(0.005)
    assert chip.read("edges") == taken + 2


def servo_pulses(chip: Chip, pin: str) -> tuple[list[int], list[int]]:
    """Widths and starts of whole pulses, in cycles."""
    at, level = chip.edges(pin)
    starts = [int(c) for c, v in zip(at, level, strict=True) if v]
    ends = [int(c) for c, v in zip(at, level, strict=True) if not v]
    ends = [end for end in ends if starts and end > starts[0]]
    return [e - s for s, e in zip(starts, ends, strict=False)], starts


SERVO_PINS = ["PE4", "PE5", "PB5", "PE3"]


def test_servo_pulses_are_exact_and_never_cut(make_probe: MakeProbe) -> None:
    rng = np.random.default_rng(2)
    chip = make_probe()
    chip.watch(*SERVO_PINS)
    make_busy(chip, 1.0, rng)
    programmed: list[set[int]] = [set() for _ in SERVO_PINS]
    for _ in range(60):
        wanted = [int(w) for w in rng.integers(2000, 4000, 4)]
        if rng.random() < 0.3:
            wanted[int(rng.integers(4))] = 0
        for output, width in enumerate(wanted):
            programmed[output].add(width * 8)
        poke_u16(chip, "servo_wanted", wanted)
        chip.run_s(float(rng.uniform(0.002, 0.03)))
    poke_u16(chip, "servo_wanted", [0, 0, 0, 0])
    chip.run_s(0.05)
    for output, pin in enumerate(SERVO_PINS):
        widths, starts = servo_pulses(chip, pin)
        assert len(widths) > 15
        assert set(widths) <= programmed[output]
        gaps = np.diff(starts)
        assert np.all(gaps % 320_000 == 0)
        assert not chip.level(pin)


def test_first_pulse_is_whole(make_probe: MakeProbe) -> None:
    chip = make_probe()
    chip.watch(*SERVO_PINS)
    poke_u16(chip, "servo_wanted", [3000, 3100, 3200, 2000])
    chip.run_s(0.05)
    for pin, width in zip(SERVO_PINS, [3000, 3100, 3200, 2000], strict=True):
        widths, _ = servo_pulses(chip, pin)
        assert set(widths) == {width * 8}


CHANNELS = [1, 5, 2, 6, 3, 4, 7, 13, 0, 14, 15]


def test_scan_gives_every_channel_its_slot(make_probe: MakeProbe) -> None:
    chip = make_probe()
    for slot, channel in enumerate(CHANNELS):
        chip.analog(channel, 5.0 * (60 + 83 * slot + 0.5) / 1024)
    poke_u8(chip, "scan_period_ms", 5)
    chip.run_s(0.05)
    sums = chip.read_array("scan_sums", "<u2")
    assert sums.tolist() == [4 * (60 + 83 * slot) for slot in range(11)]


def test_conversions_happen_when_the_schema_says(make_probe: MakeProbe) -> None:
    chip = make_probe()
    make_busy(chip, 0.5, np.random.default_rng(3))
    # The probe notes its clock once a turn: the least age of many looks is that of a fresh note.
    ages = []
    for _ in range(200):
        chip.run_s(0.00083)
        ages.append(chip.cycle - chip.read("clock_us") * US)
    clock_zero = min(ages)
    begin = chip.cycle
    for channel in CHANNELS:  # a count is 98 us of this ramp
        chip.analog_profile(channel, [begin, begin + 100 * MS], [0.0, 5.0])
    chip.run_s(0.04)
    scans = chip.read("scans")
    while chip.read("scans") == scans:
        chip.run_s(0.0001)
    start_cycle = chip.read("scan_start_us") * US + clock_zero
    scans = chip.read("scans")
    while start_cycle < begin or chip.read("scans") == scans:
        chip.run_s(0.0001)
        if chip.read("scans") == scans:
            start_cycle = chip.read("scan_start_us") * US + clock_zero
    sums = chip.read_array("scan_sums", "<u2").astype(float)
    for slot, total in enumerate(sums):
        mean_us = ((total / 4 + 0.5) / 1024 * 100 * MS + begin - start_cycle) / US
        assert mean_us == pytest.approx(1728 + 104 * slot, abs=100)


def test_supply_is_measured_once_a_second(make_probe: MakeProbe) -> None:
    chip = make_probe()
    chip.analog_supply(4.8)
    poke_u8(chip, "scan_period_ms", 5)
    chip.run_s(1.4)
    assert chip.read("supply_mv") == pytest.approx(4800, abs=25)


def test_reference_is_shown_only_when_it_has_settled(make_probe: MakeProbe) -> None:
    chip = make_probe()
    chip.analog_supply(4.8)
    chip.analog(15, 2.5)  # half the servo rail: the converter holds it when the reference is chosen
    poke_u8(chip, "scan_period_ms", 5)
    shown = set()
    for _ in range(70_000):
        chip.run_until(chip.cycle + 20 * US)
        shown.add(chip.read("adc_bandgap"))
    assert shown == {0, int(1.1 * 1024 / 4.8)}


def test_supply_that_never_ends_costs_no_scan(make_probe: MakeProbe) -> None:
    chip = make_probe()
    for slot, channel in enumerate(CHANNELS):
        chip.analog(channel, 5.0 * (60 + 83 * slot + 0.5) / 1024)
    poke_u8(chip, "scan_period_ms", 5)
    poke_u8(chip, "watch", 1)
    chip.run_s(1.4)
    assert chip.read("supply_mv") == pytest.approx(5000, abs=25)
    chip.analog_stick(0x1E)
    before = chip.read("scans")
    chip.run_s(1.5)
    assert chip.read("scans") - before >= 295
    assert chip.read("supply_mv") == 0  # unknown, not the last one for ever
    assert chip.read("reset_was") == 1  # power-on: the watchdog was fed all the time
    sums = chip.read_array("scan_sums", "<u2")
    assert sums.tolist() == [4 * (60 + 83 * slot) for slot in range(11)]
    chip.analog_stick()
    chip.run_s(1.4)
    assert chip.read("supply_mv") == pytest.approx(5000, abs=25)


def test_eeprom_that_stays_busy_reads_as_erased(make_probe: MakeProbe) -> None:
    chip = make_probe()
    poke_u8(chip, "wipe_eeprom", 0x5A)
    chip.run_s(0.01)
    chip.poke(EECR, b"\x02")  # EEPE, and no write that would end
    chip.poke(chip.symbols["read_eeprom_busy"][0], b"\1")
    before = chip.read("turns")
    chip.run_s(0.1)
    assert chip.read("eeprom_byte") == 0xFF
    assert chip.read("turns") - before >= 10


def test_packets_arrive_whole_with_their_address_and_time(make_probe: MakeProbe) -> None:
    chip = make_probe()
    poke_u8(chip, "chatter", 1)
    sent = [(43, bytes(range(36))), (42, bytes(range(100, 132))), (27, bytes(range(50, 82)))]
    begin = chip.cycle
    for k, (address, data) in enumerate(sent):
        chip.twi_send(address, data, at_cycle=begin + k * 5 * MS, scl_hz=4e5)
    chip.run_s(0.02)
    assert chip.read("packets") == 3
    for k, (address, data) in enumerate(sent):
        assert chip.read_array("packet_address", "u1")[k] == address
        assert chip.read_array("packet_length", "u1")[k] == len(data)
        held = bytes(chip.read_array("packet_bytes", "u1")[k * 40 : k * 40 + len(data)])
        assert held == data
    starts = chip.read_array("packet_start_us", "<u4").astype(np.int64)[:3]
    assert np.diff(starts).tolist() == pytest.approx([5000, 5000], abs=20)


@pytest.mark.parametrize("dies", [1, 2, 3])
def test_master_that_dies_costs_its_packet_only(make_probe: MakeProbe, dies: int) -> None:
    chip = make_probe()
    chip.twi_send(43, bytes(36), at_cycle=chip.cycle + MS, scl_hz=4e5, dies=dies, dies_after=10)
    before = chip.read("turns")
    chip.run_s(0.05)
    assert chip.read("turns") - before > 45
    chip.twi_hold(sda=False, scl=False)
    count = chip.read("packets")
    for _ in range(2):
        chip.twi_send(43, bytes(range(36)), scl_hz=4e5)
        chip.run_s(0.01)
    assert chip.read("packets") >= count + 1


def test_gps_bytes_survive_the_load(make_probe: MakeProbe) -> None:
    rng = np.random.default_rng(4)
    chip = make_probe()
    make_busy(chip, 0.0, rng)
    drive_receiver(chip, 14_000, 0.1, simultaneous=True, skew_us=0.0, rng=rng)
    data = bytes(rng.integers(0, 256, 250, dtype=np.uint8))
    chip.uart_send(2, data, baud=38400)
    chip.run_s(0.1)
    assert chip.read("gps_count") == 250
    assert bytes(chip.read_array("gps_bytes", "u1")[:250]) == data
    assert chip.read("gps_lost") == 0
    assert chip.uart_lost(2) == 0
    sent = chip.uart_sent(3)
    assert len(sent) > 900  # 11111 bytes a second


@pytest.mark.parametrize("how", [1, 2])
def test_hang_resets_and_leaves_its_address(make_probe: MakeProbe, how: int) -> None:
    chip = make_probe()
    poke_u8(chip, "watch", 1)
    chip.run_s(0.6)
    assert chip.read("reset_was") == 1  # power-on
    poke_u8(chip, "hang", how)
    chip.run_s(0.8)
    if how == 1:
        assert chip.read("reset_was") == 5  # crash
        first, size = chip.symbols["main"]
        assert first <= chip.read("crashed_at") < first + size
    else:
        assert chip.read("reset_was") == 4  # interrupts off: the watchdog alone


def test_edges_wait_at_most_2_us_for_other_interrupts(make_probe: MakeProbe) -> None:
    rng = np.random.default_rng(5)
    chip = make_probe()
    make_busy(chip, 1.0, rng)
    drive_receiver(chip, 14_000, 1.0, simultaneous=False, skew_us=0.0, rng=rng)
    chip.clear_statistics()
    chip.run_s(1.0)
    capture = chip.interrupt(11)
    assert capture.count > 400
    assert capture.latency_max <= 5 + 32 + 4  # entry, 2 us, end of the instruction and wake-up
    assert capture.length_max <= 140  # two edges 4 us apart


def test_eeprom_byte_is_written_in_the_background(make_probe: MakeProbe) -> None:
    chip = make_probe()
    poke_u8(chip, "wipe_eeprom", 0x5A)
    chip.run_s(0.01)
    assert chip.eeprom()[7] == 0x5A
    assert chip.read("eeprom_byte") == 0x5A
