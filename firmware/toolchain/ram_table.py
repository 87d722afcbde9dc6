"""Print who holds the RAM of an AVR image, and refuse one that leaves too little stack.

Reads the ELF with avr-nm, so it sees what the linker kept. PlatformIO calls
`print_table` after linking; run by hand it takes the path of the ELF.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Mapping
from pathlib import Path

from disassembly import demangle, run, section_bytes

MEGA_RAM_BYTES = 8192
SMALLEST_SHOWN_BYTES = 16


def symbols(elf: Path, *, environment: Mapping[str, str] = os.environ) -> list[tuple[str, int]]:
    """List what lies in .data, .bss and .noinit, largest first.

    Parameters
    ----------
    elf : Path
        The linked image.
    environment : mapping
        Variables for avr-nm and avr-c++filt; PATH must find them.

    Returns
    -------
    list of (name, size)
        Names as in the source, sizes in bytes.

    Raises
    ------
    OSError, subprocess.CalledProcessError
        If one of them cannot be run or does not understand the file.
    """
    nm = ["avr-nm", "--print-size", "--size-sort", "--reverse-sort", str(elf)]
    lines = [line.split(maxsplit=3) for line in run(nm, environment).splitlines()]
    found = [(name, int(size, 16)) for _, size, kind, name in lines if kind in "bBdD"]
    readable = demangle([name for name, _ in found], environment=environment)
    return list(zip(readable, (size for _, size in found), strict=True))


def print_table(
    elf: Path,
    *,
    ram_bytes: int,
    stack_bytes: int,
    environment: Mapping[str, str] = os.environ,
) -> bool:
    """Print the table; True if at least stack_bytes of RAM stay free."""
    found = symbols(elf, environment=environment)
    rows = [(name, size) for name, size in found if size >= SMALLEST_SHOWN_BYTES]
    small = sum(size for _, size in found) - sum(size for _, size in rows)
    sections = (".data", ".bss", ".noinit")
    used = sum(section_bytes(elf, name, environment=environment) for name in sections)
    small += used - sum(size for _, size in found)  # constants the compiler gave no name
    for name, size in [*rows, ("(smaller ones)", small), ("left for the stack", ram_bytes - used)]:
        print(f"{size:>7} B  {name[:80]}")
    if ram_bytes - used < stack_bytes:
        print(f"found {ram_bytes - used} B left for the stack, expected at least {stack_bytes} B")
        return False
    return True


def main() -> int:
    """Print the table of an image of the Mega; 1 if the stack is too small."""
    parser = argparse.ArgumentParser(description="Who holds the RAM of an AVR image.")
    parser.add_argument("elf", type=Path)
    parser.add_argument("--ram", type=int, default=MEGA_RAM_BYTES, help="bytes of RAM")
    parser.add_argument("--stack", type=int, default=0, help="bytes that must stay free")
    asked = parser.parse_args()
    return 0 if print_table(asked.elf, ram_bytes=asked.ram, stack_bytes=asked.stack) else 1


if __name__ == "__main__":
    sys.exit(main())
