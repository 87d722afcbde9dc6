"""Since when the parameters of an iterative or recursive estimate stayed near their end."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from host.sysid.models.fit_result import FitResult

SETTLED = 0.1  # of the end
LATE = 0.85  # of all steps: what moves straight on is within a tenth of its end from 0.9 on
# What a step is, by what a method notes of it.
STEPS = {"history_step": "iteration", "history_s": "t_s"}


@dataclass(frozen=True, slots=True)
class Settling:
    """Step from which each parameter stayed within a tenth of its end.

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


def settling_of(result: FitResult) -> Settling | None:
    """Return since when each parameter stayed within a tenth of its end; None if not noted."""
    details = result.details
    if "history" not in details:
        return None
    parameters = result.model.parameters
    history = np.atleast_2d(details["history"])[:, : len(parameters)]
    key = next(key for key in STEPS if key in details)
    at = np.asarray(details[key])
    far = np.abs(history - history[-1]) > SETTLED * np.abs(history[-1])
    # Far from its end for the last time, and the step behind it.
    left = [np.flatnonzero(far[:, k]) for k in range(history.shape[1])]
    since = [at[min(int(last[-1]) + 1, len(at) - 1)] if len(last) else at[0] for last in left]
    return Settling(
        STEPS[key],
        float(at[-1]),
        {p.name: float(when) for p, when in zip(parameters, since, strict=True)},
    )


def settling_lines(result: FitResult) -> list[str]:
    """Return since when each parameter stayed within a tenth of its end, if noted."""
    found = settling_of(result)
    if found is None:
        return []
    timed = found.step == STEPS["history_s"]
    show, of = ("{:.2f}", "s of the data fitted") if timed else ("{:.0f}", "iteration")
    settled = {name: when for name, when in found.since.items() if name not in found.moving}
    since = ", ".join(f"{name} {show.format(when)}" for name, when in settled.items()) or "none"
    moving = f"; not settled: {', '.join(found.moving)}" if found.moving else ""
    return [
        f"  settled, within 10 % of its end, since ({of}, of {show.format(found.end)}): "
        f"{since}{moving}"
    ]
