"""The value of an expression at given values of its variables, without code being made."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from host.sysid.expressions.expression_graph import FUNCTIONS, ExpressionError, ExpressionGraph

_OPERATORS: dict[str, Callable[..., float]] = {
    "+": lambda a, b: a + b,
    "-": lambda a, b: a - b,
    "*": lambda a, b: a * b,
    "/": lambda a, b: a / b,
    "negative": lambda a: -a,
    "power": lambda a, b: a**b,
    "if_le": lambda a, b, c, d: c if a <= b else d,
}


def evaluate(graph: ExpressionGraph, target: int, values: Mapping[str, float]) -> float:
    """Return the value of a node of an expression without tables.

    Raises
    ------
    ExpressionError
        If it has no finite value there.
    """
    found: dict[int, float] = {}
    for node in graph.reachable([target]):
        here = graph.nodes[node]
        if here.operation == "number":
            found[node] = here.value
        elif here.operation == "variable":
            found[node] = values[here.name]
        else:
            function = _OPERATORS.get(here.operation) or FUNCTIONS.get(here.operation)
            if function is None:
                raise ExpressionError("a table may not stand here")
            try:
                found[node] = float(function(*(found[a] for a in here.arguments)))
            except (ArithmeticError, ValueError, TypeError):
                raise ExpressionError("has no finite value at the first sample") from None
    return found[target]
