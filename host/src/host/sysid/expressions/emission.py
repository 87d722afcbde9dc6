"""Python text of expressions: straight lines of scalars, which numba and Python both run.

Names of a user never reach the text: a variable becomes a place of an array, a number its value.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from host.sysid.expressions.expression_graph import ExpressionGraph, Node

HEADER = """\
# Generated from a user's model by host.sysid.expressions; kept for its compiled code.
from math import acos, asin, atan, atan2, cos, exp, log, pow, sin, sqrt, tan

from host.sysid.expressions.table_lookup import table_slope, table_value
"""


def function_text(
    name: str,
    graph: ExpressionGraph,
    assignments: Sequence[tuple[str, int]],
    variables: Mapping[str, str],
    tables: Mapping[str, tuple[int, int]],
    arguments: Sequence[str],
) -> str:
    """Return the text of a function that assigns expressions to places of arrays.

    Parameters
    ----------
    name : str
    graph : ExpressionGraph
    assignments : sequence of (str, int)
        Place such as ``f[0]``, and node.
    variables : mapping
        Place of each variable, such as ``x[2]``.
    tables : mapping
        First place and number of points of each table in the array ``t``.
    arguments : sequence of str
        Arguments of the function.
    """
    lines = [f"def {name}({', '.join(arguments)}):"]
    said: dict[int, str] = {}
    for node in graph.reachable([n for _, n in assignments]):
        here = graph.nodes[node]
        if here.operation == "number":
            said[node] = f"({here.value!r})" if here.value < 0.0 else repr(here.value)
        elif here.operation == "variable":
            said[node] = variables[here.name]
        else:
            said[node] = f"v{node}"
            lines.append(f"    v{node} = {_operation(here, said, graph, tables)}")
    lines += [f"    {place} = {said[node]}" for place, node in assignments]
    if len(lines) == 1:
        lines.append("    pass")
    return "\n".join(lines) + "\n"


def _operation(
    node: Node,
    said: Mapping[int, str],
    graph: ExpressionGraph,
    tables: Mapping[str, tuple[int, int]],
) -> str:
    parts = [said[a] for a in node.arguments]
    if node.operation in ("+", "-", "*", "/"):
        return f"{parts[0]} {node.operation} {parts[1]}"
    if node.operation == "negative":
        return f"-{parts[0]}"
    if node.operation == "power":
        exponent = graph.value_of(node.arguments[1])
        if exponent is not None and exponent.is_integer():
            return (
                f"{parts[0]} ** {int(exponent)}"
                if exponent > 0
                else (f"1.0 / {parts[0]} ** {int(-exponent)}")
            )
        return f"pow({parts[0]}, {parts[1]})"
    if node.operation == "if_le":
        return f"{parts[2]} if {parts[0]} <= {parts[1]} else {parts[3]}"
    if node.operation == "min":
        return f"{parts[0]} if {parts[0]} <= {parts[1]} else {parts[1]}"
    if node.operation == "max":
        return f"{parts[0]} if {parts[1]} <= {parts[0]} else {parts[1]}"
    if node.operation in ("table", "table_slope"):
        first, count = tables[node.name]
        function = "table_value" if node.operation == "table" else "table_slope"
        return f"{function}(t, {first}, {count}, {parts[0]})"
    return f"{node.operation}({', '.join(parts)})"
