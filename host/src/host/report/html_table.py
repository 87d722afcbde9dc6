"""Rows of cells -> a table; a cell is markup already."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from host.report.html_text import escaped


def table(heads: Sequence[str], rows: Iterable[Sequence[str]], words: Sequence[int] = (0,)) -> str:
    """Return a table.

    Parameters
    ----------
    heads : sequence of str
        Plain text.
    rows : iterable of sequence of str
        Markup.
    words : sequence of int
        Columns of text; the others are numbers and stand to the right.
    """
    made = [_row("td", row, words) for row in rows]
    if not made:
        return "<p>none</p>"
    return (
        f'<div class="wide"><table><thead>{_row("th", [escaped(h) for h in heads], words)}</thead>'
        f"<tbody>{''.join(made)}</tbody></table></div>"
    )


def _row(kind: str, cells: Sequence[str], words: Sequence[int]) -> str:
    made = (
        f"<{kind}>{cell}</{kind}>" if k in words else f'<{kind} class="number">{cell}</{kind}>'
        for k, cell in enumerate(cells)
    )
    return f"<tr>{''.join(made)}</tr>"


def items(lines: Iterable[str]) -> str:
    """Return lines of plain text as a list."""
    made = "".join(f"<li>{escaped(line)}</li>" for line in lines)
    return f"<ul>{made}</ul>" if made else "<p>none</p>"
