"""Where a parameter of a linear model stands: in which equation, times which signal."""

from __future__ import annotations

from collections.abc import Collection
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from host.sysid.models.state_space_model import LinearModel, Term

MAIN_GAIN = 0.5  # of a parameter's largest gain in the outputs: with less it is a guest there


def leaning_on(model: LinearModel, signals: Collection[str]) -> set[str]:
    """Return the parameters in the equation of a signal, and those that it is multiplied by.

    Parameters
    ----------
    model : LinearModel
    signals : collection of str
        States, inputs or outputs. The parameters of an output that is no state (an accelerometer)
        are those whose largest gain is there: D_alpha of ax, Z_alpha of az.
    """
    found = set()
    for term in model.terms:
        into, out_of = _ends(model, term)
        own = term.matrix in "AB" or (into not in model.states and _is_main(model, term))
        if out_of in signals or (into in signals and own):
            found.add(term.parameter)
    return found


def _ends(model: LinearModel, term: Term) -> tuple[str, str]:
    """Return the state or output that a term makes, and the state or input that it multiplies."""
    rows = model.states if term.matrix in "AB" else model.outputs
    columns = model.states if term.matrix in "AC" else model.inputs
    return rows[term.row], columns[term.column]


def _is_main(model: LinearModel, term: Term) -> bool:
    """Return whether an output has a good part of the largest gain of a parameter."""
    return abs(term.gain) >= MAIN_GAIN * _largest(model, term.parameter)


def _largest(model: LinearModel, name: str) -> float:
    return max(abs(t.gain) for t in model.terms if t.matrix in "CD" and t.parameter == name)
