"""Modes of an answer in Hz and seconds, each with a word: may it be relied on."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from host.aircraft.mode_names import DUTCH_ROLL, PHUGOID, ROLL, SHORT_PERIOD, SPIRAL
from host.sysid.answer.marks import Judged, mark_of, share_text
from host.sysid.answer.parameter_words import NOT, word_of

if TYPE_CHECKING:
    from host.sysid.answer.marks import Verdict
    from host.sysid.coefficients.coefficient_estimator import CoefficientAnswer
    from host.sysid.linear.linear_answer import Answer
    from host.sysid.models.modal_analysis import Mode

PARTICIPATION = 0.25  # in a mode: a state with more makes it what it is
# Coefficients that a mode consists of (Etkin & Reid, Dynamics of Flight, ch. 6).
MADE_OF = {
    SHORT_PERIOD: ("CL_alpha", "Cm_alpha", "Cm_q"), PHUGOID: ("CD_0",), ROLL: ("Cl_p",),
    DUTCH_ROLL: ("Cn_beta", "Cn_r"), SPIRAL: ("Cl_beta", "Cl_r", "Cn_beta", "Cn_r"),
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class JudgedMode:
    """A mode, and whether it may be relied on.

    Attributes
    ----------
    mode : Mode
    word : str
        ``good``, ``fair`` or ``not``.
    reason : str
        Why not, where it is not the width of its interval.
    """

    mode: Mode
    word: str
    reason: str = ""

    @property
    def text(self) -> str:
        """The mode in Hz and seconds, its intervals in per cent, its word."""
        m = self.mode
        own = _share(m.frequency_half_width_radps, m.frequency_radps)
        if not m.oscillatory:
            after = _real_time(m)
            return f"{m.name}: {after} +- {own}, {self.word}"
        hertz = m.frequency_radps / (2.0 * math.pi)
        damping = f"damping {m.damping:.2g} +- {_share(m.damping_half_width, m.damping)}"
        return f"{m.name}: {hertz:.3g} Hz ({1.0 / hertz:.2g} s) +- {own}, {damping}, {self.word}"


def linear_modes(answer: Answer) -> list[JudgedMode]:
    """Return the modes of a linear model; not one of which a state that is not predicted takes a
    good part."""
    from host.sysid.answer.linear_rules import unpredicted_states  # of a linear model alone

    failing = unpredicted_states(answer)
    return [
        _judged(mode, [failing[s] for s in _participating(answer, mode, list(failing))])
        for mode in answer.modes
    ]


def coefficient_modes(answer: CoefficientAnswer, verdict: Verdict) -> list[JudgedMode]:
    """Return the modes that coefficients make; not one whose coefficients are doubted whatever
    their interval."""
    return [_judged(mode, _doubts(mode.name, verdict.reasons)) for mode in answer.modes]


def mode_lines(modes: Sequence[JudgedMode]) -> list[str]:
    """Return a line for each mode, with the reason against it."""
    return [f"  {one.text}{_because(one)}" for one in modes]


def _because(one: JudgedMode) -> str:
    return f": {one.reason}" if one.reason else ""


def _judged(mode: Mode, reasons: Sequence[str]) -> JudgedMode:
    if reasons:
        return JudgedMode(mode, NOT, ", ".join(dict.fromkeys(reasons)))
    shares = [mode.frequency_half_width_radps / max(mode.frequency_radps, 1e-300)]
    if mode.oscillatory:
        shares.append(mode.damping_half_width / max(abs(mode.damping), 1e-300))
    return JudgedMode(mode, word_of(mark_of(Judged(mode.name, max(shares)))))


def _doubts(name: str, reasons: Mapping[str, Sequence[str]]) -> list[str]:
    """Return what is said against the coefficients of a mode besides their width."""
    return [why for part in MADE_OF.get(name, ()) for why in reasons.get(part, ())[1:]]


def _participating(answer: Answer, mode: Mode, states: Sequence[str]) -> list[str]:
    """Return the states with a large share in a mode, among those given."""
    values, right = np.linalg.eig(answer.result.matrices()[0])
    left = np.linalg.inv(right)
    k = int(np.argmin(np.abs(values - mode.eigenvalue)))
    part = np.abs(left[k] * right[:, k])
    shares = dict(zip(answer.model.states, part / part.sum(), strict=True))
    return [state for state in states if shares[state] > PARTICIPATION]


def _real_time(mode: Mode) -> str:
    """Return in which time a real mode halves or doubles."""
    rate = mode.eigenvalue.real
    if rate == 0.0:
        return "stays"
    return f"{'doubles' if rate > 0.0 else 'halves'} in {math.log(2.0) / abs(rate):.2g} s"


def _share(half_width: float, value: float) -> str:
    return share_text(half_width / max(abs(value), 1e-300))
