"""Read the program of an AVR ELF back from avr-objdump: instructions, where each leads, names."""

from __future__ import annotations

import os
import re
import subprocess
from bisect import bisect_right
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

_LINE = re.compile(r"^ *([0-9a-f]+):\t(\S+)(?:\t([^;]*))?")
_NUMBER = re.compile(r"^(?:0x[0-9a-fA-F]+|\d+)$")
_RELATIVE = re.compile(r"^\.([+-]\d+)$")
_SKIPS = ("cpse", "sbrc", "sbrs", "sbic", "sbis")
_LONG = ("call", "jmp", "lds", "sts")


class ImageError(Exception):
    """The image holds something these tools do not understand; the text says what and where."""


@dataclass(frozen=True, slots=True)
class Instruction:
    """One instruction: its address, its name, its operands as objdump writes them."""

    address: int
    name: str
    operands: tuple[str, ...]

    @property
    def size(self) -> int:
        """Bytes it takes."""
        return 4 if self.name in _LONG else 2

    @property
    def next(self) -> int:
        """Address of the one behind it."""
        return self.address + self.size

    @property
    def target(self) -> int | None:
        """Where a jump, call or branch leads; None for all others."""
        if not self.operands:
            return None
        last = self.operands[-1]
        relative = _RELATIVE.match(last)
        if relative:
            return self.next + int(relative[1])
        if self.name in ("call", "jmp") and _NUMBER.match(last):
            return int(last, 0)
        return None

    @property
    def skips(self) -> bool:
        """Whether it may leave out the next one."""
        return self.name in _SKIPS

    def number(self, index: int) -> int:
        """Operand as a number."""
        return int(self.operands[index], 0)


class Program:
    """Instructions and names of an image.

    Parameters
    ----------
    elf : Path
        The linked image.
    environment : mapping
        Variables for avr-objdump, avr-nm and avr-c++filt; PATH must find them.

    Raises
    ------
    OSError, subprocess.CalledProcessError
        If one of them cannot be run or does not understand the file.
    """

    def __init__(self, elf: Path, *, environment: Mapping[str, str] = os.environ) -> None:
        self.instructions: dict[int, Instruction] = {}
        listing = run(["avr-objdump", "-d", "--no-show-raw-insn", str(elf)], environment)
        for line in listing.splitlines():
            found = _LINE.match(line)
            if found:
                operands = tuple(part.strip() for part in (found[3] or "").split(",") if part)
                address = int(found[1], 16)
                self.instructions[address] = Instruction(address, found[2], operands)
        self.symbols: dict[str, int] = {}
        rows = run(["avr-nm", "--numeric-sort", str(elf)], environment).splitlines()
        for address_text, kind, name in (row.split(maxsplit=2) for row in rows if row[0] != " "):
            if kind in "tTwW":
                self.symbols[name] = int(address_text, 16)
        names = list(self.symbols)
        readable = demangle(names, environment=environment)
        self._names = dict(zip((self.symbols[n] for n in names), readable, strict=True))
        self._starts = sorted(self._names)
        self._words = _words(elf, environment)

    def function_of(self, address: int) -> tuple[int, int]:
        """First address of the symbol that holds an address, and of the symbol behind it."""
        at = bisect_right(self._starts, address)
        end = self._starts[at] if at < len(self._starts) else address + 2
        return (self._starts[at - 1] if at else 0), end

    def name(self, address: int) -> str:
        """Name of the function that holds an address, as in the source."""
        return self._names.get(self.function_of(address)[0], f"0x{address:x}")

    def word(self, address: int) -> int:
        """Two bytes of program memory, low one first."""
        return self._words[address // 2]


def run(command: list[str], environment: Mapping[str, str] = os.environ, text: str = "") -> str:
    """Run a tool and give what it prints."""
    done = subprocess.run(
        command, input=text, capture_output=True, text=True, check=True, env=dict(environment)
    )
    return done.stdout


def demangle(names: list[str], *, environment: Mapping[str, str] = os.environ) -> list[str]:
    """Give names as in the source, without what link-time optimisation appends to them."""
    plain = [re.sub(r"\.(lto_priv|constprop|part|isra)\.\d+", "", name) for name in names]
    return run(["avr-c++filt"], environment, "".join(f"{name}\n" for name in plain)).splitlines()


def section_bytes(elf: Path, section: str, *, environment: Mapping[str, str] = os.environ) -> int:
    """Size of a section of an image; 0 if it has none of that name."""
    rows = run(["avr-size", "-A", "-d", str(elf)], environment).splitlines()
    return sum(int(row.split()[1]) for row in rows if row.split()[:1] == [section])


def _words(elf: Path, environment: Mapping[str, str]) -> list[int]:
    # objcopy cannot write to a pipe; the hex dump of the section can.
    dump = run(["avr-objdump", "-s", "-j", ".text", str(elf)], environment)
    content = bytearray()
    for line in dump.splitlines():
        found = re.match(r"^ ([0-9a-f]+) ((?:[0-9a-f]{2,8} ){1,4})", line)
        if found:
            address = int(found[1], 16)
            content += bytes(address - len(content))
            content += bytes.fromhex(found[2].replace(" ", ""))
    content += bytes(len(content) % 2)
    return [content[i] | content[i + 1] << 8 for i in range(0, len(content), 2)]
