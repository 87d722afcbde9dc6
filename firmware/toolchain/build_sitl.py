"""Build the firmware as a shared library for this computer: build/sitl/libsitl.so.

Compiles core, drivers, storage, app and boards/sitl with the compiler named by
CXX (default c++; g++ and clang++ both work). Only what changed is compiled
again. Import `build`, or run it: it prints the library.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
FIRMWARE = ROOT / "firmware"
LIBRARY = ROOT / "build" / "sitl" / "libsitl.so"
ROOMS = ("core", "core/learning", "drivers", "storage", "app", "boards/sitl")

INCLUDES = ("-Ifirmware", "-Iprotocol")
COMMON = ("-O2", "-g1", "-fPIC")
# A name nobody defines must fail here, not when the library is loaded; macOS does so by itself.
LINK = ("-shared", "-Wl,--no-undefined") if sys.platform == "linux" else ("-shared",)
STRICT = ("-Wall", "-Wextra", "-Wconversion", "-Wno-sign-conversion", "-Wshadow", "-Wundef")


class BuildError(Exception):
    """A compiler refused; the text holds its messages."""


@dataclass(frozen=True, slots=True)
class Unit:
    """One translation unit: its source, its object, the command without them."""

    source: Path
    target: Path
    command: tuple[str, ...]

    @property
    def dependencies(self) -> Path:
        """Return the file in which the compiler lists what it read."""
        return self.target.with_suffix(".d")

    def is_current(self) -> bool:
        """Say whether the object is newer than everything it was made from."""
        if not (self.target.is_file() and self.dependencies.is_file()):
            return False
        built = self.target.stat().st_mtime_ns
        _, _, names = self.dependencies.read_text().partition(":")
        read = [ROOT / name for name in names.replace("\\\n", " ").split()]
        return all(path.is_file() and path.stat().st_mtime_ns < built for path in read)

    def compile(self) -> None:
        """Compile to a name of this process, then rename: another build may be running."""
        self.target.parent.mkdir(parents=True, exist_ok=True)
        part = self.target.with_suffix(f".{os.getpid()}")
        listing = ["-MMD", "-MF", str(self.dependencies), "-MT", "object"]
        _run([*self.command, *listing, "-c", "-o", str(part), str(self.source)])
        part.replace(self.target)


def build(*, library: Path = LIBRARY, extra_flags: tuple[str, ...] = ()) -> Path:
    """Bring the library up to date.

    Parameters
    ----------
    library : Path
        Where it goes; objects go beside it.
    extra_flags : tuple of str
        Added to every compilation and to the link, for example sanitizers.

    Returns
    -------
    Path
        The library.

    Raises
    ------
    BuildError
        If a compiler or the linker fails.
    """
    cxx = os.environ.get("CXX", "c++")
    units = list(_units(library.parent, cxx, extra_flags))
    link = [cxx, *LINK, *extra_flags, *(str(unit.target) for unit in units)]

    # A change of compiler or flags is a change of every object.
    memory = library.parent / "commands.txt"
    commands = "\n".join([*(" ".join(unit.command) for unit in units), " ".join(link)])
    same = memory.is_file() and memory.read_text() == commands
    stale = [unit for unit in units if not (same and unit.is_current())]
    if not stale and library.is_file():
        return library
    memory.unlink(missing_ok=True)
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        list(pool.map(Unit.compile, stale))
    part = library.with_suffix(f".{os.getpid()}")
    _run([*link, "-o", str(part)])
    part.replace(library)
    memory.write_text(commands)
    return library


def _units(folder: Path, cxx: str, extra: tuple[str, ...]) -> Iterator[Unit]:
    command = (cxx, "-std=gnu++14", *STRICT, "-Werror", *INCLUDES, *COMMON, *extra)
    for room in ROOMS:
        for source in sorted((FIRMWARE / room).glob("*.cpp")):
            target = folder / source.relative_to(FIRMWARE).with_suffix(".o")
            yield Unit(source, target, command)


def _run(command: list[str]) -> None:
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise BuildError(f"{' '.join(command)}\n{done.stderr.strip()}")


def main() -> int:
    """Build and print the path of the library; 1 with the compiler's words if it fails."""
    parser = argparse.ArgumentParser(description="Build the firmware for this computer.")
    parser.parse_args()
    try:
        print(build())
    except BuildError as error:
        print(f"build_sitl: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
