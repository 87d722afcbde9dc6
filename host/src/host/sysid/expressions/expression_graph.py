"""A graph of expressions in which equal parts stand once.

Every node names its arguments by number, and arguments come first: the order of the nodes is an
order of evaluation. Numbers are folded and zeros and ones removed while it grows, so that a slope
that is zero is known to be zero.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass

from host.errors import IdentificationError

MOST_NODES = 12_000  # six degrees of freedom with all slopes: about 2000
LARGEST_EXPONENT = 100.0
FUNCTIONS: dict[str, Callable[..., float]] = {
    "sin": math.sin, "cos": math.cos, "tan": math.tan, "asin": math.asin, "acos": math.acos,
    "atan": math.atan, "atan2": math.atan2, "sqrt": math.sqrt, "exp": math.exp, "log": math.log,
    "abs": abs, "min": min, "max": max,
}  # fmt: skip
ARGUMENTS = {"atan2": (2, 2), "min": (2, 9), "max": (2, 9)}  # least and most; of the others one


class ExpressionError(IdentificationError):
    """An expression that is none; the line says where and why."""


@dataclass(frozen=True, slots=True)
class Node:
    """One operation.

    Attributes
    ----------
    operation : str
        ``number``, ``variable``, an operator, a function, ``table``, ``table_slope``, or ``if_le``:
        of (a, b, c, d) the third where a <= b, else the fourth.
    arguments : tuple of int
        Nodes.
    value : float
        Value of a number.
    name : str
        Name of a variable or table.
    """

    operation: str
    arguments: tuple[int, ...] = ()
    value: float = 0.0
    name: str = ""


class ExpressionGraph:
    """Nodes, each of which exists once."""

    def __init__(self) -> None:
        self.nodes: list[Node] = []
        self._place: dict[Node, int] = {}

    def number(self, value: float) -> int:
        """Return the node of a number.

        Raises
        ------
        ExpressionError
            If it is not finite.
        """
        if not math.isfinite(value):
            raise ExpressionError("a number of it is not finite")
        return self._node(Node("number", value=float(value) + 0.0))

    def variable(self, name: str) -> int:
        """Return the node of a named value."""
        return self._node(Node("variable", name=name))

    def table(self, name: str, x: int, *, slope: bool = False) -> int:
        """Return a table of an expression, or its slope."""
        return self._node(Node("table_slope" if slope else "table", (x,), name=name))

    def value_of(self, node: int) -> float | None:
        """Return the value of a node that is a number."""
        found = self.nodes[node]
        return found.value if found.operation == "number" else None

    def add(self, a: int, b: int) -> int:
        """Return a + b."""
        if self.value_of(a) == 0.0:
            return b
        if self.value_of(b) == 0.0:
            return a
        return self._folded("+", (a, b), lambda x, y: x + y)

    def subtract(self, a: int, b: int) -> int:
        """Return a - b."""
        if self.value_of(b) == 0.0:
            return a
        if self.value_of(a) == 0.0:
            return self.negative(b)
        return self.number(0.0) if a == b else self._folded("-", (a, b), lambda x, y: x - y)

    def negative(self, a: int) -> int:
        """Return -a."""
        inner = self.nodes[a]
        if inner.operation == "negative":
            return inner.arguments[0]
        return self._folded("negative", (a,), lambda x: -x)

    def multiply(self, a: int, b: int) -> int:
        """Return a b; zero times anything is zero."""
        for one, other in ((a, b), (b, a)):
            known = self.value_of(one)
            if known == 0.0:
                return one
            if known == 1.0:
                return other
            if known == -1.0:
                return self.negative(other)
        return self._folded("*", (min(a, b), max(a, b)), lambda x, y: x * y)

    def divide(self, a: int, b: int) -> int:
        """Return a / b.

        Raises
        ------
        ExpressionError
            If b is the number zero.
        """
        if self.value_of(b) == 0.0:
            raise ExpressionError("division by zero")
        if self.value_of(b) == 1.0 or self.value_of(a) == 0.0:
            return a
        return self._folded("/", (a, b), lambda x, y: x / y)

    def power(self, a: int, b: int) -> int:
        """Return a to the power b.

        Raises
        ------
        ExpressionError
            If b is a number beyond `LARGEST_EXPONENT`.
        """
        known = self.value_of(b)
        if known is not None and abs(known) > LARGEST_EXPONENT:
            raise ExpressionError(f"exponent {known:g}, expected up to {LARGEST_EXPONENT:g}")
        if known == 0.0:
            return self.number(1.0)
        if known == 1.0:
            return a
        if known == 2.0:
            return self.multiply(a, a)
        if known == -1.0:
            return self.divide(self.number(1.0), a)
        if known == 0.5:
            return self.call("sqrt", (a,))
        return self._folded("power", (a, b), math.pow)

    def call(self, name: str, arguments: tuple[int, ...]) -> int:
        """Return a function of `FUNCTIONS`; min and max of many are made of those of two."""
        if name in ("min", "max") and len(arguments) > 2:
            return self.call(name, (self.call(name, arguments[:-1]), arguments[-1]))
        return self._folded(name, arguments, FUNCTIONS[name])

    def where_le(self, a: int, b: int, then: int, otherwise: int) -> int:
        """Return `then` where a <= b, else `otherwise`."""
        if then == otherwise:
            return then
        known = self.value_of(a), self.value_of(b)
        if known[0] is not None and known[1] is not None:
            return then if known[0] <= known[1] else otherwise
        return self._node(Node("if_le", (a, b, then, otherwise)))

    def reachable(self, targets: Iterable[int]) -> list[int]:
        """Return all nodes that some are made of, in order of evaluation."""
        found: set[int] = set()
        left = list(targets)
        while left:
            node = left.pop()
            if node not in found:
                found.add(node)
                left += self.nodes[node].arguments
        return sorted(found)

    def _folded(
        self, operation: str, arguments: tuple[int, ...], function: Callable[..., float]
    ) -> int:
        """Return the node, or of numbers the number."""
        values = [self.value_of(a) for a in arguments]
        if any(v is None for v in values):
            return self._node(Node(operation, arguments))
        try:
            return self.number(function(*values))
        except (ArithmeticError, ValueError):
            raise ExpressionError("a number of it is not finite") from None

    def _node(self, node: Node) -> int:
        place = self._place.get(node)
        if place is None:
            if len(self.nodes) >= MOST_NODES:
                raise ExpressionError(f"more than {MOST_NODES} operations, slopes included")
            place = self._place[node] = len(self.nodes)
            self.nodes.append(node)
        return place
