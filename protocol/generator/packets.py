"""packets.json: packets on the IMU's bus, layouts of the flight card, for programs not in C++.

They are not in the schema text: no log carries them.
"""

import json

from protocol.generator.model import Frame, Schema


def json_file(schema: Schema) -> str:
    """Return packets.json: fields of each packet and layout by its name, and the numbers."""
    head = '{"generator":"protocol/generate.py from protocol/frames.toml","packets":{\n'
    rows = [f"{_json(packet.name)}:{_json(_packet_row(packet))}" for packet in schema.packets]
    layouts = [f"{_json(layout.name)}:{_json(_row(layout))}" for layout in schema.layouts]
    return (
        head
        + ",\n".join(rows)
        + '\n},"layouts":{\n'
        + ",\n".join(layouts)
        + f'\n}},"numbers":{_json(schema.numbers)}}}\n'
    )


def _packet_row(packet: Frame) -> dict[str, object]:
    return {"address": packet.address} | _row(packet)


def _row(packet: Frame) -> dict[str, object]:
    return {
        "columns": ["name", "type", "unit", "scale"],
        "fields": [[f.name, f.type, f.unit, f.scale] for f in packet.fields],
        "always": {f.name: f.always for f in packet.fields if f.always is not None},
    }


def _json(value: object) -> str:
    return json.dumps(value, ensure_ascii=True, separators=(",", ":"))
