"""How an iterative or recursive estimate settled, as a table: parameters over its steps."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np

from host.sysid.answer.atomic_files import atomic_write
from host.sysid.flight.linear_estimator import Answer

# What a step is, by what a method notes of it.
STEPS = {"history_step": "iteration", "history_s": "t_s"}


def has_history(answer: Answer) -> bool:
    """Return whether the method of an answer notes how it settles."""
    return "history" in answer.result.details


def write_history(path: Path, answer: Answer) -> None:
    """Write a CSV with a row for each step: its number or time (s), error, every parameter.

    Parameters
    ----------
    path : Path
    answer : Answer
        By a method that notes how it settles.

    Raises
    ------
    IdentificationError
        If the file cannot be written.
    """
    details = answer.result.details
    history = np.atleast_2d(details["history"])
    names = list(answer.result.names[: history.shape[1]])
    columns = [np.asarray(details[key]) for key in STEPS if key in details]
    heads = [head for key, head in STEPS.items() if key in details]
    if "history_error_percent" in details:
        columns.append(np.asarray(details["history_error_percent"]))
        heads.append("error_percent")
    table = np.column_stack([*columns, history])
    with atomic_write(path) as part, part.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow([*heads, *names])
        writer.writerows([f"{value:.10g}" for value in row] for row in table.tolist())
