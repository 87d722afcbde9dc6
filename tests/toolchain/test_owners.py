"""Bytes by source file: nothing twice, nothing lost, inlined code where it is written."""

from __future__ import annotations

import subprocess
from pathlib import Path

import owners
import pytest

FILES = {
    "firmware/core/filter.h": """
#pragma once
#include <stdint.h>
namespace core {
struct Tap { uint32_t weight; uint8_t delay; };
class Filter {
 public:
  uint32_t step(uint32_t value) {
    uint32_t sum = 0;
    for (uint8_t i = 0; i < 6; ++i) sum += taps_[i].weight * value;
    return last_ = sum ^ (sum >> 3);
  }
 private:
  Tap taps_[6] = {};
  uint32_t last_ = 0;
};
}
""",
    "firmware/app/thing.h": """
#pragma once
#include "core/filter.h"
namespace app {
class Thing {
 public:
  uint32_t step(uint32_t value) { turns_ = turns_ + 1; return filter_.step(value) + ring_[3]; }
 private:
  uint8_t ring_[90] = {};
  core::Filter filter_;
  volatile uint16_t turns_ = 0;
};
}
""",
    "firmware/boards/avr/pins.h": """
#pragma once
#include <avr/io.h>
namespace avr {
inline uint8_t both() { return uint8_t(PINA ^ (PINB << 3)); }
}
""",
    "firmware/boards/mega2560/main.cpp": """
#include "app/thing.h"
#include "boards/avr/pins.h"
#include <avr/io.h>
namespace { app::Thing g_thing; volatile uint8_t g_flag[7]; }
int main() {
  for (;;) { g_flag[2] = avr::both(); PORTB = uint8_t(g_thing.step(g_flag[PINA & 3])); }
}
""",
}


@pytest.fixture
def elf(tmp_path: Path) -> Path:
    """Build three files of three rooms."""
    for name, text in FILES.items():
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    target = tmp_path / "firmware.elf"
    main = "firmware/boards/mega2560/main.cpp"
    command = ["avr-g++", "-mmcu=atmega2560", "-std=gnu++14", "-O2", "-gstabs", "-Ifirmware"]
    subprocess.run([*command, "-o", str(target), main], cwd=tmp_path, check=True)
    return target


def test_an_object_is_divided_among_the_classes_of_its_members(tmp_path: Path, elf: Path) -> None:
    ram = owners.ram_by_owner(elf, owners.Sources(tmp_path))
    assert ram["firmware/app/thing.h", "Thing::ring_"] == 90
    assert ram["firmware/core/filter.h", "Tap::weight"] == 24
    assert ram["firmware/core/filter.h", "Tap::delay"] == 6
    assert ram["firmware/core/filter.h", "Filter::last_"] == 4
    assert ram["firmware/app/thing.h", "Thing::turns_"] == 2
    assert ram["firmware/boards/mega2560/main.cpp", "g_flag"] == 7
    assert sum(ram.values()) == 90 + 34 + 2 + 7


def test_inlined_code_counts_where_it_is_written(tmp_path: Path, elf: Path) -> None:
    flash = owners.flash_by_owner(elf, owners.Sources(tmp_path))
    size = subprocess.run(["avr-size", "-A", "-d", elf], capture_output=True, text=True, check=True)
    text = next(int(row.split()[1]) for row in size.stdout.splitlines() if row[:5] == ".text")
    assert sum(flash.values()) == text
    assert flash["firmware/core/filter.h"] > flash["firmware/app/thing.h"] > 0
    assert flash["firmware/boards/mega2560/main.cpp"] > 0
    assert flash["firmware/boards/avr/pins.h"] > 0  # not the C library's folder of that name


def test_a_member_is_found_in_its_object(elf: Path) -> None:
    taps = owners.find_member(elf, "Thing", "filter_.taps_")
    assert (taps.offset, taps.size, taps.stride) == (90, 30, 5)
    assert taps.fields == {"weight": (0, 4), "delay": (4, 1)}
    assert owners.find_member(elf, "Thing", "turns_").offset == 90 + 34
    with pytest.raises(KeyError, match="no member gone_"):
        owners.find_member(elf, "Thing", "filter_.gone_")
