"""Mistakes in settings.toml are found, and the committed header is what the generator makes."""

from __future__ import annotations

import copy
import importlib.util
import tomllib
from pathlib import Path
from types import ModuleType

import pytest

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
        ("aircraft", "value", "a name much too long", "1 to 15"),
        ("aircraft", "value", "", "1 to 15"),
        ("hold_ms", "why", "", "does not say why"),
        ("hold_ms", "maximum", 5, "unknown key maximum"),
    ],
)
def test_a_mistake_is_named(
    generator: ModuleType, name: str, key: str, value: int | str, word: str
) -> None:
    settings = tomllib.loads((FIRMWARE / "settings.toml").read_text(encoding="utf-8"))
    fields = generator.config_fields()
    generator.checked(copy.deepcopy(settings), fields)
    settings[name][key] = value
    with pytest.raises(generator.SettingsError, match=word):
        generator.checked(settings, fields)


def test_a_setting_too_many_or_missing_is_named(generator: ModuleType) -> None:
    settings = tomllib.loads((FIRMWARE / "settings.toml").read_text(encoding="utf-8"))
    fields = generator.config_fields()
    del settings["hold_ms"]
    with pytest.raises(generator.SettingsError, match="hold_ms"):
        generator.checked(settings, fields)
