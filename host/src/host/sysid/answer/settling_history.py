"""How an iterative or recursive estimate settled: lines, JSON, and a table over its steps."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from host.export.atomic_files import atomic_write
from host.sysid.estimators.estimation_method import loaded
from host.sysid.estimators.method_registry import find_method
from host.sysid.estimators.settling import STEPS, settling_of

if TYPE_CHECKING:
    from host.sysid.linear.linear_answer import Answer


def has_history(answer: Answer) -> bool:
    """Return whether the method of an answer notes how it settles."""
    return "history" in answer.result.details


def history_lines(answer: Answer) -> list[str]:
    """Return how an estimate settled, in the words of its method; nothing if it notes nothing."""
    by = find_method(answer.method) if has_history(answer) else None
    return loaded(by.history)(answer.result) if by and by.history else []


def settling_document(answer: Answer) -> dict[str, Any] | None:
    """Return since when each parameter stayed near its end; None if a method notes nothing."""
    found = settling_of(answer.result)
    if found is None:
        return None
    return {
        "step": found.step,
        "end": found.end,
        "since": dict(found.since),
        "not_settled": list(found.moving),
    }


def write_history(path: Path, answer: Answer) -> None:
    """Write a CSV with a row for each step: its number or time (s), every parameter.

    What else a method notes of each step, as the detail ``history_error_percent``, stands between.

    Parameters
    ----------
    path : Path
    answer : Answer
        By a method that notes how it settles.

    Raises
    ------
    UsageError
        If the file cannot be written.
    """
    details = answer.result.details
    history = np.atleast_2d(details["history"])
    names = list(answer.result.names[: history.shape[1]])
    columns = {head: details[key] for key, head in STEPS.items() if key in details}
    columns |= {
        key.removeprefix("history_"): value
        for key, value in details.items()
        if key.startswith("history_") and key not in STEPS
    }
    table = np.column_stack([*map(np.asarray, columns.values()), history])
    with atomic_write(path) as part, part.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow([*columns, *names])
        writer.writerows([f"{value:.10g}" for value in row] for row in table.tolist())
