"""The hash by which an image is known: the first 32 bits of SHA-256 over its flash.

The four bytes that hold it count as zero. They are written into the ELF right after linking,
before PlatformIO makes the .hex, so the chip knows its hash at its first instruction and at no
cost. The same sources, settings and compiler give the same hash in any folder; all else another.

    python firmware/toolchain/image_hash.py .pio/build/mega2560/firmware.elf
"""

from __future__ import annotations

import argparse
import os
import struct
import sys
import tempfile
from collections.abc import Mapping
from hashlib import sha256
from pathlib import Path

from disassembly import ImageError, run

SYMBOL = "image_hash_bytes"
SIZE = 4
_ELF_MAGIC = b"\x7fELF\x01\x01"  # 32 bits, little-endian
_PT_LOAD = 1


def image_hash(elf: Path, *, environment: Mapping[str, str] = os.environ) -> int:
    """Compute the hash of an image, whatever stands in its four bytes.

    Parameters
    ----------
    elf : Path
        The linked image.
    environment : mapping
        Variables for avr-nm and avr-objcopy; PATH must find them.

    Raises
    ------
    ImageError
        If the image has no place for a hash.
    OSError, subprocess.CalledProcessError
        If one of the tools cannot be run or does not understand the file.
    """
    at = _address(elf, environment)
    with tempfile.TemporaryDirectory() as folder:
        flash = Path(folder) / "flash.bin"
        run(["avr-objcopy", "-O", "binary", "-R", ".eeprom", str(elf), str(flash)], environment)
        content = bytearray(flash.read_bytes())
    if at + SIZE > len(content):
        raise ImageError(f"{elf}: {SYMBOL} at 0x{at:x} is behind the end of the flash")
    content[at : at + SIZE] = bytes(SIZE)
    return int.from_bytes(sha256(content).digest()[:SIZE], "big")


def held_hash(elf: Path, *, environment: Mapping[str, str] = os.environ) -> int:
    """Return what stands in the four bytes; 0 in an image that was never stamped."""
    at = _file_offset(elf, _address(elf, environment))
    return int.from_bytes(elf.read_bytes()[at : at + SIZE], "little")


def stamp(elf: Path, *, environment: Mapping[str, str] = os.environ) -> int:
    """Write the hash into the image and return it.

    Raises
    ------
    ImageError
        If the image has no place for it.
    """
    value = image_hash(elf, environment=environment)
    at = _file_offset(elf, _address(elf, environment))
    with elf.open("r+b") as file:
        file.seek(at)
        file.write(value.to_bytes(SIZE, "little"))
    return value


def _address(elf: Path, environment: Mapping[str, str]) -> int:
    for row in run(["avr-nm", str(elf)], environment).splitlines():
        if row.split()[-1] == SYMBOL:
            return int(row.split()[0], 16)
    raise ImageError(f"{elf}: found no {SYMBOL}, expected that of boards/avr/image_hash.cpp")


def _file_offset(elf: Path, address: int) -> int:
    """Place in the file of an address of program memory, by the segments of the ELF."""
    content = elf.read_bytes()
    if not content.startswith(_ELF_MAGIC):
        raise ImageError(f"{elf}: expected an ELF of 32 bits")
    table, size, count = (
        struct.unpack_from(form, content, at)[0]
        for form, at in (("<I", 28), ("<H", 42), ("<H", 44))
    )
    for entry in range(table, table + size * count, size):
        kind, offset, start, _, length = struct.unpack_from("<5I", content, entry)
        if kind == _PT_LOAD and start <= address and address + SIZE <= start + length:
            return int(offset + address - start)
    raise ImageError(f"{elf}: no segment holds address 0x{address:x}")


def main() -> int:
    """Print the hash of an image; 6 if another one stands in it."""
    parser = argparse.ArgumentParser(description="The hash by which an image is known.")
    parser.add_argument("elf", type=Path)
    asked = parser.parse_args()
    if not asked.elf.is_file():
        print(f"{asked.elf}: no such file; `pio run` makes it", file=sys.stderr)
        return 2
    computed, held = image_hash(asked.elf), held_hash(asked.elf)
    print(f"{computed:08x}")
    if computed != held:
        print(f"{asked.elf}: holds {held:08x}, expected {computed:08x}", file=sys.stderr)
        return 6
    return 0


if __name__ == "__main__":
    sys.exit(main())
