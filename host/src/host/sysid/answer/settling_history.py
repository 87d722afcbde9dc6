"""How an iterative or recursive estimate settled, as a table: parameters over its steps."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np

from host.sysid.answer.atomic_files import atomic_write
from host.sysid.flight.linear_answer import Answer

# What a step is, by what a method notes of it.
SETTLED = 0.1
STEPS = {"history_step": "iteration", "history_s": "t_s"}


def has_history(answer: Answer) -> bool:
    """Return whether the method of an answer notes how it settles."""
    return "history" in answer.result.details


def settling_lines(answer: Answer) -> list[str]:
    """Return since when each parameter stayed within a tenth of its end, if noted."""
    if not has_history(answer):
        return []
    details = answer.result.details
    history = np.atleast_2d(details["history"])[:, : len(answer.model.parameters)]
    key, unit = ("history_s", " s") if "history_s" in details else ("history_step", "")
    at = np.asarray(details[key])
    far = np.abs(history - history[-1]) > SETTLED * np.abs(history[-1])
    since = []
    for k, parameter in enumerate(answer.model.parameters):
        last = np.flatnonzero(far[:, k])
        begin = at[min(int(last[-1]) + 1, len(at) - 1)] if len(last) else at[0]
        since.append(f"{parameter.name} {begin:.4g}{unit}")
    of = "time" if unit else "iteration"
    lines = [f"  within 10 % of its end since ({of}): {', '.join(since)}"]
    if "history_error_percent" in details:
        error = np.asarray(details["history_error_percent"])
        lines.append(
            f"  error of the original program {error[0]:.4g} to {error[-1]:.4g} % in {at[-1]:.0f}"
            " sweeps"
        )
    return lines


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
