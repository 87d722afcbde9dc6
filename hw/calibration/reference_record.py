"""Make the EEPROM record that tells the logger its chip's true reference voltage.

    python hw/calibration/reference_record.py --meter 5.02 --shown 4.871 reference.hex

How to measure both: procedure-supply.md. The record is the last 4 of the 4096 bytes: millivolts
and CRC-16 (firmware/core/supply.h). The 4 bytes before it fill the EEPROM's page and stay erased.
"""

from __future__ import annotations

import argparse
import binascii
import math
import struct
import sys
from pathlib import Path

NOMINAL_MV = 1100.0
LEAST_MV, MOST_MV = 1000, 1200  # ATmega2560 datasheet, ADC characteristics, VINT1
PAGE = 4088


def record(reference_mv: int) -> bytes:
    """Return the 8 bytes of the EEPROM's last page.

    Raises
    ------
    ValueError
        No chip has such a reference.
    """
    if not LEAST_MV <= reference_mv <= MOST_MV:
        raise ValueError(
            f"a reference of {reference_mv} mV, expected {LEAST_MV} to {MOST_MV}:"
            " measure again, at the board's 5V pin"
        )
    word = struct.pack("<H", reference_mv)
    return b"\xff" * 4 + word + struct.pack("<H", binascii.crc_hqx(word, 0xFFFF))


def intel_hex(at: int, data: bytes) -> str:
    """Return a file for avrdude (Intel hex, format i)."""
    line = bytes([len(data), at >> 8, at & 0xFF, 0]) + data
    checked = line + bytes([-sum(line) & 0xFF])
    return f":{checked.hex().upper()}\n:00000001FF\n"


def main(argv: list[str] | None = None) -> int:
    """Write the file; 2 for values no chip has."""
    parser = argparse.ArgumentParser(description="Make the EEPROM record of the chip's reference.")
    parser.add_argument("--meter", type=float, required=True, help="V at the 5V pin, by a meter")
    parser.add_argument("--shown", type=float, required=True, help="V the status line said then")
    parser.add_argument(
        "--was", type=float, default=NOMINAL_MV, metavar="MV",
        help="reference the line was made with: 1100 while it says `about`",
    )  # fmt: skip
    parser.add_argument("out", type=Path)
    given = parser.parse_args(argv)
    if not all(0.0 < value < math.inf for value in (given.meter, given.shown, given.was)):
        parser.error("--meter, --shown and --was are voltages above 0")
    try:
        reference_mv = round(given.was * given.meter / given.shown)
        given.out.write_text(intel_hex(PAGE, record(reference_mv)), encoding="ascii")
    except (ValueError, OverflowError, OSError) as error:
        print(f"reference_record: {error}", file=sys.stderr)
        return 2
    print(
        f"{reference_mv} mV; now: avrdude -p m2560 -c wiring -P PORT -D -U eeprom:w:{given.out}:i"
    )
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
