"""The answer as the first page of a report: one sentence, modes, estimates, what is not known."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from host.constants import CARE_SHARE, TRUST_SHARE
from host.report.html_table import items, table
from host.report.html_text import escaped
from host.report.parameter_section import CLASSES

if TYPE_CHECKING:
    from host.sysid.answer.answer_summary import AnswerSummary
    from host.sysid.answer.summary_rows import SummaryRow

_MOST_PERCENT = 99.0


def answer_section(summary: AnswerSummary) -> str:
    """Return what `host identify` prints first, as markup."""
    rows = summary.rows
    half = (len(rows) + 1) // 2
    heads = ["", "", "value", "95 %", ""]
    columns = "".join(
        table(heads, [list(_cells(row)) for row in own], (0, 1, 4))
        for own in (rows[:half], rows[half:])
        if own
    )
    what = "derivatives (SI)" if all(row.unit for row in rows) else "coefficients"
    limits = f"good {100 * TRUST_SHARE:.0f}, fair {100 * CARE_SHARE:.0f}"
    unknown = [
        f"Not known: {', '.join(names)} ({reason})" for reason, names in summary.not_known.items()
    ]
    return (
        f'<p class="lead">{escaped(summary.known)}</p>'
        + items(mode.text for mode in summary.modes)
        + f"<p>At {escaped(summary.condition)}: {what}, 95 % half-width in per cent ({limits}).</p>"
        + f'<div class="pair">{columns}</div>'
        + "".join(f"<p>{escaped(line)}</p>" for line in unknown)
        + f"<p>{escaped(summary.fitted)}.</p>"
    )


def _cells(row: SummaryRow) -> Iterator[str]:
    percent = 100.0 * row.share
    yield escaped(row.name)
    yield escaped(row.words)
    yield f"{row.value:.3g}"
    yield f"{percent:.0f}" if percent <= _MOST_PERCENT else f"&gt;{_MOST_PERCENT:.0f}"
    yield f'<span class="{CLASSES.get(row.mark, "")}">{escaped(row.word)}</span>'
