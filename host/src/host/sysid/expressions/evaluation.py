"""The value of an expression at given values of its variables, without code being made."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from host.sysid.expressions.expression_graph import ExpressionError, ExpressionGraph, Node

Tables = Mapping[str, tuple[Sequence[float], Sequence[float]]]
# As machine code reckons: infinite and not a number where Python would raise.
_FUNCTIONS: dict[str, Callable[..., Any]] = {
    "+": np.add, "-": np.subtract, "*": np.multiply, "/": np.divide, "negative": np.negative,
    "power": np.power, "sin": np.sin, "cos": np.cos, "tan": np.tan, "asin": np.arcsin,
    "acos": np.arccos, "atan": np.arctan, "atan2": np.arctan2, "sqrt": np.sqrt, "exp": np.exp,
    "log": np.log, "abs": np.abs,
    "min": lambda a, b: a if a <= b else b,
    "max": lambda a, b: a if b <= a else b,
    "if_le": lambda a, b, c, d: c if a <= b else d,
}  # fmt: skip


def evaluate(
    graph: ExpressionGraph, target: int, values: Mapping[str, float], tables: Tables | None = None
) -> float:
    """Return the value of a node.

    Parameters
    ----------
    graph : ExpressionGraph
    target : int
        Node.
    values : mapping
        Values of the variables.
    tables : mapping, optional
        Points of x and y of each table.

    Raises
    ------
    ExpressionError
        If it has no finite value there; the line names the part that has none.
    """
    found: dict[int, float] = {}
    lost = None
    with np.errstate(all="ignore"):
        for node in graph.reachable([target]):
            here = graph.nodes[node]
            given = [found[a] for a in here.arguments]
            found[node] = _value(here, given, values, tables or {})
            if lost is None and not np.isfinite(found[node]):
                lost = _said(here, given)
    if not np.isfinite(found[target]):
        raise ExpressionError(f"has no finite value at the first sample: {lost}")
    return found[target]


def _value(
    node: Node, given: Sequence[float], values: Mapping[str, float], tables: Tables
) -> float:
    if node.operation == "number":
        return node.value
    if node.operation == "variable":
        return values[node.name]
    if node.operation == "table":
        return float(np.interp(given[0], *tables[node.name]))
    return float(_FUNCTIONS[node.operation](*given))


def _said(node: Node, given: Sequence[float]) -> str:
    """Return an operation as words."""
    numbers = [f"{x:.4g}" for x in given]
    if node.operation == "variable":
        return f"{node.name} is none"
    if node.operation in ("+", "-", "*", "/"):
        return f" {node.operation} ".join(numbers)
    if node.operation == "power":
        return f"({numbers[0]})^{numbers[1]}"
    return f"{node.operation}({', '.join(numbers)})"
