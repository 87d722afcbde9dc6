"""uPlot (MIT), the chart library of our pages: its script and its style sheet.

It comes with PyPI's uplot-python (Apache-2.0), of which only these two files are read: importing
it would start IPython. They are shown as they are, so that a page needs no network.
"""

from __future__ import annotations

import importlib.util
from pathlib import Path

from host.errors import UsageError
from host.extras import install_hint

_PACKAGE = "uplot"
_SCRIPT = "static/uPlot.iife.js"
_STYLE = "static/uPlot.min.css"


def chart_script() -> str:
    """Return uPlot's JavaScript, which defines ``uPlot``.

    Raises
    ------
    UsageError
        If uplot-python is not installed; one line that says how to.
    """
    return _text(_SCRIPT)


def chart_style() -> str:
    """Return uPlot's style sheet.

    Raises
    ------
    UsageError
        If uplot-python is not installed; one line that says how to.
    """
    return _text(_STYLE)


def _text(name: str) -> str:
    found = importlib.util.find_spec(_PACKAGE)
    for folder in (found and found.submodule_search_locations) or ():
        path = Path(folder) / name
        if path.is_file():
            return path.read_text(encoding="utf-8")
    raise UsageError(
        f"a page with charts needs uPlot, which comes with uplot-python (extra plot):"
        f" {install_hint('uplot-python')}"
    )
