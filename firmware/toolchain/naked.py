"""Functions without a frame of the compiler's: prove from the linked image that they hold only
what their source says.

GCC promises that of basic assembly alone; ours name constants too (``"n"``, ``"M"``, ``"i"``
operands), which is extended assembly. So the image is asked: whatever a naked function writes it
has saved, on every path, and it gives back what it saved before it returns.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from disassembly import Instruction, Program

# Functions of ours that are naked, by chip; a test holds the list against the sources.
NAKED = {
    "atmega2560": {
        "mega_init3": "", "mega_stack_gone": "", "PCINT2": "__vector_11", "WDT": "__vector_12",
        "TIMER2_COMPA": "__vector_13", "USART0_UDRE": "__vector_26", "ADC": "__vector_29",
        "TWI": "__vector_39", "TIMER5_OVF": "__vector_50", "USART2_RX": "__vector_51",
        "USART2_UDRE": "__vector_52", "USART3_UDRE": "__vector_55",
    },
    "atmega328p": {"arduimu_init3": "", "WDT": "__vector_6"},
}  # fmt: skip
# Before main, or never to return: nobody's registers have to be kept.
FREE = ("mega_init3", "mega_stack_gone", "arduimu_init3", "WDT")

_ALU = (
    "add adc adiw sub subi sbc sbci sbiw and andi or ori eor com neg inc dec clr tst lsr lsl ror"
    " rol asr"
)
_WRITES_FIRST = frozenset(f"{_ALU} ser ldi lds ld ldd lpm elpm in mov swap bld pop".split()) - {
    "tst"
}
_FLAGS = frozenset(f"{_ALU} cp cpc cpi".split())
_SREG = "0x3f"


@dataclass(frozen=True, slots=True)
class _State:
    """What is on the stack, innermost last, and whether the flags are saved."""

    stack: tuple[str, ...] = ()
    flags_in: str = ""  # register that holds SREG and was not written since


def complaints(program: Program, chip: str) -> list[str]:
    """Say what is wrong with the naked functions of an image.

    Parameters
    ----------
    program : Program
        The image.
    chip : str
        Its chip, as the board names it.

    Returns
    -------
    list[str]
        One line for each; empty if all is proven.
    """
    found: list[str] = []
    for name, vector in NAKED[chip].items():
        address = program.symbols.get(vector or name)
        if address is None:
            found.append(f"{name}: found no such function, expected the one of the source")
            continue
        found += [f"{name}: {text}" for text in _judge(program, address, name in FREE)]
    return found


def _judge(program: Program, start: int, free: bool) -> Iterator[str]:
    first, end = program.function_of(start)
    seen: set[tuple[int, _State]] = set()
    paths = [(start, _State())]
    while paths:
        at, state = paths.pop()
        if (at, state) in seen:
            continue
        seen.add((at, state))
        one = program.instructions.get(at)
        if one is None or at >= end:
            yield f"runs on to 0x{at:x}, behind its end"
            continue
        if one.name in ("call", "rcall", "icall", "eicall", "ret"):
            yield f"found {one.name} at 0x{at:x}, expected none: a frame of the compiler's?"
            continue
        if free:
            if one.name == "push":
                yield f"found push at 0x{at:x}, expected no frame"
            paths += [(a, state) for a in _next(one, first, end) if a < end]
            continue
        wrong, after = _step(one, state)
        if wrong:
            yield f"{wrong} at 0x{at:x}"
            continue
        if one.name == "reti" and after.stack:
            yield f"returns at 0x{at:x} with {len(after.stack)} registers on the stack"
        leaves = one.name == "jmp" and not first <= (one.target or 0) < end
        if leaves and after.stack and not _never_returns(program, one):
            yield f"leaves at 0x{at:x} with {len(after.stack)} registers on the stack"
        paths += [(a, after) for a in _next(one, first, end)]


def _never_returns(program: Program, jump: Instruction) -> bool:
    return program.name(jump.target or 0) == "mega_stack_gone"


def _next(one: Instruction, first: int, end: int) -> Iterable[int]:
    if one.name == "reti":
        return ()
    if one.name in ("jmp", "rjmp"):
        return (one.target,) if one.target is not None and first <= one.target < end else ()
    if one.skips:
        return (one.next, one.next + 2, one.next + 4)[:2]
    if one.name.startswith("br") and one.target is not None:
        return (one.next, one.target)
    return (one.next,)


def _step(one: Instruction, state: _State) -> tuple[str, _State]:
    if one.name == "push":
        return "", _State((*state.stack, _pushed(one, state)), state.flags_in)
    if one.name == "pop":
        if not state.stack:
            return "pops what it never pushed", state
        want = state.stack[-1]
        if want not in (one.operands[0], "flags"):
            return f"gives {want} back into {one.operands[0]}", state
        return "", _State(state.stack[:-1], one.operands[0] if want == "flags" else "")
    if one.name == "in" and one.operands[1] == _SREG:
        saved = one.operands[0] in state.stack
        wrong = "" if saved else f"reads the flags into {one.operands[0]}, which is not saved"
        return wrong, _State(state.stack, one.operands[0])
    if one.name == "out" and one.operands[0] == _SREG:
        wrong = "" if one.operands[1] == state.flags_in else "sets the flags to something else"
        return wrong, state
    if one.name in _FLAGS and "flags" not in state.stack:
        return f"{one.name} spoils flags that are not saved", state
    if one.name in _WRITES_FIRST:
        for register in _written(one):
            if register not in state.stack:
                return f"{one.name} writes {register}, which is not saved", state
    held = state.flags_in if one.name not in _WRITES_FIRST else ""
    return "", _State(state.stack, held)


def _pushed(one: Instruction, state: _State) -> str:
    return "flags" if one.operands[0] == state.flags_in else one.operands[0]


def _written(one: Instruction) -> tuple[str, ...]:
    first = one.operands[0]
    if one.name in ("adiw", "sbiw"):
        return (first, f"r{int(first[1:]) + 1}")
    return (first,)
