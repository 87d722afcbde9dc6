"""Mistakes in settings.toml are found, and the committed header is what the generator makes."""

from __future__ import annotations

import copy
import importlib.util
import shutil
import sys
import tomllib
from pathlib import Path
from types import ModuleType

import pytest
import settings_check

FIRMWARE = Path(__file__).resolve().parents[2] / "firmware"


@pytest.fixture(name="generator", scope="module")
def fixture_generator() -> ModuleType:
    """Return the generator as a module."""
    path = FIRMWARE / "generate_settings.py"
    spec = importlib.util.spec_from_file_location("generate_settings", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_committed_header_is_current(
    generator: ModuleType, capsys: pytest.CaptureFixture[str]
) -> None:
    assert generator.main(["--check"]) == 0
    assert capsys.readouterr().err == ""


def test_old_header_is_told_in_one_line(
    generator: ModuleType,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr(generator, "HEADER", tmp_path / "generated" / "settings.h")
    assert generator.main(["--check"]) == 6
    assert capsys.readouterr().err.count("\n") == 1
    assert generator.main([]) == 0
    assert generator.main(["--check"]) == 0


@pytest.mark.parametrize(
    ("name", "key", "value", "word"),
    [
        ("rate_hz", "value", 99, "expected one of 25, 50, 100, 200"),
        ("hold_ms", "value", 1001, "expected one of 0 to 1000"),
        ("hold_ms", "value", "off", "'off'"),
        ("input_aileron", "max", 256, "do not fit u8"),
        ("hold_ms", "min", 2000, "needs min and max"),
        ("hold_ms", "value", True, "expected one of 0 to 1000"),
        ("hold_ms", "value", 5.0, "expected one of 0 to 1000"),
        ("rate_hz", "any_of", [], "in whole numbers"),
        ("rate_hz", "any_of", [100, "fast"], "in whole numbers"),
        ("input_elevator", "value", 0, r"\[input_elevator\] value is 0, which \[input_aileron\]"),
        ("input_switch", "value", 3, r"which \[input_throttle\] has already"),
        ("switch_mega_min_us", "value", 1499, "expected at least 1500"),
        ("switch_armed_min_us", "value", 1799, "expected 0 or at least 1800"),
        ("switch_armed_min_us", "value", 2101, "expected one of 0 to 2100"),
        ("aircraft", "value", "a name much too long", "1 to 15"),
        ("aircraft", "value", "it's", "letters, digits"),
        ("aircraft", "value", "", "1 to 15"),
        ("hold_ms", "why", "", "does not say why"),
        ("hold_ms", "maximum", 5, "unknown key maximum"),
    ],
)
def test_a_mistake_is_named(
    generator: ModuleType, name: str, key: str, value: object, word: str
) -> None:
    settings = tomllib.loads((FIRMWARE / "settings.toml").read_text(encoding="utf-8"))
    fields = generator.config_fields()
    generator.checked(copy.deepcopy(settings), fields)
    settings[name][key] = value
    with pytest.raises(generator.SettingsError, match=word):
        generator.checked(settings, fields)


def test_a_setting_that_is_no_table_is_named(generator: ModuleType) -> None:
    settings = tomllib.loads((FIRMWARE / "settings.toml").read_text(encoding="utf-8"))
    settings["hold_ms"] = 200
    with pytest.raises(generator.SettingsError, match="hold_ms is 200, expected a table"):
        generator.checked(settings, generator.config_fields())


@pytest.mark.parametrize("content", [None, b"[rate_hz]\nvalue =\n", b"\xff\xfe[rate_hz]\n"])
def test_a_file_that_cannot_be_read_is_told_in_one_line(
    generator: ModuleType,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    content: bytes | None,
) -> None:
    path = tmp_path / "settings.toml"
    if content is not None:
        path.write_bytes(content)
    monkeypatch.setattr(generator, "SETTINGS", path)
    assert generator.main([]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert said.startswith("firmware/settings.toml: ")


def test_a_build_is_stopped_while_the_header_is_old(tmp_path: Path) -> None:
    for name in ("generate_settings.py", "settings.toml", "generated/settings.h"):
        (tmp_path / "firmware" / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(FIRMWARE / name, tmp_path / "firmware" / name)
    (tmp_path / "protocol").mkdir()
    shutil.copy(FIRMWARE.parent / "protocol" / "frames.toml", tmp_path / "protocol")
    firmware = tmp_path / "firmware"
    assert settings_check.complaint(firmware, python=sys.executable) == ""
    settings = firmware / "settings.toml"
    text = settings.read_text(encoding="utf-8")
    settings.write_text(text.replace("value = 1400", "value = 1300"), encoding="utf-8")
    old = settings_check.complaint(firmware, python=sys.executable)
    assert "settings.h is old: run python firmware/generate_settings.py" in old
    settings.write_text(text.replace("value = 1400", "value = 1900"), encoding="utf-8")
    assert "switch_mega_min_us" in settings_check.complaint(firmware, python=sys.executable)


def test_a_setting_too_many_or_missing_is_named(generator: ModuleType) -> None:
    settings = tomllib.loads((FIRMWARE / "settings.toml").read_text(encoding="utf-8"))
    fields = generator.config_fields()
    del settings["hold_ms"]
    with pytest.raises(generator.SettingsError, match="hold_ms"):
        generator.checked(settings, fields)
