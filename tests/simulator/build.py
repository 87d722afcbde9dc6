"""Build the chip simulator's shared library and the AVR programs of its own tests.

Needs gcc and libsimavr-dev; for the programs gcc-avr and avr-libc (Debian packages). Everything
goes to ``build/simulator`` in the root of the repository.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
OUT = HERE.parents[1] / "build" / "simulator"
LIBRARY = OUT / "libsimavr_bench.so"
HEADER = Path("/usr/include/simavr/sim_avr.h")

C_FLAGS = [
    *("-std=gnu11", "-O2", "-g", "-fPIC", "-shared", "-fvisibility=hidden"),
    *("-Wall", "-Wextra", "-Wconversion", "-Wshadow", "-Wundef", "-Werror"),
    # the library's own headers are not ours to repair
    *("-isystem", "/usr/include/simavr"),
]
AVR_FLAGS = [
    *("-DF_CPU=16000000UL", "-std=gnu11", "-Os", "-g"),
    *("-Wall", "-Wextra", "-Werror"),
]
# Programs for another chip than the ATmega2560.
PROGRAM_CHIPS = {"twi_master": "atmega328p"}


class BuildError(RuntimeError):
    """A tool or package is missing, or a compiler refused; the text says which and what to do."""


def _run(command: list[str], what: str) -> None:
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise BuildError(f"{what} failed:\n{done.stdout}{done.stderr}")


def _stale(target: Path, sources: list[Path]) -> bool:
    if not target.exists():
        return True
    made = target.stat().st_mtime
    return any(source.stat().st_mtime > made for source in sources)


def build_library() -> Path:
    """Compile the shim when it is older than its sources.

    Returns
    -------
    Path
        The shared library.

    Raises
    ------
    BuildError
        If gcc or libsimavr-dev is missing, or the compiler refuses the sources.
    """
    if not HEADER.exists():
        raise BuildError(
            f"libsimavr is missing: {HEADER} not found, expected Debian's package; "
            "run: apt install libsimavr-dev"
        )
    if shutil.which("gcc") is None:
        raise BuildError("gcc is missing, expected it on the PATH; run: apt install gcc")
    sources = sorted((HERE / "shim").glob("*.c"))
    if _stale(LIBRARY, [*sources, *(HERE / "shim").glob("*.h"), Path(__file__)]):
        OUT.mkdir(parents=True, exist_ok=True)
        # A name of its own until it is whole: two test runs may build at the same time.
        part = LIBRARY.with_suffix(f".{id(sources):x}.part")
        _run(
            ["gcc", *C_FLAGS, *map(str, sources), "-o", str(part), "-lsimavr", "-lm"],
            "compiling the shim",
        )
        part.replace(LIBRARY)
    return LIBRARY


def build_program(name: str) -> Path:
    """Compile ``programs/<name>.c`` for its chip when it is stale.

    Parameters
    ----------
    name : str
        File name without suffix.

    Returns
    -------
    Path
        The ELF.

    Raises
    ------
    BuildError
        If avr-gcc is missing or refuses the source.
    """
    if shutil.which("avr-gcc") is None:
        raise BuildError(
            "avr-gcc is missing, expected it on the PATH; run: apt install gcc-avr avr-libc"
        )
    source = HERE / "programs" / f"{name}.c"
    target = OUT / "programs" / f"{name}.elf"
    headers = list((HERE / "programs").glob("*.h"))
    if _stale(target, [source, *headers, Path(__file__)]):
        target.parent.mkdir(parents=True, exist_ok=True)
        chip = f"-mmcu={PROGRAM_CHIPS.get(name, 'atmega2560')}"
        command = ["avr-gcc", chip, *AVR_FLAGS, str(source), "-o", str(target)]
        _run(command, f"compiling {source.name}")
    return target


def main() -> int:
    """Build the library and every program; print what is there."""
    try:
        print(build_library())
        for source in sorted((HERE / "programs").glob("*.c")):
            print(build_program(source.stem))
    except BuildError as error:
        print(error, file=sys.stderr)
        return 6
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
