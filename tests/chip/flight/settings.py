"""The settings record of the firmware's EEPROM (core/settings.h) from firmware/settings.toml."""

from __future__ import annotations

import binascii
import json
import struct
import tomllib
import zlib

from flight.images import ROOT
from simavr_bench import Image

MAGIC = 0x5346
FORMATS = {"u8": "B", "i8": "b", "u16": "H", "i16": "h", "u32": "I", "i32": "i"}


def settings_image(**changed: int) -> Image:
    """Give an EEPROM that holds the default settings with some changed.

    Parameters
    ----------
    changed
        Raw values by field name of the frame `config`, for example ``rate_hz=200``.

    Returns
    -------
    Image
        To be loaded behind the program.

    Raises
    ------
    KeyError
        A name that the frame does not have.
    """
    text = (ROOT / "protocol" / "generated" / "schema.json").read_text()
    schema = json.loads(text)["schema"]
    config = next(frame for frame in schema["frames"] if frame["name"] == "config")
    values = _defaults()
    names = [row[0] for row in config["fields"]]
    for name in changed:
        if name not in names:
            raise KeyError(name)
    values |= changed
    body = b""
    for name, kind, *_ in config["fields"][1:]:
        if kind.startswith("char"):
            body += str(values[name]).encode().ljust(int(kind[5:-1]), b"\0")
        else:
            body += struct.pack("<" + FORMATS[kind], values[name])
    record = struct.pack("<HBB", MAGIC, schema["version"], len(body)) + body
    return Image(flash={}, eeprom={0: record + struct.pack("<I", zlib.crc32(record))})


def reference_image(reference_mv: int) -> Image:
    """Give the EEPROM record of the chip's reference voltage (core/supply.h)."""
    word = struct.pack("<H", reference_mv)
    return Image(flash={}, eeprom={4092: word + struct.pack("<H", binascii.crc_hqx(word, 0xFFFF))})


def _defaults() -> dict[str, int | str]:
    table = tomllib.loads((ROOT / "firmware" / "settings.toml").read_text())
    return {name: row["value"] for name, row in table.items()}
