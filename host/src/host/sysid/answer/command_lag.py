"""Is the lag between command and surface known? Else no derivative of a turning rate is.

A moment that comes later is less damping: where neither the data nor a file tell the lag, or the
data determine no damping with it, it and the derivatives of the equations in which the commands act
cannot be separated. On a real autopilot's records two lags 87 ms apart fit alike, each known to
9 ms, with M_q of -11 +- 18 and -301 +- 27000 1/s.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from host.sysid.linear.linear_answer import Answer

RATE = "_radps"  # ends the name of a state that a control's moment changes


def unknown_lag(answer: Answer) -> str:
    """Return why the lag of the commanded inputs is not known; empty where it is, or is none."""
    if answer.servo is None:
        return ""
    if why := answer.servo.unknown_delay:
        return why
    if not answer.servo.wide_prior:
        return ""
    result, half = answer.result, answer.result.half_width()
    for names in (_controls(answer), _dampings(answer)):
        own = {name: result.index(name) for name in names}
        significant = [name for name, k in own.items() if abs(result.estimate[k]) > half[k]]
        if own and not significant:
            return f"{', '.join(own)} may be zero"
    return ""


def lag_lookalikes(answer: Answer) -> tuple[str, ...]:
    """Return the parameters that cannot be separated from the lag, in the model's order."""
    if answer.servo is None:
        return ()
    alike = set(answer.servo.alike)
    if unknown_lag(answer):
        rows = _turned(answer)
        alike |= {t.parameter for t in answer.model.terms if t.matrix in "AB" and t.row in rows}
    return tuple(p.name for p in answer.model.parameters if p.name in alike)


def _turned(answer: Answer) -> set[int]:
    """Return the equations of rates in which a commanded input acts."""
    model, servo = answer.model, answer.servo
    return {
        t.row
        for t in model.terms
        if servo is not None
        and t.matrix == "B"
        and model.inputs[t.column] in servo.surfaces
        and model.states[t.row].endswith(RATE)
    }


def _controls(answer: Answer) -> list[str]:
    """Return the derivatives of the commanded inputs in these equations."""
    rows = _turned(answer)
    return list(
        dict.fromkeys(t.parameter for t in answer.model.terms if t.matrix == "B" and t.row in rows)
    )


def _dampings(answer: Answer) -> list[str]:
    """Return the derivatives of these equations by their own rate."""
    rows = _turned(answer)
    terms = (t for t in answer.model.terms if t.matrix == "A" and t.row == t.column)
    return list(dict.fromkeys(t.parameter for t in terms if t.row in rows))
