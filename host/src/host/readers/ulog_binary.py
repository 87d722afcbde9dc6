"""PX4 ULog by numpy, from the log's own definitions.

The format has no checksum and no mark between messages. A message counts only if its head can be
one: of data the length has to be that of a subscribed topic. Whatever lies between counted messages
is searched through by numpy. Every byte is looked at once, whatever the file holds.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from host.progress import progress_bar
from host.readers.ulog_layout import Formats, LayoutError

HEAD_BYTES, FLAGS_BYTES = 16, 40
APPENDED = 1  # the only flag of the file's flags that changes how it is read
SYNC = np.frombuffer(b"\x2f\x73\x13\x20", "<u4")[0]
KINDS = np.isin(np.arange(256), np.frombuffer(b"BFIMPQARDLCSO", "u1"))
_LETTERS = np.isin(np.arange(256), np.frombuffer(
    b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz_/", "u1"))  # fmt: skip
_SUBSCRIPTION = ord("A")
_MESSAGE_HEAD, _LONGEST = 3, 3 + 65535
_BEHIND = 16  # bytes of the next portion that a head is judged by
_PORTION_BYTES, _FIRST_BYTES = 1 << 20, 1 << 14
MOST_SUBSCRIPTIONS = 1000  # PX4 subscribes 250 at most
MOST_INSTANCES = 16  # of a topic; PX4 has ten
MOST_PARAMETERS = 20_000  # PX4 has 2000
_NUMBERS = {b"int32_t": "<i", b"float": "<f"}
SAID = ("sys_name", "ver_sw_branch", "ver_hw")


class UnknownFlagsError(ValueError):
    """A log whose flags say that it is to be read in a way that is not known here."""


@dataclass(slots=True)
class Topic:
    """A subscribed topic that is read, and its messages' columns."""

    name: str
    instance: int
    packed: np.dtype[np.void]
    span: NDArray[np.intp]  # places of the columns' bytes in a message
    data: bytearray = field(default_factory=bytearray)

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the columns that are read."""
        return self.packed.names or ()

    def column(self, name: str) -> NDArray[Any]:
        """Return one column of all messages."""
        return np.frombuffer(self.data, self.packed)[name].copy()

    def first(self, name: str, most: int = 5) -> NDArray[Any]:
        """Return a column of the first messages."""
        count = min(most, len(self.data) // self.packed.itemsize)
        return np.frombuffer(self.data, self.packed, count)[name].copy()


@dataclass(slots=True)
class ULogContent:
    """What a log holds.

    Attributes
    ----------
    topics : list of Topic
    written : list of (str, float, float)
        Parameters as they were written: name, value, and the time, us, of the message before it; 0
        before logging began.
    said : dict of str to str
        Values of those information messages that are in `SAID`.
    dropouts, dropped_ms : int
        How often the card could not keep up, and for how long together.
    strange, strange_at : int
        Bytes that are no message, and where the first is.
    rest : int
        Bytes of a last message that is cut.
    refused : dict of str to str
        Why something of the log is not read.
    twice : list of str
        Topics that are defined again, and otherwise: the first definition counts.
    """

    topics: list[Topic] = field(default_factory=list)
    written: list[tuple[str, float, float]] = field(default_factory=list)
    said: dict[str, str] = field(default_factory=dict)
    dropouts: int = 0
    dropped_ms: int = 0
    strange: int = 0
    strange_at: int = 0
    rest: int = 0
    refused: dict[str, str] = field(default_factory=dict)
    twice: list[str] = field(default_factory=list)


def read_content(
    path: Path, wanted: Callable[[str], bool], read: Callable[[str, str], bool]
) -> ULogContent:
    """Read a log.

    Parameters
    ----------
    path : Path
    wanted : callable
        Says by a topic's name whether it is read.
    read : callable
        Says by a topic's name and a column's whether it is read.

    Raises
    ------
    UnknownFlagsError
    """
    reading = _Reading(path.stat().st_size, wanted, read)
    progress = progress_bar("reading", reading.size)
    with path.open("rb") as file:
        for first, end in _sections(file, reading.size):
            reading.section(file, first, end, progress)
    if reading.formats.left_out:
        reading.found.refused["formats"] = f"{reading.formats.left_out} definitions are too many"
    reading.found.twice = reading.formats.twice
    return reading.found


def _sections(file: BinaryIO, size: int) -> Iterator[tuple[int, int]]:
    """Yield begin and end of the log, and of what was appended behind it after a crash."""
    head = file.read(HEAD_BYTES + _MESSAGE_HEAD + FLAGS_BYTES)
    starts: list[int] = []
    if len(head) == HEAD_BYTES + _MESSAGE_HEAD + FLAGS_BYTES and head[18:19] == b"B":
        flags = struct.unpack_from("<8x8B3Q", head, HEAD_BYTES + _MESSAGE_HEAD)
        if any(flags[1:8]) or flags[0] & ~APPENDED:
            raise UnknownFlagsError
        if flags[0] & APPENDED:
            starts = sorted(at for at in flags[8:] if HEAD_BYTES < at < size)
    yield from zip([HEAD_BYTES, *starts], [*starts, size], strict=True)


class _Reading:
    """A log that is being read."""

    def __init__(
        self, size: int, wanted: Callable[[str], bool], read: Callable[[str, str], bool]
    ) -> None:
        self.size = size
        self.found = ULogContent()
        self._wanted, self._read = wanted, read
        self.formats = Formats()
        # By the number of a subscription: fewest and most bytes, and which topic that is read.
        self._fewest = np.full(1 << 16, 1 << 17)
        self._most = np.zeros(1 << 16, np.int64)
        self._topic = np.full(1 << 16, -1, np.int16)
        self._columns: dict[str, tuple[np.dtype[np.void], NDArray[np.intp]] | None] = {}
        self._known: dict[tuple[str, int], int] = {}
        self._subscribed = 0
        self._now_us = 0.0  # of the last message that is read

    def section(self, file: BinaryIO, first: int, end: int, progress: Any) -> None:
        """Read the messages between two places."""
        at, portion = first, _FIRST_BYTES
        run_at = run_end = first  # the last range that is no message
        while at + _MESSAGE_HEAD <= end:
            file.seek(at)
            data = file.read(min(portion + _LONGEST + _BEHIND, end - at))
            if len(data) <= _MESSAGE_HEAD:
                break
            went, subscribed, strange = self._portion(data, at, end, portion)
            for place, many in strange:
                run_at = run_at if at + place == run_end else at + place
                run_end = at + place + many
                self.found.strange_at = self.found.strange_at or run_at
                self.found.strange += many
            at += went
            portion = _FIRST_BYTES if subscribed else min(2 * portion, _PORTION_BYTES)
            if progress is not None:
                progress(at, self.size)
        self._ended(file, run_at if run_end == at else at, at, end)

    def _ended(self, file: BinaryIO, cut: int, at: int, end: int) -> None:
        """Tell a last message that is cut, from `cut` on, from bytes that are none."""
        found = self.found
        if end == self.size and not self._is_cut(file, cut, end):
            found.rest = end - at
            return
        found.strange -= at - cut  # what was appended begins anywhere in a message
        found.strange_at = found.strange_at if found.strange else 0
        found.rest = end - cut if end == self.size else 0

    def _is_cut(self, file: BinaryIO, at: int, end: int) -> bool:
        """Return whether a message can begin there that goes beyond the end."""
        file.seek(at)
        head = file.read(_MESSAGE_HEAD + _BEHIND)
        if len(head) < _MESSAGE_HEAD:
            return True
        view = np.frombuffer(head + bytes(_BEHIND), np.uint8)
        can_be = self._every_head(view, 1, _LONGEST)[0]
        return bool(can_be) and at + _MESSAGE_HEAD + (head[0] | head[1] << 8) > end

    def _portion(
        self, data: bytes, first: int, end: int, most: int
    ) -> tuple[int, bool, list[tuple[int, int]]]:
        """Read messages that begin in a portion.

        Returns
        -------
        went : int
            Bytes that are done with.
        subscribed : bool
            It ends behind a subscription: what follows is judged anew.
        strange : list of (int, int)
            Ranges that are no message: where in the portion, and how long.
        """
        view = np.frombuffer(data + bytes(_BEHIND), dtype=np.uint8)
        count = min(most, end - first - _MESSAGE_HEAD + 1)
        chain, at, subscribed = self._chain(data, view, count)
        if self._heads(view, chain, end - first).all():
            self._take(data, view, chain)
            return at, subscribed, []
        can_be = self._every_head(view, count, end - first).tobytes()
        starts: list[int] = []
        strange: list[tuple[int, int]] = []
        at, subscribed = 0, False
        while at < count:
            if not can_be[at]:
                to = can_be.find(1, at)
                to = to if to >= 0 else count if count == most else end - first
                strange.append((at, to - at))
                at = to
                continue
            starts.append(at)
            begun = at
            at += _MESSAGE_HEAD + (data[at] | data[at + 1] << 8)
            if data[begun + 2] == _SUBSCRIPTION and self._is_new(data, begun):
                subscribed = True
                break
        self._take(data, view, np.array(starts, dtype=np.int64))
        return at, subscribed, strange

    def _chain(
        self, data: bytes, view: NDArray[np.uint8], count: int
    ) -> tuple[NDArray[np.int64], int, bool]:
        """Return where messages begin if each is one, where the last ends, and whether that is a
        new subscription: what follows is judged by it."""
        places: list[int] = []
        at = 0
        while at < count:
            places.append(at)
            at += _MESSAGE_HEAD + (data[at] | data[at + 1] << 8)
        chain = np.array(places, dtype=np.int64)
        for k in np.flatnonzero(view[chain + 2] == _SUBSCRIPTION).tolist():
            if self._is_new(data, places[k]):
                return chain[: k + 1], (*places, at)[k + 1], True
        return chain, at, False

    def _is_new(self, data: bytes, at: int) -> bool:
        """Return whether the subscription there is the first of its number, and is taken."""
        if at + _MESSAGE_HEAD + 3 > len(data):  # cut off before its number
            return False
        number = data[at + 4] | data[at + 5] << 8
        return self._subscribed < MOST_SUBSCRIPTIONS and not self._most[number]

    def _every_head(self, view: NDArray[np.uint8], count: int, end: int) -> NDArray[np.bool_]:
        """Return of the first so many places whether a message can begin there and ends before
        `end`."""
        can_be = np.zeros(count, dtype=bool)
        at = np.flatnonzero(KINDS[view[2 : count + 2]])
        can_be[at] = self._heads(view, at, end)
        return can_be

    def _heads(
        self, view: NDArray[np.uint8], places: NDArray[np.int64], end: int
    ) -> NDArray[np.bool_]:
        """Return of some places whether a message can begin there and ends before `end`."""
        can_be = np.zeros(len(places), dtype=bool)
        length = view[places].astype(np.int64) | view[places + 1].astype(np.int64) << 8
        inside = (length > 0) & (places + _MESSAGE_HEAD + length <= end)
        at, length = places[inside], length[inside]
        kind = view[at + 2]
        first, second, third, fourth = (view[at + _MESSAGE_HEAD + k] for k in range(4))
        number = first.astype(np.int64) | second.astype(np.int64) << 8
        level = (first >= 0x30) & (first <= 0x37)
        rules = {
            "B": length == FLAGS_BYTES,
            "F": (length > 3) & _LETTERS[first],
            "IP": (first > 0) & (first + 1 <= length) & _LETTERS[second],
            "MQ": (first < 4) & (second > 0) & (second + 2 <= length) & _LETTERS[third],
            "A": (length > 3) & _LETTERS[fourth],
            "RO": length == 2,
            "L": (length > 8) & level,
            "C": (length > 10) & level,
            "S": (length == 8) & (number | third.astype(np.int64) << 16
                                  | fourth.astype(np.int64) << 24 == int(SYNC)),
            "D": (length - 2 >= self._fewest[number]) & (length - 2 <= self._most[number]),
        }  # fmt: skip
        right = np.zeros(len(at), dtype=bool)
        for kinds, rule in rules.items():
            for one in kinds.encode():
                right |= (kind == one) & rule
        can_be[inside] = right
        return can_be

    def _take(self, data: bytes, view: NDArray[np.uint8], starts: NDArray[np.int64]) -> None:
        """Take the messages of a portion that begin at these places."""
        kinds = view[starts + 2]
        rows = starts[kinds == ord("D")]
        which = self._topic[view[rows + 3].astype(np.int64) | view[rows + 4].astype(np.int64) << 8]
        rows, which = rows[which >= 0], which[which >= 0]
        timed = rows, which
        order = np.argsort(which, kind="stable")
        turns = np.flatnonzero(np.diff(which[order])) + 1
        for group in np.split(order, turns) if len(order) else ():
            topic = self.found.topics[which[group[0]]]
            whole = sliding_window_view(view, int(topic.span.max()) + 1)
            body = whole[rows[group] + _MESSAGE_HEAD + 2][:, topic.span]
            topic.data += body.tobytes()
        for at in starts[np.isin(kinds, np.frombuffer(b"FIPALO", "u1"))].tolist():
            length = data[at] | data[at + 1] << 8
            body_at = at + _MESSAGE_HEAD
            if data[at + 2] == ord("P"):
                self._pass(view, *timed, at)
            self._other(data[at + 2], data[body_at : body_at + length])
        self._pass(view, *timed, len(data))

    def _pass(
        self, view: NDArray[np.uint8], rows: NDArray[np.int64], which: NDArray[np.int16], at: int
    ) -> None:
        """Note the time of the last message that is read before a place."""
        before = int(np.searchsorted(rows, at)) - 1
        topic = self.found.topics[which[before]] if before >= 0 else None
        if topic is not None and "timestamp" in topic.columns:
            body = view[rows[before] + (_MESSAGE_HEAD + 2) + topic.span]
            self._now_us = float(body.view(topic.packed)["timestamp"][0])

    def _other(self, kind: int, body: bytes) -> None:
        if kind == ord("F"):
            self.formats.define(body.decode("ascii", "replace"))
        elif kind == _SUBSCRIPTION:
            self._subscribe(body[0], body[1] | body[2] << 8, body[3:])
        elif kind == ord("O"):
            self.found.dropouts += 1
            self.found.dropped_ms += body[0] | body[1] << 8
        elif kind == ord("P"):
            self._parameter(body[1 : 1 + body[0]], body[1 + body[0] :])
        elif kind == ord("I"):
            typed, _, key = body[1 : 1 + body[0]].decode("ascii", "replace").rpartition(" ")
            if key in SAID and typed.startswith("char["):
                value = body[1 + body[0] :].decode("utf-8", "replace")
                self.found.said.setdefault(key, value)

    def _parameter(self, key: bytes, value: bytes) -> None:
        kind, _, name = key.partition(b" ")
        if kind not in _NUMBERS or len(value) != 4 or len(name) > 32 or not name.isascii():
            return
        written = self.found.written
        if len(written) < MOST_PARAMETERS:
            number = float(struct.unpack(_NUMBERS[kind], value)[0])
            written.append((name.decode("ascii"), number, self._now_us))
        else:
            self.found.refused["parameters"] = f"only the first {MOST_PARAMETERS} parameters"

    def _subscribe(self, instance: int, number: int, raw: bytes) -> None:
        """Take a subscription; of two of a number the first counts."""
        if self._most[number]:
            return
        name = raw.decode("ascii", "replace")
        if self._subscribed == MOST_SUBSCRIPTIONS:
            self.found.refused["subscriptions"] = f"only {MOST_SUBSCRIPTIONS} subscriptions"
            return
        self._subscribed += 1
        try:
            self._fewest[number], self._most[number] = self.formats.sizes(name)
            if self._wanted(name) and instance < MOST_INSTANCES:
                self._topic[number] = self._topic_number(name, instance)
        except LayoutError as error:
            self.found.refused[name[:40]] = f"{str(error)[:120]}: no topic"

    def _topic_number(self, name: str, instance: int) -> int:
        if name not in self._columns:
            self._columns[name] = None
            self._columns[name] = self.formats.columns(name, lambda one: self._read(name, one))
        columns = self._columns[name]
        if columns is None:
            raise LayoutError(f"{name}: its columns are too many")
        if (name, instance) not in self._known:
            self._known[name, instance] = len(self.found.topics)
            self.found.topics.append(Topic(name, instance, *columns))
        return self._known[name, instance]
