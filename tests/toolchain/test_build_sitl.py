"""The library for this computer: rebuilt when, and only when, something it is made from changed."""

from __future__ import annotations

import ctypes
import os
from pathlib import Path

import build_sitl
import pytest

SOURCE = '#include "core/answer.h"\nextern "C" int answer() { return kAnswer; }\n'


@pytest.fixture
def tree(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Make a firmware of one source and one header."""
    for folder in ("firmware/core", "firmware/boards/sitl"):
        (tmp_path / folder).mkdir(parents=True)
    (tmp_path / "firmware/core/answer.h").write_text("constexpr int kAnswer = 41;\n")
    (tmp_path / "firmware/boards/sitl/answer.cpp").write_text(SOURCE)
    monkeypatch.setattr(build_sitl, "ROOT", tmp_path)
    monkeypatch.setattr(build_sitl, "FIRMWARE", tmp_path / "firmware")
    return tmp_path


def build(tree: Path, *flags: str) -> Path:
    return build_sitl.build(library=tree / "out" / "lib.so", extra_flags=flags)


def answer(library: Path, copy: Path) -> int:
    """Load a copy: the loader would hand out the library it has under the same name."""
    copy.write_bytes(library.read_bytes())
    return int(ctypes.CDLL(str(copy)).answer())


def newer(path: Path, than: Path) -> None:
    """Give a file a time after another one's, whatever the clock's resolution."""
    time_ns = than.stat().st_mtime_ns + 1_000_000
    os.utime(path, ns=(time_ns, time_ns))


def test_a_changed_header_is_compiled_in(tree: Path) -> None:
    library = build(tree)
    assert answer(library, tree / "first.so") == 41
    header = tree / "firmware/core/answer.h"
    header.write_text("constexpr int kAnswer = 42;\n")
    newer(header, library)
    assert answer(build(tree), tree / "second.so") == 42


def test_nothing_changed_nothing_compiled(tree: Path) -> None:
    before_ns = build(tree).stat().st_mtime_ns
    assert build(tree).stat().st_mtime_ns == before_ns


def test_other_flags_compile_everything_again(tree: Path) -> None:
    (tree / "firmware/core/answer.h").write_text("constexpr int kAnswer = ANSWER;\n")
    assert answer(build(tree, "-DANSWER=1"), tree / "first.so") == 1
    assert answer(build(tree, "-DANSWER=2"), tree / "second.so") == 2


def test_a_removed_source_leaves_the_library(tree: Path) -> None:
    extra = tree / "firmware/core/extra.cpp"
    extra.write_text('extern "C" int extra() { return 1; }\n')
    assert hasattr(ctypes.CDLL(str(build(tree))), "extra")
    extra.unlink()
    (tree / "second.so").write_bytes(build(tree).read_bytes())
    assert not hasattr(ctypes.CDLL(str(tree / "second.so")), "extra")


def test_a_name_nobody_defines_stops_the_link(tree: Path) -> None:
    source = "int missing();\nint f();\nint f() { return missing(); }\n"
    (tree / "firmware/core/bad.cpp").write_text(source)
    with pytest.raises(build_sitl.BuildError, match="missing"):
        build(tree)


@pytest.mark.parametrize(
    "line",
    ["int f(long x) { return x; }", "int f(int x) { return g(x); }", "#if SETTING\n#endif"],
    ids=["conversion", "unknown name", "undefined macro"],
)
def test_a_warning_stops_the_build_and_is_shown(tree: Path, line: str) -> None:
    (tree / "firmware/core/bad.cpp").write_text(f"{line}\n")
    with pytest.raises(build_sitl.BuildError, match=r"bad\.cpp"):
        build(tree)
    assert not (tree / "out" / "lib.so").exists()
