"""What one function of an AVR image does to the stack: every path, the stack pointer in hand."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from disassembly import ImageError, Instruction, Program

INDIRECT_CALLS = Path(__file__).with_name("indirect_calls.toml")

_SPL, _SPH = 0x3D, 0x3E
_ENDS = ("ret", "reti")
_NO_WRITE = ("push", "out", "cp", "cpi", "cpc", "cpse", "tst", "sbrc", "sbrs", "st", "std", "sts")
_TABLE_JUMP = "__tablejump2__"
_DEEPEST = 8192  # more than any RAM: a loop that pushes


@dataclass(slots=True)
class Walk:
    """What one function does by itself."""

    frame: int  # deepest without any callee
    own: int  # with the return address of a callee
    calls: dict[int, int]  # callee: depth at its entry, return address included
    enables: bool  # reaches SEI


class FunctionWalker:
    """Walks functions of an image.

    Parameters
    ----------
    program : Program
        The image.
    return_bytes : int
        Bytes of a return address.
    indirect : dict of str to list of str
        By a pattern for the function that calls through a pointer, patterns of what it may call.
    """

    def __init__(
        self, program: Program, *, return_bytes: int, indirect: dict[str, list[str]]
    ) -> None:
        self._program = program
        self._return = return_bytes
        self._indirect = indirect
        self._table_jump = program.symbols.get(_TABLE_JUMP)

    def walk(self, function: int) -> Walk:
        """Walk every path of a function.

        Raises
        ------
        ImageError
            What makes a bound impossible, with the place.
        """
        result = Walk(frame=0, own=0, calls={}, enables=False)
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
        result: Walk,
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

    def _call(self, callee: int, depth: int, result: Walk) -> None:
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
