"""Interrupts in assembly: the list is that of the sources, and what a compiler could do is seen."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import naked
import pytest
from disassembly import Program

ROOT = Path(__file__).resolve().parents[2]
BOARDS = {"atmega2560": "mega2560", "atmega328p": "arduimu"}
KEEP = """
  "push r24 \\n\\t" "in r24, 0x3f \\n\\t" "push r24 \\n\\t" "push r25 \\n\\t"
  {body}
  "pop r25 \\n\\t" "pop r24 \\n\\t" "out 0x3f, r24 \\n\\t" "pop r24 \\n\\t" "reti \\n\\t"
"""
FAULTS = {
    "": '"lds r25, 0x200 \\n\\t" "inc r25 \\n\\t" "sts 0x200, r25 \\n\\t"',
    "writes r18, which is not saved": '"lds r18, 0x200 \\n\\t"',
    "writes r26, which is not saved": '"adiw r26, 1 \\n\\t"',
    "expected none": '"call main \\n\\t"',
    "gives r25 back into r24": '"pop r24 \\n\\t"',
}


def program(tmp_path: Path, body: str) -> Program:
    """Compile one naked interrupt with this in its middle."""
    source, elf = tmp_path / "naked.c", tmp_path / "naked.elf"
    source.write_text(
        "#include <avr/interrupt.h>\nvoid arduimu_init3(void)"
        ' __attribute__((naked, used, section(".init3")));\n'
        "void arduimu_init3(void) { for (;;) { } }\n"
        f"ISR(WDT_vect, ISR_NAKED) {{ __asm__ __volatile__({body}); }}\nint main(void) {{ }}\n"
    )
    command = ["avr-gcc", "-Os", "-mmcu=atmega328p", str(source), "-o", str(elf)]
    subprocess.run(command, check=True, capture_output=True)
    return Program(elf)


@pytest.mark.parametrize("chip", BOARDS)
def test_list_is_that_of_the_sources(chip: str) -> None:
    text = "".join(
        path.read_text(encoding="utf-8")
        for path in (ROOT / "firmware" / "boards" / BOARDS[chip]).glob("*.cpp")
    )
    found = set(re.findall(r"ISR\((\w+)_vect, ISR_NAKED\)", text))
    found |= set(re.findall(r"void (\w+)\(void\) __attribute__\(\(naked", text))
    found.discard("USART##n##_UDRE")
    found |= {f"USART{n}_UDRE" for n in re.findall(r"^SEND_INTERRUPT\((\d)", text, re.MULTILINE)}
    assert found == set(naked.NAKED[chip])


@pytest.mark.parametrize("fault", FAULTS)
def test_what_is_not_saved_is_seen(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, fault: str
) -> None:
    monkeypatch.setattr(naked, "FREE", ("arduimu_init3",))
    found = naked.complaints(program(tmp_path, KEEP.format(body=FAULTS[fault])), "atmega328p")
    if fault:
        assert any(fault in line for line in found), found
    else:
        assert found == []
