"""Timers at random settings against the datasheet's formulas (17.9.2, 17.9.3, 20.7)."""

from __future__ import annotations

import struct

import numpy as np
from simavr_bench import Chip
from simavr_bench.testing import MakeChip

DIVIDERS = {1: 1, 2: 8, 3: 64, 4: 256, 5: 1024}
DIVIDERS_2 = {1: 1, 2: 8, 3: 32, 4: 64, 5: 128, 6: 256, 7: 1024}


def set_up(chip: Chip, **values: int) -> None:
    for name, value in values.items():
        address, size = chip.symbols[name]
        chip.poke(address, struct.pack("<H" if size == 2 else "B", value))
    chip.poke(chip.symbols["go"][0], b"\1")
    chip.run_s(1e-4)
    chip.clear_log()


def steady(chip: Chip, pin: str) -> tuple[set[int], set[int]]:
    """Periods between rising edges and widths of the high pulses, start-up left out."""
    at, level = chip.edges(pin)
    at, level = at[6:].astype(np.int64), level[6:]
    rises, falls = at[level == 1], at[level == 0]
    falls = falls[falls > rises[0]]
    count = min(len(rises), len(falls))
    return set(np.diff(rises)), set(falls[:count] - rises[:count])


def test_fast_pwm_at_random_settings(make_chip: MakeChip) -> None:
    chip = make_chip("any_timer")
    chip.watch("PH3", "PH6")
    chip.run_s(1e-3)
    rng = np.random.default_rng(2015)
    for _ in range(25):
        clock4, clock2 = int(rng.integers(1, 4)), int(rng.integers(2, 7))
        divider, divider2 = DIVIDERS[clock4], DIVIDERS_2[clock2]
        top = int(rng.integers(300, 20_000 // divider + 600))
        ocr4, ocr2 = int(rng.integers(0, top)), int(rng.integers(0, 255))
        set_up(chip, toggle=0, clock4=clock4, clock2=clock2, top=top, ocr4=ocr4, ocr2=ocr2)
        longest = max((top + 1) * divider, 256 * divider2)
        chip.run_until(chip.cycle + 12 * longest)
        assert steady(chip, "PH3") == ({(top + 1) * divider}, {(ocr4 + 1) * divider})
        assert steady(chip, "PH6") == ({256 * divider2}, {(ocr2 + 1) * divider2})


def test_toggled_output_at_random_settings(make_chip: MakeChip) -> None:
    chip = make_chip("any_timer")
    chip.watch("PH3", "PH6")
    chip.run_s(1e-3)
    rng = np.random.default_rng(2016)
    for _ in range(25):
        clock4, clock2 = int(rng.integers(1, 4)), int(rng.integers(2, 7))
        divider, divider2 = DIVIDERS[clock4], DIVIDERS_2[clock2]
        top = int(rng.integers(300, 20_000 // divider + 600))
        ocr4, ocr2 = int(rng.integers(0, top + 1)), int(rng.integers(20, 256))
        set_up(chip, toggle=1, clock4=clock4, clock2=clock2, top=top, ocr4=ocr4, ocr2=ocr2)
        half, half2 = (top + 1) * divider, (ocr2 + 1) * divider2
        chip.run_until(chip.cycle + 12 * max(half, half2) + 65_536 * divider)
        assert steady(chip, "PH3") == ({2 * half}, {half})
        assert steady(chip, "PH6") == ({2 * half2}, {half2})
