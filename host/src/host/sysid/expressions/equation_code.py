"""Equations of a model as code: rates and outputs, and their slopes by all that they depend on."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import FunctionType, ModuleType
from typing import TYPE_CHECKING, Any

import numpy as np

from host.compiled import Kernel, generated_source
from host.sysid.expressions.derivative import derivatives
from host.sysid.expressions.emission import HEADER, function_text

if TYPE_CHECKING:
    from host.arrays import Array
    from host.sysid.expressions.expression_graph import ExpressionGraph

GIVEN = ("x", "u", "p", "c", "t")  # states, inputs, parameters, constants, tables
FUNCTIONS = ("rates", "rate_slopes", "readings", "reading_slopes")


def of_equations(function: Callable[..., Any]) -> Callable[..., Any]:
    """Mark what calls `FUNCTIONS` by their names for other templates (`EquationCode.loop`)."""
    function.__dict__["of_equations"] = True
    return function


@dataclass(frozen=True)
class EquationNodes:
    """Equations as nodes of a graph, and what they may depend on.

    Attributes
    ----------
    graph : ExpressionGraph
    rates, outputs : tuple of int
        Nodes.
    states, inputs, parameters, constants : tuple of str
        Variables of the graph.
    tables : mapping
        Points of x and y of each.
    """

    graph: ExpressionGraph
    rates: tuple[int, ...]
    outputs: tuple[int, ...]
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    parameters: tuple[str, ...]
    constants: tuple[str, ...]
    tables: Mapping[str, tuple[Sequence[float], Sequence[float]]]

    @property
    def table_values(self) -> Array:
        """All tables end to end: x, y of each."""
        parts = [np.concatenate([x, y]) for x, y in self.tables.values()]
        return np.concatenate([*parts, np.zeros(1)]).astype(np.float64)

    def text(self) -> str:
        """Return a module with the functions of `FUNCTIONS`.

        `rates` and `readings` fill an array; the others fill its slopes by states, inputs and
        parameters as well. Slopes that are zero everywhere are not written.
        """
        place = {n: f"x[{k}]" for k, n in enumerate(self.states)}
        place |= {n: f"u[{k}]" for k, n in enumerate(self.inputs)}
        place |= {n: f"p[{k}]" for k, n in enumerate(self.parameters)}
        place |= {n: f"c[{k}]" for k, n in enumerate(self.constants)}
        tables, first = {}, 0
        for name, (x, _) in self.tables.items():
            tables[name] = (first, len(x))
            first += 2 * len(x)
        parts = [HEADER]
        for plain, slopes, letter, nodes in (
            ("rates", "rate_slopes", "f", self.rates),
            ("readings", "reading_slopes", "y", self.outputs),
        ):
            values = [(f"{letter}[{k}]", node) for k, node in enumerate(nodes)]
            arguments = (*GIVEN, letter)
            parts.append(function_text(plain, self.graph, values, place, tables, arguments))
            by = (f"{letter}x", f"{letter}u", f"{letter}p")
            for array, names in zip(by, (self.states, self.inputs, self.parameters), strict=True):
                values += self._slopes(array, nodes, names)
            parts.append(
                function_text(slopes, self.graph, values, place, tables, (*arguments, *by))
            )
        return "\n\n".join(parts)

    def _slopes(
        self, array: str, nodes: Sequence[int], names: Sequence[str]
    ) -> list[tuple[str, int]]:
        """Return where the slopes of nodes by variables go, but for those that are zero."""
        found = []
        for column, name in enumerate(names):
            slopes = derivatives(self.graph, nodes, self.graph.variable(name))
            found += [
                (f"{array}[{row}, {column}]", slope)
                for row, slope in enumerate(slopes)
                if self.graph.value_of(slope) != 0.0
            ]
        return found


class EquationCode:
    """Functions of equations, and loops that call them, as kernels.

    Parameters
    ----------
    text : str
        From `EquationNodes.text`.
    """

    def __init__(self, text: str) -> None:
        self.path: Path = generated_source(text, "equations")
        module = ModuleType(self.path.stem)
        sys.modules[module.__name__] = module  # kept code asks for the module of its function
        places = vars(module)
        exec(compile(text, str(self.path), "exec"), places)
        self.functions: dict[str, Callable[..., None]] = {name: places[name] for name in FUNCTIONS}
        self._loops: dict[str, Kernel[..., Any]] = {}
        self._parts = {
            name: Kernel(f, reordered=False, part=True) for name, f in self.functions.items()
        }
        self._marked: dict[str, Kernel[..., Any]] = {}  # one each: else each caller compiles it

    def loop(self, template: Callable[..., Any]) -> Kernel[..., Any]:
        """Return a kernel from a function that calls those of `FUNCTIONS` by their names.

        It is the template's code with these equations in the place of those names, and is kept
        with them: several models may use one template. So is a part that `of_equations` marks.
        """
        if template.__name__ not in self._loops:
            self._loops[template.__name__] = self._bound(template)
        return self._loops[template.__name__]

    def _bound(self, template: Callable[..., Any], *, part: bool = False) -> Kernel[..., Any]:
        code = template.__code__.replace(co_filename=str(self.path))
        known = template.__globals__
        marked = [name for name in code.co_names if hasattr(known.get(name), "of_equations")]
        places = {**known, **self._parts, **{name: self._part(known[name]) for name in marked}}
        bound = FunctionType(code, places, template.__name__)
        bound.__module__ = self.path.stem
        bound.__qualname__ = template.__name__
        return Kernel(bound, reordered=False, part=part)

    def _part(self, function: Callable[..., Any]) -> Kernel[..., Any]:
        if function.__name__ not in self._marked:
            self._marked[function.__name__] = self._bound(function, part=True)
        return self._marked[function.__name__]
