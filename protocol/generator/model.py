"""Read frames.toml into typed records and refuse what a decoder could not live with."""

import re
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

# Bytes and C++ name of each number type. char is text, not a number.
NUMBERS: dict[str, tuple[int, str]] = {
    "u8": (1, "uint8_t"),
    "i8": (1, "int8_t"),
    "u16": (2, "uint16_t"),
    "i16": (2, "int16_t"),
    "u32": (4, "uint32_t"),
    "i32": (4, "int32_t"),
    "f32": (4, "float"),
    "char": (1, "char"),
}
SI_UNITS = ("us", "ms", "s", "Hz", "rad", "rad/s", "deg", "m", "m/s", "m/s2", "T", "Pa")
UNITS = frozenset((*SI_UNITS, "degC", "mV", "us/s", "s2", "count", "LSB", "byte", "byte/s", "baud"))
AXES = frozenset(("x", "y", "z", "north", "east", "down"))
# What a name that ends so must have as its unit.
SUFFIXES = {
    "_us": "us",
    "_ms": "ms",
    "_s": "s",
    "_hz": "Hz",
    "_mv": "mV",
    "_deg": "deg",
    "_mps": "m/s",
    "_m": "m",
    "_baud": "baud",
    "_byteps": "byte/s",
    "_pa": "Pa",
    "_usps": "us/s",
    "_chz": "Hz",
}
IDENT_LIMIT_BYTES = 68  # a ring of 4.45 kB then holds 500 ms at 100 Hz
FRAME_LIMIT_BYTES = 128  # the longest a telemetry envelope carries
VALUE_KEYS = ("name", "type", "unit", "scale", "axis", "invalid", "valid", "age", "delay_us")
FIELD_KEYS = frozenset((*VALUE_KEYS, "enum", "bits", "always", "doc"))
TOP_KEYS = frozenset(("version", "frame", "packet", "layout", "numbers", "bits", "enum"))
FRAME_KEYS = frozenset(("id", "name", "rate_hz", "doc", "field"))
PACKET_KEYS = frozenset(("name", "address", "doc", "field"))
LAYOUT_KEYS = frozenset(("name", "doc", "field"))
TYPE = re.compile(r"(u8|i8|u16|i16|u32|i32|f32|char)(?:\[([1-9][0-9]*)\])?")
NAME = re.compile(r"[a-z][a-z0-9_]*")

Delay = int | Mapping[str, int]


class SchemaError(Exception):
    """frames.toml says something that cannot be; the text is one line for a person."""


@dataclass(frozen=True, slots=True)
class Field:
    """One number (or array) of a frame; `offset` counts from the byte behind the id."""

    name: str
    base: str
    length: int  # 0: not an array
    offset: int
    unit: str
    scale: float
    axis: str
    invalid: int | None
    valid: int | None
    age: str | None
    delay_us: Delay | None
    table: str | None
    always: int | None
    doc: str

    @property
    def type(self) -> str:
        """Type as written in frames.toml."""
        return f"{self.base}[{self.length}]" if self.length else self.base

    @property
    def size(self) -> int:
        """Bytes of the whole field."""
        return NUMBERS[self.base][0] * max(self.length, 1)


@dataclass(frozen=True, slots=True)
class Frame:
    """A frame (with id), a packet on the I2C bus (with address), or a layout (with neither)."""

    id: int | None
    address: int | None
    name: str
    rate_hz: int | str
    doc: str
    fields: tuple[Field, ...]

    @property
    def body_size(self) -> int:
        """Bytes without the id."""
        return sum(field.size for field in self.fields)

    @property
    def wire_size(self) -> int:
        """Bytes in the log: the id and the body."""
        return self.body_size + 1


@dataclass(frozen=True, slots=True)
class Schema:
    """All of frames.toml."""

    version: int
    frames: tuple[Frame, ...]
    packets: tuple[Frame, ...]
    layouts: tuple[Frame, ...]
    numbers: dict[str, int]
    bits: dict[str, tuple[str, ...]]
    enums: dict[str, dict[str, int]]


def load(path: Path) -> Schema:
    """Read and check a frames.toml.

    Raises
    ------
    SchemaError
        With one line that names the frame and field, what was found and what was expected.
    """
    try:
        data = tomllib.loads(path.read_text(encoding="ascii"))
    except OSError as error:
        raise SchemaError(f"{path.name} cannot be read: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise SchemaError(f"{path.name}: byte {error.start} is not ASCII") from error
    except tomllib.TOMLDecodeError as error:
        raise SchemaError(f"{path.name} is not TOML: {error}") from error
    try:
        return parse(data)
    except SchemaError as error:
        raise SchemaError(f"{path.name}: {error}") from error


def parse(data: Mapping[str, object]) -> Schema:
    """Check the content of a frames.toml, already read, and give it types."""
    _only_keys(data, TOP_KEYS, "frames.toml")
    version = _integer(data.get("version"), "version", 1, 255)
    bits = {
        name: tuple(_text(bit, f"bits.{name}") for bit in _list(row, f"bits.{name}"))
        for name, row in _table(data.get("bits", {}), "bits").items()
    }
    enums = {
        name: {
            key: _integer(value, f"enum.{name}.{key}", 0, 255)
            for key, value in _table(row, f"enum.{name}").items()
        }
        for name, row in _table(data.get("enum", {}), "enum").items()
    }
    for name, row in enums.items():
        if len(set(row.values())) != len(row):
            raise SchemaError(f"enum.{name}: two names have one number")
    for name, names in bits.items():
        if len(set(names)) != len(names):
            raise SchemaError(f"bits.{name}: a name stands twice")
    frames = tuple(
        _frame(_table(row, "frame"), bits, enums, "frame")
        for row in _list(data.get("frame", []), "frame")
    )
    packets = tuple(
        _frame(_table(row, "packet"), bits, enums, "packet")
        for row in _list(data.get("packet", []), "packet")
    )
    layouts = tuple(
        _frame(_table(row, "layout"), bits, enums, "layout")
        for row in _list(data.get("layout", []), "layout")
    )
    numbers = {
        name: _integer(value, f"numbers.{name}", 0, 65535)
        for name, value in _table(data.get("numbers", {}), "numbers").items()
    }
    if not frames:
        raise SchemaError("no [[frame]] found, expected at least one")
    _unique([frame.id for frame in frames], "frame id")
    _unique([frame.name for frame in frames], "frame name")
    _unique([packet.name for packet in packets], "packet name")
    _unique([layout.name for layout in layouts], "layout name")
    _check_rates(frames)
    return Schema(version, frames, packets, layouts, numbers, bits, enums)


def _frame(
    row: Mapping[str, object],
    bits: Mapping[str, tuple[str, ...]],
    enums: Mapping[str, Mapping[str, int]],
    kind: str,
) -> Frame:
    name = _name(row.get("name"), kind)
    where = f"{kind} {name}"
    keys = {"frame": FRAME_KEYS, "packet": PACKET_KEYS, "layout": LAYOUT_KEYS}[kind]
    _only_keys(row, keys, where)
    framed = kind == "frame"
    number = _integer(row.get("id"), f"{where}: id", 1, 255) if framed else None
    addressed = kind == "packet"
    address = _integer(row.get("address"), f"{where}: address", 8, 119) if addressed else None
    rate = row.get("rate_hz") if framed else 0
    if isinstance(rate, bool) or not isinstance(rate, int | str):
        raise SchemaError(f"{where}: rate_hz is {rate!r}, expected a number or 'frame.field'")
    fields: list[Field] = []
    offset = 0
    for entry in _list(row.get("field"), f"{where}: field"):
        field = _field(_table(entry, f"{where}: field"), offset, where)
        fields.append(field)
        offset += field.size
    frame = Frame(number, address, name, rate, _text(row.get("doc"), where), tuple(fields))
    _check_frame(frame, where, bits, enums)
    return frame


def _field(row: Mapping[str, object], offset: int, where: str) -> Field:
    name = _name(row.get("name"), f"{where}: a field")
    where = f"{where}, field {name}"
    _only_keys(row, FIELD_KEYS, where)
    match = TYPE.fullmatch(str(row.get("type")))
    if match is None:
        raise SchemaError(
            f"{where}: type is {row.get('type')!r}, expected one of {' '.join(NUMBERS)}, TYPE[n]"
        )
    unit = str(row.get("unit", ""))
    if unit and unit not in UNITS:
        raise SchemaError(f"{where}: unit {unit!r} is not known to {Path(__file__).name}")
    physical = [key for key in ("scale", "axis", "age", "delay_us") if key in row]
    if "unit" not in row and physical:
        raise SchemaError(f"{where}: has {physical[0]} but no unit")
    for suffix, expected in SUFFIXES.items():
        if name.endswith(suffix) and unit != expected:
            raise SchemaError(f"{where}: unit is {unit!r}, its name asks for {expected!r}")
    axis = str(row.get("axis", ""))
    if axis and axis not in AXES:
        raise SchemaError(f"{where}: axis is {axis!r}, expected one of {' '.join(sorted(AXES))}")
    scale = row.get("scale", 1)
    if isinstance(scale, bool) or not isinstance(scale, int | float) or not scale > 0:
        raise SchemaError(f"{where}: scale is {scale!r}, expected a number above 0")
    base = match[1]
    age = row.get("age")
    tables = [str(row[key]) for key in ("enum", "bits") if key in row]
    if len(tables) > 1:
        raise SchemaError(f"{where}: has both enum and bits")
    return Field(
        name=name,
        base=base,
        length=int(match[2] or 0),
        offset=offset,
        unit=unit,
        scale=scale,
        axis=axis,
        invalid=_raw(row.get("invalid"), base, f"{where}: invalid"),
        valid=None if "valid" not in row else _integer(row["valid"], f"{where}: valid bit", 0, 31),
        age=None if age is None else _text(age, where),
        delay_us=_delay(row.get("delay_us"), where),
        table=tables[0] if tables else None,
        always=_raw(row.get("always"), base, f"{where}: always"),
        doc=_text(row.get("doc"), f"{where}: doc"),
    )


def _check_frame(
    frame: Frame,
    where: str,
    bits: Mapping[str, tuple[str, ...]],
    enums: Mapping[str, Mapping[str, int]],
) -> None:
    _unique([field.name for field in frame.fields], f"{where}: field")
    by_name = {field.name: field for field in frame.fields}
    if frame.id is not None:
        first = frame.fields[0] if frame.fields else None
        if first is None or (first.name, first.type) != ("t_us", "u32"):
            raise SchemaError(f"{where}: its first field must be t_us of type u32")
        limit = IDENT_LIMIT_BYTES if frame.name == "ident" else FRAME_LIMIT_BYTES
        if frame.wire_size > limit:
            raise SchemaError(f"{where}: {frame.wire_size} bytes with its id, at most {limit} fit")
    for field in frame.fields:
        at = f"{where}, field {field.name}"
        if field.table is not None and field.table not in (*bits, *enums):
            raise SchemaError(f"{at}: table {field.table!r} is in neither [bits] nor [enum]")
        needed = len(bits.get(field.table or "", ()))
        if needed > 8 * field.size:
            raise SchemaError(f"{at}: {needed} bits do not fit {field.type}")
        if field.age is not None and field.age not in by_name:
            raise SchemaError(f"{at}: age field {field.age!r} is not in the frame")
        if field.age is not None and by_name[field.age].unit != "us":
            raise SchemaError(f"{at}: age field {field.age!r} is not in us")
        if field.valid is not None:
            flags = by_name.get("valid")
            names = bits.get(flags.table or "", ()) if flags is not None else ()
            if field.valid >= len(names):
                raise SchemaError(
                    f"{at}: valid bit {field.valid} is out of range,"
                    f" the frame's `valid` has {len(names)} bits"
                )


def _check_rates(frames: tuple[Frame, ...]) -> None:
    known = {f"{frame.name}.{field.name}" for frame in frames for field in frame.fields}
    for frame in frames:
        if isinstance(frame.rate_hz, str) and frame.rate_hz not in known:
            raise SchemaError(f"frame {frame.name}: rate_hz names {frame.rate_hz!r}, no such field")


def _raw(value: object, base: str, where: str) -> int | None:
    if value is None:
        return None
    if base in ("f32", "char"):
        raise SchemaError(f"{where}: not possible for type {base}")
    bits = 8 * NUMBERS[base][0]
    low, high = (0, 2**bits - 1) if base[0] == "u" else (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)
    return _integer(value, where, low, high)


def _delay(value: object, where: str) -> Delay | None:
    if value is None:
        return None
    if isinstance(value, Mapping):
        return {
            str(
                _integer(int(key) if str(key).isdigit() else key, f"{where}: delay_us", 0, 7)
            ): _integer(delay, f"{where}: delay_us", -100_000, 100_000)
            for key, delay in value.items()
        }
    return _integer(value, f"{where}: delay_us", -100_000, 100_000)


def _integer(value: object, where: str, low: int, high: int) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
        raise SchemaError(f"{where} is {value!r}, expected a whole number from {low} to {high}")
    return value


def _text(value: object, where: str) -> str:
    if not isinstance(value, str):
        raise SchemaError(f"{where} is {value!r}, expected a text")
    return value


def _name(value: object, where: str) -> str:
    if not isinstance(value, str) or NAME.fullmatch(value) is None:
        raise SchemaError(f"{where} has the name {value!r}, expected lower_case letters")
    return value


def _list(value: object, where: str) -> list[object]:
    if not isinstance(value, list):
        raise SchemaError(f"{where} is {value!r}, expected a list")
    return value


def _table(value: object, where: str) -> dict[str, object]:
    if not isinstance(value, dict):
        raise SchemaError(f"{where} is {value!r}, expected a table")
    return value


def _only_keys(row: Mapping[str, object], allowed: frozenset[str], where: str) -> None:
    for key in row:
        if key not in allowed:
            raise SchemaError(f"{where}: key {key!r} is unknown")


def _unique(values: list[int | None] | list[str], where: str) -> None:
    for value in _repeated(values):
        raise SchemaError(f"{where} {value!r} stands twice")


def _repeated(values: list[int | None] | list[str]) -> Iterator[object]:
    seen: set[object] = set()
    for value in values:
        if value in seen:
            yield value
        seen.add(value)
