"""The schema as the log carries it: JSON in ASCII on one line (README.md, "Schema")."""

import json
import zlib
from collections.abc import Mapping

from protocol.generator.model import Field, Frame, Schema

COLUMNS = ("name", "type", "unit", "scale", "axis", "invalid", "valid", "age", "delay_us", "table")
DEFAULTS: tuple[object, ...] = (None, None, "", 1, "", None, None, None, None, None)
TEXT_LIMIT_BYTES = 65_535  # offset and total of a schema block are u16


def pieces(schema: Schema) -> list[str]:
    """Return the schema text cut where a person would break the line; joined it is the text."""
    head = (
        f'{{"format":"flight-test-log","version":{schema.version},"columns":{_json(COLUMNS)},'
        '"frames":['
    )
    frames = [_json(_frame_row(frame)) for frame in schema.frames]
    tail = f'],"bits":{_json(schema.bits)},"enum":{_json(schema.enums)}}}'
    return [head, *(row + "," for row in frames[:-1]), frames[-1], tail]


def text(schema: Schema) -> str:
    """Return the schema text."""
    return "".join(pieces(schema))


def crc32(schema: Schema) -> int:
    """Return the schema hash that stands in every block."""
    return zlib.crc32(text(schema).encode("ascii"))


def json_file(schema: Schema) -> str:
    """Return schema.json: its second line is the schema text, byte for byte."""
    return (
        f'{{"generator":"protocol/generate.py from protocol/frames.toml","crc32":{crc32(schema)},'
        f'"schema":\n{text(schema)}\n}}\n'
    )


def _frame_row(frame: Frame) -> dict[str, object]:
    return {
        "id": frame.id,
        "name": frame.name,
        "rate_hz": frame.rate_hz,
        "fields": [_field_row(field) for field in frame.fields],
    }


def _field_row(field: Field) -> list[object]:
    row: list[object] = [
        field.name,
        field.type,
        field.unit,
        field.scale,
        field.axis,
        field.invalid,
        field.valid,
        field.age,
        dict(field.delay_us) if isinstance(field.delay_us, Mapping) else field.delay_us,
        field.table,
    ]
    while len(row) > 2 and row[-1] == DEFAULTS[len(row) - 1]:
        row.pop()
    return row


def _json(value: object) -> str:
    return json.dumps(value, ensure_ascii=True, separators=(",", ":"))
