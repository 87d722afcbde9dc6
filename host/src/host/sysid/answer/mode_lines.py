"""Modes of an answer in lines, and which consist of a state that is not predicted."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from host.sysid.answer.linear_rules import unpredicted_states

if TYPE_CHECKING:
    from host.sysid.linear.linear_answer import Answer
    from host.sysid.models.modal_analysis import Mode

PARTICIPATION = 0.25  # in a mode: a state with more makes it what it is


def mode_lines(modes: Sequence[Mode]) -> list[str]:
    """Return a line for each mode."""
    return [_mode_line(mode) for mode in modes]


def linear_mode_lines(answer: Answer) -> list[str]:
    """Return the modes, and of which a state that is not predicted takes a good part."""
    failing = unpredicted_states(answer)
    lines = []
    for mode in answer.modes:
        in_it = _participating(answer, mode, list(failing))
        mark = f"  not to be relied on: {', '.join(failing[s] for s in in_it)}" if in_it else ""
        lines.append(_mode_line(mode) + mark)
    return lines


def _participating(answer: Answer, mode: Mode, states: Sequence[str]) -> list[str]:
    """Return the states with a large share in a mode, among those given."""
    values, right = np.linalg.eig(answer.result.matrices()[0])
    left = np.linalg.inv(right)
    k = int(np.argmin(np.abs(values - mode.eigenvalue)))
    part = np.abs(left[k] * right[:, k])
    shares = dict(zip(answer.model.states, part / part.sum(), strict=True))
    return [state for state in states if shares[state] > PARTICIPATION]


def _mode_line(mode: Mode) -> str:
    half = mode.frequency_half_width_radps
    if not mode.oscillatory:
        return f"  {mode.name}: {mode.eigenvalue.real:.3f} +- {_width(half)} 1/s"
    return (
        f"  {mode.name}: {mode.frequency_radps:.3f} +- {_width(half)} rad/s,"
        f" damping {mode.damping:.3f} +- {_width(mode.damping_half_width)}"
    )


def _width(half: float) -> str:
    """Return a half-width with three decimals, or as many as it takes to be none of zero."""
    return f"{half:.3f}" if half >= 0.001 else f"{half:.1g}"
