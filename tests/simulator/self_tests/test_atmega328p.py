"""The second chip: its vectors, pins and sizes, its TWI as a master, the sensors on its bus."""

from __future__ import annotations

import re
import subprocess
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from simavr_bench import Chip, I2cBus, Image, Magnetometer, Mpu6000
from simavr_bench.log import LogKind, TwiNote

SHIM = Path(__file__).resolve().parents[1] / "shim"
ACK_LINE = (0x08, 0x18, 0x28, 0x10, 0x40, 0x50, 0x58)
BIT = 40  # cycles at 400 kHz


def avr_libc(mcu: str) -> dict[str, str]:
    """Macros of avr/io.h."""
    done = subprocess.run(
        ["avr-gcc", f"-mmcu={mcu}", "-E", "-dM", "-include", "avr/io.h", "-"],
        input="", capture_output=True, text=True, check=True,
    )  # fmt: skip
    return dict(re.findall(r"#define (\w+) (.+)", done.stdout))


@pytest.fixture
def master(build: ModuleType) -> Iterator[tuple[Chip, I2cBus]]:
    """A powered chip that runs twi_master.c, on a bus without anything."""
    chip = Chip(model="atmega328p", startup_s=0.0)
    chip.load(build.build_program("twi_master"))
    bus = I2cBus(chip)
    bus.log_bytes()
    yield chip, bus
    chip.close()


def statuses(chip: Chip) -> tuple[int, ...]:
    """Status of every step of the last exchange."""
    seen = chip.read_array("status_seen", "u1")[: chip.read("steps")]
    return tuple(int(status) for status in seen)


def test_registers_lie_where_those_of_the_atmega2560_do() -> None:
    mega, small = avr_libc("atmega2560"), avr_libc("atmega328p")
    ours = re.findall(r"#define REG_(\w+) 0x", (SHIM / "registers.h").read_text())
    shared = [name for name in ours if name in small]
    assert len(shared) >= 40
    for name in shared:
        assert mega[name].lower() == small[name].lower(), name
    assert {name for name in ours if name not in small} == {
        "TCCR3A", "TCCR4A", "TCCR5A", "RAMPZ", "EICRB", "UCSR1A", "UCSR2A", "UCSR3A", "LAST_IO",
    }  # fmt: skip


def test_vectors_are_those_of_avr_libc() -> None:
    numbers = {
        text: int(value)
        for text, value in re.findall(r"\[(\d+)\] = (\d+)", (SHIM / "model.c").read_text())
    }
    mega, small = avr_libc("atmega2560"), avr_libc("atmega328p")
    renamed = {"USART0_RX": "USART_RX", "USART0_UDRE": "USART_UDRE", "USART0_TX": "USART_TX"}
    checked = 0
    for name, value in mega.items():
        if not name.endswith("_vect_num"):
            continue
        ours = renamed.get(name[:-9], name[:-9]) + "_vect_num"
        if ours in small and not name.startswith(("INT6", "INT7")):
            assert numbers[value] == int(small[ours]), name
            checked += 1
    assert checked >= 24


def test_an_image_too_large_for_the_chip_is_refused(master: tuple[Chip, I2cBus]) -> None:
    chip, _ = master
    with pytest.raises(ValueError, match="the chip has 32768 bytes"):
        chip.load(Image({32_760: bytes(16)}))
    with pytest.raises(ValueError, match="1024"):
        chip.set_eeprom(bytes(4096))
    with pytest.raises(ValueError, match="no model of"):
        Chip(model="atmega168")


def test_interrupts_are_entered_in_four_cycles(master: tuple[Chip, I2cBus]) -> None:
    chip, _ = master
    chip.power_on()
    chip.run_s(0.02)
    chip.clear_statistics()
    chip.run_s(0.1)
    timer = chip.interrupt(14)
    assert timer.count == pytest.approx(100, abs=1)
    # four, and four more out of sleep; the jump of the vector and RETI three and four
    assert (timer.latency_p50, timer.latency_max) == (8, 8)
    assert (timer.length_p50, timer.length_max) == (7, 7)


def test_master_reads_registers_behind_a_repeated_start(master: tuple[Chip, I2cBus]) -> None:
    chip, bus = master
    sensor = Magnetometer(chip, bus)
    chip.power_on()
    chip.run_s(0.01)
    assert statuses(chip) == ACK_LINE
    assert sensor.count == 0  # a magnetometer that got no command stands still
    starts = chip.records(LogKind.TWI, TwiNote.START)["cycle"]
    assert len(starts) == 2
    # SLA+W and a register number, then the repeated START: nineteen bits and what the program takes
    took = int(starts[1] - starts[0])
    assert 19 * BIT < took < 19 * BIT + 250
    assert chip.faults() == []


def test_nobody_answers(master: tuple[Chip, I2cBus]) -> None:
    chip, _ = master
    chip.power_on()
    chip.run_s(0.01)
    assert statuses(chip) == (0x08, 0x20)
    assert chip.read("finished") == 1


@pytest.mark.parametrize(
    ("sda_low", "scl_low", "sda_high", "scl_high", "seen"),
    [
        (True, False, False, False, (0xFF,)),  # the bus is taken: START never comes
        (False, True, False, False, (0xFF,)),
        (False, False, True, False, (0x08, 0x20)),
        (False, False, False, True, (0x08, 0xFF)),  # no clock: the byte never ends
    ],
)
def test_stuck_lines(
    master: tuple[Chip, I2cBus],
    sda_low: bool,
    scl_low: bool,
    sda_high: bool,
    scl_high: bool,
    seen: tuple[int, ...],
) -> None:
    chip, bus = master
    bus.listen(0x1E)
    bus.hold(sda_low=sda_low, scl_low=scl_low, sda_high=sda_high, scl_high=scl_high)
    chip.power_on()
    chip.run_s(0.05)
    assert statuses(chip)[: len(seen)] == seen
    assert chip.level("PC4") is (not sda_low)
    assert chip.level("PC5") is (not scl_low)
    bus.hold()
    chip.run_s(0.01)
    chip.poke(chip.symbols["again"][0], b"\1")
    chip.run_s(0.01)
    assert statuses(chip)[0] in (0x08, 0x10)
    assert statuses(chip)[1] == 0x18


def test_a_line_that_falls_in_a_byte_costs_the_arbitration(master: tuple[Chip, I2cBus]) -> None:
    chip, bus = master
    bus.listen(0x1E)
    chip.power_on()
    while len(chip.records(LogKind.TWI, TwiNote.START)) == 0:
        chip.run_until(chip.cycle + 20)
    bus.hold(sda_low=True)
    chip.run_s(100e-6)
    bus.hold()
    chip.run_s(0.01)
    assert statuses(chip)[:2] == (0x08, 0x38)


def test_a_slave_that_stretches_delays_every_byte(master: tuple[Chip, I2cBus]) -> None:
    chip, bus = master
    bus.listen(0x1E)
    chip.power_on()
    chip.run_s(0.01)
    starts = chip.records(LogKind.TWI, TwiNote.START)["cycle"]
    quick = int(starts[1] - starts[0])
    bus.stretch(100e-6)
    chip.poke(chip.symbols["again"][0], b"\1")
    chip.run_s(0.01)
    starts = chip.records(LogKind.TWI, TwiNote.START)["cycle"]
    # the register number and the repeated START wait behind it
    assert int(starts[3] - starts[2]) - quick == pytest.approx(2 * 1600, abs=16)


def read_motion(rates_radps: float, *, range_bits: int, product_id: int) -> tuple[int, int]:
    """Counts of x rate and x force with a range setting: the registers are written by hand."""
    with Chip(model="atmega328p", startup_s=0.0) as chip:
        mpu = Mpu6000(chip, product_id=product_id, gyro_noise_lsb=0.0, accel_noise_lsb=0.0)
        mpu.motion([0.0], [[rates_radps, 0.0, 0.0]], [[9.80665, 0.0, 0.0]])
        mpu.poke(0x19, 4)
        mpu.poke(0x1A, 2)
        mpu.poke(0x1B, range_bits << 3)
        mpu.poke(0x1C, range_bits << 3)
        mpu.poke(0x38, 1)
        mpu.poke(0x6B, 1)
        chip.run_s(0.5)
        last = mpu.samples()[-1]
        return int(last["rates"][0]), int(last["force"][0])


@pytest.mark.parametrize("range_bits", range(4))
def test_ranges_give_the_datasheets_counts_and_saturate(range_bits: int) -> None:
    rate, force = read_motion(np.deg2rad(100.0), range_bits=range_bits, product_id=0x58)
    assert rate == pytest.approx(100 * 131.072 / 2**range_bits, abs=1)
    assert force == pytest.approx(16384 / 2**range_bits, abs=1)
    rate, force = read_motion(np.deg2rad(3000.0), range_bits=range_bits, product_id=0x54)
    assert rate == 32767
    assert force == pytest.approx(8192 / 2**range_bits, abs=1)


@pytest.mark.parametrize(("dlpf", "delay_us"), [(2, 2800), (3, 4800), (6, 18600)])
def test_low_pass_is_as_late_as_the_datasheet_says(dlpf: int, delay_us: float) -> None:
    with Chip(model="atmega328p", startup_s=0.0) as chip:
        mpu = Mpu6000(chip, gyro_noise_lsb=0.0, jitter_us=0.0)
        slope = 0.5  # rad/s2: a ramp comes out late by the delay
        mpu.motion([0.0, 4.0], [[0.0, 0, 0], [slope * 4, 0, 0]], [[0.0, 0, -9.8]] * 2)
        for number, value in ((0x19, 4), (0x1A, dlpf), (0x1B, 8), (0x38, 1), (0x6B, 1)):
            mpu.poke(number, value)
        chip.run_s(3.0)
        last = mpu.samples()[-1]
        rate_radps = np.deg2rad(int(last["rates"][0]) / 65.536)
        late_us = (int(last["cycle"]) / 16e6 - rate_radps / slope) * 1e6
        assert late_us == pytest.approx(delay_us, abs=300)  # one count is 530 us


def test_samples_come_on_the_sensors_own_clock_with_jitter_that_does_not_add_up() -> None:
    with Chip(model="atmega328p", startup_s=0.0) as chip:
        mpu = Mpu6000(chip, clock_ppm=10_000.0, jitter_us=5.0)
        for number, value in ((0x19, 4), (0x1A, 2), (0x38, 1), (0x6B, 1)):
            mpu.poke(number, value)
        chip.run_s(5.0)
        at = mpu.samples()["cycle"].astype(np.float64) / 16e6
        assert len(at) == pytest.approx(5.0 * 202, abs=3)
        grid = np.polyval(np.polyfit(np.arange(len(at)), at, 1), np.arange(len(at)))
        assert 1.0 < np.max(np.abs(at - grid)) * 1e6 < 6.5
