"""Every figure of a study or a bench has a date and a commit, and changed ones are seen."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def generator() -> ModuleType:
    path = ROOT / ".ci" / "docs" / "generate_measured.py"
    spec = importlib.util.spec_from_file_location("generate_measured", path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_page_is_current(generator: ModuleType) -> None:
    assert generator.main(["--check"]) == 0


def test_every_study_has_a_dated_result(generator: ModuleType) -> None:
    studies = {p.name for p in (ROOT / "host" / "studies").glob("*.md")} - {"README.md"}
    dated = {Path(page).name for page, name, _ in generator.kept() if name == "Result"}
    assert studies - dated == set()


def test_a_changed_figure_is_seen(
    generator: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    page = tmp_path / "MEASURED.md"
    text = generator.PAGE.read_text(encoding="utf-8")
    crc = next(iter(generator.kept()))[2]
    page.write_text(text.replace(crc, "00000000"), encoding="utf-8")
    monkeypatch.setattr(generator, "PAGE", page)
    monkeypatch.setattr(generator, "ROOT", ROOT)
    assert generator.text(history=False) != page.read_text(encoding="utf-8")


def test_figures_are_numbers_of_results_and_of_tables(generator: ModuleType) -> None:
    study = "# A\n## Method\n| 1 |\n## Result\n3.5 of 7\n\n| a2 | 95 % |\n"
    assert generator.sections("host/studies/a.md", study) == {"Result": ["3.5", "7", "95"]}
    assert generator.sections("tests/A.md", study) == {"Method": ["1"], "Result": ["95"]}
