"""The answer as a page of a notebook. Every name in it is a stranger's: all text is escaped."""

from __future__ import annotations

import html
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from host.sysid.answer.marks import CAREFUL, SMALL, TRUSTED
from host.text import shown

if TYPE_CHECKING:
    import pandas as pd

GOOD, FAIR, POOR = "#2e7d32", "#b26a00", "#b3261e"
COLOURS = {TRUSTED: GOOD, CAREFUL: FAIR, SMALL: FAIR}
DIGITS = 4
NARROW = "font-size:85%;max-width:100%"  # eight columns beneath a cell of 700 px


def answer_html(title: str, verdict: Sequence[str], tables: Mapping[str, pd.DataFrame]) -> str:
    """Return verdict and tables as HTML without scripts or links.

    Parameters
    ----------
    title : str
    verdict : sequence of str
        Lines.
    tables : mapping
        Heading to table.
    """
    parts = [f"<div><p><b>{escaped(title)}</b></p>", "<pre>"]
    parts += [escaped(line) + "\n" for line in verdict]
    parts.append("</pre>")
    for heading, table in tables.items():
        parts += [f"<p>{escaped(heading)}</p>", _table(table)]
    return "".join([*parts, "</div>"])


def escaped(text: object) -> str:
    """Return text that is neither markup nor a control code."""
    return html.escape(shown(str(text)), quote=True)


def _table(table: pd.DataFrame) -> str:
    names = [*(str(n) for n in table.index.names), *table.columns]
    head = "".join(f"<th>{escaped(name)}</th>" for name in names)
    rows = []
    for places, values in zip(table.index, table.itertuples(index=False), strict=True):
        cells = [f"<th>{escaped(place)}</th>" for place in places]
        cells += [_cell(value) for value in values]
        rows.append(f"<tr>{''.join(cells)}</tr>")
    body = f"<thead><tr>{head}</tr></thead><tbody>{''.join(rows)}</tbody>"
    return f'<table style="{NARROW}">{body}</table>'


def _cell(value: Any) -> str:
    if isinstance(value, float):
        return f'<td style="text-align:right">{value:.{DIGITS}g}</td>'
    colour = COLOURS.get(value, POOR if str(value).startswith("do not") else "")
    style = f' style="color:{colour}"' if colour else ""
    return f"<td{style}>{escaped(value)}</td>"
