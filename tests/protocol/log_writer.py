"""Write logs as the logger would, straight from protocol/README.md and the generated schema.

Knows nothing of the firmware and of the host package, so that it can be a truth for both.

    writer = LogWriter()                       # file id, session 1, nothing written yet
    writer.begin(rate_hz=100)                  # schema, config, identity, event session_start
    writer.put("event", t_us=5, code=24, arg=1)
    writer.extend([Timed(ident, finished_us), Timed(baro, baro_finished_us)])
    writer.end()                               # event session_end, last block
    data = writer.data()
    writer.truth("ident")                      # every ident row written, and the block it is in
"""

import io
import json
import struct
import zlib
from bisect import bisect_right
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

ROOT = Path(__file__).resolve().parents[2]
BLOCK = 512
HEADER = struct.Struct("<4sIIIIIHBB")
MAGIC = b"FLT1"
ROOM = 480
KIND_FRAMES = 0
KIND_SCHEMA = 1
SCHEMA_ROOM = ROOM - 4
CARD_ID = bytes.fromhex("03534453443332478000a1b2c3d41601")
NUMPY_TYPES = {
    "u8": "u1",
    "i8": "i1",
    "u16": "<u2",
    "i16": "<i2",
    "u32": "<u4",
    "i32": "<i4",
    "f32": "<f4",
}

Rows = NDArray[np.void]


def schema_text() -> bytes:
    """Return the schema text of the committed schema, as the log carries it."""
    path = ROOT / "protocol/generated/schema.json"
    return path.read_bytes().split(b"\n")[1]


def released_texts() -> list[bytes]:
    """Return the text of every schema that firmware was released with, today's first."""
    old = sorted((ROOT / "protocol/released").glob("*.json"))
    return [schema_text(), *(path.read_bytes().split(b"\n")[1] for path in old)]


def layouts(text: bytes) -> dict[str, np.dtype[np.void]]:
    """Return the packed dtype of every frame of a schema text; its first field is the id."""
    frames = json.loads(text)["frames"]
    return {
        frame["name"]: np.dtype([("id", "u1"), *(_column(row) for row in frame["fields"])])
        for frame in frames
    }


def ids(text: bytes) -> dict[str, int]:
    """Return the id of every frame of a schema text by its name."""
    return {frame["name"]: frame["id"] for frame in json.loads(text)["frames"]}


def number(table: str, word: str) -> int:
    """Return the number of a word of the committed schema's enums."""
    return int(json.loads(schema_text())["enum"][table][word])


def rows(name: str, length: int, /, **columns: object) -> Rows:
    """Make `length` rows of frame `name` of the committed schema; columns not named are 0."""
    text = schema_text()
    made = np.zeros(length, layouts(text)[name])
    made["id"] = ids(text)[name]
    for column, values in columns.items():
        made[column] = values
    return made


def file_id(card_id: bytes, session: int, first_block_before: bytes, card_block: int) -> int:
    """Return the id that every block of a file created so carries.

    `card_block` is the number of the file's first block on the card.
    """
    place = struct.pack("<I", card_block)
    return zlib.crc32(card_id + struct.pack("<I", session) + first_block_before[:508] + place)


def block(
    payload: bytes,
    *,
    file_id: int,
    session: int,
    sequence: int,
    schema_hash: int,
    dropped: int = 0,
    kind: int = KIND_FRAMES,
) -> bytes:
    """Build one block of 512 bytes around `payload`."""
    head = HEADER.pack(
        MAGIC, file_id, session, sequence, schema_hash, dropped, len(payload), kind, 0
    )
    body = head + payload.ljust(ROOM, b"\0")
    return body + struct.pack("<I", zlib.crc32(body))


def envelope(frame: bytes) -> bytes:
    """Put one frame (with its id) into its telemetry envelope."""
    body = bytes([len(frame)]) + frame
    return b"\xa5\x5a" + body + struct.pack("<H", crc16(body))


def crc16(data: bytes) -> int:
    """CRC-16/CCITT-FALSE, bit by bit on purpose: the peers use tables and libraries."""
    crc = 0xFFFF
    for byte in data:
        crc ^= byte << 8
        for _ in range(8):
            crc = (crc << 1 ^ 0x1021 if crc & 0x8000 else crc << 1) & 0xFFFF
    return crc


@dataclass(frozen=True, slots=True)
class Timed:
    """Rows of one frame and the unwrapped time at which each was finished, (n,) in us.

    `extend` merges several of them by that time; it is not written.
    """

    rows: Rows
    finished_us: NDArray[np.int64]


@dataclass(slots=True)
class _Truth:
    rows: list[Rows] = field(default_factory=list)
    blocks: list[NDArray[np.int64]] = field(default_factory=list)


class LogWriter:
    """Append-only writer of one log file.

    Parameters
    ----------
    sink
        Where blocks go; memory when not given.
    card_id, session, first_block_before, card_block
        What the file id is made of. `session` is also the first session's number.
    text
        Schema text, the committed one when not given.
    preallocated
        Size in bytes of the file until it is closed, as the frame `file` says.
    keep_truth
        Remember every row and its block for `truth`; leave out for files of gigabytes.
    """

    def __init__(
        self,
        sink: BinaryIO | None = None,
        *,
        card_id: bytes = CARD_ID,
        session: int = 1,
        first_block_before: bytes = bytes(BLOCK),
        card_block: int = 40_960,
        text: bytes | None = None,
        preallocated: int = 64 << 20,
        keep_truth: bool = True,
    ) -> None:
        self._sink: BinaryIO = io.BytesIO() if sink is None else sink
        self.text = schema_text() if text is None else text
        self.schema_hash = zlib.crc32(self.text)
        self.layouts = layouts(self.text)
        self.ids = ids(self.text)
        self._card_id = card_id
        self.preallocated = preallocated
        self.session = session
        self.file_id = file_id(card_id, session, first_block_before, card_block)
        self.sequence = 0
        self.dropped = 0
        self._open = bytearray()
        self._truth = {name: _Truth() for name in self.layouts} if keep_truth else None

    def begin(self, *, rate_hz: int = 100, t_us: int = 0, cause: str = "button") -> None:
        """Head a session: schema, frames `config`, `identity`, event `session_start`."""
        self.schema()
        self.head(rate_hz=rate_hz, t_us=t_us, resumed=cause == "resumed")
        self.put("event", t_us=t_us, code=1, arg=number("start_cause", cause))

    def head(self, *, rate_hz: int = 100, t_us: int = 0, resumed: bool = False) -> None:
        """Write the frames `config`, `identity` and `file`, as at each return of the schema."""
        self.put(
            "config",
            t_us=t_us,
            rate_hz=rate_hz,
            input_elevator=1,
            input_rudder=2,
            input_throttle=3,
            input_switch=4,
            switch_direct_max_us=1300,
            switch_mega_min_us=1700,
            throttle_idle_max_us=1100,
            telemetry=1,
            telemetry_baud=57600,
            telemetry_budget_byteps=2000,
            gps_source=1,
            aircraft=b"ultrastick25e",
        )
        self.put(
            "identity",
            t_us=t_us,
            session=self.session,
            card_id=np.frombuffer(self._card_id, np.uint8),
            boots=self.session,
            reset_cause=1,
            resumed=int(resumed),
            board=b"sitl",
            firmware=b"synthetic",
        )
        self.put("image", t_us=t_us, hash=0x600D1DEA)

        if "file" in self.ids:
            self.put("file", t_us=t_us, number=1, preallocated=self.preallocated)

    def schema(self) -> None:
        """Write the whole schema into blocks of its own."""
        self.flush()
        total = len(self.text)
        for offset in range(0, total, SCHEMA_ROOM):
            piece = self.text[offset : offset + SCHEMA_ROOM]
            self._finish(struct.pack("<HH", offset, total) + piece, KIND_SCHEMA)

    def put(self, name: str, **values: object) -> None:
        """Write one frame; fields not named are 0."""
        row = np.zeros(1, self.layouts[name])
        row["id"] = self.ids[name]
        for column, value in values.items():
            row[column] = value
        self.extend([Timed(row, np.zeros(1, np.int64))])

    def extend(self, streams: Sequence[Timed]) -> None:
        """Write all rows of `streams`, merged by the time at which they were finished."""
        streams = [stream for stream in streams if len(stream.rows)]
        count = sum(len(stream.rows) for stream in streams)
        if count == 0:
            return
        sizes = np.concatenate(
            [np.full(len(s.rows), s.rows.dtype.itemsize, np.int64) for s in streams]
        )
        order = np.argsort(np.concatenate([s.finished_us for s in streams]), kind="stable")
        block_of, position, block_count = self._pack(sizes[order])
        inverse = np.empty(count, np.int64)
        inverse[order] = np.arange(count)
        image = np.zeros((block_count, ROOM), np.uint8)
        image[0, : len(self._open)] = np.frombuffer(bytes(self._open), np.uint8)
        used = np.zeros(block_count, np.int64)
        used[0] = len(self._open)
        np.maximum.at(used, block_of, position + sizes[order])
        first = 0
        for stream in streams:
            at = inverse[first : first + len(stream.rows)]
            first += len(stream.rows)
            size = stream.rows.dtype.itemsize
            content = np.ascontiguousarray(stream.rows).view(np.uint8).reshape(-1, size)
            start = block_of[at] * ROOM + position[at]
            image.reshape(-1)[start[:, None] + np.arange(size)] = content
            in_log = np.argsort(at)
            self._remember(stream.rows[in_log], self.sequence + block_of[at[in_log]])
        finished = image.tobytes()
        for number in range(block_count - 1):
            start_byte = number * ROOM
            self._finish(finished[start_byte : start_byte + int(used[number])], KIND_FRAMES)
        last = (block_count - 1) * ROOM
        self._open = bytearray(finished[last : last + int(used[-1])])

    def drop(self, count: int, *, t_us: int | None = None) -> None:
        """Count frames as dropped and, if `t_us` is given, say so with an event."""
        self.dropped += count
        if t_us is not None:
            self.put("event", t_us=t_us & 0xFFFFFFFF, code=3, arg=count)

    def skip(self, count: int, *, content: bytes | None = None) -> None:
        """Leave `count` blocks unwritten: zeros, or `content`, stand in their place."""
        self.flush()
        self._sink.write(bytes(count * BLOCK) if content is None else content)
        self.sequence += count

    def resume(self, *, rate_hz: int = 100, t_us: int = 0, session: int | None = None) -> None:
        """Begin the session after a reset in flight: same file, next block, larger number."""
        self.flush()
        self.session = self.session + 1 if session is None else session
        self.dropped = 0
        self.begin(rate_hz=rate_hz, t_us=t_us, cause="resumed")

    def end(self, *, t_us: int = 0, cause: str = "button") -> None:
        """End the session with its event and write the open block."""
        self.put("event", t_us=t_us & 0xFFFFFFFF, code=2, arg=number("end_cause", cause))
        self.flush()

    def flush(self) -> None:
        """Write the open block, if anything is in it."""
        if self._open:
            payload = bytes(self._open)
            self._open.clear()
            self._finish(payload, KIND_FRAMES)

    def tail(self, content: bytes) -> None:
        """Append what the card held before: the part of a preallocated file not yet used."""
        self.flush()
        self._sink.write(content)

    def data(self) -> bytes:
        """Return the file; only for a writer into memory."""
        self.flush()
        if not isinstance(self._sink, io.BytesIO):
            raise TypeError("this writer writes to a sink of its caller")
        return self._sink.getvalue()

    def truth(self, name: str) -> tuple[Rows, NDArray[np.int64]]:
        """Return every row of frame `name` in log order and the sequence of its block."""
        if self._truth is None:
            raise TypeError("this writer was set not to keep the truth")
        kept = self._truth[name]
        if not kept.rows:
            return np.zeros(0, self.layouts[name]), np.zeros(0, np.int64)
        return np.concatenate(kept.rows), np.concatenate(kept.blocks)

    def truths(self) -> Mapping[str, tuple[Rows, NDArray[np.int64]]]:
        """Return `truth` of every frame by its name."""
        return {name: self.truth(name) for name in self.layouts}

    def _remember(self, written: Rows, blocks: NDArray[np.int64]) -> None:
        if self._truth is None:
            return
        name = next(n for n, number in self.ids.items() if number == int(written["id"][0]))
        self._truth[name].rows.append(written.copy())
        self._truth[name].blocks.append(blocks)

    def _pack(self, sizes: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64], int]:
        """Fill blocks greedily with whole frames; return block and position of each frame."""
        ends = np.cumsum(sizes)
        ends_list: list[int] = ends.tolist()
        firsts = [0]
        base = -len(self._open)  # stream position at which the current block's payload began
        bases = [base]
        while True:
            stop = bisect_right(ends_list, base + ROOM, firsts[-1])
            if stop == len(ends_list):
                break
            base = ends_list[stop - 1] if stop else 0
            firsts.append(stop)
            bases.append(base)
        counts = np.diff([*firsts, len(ends_list)])
        block_of = np.repeat(np.arange(len(firsts), dtype=np.int64), counts)
        position = ends - sizes - np.repeat(np.asarray(bases, np.int64), counts)
        return block_of, position, len(firsts)

    def _finish(self, payload: bytes, kind: int) -> None:
        self._sink.write(
            block(
                payload,
                file_id=self.file_id,
                session=self.session,
                sequence=self.sequence,
                schema_hash=self.schema_hash,
                dropped=self.dropped,
                kind=kind,
            )
        )
        self.sequence += 1


def _column(row: Sequence[object]) -> tuple[str, str] | tuple[str, str, tuple[int]]:
    name, kind = str(row[0]), str(row[1])
    base, _, length = kind.rstrip("]").partition("[")
    if base == "char":
        return name, f"S{length or 1}"
    return (name, NUMPY_TYPES[base], (int(length),)) if length else (name, NUMPY_TYPES[base])
