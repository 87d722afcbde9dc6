"""Compute how deep the stack of an AVR image can get, from its instructions alone.

Every path of every function is walked (stack_walk.py). A call costs what its callee can need; the
deepest chain from main is added to every interrupt that lets others in, once each, and to the
deepest of those that do not. Which do is read from the image: an interrupt that reaches SEI lets
others in. Recursion, a stack pointer set from an unknown value and an indirect call that
`indirect_calls.toml` does not list are errors.

    python firmware/toolchain/stack_depth.py .pio/build/mega2560/firmware.elf
"""

from __future__ import annotations

import argparse
import functools
import os
import sys
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from disassembly import ImageError, Program, run
from stack_walk import INDIRECT_CALLS, FunctionWalker


@dataclass(frozen=True, slots=True)
class Chip:
    """What differs between the chips of this project."""

    ram_end: int
    return_bytes: int  # three where the program counter has more than 16 bits
    vectors: int  # the reset included


CHIPS = {"atmega2560": Chip(0x2200, 3, 57), "atmega328p": Chip(0x900, 2, 26)}


@dataclass(frozen=True, slots=True)
class Link:
    """One step of the deepest chain: a function and the bytes below it when it calls the next."""

    function: str
    bytes: int


@dataclass(frozen=True, slots=True)
class StackDepth:
    """What the stack of an image may need.

    Attributes
    ----------
    main : tuple of Link
        Deepest chain from main (or a constructor); the bytes of its links add up.
    nesting : dict of int to int
        Bytes of each interrupt that lets others in, by vector.
    plain : dict of int to int
        Bytes of each of the others.
    """

    main: tuple[Link, ...]
    nesting: dict[int, int]
    plain: dict[int, int]

    @property
    def main_bytes(self) -> int:
        """Bytes of the deepest chain from main."""
        return sum(link.bytes for link in self.main)

    @property
    def interrupt_bytes(self) -> int:
        """Bytes of every nestable interrupt once and the deepest of the others."""
        return sum(self.nesting.values()) + max(self.plain.values(), default=0)

    @property
    def total_bytes(self) -> int:
        """Bytes all of it may need at once."""
        return self.main_bytes + self.interrupt_bytes


class StackAnalysis:
    """Walks an image.

    Parameters
    ----------
    program : Program
        The image.
    chip : Chip
        What it runs on.
    indirect : dict of str to list of str
        By a pattern for the function that calls through a pointer, patterns of what it may call.
    """

    def __init__(self, program: Program, *, chip: Chip, indirect: dict[str, list[str]]) -> None:
        self._program = program
        self._return = chip.return_bytes
        self._vector_count = chip.vectors
        walker = FunctionWalker(program, return_bytes=chip.return_bytes, indirect=indirect)
        self.walk = functools.cache(walker.walk)
        self.deepest = functools.cache(self._deepest)
        self._path: list[int] = []

    def of_image(self) -> StackDepth:
        """Analyse main, constructors and every interrupt that has a vector of its own.

        Raises
        ------
        ImageError
            Recursion, an unlisted indirect call, a stack pointer from nowhere.
        """
        symbols = self._program.symbols
        roots = [symbols["main"], *self._constructors()]
        chains = [self._chain(root) for root in roots]
        longest = max(chains, key=lambda chain: sum(link.bytes for link in chain))
        main = (Link("return address of main", self._return), *longest)
        nesting: dict[int, int] = {}
        plain: dict[int, int] = {}
        for vector, entry in self._vectors().items():
            depth = self._return + self.deepest(entry)
            (nesting if self._enables(entry) else plain)[vector] = depth
        return StackDepth(main, nesting, plain)

    def _vectors(self) -> dict[int, int]:
        unused = self._program.symbols.get("__bad_interrupt")
        vectors: dict[int, int] = {}
        instructions = self._program.instructions
        step = instructions[0].size
        for number in range(1, self._vector_count):
            target = instructions[number * step].target
            if target is not None and target != unused:
                vectors[number] = target
        return vectors

    def _constructors(self) -> list[int]:
        symbols = self._program.symbols
        start, end = symbols.get("__ctors_start", 0), symbols.get("__ctors_end", 0)
        return [self._program.word(at) * 2 for at in range(start, end, 2)]

    def _enables(self, function: int) -> bool:
        seen: set[int] = set()
        waiting = [function]
        while waiting:
            at = waiting.pop()
            if at not in seen:
                seen.add(at)
                walk = self.walk(at)
                if walk.enables:
                    return True
                waiting += walk.calls
        return False

    def _deepest(self, function: int) -> int:
        if function in self._path:
            cycle = [*self._path[self._path.index(function) :], function]
            names = " -> ".join(self._program.name(at) for at in cycle)
            raise ImageError(f"recursion: {names}; the stack has no bound")
        self._path.append(function)
        walk = self.walk(function)
        below = (depth + self.deepest(callee) for callee, depth in walk.calls.items())
        deepest = max(walk.own, max(below, default=0))
        self._path.pop()
        return deepest

    def _chain(self, function: int) -> list[Link]:
        links: list[Link] = []
        at = function
        while True:
            walk = self.walk(at)
            if self.deepest(at) <= walk.own:
                return [*links, Link(self._program.name(at), walk.own)]
            callee = max(walk.calls, key=lambda to: walk.calls[to] + self.deepest(to))
            links.append(Link(self._program.name(at), walk.calls[callee]))
            at = callee


def analyse(
    elf: Path,
    *,
    chip: str = "atmega2560",
    indirect: dict[str, list[str]] | None = None,
    environment: Mapping[str, str] = os.environ,
) -> StackDepth:
    """Compute what the stack of an image may need.

    Parameters
    ----------
    elf : Path
        The linked image.
    chip : str
        One of CHIPS.
    indirect : dict, optional
        What calls through pointers may reach; by default the file beside this module.
    environment : mapping
        Variables for the tools of the compiler.

    Raises
    ------
    ImageError
        What makes a bound impossible, with the place.
    """
    known = read_indirect_calls() if indirect is None else indirect
    program = Program(elf, environment=environment)
    return StackAnalysis(program, chip=CHIPS[chip], indirect=known).of_image()


def read_indirect_calls(path: Path = INDIRECT_CALLS) -> dict[str, list[str]]:
    """Read which functions may be reached through pointers."""
    table = tomllib.loads(path.read_text(encoding="utf-8"))
    return {row["caller"]: list(row["callees"]) for row in table["call"]}


def room_bytes(
    elf: Path, *, chip: str = "atmega2560", environment: Mapping[str, str] = os.environ
) -> int:
    """Bytes between the last variable and the end of RAM."""
    rows = run(["avr-nm", str(elf)], environment).splitlines()
    end = next(int(row.split()[0], 16) for row in rows if row.endswith(" _end"))
    return CHIPS[chip].ram_end - (end & 0xFFFF)


def print_depth(found: StackDepth, room: int) -> bool:
    """Print the deepest chain and the interrupts; True if all of it fits."""
    for link in found.main:
        print(f"{link.bytes:>7} B  {link.function[:84]}")
    for vector, depth in sorted(found.nesting.items()):
        print(f"{depth:>7} B  interrupt {vector}, lets others in")
    vector = max(found.plain, key=lambda number: found.plain[number], default=0)
    print(f"{found.plain.get(vector, 0):>7} B  interrupt {vector}, deepest of the others")
    print(f"{found.total_bytes:>7} B  worst case; {room} B are there")
    return found.total_bytes <= room


def main() -> int:
    """Print the worst case of an image; 6 if it does not fit or has no bound."""
    parser = argparse.ArgumentParser(description="How deep the stack of an AVR image can get.")
    parser.add_argument("elf", type=Path)
    parser.add_argument("--chip", choices=sorted(CHIPS), default="atmega2560")
    asked = parser.parse_args()
    if not asked.elf.is_file():
        print(f"{asked.elf}: no such file; `pio run` makes it", file=sys.stderr)
        return 2
    try:
        found = analyse(asked.elf, chip=asked.chip)
    except ImageError as error:
        print(error, file=sys.stderr)
        return 6
    return 0 if print_depth(found, room_bytes(asked.elf, chip=asked.chip)) else 6


if __name__ == "__main__":
    sys.exit(main())
