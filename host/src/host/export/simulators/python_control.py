"""A Python file for python-control: linear models as state-space systems."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from host.arrays import Array


@dataclass(frozen=True, slots=True)
class StateSpace:
    """A linear model about a trim.

    Attributes
    ----------
    name, method : str
    airspeed_mps : float
        Airspeed at trim.
    parameters : sequence of tuple
        Name, value and 95 % half-width of each.
    delayed : tuple of str
        Signals with a delay, which no system here has.
    matrices : tuple of array
        A, B, C, D.
    states, inputs, outputs : tuple of str
    """

    name: str
    method: str
    airspeed_mps: float
    parameters: Sequence[tuple[str, float, float]]
    delayed: tuple[str, ...]
    matrices: tuple[Array, ...]
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]


def control_text(systems: Sequence[StateSpace]) -> str:
    """Return the file: one ``control.ss`` for each model, with names of states and signals."""
    lines = [
        "# Linear models by host identify, for python-control: departures from the trim, SI and",
        "# radians, x' = A x + B u, y = C x + D u. Elevator trailing edge down, rudder left,",
        "# aileron (left - right) / 2 positive. Good for small departures only; biases and initial",
        "# states of the flight's maneuvers are not in them.",
        "import control",
    ]
    for s in systems:
        lines += ["", f"# {s.name}, {s.method}; trim {s.airspeed_mps:.2f} m/s"]
        lines += [
            f"#   {name} {value:.5g} +- {half:.2g} (95 %)" for name, value, half in s.parameters
        ]
        if s.delayed:
            lines.append(f"#   delays of {', '.join(s.delayed)} are not in the system")
        name = s.name.replace("-", "_")
        lines += [
            f"{name} = control.ss(",
            f"    {', '.join(_matrix(m) for m in s.matrices)},",
            f"    states={list(s.states)!r}, inputs={list(s.inputs)!r},",
            f"    outputs={list(s.outputs)!r}, name={name!r},",
            ")",
        ]
    return "\n".join(lines) + "\n"


def _matrix(m: Array) -> str:
    rows = ["[" + ", ".join(f"{v:.12g}" for v in row) + "]" for row in np.atleast_2d(m)]
    return "[" + ", ".join(rows) + "]"
