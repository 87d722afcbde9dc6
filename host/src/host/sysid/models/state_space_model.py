"""A linear state-space model with named signals, fixed entries and free parameters.

    x' = A x + B u + b,   y = C x + D u + c,   x(0) = x0

Every entry of A, B, C and D is a known number plus a sum of parameters times known gains. An entry
can thus be fixed, free or tied (an accelerometer equation repeats the force equation times the
speed). Biases b and c and the initial state x0 belong to one maneuver; everything else is common.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, ClassVar, TypeGuard

import numpy as np

from host.arrays import Array, IntArray
from host.errors import IdentificationError

if TYPE_CHECKING:
    from host.sysid.models.nonlinear_model import NonlinearModel

MATRICES = ("A", "B", "C", "D")
CONSTANT = "one"  # an input that is 1 at every sample: its entries are constants of all records


@dataclass(frozen=True, slots=True)
class Parameter:
    """A free parameter of the model.

    Parameters
    ----------
    name : str
        Unique name, e.g. ``M_alpha``.
    start : float
        Start of the iteration unless a cheaper method gives one; mean of the prior.
    lower, upper : float
        Bounds of the search.
    prior_sd : float
        Standard deviation of a Gaussian prior about `start`; infinite means none.
    unit : str
        Where a user states it; otherwise the names of signals tell it.
    """

    name: str
    start: float = 0.0
    lower: float = -np.inf
    upper: float = np.inf
    prior_sd: float = np.inf
    unit: str = ""


@dataclass(frozen=True, slots=True)
class Term:
    """One appearance of a parameter: `gain` times it is added to entry (row, column)."""

    matrix: str
    row: int
    column: int
    parameter: str
    gain: float = 1.0


@dataclass(frozen=True, slots=True)
class DelayGroup:
    """Outputs that lag the inputs by one common residual delay.

    Parameters
    ----------
    name : str
        Parameter name, e.g. ``delay_vanes_s``.
    outputs : tuple of str
        The outputs concerned.
    prior_sd_s : float
        Standard deviation of the prior about zero, s.
    limit_s : float
        Bound of the search, s.
    """

    name: str
    outputs: tuple[str, ...]
    prior_sd_s: float = 0.005
    limit_s: float = 0.1


@dataclass(frozen=True, slots=True)
class AccelerometerOffset:
    """An accelerometer away from its assumed place: output += gain * parameter * rate of a state.

    It is the tangential term omega' x r of the acceleration at r (EQUATIONS.md, eq. 14). A wrong
    position of 1 cm turns angular acceleration into false side force. The offset is then a
    parameter with a prior, and every derivative of the state's equation enters the output through
    it. The output should have a bias of its own, which takes the constant part.
    """

    output: str
    state: str
    parameter: str
    gain: float = 1.0


@dataclass(frozen=True, slots=True)
class EntryTable:
    """Terms as index arrays, all of shape (terms,): rows, columns, parameters, gains."""

    row: IntArray
    column: IntArray
    parameter: IntArray
    gain: Array


@dataclass(frozen=True)
class LinearModel:
    """A linear state-space model with named signals.

    Parameters
    ----------
    name : str
        What reports call it.
    states, inputs, outputs : tuple of str
        Names ending in their unit. An output with the name of a state measures it.
    A, B, C, D : Array
        Known parts; shapes (n, n), (n, m), (p, n), (p, m).
    terms : tuple of Term
        Entries in which parameters appear.
    parameters : tuple of Parameter
        Free numbers, in the order of every estimate.
    state_biases, output_biases, initial_states : tuple of str
        State equations, outputs and initial states with a free constant in each maneuver.
    delays : tuple of DelayGroup
        Residual delays, common to all maneuvers.
    hold : str
        Input between its samples: ``zoh`` (zero-order hold) or ``foh`` (first-order hold).
    accelerometer_offsets : tuple of AccelerometerOffset
        Sensor offsets that mix state rates into outputs.
    known_starts : tuple of (str, float)
        States whose initial value is known; one that is neither here, in `shared_starts` nor in
        `initial_states` starts at zero.
    shared_starts : tuple of (str, str)
        States whose initial value is a parameter, the same in all maneuvers.
    known_noise : tuple of (str, float)
        Outputs whose noise has a known standard deviation; that of others is estimated.

    Raises
    ------
    IdentificationError
        If shapes, names or indices disagree.
    """

    of_equations: ClassVar[bool] = False  # of a user, in place of constant matrices

    name: str
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    A: Array
    B: Array
    C: Array
    D: Array
    terms: tuple[Term, ...] = ()
    parameters: tuple[Parameter, ...] = ()
    state_biases: tuple[str, ...] = ()
    output_biases: tuple[str, ...] = ()
    initial_states: tuple[str, ...] = ()
    delays: tuple[DelayGroup, ...] = field(default=())
    hold: str = "zoh"
    accelerometer_offsets: tuple[AccelerometerOffset, ...] = ()
    known_starts: tuple[tuple[str, float], ...] = ()
    shared_starts: tuple[tuple[str, str], ...] = ()
    known_noise: tuple[tuple[str, float], ...] = ()

    def __post_init__(self) -> None:
        n, m, p = len(self.states), len(self.inputs), len(self.outputs)
        shapes = {"A": (n, n), "B": (n, m), "C": (p, n), "D": (p, m)}
        for label, shape in shapes.items():
            array = np.array(getattr(self, label), dtype=np.float64)
            if array.shape != shape:
                raise IdentificationError(
                    f"model {self.name}: {label} is {array.shape}, expected {shape}"
                )
            object.__setattr__(self, label, array)
        names = tuple(parameter.name for parameter in self.parameters)
        for group in (self.states, self.inputs, self.outputs, names):
            if len(set(group)) < len(group):
                twice = sorted({x for x in group if list(group).count(x) > 1})
                raise IdentificationError(f"model {self.name}: {', '.join(twice)} named twice")
        self._check_terms(names, shapes)
        self._check_references(names)
        if self.hold not in ("zoh", "foh"):
            raise IdentificationError(f"model {self.name}: hold '{self.hold}', use zoh or foh")

    def _check_terms(self, names: Sequence[str], shapes: Mapping[str, tuple[int, int]]) -> None:
        """Raise where an entry has no parameter or no place, or a parameter enters nowhere."""
        for term in self.terms:
            if term.matrix not in shapes or term.parameter not in names:
                raise IdentificationError(
                    f"model {self.name}: entry {term.matrix}[{term.row},{term.column}] refers to"
                    f" '{term.parameter}', which is no parameter of this model"
                )
            rows, columns = shapes[term.matrix]
            if not (0 <= term.row < rows and 0 <= term.column < columns):
                raise IdentificationError(
                    f"model {self.name}: {term.matrix} has no entry [{term.row},{term.column}]"
                )
        unused = sorted(
            set(names)
            - {term.parameter for term in self.terms}
            - {lever.parameter for lever in self.accelerometer_offsets}
            - {parameter for _, parameter in self.shared_starts}
            - self.names_beyond_matrices()
        )
        if unused:
            raise IdentificationError(f"model {self.name}: {', '.join(unused)} enters no matrix")

    def _check_references(self, names: tuple[str, ...]) -> None:
        """Raise where a bias, start, noise, lever or delay is of no signal of the model."""
        started, shared = zip(*self.shared_starts, strict=True) if self.shared_starts else ((), ())
        levers = self.accelerometer_offsets
        for what, chosen, known in (
            ("state bias", self.state_biases, self.states),
            ("initial state", self.initial_states, self.states),
            ("initial state", tuple(x for x, _ in self.known_starts), self.states),
            ("initial state", started, self.states),
            ("initial state", shared, names),
            ("noise", tuple(x for x, _ in self.known_noise), self.outputs),
            ("output bias", self.output_biases, self.outputs),
            ("lever", tuple(x.output for x in levers), self.outputs),
            ("lever", tuple(x.state for x in levers), self.states),
            ("lever", tuple(x.parameter for x in levers), names),
            ("delay", tuple(y for d in self.delays for y in d.outputs), self.delayed_signals()),
        ):
            unknown = [x for x in chosen if x not in known]
            if unknown:
                raise IdentificationError(
                    f"model {self.name}: {what} on {', '.join(unknown)}, known are"
                    f" {', '.join(known)}"
                )

    @property
    def parameter_names(self) -> tuple[str, ...]:
        """Names of the parameters common to all maneuvers, delays last."""
        return tuple(p.name for p in self.parameters) + tuple(d.name for d in self.delays)

    def names_beyond_matrices(self) -> set[str]:
        """Return parameters that act elsewhere than in a matrix: none of a linear model."""
        return set()

    def stated_units(self) -> dict[str, str]:
        """Return the units of parameters of which the user states them."""
        return {p.name: p.unit for p in self.parameters if p.unit}

    def signals(self) -> tuple[str, ...]:
        """Return the inputs and outputs that columns give: all but the constant."""
        return tuple(s for s in (*self.inputs, *self.outputs) if s != CONSTANT)

    def controls(self) -> tuple[str, ...]:
        """Return the inputs that a pilot moves."""
        return self.inputs

    def smooth_inputs(self) -> tuple[str, ...]:
        """Return the inputs that move smoothly between samples: none, they are held or on lines."""
        return ()

    def delayed_signals(self) -> tuple[str, ...]:
        """Return the signals that may be delayed."""
        return self.outputs

    def local_names(self, maneuver: int) -> tuple[str, ...]:
        """Return the names of the constants that belong to one maneuver (counted from 1)."""
        return (
            *(f"bias_rate.{s}@{maneuver}" for s in self.state_biases),
            *(f"bias.{y}@{maneuver}" for y in self.output_biases),
            *(f"initial.{s}@{maneuver}" for s in self.initial_states),
        )

    @property
    def start(self) -> Array:
        """Start values of the parameters (without delays)."""
        return np.array([p.start for p in self.parameters], dtype=np.float64)

    def with_start(self, values: Sequence[float] | Array) -> LinearModel:
        """Return the same model with other start values."""
        if len(values) != len(self.parameters):
            raise IdentificationError(
                f"model {self.name}: {len(values)} start values, {len(self.parameters)} parameters"
            )
        fresh = tuple(
            replace(p, start=float(v)) for p, v in zip(self.parameters, values, strict=True)
        )
        return replace(self, parameters=fresh)

    def entries(self, matrices: str) -> EntryTable:
        """Return the terms of two neighbouring matrices, ``AB`` or ``CD``, as one wide matrix."""
        index = {p.name: i for i, p in enumerate(self.parameters)}
        chosen = [t for t in self.terms if t.matrix in matrices]
        offset = {matrices[0]: 0, matrices[1]: len(self.states)}
        return EntryTable(
            row=np.array([t.row for t in chosen], dtype=np.int64),
            column=np.array([t.column + offset[t.matrix] for t in chosen], dtype=np.int64),
            parameter=np.array([index[t.parameter] for t in chosen], dtype=np.int64),
            gain=np.array([t.gain for t in chosen], dtype=np.float64),
        )

    def matrices(self, theta: Array) -> tuple[Array, Array, Array, Array]:
        """Return A, B, C, D at parameter values `theta` (only the common ones are read)."""
        result = {label: np.array(getattr(self, label)) for label in MATRICES}
        index = {p.name: i for i, p in enumerate(self.parameters)}
        for term in self.terms:
            result[term.matrix][term.row, term.column] += term.gain * theta[index[term.parameter]]
        for lever in self.accelerometer_offsets:
            row, state = self.outputs.index(lever.output), self.states.index(lever.state)
            arm = lever.gain * float(theta[index[lever.parameter]])
            result["C"][row] += arm * result["A"][state]
            result["D"][row] += arm * result["B"][state]
        return result["A"], result["B"], result["C"], result["D"]

    def gradient(self, matrix: str, parameter: str) -> Array:
        """Return the derivative of one matrix by one parameter."""
        derivative: Array = np.zeros(np.shape(getattr(self, matrix)))
        for term in self.terms:
            if term.matrix == matrix and term.parameter == parameter:
                derivative[term.row, term.column] += term.gain
        return derivative

    def measured_states(self) -> IntArray:
        """Return, for each state, the output that measures it.

        Raises
        ------
        IdentificationError
            If a state has no output of its own name.
        """
        absent = [s for s in self.states if s not in self.outputs]
        if absent:
            raise IdentificationError(
                f"model {self.name}: {', '.join(absent)} not among the outputs; this method needs"
                " every state measured, output error does not"
            )
        return np.array([self.outputs.index(s) for s in self.states], dtype=np.int64)


def has_equations(model: LinearModel) -> TypeGuard[NonlinearModel]:
    """Return whether a model is made of a user's equations; the code for them is not imported."""
    return model.of_equations
