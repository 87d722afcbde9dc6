"""uPlot (MIT), the chart library of our pages: its script and its style sheet.

Both lie in the wheel, in a clone's build folder (`host/chart_files.py`), or in PyPI's uplot-python,
which is never imported: that would start IPython. They are shown as they are, so that a page needs
no network.
"""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Iterator
from pathlib import Path

from host.errors import UsageError
from host.resources import CLONE, PACKED
from host.terminal import command_line

_PLACES = (PACKED / "uplot", CLONE / "build" / "uplot")
_PACKAGE = "uplot"
_REQUIREMENT = "uplot-python==1.1.1"  # it carries the same uPlot
_SCRIPT = "uPlot.iife.js"
_STYLE = "uPlot.min.css"
_LICENCE = "LICENSE"
_HEAD_CHARACTERS = 200


def chart_script() -> str:
    """Return uPlot's JavaScript, which defines ``uPlot``.

    Raises
    ------
    UsageError
        If uPlot is nowhere; one line that says how to get it.
    """
    return _text(_SCRIPT)


def chart_style() -> str:
    """Return uPlot's style sheet.

    Raises
    ------
    UsageError
        If uPlot is nowhere; one line that says how to get it.
    """
    return _text(_STYLE)


def chart_folder() -> Path | None:
    """Return the folder that holds script and style sheet, None where there is none."""
    return next(
        (one for one in _folders() if all((one / name).is_file() for name in (_SCRIPT, _STYLE))),
        None,
    )


def chart_licence(folder: Path) -> Path | None:
    """Return uPlot's licence in `folder`: its file, or the script whose head names it."""
    if (folder / _LICENCE).is_file():
        return folder / _LICENCE
    with (folder / _SCRIPT).open(encoding="utf-8") as script:
        return folder / _SCRIPT if "MIT" in script.read(_HEAD_CHARACTERS) else None


def chart_hint() -> str:
    """Return the command that installs uPlot."""
    return command_line(sys.executable, "-m", "pip", "install", "--no-deps", _REQUIREMENT)


def _folders() -> Iterator[Path]:
    yield from _PLACES
    found = importlib.util.find_spec(_PACKAGE)
    for folder in (found and found.submodule_search_locations) or ():
        yield Path(folder) / "static"


def _text(name: str) -> str:
    folder = chart_folder()
    if folder is None:
        raise UsageError(
            f"a page with charts needs uPlot: {chart_hint()} (or install npm, and host again)"
        )
    return (folder / name).read_text(encoding="utf-8")
