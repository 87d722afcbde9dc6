"""Firmware images: ELF (with symbols) and Intel HEX, read without further libraries."""

from __future__ import annotations

import struct
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

_EEPROM_BASE = 0x810000
_RAM_BASE = 0x800000
_FLASH_SIZE = 262_144


@dataclass(frozen=True, slots=True)
class Image:
    """What goes into the chip.

    Attributes
    ----------
    flash : Mapping[int, bytes]
        Pieces of program memory by byte address.
    eeprom : Mapping[int, bytes]
        Pieces of EEPROM by address.
    symbols : Mapping[str, tuple[int, int]]
        Address and size in bytes; RAM addresses as the program sees them, flash in bytes.
    """

    flash: Mapping[int, bytes]
    eeprom: Mapping[int, bytes] = field(default_factory=dict)
    symbols: Mapping[str, tuple[int, int]] = field(default_factory=dict)


def _read_elf(data: bytes, path: Path) -> Image:
    if data[4] != 1 or struct.unpack_from("<H", data, 18)[0] != 83:
        raise ValueError(f"{path}: not an AVR ELF, expected a 32-bit file for machine 83")
    ph_offset, sh_offset = struct.unpack_from("<II", data, 28)
    ph_size, ph_count, sh_size, sh_count = struct.unpack_from("<HHHH", data, 42)
    flash: dict[int, bytes] = {}
    eeprom: dict[int, bytes] = {}
    for i in range(ph_count):
        kind, offset, _, physical, size = struct.unpack_from(
            "<IIIII", data, ph_offset + i * ph_size
        )
        if kind != 1 or size == 0:
            continue
        piece = data[offset : offset + size]
        if physical < _RAM_BASE:
            flash[physical] = piece
        elif physical >= _EEPROM_BASE and physical < _EEPROM_BASE + 4096:
            eeprom[physical - _EEPROM_BASE] = piece
    symbols: dict[str, tuple[int, int]] = {}
    sections = [struct.unpack_from("<10I", data, sh_offset + i * sh_size) for i in range(sh_count)]
    for section in sections:
        if section[1] != 2:  # SHT_SYMTAB
            continue
        strings = sections[section[6]][4]
        for at in range(section[4], section[4] + section[5], 16):
            name, value, size = struct.unpack_from("<III", data, at)
            end = data.index(b"\0", strings + name)
            text = data[strings + name : end].decode()
            if text:
                symbols[text] = (value & 0xFFFF if value >= _RAM_BASE else value, size)
    return Image(flash, eeprom, symbols)


def _read_hex(text: str, path: Path) -> Image:
    flash: dict[int, bytes] = {}
    base = 0
    for number, line in enumerate(text.split(), 1):
        raw = bytes.fromhex(line[1:]) if line[:1] == ":" else b""
        if len(raw) < 5 or sum(raw) & 0xFF or raw[0] + 5 != len(raw):
            raise ValueError(f"{path}: line {number} is not a whole Intel HEX record")
        address, kind, data = int.from_bytes(raw[1:3], "big"), raw[3], raw[4:-1]
        if kind == 0:
            flash[base + address] = data
        elif kind == 2:
            base = int.from_bytes(data, "big") << 4
        elif kind == 4:
            base = int.from_bytes(data, "big") << 16
    return Image(flash)


def read_image(path: Path) -> Image:
    """Read an ELF or Intel HEX file.

    Parameters
    ----------
    path : Path
        The file; an ELF is known by its first bytes.

    Returns
    -------
    Image
        Flash, EEPROM and, from an ELF, symbols.

    Raises
    ------
    ValueError
        If the file is neither, or does not fit the chip.
    OSError
        If it cannot be read.
    """
    data = path.read_bytes()
    if data[:4] == b"\x7fELF":
        image = _read_elf(data, path)
    elif data[:1] == b":":
        image = _read_hex(data.decode("ascii"), path)
    else:
        raise ValueError(f"{path}: neither ELF nor Intel HEX")
    for address, piece in image.flash.items():
        if address + len(piece) > _FLASH_SIZE:
            raise ValueError(f"{path}: {address + len(piece)} bytes of flash, the chip has 262144")
    return image
