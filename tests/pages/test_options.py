"""The page of every verb's arguments is what its parser says."""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path
from types import ModuleType

import pytest
from host.cli import main, verbs

GENERATOR = Path(__file__).resolve().parents[2] / ".ci" / "docs" / "generate_options.py"


def _generator() -> ModuleType:
    spec = importlib.util.spec_from_file_location("generate_options", GENERATOR)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_page_is_current() -> None:
    module = _generator()
    assert module.PAGE.read_text(encoding="utf-8") == module.text()


@pytest.mark.parametrize("verb", list(verbs()))
def test_what_help_prints_is_on_the_page(
    verb: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "1000")  # no word is broken
    with pytest.raises(SystemExit):
        main([verb, "--help"])
    helped = set(re.findall(r"--[a-z-]+[a-z]", capsys.readouterr().out)) - {"--help"}
    page = _generator().PAGE.read_text(encoding="utf-8")
    own = page.partition(f"## host {verb}\n")[2].partition("\n## ")[0]
    assert own
    assert helped <= set(re.findall(r"--[a-z-]+[a-z]", own))
