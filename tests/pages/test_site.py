"""The API page of `make docs` names everything that `import host` offers, where it is defined."""

from __future__ import annotations

import ast
import importlib
import importlib.util
import json
from pathlib import Path

import host

EXAMPLES = Path(__file__).resolve().parents[2] / "host" / "examples"
SITE = Path(__file__).resolve().parents[2] / ".ci" / "docs" / "site.py"


def test_every_name_of_the_package_has_its_docstring() -> None:
    spec = importlib.util.spec_from_file_location("site_of_pages", SITE)
    assert spec is not None and spec.loader is not None
    site = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(site)
    shown = [line.removeprefix("::: ") for line in site.api_page().splitlines() if ":::" in line]
    assert sorted(place.rpartition(".")[2] for place in shown) == sorted(
        name for name in host.__all__ if name != "__version__"
    )
    for place in shown:
        module, _, name = place.rpartition(".")
        assert getattr(importlib.import_module(module), name).__doc__


def test_notebooks_are_kept_without_what_their_cells_gave() -> None:
    """`make docs` runs them; what a clone keeps is what was written."""
    found = sorted(EXAMPLES.glob("*.ipynb"))
    assert {path.stem for path in found} == {"flight", "fleet", "gains"}
    for path in found:
        cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
        code = [cell for cell in cells if cell["cell_type"] == "code"]
        assert all(cell["outputs"] == [] and cell["execution_count"] is None for cell in code)
        for cell in code:
            ast.parse("".join(cell["source"]))
