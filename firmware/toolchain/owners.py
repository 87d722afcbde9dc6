"""Who owns the RAM and the flash of an AVR image: bytes by source file.

Flash comes from the line table of the image, so what was inlined elsewhere counts for the file it
was written in. RAM comes from the symbols; an object of a class is divided among the classes of its
members. Both need the debug information of GCC 5 (stabs); without it whole symbols are counted.
Variables are found in the sources by their names.

    python firmware/toolchain/owners.py .pio/build/mega2560/firmware.elf
"""

from __future__ import annotations

import argparse
import re
import sys
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from disassembly import demangle, run, section_bytes

ROOT = Path(__file__).resolve().parents[2]
LIBRARY = "(compiler's and C library)"
UNNAMED = "(without a name)"
LEAST_OBJECT = 64  # smaller ones are counted whole
# Rooms in which a name of a namespace is looked for first.
ROOMS = {
    "core": "firmware/core",
    "drivers": "firmware/drivers",
    "storage": "firmware/storage",
    "app": "firmware/app",
    "imu": "firmware/imu",
    "avr": "firmware/boards/avr",
    "mega": "firmware/boards/mega2560",
    "hal": "firmware/boards",
    "frames": "protocol/generated",
}
_STAB = re.compile(r"^\d+ +(\w+) +\d+ +\d+ +([0-9a-f]+) +\d+ *(.*)$")
_STRUCT = re.compile(r"^([\w:]+):Tt?(\(\d+,\d+\))=s(\d+)")
_MEMBER = re.compile(r"(\w+):(?:/\d)?(\(\d+,\d+\))((?:=[^:]*?)?),(\d+),(\d+);")
_ARRAY = re.compile(r"=ar.*;(\(\d+,\d+\))[^;]*$")  # the last type is that of its elements


class Sources:
    """Finds the file in which a class or a variable is defined."""

    def __init__(self, root: Path = ROOT) -> None:
        self._root = root
        patterns = ("firmware/**/*.h", "firmware/**/*.cpp", "protocol/generated/*.h")
        paths = [path for pattern in patterns for path in sorted(root.glob(pattern))]
        self._texts = {
            self.short(str(path.relative_to(root))): path.read_text(errors="replace")
            for path in paths
            if "boards/sitl" not in str(path)
        }

    @staticmethod
    def short(path: str) -> str:
        """Name of a file in the tables: as in the tree."""
        return path.removeprefix("./")

    def of_class(self, name: str) -> str | None:
        """File that defines a class; None if none or several do."""
        pattern = re.compile(rf"(?:class|struct|\}}) {re.escape(name)}\b(?! *[;&*(]|.*\);)")
        ending = re.compile(rf"^\}} {re.escape(name)};", re.MULTILINE)  # typedef of C
        found = [
            path
            for path, text in self._texts.items()
            if pattern.search(text) or ending.search(text)
        ]
        return found[0] if len(found) == 1 else None

    def of_variable(self, name: str) -> str:
        """File that defines a variable, its name as avr-c++filt gives it."""
        bare = name.rpartition("::")[2]
        room = ROOMS.get(name.partition("::")[0], "firmware/boards")
        defined = re.compile(
            rf"^(?!extern|#|//).*\b{re.escape(bare)}\b *"
            r"(?:\[|=|;|\{|\(|__attribute__|CORE_FLASH|FOR_THE|PROGMEM)",
            re.MULTILINE,
        )
        found = [path for path, text in self._texts.items() if defined.search(text)]
        found.sort(key=lambda path: (not path.startswith(room), path.endswith(".h"), path))
        return found[0] if found else LIBRARY


def ram_by_owner(elf: Path, sources: Sources | None = None) -> Counter[tuple[str, str]]:
    """Bytes of .data, .bss and .noinit by (file, variable or member)."""
    known = sources or Sources()
    layouts = _layouts(elf)
    result: Counter[tuple[str, str]] = Counter()
    for name, size in _symbols(elf, "bBdD"):
        owner = known.of_variable(name)
        bare = name.rpartition("::")[2]
        # Link-time optimisation leaves no types of variables: an object is of the class that is as
        # large as it is, give or take what the optimiser leaves out.
        whole = [
            key
            for key, layout in layouts.items()
            if layout.size >= LEAST_OBJECT and size - 2 <= layout.size <= size
        ]
        if len(whole) == 1:
            rest = size
            for member_owner, path, member_size in layouts[whole[0]].leaves(known, owner):
                result[member_owner, path] += member_size
                rest -= member_size
            result[owner, bare] += rest
        else:
            result[owner, bare] += size
    static = sum(section_bytes(elf, name) for name in (".data", ".bss", ".noinit"))
    result[UNNAMED, "constants the compiler made"] += static - sum(result.values())
    return +result


def flash_by_owner(elf: Path, sources: Sources | None = None) -> Counter[str]:
    """Bytes of code and constants by file."""
    known = sources or Sources()
    result: Counter[str] = Counter()
    placed: dict[int, int] = {}
    for file, start, size in _line_ranges(elf):
        ours = "/avr/include/" not in file and not file.endswith((".o", "/"))
        result[known.short(file) if ours else LIBRARY] += size
        placed[start] = size
    covered = sorted(placed)
    for name, size, address in _symbols_at(elf, "tTwW"):
        if not any(address <= at < address + size for at in covered):
            result[known.of_variable(name)] += size
    result[LIBRARY] += section_bytes(elf, ".text") - sum(result.values())
    return +result


class _Layout:
    """A class as the debug information describes it."""

    def __init__(self, name: str, size: int, unit: dict[str, _Layout]) -> None:
        self.name = name
        self.size = size
        self._unit = unit
        self.members: list[tuple[str, str, int, int]] = []  # name, type, offset, bytes

    def inner(self, name: str) -> tuple[int, int, _Layout | None]:
        """Offset, size and class of a member."""
        for member, kind, offset, size in self.members:
            if member == name:
                return offset, size, self._unit.get(kind)
        raise KeyError(f"class {self.name} has no member {name}")

    def leaves(self, sources: Sources, default: str) -> Iterable[tuple[str, str, int]]:
        """Owner, name and size of every member that is not of a class itself."""
        owner = sources.of_class(self.name.rpartition("::")[2]) or default
        for member, kind, _, size in self.members:
            inner = self._unit.get(kind)
            if inner is not None and inner.members and inner.size > 0:
                for leaf_owner, path, leaf in inner.leaves(sources, owner):
                    yield leaf_owner, path, leaf * (size // inner.size)
            else:
                yield owner, f"{self.name}::{member}", size


@dataclass(frozen=True, slots=True)
class Member:
    """A member of an object: where it is in it, its size, its own members' places and sizes.

    Of an array `fields` and `stride` are those of its elements.
    """

    offset: int
    size: int
    stride: int
    fields: dict[str, tuple[int, int]]


def find_member(elf: Path, root: str, path: str) -> Member:
    """Find a member of a class, for example ``find_member(elf, "Instrument", "pilot_.decoder_")``.

    Raises
    ------
    KeyError
        If the debug information has no such class or member.
    """
    layout: _Layout | None = _layouts(elf)[root]
    offset = size = 0
    for name in path.split("."):
        if layout is None:
            raise KeyError(f"{path}: {name} is a member of no class")
        more, size, layout = layout.inner(name)
        offset += more
    fields = {m[0]: (m[2], m[3]) for m in layout.members} if layout is not None else {}
    return Member(offset, size, layout.size if layout is not None else size, fields)


def _layouts(elf: Path) -> dict[str, _Layout]:
    """Classes by name; of a class that several units describe the one with most members."""
    best: dict[str, _Layout] = {}
    unit: dict[str, _Layout] = {}
    for kind, _, text in _stabs(elf):
        if kind == "SO":
            unit = {}
        head = _STRUCT.match(text) if kind == "LSYM" else None
        if head:
            layout = unit.setdefault(head[2], _Layout(head[1], int(head[3]), unit))
            body = re.sub(r"=xs\w+:", "", text[head.end() :])
            layout.members = []
            for member, kind_id, more, at, bits in _MEMBER.findall(body):
                array = _ARRAY.match(more)
                kind_id = array[1] if array else kind_id
                layout.members.append((member, kind_id, int(at) // 8, int(bits) // 8))
            if len(layout.members) > len(best[head[1]].members if head[1] in best else []):
                best[head[1]] = layout
    return best


def _stabs(elf: Path) -> Iterable[tuple[str, int, str]]:
    pending = ""
    for line in run(["avr-objdump", "-G", str(elf)]).splitlines():
        found = _STAB.match(line)
        if not found:
            continue
        if found[3].endswith("\\"):
            pending += found[3][:-1]
            continue
        yield found[1], int(found[2], 16), pending + found[3]
        pending = ""


def _line_ranges(elf: Path) -> Iterable[tuple[str, int, int]]:
    """File, first address and bytes of every run of lines."""
    sizes = {address: size for _, size, address in _symbols_at(elf, "tTwW")}
    file, start, at, end = "", 0, 0, 0
    for kind, value, text in _stabs(elf):
        if kind in ("FUN", "SO") and at < end:
            yield file, at, end - at
            at = end
        if kind == "FUN" and text:
            start = at = value
            end = start + sizes.get(start, 0)
        elif kind == "SOL":
            # Lines up to here belong to the file before.
            if at < value <= end:
                yield file, at, value - at
                at = value
            file = text
        elif kind == "SO":
            file = text
    if at < end:
        yield file, at, end - at


def _symbols_at(elf: Path, kinds: str) -> list[tuple[str, int, int]]:
    rows = []
    for line in run(["avr-nm", "--print-size", "--numeric-sort", str(elf)]).splitlines():
        parts = line.split(maxsplit=3)
        if len(parts) == 4 and parts[2] in kinds:
            rows.append((parts[3], int(parts[1], 16), int(parts[0], 16)))
    names = demangle([name for name, _, _ in rows])
    return [(name, size, at) for name, (_, size, at) in zip(names, rows, strict=True)]


def _symbols(elf: Path, kinds: str) -> list[tuple[str, int]]:
    return [(name, size) for name, size, _ in _symbols_at(elf, kinds)]


def room_of(file: str) -> str:
    """Folder of a file, as the tables group it."""
    return file.rpartition("/")[0] or file


def print_owners(elf: Path, *, least_bytes: int = 24) -> None:
    """Print RAM and flash by folder, RAM also by its largest variables."""
    sources = Sources()
    ram = ram_by_owner(elf, sources)
    flash = flash_by_owner(elf, sources)
    rooms: dict[str, list[int]] = {}
    for (file, _), size in ram.items():
        rooms.setdefault(room_of(file), [0, 0])[0] += size
    for file, size in flash.items():
        rooms.setdefault(room_of(file), [0, 0])[1] += size
    print(f"  {'owner':34} {'RAM, B':>8} {'flash, B':>9}")
    for room, (ram_bytes, flash_bytes) in sorted(rooms.items(), key=lambda row: -row[1][0]):
        print(f"  {room:34} {ram_bytes:8} {flash_bytes:9}")
    for (file, what), size in ram.most_common():
        if size >= least_bytes:
            print(f"  {size:6} B RAM  {what:40} {file}")


def main() -> int:
    """Print the tables of an image."""
    parser = argparse.ArgumentParser(description="Who owns RAM and flash of an AVR image.")
    parser.add_argument("elf", type=Path)
    asked = parser.parse_args()
    if not asked.elf.is_file():
        print(f"{asked.elf}: no such file; `pio run` makes it", file=sys.stderr)
        return 2
    print_owners(asked.elf)
    return 0


if __name__ == "__main__":
    sys.exit(main())
