"""How an iterative or recursive estimate settled, as a table: parameters over its steps."""

from __future__ import annotations

import csv
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from host.sysid.answer.atomic_files import atomic_write
from host.sysid.flight.linear_answer import Answer

SETTLED = 0.1  # of the end
LATE = 0.85  # of all steps: what moves straight on is within a tenth of its end from 0.9 on
STILL = 1e-4  # of the error of the line search, lowered by less: its start but for rounding
# What a step is, by what a method notes of it.
STEPS = {"history_step": "iteration", "history_s": "t_s"}


@dataclass(frozen=True, slots=True)
class Settling:
    """Since when each parameter stayed within a tenth of its end.

    Attributes
    ----------
    step : str
        ``iteration``, or ``t_s``: time of the data fitted, one maneuver behind the other.
    end : float
        The last step.
    since : mapping of str to float
        Step by parameter.
    """

    step: str
    end: float
    since: Mapping[str, float]

    @property
    def moving(self) -> tuple[str, ...]:
        """Parameters that had not settled when the steps ended."""
        return tuple(name for name, when in self.since.items() if when > LATE * self.end)


def has_history(answer: Answer) -> bool:
    """Return whether the method of an answer notes how it settles."""
    return "history" in answer.result.details


def settling_of(answer: Answer) -> Settling | None:
    """Return since when each parameter stayed within a tenth of its end; None if not noted."""
    if not has_history(answer):
        return None
    details = answer.result.details
    history = np.atleast_2d(details["history"])[:, : len(answer.model.parameters)]
    key = next(key for key in STEPS if key in details)
    at = np.asarray(details[key])
    far = np.abs(history - history[-1]) > SETTLED * np.abs(history[-1])
    # Far from its end for the last time, and the step behind it.
    left = [np.flatnonzero(far[:, k]) for k in range(history.shape[1])]
    since = [at[min(int(last[-1]) + 1, len(at) - 1)] if len(last) else at[0] for last in left]
    return Settling(
        STEPS[key],
        float(at[-1]),
        {p.name: float(when) for p, when in zip(answer.model.parameters, since, strict=True)},
    )


def settling_lines(answer: Answer) -> list[str]:
    """Return since when each parameter stayed within a tenth of its end, if noted."""
    found = settling_of(answer)
    if found is None:
        return []
    error = np.asarray(answer.result.details.get("history_error_percent", ()))
    if len(error) and error[0] - error[-1] <= STILL * error[0]:
        return [
            f"  no sweep lowered the error of the original program ({error[0]:.4g} %): the answer"
            " is its start; at least squares the network stands still, start=model and start=zero"
            " (method option) let it move"
        ]
    timed = found.step == STEPS["history_s"]
    show, of = ("{:.2f}", "s of the data fitted") if timed else ("{:.0f}", "iteration")
    settled = {name: when for name, when in found.since.items() if name not in found.moving}
    since = ", ".join(f"{name} {show.format(when)}" for name, when in settled.items()) or "none"
    moving = f"; not settled: {', '.join(found.moving)}" if found.moving else ""
    lines = [
        f"  settled, within 10 % of its end, since ({of}, of {show.format(found.end)}): "
        f"{since}{moving}"
    ]
    if len(error):
        lines.append(
            f"  error of the original program {error[0]:.4g} to {error[-1]:.4g} % in"
            f" {found.end:.0f} sweeps"
        )
    return lines


def settling_document(answer: Answer) -> dict[str, Any] | None:
    """Return the same for JSON; None if a method notes nothing."""
    found = settling_of(answer)
    if found is None:
        return None
    return {
        "step": found.step,
        "end": found.end,
        "since": dict(found.since),
        "not_settled": list(found.moving),
    }


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
