"""Compute how deep the stack of an AVR image can get, from its instructions alone.

Every path of every function is walked with the stack pointer in hand: pushes, return addresses,
frames. A call costs what its callee can need; the deepest chain from main is added to every
interrupt that lets others in, once each, and to the deepest of those that do not. Which do is read
from the image: an interrupt that reaches SEI lets others in. Recursion, a stack pointer set from
an unknown value and an indirect call that `indirect_calls.toml` does not list are errors.

    python firmware/toolchain/stack_depth.py .pio/build/mega2560/firmware.elf
"""

from __future__ import annotations

import argparse
import functools
import os
import re
import sys
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from disassembly import ImageError, Instruction, Program, run

INDIRECT_CALLS = Path(__file__).with_name("indirect_calls.toml")

_SPL, _SPH = 0x3D, 0x3E
_ENDS = ("ret", "reti")
_NO_WRITE = ("push", "out", "cp", "cpi", "cpc", "cpse", "tst", "sbrc", "sbrs", "st", "std", "sts")
_TABLE_JUMP = "__tablejump2__"
_DEEPEST = 8192  # more than any RAM: a loop that pushes


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


@dataclass(slots=True)
class _Walk:
    """What one function does by itself."""

    frame: int  # deepest without any callee
    own: int  # with the return address of a callee
    calls: dict[int, int]  # callee: depth at its entry, return address included
    enables: bool  # reaches SEI


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
        self._indirect = indirect
        self._table_jump = program.symbols.get(_TABLE_JUMP)
        self.walk = functools.cache(self._walk)
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

    # ---- one function ----------------------------------------------------------------------------

    def _walk(self, function: int) -> _Walk:
        result = _Walk(frame=0, own=0, calls={}, enables=False)
        # y: depth to which the stack pointer comes when it is set from Y; None if Y is data. A
        # tuple: the low byte has been changed by so much, the carry goes into the next.
        waiting: list[tuple[int, int, int | tuple[int, int] | None]] = [(function, 0, None)]
        seen = set(waiting)
        while waiting:
            address, depth, y = waiting.pop()
            if depth > _DEEPEST:
                raise ImageError(f"{self._at(address)}: a loop pushes without end")
            instruction = self._program.instructions.get(address)
            if instruction is None:
                raise ImageError(f"{self._at(function)}: runs into 0x{address:x}, no instruction")
            depth, y = self._step(instruction, depth, y)
            result.frame = max(result.frame, depth)
            result.own = max(result.own, depth)
            result.enables = result.enables or instruction.name == "sei"
            for state in self._follow(instruction, depth, y, result):
                if state not in seen:
                    seen.add(state)
                    waiting.append(state)
        return result

    def _at(self, address: int) -> str:
        return f"{self._program.name(address)} at 0x{address:x}"

    def _step(
        self, at: Instruction, depth: int, y: int | tuple[int, int] | None
    ) -> tuple[int, int | tuple[int, int] | None]:
        name = at.name
        if name == "push":
            return depth + 1, y
        if name == "rcall" and at.target == at.next:  # a frame of its own size
            return depth + self._return, y
        first = at.operands[0] if at.operands else ""
        if name == "pop":
            return depth - 1, None if first in ("r28", "r29") else y
        if name == "out" and int(first, 0) in (_SPL, _SPH):
            if at.operands[1] not in ("r28", "r29") or not isinstance(y, int):
                raise ImageError(f"{self._at(at.address)}: sets the stack from an unknown value")
            # The high byte is written first: the pointer is whole with the low one.
            return (y if int(first, 0) == _SPL else depth), y
        if first not in ("r28", "r29") or name in _NO_WRITE:
            return depth, y
        if name == "in" and at.number(1) in (_SPL, _SPH):
            return depth, depth
        if name in ("adiw", "sbiw") and isinstance(y, int):
            return depth, y + (at.number(1) if name == "sbiw" else -at.number(1))
        if name == "subi" and first == "r28" and isinstance(y, int):
            return depth, (y, at.number(1))
        if name in ("sbci", "sbc") and first == "r29" and isinstance(y, tuple):
            if name == "sbc" and at.operands[1] != "r1":
                return depth, None
            high = at.number(1) if name == "sbci" else 0
            size = high << 8 | y[1]
            return depth, y[0] + (size - 0x10000 if size >= 0x8000 else size)
        return depth, None

    def _follow(
        self,
        at: Instruction,
        depth: int,
        y: int | tuple[int, int] | None,
        result: _Walk,
    ) -> list[tuple[int, int, int | tuple[int, int] | None]]:
        name, target = at.name, at.target
        if name in _ENDS:
            if depth != 0:
                raise ImageError(f"{self._at(at.address)}: returns with {depth} bytes on the stack")
            return []
        if name in ("jmp", "rjmp"):
            if target == self._table_jump:
                return [(to, depth, y) for to in self._switch(at)]
            # A jump to 0 starts the program anew, stack included.
            return [(target, depth, y)] if target else []
        if name in ("ijmp", "eijmp"):
            raise ImageError(f"{self._at(at.address)}: jumps through a pointer")
        if name in ("icall", "eicall"):
            for callee in self._pointed(at):
                self._call(callee, depth, result)
        elif name in ("call", "rcall") and target is not None and target != at.next:
            self._call(target, depth, result)
        following = [(at.next, depth, y)]
        if at.skips:
            after = self._program.instructions.get(at.next)
            if after is not None:
                following.append((after.next, depth, y))
        elif name.startswith("br") and target is not None:
            following.append((target, depth, y))
        return following

    def _call(self, callee: int, depth: int, result: _Walk) -> None:
        depth += self._return
        result.calls[callee] = max(result.calls.get(callee, 0), depth)
        result.own = max(result.own, depth)

    def _pointed(self, at: Instruction) -> list[int]:
        caller = self._program.name(at.address)
        symbols = self._program.symbols.values()
        for pattern, callees in self._indirect.items():
            if re.search(pattern, caller):
                wanted = re.compile("|".join(callees))
                found = [to for to in symbols if wanted.search(self._program.name(to))]
                if found:
                    return found
        raise ImageError(
            f"{self._at(at.address)}: calls through a pointer; "
            f"list what it may call in {INDIRECT_CALLS.name}"
        )

    def _switch(self, at: Instruction) -> list[int]:
        # subi r30, K; sbci r31, K2; sbci r24, K3: Z becomes index + address of the table, in words.
        constants: dict[str, int] = {}
        before = at.address
        while len(constants) < 3 and before > at.address - 24:
            before -= 2
            instruction = self._program.instructions.get(before)
            if instruction is not None and instruction.name in ("subi", "sbci"):
                constants.setdefault(instruction.operands[0], instruction.number(1))
        if not {"r30", "r31"} <= constants.keys():
            raise ImageError(f"{self._at(at.address)}: a switch whose table was not found")
        # Chips whose program counter has 16 bits leave out the third byte.
        low = constants["r30"] | constants["r31"] << 8 | constants.get("r24", 0xFF) << 16
        table = (0x1000000 - low) * 2
        start, end = self._program.function_of(at.address)
        targets: list[int] = []
        while start <= self._program.word(table) * 2 < end:
            targets.append(self._program.word(table) * 2)
            table += 2
        if not targets:
            raise ImageError(f"{self._at(at.address)}: a switch with an empty table")
        return targets


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
