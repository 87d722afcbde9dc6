"""The hash of an image: of every byte of its flash but its own four, and found where it was put."""

from __future__ import annotations

import subprocess
from hashlib import sha256
from pathlib import Path

import image_hash
import pytest
from disassembly import ImageError

PROGRAM = """
#include <avr/pgmspace.h>
const unsigned char {symbol}[4] PROGMEM __attribute__((used)) = {{0}};
volatile int seed = {seed};
int main(void) {{ return seed + pgm_read_byte(&{symbol}[1]); }}
"""


def build(folder: Path, *, seed: int = 1, symbol: str = image_hash.SYMBOL) -> Path:
    """Link a small program for the Mega's chip."""
    source, elf = folder / "program.c", folder / f"{seed}{symbol}.elf"
    source.write_text(PROGRAM.format(seed=seed, symbol=symbol))
    command = ["avr-gcc", "-mmcu=atmega2560", "-Os", "-g", str(source), "-o", str(elf)]
    subprocess.run(command, check=True)
    return elf


def flash(elf: Path) -> bytes:
    """Bytes a programmer writes."""
    binary = elf.with_suffix(".bin")
    command = ["avr-objcopy", "-O", "binary", "-R", ".eeprom", str(elf), str(binary)]
    subprocess.run(command, check=True)
    return binary.read_bytes()


def test_stamp_changes_its_four_bytes_of_the_flash_and_no_other(tmp_path: Path) -> None:
    elf = build(tmp_path)
    before = flash(elf)
    assert image_hash.held_hash(elf) == 0
    value = image_hash.stamp(elf)
    after = flash(elf)
    assert value == image_hash.image_hash(elf) == image_hash.held_hash(elf)
    assert value == int.from_bytes(sha256(before).digest()[:4], "big")
    at = after.index(value.to_bytes(4, "little"))
    assert after[:at] + bytes(4) + after[at + 4 :] == before
    assert image_hash.stamp(elf) == value


def test_initial_values_of_variables_count(tmp_path: Path) -> None:
    one, other = (image_hash.stamp(build(tmp_path, seed=seed)) for seed in (1, 2))
    assert one != other


def test_an_image_changed_behind_the_build_is_found_out(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    elf = build(tmp_path)
    image_hash.stamp(elf)
    monkeypatch.setattr("sys.argv", ["image_hash.py", str(elf)])
    assert image_hash.main() == 0
    content = bytearray(elf.read_bytes())
    held = image_hash.held_hash(elf).to_bytes(4, "little")
    content[content.index(held) + 8] ^= 1
    elf.write_bytes(content)
    assert image_hash.main() == 6
    assert "expected" in capsys.readouterr().err


def test_an_image_without_a_place_for_it_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(ImageError, match="found no image_hash_bytes"):
        image_hash.stamp(build(tmp_path, symbol="another"))
