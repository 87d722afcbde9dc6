"""Exact slopes of expressions, as expressions.

At a kink of `min`, `max`, `abs` or a table the slope is that of one side, the right one of a table.
"""

from __future__ import annotations

from collections.abc import Sequence

from host.sysid.expressions.expression_graph import ExpressionGraph


def derivatives(graph: ExpressionGraph, targets: Sequence[int], variable: int) -> list[int]:
    """Return the derivatives of some nodes by one variable; the number zero where there is none.

    Parameters
    ----------
    graph : ExpressionGraph
        Is extended.
    targets : sequence of int
        Nodes.
    variable : int
        Node of the variable.

    Raises
    ------
    ExpressionError
        If the graph becomes too large.
    """
    zero = graph.number(0.0)
    slope = {variable: graph.number(1.0)}
    for node in graph.reachable(targets):
        if node != variable and any(
            slope.get(a, zero) != zero for a in graph.nodes[node].arguments
        ):
            slope[node] = _derivative(graph, node, slope, zero)
    return [slope.get(t, zero) for t in targets]


def _derivative(graph: ExpressionGraph, node: int, slope: dict[int, int], zero: int) -> int:
    """Return the derivative of one node from those of its arguments."""
    g, here = graph, graph.nodes[node]
    operation, arguments = here.operation, here.arguments
    d = [slope.get(a, zero) for a in arguments]
    a, b = arguments[0], arguments[-1]
    if operation == "+":
        return g.add(d[0], d[1])
    if operation == "-":
        return g.subtract(d[0], d[1])
    if operation == "negative":
        return g.negative(d[0])
    if operation == "*":
        return g.add(g.multiply(d[0], b), g.multiply(a, d[1]))
    if operation == "/":
        return g.subtract(g.divide(d[0], b), g.divide(g.multiply(node, d[1]), b))
    if operation == "power":
        return _power(g, node, d, zero)
    if operation == "min":
        return g.where_le(a, b, d[0], d[1])
    if operation == "max":
        return g.where_le(b, a, d[0], d[1])
    if operation == "if_le":
        return g.where_le(a, arguments[1], d[2], d[3])
    if operation == "atan2":  # of (y, x): (x dy - y dx) / (x^2 + y^2)
        square = g.add(g.multiply(a, a), g.multiply(b, b))
        return g.divide(g.subtract(g.multiply(b, d[0]), g.multiply(a, d[1])), square)
    if operation == "abs":
        return g.where_le(zero, a, d[0], g.negative(d[0]))
    if operation == "table":
        return g.multiply(g.table(here.name, a, slope=True), d[0])
    if operation == "table_slope":
        return zero
    return g.multiply(_of_one(g, operation, a, node), d[0])


def _power(g: ExpressionGraph, node: int, d: Sequence[int], zero: int) -> int:
    a, b = g.nodes[node].arguments
    by_base = zero
    if d[0] != zero:
        less = g.power(a, g.subtract(b, g.number(1.0)))
        by_base = g.multiply(g.multiply(b, less), d[0])
    if d[1] == zero:
        return by_base
    return g.add(by_base, g.multiply(g.multiply(node, g.call("log", (a,))), d[1]))


def _of_one(g: ExpressionGraph, name: str, a: int, node: int) -> int:
    """Return the slope of a function of one argument."""
    one = g.number(1.0)
    if name == "sin":
        return g.call("cos", (a,))
    if name == "cos":
        return g.negative(g.call("sin", (a,)))
    if name == "tan":
        return g.add(one, g.multiply(node, node))
    if name == "atan":
        return g.divide(one, g.add(one, g.multiply(a, a)))
    if name == "sqrt":
        return g.divide(g.number(0.5), node)
    if name == "exp":
        return node
    if name == "log":
        return g.divide(one, a)
    root = g.call("sqrt", (g.subtract(one, g.multiply(a, a)),))  # asin, acos
    return g.divide(one if name == "asin" else g.number(-1.0), root)
