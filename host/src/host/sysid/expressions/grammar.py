"""The grammar of a user's expressions: read character by character, nothing is ever executed.

    sum     = product { ("+" | "-") product }
    product = signed { ("*" | "/") signed }
    signed  = { "+" | "-" } power
    power   = atom [ ("^" | "**") signed ]          # so -x^2 is -(x^2), and 2^-1 is 0.5
    atom    = number | name | name "(" sum { "," sum } ")" | "(" sum ")"

A name is a variable, ``pi``, a function of `FUNCTIONS`, or a table of one argument.
"""

from __future__ import annotations

import difflib
import math
import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass

from host.sysid.expressions.expression_graph import (
    ARGUMENTS,
    FUNCTIONS,
    ExpressionError,
    ExpressionGraph,
)

LONGEST = 2000  # characters
DEEPEST = 40  # brackets and signs within each other
MOST_SHOWN = 24  # characters of what was found
NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
RESERVED = frozenset({*FUNCTIONS, "pi"})
_TOKEN = re.compile(
    r"(?P<number>(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)"
    r"|(?P<name>[A-Za-z_][A-Za-z0-9_]*)|(?P<sign>\*\*|[-+*/^(),])"
)


@dataclass(frozen=True, slots=True)
class _Token:
    kind: str  # number, name, sign or end
    text: str
    column: int  # from 1


def parse_expression(
    text: str, graph: ExpressionGraph, names: Mapping[str, int], tables: Collection[str] = ()
) -> int:
    """Return the node of an expression.

    Parameters
    ----------
    text : str
        ASCII, at most `LONGEST` characters.
    graph : ExpressionGraph
        Is extended.
    names : mapping
        Node of each name that the expression may use.
    tables : collection of str
        Names that take one argument in brackets.

    Raises
    ------
    ExpressionError
        In one line, with the column.
    """
    if len(text) > LONGEST:
        raise ExpressionError(f"{len(text)} characters, expected up to {LONGEST}")
    reader = _Reader(text, graph, names, tables)
    node = reader.sum(0)
    if reader.token.kind != "end":
        raise reader.unexpected("an operator")
    return node


class _Reader:
    """One token ahead."""

    def __init__(
        self, text: str, graph: ExpressionGraph, names: Mapping[str, int], tables: Collection[str]
    ) -> None:
        self.text, self.graph, self.names, self.tables = text, graph, names, tables
        self.place = 0
        self.token = self._next()

    def sum(self, depth: int) -> int:
        node = self.product(depth)
        while self.token.text in ("+", "-"):
            sign = self._take()
            right = self.product(depth)
            join = self.graph.add if sign.text == "+" else self.graph.subtract
            node = join(node, right)
        return node

    def product(self, depth: int) -> int:
        node = self.signed(depth)
        while self.token.text in ("*", "/"):
            sign = self._take()
            right = self.signed(depth)
            join = self.graph.multiply if sign.text == "*" else self.graph.divide
            node = self._located(lambda join=join, a=node, b=right: join(a, b), sign)
        return node

    def signed(self, depth: int) -> int:
        self._refuse_depth(depth)
        if self.token.text in ("+", "-"):
            sign = self._take()
            inner = self.signed(depth + 1)
            return self.graph.negative(inner) if sign.text == "-" else inner
        return self.power(depth)

    def power(self, depth: int) -> int:
        node = self.atom(depth)
        if self.token.text in ("^", "**"):
            sign = self._take()
            exponent = self.signed(depth + 1)
            return self._located(lambda: self.graph.power(node, exponent), sign)
        return node

    def atom(self, depth: int) -> int:
        self._refuse_depth(depth)
        token = self.token
        if token.kind == "number":
            self._take()
            return self._located(lambda: self.graph.number(float(token.text)), token)
        if token.kind == "name":
            return self._named(self._take(), depth)
        if token.text == "(":
            self._take()
            node = self.sum(depth + 1)
            self._expect(")")
            return node
        raise self.unexpected("a number, a name or (")

    def unexpected(self, wanted: str) -> ExpressionError:
        """Return the error of a token that may not stand here."""
        found = "the end" if self.token.kind == "end" else _shown(self.token.text)
        return self._error(self.token, f"found {found}, expected {wanted}")

    def _named(self, token: _Token, depth: int) -> int:
        name = token.text
        if self.token.text != "(":
            if name in self.names:
                return self.names[name]
            if name == "pi":
                return self.graph.number(math.pi)
            raise self._unknown(token, called=False)
        if name not in FUNCTIONS and name not in self.tables:
            raise self._unknown(token, called=True)
        self._take()
        arguments = [self.sum(depth + 1)]
        while self.token.text == ",":
            self._take()
            arguments.append(self.sum(depth + 1))
        self._expect(")")
        least, most = ARGUMENTS.get(name, (1, 1))
        if not least <= len(arguments) <= most:
            wanted = f"{least}" if least == most else f"{least} to {most}"
            raise self._error(token, f"{name} takes {wanted} arguments, found {len(arguments)}")
        if name in self.tables:
            return self.graph.table(name, arguments[0])
        return self._located(lambda: self.graph.call(name, tuple(arguments)), token)

    def _unknown(self, token: _Token, *, called: bool) -> ExpressionError:
        known = {*FUNCTIONS, *self.tables} if called else {*self.names, "pi"}
        what = "function or table" if called else "name"
        near = difflib.get_close_matches(token.text, sorted(known), 1)
        hint = f"; like {near[0]}?" if near else ""
        if not called and (token.text in FUNCTIONS or token.text in self.tables):
            hint = "; it takes its argument in brackets"
        return self._error(token, f"{_shown(token.text)} is no {what} of this model{hint}")

    def _located(self, make: object, token: _Token) -> int:
        assert callable(make)
        try:
            return int(make())
        except ExpressionError as error:
            raise self._error(token, str(error)) from None

    def _expect(self, text: str) -> None:
        if self.token.text != text:
            raise self.unexpected(f"{text} or an operator")
        self._take()

    def _refuse_depth(self, depth: int) -> None:
        if depth > DEEPEST:
            raise self._error(self.token, f"nested deeper than {DEEPEST}")

    def _take(self) -> _Token:
        taken, self.token = self.token, self._next()
        return taken

    def _next(self) -> _Token:
        while self.place < len(self.text) and self.text[self.place] in " \t\r\n":
            self.place += 1
        column = self.place + 1
        if self.place == len(self.text):
            return _Token("end", "", column)
        found = _TOKEN.match(self.text, self.place)
        if found is None:
            bad = _Token("sign", self.text[self.place], column)
            raise self._error(bad, f"{_shown(bad.text)} is no part of an expression")
        self.place = found.end()
        assert found.lastgroup is not None
        return _Token(found.lastgroup, found.group(), column)

    def _error(self, token: _Token, text: str) -> ExpressionError:
        return ExpressionError(f"column {token.column}: {text}")


def _shown(text: str) -> str:
    return repr(text if len(text) <= MOST_SHOWN else f"{text[:MOST_SHOWN]}...")
