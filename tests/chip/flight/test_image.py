"""What the flight image may hold, by either compiler: no heap, a budget, its own hash."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import pytest
import stack_depth
from compilers import TESTED
from image_hash import held_hash, image_hash

pytestmark = [
    pytest.mark.parametrize("flight_elf", TESTED, indirect=True),
    pytest.mark.costs(20, "an image is built anew"),
]

RAM_LIMIT_BYTES = 6600
# 253 952 are there; more than this is a mistake. 10 500 are what a row teaches, with its floats.
FLASH_LIMIT_BYTES = 130_000
STACK_LEFT_BYTES = 1200

HEAP = re.compile(r"^(malloc|free|realloc|calloc|__malloc_\w+|__brkval|_Zn[wa]\w*|_Zd[la]\w*)$")
FLOAT_TEXT = re.compile(r"^(vfprintf|vsnprintf|sprintf|printf|dtostre|dtostrf|__ftoa\w*|strtod)$")
FLOAT_MATH = re.compile(r"^__(add|sub|mul|div|cmp|le|ge|float\w*|fix\w*)sf\w*$")
# Who may reckon in floats: once a second, off the recording path (core/learning).
LEARNING = re.compile(r"EquationError|RowLearning|^__\w*sf\w*$|^__fp_\w+$|^(square|sqrt)\w*$")
DIVISION = re.compile(r"__(u?div|u?mod)\w+")


@pytest.fixture(scope="module")
def symbols(flight_elf: Path) -> set[str]:
    """Names of the linked image."""
    done = subprocess.run(["avr-nm", str(flight_elf)], capture_output=True, text=True, check=True)
    return {line.split()[-1] for line in done.stdout.splitlines()}


@pytest.mark.parametrize("refused", [HEAP, FLOAT_TEXT])
def test_image_is_free_of(symbols: set[str], refused: re.Pattern[str]) -> None:
    assert "main" in symbols
    assert [name for name in symbols if refused.match(name)] == []


def test_image_keeps_its_budget(flight_elf: Path) -> None:
    done = subprocess.run(["avr-size", str(flight_elf)], capture_output=True, text=True, check=True)
    text, data, bss = map(int, done.stdout.splitlines()[1].split()[:3])
    assert data + bss <= RAM_LIMIT_BYTES
    assert 8192 - data - bss >= STACK_LEFT_BYTES
    assert text + data <= FLASH_LIMIT_BYTES


def calls_of(elf: Path) -> dict[str, set[str]]:
    """Give who calls or jumps to whom, by linked names."""
    done = subprocess.run(
        ["avr-objdump", "-d", "--no-show-raw-insn", str(elf)],
        capture_output=True,
        text=True,
        check=True,
    )
    calls: dict[str, set[str]] = {}
    name = ""
    for line in done.stdout.splitlines():
        head = re.match(r"^[0-9a-f]+ <(.+)>:$", line)
        if head:
            name = head[1]
            calls[name] = set()
        else:
            target = re.search(r"\b(?:r?call|r?jmp)\b.*<([^+>]+)>", line)
            if target:
                calls[name].add(target[1])
    return calls


def test_only_the_learning_reckons_in_floats(flight_elf: Path) -> None:
    calls = calls_of(flight_elf)
    users = {name for name, called in calls.items() if any(map(FLOAT_MATH.match, called))}
    assert any("RowLearning" in name for name in users)
    assert [name for name in users if not LEARNING.search(name)] == []


def test_interrupts_never_divide(flight_elf: Path) -> None:
    calls = calls_of(flight_elf)
    vectors = [name for name in calls if re.match(r"^__vector_(\d+|nested_\w+|imu_\w+)$", name)]
    assert len(vectors) >= 10
    seen: set[str] = set()
    waiting = list(vectors)
    while waiting:
        at = waiting.pop()
        if at not in seen:
            seen.add(at)
            waiting += calls.get(at, set())
    assert [name for name in seen if DIVISION.search(name)] == []


def test_deepest_stack_fits(flight_elf: Path) -> None:
    found = stack_depth.analyse(flight_elf)
    assert found.total_bytes <= stack_depth.room_bytes(flight_elf)
    # every interrupt whose flag stays set lets the receiver's in: TWI, RX 2, UDRE 0, 2, 3
    assert {26, 29, 39, 51, 52, 55} <= set(found.nesting)
    assert 11 in found.plain


def test_image_is_made_by_the_compiler_asked_for(
    flight_elf: Path, request: pytest.FixtureRequest
) -> None:
    command = ["avr-readelf", "-p", ".comment", str(flight_elf)]
    said = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    wanted = request.node.callspec.params["flight_elf"]
    assert re.findall(r"GCC: \(GNU\) (\S+)", said) == [wanted]


def test_image_knows_its_hash(flight_elf: Path) -> None:
    assert held_hash(flight_elf) == image_hash(flight_elf) != 0
