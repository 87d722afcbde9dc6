"""Faults of the program: resets, hangs, storms of interrupts, a stack that overflows."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

from flight.faults.model import Check, Fault, Seen, expect
from flight.rig import FlightRig
from flight.servos import released_ms
from simavr_bench import Image, ResetCause

RELEASED_MS = 50
RESUMED_S = 2.0
BLOCK_S = 0.3  # the schema comes first, then the frames of the first instant

NOW_US = "_ZN3hal6now_usEv"  # every turn of the main loop calls it
HANG = b"\xff\xcf"  # rjmp to itself
HANG_WITHOUT_INTERRUPTS = b"\xf8\x94\xff\xcf"  # cli before it
NOP, RETI = b"\0\0", b"\x18\x95"
SPARE = 0x30000  # flash that the image does not use
USART1_UDRE = 37  # vector; the port is not used
# ldi r22, UDRIE1 | TXEN1; sts UCSR1B, r22: from then on its interrupt is pending for ever
PEND = b"\x68\xe2\x60\x93\xc9\x00"
# in r24, SPH; cpi r24, 3; brlo over; rcall to the first; over: rjmp to itself. Variables lie from
# 0x200 on: all of them are overwritten.
RECURSE = b"\x8e\xb7\x83\x30\x08\xf0\xfc\xdf\xff\xcf"

CAUSES = {"power_on": 1, "external": 2, "brown_out": 3, "watchdog": 4, "crash": 5}


def jump(to: int) -> bytes:
    """Encode `jmp`."""
    word = to // 2
    high = 0x940C | (word >> 16 & 1) | (word >> 17) << 4
    return high.to_bytes(2, "little") + (word & 0xFFFF).to_bytes(2, "little")


def patch(rig: FlightRig, address: int, code: bytes) -> None:
    """Overwrite program memory until the next start."""
    right = rig.chip.flash(address, len(code))
    rig.chip.load(Image({address: code}))

    def mend(_: int) -> None:
        rig.chip.load(Image({address: right}))

    rig.chip.on_start(mend)


def hang(rig: FlightRig, code: bytes) -> None:
    """Replace what every turn of the main loop calls."""
    patch(rig, rig.chip.symbols[NOW_US][0], code)


def overflow(rig: FlightRig) -> None:
    """Let the stack grow through all of RAM."""
    rig.chip.load(Image({SPARE: RECURSE}))
    hang(rig, jump(SPARE))


def storm(rig: FlightRig) -> None:
    """An interrupt that is always pending and takes 400 cycles: the main loop stands."""
    start = rig.chip.symbols[NOW_US][0]
    opening = rig.chip.flash(start, 4)
    if not all(_movable(opening[i : i + 2]) for i in (0, 2)):
        raise AssertionError("hal::now_us() does not begin as this fault expects")
    begin = PEND + opening + jump(start + 4)
    rig.chip.load(Image({SPARE: begin, SPARE + 0x100: NOP * 400 + RETI}))
    patch(rig, 4 * USART1_UDRE, jump(SPARE + 0x100))
    hang(rig, jump(SPARE))


def _movable(word: bytes) -> bool:
    """Whether an instruction may run elsewhere: in of SREG, cli or push."""
    code = int.from_bytes(word, "little")
    return code & 0xFE0F in (0xB60F, 0x920F) or code == 0x94F8


def came_back(cause: str, *, where: str = "") -> Check:
    """Make a check: relay released, cause said, recording again within 2 s, in a new session."""

    def check(seen: Seen) -> Sequence[str]:
        told = [event.arg for event in seen.events_of("reset")]
        rows = seen.log.frames["identity"]
        sessions = len(seen.log.sessions)
        wrong = [
            *expect(told == [CAUSES[cause]], f"reset causes reported: {told}"),
            *expect(released_ms(seen.rig, seen.begin) <= RELEASED_MS, "released late"),
            *expect(sessions == 2 and rows["resumed"][-1] == 1, f"{sessions} sessions"),
            *expect(rows["reset_cause"][-1] == CAUSES[cause], "another cause in the identity"),
            *expect(len(seen.rig.started) == 2, f"{len(seen.rig.started)} starts"),
        ]
        if where:
            start, size = seen.rig.chip.symbols[where]
            at = [event.arg for event in seen.events_of("crash")]
            inside = len(at) == 1 and start <= at[0] < start + size
            wrong += expect(inside, f"crash reported at {[hex(a) for a in at]}")
        return wrong

    return check


def row(number: str, injected: str, begin: object, check: Check) -> Fault:
    """Make a row of a program that starts anew."""
    assert callable(begin)
    return Fault(
        number, injected, "released in 50 ms, resumes in 2 s", begin,
        lossless=False, events=("reset",), engaged=False, check=check, resets=True,
    )  # fmt: skip


PROGRAM = (
    row("22", "watchdog reset", lambda r: r.chip.reset(ResetCause.WATCHDOG),
        came_back("watchdog")),
    row("22", "brown-out reset", lambda r: r.chip.reset(ResetCause.BROWN_OUT),
        came_back("brown_out")),
    row("22", "reset button", lambda r: r.chip.reset(ResetCause.EXTERNAL), came_back("external")),
    row("23", "main loop hangs", partial(hang, code=HANG), came_back("crash", where=NOW_US)),
    row("23", "hangs with interrupts off", partial(hang, code=HANG_WITHOUT_INTERRUPTS),
        came_back("watchdog")),
    row("23", "stack overflow", overflow, came_back("crash")),
    row("23", "interrupt storm", storm, came_back("crash")),
)  # fmt: skip
