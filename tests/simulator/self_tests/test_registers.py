"""Every address and vector of shim/registers.h is the one avr-libc states for the ATmega2560."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

HEADER = Path(__file__).resolve().parents[1] / "shim" / "registers.h"
_VECTORS = {
    "Int0": "INT0", "Pcint0": "PCINT0", "Pcint1": "PCINT1", "Pcint2": "PCINT2", "Wdt": "WDT",
    "Spi": "SPI_STC", "Adc": "ADC", "EeReady": "EE_READY", "Twi": "TWI", "SpmReady": "SPM_READY",
}  # fmt: skip


def _avr_libc() -> dict[str, str]:
    done = subprocess.run(
        ["avr-gcc", "-mmcu=atmega2560", "-E", "-dM", "-include", "avr/io.h", "-"],
        input="", capture_output=True, text=True, check=True,
    )  # fmt: skip
    return dict(re.findall(r"#define (\w+) (.+)", done.stdout))


def _address(macro: str) -> int:
    match = re.fullmatch(r"_SFR_(IO|MEM)(?:8|16)\s*\(0[xX]([0-9A-Fa-f]+)\)", macro)
    assert match, macro
    return int(match[2], 16) + (0x20 if match[1] == "IO" else 0)


def test_addresses_are_those_of_avr_libc() -> None:
    ours = re.findall(r"#define REG_(\w+) 0x([0-9A-F]+)", HEADER.read_text())
    theirs = _avr_libc()
    checked = 0
    for name, value in ours:
        if name != "LAST_IO":
            assert _address(theirs[name]) == int(value, 16), name
            checked += 1
    assert checked == len(ours) - 1 > 40


def test_vectors_are_those_of_avr_libc() -> None:
    ours = dict(re.findall(r"kVector(\w+) = (\d+)", HEADER.read_text()))
    theirs = _avr_libc()
    for name, libc in _VECTORS.items():
        assert int(ours[name]) == int(theirs[f"{libc}_vect_num"]), name
    assert int(ours["Count"]) == 57
