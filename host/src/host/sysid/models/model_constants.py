"""Constants of a user's model: free in each record, free and shared by all, or known.

```toml
initial_states = { alpha_rad = "own", q_radps = 0.0 }    # free in each record; known
state_biases = { alpha_rad = "own", q_radps = "b_q" }    # b_q: one parameter for all records
output_biases = { az_mps2 = -0.08 }
noise = { q_radps = 0.004 }                              # known standard deviation
```

A list of names frees each in every record. A bias that is not a record's own is an entry of the
input `one`, which is 1 at every sample: known numbers and shared parameters are then entries of B
and D like any other.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from host.arrays import Array
from host.errors import IdentificationError
from host.files.quantities import Quantity
from host.files.user_text import shown
from host.sysid.models.state_space_model import CONSTANT, LinearModel, Term

OWN = "own"
_NAME = re.compile(r"[A-Za-z_]\w*")
_CONSTANT = Quantity("", -1e6, 1e6, "a pressure altitude in m, and more")
_DEVIATION = Quantity("", 0.0, 1e6, "no noise is larger than its signal", above=True)


@dataclass(frozen=True, slots=True)
class ModelConstants:
    """One kind of constant: names free in each record, known values, parameters of all records."""

    own: tuple[str, ...]
    known: tuple[tuple[str, float], ...] = ()
    shared: tuple[tuple[str, str], ...] = ()


def read_constants(value: object, signals: Sequence[str], where: str) -> ModelConstants:
    """Return the constants of one kind from a list of names, or a table.

    Parameters
    ----------
    value : object
        From the document.
    signals : sequence of str
        Those that may have such a constant.
    where : str
        Begins an error message.

    Raises
    ------
    IdentificationError
        If it is neither, or names a signal that the model lacks.
    """
    if isinstance(value, list) and all(isinstance(name, str) for name in value):
        return ModelConstants(tuple(value))
    if not isinstance(value, dict):
        raise IdentificationError(
            f'{where} must be a list of signal names, or a table: a signal = "own" (free in each'
            " record), a number (known), or a parameter's name (the same in all records)"
        )
    _only(value, signals, where)
    own: list[str] = []
    known: list[tuple[str, float]] = []
    shared: list[tuple[str, str]] = []
    for name, what in value.items():
        if what == OWN:
            own.append(name)
        elif isinstance(what, str) and _NAME.fullmatch(what):
            shared.append((name, what))
        elif isinstance(what, str):
            raise IdentificationError(
                f'{where}: {name} = {shown(what)}, expected "own", a number or a parameter\'s name'
            )
        else:
            number = _CONSTANT.check(f"{where}: {name}", what, IdentificationError)
            known.append((name, number))
    return ModelConstants(tuple(own), tuple(known), tuple(shared))


def read_noise(value: object, outputs: Sequence[str], where: str) -> tuple[tuple[str, float], ...]:
    """Return known standard deviations of the noise of outputs.

    Raises
    ------
    IdentificationError
        If it is no table of outputs and positive numbers.
    """
    if not isinstance(value, dict):
        raise IdentificationError(f"{where} must be a table: an output = its standard deviation")
    _only(value, outputs, where)
    return tuple(
        (name, _DEVIATION.check(f"{where}: {name}", sd, IdentificationError))
        for name, sd in value.items()
    )


@dataclass(frozen=True, slots=True)
class Inputs:
    """Inputs of a model with their matrices B (n, m) and D (p, m), and the terms of both."""

    names: tuple[str, ...]
    B: Array
    D: Array
    terms: tuple[Term, ...]


def with_constant_input(
    inputs: Inputs,
    states: Sequence[str],
    outputs: Sequence[str],
    state_biases: ModelConstants,
    output_biases: ModelConstants,
) -> Inputs:
    """Return the inputs with known and shared biases as entries of the input `one`."""
    kinds = ((state_biases, "B", states), (output_biases, "D", outputs))
    if not any(kind.known or kind.shared for kind, _, _ in kinds):
        return inputs
    if CONSTANT in inputs.names:
        names, matrices = inputs.names, {"B": inputs.B.copy(), "D": inputs.D.copy()}
    else:
        names = (*inputs.names, CONSTANT)
        matrices = {
            label: np.hstack([matrix, np.zeros((len(matrix), 1))])
            for label, matrix in (("B", inputs.B), ("D", inputs.D))
        }
    column, terms = names.index(CONSTANT), list(inputs.terms)
    for kind, label, signals in kinds:
        for name, value in kind.known:
            matrices[label][signals.index(name), column] += value
        terms += [Term(label, signals.index(name), column, by) for name, by in kind.shared]
    return Inputs(names, matrices["B"], matrices["D"], tuple(terms))


def known_constants(model: LinearModel) -> dict[str, float]:
    """Return every constant that the model states as a number, by the name of a free one.

    ``bias_rate`` of a state's equation, ``bias`` of an output, ``initial`` state, ``noise`` of an
    output.
    """
    found: dict[str, float] = {}
    if CONSTANT in model.inputs:
        column = model.inputs.index(CONSTANT)
        for kind, label, names in (("bias_rate", "B", model.states), ("bias", "D", model.outputs)):
            values = getattr(model, label)[:, column]
            found |= {
                f"{kind}.{name}": float(v)
                for name, v in zip(names, values, strict=True)
                if v != 0.0
            }
    found |= {f"initial.{state}": value for state, value in model.known_starts}
    return found | {f"noise.{output}": sd for output, sd in model.known_noise}


def _only(value: Mapping[str, object], signals: Sequence[str], where: str) -> None:
    strangers = sorted(set(value) - set(signals))
    if strangers:
        raise IdentificationError(
            f"{where}: no signal {', '.join(strangers)}; there are {', '.join(signals)}"
        )
