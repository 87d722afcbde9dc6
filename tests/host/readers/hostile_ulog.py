"""ULogs that nobody's autopilot writes: each asks for more than its bytes are worth."""

from __future__ import annotations

import itertools
import struct
from collections.abc import Callable

MAGIC = b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 1)
TOPICS = ("sensor_combined", "vehicle_status", "actuator_outputs", "airspeed")


def message(kind: str, body: bytes) -> bytes:
    """Return a message of the format."""
    return struct.pack("<HB", len(body), ord(kind)) + body


def definition(name: str, fields: str) -> bytes:
    return message("F", f"{name}:{fields}".encode())


def subscription(name: str, number: int, instance: int = 0) -> bytes:
    return message("A", struct.pack("<BH", instance, number) + name.encode())


def data(number: int, body: bytes) -> bytes:
    return message("D", struct.pack("<H", number) + body)


def parameter(name: str, value: float) -> bytes:
    key = f"float {name}".encode()
    return message("P", bytes([len(key)]) + key + struct.pack("<f", value))


def nested(depth: int, count: int) -> bytes:
    """Return types in types, the widest of which a topic is."""
    inner = b"".join(
        definition(f"t{k}", f"t{k + 1}[{count}] x;") for k in range(depth)
    ) + definition(f"t{depth}", "uint64_t timestamp;")
    return inner + definition("airspeed", f"uint64_t timestamp;t0[{count}] x;")


def head(size: int = 4) -> bytes:
    """Return a good head: definitions, parameters, a topic that is subscribed and sent."""
    told = b"".join(parameter(f"P{k}", float(k)) for k in range(size))
    topic = definition("airspeed", "uint64_t timestamp;float true_airspeed_m_s;")
    rows = b"".join(data(1, struct.pack("<Qf", 10_000 * k, 15.0)) for k in range(1, 20))
    return MAGIC + topic + told + subscription("airspeed", 1) + rows


def clean(size: int) -> bytes:
    """Return a whole log of about so many bytes."""
    fields = "uint64_t timestamp;" + "".join(f"float f{k};" for k in range(12))
    row = struct.pack("<12f", *range(12))
    rows = range(1, size // 61 + 1)
    sent = (data(1, struct.pack("<Q", 4000 * k) + row) for k in rows)
    return head()[: len(MAGIC)] + definition("vehicle_status", fields) + (
        subscription("vehicle_status", 1) + b"".join(sent)
    )  # fmt: skip


def hostile(size: int) -> dict[str, Callable[[], bytes]]:
    """Return makers of logs of about `size` bytes, or as few as it takes, by what is wrong."""
    wide = "uint64_t timestamp;" + "".join(f"uint8_t f{k};" for k in range(500))
    wide_topics = b"".join(definition(name, wide) for name in TOPICS)

    def repeated(one: Callable[[int], bytes], before: bytes = b"") -> bytes:
        made, length = [head(), before], 0
        for k in itertools.count():
            made.append(one(k))
            length += len(made[-1])
            if length >= size:
                return b"".join(made)
        raise AssertionError

    def of_all_instances(k: int) -> bytes:
        number = 10 + k % 1000
        name, instance = TOPICS[number % len(TOPICS)], number // len(TOPICS) % 256
        told = subscription(name, number, instance) if k < 1000 else b""
        return told + data(number, struct.pack("<Q", 1000 * k) + bytes(500))

    return {
        "types of 1000 elements six deep": lambda: (
            MAGIC + nested(6, 1000) + subscription("airspeed", 1)
        ),
        "39 types of two each": lambda: MAGIC + nested(38, 2) + subscription("airspeed", 1),
        "a type in itself": lambda: (
            MAGIC + definition("airspeed", "airspeed[2] x;") + subscription("airspeed", 1)
        ),
        "nothing but 0xFF": lambda: head() + b"\xff" * size,
        "nothing but zeros": lambda: head() + bytes(size),
        "nothing but D": lambda: head() + b"D" * size,
        "nothing but heads of data": lambda: head() + b"\x0c\x00D\x01" * (size // 4),
        "empty messages": lambda: repeated(lambda k: message("D", b"")),
        "empty messages of another kind": lambda: repeated(lambda k: b"\0\0L"),
        "shortest messages": lambda: repeated(lambda k: message("O", b"\1\0")),
        "shortest data": lambda: repeated(
            lambda k: data(2, bytes([k % 256])),
            definition("vehicle_status", "uint8_t timestamp;") + subscription("vehicle_status", 2),
        ),
        "a byte astray between all": lambda: repeated(lambda k: message("O", b"\1\0") + b"\xff"),
        "subscriptions and bytes astray": lambda: repeated(
            lambda k: subscription("airspeed", k % 65536) + b"\xffDD"
        ),
        "subscriptions of wide topics": lambda: repeated(of_all_instances, wide_topics),
        "one topic too wide, subscribed again and again": lambda: repeated(
            lambda k: subscription("vehicle_status", k % 65536),
            definition("vehicle_status", "uint64_t timestamp;uint8_t[60000] x;"),
        ),
        "definitions": lambda: repeated(lambda k: definition(f"t{k}", "char a;" * 100)),
        "long definitions": lambda: repeated(lambda k: definition(f"t{k}", "char a;" * 9000)),
        "parameters": lambda: MAGIC + b"".join(parameter(f"P{k}", 1.0) for k in range(size // 22)),
        "lines of text": lambda: repeated(lambda k: message("L", b"6" + bytes(8) + b"x")),
        "longest messages": lambda: repeated(lambda k: message("D", bytes(65535))),
    }
