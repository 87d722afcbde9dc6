"""One test per peripheral that Debian's library models wrongly, against the datasheet's value."""

from __future__ import annotations

import numpy as np
import pytest
from simavr_bench import Chip, cycles
from simavr_bench.log import LogKind, pulses, select
from simavr_bench.testing import MakeChip, run_until_value

UDRE0, RX1, TIMER1_OVF = 26, 36, 20


def run_to(chip: Chip, value: int = 1) -> None:
    run_until_value(chip, "finished", value)


@pytest.mark.parametrize(("pin", "bank"), [("PK0", 1), ("PK2", 1), ("PB0", 0)])
def test_pin_change_stamps_a_pulse_exactly(make_chip: MakeChip, pin: str, bank: int) -> None:
    chip = make_chip("pulses")
    for name in ("PK0", "PK2", "PB0"):
        chip.drive(name, False)
    chip.run_s(1e-3)
    rng = np.random.default_rng(3)
    widths = rng.integers(900 * 16, 2100 * 16, 20)
    at = cycles(0.01) + 5
    for width in widths:
        chip.drive(pin, True, at_cycle=at)
        chip.drive(pin, False, at_cycle=at + int(width))
        at += cycles(0.005)
    chip.run_s(0.2)
    stamps = chip.read_array("stamp", "<u2").reshape(2, 64)[bank][:40].astype(int)
    seen = (stamps[1::2] - stamps[0::2]) & 0xFFFF
    assert np.all(np.abs(seen - widths / 8) <= 1.0)
    assert chip.interrupt(11 if bank else 9).count == 40


def test_masked_pins_of_a_bank_stay_silent(make_chip: MakeChip) -> None:
    chip = make_chip("pulses")
    chip.run_s(1e-3)
    chip.drive("PK1", True)
    chip.drive("PB1", True)
    chip.drive("PJ0", True)
    chip.run_s(1e-3)
    assert list(chip.read_array("count", "u1")) == [0, 0]


def test_converter_reads_sixteen_channels_exactly(make_chip: MakeChip) -> None:
    chip = make_chip("adc", power=False)
    volts = np.linspace(0.02, 4.98, 16)
    for channel, volt in enumerate(volts):
        chip.analog(channel, float(volt))
    chip.power_on()
    run_to(chip)
    expected = np.floor(volts * 1024 / 5.0).astype(int)
    assert list(chip.read_array("code", "<u2")[:16]) == list(expected)
    assert chip.read("by_interrupt") == expected[13]
    assert chip.read("unsettled") == expected[15]  # the capacitor still has the channel before
    assert chip.read_array("code", "<u2")[16] == int(1.1 * 1024 / 5.0)
    assert chip.read_array("code", "<u2")[17] == 0


def test_converter_latches_the_channel_at_the_start(make_chip: MakeChip) -> None:
    chip = make_chip("adc", power=False)
    for channel, volt in ((1, 1.0), (2, 2.0), (3, 3.0)):
        chip.analog(channel, volt)
    chip.power_on()
    run_to(chip)
    assert chip.read("latched") == int(1.0 * 1024 / 5)
    assert chip.read("still_set") == 0x10
    assert chip.read("after_write") == 0


def test_converter_takes_13_clocks_and_25_the_first_time(make_chip: MakeChip) -> None:
    chip = make_chip("adc")
    run_to(chip)
    # up to one ADC clock (128 cycles) to the start, up to 20 cycles of the program
    assert 25 * 128 <= chip.read("first_cycles") <= 26 * 128 + 20
    assert 13 * 128 <= chip.read("next_cycles") <= 14 * 128 + 20
    chip.run_s(1e-3)
    before = chip.adc_conversions
    chip.run_s(0.1)
    assert chip.adc_conversions - before == pytest.approx(0.1 * 16e6 / (13 * 128), abs=1)


def test_converter_samples_a_ramp_at_its_hold_instant(make_chip: MakeChip) -> None:
    chip = make_chip("adc", power=False)
    chip.analog_profile(4, [0, cycles(1.0)], [0.0, 5.0])
    chip.power_on()
    run_to(chip)
    chip.run_s(0.1)
    # 13 clocks of 8 us pass from hold to the next hold: the newest result is at most that old
    now = chip.time_s * 1024
    assert now - 0.25 < chip.read("by_interrupt") + 1 <= now + 1


def test_spi_byte_takes_eight_bits(make_chip: MakeChip) -> None:
    chip = make_chip("spi")
    run_to(chip)
    seen = chip.read_array("byte_cycles", "<u2").astype(int)
    # 8 x 2, 4, 16, 128 cycles and what the polling loop adds (about 20, in steps of 5)
    assert np.all(seen - 8 * np.array([2, 4, 16, 128]) >= 0)
    assert np.all(seen - 8 * np.array([2, 4, 16, 128]) <= 30)
    assert chip.read("read_back") == 0xFF


@pytest.mark.parametrize("ss_high", [True, False])
def test_spi_collision_flags_and_mode_fault(make_chip: MakeChip, ss_high: bool) -> None:
    chip = make_chip("spi")
    run_to(chip)
    chip.drive("PB0", ss_high)
    assert chip.read("collision") == 0x40
    assert chip.read("after_clear") == 0
    assert chip.read("interrupts") == 1
    chip.drive("PA0", True)
    run_to(chip, 2)
    assert chip.read("mode_fault") == int(not ss_high)


def test_uart_byte_is_ten_bits(make_chip: MakeChip) -> None:
    chip = make_chip("uart")
    run_to(chip)
    sent = select(chip.log(), LogKind.UART_TX, 0)
    assert list(sent["value"]) == [0x55, 0xAA]
    bit = 17 * 8
    assert int(sent["cycle"][1]) - int(sent["cycle"][0]) == 10 * bit
    assert chip.read("udre_cycles") == pytest.approx(10 * bit, abs=30)
    assert chip.read("txc_cycles") == pytest.approx(20 * bit, abs=40)


def test_uart_overrun_keeps_two_and_takes_the_third(make_chip: MakeChip) -> None:
    chip = make_chip("uart")
    run_to(chip)
    chip.uart_send(1, b"ABCDEF", baud=38461.5)
    chip.run_s(0.01)
    # A, B in the buffer; C, D, E each lost to the next start bit; F waits
    assert chip.uart_lost(1) == 3
    chip.poke(chip.symbols["go"][0], b"\1")
    chip.run_s(1e-3)
    assert bytes(chip.read_array("got", "u1")[:3]) == b"ABF"
    assert list(chip.read_array("flags", "u1")[:3]) == [0, 0, 0x08]


def test_uart_three_unread_bytes_are_not_lost(make_chip: MakeChip) -> None:
    chip = make_chip("uart")
    run_to(chip)
    chip.uart_send(1, b"ABC", baud=38461.5)
    chip.run_s(0.01)
    assert chip.uart_lost(1) == 0
    chip.poke(chip.symbols["go"][0], b"\1")
    chip.run_s(1e-3)
    assert bytes(chip.read_array("got", "u1")[:3]) == b"ABC"


@pytest.mark.parametrize(
    ("baud", "right"), [(38400, True), (37300, True), (39700, True), (9600, False), (57600, False)]
)
def test_uart_hears_only_its_own_baud_rate(make_chip: MakeChip, baud: int, right: bool) -> None:
    chip = make_chip("uart")
    run_to(chip)
    text = b"UBX"
    heard = bytearray()
    for byte in text:
        chip.uart_send(1, bytes([byte]), baud=baud)
        chip.run_s(0.003)
        chip.poke(chip.symbols["go"][0], b"\1")
        chip.run_s(1e-4)
    heard += bytes(chip.read_array("got", "u1")[: min(8, chip.read("got_count"))])
    assert (bytes(heard) == text) is right


def test_uart_takes_no_spike_for_a_start_bit(make_chip: MakeChip) -> None:
    chip = make_chip("uart")
    run_to(chip)
    chip.uart_send(1, b"\xff", baud=20 * 38461.5)  # low for a twentieth of a bit
    chip.run_s(1e-3)
    chip.uart_send(1, b"A", baud=38461.5)
    chip.run_s(1e-3)
    chip.poke(chip.symbols["go"][0], b"\1")
    chip.run_s(1e-4)
    assert chip.read("got_count") == 1
    assert bytes(chip.read_array("got", "u1")[:1]) == b"A"


def test_eeprom_write_takes_3_4_ms(make_chip: MakeChip) -> None:
    chip = make_chip("eeprom")
    run_to(chip)
    assert chip.read("busy_ticks") / 2 == pytest.approx(3400, abs=3)
    assert list(chip.read_array("back", "u1")) == [0xA5, 0x3C]
    assert chip.eeprom()[10:12] == b"\xa5\x3c"
    assert chip.read("without_arming") == 0


def test_eeprom_byte_under_way_is_lost_with_the_power(make_chip: MakeChip) -> None:
    chip = make_chip("eeprom")
    chip.run_s(1e-3)
    assert chip.eeprom()[10] == 0xFF
    chip.power_off()
    chip.run_s(0.01)
    assert chip.eeprom()[10] not in (0xFF, 0xA5)


def test_pwm_gives_only_programmed_widths(make_chip: MakeChip) -> None:
    chip = make_chip("pwm")
    chip.watch("PE3", "PE4", "PE5")
    chip.run_s(4.0)
    steady = pulses(*chip.edges("PE3"))
    # OCR + 1 clocks of 8 cycles, every 40000 clocks: 1.5 ms in 20 ms
    assert set(np.diff(steady, axis=1).ravel()) == {3000 * 8}
    assert set(np.diff(steady[:, 0])) == {40000 * 8}
    jumping = np.diff(pulses(*chip.edges("PE4")), axis=1).ravel()
    assert set(jumping) <= {8 * (w + 1) for w in (2000, 2500, 3000, 3999)}
    assert len(set(jumping)) == 4
    assert set(np.diff(pulses(*chip.edges("PE5")), axis=1).ravel()) == {4000 * 8}
    assert chip.read("read_back") == 2000
    assert chip.read("icr_before") == 0  # ICR is writable only where it is TOP


def test_pwm_top_changes_at_once(make_chip: MakeChip) -> None:
    chip = make_chip("pwm")
    chip.watch("PE3")
    chip.run_s(0.1)
    chip.poke(chip.symbols["change_top"][0], b"\1")
    run_to(chip)
    chip.run_s(0.5)
    # below the counter's place TOP is missed once and the counter runs to 0xFFFF
    periods = np.diff(pulses(*chip.edges("PE3"))[:, 0])
    assert set(periods[-10:]) == {20000 * 8}
    assert set(periods) <= {40000 * 8, 20000 * 8, 65536 * 8}


def test_reset_ends_a_pulse(make_chip: MakeChip) -> None:
    chip = make_chip("pwm")
    chip.watch("PE3")
    chip.pull("PE3", False)
    chip.run_until(int(cycles(0.02) * 5 + cycles(0.001)))
    assert chip.level("PE3")
    chip.reset()
    assert not chip.level("PE3")


def test_shared_temp_byte_tears_a_read(make_chip: MakeChip) -> None:
    chip = make_chip("temp_byte")
    chip.run_s(0.5)
    same = chip.read("torn_same")
    assert chip.read("reads") > 1000
    chip.poke(chip.symbols["use_other"][0], b"\1")
    chip.run_s(0.5)
    assert same > 10
    assert chip.read("torn_other") == 0


def test_level_flags_enter_again(make_chip: MakeChip) -> None:
    chip = make_chip("reentry")
    run_to(chip)
    chip.uart_send(1, b"x", baud=38461.5)
    run_to(chip, 2)
    deepest = chip.read_array("result", "<u2")[:3]
    assert deepest[0] == 5  # UDRE: until the handler stops enabling interrupts
    assert deepest[1] == 7  # RXC
    assert deepest[2] == 1  # an edge flag is cleared on entry
    assert chip.interrupt(UDRE0).nested_max == 5
    assert chip.interrupt(RX1).nested_max == 7
    assert chip.interrupt(TIMER1_OVF).nested_max == 1


def test_watchdog_interrupts_first_and_resets_then(make_chip: MakeChip) -> None:
    chip = make_chip("watchdog", power=False)
    chip.drive("PA0", True)
    chip.power_on()
    chip.run_s(0.048)
    assert chip.read("interrupts") == 1
    assert chip.read("wdie_in_handler") == 0
    chip.run_s(0.030)
    assert chip.read("finished") == 2
    assert chip.read("cause") == 8
    assert chip.read("interrupts") == 1
    assert chip.read("wdtcsr_at_start") == 0x08  # still on, with its shortest time


def test_watchdog_interrupt_mode_goes_on(make_chip: MakeChip) -> None:
    chip = make_chip("watchdog", power=False)
    chip.drive("PA0", False)
    chip.power_on()
    chip.run_s(0.34)
    assert chip.read("interrupts") == 10
    assert chip.read("cause") == 1


def test_sbi_touches_one_flag(make_chip: MakeChip) -> None:
    chip = make_chip("flags")
    run_to(chip)
    seen = list(chip.read_array("result", "<u2")[:5])
    assert seen == [0x8F, 0x0E, 0x0E, 0x0A, 0x08]


def test_input_capture_stamps_in_hardware(make_chip: MakeChip) -> None:
    chip = make_chip("capture")
    chip.drive("PL0", False)
    chip.drive("PL1", False)
    run_to(chip)
    start = chip.cycle
    for k in range(6):
        at = start + 16_000 + 8 * 1234 * k
        chip.drive("PL0", True, at_cycle=at)
        chip.drive("PL1", True, at_cycle=at + 80)
        chip.drive("PL0", False, at_cycle=at + 800)
        chip.drive("PL1", False, at_cycle=at + 800)
    chip.run_s(0.01)
    four, five = chip.read_array("captured", "<u2").reshape(2, 8).astype(int)[:, :6]
    assert set(np.diff(four) & 0xFFFF) == {1234}
    assert set((five - four) & 0xFFFF) == {10}
