"""The summary of an answer on one screen: 25 lines of 80 columns for one flight."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from host.constants import CARE_SHARE, TRUST_SHARE
from host.log.ledger import LOST
from host.sysid.answer.answer_summary import AnswerSummary, counted

if TYPE_CHECKING:
    from host.sysid.answer.summary_rows import SummaryRow
    from host.sysid.checks.data_finding import Finding

COLUMNS, LINES = 80, 25
CELL = 39  # of two columns
VALUE_CELL = 30  # name, words and value
MOST_PERCENT = 99
DONE = 36  # of a finding: what was done
REST = "Rest: --full, --json, --plots DIR, host report"


def summary_lines(
    summary: AnswerSummary, notes: Sequence[str], table: Sequence[str] | None = None
) -> list[str]:
    """Return the summary; each finding is a line more than 25.

    Parameters
    ----------
    summary : AnswerSummary
    notes : sequence of str
        What was done to the data; those that find no room are counted.
    table : sequence of str, optional
        In place of the estimates, a line each: several methods side by side.
    """
    # Nothing that was read of a log is said before what the log lost.
    lost = counted(note for note in notes if note.startswith(LOST))
    notes = [note for note in notes if not note.startswith(LOST)]
    above = [
        *lost,
        summary.known,
        *_packed([one.text for one in summary.modes], "  ", COLUMNS),
    ]
    not_known = _not_known(summary)
    said = counted(notes)
    rows = list(filter(None, table)) if table is not None else _two_columns(summary)
    room = LINES + summary.flights - 1 - len(above) - 4 - bool(said)
    if len(rows) > room:
        rows = [*rows[: room - 1], f"  ... and {len(rows) - room + 1} more lines: --full"]
    room -= len(rows)
    fly = _listed("Fly next", summary.fly_lines(), room)
    room -= len(fly) - 1
    measure = _listed("Measure", summary.measure_lines(), room)
    room -= len(measure) - 1
    findings = counted(_finding(f) for f in summary.findings)
    lines = [
        *above, *findings, *rows, not_known, *fly, *measure,
        *_notes(said, room + 1), f"{summary.fitted}. {REST}",
    ]  # fmt: skip
    return [cut(line) for line in lines]


def advice_lines(summary: AnswerSummary) -> list[str]:
    """Return all that may be flown next or measured, a line each."""
    return [
        *(f"Fly next: {one}" for one in summary.fly_lines()),
        *(f"Measure: {one}" for one in summary.measure_lines()),
    ]


def cut(text: str, width: int = COLUMNS) -> str:
    """Return a line that ends within the width, at a word."""
    if len(text) <= width:
        return text
    return text[: width - 3].rpartition(" ")[0].rstrip(" ,;:") + "..."


def _finding(finding: Finding) -> str:
    """Return what was found and what was done about it, in one line."""
    done = f"; {cut(finding.done.partition(' (')[0].partition(':')[0], DONE)}"
    return f"{cut(f'Finding: {finding.text}', COLUMNS - len(done))}{done}"


def _packed(texts: Sequence[str], head: str, width: int) -> list[str]:
    """Return short texts several to a line, a head before the first and its width before others."""
    lines: list[str] = []
    for text in texts:
        if lines and len(lines[-1]) + len(text) + 2 <= width:
            lines[-1] += f"; {text}"
        else:
            lines.append(f"{' ' * len(head) if lines else head}{text}")
    return lines


def _two_columns(summary: AnswerSummary) -> list[str]:
    cells = [_cell(row) for row in summary.rows]
    height = (len(cells) + 1) // 2
    right = [*cells[height:], ""]
    what = "derivatives (SI)" if all(r.unit for r in summary.rows) else "coefficients"
    head = (
        f"At {summary.condition}: {what}, 95 % share"
        f" (good {100 * TRUST_SHARE:.0f}, fair {100 * CARE_SHARE:.0f})"
    )
    return [
        head,
        *(f"{a:<{CELL}s}  {b}".rstrip() for a, b in zip(cells[:height], right, strict=False)),
    ]


def _cell(row: SummaryRow) -> str:
    """Return name, words, value, half-width in per cent and word in 39 characters."""
    percent = 100.0 * row.share
    share = f"{percent:.0f}" if percent <= MOST_PERCENT else f">{MOST_PERCENT}"
    return f"{_valued(row)} {share:>3s} {row.word:<4s}"


def _valued(row: SummaryRow) -> str:
    named = f"{row.name} {row.words}".strip()
    for name, digits in ((named, 3), (named, 2), (row.name, 3), (row.name, 1)):
        value = f"{row.value:.{digits}g}"
        if len(name) + 1 + len(value) <= VALUE_CELL:
            return f"{name}{value:>{VALUE_CELL - len(name)}s}"
    value = f"{row.value:.1g}"
    return f"{row.name[: VALUE_CELL - len(value) - 1]} {value}"


def _not_known(summary: AnswerSummary) -> str:
    """Return what is not known and why, by names where there is room, else by their number."""
    groups = summary.not_known
    parts = [f"{', '.join(names)} ({reason})" for reason, names in groups.items()]
    short = [f"{len(names)} ({reason})" for reason, names in groups.items()]
    line = "Not known from this flight: nothing that was asked"
    for named in range(len(parts), -1, -1):
        line = f"Not known: {'; '.join([*parts[:named], *short[named:]])}" if parts else line
        if len(line) <= COLUMNS:
            break
    return line


def _listed(head: str, items: Sequence[str], spare: int) -> list[str]:
    """Return the items that a line, and a spare one if there is, holds; others are counted."""
    whole = _packed(items, f"{head}: ", COLUMNS)
    if len(whole) <= 1 + min(spare, 1):
        return whole
    more = "; {} more: --full"
    lines = _packed(items, f"{head}: ", COLUMNS - len(more))[: 1 + min(spare, 1)]
    shown = sum(line.count("; ") + 1 for line in lines)
    tail = more.format(len(items) - shown)
    return [*lines[:-1], cut(lines[-1], COLUMNS - len(tail)) + tail]


def _notes(said: Sequence[str], room: int) -> list[str]:
    """Return notes in the lines that are left; what does not fit is counted."""
    if not said:
        return []
    room = max(room, 1)
    if len(said) <= room:
        return [cut(f"Note: {one}") for one in said]
    more = f" (and {len(said) - room} more notes: --full)"
    shown = [cut(f"Note: {one}") for one in said[: room - 1]]
    return [*shown, cut(f"Note: {said[room - 1]}", COLUMNS - len(more)) + more]
