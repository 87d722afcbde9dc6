"""Parse the schema text of a log; every name and number is checked here, and only here.

A log may come from anybody. Its names become columns and file names, its numbers sizes and shifts,
so they are used unchecked after this. The limits are those of protocol/generator.
"""

from __future__ import annotations

import json
import re
import zlib
from collections.abc import Iterable, Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any, NoReturn

from host.errors import LogError
from host.resources import released_schemas, resource
from host.wire.read_fields import READ_BITS, READ_FIELDS, READ_IF_THERE, READ_WORDS
from host.wire.schema import TYPES, Field, Frame, Schema

_FORMAT = "flight-test-log"
_VERSION = 1
_TYPE = re.compile(r"(u8|i8|u16|i16|u32|i32|f32|char)(?:\[([1-9][0-9]{0,2})\])?")
_NAME = re.compile(r"[a-z][a-z0-9_]{0,31}")
_UNIT = re.compile(r"[A-Za-z0-9/]{0,16}")
# Windows takes these for devices, whatever their ending.
_DEVICES = re.compile(r"con|prn|aux|nul|(com|lpt)[0-9]")
_FRAME_BYTES = 128  # the longest a telemetry envelope carries
_WORDS = 256  # names in one table of bits or numbers, tables, fields of a frame
_RAW = (-(1 << 31), (1 << 32) - 1)
_SCALE = (1e-12, 1e12)
_DELAY_US = (-100_000, 100_000)
_QUOTED = 40  # characters of a stranger's text in an error


@lru_cache(maxsize=4)
def parse_schema(text: bytes) -> Schema:
    """Parse the schema text of a log.

    Parameters
    ----------
    text : bytes
        JSON as protocol/README.md describes it.

    Returns
    -------
    Schema

    Raises
    ------
    LogError
        If the text is no schema of a version this program knows, or a name or a number in it is
        not one that the format allows.
    """
    try:
        raw = json.loads(text.decode("ascii"), parse_constant=_no_number)
    except (ValueError, RecursionError) as error:
        raise LogError(f"the log's schema is not the JSON it should be: {_quote(error)}") from error
    head = _table(raw, "the schema")
    if head.get("format") != _FORMAT or head.get("version") != _VERSION:
        raise LogError(
            f"schema of format {_quote(head.get('format'))} version {_quote(head.get('version'))};"
            f" this program reads {_FORMAT!r} version {_VERSION}: install a newer host tool"
        )
    columns = [_name(one, "a column") for one in _list(head.get("columns"), "columns")]
    bits = {
        _name(name, "bits"): tuple(_names(words, f"bits {name}", 32))
        for name, words in _table(head.get("bits"), "bits").items()
    }
    enums = {
        _name(name, "enum"): {
            _name(word, f"enum {name}"): _whole(value, f"enum {name}", 0, 255)
            for word, value in _table(words, f"enum {name}").items()
        }
        for name, words in _table(head.get("enum"), "enum").items()
    }
    frames = tuple(_frame(one, columns) for one in _list(head.get("frames"), "frames"))
    _different((frame.name for frame in frames), "frame")
    _different((frame.id for frame in frames), "frame id")
    schema = Schema(text, frames, bits, enums)
    _check_what_is_read(schema)
    return schema


@lru_cache(maxsize=1)
def packed_schema() -> Schema:
    """Return the schema this host tool was built with.

    Logs that lost their own copy, and writers of synthetic logs, use it.
    """
    return parse_schema(_text_of(resource("schema.json")))


@lru_cache(maxsize=1)
def known_schemas() -> dict[int, bytes]:
    """Return the texts of all schemas that firmware was ever released with, by their hash."""
    texts = [_text_of(path) for path in (resource("schema.json"), *released_schemas())]
    return {zlib.crc32(text): text for text in texts}


def _text_of(path: Path) -> bytes:
    return path.read_bytes().split(b"\n")[1]


def _frame(raw: Any, columns: list[str]) -> Frame:
    row = _table(raw, "a frame")
    name = _name(row.get("name"), "a frame")
    if _DEVICES.fullmatch(name):
        _refuse(f"frame name {name!r}", "a name that is no device on any computer")
    rows = _list(row.get("fields"), f"frame {name}")
    fields = tuple(_field(dict(zip(columns, _list(one, name), strict=False))) for one in rows)
    _different((field.name for field in fields), f"field of frame {name}")
    frame = Frame(_whole(row.get("id"), f"id of frame {name}", 1, 255), name, fields)
    if not fields or (fields[0].name, fields[0].type) != ("t_us", "u32"):
        _refuse(f"frame {name}", "t_us of type u32 as its first field")
    if frame.size_bytes > _FRAME_BYTES:
        _refuse(f"frame {name} of {frame.size_bytes} bytes", f"at most {_FRAME_BYTES}")
    for field in fields:
        if field.age is not None and field.age not in {other.name for other in fields}:
            _refuse(f"age {field.age!r} of field {name}.{field.name}", "a field of the same frame")
    return frame


def _field(value: Mapping[str, Any]) -> Field:
    name = _name(value.get("name"), "a field")
    if name == "id":
        _refuse("a field called id", "another name: the frame's own id has it")
    kind = value.get("type")
    match = _TYPE.fullmatch(kind) if isinstance(kind, str) else None
    if match is None:
        _refuse(f"type {_quote(kind)} of field {name}", f"one of {' '.join(TYPES)} char, or [n]")
    unit = value.get("unit", "")
    if not isinstance(unit, str) or not _UNIT.fullmatch(unit):
        _refuse(f"unit {_quote(unit)} of field {name}", "at most 16 letters, digits, slashes")
    delay = value.get("delay_us")
    if isinstance(delay, dict):
        delay = {
            _whole(int(key) if key in tuple("01234567") else key, f"{name}: delay", 0, 7): _number(
                number, f"{name}: delay", *_DELAY_US
            )
            for key, number in delay.items()
        }
    elif delay is not None:
        delay = _number(delay, f"{name}: delay", *_DELAY_US)
    return Field(
        name=name,
        type=match.group(),
        unit=unit,
        scale=_number(value.get("scale", 1), f"{name}: scale", *_SCALE),
        invalid=_maybe_whole(value.get("invalid"), f"{name}: invalid", *_RAW),
        valid=_maybe_whole(value.get("valid"), f"{name}: valid", 0, 15),
        age=_maybe_name(value.get("age"), f"{name}: age"),
        delay_us=delay,
        table=_maybe_name(value.get("table"), f"{name}: table"),
    )


def _check_what_is_read(schema: Schema) -> None:
    """Refuse a schema without the fields and words that the table needs."""
    for name, wanted in (*READ_FIELDS.items(), *READ_IF_THERE.items()):
        if name not in schema.by_name:
            if name in READ_IF_THERE:
                continue
            _refuse(f"no frame {name}", "every frame of format version 1")
        found = {field.name: field.type for field in schema.by_name[name].fields}
        for field, kind in wanted.items():
            if found.get(field) != kind:
                _refuse(f"field {name}.{field} of type {found.get(field)}", f"type {kind}")
    for table, most in READ_BITS.items():
        if len(schema.bits.get(table, ())) > most:
            _refuse(f"{len(schema.bits[table])} names of bits in table {table}", f"{most} at most")
    for table, words in READ_WORDS.items():
        known = schema.enums.get(table) or schema.bits.get(table) or ()
        for word in words:
            if word not in known:
                _refuse(f"no word {word} in table {table}", "every word of format version 1")


def _refuse(found: str, expected: str) -> NoReturn:
    raise LogError(f"the log's schema has {found}; expected {expected}: not written by this logger")


def _quote(value: object) -> str:
    if isinstance(value, Exception):
        value = str(value)
    elif isinstance(value, list | dict):  # may be nested too deep to be shown
        return "a list" if isinstance(value, list) else "a table"
    text = ascii(value)
    return text if len(text) <= _QUOTED else f"{text[:_QUOTED]}..."


def _no_number(text: str) -> NoReturn:
    raise ValueError(f"{text} is no number")


def _table(value: object, where: str) -> dict[str, Any]:
    if not isinstance(value, dict) or len(value) > _WORDS:
        _refuse(
            f"{_quote(value)} as {_quote(where)}",
            f"a table of at most {_WORDS} entries",
        )
    return value


def _list(value: object, where: str) -> list[Any]:
    if not isinstance(value, list) or len(value) > _WORDS:
        _refuse(
            f"{_quote(value)} as {_quote(where)}",
            f"a list of at most {_WORDS} entries",
        )
    return value


def _name(value: object, where: str) -> str:
    if not isinstance(value, str) or not _NAME.fullmatch(value):
        _refuse(
            f"the name {_quote(value)} ({_quote(where)})",
            "a small letter, then at most 31 small letters, digits, underscores",
        )
    return value


def _names(value: object, where: str, most: int) -> list[str]:
    names = [_name(one, where) for one in _list(value, where)]
    if len(names) > most:
        _refuse(f"{len(names)} names in {_quote(where)}", f"at most {most}")
    _different(names, where)
    return names


def _maybe_name(value: object, where: str) -> str | None:
    return None if value is None else _name(value, where)


def _whole(value: object, where: str, low: int, high: int) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
        _refuse(
            f"{_quote(value)} as {_quote(where)}",
            f"a whole number from {low} to {high}",
        )
    return value


def _maybe_whole(value: object, where: str, low: int, high: int) -> int | None:
    return None if value is None else _whole(value, where, low, high)


def _number(value: object, where: str, low: float, high: float) -> float:
    if isinstance(value, int | float) and not isinstance(value, bool) and low <= value <= high:
        return float(value)
    _refuse(f"{_quote(value)} as {_quote(where)}", f"a number from {low:g} to {high:g}")


def _different(values: Iterable[object], where: str) -> None:
    seen: set[object] = set()
    for value in values:
        if value in seen:
            _refuse(f"{_quote(where)} {_quote(value)} twice", "each once")
        seen.add(value)
