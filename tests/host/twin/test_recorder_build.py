"""The recorder's library on a computer that has none: sources, compilers, and what is said."""

import sys
from pathlib import Path

import pytest
from host.cli import main
from host.errors import UsageError
from host.twin.outcome import picture
from host.twin.recorder import recorder_build

from tests.host.logs import ROOT

sys.path.insert(0, str(ROOT / "firmware/toolchain"))
import build_sitl


@pytest.fixture
def nothing_built(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.delenv("HOST_SITL", raising=False)
    monkeypatch.setattr(recorder_build, "CLONE_LIBRARY", tmp_path / "none")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.delenv("LOCALAPPDATA", raising=False)
    monkeypatch.delenv("CXX", raising=False)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_what_users_build_is_what_the_clone_builds() -> None:
    assert recorder_build.ROOMS == build_sitl.ROOMS
    assert recorder_build.INCLUDES == build_sitl.INCLUDES
    root = recorder_build.sources()
    assert root == ROOT
    units = build_sitl._units(Path("x"), "c++", ())
    built = {unit.source for unit in units}
    assert built <= set(recorder_build._all_sources(root))
    assert all(recorder_build.STANDARD in unit.command for unit in units)


def test_without_a_compiler_both_ways_are_named_before_anything_is_flown(
    nothing_built: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("PATH", str(nothing_built))
    assert main(["simulate", "demo"]) == 2
    said = capsys.readouterr().err
    assert "no compiler" in said
    assert "pip install" in said
    assert "ziglang" in said
    assert said.count("\n") == 1
    assert not Path("flight").exists()


def test_a_compiler_that_fails_is_quoted_and_the_next_one_asked(
    nothing_built: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = []

    def two() -> list[tuple[str, ...]]:
        return [("first",), ("second",)]

    def build(compiler: tuple[str, ...], *rest: object) -> str | None:
        asked.append(compiler[0])
        return f"{compiler[0]} has no headers"

    monkeypatch.setattr(recorder_build, "compilers", two)
    monkeypatch.setattr(recorder_build, "_build", build)
    with pytest.raises(UsageError, match="first has no headers; second: second has no headers"):
        recorder_build.recorder_library()
    assert asked == ["first", "second"]


def test_what_was_built_once_is_found_until_its_sources_change(
    nothing_built: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def build(compiler: object, root: object, target: Path, progress: object) -> None:
        target.write_bytes(b"library")

    monkeypatch.setattr(recorder_build, "compilers", lambda: [("one",)])
    monkeypatch.setattr(recorder_build, "_build", build)
    kept = recorder_build.recorder_library()
    assert kept.is_relative_to(nothing_built / "cache")
    assert recorder_build.existing_library() == kept
    monkeypatch.setattr(recorder_build, "STANDARD", "-std=gnu++17")
    assert recorder_build.existing_library() is None
    again = recorder_build.recorder_library()
    assert again != kept
    assert not kept.exists()  # of other sources


def test_without_matplotlib_the_flight_is_written(
    nothing_built: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def missing(*_: object, **__: object) -> None:
        raise ModuleNotFoundError("No module named 'matplotlib'", name="matplotlib")

    monkeypatch.setattr(picture, "draw", missing)
    assert main(["simulate", "calm", "--firmware", "none", "-o", "."]) == 0
    assert Path("flight.csv").is_file()
    assert not Path("flight.png").exists()
    assert "no picture without matplotlib: " in capsys.readouterr().err
