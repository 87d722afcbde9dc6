"""Kernels: when they are compiled, what is said, and that kept code is never of other code."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from host.compiled import compiled

KERNEL = """
import sys
from host.compiled import compiled
from parts import times

@compiled
def double(x):
    return times(x)

assert sys.modules.get("numba") is None
value = double(21.0)
stats = double.machine().stats if sys.modules.get("numba") else None
print(value, *([len(stats.cache_hits), len(stats.cache_misses)] if stats else []))
"""
PARTS = """
from host.compiled import compiled_part

FACTOR = 2.0

@compiled_part
def times(x):
    return FACTOR * x
"""
TRIM = """
from host.aircraft.file import load
from host.aircraft.trim import solve

print(solve(load("ultrastick25e").airframe(), 17.0).state.tobytes().hex())
"""
SAID = re.compile(
    r"host: a first run compiles its kernels and keeps them for the next \(double, about \d+ s,"
    r" comes first\)\n"
)


def run(folder: Path, *, without: bool = False) -> tuple[str, str]:
    """Call the kernel in a process of its own; give what it printed and what it said."""
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(folder / "cache")}
    command = [sys.executable, str(folder / "kernel.py")]
    if without:
        blocked = f"import sys, runpy; sys.modules['numba'] = None; sys.path[0] = {str(folder)!r}"
        command = [sys.executable, "-c", f"{blocked}; runpy.run_path({command[1]!r})"]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout.strip(), done.stderr


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "kernel.py").write_text(KERNEL)
    (tmp_path / "parts.py").write_text(PARTS)
    return tmp_path


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """A folder whose kernel was compiled once, and a copy of it as it was then."""
    folder, copy = (tmp_path_factory.mktemp(name) for name in ("kernel", "copy"))
    (folder / "kernel.py").write_text(KERNEL)
    (folder / "parts.py").write_text(PARTS)
    run(folder)
    shutil.copytree(folder, copy, dirs_exist_ok=True)
    return folder, copy


@pytest.fixture
def compiled_before(made: tuple[Path, Path]) -> Path:
    """That folder in its own place, whatever the test before did to it; times of files are kept."""
    folder, copy = made
    shutil.rmtree(folder)
    shutil.copytree(copy, folder)
    return folder


def test_it_says_that_it_compiles_and_does_so_once(folder: Path) -> None:
    printed, said = run(folder)
    assert printed == "42.0 0 1"
    assert SAID.fullmatch(said)
    assert run(folder) == ("42.0 1 0", "")


@pytest.mark.parametrize("damage", ["index of a module that moved", "cut index", "cut code"])
def test_kernel_is_compiled_anew(compiled_before: Path, damage: str) -> None:
    folder = compiled_before
    (index,) = (folder / "cache").rglob("kernel.double*.nbi")
    (code,) = (folder / "cache").rglob("kernel.double*.nbc")
    if damage == "cut code":
        code.write_bytes(code.read_bytes()[:40])
    elif damage == "cut index":
        # Version and stamp stay whole; the table of signatures behind them does not.
        index.write_bytes(index.read_bytes()[:-20])
    else:
        moved = index.read_bytes().replace(b"numba.core.types.scalars", b"numba.core.types.sca1ars")
        assert moved != index.read_bytes()
        index.write_bytes(moved)
    assert run(folder)[0].startswith("42.0")
    assert run(folder)[0] == "42.0 1 0"


def test_a_run_that_compiles_gives_the_bits_of_every_later_run(tmp_path: Path) -> None:
    (tmp_path / "kernel.py").write_text(TRIM)
    (first, said), (later, silent) = run(tmp_path), run(tmp_path)
    assert "compiles" in said
    assert not silent
    assert first == later


@pytest.mark.parametrize(
    ("old", "new", "expected"), [("2.0", "3.0", "63.0"), ("* x", "+ x", "23.0")]
)
def test_what_a_kernel_calls_in_another_file_has_changed(
    compiled_before: Path, old: str, new: str, expected: str
) -> None:
    folder = compiled_before
    (folder / "parts.py").write_text(PARTS.replace(old, new))
    assert run(folder)[0] == f"{expected} 0 1"
    kept = list((folder / "cache" / "kernels").glob("kernel.double.*"))
    assert len(kept) == 1  # what it was before is gone


def test_without_numba_it_says_at_once_how_slow_it_is(folder: Path) -> None:
    printed, said = run(folder, without=True)
    assert printed == "42.0"
    assert said.startswith("host: without numba this takes 100 to 400 times as long: ")


def test_code_of_a_source_that_nobody_may_write_is_kept_with_the_user(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    source = tmp_path / "installed" / "kernel.py"
    source.parent.mkdir()
    source.write_text("def twice(x):\n    return 2.0 * x\n")
    (source.parent / "__pycache__").write_text("where a folder would be")
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    monkeypatch.delenv("LOCALAPPDATA", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "own"))
    found: dict[str, Callable[[float], Any]] = {}
    exec(compile(source.read_text(), str(source), "exec"), found)
    assert compiled(found["twice"])(3.0) == 6.0
    assert list((tmp_path / "own" / "flight-test-host").rglob("*.nbc"))


def test_a_kernel_is_compiled_where_no_cache_can_be() -> None:
    found: dict[str, Callable[[float], Any]] = {}
    # Code of no file is not kept, as of a file where nobody may write.
    exec("def kernel(x):\n    return 2.0 * x\n", found)
    assert compiled(found["kernel"])(3.0) == 6.0


GENERATE = """
import sys
import host.compiled as compiled
from host.sysid.expressions.equation_code import EquationCode

compiled.__file__ = sys.argv[1] + "/compiled.py"  # an installation of its own
text = "\\n".join(f"def {name}(x): return 2.0 * x" for name in
                 ("rates", "rate_slopes", "readings", "reading_slopes"))
def loop(x):
    return rates(x)
kernel = EquationCode(text).loop(loop)
value, stats = kernel(21.0), kernel.machine().stats
print(value, len(stats.cache_hits))
"""


def test_generated_code_is_compiled_once_for_every_installation_of_a_user(tmp_path: Path) -> None:
    environment = {
        k: v for k, v in os.environ.items() if k not in ("NUMBA_CACHE_DIR", "LOCALAPPDATA")
    }
    environment |= {"XDG_CACHE_HOME": str(tmp_path / "own")}
    places = [tmp_path / name for name in ("one", "other", "third")]
    for place in places:
        place.mkdir()
    start = [sys.executable, "-c", GENERATE]
    both = [
        subprocess.Popen([*start, str(place)], env=environment, stdout=subprocess.PIPE, text=True)
        for place in places[:2]
    ]
    assert {one.communicate()[0].split()[0] for one in both} == {"42.0"}  # at the same time
    last = subprocess.run(
        [*start, str(places[2])], env=environment, capture_output=True, text=True, check=True
    )
    assert last.stdout.split() == ["42.0", "1"]
    assert not last.stderr
