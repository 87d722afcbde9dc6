"""Where a parameter of a linear model stands: in which equation, beside which signal."""

from __future__ import annotations

from collections.abc import Collection

from host.sysid.models.state_space_model import LinearModel

MAIN_GAIN = 0.5  # of a parameter's largest gain in the outputs: with less it is a guest there


def leaning_on(model: LinearModel, signals: Collection[str]) -> set[str]:
    """Return the parameters in the equation of a signal, and those that it is multiplied by.

    Parameters
    ----------
    model : LinearModel
    signals : collection of str
        States, inputs or outputs. Of an output that is no state (an accelerometer) the parameters
        are those whose largest gain is there: D_alpha of ax, Z_alpha of az.
    """
    rows = {k for k, name in enumerate(model.states) if name in signals}
    columns = {k for k, name in enumerate(model.inputs) if name in signals}
    outputs = {
        k for k, name in enumerate(model.outputs) if name in signals and name not in model.states
    }
    found = set()
    for term in model.terms:
        if (term.matrix in "AB" and term.row in rows) or (
            term.column in (rows if term.matrix in "AC" else columns)
        ):
            found.add(term.parameter)
    return found | {
        t.parameter
        for t in model.terms
        if t.matrix in "CD"
        and t.row in outputs
        and abs(t.gain) >= MAIN_GAIN * _largest(model, t.parameter)
    }


def _largest(model: LinearModel, name: str) -> float:
    return max(abs(t.gain) for t in model.terms if t.matrix in "CD" and t.parameter == name)
