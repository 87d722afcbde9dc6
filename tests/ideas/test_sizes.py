"""Files and functions stay short; what is longer is listed with its reason."""

from __future__ import annotations

import tomllib
from pathlib import Path

from tests.ideas.__main__ import MOST_COMPLEXITY, MOST_FILE_LINES, MOST_LINES, SYSID
from tests.ideas.sources import functions, modules

LISTED = Path(__file__).parent / "long_functions.toml"


def test_no_file_is_longer_than_400_lines() -> None:
    long = {m.stem: m.lines for m in modules().values() if m.lines > MOST_FILE_LINES}
    assert long == {}


def test_each_long_function_of_sysid_has_its_reason() -> None:
    found = {
        part.label
        for name, module in modules().items()
        if name.startswith(SYSID)
        for part in functions(module)
        if part.lines > MOST_LINES or part.complexity > MOST_COMPLEXITY
    }
    assert found == set(tomllib.loads(LISTED.read_text(encoding="utf-8")))
