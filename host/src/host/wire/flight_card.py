"""The bytes of a flight card: parts of 48 bytes, their fields, their checks.

Layouts and numbers are generated (`protocol/frames.toml`); what a good card is stands in
protocol/flight-card.md, and the logger asks the same before it makes a card valid.
"""

from __future__ import annotations

import json
import zlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from host.files.regular import regular_file
from host.resources import resource
from host.wire.framing import crc16
from host.wire.schema import Field
from host.wire.schema_text import packed_schema

_LONGEST_FILE = 48 * 64  # longer than any good card
HEAD, LEARNING, ROW = "card_head", "card_learning", "card_row"
AXIS, WORTH, HOLD = "card_axis", "card_worth", "card_hold"
AXES = ("aileron", "elevator", "rudder")
HELD = AXES[:2]  # by bank and by pitch: what a row may hold
TURNS = ("pitch", "roll", "yaw")  # of `card_axis.axis`
SHAPES = ("pulse", "doublet", "three_two_one_one", "sweep", "multisine")
# Highest frequency of a shape in units of 1/duration, times 100000 (flight-card.md).
FREQUENCY = {"pulse": 50_000, "doublet": 100_000, "three_two_one_one": 350_000}
MOST_SHARES = 252  # largest sum of the tones' shares on an axis; a share is in 64ths
TRAVEL_US = (800, 2200)
NONE = 255
# Sizes of an axis that is learned: firmware/core/learning/axis_card.h.
YAW, PITCH_SIGNALS, MOST_SIGNALS, MOST_SUMS = 2, 3, 5, 30


@dataclass(frozen=True, slots=True)
class CardFile:
    """A card as raw numbers by field name, the axes learned while it is flown, and its gains."""

    head: dict[str, Any]
    rows: tuple[dict[str, Any], ...]
    teaches: tuple[str, ...]  # of `TURNS`; empty: nothing
    hold: dict[str, Any] | None  # of `HOLD`; None: it holds no axis

    @property
    def hash(self) -> int:
        """The card's CRC-32, by which the logger names it."""
        return int(self.head["crc"])


@cache
def _table() -> dict[str, Any]:
    text = resource("packets.json").read_text(encoding="ascii")
    return dict(json.loads(text))


def number(name: str) -> int:
    """Return a number of the protocol, such as ``card_most_rows``."""
    return int(_table()["numbers"][name])


@cache
def fields(layout: str) -> tuple[Field, ...]:
    """Return the fields of `HEAD`, `LEARNING`, `ROW`, `AXIS`, `WORTH` or `HOLD`."""
    return tuple(
        Field(name=name, type=kind, unit=unit, scale=float(scale))
        for name, kind, unit, scale in _table()["layouts"][layout]["fields"]
    )


@cache
def dtype(layout: str) -> np.dtype[Any]:
    """Return the packed little-endian layout."""
    return np.dtype([(field.name, field.numpy_type) for field in fields(layout)])


def scale(layout: str, name: str) -> float:
    """Return one raw step of a field in its unit."""
    return {field.name: field.scale for field in fields(layout)}[name]


def card_file(path: Path) -> bytes:
    """Return a file's bytes, of no more than shows that it is no card; ask `card_faults` next.

    Raises
    ------
    UsageError
        There is no such file.
    """
    with regular_file(path).open("rb") as file:
        return file.read(_LONGEST_FILE + 1)


def card_bytes(
    head: Mapping[str, object],
    rows: Sequence[Mapping[str, object]],
    axes: Sequence[tuple[Mapping[str, object], Mapping[str, object]]] = (),
    axis_of_row: Sequence[int] = (),
    hold: Mapping[str, object] | None = None,
) -> bytes:
    """Return a card's file with its counts, constants and checks put in.

    Parameters
    ----------
    head, rows : mapping
        Raw numbers by field; what is left out is 0.
    axes : sequence of (mapping, mapping)
        `AXIS` and `WORTH` of what the logger learns in flight.
    axis_of_row : sequence of int
        Which of them while each row is flown, from 1; 0: none.
    hold : mapping, optional
        `HOLD`: gains of the axes that rows hold.
    """
    always = _table()["layouts"][HEAD]["always"]
    counts = {"learned_axes": len(axes), "hold": int(hold is not None)}
    first = _packed(HEAD, {**counts, **head, **always, "rows": len(rows)})
    named = [*axis_of_row, *[0] * (number("card_most_rows") - len(axis_of_row))]
    body = _packed(LEARNING, {"axis_of_row": named})
    for row in rows:
        bare = _packed(ROW, row)[:-2]
        body += bare + crc16(bare).to_bytes(2, "little")
    body += b"".join(_packed(AXIS, axis) + _packed(WORTH, worth) for axis, worth in axes)
    body += b"" if hold is None else _packed(HOLD, hold)
    return first[:-4] + zlib.crc32(first[:-4] + body).to_bytes(4, "little") + body


def _packed(layout: str, values: Mapping[str, object]) -> bytes:
    record = np.zeros(1, dtype=dtype(layout))
    for name, value in values.items():
        record[name] = value
    return record.tobytes()


def parts(data: bytes) -> list[bytes]:
    """Return the parts of 48 bytes."""
    size = number("card_part_bytes")
    return [data[i : i + size] for i in range(0, len(data), size)]


def read_card(data: bytes) -> CardFile:
    """Return a card in numbers; ask `card_faults` first: a bad one names what is not there."""
    head, rows = _head_and_rows(data)
    heads, each = number("card_head_parts"), parts(data)
    behind = heads + head["rows"]
    last = behind + number("card_axis_parts") * head["learned_axes"]
    learned = [
        _numbers(AXIS, part)["axis"] for part in each[behind : last : number("card_axis_parts")]
    ]
    hold = _numbers(HOLD, each[last]) if head["hold"] else None
    axes = _numbers(LEARNING, each[heads - 1])["axis_of_row"][: len(rows)]
    teaches = tuple(TURNS[learned[n - 1]] if n else "" for n in axes)
    return CardFile(head, tuple(rows), teaches, hold)


def _head_and_rows(data: bytes) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """Return a card's numbers that mean something by themselves."""
    head, heads = _numbers(HEAD, data), number("card_head_parts")
    rows = parts(data)[heads : heads + head["rows"]]
    return head, [_numbers(ROW, part) for part in rows]


def body_parts(head: bytes) -> int:
    """Return how many parts follow the first three: rows, two of each learned axis, the hold."""
    found = _numbers(HEAD, head)
    learned = number("card_axis_parts") * int(found["learned_axes"])
    return int(found["rows"]) + learned + int(found["hold"])


def held_axes(row: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the surfaces that a row holds."""
    bits = row["axes"] >> number("card_held_shift")
    return tuple(axis for k, axis in enumerate(AXES) if bits >> k & 1)


def read_row(part: bytes) -> dict[str, Any]:
    """Return one row in numbers."""
    return _numbers(ROW, part)


def _numbers(layout: str, data: bytes) -> dict[str, Any]:
    record = np.frombuffer(data, dtype=dtype(layout), count=1)[0]
    return {name: record[name].tolist() for name in dtype(layout).names or ()}


def card_faults(data: bytes) -> list[str]:
    """Return the faults of a card in words; a good card has none.

    Parameters
    ----------
    data : bytes
        Bytes of a file.
    """
    size, heads, most = (number(f"card_{n}") for n in ("part_bytes", "head_parts", "most_rows"))
    learned = number("card_axis_parts") * number("card_most_axes")
    found = len(data) // size - heads
    if len(data) % size or not 1 <= found <= most + learned + 1:
        return [
            f"{len(data)} bytes, expected {size} times {heads + 1} to {heads + most + learned + 1}:"
            " the head, 1 to 32 rows, two parts of each axis that is learned, one of the hold"
        ]
    said = _numbers(HEAD, data)
    rows = found - number("card_axis_parts") * said["learned_axes"] - said["hold"]
    if not 1 <= rows <= most or said["hold"] > 1:
        return [
            f"{found} parts behind the head and {found - rows} of them of learned axes and hold"
        ]
    always = _table()["layouts"][HEAD]["always"]
    head, each = _head_and_rows(data)
    wrong = [
        f"{k} is {head[k]}, expected {v}"
        for k, v in always.items()
        if np.any(np.asarray(head[k]) != v)
    ]
    if head["rows"] != rows:
        wrong.append(f"rows is {head['rows']}, expected {rows} as there are")
    body = dtype(HEAD).itemsize
    check = zlib.crc32(data[: body - 4] + data[body:])
    if head["crc"] != check or check == 0:
        wrong.append(f"CRC-32 is {head['crc']:08x}, expected {check:08x}: a byte was changed")
    wrong += [*_limit_faults(head), *_learning_faults(data, rows, head["learned_axes"])]
    if head["hold"]:
        wrong += _hold_faults(_numbers(HOLD, data[-size:]), head)
    return [*wrong, *(x for k, row in enumerate(each)
            for x in _row_faults(k + 1, row, head, data[(heads + k) * size :][:size]))]  # fmt: skip


def _learning_faults(data: bytes, rows: int, axes: int) -> Iterator[str]:
    if axes > number("card_most_axes"):
        yield f"learned_axes is {axes}, expected 0 to {number('card_most_axes')}"
    heads = number("card_head_parts")
    named = _numbers(LEARNING, parts(data)[heads - 1])["axis_of_row"][:rows]
    for place, axis in enumerate(named):
        if axis > axes:
            yield f"row {place + 1}: learns axis {axis}, expected 0 to {axes}"
        row = _numbers(ROW, parts(data)[heads + place])
        if axis and held_axes(row):
            yield f"row {place + 1}: holds and learns, expected one of both"
    behind = parts(data)[heads + rows : heads + rows + number("card_axis_parts") * axes]
    for n, part in enumerate(behind[:: number("card_axis_parts")]):
        axis = _numbers(AXIS, part)
        signals = MOST_SIGNALS if axis["axis"] else PITCH_SIGNALS
        if axis["axis"] > YAW or axis["told"] >> signals:
            yield f"learned axis {n + 1}: axis {axis['axis']}, told {axis['told']:05b}"
        count, most = axis["harmonic_count"], min(len(axis["harmonics"]), MOST_SUMS // signals)
        if not 1 <= count <= most:
            yield f"learned axis {n + 1}: {count} harmonics, expected 1 to {most}"
    for place, part in enumerate(behind):
        n, worth = divmod(place, number("card_axis_parts"))
        record = np.frombuffer(part, dtype=dtype(WORTH if worth else AXIS), count=1)
        for name in record.dtype.names or ():
            if record[name].dtype.kind == "f" and not np.isfinite(record[name]).all():
                yield f"learned axis {n + 1}: {name} is not finite"


def _hold_faults(hold: Mapping[str, Any], head: Mapping[str, Any]) -> Iterator[str]:
    for k, axis in enumerate(HELD):
        gain = hold["angle_gain"][k]
        others = (hold["integral_gain"][k], hold["rate_gain"][k])
        least = np.iinfo(np.int16).min  # it has no opposite
        if gain == 0 or least in (gain, *others) or any(gain * other < 0 for other in others):
            found = ", ".join(map(str, (gain, *others)))
            yield f"gains of the {axis} {found}, expected of one sign, the first not 0"
        most = head["amplitude_max_us"][k]
        if not 1 <= hold["authority_us"][k] <= most:
            yield f"authority of the {axis} {hold['authority_us'][k]} us, expected 1 to {most}"
    if any(hold["reserved"]):
        yield "reserved bytes of the hold are not 0"


def _limit_faults(head: Mapping[str, Any]) -> Iterator[str]:
    pairs = ("dp", "alpha", "beta", "theta", "az")
    for name in pairs:
        if head[f"{name}_min"] > head[f"{name}_max"]:
            yield f"{name}_min {head[f'{name}_min']} is above {name}_max {head[f'{name}_max']}"
    ranges = {
        "height_min_pa": (number("card_least_height_pa"), head["height_max_pa"]),
        "phi_max": (0, 18_000), "p_max": (0, 32_767), "q_max": (0, 32_767), "r_max": (0, 32_767),
        "distance_max_m": (0, number("card_most_distance_m")),
        "still_ms": (100, 2000), "stick_us": (10, 200), "rate_max_usps": (100, 60_000),
        "frequency_max_chz": (1, number("card_most_frequency_chz")),
    }  # fmt: skip
    for name, (least, largest) in ranges.items():
        if not least <= head[name] <= largest:
            yield f"{name} is {head[name]}, expected {least} to {largest}"
    inputs = {"airspeed_input": (4, 5), "alpha_input": (0, 1), "beta_input": (2, 3)}
    for name, known in inputs.items():
        if head[name] not in (*known, NONE):
            yield f"{name} is {head[name]}, expected {known[0]}, {known[1]} or {NONE}"
    for k, axis in enumerate(AXES):
        low, high = head["servo_min_us"][k], head["servo_max_us"][k]
        if not TRAVEL_US[0] <= low <= high <= TRAVEL_US[1]:
            yield f"travel of the {axis} {low} to {high} us, expected within 800 to 2200"
        if head["amplitude_max_us"][k] > number("card_most_amplitude_us"):
            yield f"amplitude_max_us of the {axis} is {head['amplitude_max_us'][k]}, at most 500"


def _row_faults(
    place: int, row: Mapping[str, Any], head: Mapping[str, Any], data: bytes
) -> Iterator[str]:
    shapes = {value: name for name, value in packed_schema().enums["card_shape"].items()}
    where, shape = f"row {place}", shapes.get(row["shape"], "")
    if row["crc"] != crc16(data[:-2]):
        yield f"{where}: CRC-16 is {row['crc']:04x}, expected {crc16(data[:-2]):04x}"
    if not shape:
        yield f"{where}: shape {row['shape']}, expected of {', '.join(SHAPES)}"
    moved = sum(1 << k for k, size in enumerate(row["amplitude_us"]) if size)
    said = row["axes"] & (1 << number("card_held_shift")) - 1
    if said != moved or not moved:
        yield f"{where}: axes {said:03b}, expected {moved:03b}: those with an amplitude"
    held = row["axes"] >> number("card_held_shift")
    if held and (held >= 1 << len(HELD) or held & moved or not head["hold"]):
        yield (
            f"{where}: holds {held:03b}, expected of {', '.join(HELD)}, none that it moves, and"
            " gains on the card"
        )
    longest, least = number("card_longest_ms"), number("card_least_ms")
    if row["duration_ms"] < least or row["duration_ms"] + row["quiet_ms"] > longest:
        yield (
            f"{where}: {row['duration_ms']} ms and {row['quiet_ms']} ms before, expected"
            f" {least} ms or more, together up to {longest}"
        )
    for k, size in enumerate(row["amplitude_us"]):
        if abs(size) > head["amplitude_max_us"][k]:
            yield (f"{where}: {AXES[k]} {size} us, expected up to {head['amplitude_max_us'][k]} us")
    tones = components(row)
    yield from (f"{where}: {text}" for text in _tone_faults(row, shape, tones))
    fastest = FREQUENCY.get(shape, 100_000 * max((t[1] for t in tones), default=0))
    if shape == "sweep":
        fastest = max(row["first_chz"], row["last_chz"]) * row["duration_ms"]
    if fastest > head["frequency_max_chz"] * row["duration_ms"]:
        yield (
            f"{where}: up to {fastest / row['duration_ms'] / 100.0:.2f} Hz, expected up to"
            f" {head['frequency_max_chz'] / 100.0:g} Hz"
        )


def components(row: Mapping[str, Any]) -> list[tuple[int, int, int, int]]:
    """Return axis, harmonic, share of 64 and phase of 256 of each used tone of a row."""
    data = row["components"]
    each = [data[i : i + 3] for i in range(0, len(data), 3)]
    return [(c >> 6, h, c & 63, phase) for h, phase, c in each if h]


def _tone_faults(
    row: Mapping[str, Any], shape: str, tones: Sequence[tuple[int, int, int, int]]
) -> Iterator[str]:
    used = 3 * len(tones)
    if any(row["components"][used:]) or (tones and shape != "multisine"):
        yield "bytes behind the last tone are not 0"
    if (shape == "sweep") != bool(row["first_chz"] or row["last_chz"]) or (
        shape == "sweep" and not (row["first_chz"] and row["last_chz"])
    ):
        yield f"sweep from {row['first_chz']} to {row['last_chz']}, expected both of a sweep only"
    if shape != "multisine":
        return
    for k, axis in enumerate(AXES):
        own = [share for place, _, share, _ in tones if place == k]
        if bool(own) != bool(row["axes"] >> k & 1):
            yield f"{len(own)} tones of the {axis}, expected them of each axis of the row only"
        if sum(own) > MOST_SHARES:
            yield f"shares of the {axis} add up to {sum(own)}, at most {MOST_SHARES}"
