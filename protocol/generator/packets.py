"""packets.json: the packets on the IMU's bus for programs that are not C++.

They are not in the schema text: no log carries them.
"""

import json

from protocol.generator.model import Frame, Schema


def json_file(schema: Schema) -> str:
    """Return packets.json: address and fields of each packet by its name."""
    head = '{"generator":"protocol/generate.py from protocol/frames.toml","packets":{\n'
    rows = [f"{_json(packet.name)}:{_json(_packet_row(packet))}" for packet in schema.packets]
    return head + ",\n".join(rows) + "\n}}\n"


def _packet_row(packet: Frame) -> dict[str, object]:
    return {
        "address": packet.address,
        "columns": ["name", "type", "unit", "scale"],
        "fields": [[f.name, f.type, f.unit, f.scale] for f in packet.fields],
        "always": {f.name: f.always for f in packet.fields if f.always is not None},
    }


def _json(value: object) -> str:
    return json.dumps(value, ensure_ascii=True, separators=(",", ":"))
