"""Frames of the slower kinds in units and words: the recorder's health, GPS, pressure, settings."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

from host.live.live_sample import SlowFrame
from host.text import shown
from host.wire.schema import Field, Schema

_RAIL_DIVIDER = 2.0  # 10 k over 10 k (hw/pin_map.toml, net of rail)
_RAIL_COUNTS = 1024.0


def slow_reading(schema: Schema, frame: SlowFrame) -> dict[str, Any]:
    """Return what a frame says: numbers in its units, None where it has no value, enums as words.

    Parameters
    ----------
    schema : Schema
    frame : SlowFrame

    Returns
    -------
    dict
        By field; bits as a list of names, text without its padding. A `system` frame has `rail_v`
        and `supply_v` too.
    """
    raw = frame.row.item()
    out = {name: read(raw[at]) for at, name, read in _readers(_Kept(schema), frame.name)}
    if frame.name == "system":
        supply_mv, rail = out["avcc_mv"], out["rail"]
        out["supply_v"] = supply_mv * 1e-3 if supply_mv else None
        known = supply_mv and rail is not None
        out["rail_v"] = rail * _RAIL_DIVIDER * out["supply_v"] / _RAIL_COUNTS if known else None
    return out


class _Kept:
    """A schema as the key of what is kept: by the hash of its text."""

    def __init__(self, schema: Schema) -> None:
        self.schema = schema

    def __hash__(self) -> int:
        return self.schema.hash

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Kept) and other.schema.hash == self.schema.hash


@cache
def _readers(kept: _Kept, name: str) -> list[tuple[int, str, Callable[[Any], Any]]]:
    """Return place, name and reading of each field of a frame; its id stands first."""
    fields = kept.schema.by_name[name].fields
    return [(at, one.name, _reader(kept.schema, one)) for at, one in enumerate(fields, start=1)]


def _reader(schema: Schema, field: Field) -> Callable[[Any], Any]:
    """Return what makes a value of a raw one."""
    if field.type.startswith("char"):
        return lambda raw: shown(raw.rstrip(b"\0"))
    if "[" in field.type:
        return lambda raw: [int(one) for one in raw]
    if field.table in schema.enums:
        words = {n: word.replace("_", " ") for word, n in schema.enums[field.table].items()}
        return lambda raw: words.get(raw, f"unknown ({raw})")
    if field.table in schema.bits:
        names = schema.bits[field.table]
        return lambda raw: [name for at, name in enumerate(names) if raw >> at & 1]
    invalid, scale = field.invalid, field.scale
    if scale == 1.0:
        return lambda raw: None if raw == invalid else raw
    return lambda raw: None if raw == invalid else raw * scale
