"""Build a fuzz target of the firmware with clang's libFuzzer and run it.

    python -m tests.fuzz.targets rc_decoder --runs 2000
    python -m tests.fuzz.targets rc_decoder --merge     keep what is new in tests/data/fuzz

Under address and undefined-behaviour sanitizers. An input that breaks
a rule stays in build/fuzz/failures; `--input FILE` repeats it. Exit codes: 0, 6 for a broken rule,
1 where nothing could be built.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
SOURCES = Path(__file__).resolve().parent / "targets"
OUT = ROOT / "build" / "fuzz"
CORPORA = ROOT / "tests" / "data" / "fuzz"

FLAGS = (
    *("-std=gnu++14", "-O1", "-g", "-fno-omit-frame-pointer"),
    *("-fsanitize=fuzzer,address,undefined", "-fno-sanitize-recover=all"),
    *("-Wall", "-Wextra", "-Werror", "-Ifirmware", "-Iprotocol", "-Itests/fuzz/targets"),
)
LIMITS = ("-timeout=20", "-rss_limit_mb=1024")
BROKEN = 6
_TELLS = re.compile(r"not so: |runtime error: |ERROR: ")  # where the words about a fault begin


class FuzzError(Exception):
    """Nothing was run; the text says what is missing."""


@dataclass(frozen=True, slots=True)
class Target:
    """One program: what it links and how long its inputs may be."""

    units: tuple[str, ...]  # patterns below firmware/, without suffix
    longest: int  # bytes of an input


_BLOCKS = ("core/block", "core/block_writer", "core/byte_ring", "core/crc")
TARGETS = {
    "rc_decoder": Target(("core/rc_decoder",), 1500),
    "imu_receiver": Target(
        ("core/imu_receiver", "core/crc", "core/float32", "core/gps_receiver", "core/ubx"), 1000
    ),
    "ubx": Target(("core/gps_receiver", "core/ubx"), 1500),
    "settings": Target(
        ("core/settings", "core/imu/record", "core/session_record", "core/crc"), 300
    ),
    "block_writer": Target(_BLOCKS, 1000),
    "fat": Target(("storage/*", "core/block", "core/crc"), 300),
}


def build(name: str, *, extra_flags: tuple[str, ...] = ()) -> Path:
    """Compile a target when anything it is made of has changed.

    Returns
    -------
    Path
        The program.

    Raises
    ------
    FuzzError
        If clang is missing or refuses the sources.
    """
    compiler = shutil.which("clang++")
    if compiler is None:
        raise FuzzError("no clang++ found: apt-get install clang libclang-rt-dev, or make setup")
    target = TARGETS[name]
    firmware = ROOT / "firmware"
    sources = [SOURCES / f"{name}.cpp"]
    sources += [path for unit in target.units for path in sorted(firmware.glob(f"{unit}.cpp"))]
    headers = [path for room in ("core", "drivers", "hal", "storage", "generated")
               for path in sorted((ROOT / "firmware" / room).rglob("*.h"))]  # fmt: skip
    headers += [*sorted(SOURCES.glob("*.h")), *sorted((ROOT / "protocol/generated").glob("*.h"))]
    state = sha256(" ".join((*FLAGS, *extra_flags)).encode())
    for path in (*sources, *headers):
        state.update(path.read_bytes())
    program = OUT / "programs" / f"{name}-{state.hexdigest()[:16]}"
    if program.is_file():
        return program
    program.parent.mkdir(parents=True, exist_ok=True)
    for old in program.parent.glob(f"{name}-*"):
        old.unlink(missing_ok=True)
    # A name of this process until it is whole: two runs may build at the same time.
    part = program.with_suffix(f".{os.getpid()}")
    command = [compiler, *FLAGS, *extra_flags, *map(str, sources), "-o", str(part)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise FuzzError(f"compiling {name} failed:\n{done.stderr.strip()}")
    part.replace(program)
    return program


def unpack(name: str, folder: Path) -> int:
    """Write the committed inputs of a target, a file each; give how many."""
    folder.mkdir(parents=True, exist_ok=True)
    packed = CORPORA / f"{name}.txt"
    lines = packed.read_text(encoding="ascii").splitlines() if packed.is_file() else []
    inputs = [bytes.fromhex(line) for line in lines if line and not line.startswith("#")]
    for content in inputs:
        (folder / sha256(content).hexdigest()[:16]).write_bytes(content)
    return len(inputs)


def pack(name: str, folder: Path) -> int:
    """Keep the inputs of a folder as those of a target, shortest first; give how many."""
    inputs = sorted({path.read_bytes() for path in folder.iterdir()}, key=lambda c: (len(c), c))
    head = f"# Inputs of tests/fuzz/targets/{name}.cpp, one per line in hex; made by --merge."
    CORPORA.mkdir(parents=True, exist_ok=True)
    text = "\n".join([head, *(content.hex() for content in inputs)]) + "\n"
    (CORPORA / f"{name}.txt").write_text(text, encoding="ascii")
    return len(inputs)


def fuzz(program: Path, name: str, corpus: Path, *, runs: int, seed: int) -> tuple[int, str]:
    """Run a target.

    Parameters
    ----------
    program : Path
        As `build` gave it.
    name : str
        Name of the target.
    corpus : Path
        Inputs to begin with; new ones are added.
    runs : int
        Inputs in all.
    seed : int
        The same seed, corpus and program give the same inputs.

    Returns
    -------
    code : int
        0, or 6 if a rule was broken.
    said : str
        One line of figures, or the end of what libFuzzer says.
    """
    failures = OUT / "failures"
    failures.mkdir(parents=True, exist_ok=True)
    longest = TARGETS[name].longest if name in TARGETS else 1000
    options = [f"-runs={runs}", f"-seed={seed}", f"-max_len={longest}", *LIMITS]
    options += [f"-artifact_prefix={failures}/{name}-", "-print_final_stats=1"]
    done = subprocess.run(
        [str(program), *options, str(corpus)],
        capture_output=True, text=True, errors="replace", check=False,
    )  # fmt: skip
    if done.returncode != 0:
        lines = done.stderr.splitlines()
        told = (at for at, line in enumerate(lines) if _TELLS.search(line))
        first = next(told, max(0, len(lines) - 30))
        return BROKEN, "\n".join(lines[first : first + 30])
    ran = re.findall(r"number_of_executed_units: (\d+)", done.stderr)
    covered = re.findall(r"cov: (\d+) ft: (\d+)", done.stderr)
    edges, features = covered[-1] if covered else ("?", "?")
    kept = sum(1 for _ in corpus.iterdir())
    return 0, f"{ran[-1]} runs, {edges} edges and {features} features reached, {kept} inputs kept"


def merge(program: Path, name: str) -> str:
    """Keep the fewest inputs that reach all that was reached so far."""
    known = OUT / "corpus" / name
    unpack(name, known)
    with tempfile.TemporaryDirectory() as folder:
        command = [str(program), "-merge=1", *LIMITS, f"-max_len={TARGETS[name].longest}"]
        subprocess.run([*command, folder, str(known)], capture_output=True, check=True)
        count = pack(name, Path(folder))
    return f"{name}: {count} inputs in {CORPORA.relative_to(ROOT)}"


def main(arguments: list[str] | None = None) -> int:
    """Run the command line; return the exit code."""
    parser = argparse.ArgumentParser(prog="fuzz.targets", description=__doc__)
    parser.add_argument("name", choices=sorted(TARGETS))
    parser.add_argument("--runs", type=int, default=2000, help="inputs in all (default 2000)")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--merge", action="store_true", help="keep what is new in tests/data/fuzz")
    parser.add_argument("--input", type=Path, help="one input, as a failure left it")
    asked = parser.parse_args(arguments)
    try:
        program = build(asked.name)
    except FuzzError as error:
        print(f"fuzz: {error}", file=sys.stderr)
        return 1
    if asked.input is not None:
        return subprocess.run([str(program), str(asked.input)], check=False).returncode
    if asked.merge:
        print(merge(program, asked.name))
        return 0
    corpus = OUT / "corpus" / asked.name
    unpack(asked.name, corpus)
    code, said = fuzz(program, asked.name, corpus, runs=asked.runs, seed=asked.seed)
    print(said)
    return code


if __name__ == "__main__":
    sys.exit(main())
