"""The worst case of the stack: as the compiler says, and a fatter frame, recursion or a pointer."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import pytest
import stack_depth
from disassembly import ImageError, Program

# Kept apart by the optimiser: noinline, and no copies for constant arguments.
SOURCE = """
#include <avr/interrupt.h>
#include <avr/io.h>
#define APART __attribute__((noinline, noclone, used))
#ifndef ROOM
#define ROOM 20
#endif
volatile unsigned char sink;
APART void touch(volatile unsigned char* at, unsigned char size) {
  while (size-- != 0) sink = at[size];
}
APART void leaf(unsigned char a) {
  volatile unsigned char room[ROOM];
  touch(room, a);
}
APART void large(unsigned char a) {
  volatile unsigned char room[300];
  touch(room, a);
  sink = room[7];
}
APART int many(int a, int b, int c, int d, int e, int f, int g, int h, int i, int j) {
  return a + b * c + d + e + f + g + h + i + j + sink;
}
APART void chosen(unsigned char a) {
  switch (a) {
    case 0: leaf(3); break;
    case 1: sink = 4; break;
    case 2: large(2); break;
    case 3: sink = 9; break;
    case 4: PORTA = 1; break;
    case 5: leaf(7); break;
    case 6: PORTB = 2; break;
    case 7: sink = (unsigned char)many(1, sink, 3, sink, 5, 6, sink, 8, 9, sink); break;
  }
}
#ifdef RECURSES
APART void up(unsigned char a);
APART void down(unsigned char a) { if (a != 0) up(a - 1); PORTA = a; }
APART void up(unsigned char a) { down(a); PORTB = a; }
#endif
#ifdef GROWS
#include <alloca.h>
APART void grows(unsigned char a) { touch(alloca(a), a); sink = a; }
#endif
APART void deep(unsigned char a) {
  volatile unsigned char room[700];
  touch(room, a);
}
/* Behind the vectors: reads like one more that starts the program again. */
__attribute__((section(".progmem.gcc_sw_table"), used)) const unsigned bait[] = {0x940C, 0};
void (*volatile pointer)(unsigned char) = deep;
ISR(TIMER1_OVF_vect) { sink = 1; }
ISR(ADC_vect, ISR_NOBLOCK) { leaf(2); }
#ifdef SECOND
ISR(TWI_vect, ISR_NOBLOCK) { leaf(5); }
#endif
int main(void) {
  for (;;) {
    chosen(sink);
#ifdef RECURSES
    up(sink);
#endif
#ifdef GROWS
    grows(sink);
#endif
#ifdef POINTS
    pointer(sink);
#endif
  }
}
"""


def build(folder: Path, *flags: str) -> Path:
    """Compile the program for a Mega, with what the compiler says of its frames with it."""
    source = folder / "program.c"
    source.write_text(SOURCE)
    elf = folder / "program.elf"
    subprocess.run(
        [
            "avr-gcc",
            "-mmcu=atmega2560",
            "-O2",
            "-fno-optimize-sibling-calls",
            "-fstack-usage",
            *flags,
            "-o",
            elf,
            source,
        ],
        check=True,
        cwd=folder,
        capture_output=True,
    )
    return elf


def analysis(elf: Path) -> stack_depth.StackAnalysis:
    return stack_depth.StackAnalysis(
        Program(elf), chip=stack_depth.CHIPS["atmega2560"], indirect={}
    )


def total(elf: Path, indirect: dict[str, list[str]] | None = None) -> int:
    return stack_depth.analyse(elf, indirect=indirect or {}).total_bytes


def test_frames_are_those_the_compiler_reports(tmp_path: Path) -> None:
    elf = build(tmp_path)
    symbols = Program(elf).symbols
    walks = analysis(elf)
    reported = {}
    for line in next(tmp_path.glob("*.su")).read_text().splitlines():
        place, size, kind = line.split("\t")
        # "dynamic,bounded" leaves out what is pushed for a callee
        if kind == "static":
            reported[place.rsplit(":", 1)[1]] = int(size)
    assert len(reported) >= 7
    assert reported["large"] > 300
    # the compiler counts the return address of the function itself
    assert {name: walks.walk(symbols[name]).frame + 3 for name in reported} == reported


def test_deepest_chain_leads_through_the_switch_to_the_largest_frame(tmp_path: Path) -> None:
    found = stack_depth.analyse(build(tmp_path), indirect={})
    names = [link.function for link in found.main]
    assert names[1:] == ["main", "chosen", "large"]
    assert list(found.nesting) == [29]
    assert list(found.plain) == [20]


def test_a_fatter_frame_no_longer_fits(tmp_path: Path) -> None:
    lean, fat = tmp_path / "lean", tmp_path / "fat"
    lean.mkdir()
    fat.mkdir()
    small = build(lean, "-DROOM=20")
    large = build(fat, "-DROOM=520")
    room = total(small)
    # leaf was not on the deepest chain; now it is, and in the interrupt as well
    assert total(large) > room + 2 * 500 - 300
    assert stack_depth.print_depth(stack_depth.analyse(small, indirect={}), room)
    assert not stack_depth.print_depth(stack_depth.analyse(large, indirect={}), room)


def test_each_nesting_interrupt_counts_once(tmp_path: Path) -> None:
    one, two = tmp_path / "one", tmp_path / "two"
    one.mkdir()
    two.mkdir()
    first = stack_depth.analyse(build(one), indirect={})
    second = stack_depth.analyse(build(two, "-DSECOND"), indirect={})
    assert second.total_bytes - first.total_bytes == second.nesting[39]
    assert second.nesting[39] == second.nesting[29]


@pytest.mark.parametrize(
    ("flag", "says"),
    [
        ("-DRECURSES", "recursion: .*(up|down).* -> "),
        ("-DGROWS", "sets the stack from an unknown value"),
        ("-DPOINTS", "main at .* calls through a pointer"),
    ],
)
def test_what_has_no_bound_is_an_error(tmp_path: Path, flag: str, says: str) -> None:
    with pytest.raises(ImageError, match=says):
        total(build(tmp_path, flag))


def test_a_listed_pointer_costs_what_it_reaches(tmp_path: Path) -> None:
    elf = build(tmp_path, "-DPOINTS")
    found = stack_depth.analyse(elf, indirect={"^main$": ["^deep$"]})
    assert [link.function for link in found.main][1:] == ["main", "deep"]


def test_program_says_what_is_there_and_what_not(tmp_path: Path) -> None:
    script = Path(stack_depth.__file__)
    elf = build(tmp_path)
    for argument, code, says in (
        (elf, 0, r"worst case; \d+ B are there"),
        (tmp_path / "missing.elf", 2, "no such file"),
    ):
        done = subprocess.run(
            ["python3", script, argument], capture_output=True, text=True, check=False
        )
        assert done.returncode == code
        assert re.search(says, done.stdout + done.stderr)
        assert "Traceback" not in done.stderr
