"""Flight cards made byte by byte from `packets.json`, and put into an EEPROM."""

from __future__ import annotations

import binascii
import json
import struct
import zlib
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any

from host.planning.onboard_sums import PITCH, ROLL, YAW, AxisCard

ROOT = Path(__file__).resolve().parents[2]
VALID_AT, CARD_AT, VALID = 1024, 1040, 0xC5  # app/card_store.h
EEPROM_BYTES = 4096
PULSE, DOUBLET, THREE_TWO_ONE_ONE, SWEEP, MULTISINE = range(1, 6)
FORMATS = {"u8": "B", "char": "s", "u16": "H", "i16": "h", "u32": "I", "f32": "f"}

# What the aircraft of these flights may do: wide where a flight does not ask for less.
HEAD: dict[str, Any] = {
    "magic": 0x4346, "version": 2, "aircraft": b"ultrastick25e",
    "airspeed_input": 4, "alpha_input": 0, "beta_input": 2,
    "dp_min": 2100, "dp_max": 3600, "alpha_min": 1200, "alpha_max": 2900,
    "beta_min": 1200, "beta_max": 2900, "phi_max": 6000, "theta_min": -3000, "theta_max": 3000,
    "p_max": 20000, "q_max": 12000, "r_max": 12000, "az_min": -24000, "az_max": 0,
    "height_min_pa": 200, "height_max_pa": 2400, "distance_max_m": 400, "still_ms": 500,
    "stick_us": 40, "servo_min_us": (1050, 1050, 1050), "servo_max_us": (1950, 1950, 1950),
    "amplitude_max_us": (200, 200, 200), "rate_max_usps": 4000, "frequency_max_chz": 500,
}  # fmt: skip
# `host tune --for mega` of the flight of `host simulate demo`, for the twin's servos of 25 deg in
# 400 us: a longer pulse rolls right, and pitches down.
HOLD: dict[str, Any] = {
    "model": b"ultrastick25e", "model_date": 20261128, "angle_gain": (3722, -5085),
    "integral_gain": (394, -545), "rate_gain": (240, -240), "authority_us": (100, 100),
}  # fmt: skip
ROW: dict[str, Any] = {"shape": DOUBLET, "axes": 2, "quiet_ms": 200, "duration_ms": 1000,
                       "amplitude_us": (0, 100, 0)}  # fmt: skip


@cache
def _layouts() -> dict[str, Any]:
    text = (ROOT / "protocol" / "generated" / "packets.json").read_text(encoding="utf-8")
    layouts: dict[str, Any] = json.loads(text)["layouts"]
    return layouts


def _packed(name: str, values: dict[str, Any]) -> bytes:
    """Return a layout's bytes; what is not given is zero."""
    out = b""
    for field, kind, *_ in _layouts()[name]["fields"]:
        base, _, length = kind.rstrip("]").partition("[")
        count = int(length or 1)
        value = values.get(field, b"" if base == "char" else 0)
        if base == "char":
            out += struct.pack(f"<{count}s", value)
        else:
            numbers = list(value) if isinstance(value, Sequence) else [value] * count
            numbers += [0] * (count - len(numbers))
            out += struct.pack(f"<{count}{FORMATS[base]}", *numbers)
    return out


def row(**changed: Any) -> bytes:
    """Return a row with its CRC; a doublet of the elevator where nothing else is said."""
    body = _packed("card_row", ROW | changed)[:-2]
    return body + struct.pack("<H", binascii.crc_hqx(body, 0xFFFF))


def axis_parts(learned: AxisCard) -> bytes:
    """Return the two parts of an axis that is learned."""
    values = {
        "axis": (PITCH, ROLL, YAW).index(learned.axis),
        "harmonic_count": len(learned.harmonics),
        "harmonics": learned.harmonics,
        "told": sum(1 << k for k, percent in enumerate(learned.wanted_percent) if percent),
        "advance_s": learned.advance_s,
        "curvature_s2": learned.curvature_s2,
        "lever": learned.lever,
        "product": learned.product,
    }
    worth = {name: getattr(learned, name) for name in ("gain", "tolerance", "wanted_percent")}
    return _packed("card_axis", values) + _packed("card_worth", worth)


def card(
    rows: Sequence[bytes],
    axes: Sequence[AxisCard] = (),
    axis_of_row: Sequence[int] = (),
    hold: Any = None,
    **changed: Any,
) -> bytes:
    """Return a whole card with its hash; `axis_of_row` counts `axes` from 1, 0 is none.

    `hold` are values as `HOLD`, if it holds; untyped, since callers spread dicts of numbers.
    """
    counts = {"rows": len(rows), "learned_axes": len(axes), "hold": int(hold is not None)}
    head = _packed("card_head", HEAD | counts | changed)[:-4]
    rest = _packed("card_learning", {"axis_of_row": axis_of_row or (0,)})
    rest += b"".join(rows) + b"".join(axis_parts(axis) for axis in axes)
    rest += b"" if hold is None else _packed("card_hold", hold)
    return head + struct.pack("<I", zlib.crc32(head + rest)) + rest


def card_hash(data: bytes) -> int:
    """Return the hash a card carries."""
    return int(struct.unpack_from("<I", data, 92)[0])


def eeprom_with(data: bytes, *, valid: int = VALID) -> bytes:
    """Return an erased EEPROM with the card in it."""
    content = bytearray(b"\xff" * EEPROM_BYTES)
    content[VALID_AT] = valid
    content[CARD_AT : CARD_AT + len(data)] = data
    return bytes(content)
