"""The same flight written three ways: our log, a PX4 ULog and an ArduPilot DataFlash log.

The two peers' writers are minimal, from their public descriptions (docs.px4.io/main/en/dev_log/
ulog_file_format.html; ArduPilot's LogStructure, FMT records). Both get what helps their readers:
ULog its sync message twice a second, DataFlash a modern GPS message for its clock.
"""

import struct
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tests.protocol.flights import ident, slow, write_flight
from tests.protocol.log_writer import LogWriter, Rows, Timed, rows

RATE_HZ = 100
START_US = 2_000_000
MINUTE_S = 60
ULOG_SYNC = b"\x2f\x73\x13\x20\x25\x0c\xbb\x12"
ULOG_TYPES = {"u1": "uint8_t", "u2": "uint16_t", "u4": "uint32_t", "i2": "int16_t", "i4": "int32_t"}
DATAFLASH_TYPES = {"u1": "B", "u2": "H", "u4": "I", "i2": "h", "i4": "i"}
DATAFLASH_COLUMNS = 15  # 16 columns fit a FMT record, the first is TimeUS
GPS_LABELS = {"itow_ms": "GMS", "week": "GWk"}


@dataclass(frozen=True, slots=True)
class Records:
    """Encoded records of one kind, (n, size) bytes, and the time that orders them, (n,)."""

    data: NDArray[np.uint8]
    order_us: NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Message:
    """One DataFlash message: 4 letters, the frame it comes from and the fields it carries."""

    name: str
    frame: str
    fields: tuple[str, ...]


def minute(number: int) -> list[Timed]:
    """Return the frames of one minute of flight, as `write_flight` makes them for our log."""
    rng = np.random.default_rng(number)
    start_us = START_US + number * MINUTE_S * 1_000_000
    count = MINUTE_S * RATE_HZ
    fast = ident(start_us, count, rate_hz=RATE_HZ, first_count=number * count, rng=rng)
    return [fast, *slow(start_us, MINUTE_S, rng=rng)]


def write_ours(path: Path, minutes: int) -> None:
    """Write our log."""
    with path.open("wb") as sink:
        writer = LogWriter(sink, keep_truth=False)
        writer.begin(rate_hz=RATE_HZ)
        for number in range(minutes):
            if number:
                writer.schema()
                writer.head(rate_hz=RATE_HZ)
            end_us = write_flight(
                writer,
                MINUTE_S,
                rate_hz=RATE_HZ,
                start_us=START_US + number * MINUTE_S * 1_000_000,
                first_count=number * MINUTE_S * RATE_HZ,
                seed=number,
            )
        writer.end(t_us=end_us & 0xFFFFFFFF)


def write_ulog(path: Path, minutes: int) -> None:
    """Write a ULog with sync messages, one topic per frame."""
    head = b"ULog\x01\x12\x35\x01" + struct.pack("<Q", START_US)
    head += _ulog_message("B", bytes(40))
    first = minute(0)
    for stream in first:
        name, columns = _name(stream), _columns(stream.rows)
        text = ";".join(f"{ULOG_TYPES[kind]} {column}" for column, kind in columns)
        head += _ulog_message("F", f"{name}:uint64_t timestamp;{text};".encode())
    for number, stream in enumerate(first):
        head += _ulog_message("A", struct.pack("<BH", 0, number) + _name(stream).encode())
    with path.open("wb") as sink:
        sink.write(head)
        for number in range(minutes):
            records = [_ulog_data(index, s) for index, s in enumerate(minute(number))]
            sink.write(interleave([*records, _ulog_sync(number)]))


def write_dataflash(path: Path, minutes: int) -> None:
    """Write a DataFlash log; a frame of more than 15 fields becomes several messages."""
    messages = dataflash_messages()
    with path.open("wb") as sink:
        sink.write(_fmt(128, 89, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns"))
        layouts = {_name(s): dict(_columns(s.rows)) for s in minute(0)}
        for number, message in enumerate(messages):
            kinds = [layouts[message.frame][column] for column in message.fields]
            size = 3 + 8 + sum(int(kind[1]) for kind in kinds)
            labels = [GPS_LABELS.get(f, f"c{i}") for i, f in enumerate(message.fields)]
            codes = "Q" + "".join(DATAFLASH_TYPES[kind] for kind in kinds)
            sink.write(_fmt(number + 1, size, message.name, codes, ",".join(["TimeUS", *labels])))
        for number in range(minutes):
            streams = {_name(s): s for s in minute(number)}
            records = [
                _dataflash_data(index + 1, message, streams[message.frame])
                for index, message in enumerate(messages)
            ]
            sink.write(interleave(records))


def dataflash_messages() -> list[Message]:
    """Return the messages that carry our frames."""
    names = {
        "ident": "ID",
        "mag": "MAG",
        "attitude": "AT",
        "baro": "BAR",
        "gps": "GP",
        "system": "SY",
    }
    messages = []
    for stream in minute(0):
        frame = _name(stream)
        fields = [column for column, _ in _columns(stream.rows)]
        for part, start in enumerate(range(0, len(fields), DATAFLASH_COLUMNS)):
            name = "GPS" if (frame, part) == ("gps", 0) else f"{names[frame]}{part}"
            chosen = tuple(fields[start : start + DATAFLASH_COLUMNS])
            messages.append(Message(name, frame, chosen))
    return messages


def interleave(records: Sequence[Records]) -> bytes:
    """Return all records one after the other in the order of their times."""
    sizes = np.concatenate([np.full(len(r.data), r.data.shape[1], np.int64) for r in records])
    order = np.argsort(np.concatenate([r.order_us for r in records]), kind="stable")
    ends = np.cumsum(sizes[order])
    start_of = np.empty(len(sizes), np.int64)
    start_of[order] = ends - sizes[order]
    image = np.empty(int(ends[-1]), np.uint8)
    first = 0
    for record in records:
        count, size = record.data.shape
        starts = start_of[first : first + count]
        image[starts[:, None] + np.arange(size)] = record.data
        first += count
    return image.tobytes()


def _name(stream: Timed) -> str:
    frames = ("ident", "mag", "attitude", "baro", "gps", "system")
    return frames[int(stream.rows["id"][0]) - 1]


def _columns(frame: Rows) -> list[tuple[str, str]]:
    """Return name and numpy code of every field but id and t_us, which the peers hold as time."""
    names = frame.dtype.names or ()
    return [(n, frame.dtype[n].str.lstrip("<|")) for n in names if n not in ("id", "t_us")]


def _time_us(stream: Timed) -> NDArray[np.int64]:
    """Return t_us unwrapped: the finishing time is within minutes of it."""
    lag = (stream.finished_us - stream.rows["t_us"].astype(np.int64)) & 0xFFFFFFFF
    return stream.finished_us - lag


def _packed(stream: Timed, fields: Sequence[str], head: bytes) -> NDArray[np.uint8]:
    kinds = dict(_columns(stream.rows))
    layout = np.dtype(
        [("head", f"V{len(head)}"), ("timestamp", "<u8"), *((f, "<" + kinds[f]) for f in fields)]
    )
    made = np.zeros(len(stream.rows), layout)
    made["head"] = np.void(head)
    made["timestamp"] = _time_us(stream)
    for name in fields:
        made[name] = stream.rows[name]
    return made.view(np.uint8).reshape(len(made), layout.itemsize)


def _ulog_message(kind: str, body: bytes) -> bytes:
    return struct.pack("<Hc", len(body), kind.encode()) + body


def _ulog_data(number: int, stream: Timed) -> Records:
    fields = [name for name, _ in _columns(stream.rows)]
    size = 2 + 8 + sum(stream.rows.dtype[name].itemsize for name in fields)
    head = struct.pack("<HcH", size, b"D", number)
    return Records(_packed(stream, fields, head), stream.finished_us)


def _ulog_sync(number: int) -> Records:
    record = np.frombuffer(_ulog_message("S", ULOG_SYNC), np.uint8)
    count = MINUTE_S * 2
    start_us = START_US + number * MINUTE_S * 1_000_000
    return Records(np.tile(record, (count, 1)), start_us + np.arange(count) * 500_000)


def _fmt(number: int, size: int, name: str, codes: str, labels: str) -> bytes:
    if len(codes) > 16 or len(labels) > 64:
        raise ValueError(f"{name}: {codes} {labels} do not fit a FMT record")
    body = struct.pack("<BB4s16s64s", number, size, name.encode(), codes.encode(), labels.encode())
    return b"\xa3\x95\x80" + body


def _dataflash_data(number: int, message: Message, stream: Timed) -> Records:
    head = b"\xa3\x95" + bytes([number])
    return Records(_packed(stream, message.fields, head), stream.finished_us)


def packed_idents(minutes: int) -> Rows:
    """Return the identification frames alone: what the numpy limit reads."""
    made = [minute(number)[0].rows for number in range(minutes)]
    return np.concatenate(made) if made else rows("ident", 0)
