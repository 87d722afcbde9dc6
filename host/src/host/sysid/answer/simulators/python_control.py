"""A Python file for python-control: the linear models of an answer as state-space systems."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from host.arrays import Array
from host.sysid.flight.linear_answer import Answer


def control_text(answers: Sequence[Answer]) -> str:
    """Return the file: one ``control.ss`` for each model, with names of states and signals."""
    lines = [
        "# Linear models by host identify, for python-control: departures from the trim, SI and",
        "# radians, x' = A x + B u, y = C x + D u. Elevator trailing edge down, rudder left,",
        "# aileron (left - right) / 2 positive. Good for small departures only; biases and initial",
        "# states of the flight's maneuvers are not in them.",
        "import control",
    ]
    for answer in answers:
        model, trim = answer.model, answer.trim
        common = len(model.parameters)
        theta = answer.result.estimate[:common]
        lines += ["", f"# {answer.template}, {answer.method}; trim {trim.airspeed_mps:.2f} m/s"]
        lines += [
            f"#   {p.name} {value:.5g} +- {half:.2g} (95 %)"
            for p, value, half in zip(
                model.parameters, theta, answer.result.half_width()[:common], strict=True
            )
        ]
        if model.delays:
            lines.append(
                f"#   delays of {', '.join(d.name for d in model.delays)} are not in the system"
            )
        name = answer.template.replace("-", "_")
        matrices = ", ".join(_matrix(m) for m in model.matrices(answer.result.estimate))
        lines += [
            f"{name} = control.ss(",
            f"    {matrices},",
            f"    states={list(model.states)!r}, inputs={list(model.inputs)!r},",
            f"    outputs={list(model.outputs)!r}, name={name!r},",
            ")",
        ]
    return "\n".join(lines) + "\n"


def _matrix(m: Array) -> str:
    rows = ["[" + ", ".join(f"{v:.12g}" for v in row) + "]" for row in np.atleast_2d(m)]
    return "[" + ", ".join(rows) + "]"
