"""Held positions -> each channel's line, or the sentence that says why there is none."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from host.bench_calibration.bench_plan import AIR_KGPM3, Subject
from host.bench_calibration.channel_doubts import doubt, doubt_before_fit
from host.bench_calibration.held_position import Held
from host.bench_calibration.line_fit import LineFit, fit_line


@dataclass(frozen=True, slots=True)
class Calibrated:
    """One channel after its repeats.

    Attributes
    ----------
    fit : LineFit or None
        None where no line could be drawn.
    doubt : str or None
        What is wrong with it; such a line is not written.
    short : str
        What the plan wants and the points lack; empty if they are complete.
    """

    channel: str
    fit: LineFit | None
    doubt: str | None
    short: str = ""


def calibrated_lines(
    subject: Subject, held: Sequence[Held], *, density_kgpm3: float = AIR_KGPM3
) -> list[Calibrated]:
    """Return one line for each channel that was moved, in the order of the subject.

    Raises
    ------
    UsageError
        If a channel has too few positions.
    """
    found = []
    for channel in subject.channels:
        points = [p for p in held if p.moved == channel]
        if not points:
            continue
        early = doubt_before_fit(subject, channel, points)
        if early:
            found.append(Calibrated(channel, None, early))
            continue
        # A pressure that was held to see a leak is no point of the line.
        fitted_points = [p for p in points if not (channel in p.change and p.duration_s >= _LEAK_S)]
        fit = fit_line(subject, channel, fitted_points, density_kgpm3=density_kgpm3)
        found.append(
            Calibrated(
                channel, fit, doubt(subject, fit, points), _short(subject, fitted_points, fit)
            )
        )
    return found


_LEAK_S = 45.0  # the procedure holds 60 s


def _short(subject: Subject, points: Sequence[Held], fit: LineFit) -> str:
    """Return in words that repeats or a direction are missing; empty if nothing is."""
    repeats = len({p.repeat for p in points})
    lacking = []
    if repeats < subject.repeats:
        lacking.append(
            f"{repeats} repeat{'s' if repeats > 1 else ''} of {subject.repeats}: the placing of the"
            " tool is by its file's word"
        )
    if len(subject.positions) > 3 and not {1, -1} <= set(fit.direction.tolist()):
        lacking.append("one direction only: hysteresis is not known")
    return "; ".join(lacking) if not math.isnan(fit.zero_sigma) else ""
