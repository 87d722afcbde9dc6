"""Smaller rules of the datasheet, one program through all of them."""

from __future__ import annotations

import pytest
from simavr_bench import Chip, Image
from simavr_bench.testing import MakeChip, run_until_value


def go(chip: Chip, step: int) -> None:
    chip.poke(chip.symbols["go"][0], bytes([step]))


def test_small_rules(make_chip: MakeChip) -> None:
    chip = make_chip("odds", power=False)
    chip.load(Image({0x10000: b"\x12\x34"}))
    chip.analog(0, 1.0)  # code 204 = 0x0CC
    chip.drive("PD0", True)
    chip.power_on()
    run_until_value(chip, "finished", 1)
    chip.analog(0, 4.0)  # code 819 = 0x333
    go(chip, 1)
    run_until_value(chip, "finished", 2)
    assert (chip.read("adcl"), chip.read("adch")) == (0xCC, 0x00)
    assert chip.read("triggered") == pytest.approx(1000, abs=1)

    go(chip, 2)
    chip.run_s(1e-3)
    assert chip.read("level_entries") == 0
    chip.drive("PD0", False)
    chip.run_s(1e-4)
    chip.drive("PD0", True)
    entries = chip.read("level_entries")
    assert 10 < entries < 100
    chip.run_s(1e-3)
    assert chip.read("level_entries") - entries <= 1

    go(chip, 3)
    run_until_value(chip, "finished", 3)
    chip.uart_send(1, b"ab", baud=38461.5)
    chip.run_s(2e-3)
    go(chip, 4)
    run_until_value(chip, "finished", 4)
    assert chip.read("after_flush") == 0
    assert chip.flash(0x10000, 2) == b"\x12\x34"

    go(chip, 5)
    run_until_value(chip, "finished", 9)
    assert chip.read("wde_with_flag") == 8
    assert chip.read("wde_without") == 0


def test_noise_canceler_delays_a_capture_by_four_clocks(make_chip: MakeChip) -> None:
    chip = make_chip("capture")
    chip.drive("PL0", False)
    chip.drive("PL1", False)
    run_until_value(chip, "finished", 1)
    # both timers run in step: with ICNC4 the same edge is seen 4 cycles later, half a tick
    chip.poke(0xA1, bytes([chip.data(0xA1, 1)[0] | 0x80]))
    later = 0
    for k in range(8):
        at = chip.cycle + 1000 + k
        chip.drive("PL0", True, at_cycle=at)
        chip.drive("PL1", True, at_cycle=at)
        chip.drive("PL0", False, at_cycle=at + 400)
        chip.drive("PL1", False, at_cycle=at + 400)
        chip.run_s(1e-4)
        four, five = chip.read_array("captured", "<u2").reshape(2, 8)[:, k].astype(int)
        later += (four - five) & 0xFFFF
    assert later == 4
