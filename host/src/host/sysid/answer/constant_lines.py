"""Constants of each maneuver in words: biases of equations and outputs, initial states."""

from __future__ import annotations

from typing import TYPE_CHECKING

from host.people_units import people_name
from host.sysid.models.model_constants import known_constants
from host.sysid.models.parameter_units import parameter_unit

if TYPE_CHECKING:
    from host.sysid.linear.linear_answer import Answer

IN_A_LINE = 4  # maneuvers
# Half-width over value from which a constant only trades with another: without the bank angle the
# initial one and the bias of sideslip are the same motion.
UNDETERMINED_RATIO = 1e3


def constant_lines(answer: Answer) -> list[str]:
    """Return every constant with its 95 % half-width, maneuver by maneuver; known ones last."""
    result, half = answer.result, answer.result.half_width()
    found: dict[str, tuple[str, list[str]]] = {}
    for k, name in enumerate(result.names):
        constant, at, _ = name.partition("@")
        if at:
            value = float(result.estimate[k])
            determined = half[k] < UNDETERMINED_RATIO * max(abs(value), 1e-3)
            shown, factor = people_name(constant)
            words = (
                f"{factor * value:.4g} +- {factor * half[k]:.2g}" if determined else "not estimated"
            )
            found.setdefault(constant, (shown, []))[1].append(words)
    lines = []
    if found:
        lines.append(
            "  constants of each maneuver (bias_rate of a state's equation, bias of an output,"
            " initial state)"
        )
    for constant, (shown, values) in found.items():
        unit = parameter_unit(answer.model, f"{constant}@1")
        unit = unit.replace("1", "deg", 1) if shown != constant else unit
        for first in range(0, len(values), IN_A_LINE):
            label = f"{shown} {unit}".rstrip() if first == 0 else ""
            row = "".join(f"{x:>22s}" for x in values[first : first + IN_A_LINE])
            lines.append(f"    {label:30s}{row}")
    known = [f"{name} {value:g}" for name, value in known_constants(answer.model).items()]
    return [*lines, f"  known: {', '.join(known)}"] if known else lines
