"""A model of the user's own equations, with its tangent.

    x' = f(x, u, p) + b,   y = g(x, u, p) + c,   x(0) = x0

Estimators that simulate take the equations. What needs matrices (modes, units, what a parameter's
size is judged against, the signatures of wrong models) takes the tangent: the linear model of the
same signals, parameters and constants to first order about a mean condition, A(p) included.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import ClassVar

import numpy as np

from host.arrays import Array
from host.errors import IdentificationError
from host.sysid.expressions.equation_code import EquationCode, EquationNodes
from host.sysid.expressions.evaluation import evaluate
from host.sysid.expressions.expression_graph import ExpressionError, ExpressionGraph
from host.sysid.expressions.grammar import NAME, parse_expression
from host.sysid.models.state_space_model import LinearModel, Parameter, Term

SLOPE_STEP = 1e-6  # of a parameter's size: central differences of exact slopes
Named = tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class Equations:
    """Equations as a user wrote them: texts of expressions and the numbers that they name.

    Attributes
    ----------
    definitions : tuple of (str, str)
        Names for parts of expressions, each of those before it.
    rates, outputs : tuple of (str, str)
        Expression of each state's rate and of each output.
    constants : tuple of (str, float)
    tables : tuple of (str, tuple, tuple)
        Points of x and y.
    starts : tuple of (str, str)
        First guess of initial states, from what was measured at the first sample.
    parameters : tuple of str
        All that the expressions may name, in the order of `NonlinearModel.all_parameters`.
    inputs : tuple of str
        Controls, and measured columns behind them.
    controls : int
        How many of the inputs are controls: their maneuvers are fitted.
    """

    definitions: Named
    rates: Named
    outputs: Named
    constants: tuple[tuple[str, float], ...]
    tables: tuple[tuple[str, tuple[float, ...], tuple[float, ...]], ...]
    starts: Named
    parameters: tuple[str, ...]
    inputs: tuple[str, ...]
    controls: int

    @property
    def states(self) -> tuple[str, ...]:
        """Names of the states."""
        return tuple(name for name, _ in self.rates)

    def nodes(self) -> EquationNodes:
        """Return the equations as a graph.

        Raises
        ------
        ExpressionError
            If a text is no expression; the line names it and the column.
        """
        return _nodes(self)

    def text(self) -> str:
        """Return the equations and their slopes as a module.

        Raises
        ------
        ExpressionError
            If they are too large.
        """
        return _text(self)

    @property
    def code(self) -> EquationCode:
        """The equations as code, made when first asked for."""
        return _code(self)

    @property
    def constant_values(self) -> Array:
        """Numbers of the constants."""
        return np.array([*(value for _, value in self.constants), 0.0])

    @property
    def table_values(self) -> Array:
        """Numbers of the tables."""
        return self.nodes().table_values

    def first_states(self, measured: Mapping[str, float]) -> dict[str, float]:
        """Return the first guess of the initial states that have one.

        Parameters
        ----------
        measured : mapping
            Inputs and outputs at the first sample.
        """
        graph, nodes = _starts(self)
        known = dict(self.constants) | dict(measured)
        found = {}
        for state, node in nodes.items():
            try:
                found[state] = evaluate(graph, node, known)
            except ExpressionError as error:
                raise ExpressionError(f"starts.{state}: {error}") from None
        return found

    def check_starts(self) -> None:
        """Read the first guesses of initial states.

        Raises
        ------
        ExpressionError
            If one is no expression of what is measured.
        """
        _starts(self)

    def check_first_sample(
        self, x: Sequence[float], u: Sequence[float], p: Sequence[float]
    ) -> None:
        """Try rates and outputs at one sample, without code being made.

        Parameters
        ----------
        x, u, p : sequence of float
            States, inputs and parameters.

        Raises
        ------
        ExpressionError
            If one has no finite value there; the line names it and the part of it that has none.
        """
        nodes = self.nodes()
        values = dict(self.constants)
        for names, numbers in ((self.states, x), (self.inputs, u), (self.parameters, p)):
            values |= dict(zip(names, numbers, strict=True))
        for kind, named, found in (
            ("rates", self.rates, nodes.rates),
            ("outputs", self.outputs, nodes.outputs),
        ):
            for (name, _), node in zip(named, found, strict=True):
                try:
                    evaluate(nodes.graph, node, values, nodes.tables)
                except ExpressionError as error:
                    raise ExpressionError(f"{kind}.{name} {error}") from None


@lru_cache(maxsize=16)
def _nodes(equations: Equations) -> EquationNodes:
    e, graph = equations, ExpressionGraph()
    tables = {name: (x, y) for name, x, y in e.tables}
    constants = tuple(name for name, _ in e.constants)
    names = {
        name: graph.variable(name) for name in (*e.states, *e.inputs, *e.parameters, *constants)
    }
    for kind, named in (("definitions", e.definitions), ("rates", e.rates), ("outputs", e.outputs)):
        for number, (name, text) in enumerate(named):
            try:
                if kind == "definitions":
                    _refuse_later(text, name, [later for later, _ in named[number:]])
                node = parse_expression(text, graph, names, tables)
            except ExpressionError as error:
                raise ExpressionError(f"{kind}.{name}: {error}") from None
            if kind == "definitions":
                names[name] = node
            else:
                names[f"{kind}.{name}"] = node  # no name of a user has a point in it
    return EquationNodes(
        graph=graph,
        rates=tuple(names[f"rates.{name}"] for name in e.states),
        outputs=tuple(names[f"outputs.{name}"] for name, _ in e.outputs),
        states=e.states,
        inputs=e.inputs,
        parameters=e.parameters,
        constants=constants,
        tables=tables,
    )


def _refuse_later(text: str, name: str, later: Sequence[str]) -> None:
    """Refuse a definition that is made of itself, or of one below it."""
    for other in NAME.findall(text):
        if other in later:
            what = "itself" if other == name else f"{other}, which stands below it"
            raise ExpressionError(f"made of {what}; a definition knows those above it")


@lru_cache(maxsize=16)
def _starts(equations: Equations) -> tuple[ExpressionGraph, dict[str, int]]:
    """Return the first guess of the initial states that have one, as nodes of a graph."""
    graph = ExpressionGraph()
    constants = (name for name, _ in equations.constants)
    outputs = (name for name, _ in equations.outputs)
    known = {name: graph.variable(name) for name in (*constants, *equations.inputs, *outputs)}
    found = {}
    for state, text in equations.starts:
        try:
            found[state] = parse_expression(text, graph, known)
        except ExpressionError as error:
            raise ExpressionError(
                f"starts.{state}: {error} (a start knows constants, and inputs, columns and"
                " outputs as they were measured)"
            ) from None
    return graph, found


@lru_cache(maxsize=16)
def _code(equations: Equations) -> EquationCode:
    return EquationCode(equations.text())


@lru_cache(maxsize=16)
def _text(equations: Equations) -> str:
    return equations.nodes().text()


@dataclass(frozen=True)
class NonlinearModel(LinearModel):
    """Equations of a user, with their tangent as the linear model.

    Parameters
    ----------
    equations : Equations
    own_parameters : tuple of Parameter
        Parameters that each record has of its own.
    process_noise : tuple of str
        States whose equation process noise drives, for filters.
    frozen : tuple of (str, float)
        Parameters that are known by now.
    smooth : bool
        Controls move smoothly between samples, which lines with the mean of that motion stand for.
    """

    of_equations: ClassVar[bool] = True

    equations: Equations | None = None
    own_parameters: tuple[Parameter, ...] = ()
    process_noise: tuple[str, ...] = ()
    frozen: tuple[tuple[str, float], ...] = ()
    smooth: bool = False

    @property
    def source(self) -> Equations:
        """The equations."""
        assert self.equations is not None
        return self.equations

    def local_names(self, maneuver: int) -> tuple[str, ...]:
        """Return the names of one maneuver's constants, its own parameters last."""
        own = (f"{p.name}@{maneuver}" for p in self.own_parameters)
        return (*LinearModel.local_names(self, maneuver), *own)

    def names_beyond_matrices(self) -> set[str]:
        """Return parameters that act through the equations."""
        return {p.name for p in self.parameters}

    def stated_units(self) -> dict[str, str]:
        """Return the units of parameters of which the user states them."""
        own = {p.name: p.unit for p in self.own_parameters if p.unit}
        return LinearModel.stated_units(self) | own

    def controls(self) -> tuple[str, ...]:
        """Return the inputs that a pilot moves; measured columns follow the air as outputs do."""
        return self.inputs[: self.source.controls]

    def smooth_inputs(self) -> tuple[str, ...]:
        """Return the inputs that move smoothly between samples: controls, if the model says so."""
        return self.controls() if self.smooth else ()

    def delayed_signals(self) -> tuple[str, ...]:
        """Return the signals that may be delayed: inputs too."""
        return (*self.outputs, *self.inputs)

    def frozen_at(self, theta: Array) -> NonlinearModel:
        """Return the model with its common parameters known."""
        common = zip(self.parameters, theta, strict=False)
        delays = zip(self.delays, theta[len(self.parameters) :], strict=False)
        A, B, C, D = self.matrices(theta)
        value = {p.name: float(v) for p, v in common}
        value |= {d.name: float(v) for d, v in delays}
        return replace(
            self,
            A=A,
            B=B,
            C=C,
            D=D,
            terms=(),
            parameters=(),
            frozen=(*self.frozen, *value.items()),
            known_starts=(*self.known_starts, *((s, value[p]) for s, p in self.shared_starts)),
            shared_starts=(),
        )

    def tangent_at(self, x: Array, u: Array, theta: Array, own: Array) -> NonlinearModel:
        """Return the model with the tangent at a condition.

        Parameters
        ----------
        x, u : Array
            Mean states and inputs.
        theta : Array
            Common parameters.
        own : Array
            Mean of each record's own.
        """
        count = len(self.parameters)
        base = self._slopes(x, u, theta[:count], own)
        matrices = {label: m.copy() for label, m in zip("ABCD", base, strict=True)}
        terms = []
        for k, parameter in enumerate(self.parameters):
            width = SLOPE_STEP * max(abs(float(theta[k])), 1e-3)
            up, down = theta[:count].copy(), theta[:count].copy()
            up[k] += width
            down[k] -= width
            both = self._slopes(x, u, up, own), self._slopes(x, u, down, own)
            for label, high, low, here in zip("ABCD", *both, base, strict=True):
                slope = (high - low) / (2.0 * width)
                floor = SLOPE_STEP * max(float(np.max(np.abs(here), initial=0.0)), 1e-12)
                for i, j in np.argwhere(np.abs(slope) * max(abs(theta[k]), 1e-3) > floor):
                    gain = float(slope[i, j])
                    terms.append(Term(label, int(i), int(j), parameter.name, gain))
                    matrices[label][i, j] -= gain * theta[k]
        return replace(
            self,
            A=matrices["A"],
            B=matrices["B"],
            C=matrices["C"],
            D=matrices["D"],
            terms=tuple(terms),
        )

    def parameter_vector(self, theta: Array, own: Array) -> Array:
        """Return the values of `Equations.parameters`, one more than there are."""
        value = dict(self.frozen)
        value |= {p.name: float(v) for p, v in zip(self.parameters, theta, strict=False)}
        value |= {p.name: float(v) for p, v in zip(self.own_parameters, own, strict=True)}
        return np.array([*(value[name] for name in self.source.parameters), 0.0])

    def _slopes(self, x: Array, u: Array, theta: Array, own: Array) -> tuple[Array, ...]:
        e = self.source
        n, m, p, q = len(x), len(u), len(self.outputs), len(e.parameters)
        given = (x, u, self.parameter_vector(theta, own), e.constant_values, e.table_values)
        f, y = np.zeros(n), np.zeros(p)
        A, B, C, D = (np.zeros(shape) for shape in ((n, n), (n, m), (p, n), (p, m)))
        try:
            e.code.functions["rate_slopes"](*given, f, A, B, np.zeros((n, q)))
            e.code.functions["reading_slopes"](*given, y, C, D, np.zeros((p, q)))
        except (ArithmeticError, ValueError):
            raise IdentificationError(
                f"model {self.name} has no finite slope at its mean condition"
            ) from None
        if not all(np.isfinite(part).all() for part in (A, B, C, D)):
            raise IdentificationError(
                f"model {self.name} has no finite slope at its mean condition"
            )
        return A, B, C, D


def no_tangent(equations: Equations) -> dict[str, Array]:
    """Return matrices of a tangent that is not known yet, by name: it depends on the records."""
    n, m, p = len(equations.rates), len(equations.inputs), len(equations.outputs)
    shapes = {"A": (n, n), "B": (n, m), "C": (p, n), "D": (p, m)}
    return {label: np.zeros(shape) for label, shape in shapes.items()}
